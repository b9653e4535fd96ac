"""What the contact model expects where the contact is another: what `estimate` answers."""

from __future__ import annotations

from forcemap.answers.answer import AllSaid, Answer, Figure, of


class EstimateAnswer(Answer):
    """A reading on a fixed device, what is other, and the force the model expects; nothing of it was measured."""

    estimate: str
    simulated: bool
    warnings: AllSaid
    force_N: float
    force_source: str
    device_spring_N_per_m: float
    speed_mps: Figure
    robot_mass_kg: tuple[float, float] = of("robot_mass")
    robot_mass_source: str
    robot_mass_of_reading_kg: Figure
    body_mass_kg: Figure
    spring_N_per_m: float
    payload_change_kg: float
    cover_spring_N_per_m: float | None
    cover_thickness_m: float | None
    bottoms_out: bool
    lowest_N: float = of("lowest")
    highest_N: float = of("highest")
    lab_lowest_N: Figure = of("lab_lowest")
    lab_highest_N: Figure = of("lab_highest")
    at_most_N: Figure = of("at_most")
    rests_on: AllSaid
    measure: list[str]
