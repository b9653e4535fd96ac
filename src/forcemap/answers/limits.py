"""Limits of body areas, and the speed that the standard's contact model allows: what `limits` answers."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator

from forcemap.answers.answer import AllSaid, Answer, Figure, of
from forcemap.limits.body_areas import PASCALS

Pressure = Annotated[float | None, BeforeValidator(lambda pressure: None if pressure is None else pressure / PASCALS)]


class ContactModelAnswer(Answer):
    """Speeds that the contact model allows: a formula, confirmed by no measurement."""

    assumptions: list[str]
    robot_mass_kg: float
    body: str
    body_mass_kg: Figure
    stiffness_N_per_m: float
    quasi_static_speed_mps: float
    quasi_static_governed_by: str
    transient_speed_mps: float
    transient_governed_by: str


class LimitAnswer(Answer):
    """Limits of a body area or region; null where the standard permits no contact."""

    name: str
    areas: list[str]
    permitted: bool
    tabulated_quasi_static_N: float = of("tabulated_quasi_static")
    quasi_static_N: float | None
    transient_N: float | None
    quasi_static_N_per_cm2: Pressure
    transient_N_per_cm2: Pressure
    spring_N_per_m: Figure = of("stiffness")
    contact_model: ContactModelAnswer | None


class LimitsAnswer(Answer):
    """Limits of body areas, and the table they are of."""

    edition: str
    source: str
    version: str
    sha256: str
    doubts: AllSaid
    limits: list[LimitAnswer]
