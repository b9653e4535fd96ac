"""Questions to a campaign, as the parameters of an address: body area, kind of contact, bound, place, path.

The ranges of parameters are choices: wider than any campaign needs, and narrow enough that an answer takes seconds.
"""

from __future__ import annotations

import math
import re
from enum import StrEnum
from typing import Annotated, Any, get_args
from urllib.parse import urlencode

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

import forcemap as fm
from forcemap.answers.comparison import Body
from forcemap.assessment.assess_campaign import PLACES_APART
from forcemap.exports.robot_table import ZONE_SIZE
from forcemap.maps.bounds import Bound
from forcemap.paths.task import MOST_ACCELERATION

Metres = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
MetresPerSecond = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]

NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""A number as a page or a program states it: digits, a point, an exponent. 1_0 is a slip, not ten."""

DRAWN_PLACES = 2500
"""Places of a drawn grid, if not stated; a choice: 50 by 50."""

_POINT = r"[0-9]{1,2}(\.[0-9]{1,6})?,-?[0-9]{1,2}(\.[0-9]{1,6})?"


class BoundKind(StrEnum):
    """Upper bounds on the force."""

    TOLERANCE = "tolerance"
    MARGIN = "margin"


class Area(BaseModel):
    """A body area or region."""

    model_config = ConfigDict(extra="forbid")

    area: str = Field(
        "", description="Body area or body region; if not given, the first of the contact points.", max_length=60
    )

    @field_validator("*", mode="before")
    @classmethod
    def _as_written(cls, value: Any, info: ValidationInfo) -> Any:
        """A number is digits, a point and an exponent; 1_0 is a slip, not ten."""
        kind = cls.model_fields[str(info.field_name)].annotation
        text = any(isinstance(option, type) and issubclass(option, str | bool) for option in (kind, *get_args(kind)))
        if isinstance(value, str) and not text and not NUMBER.fullmatch(value):
            raise ValueError("expected a number such as 0.25")
        return value

    @property
    def query(self) -> str:
        """The parameters as they stand in an address, without those of the place."""
        stated = self.model_dump(mode="json", include={*Question.model_fields} & {*type(self).model_fields})
        return urlencode({name: value for name, value in stated.items() if value != ""})


class Bounded(Area):
    """A body area or region, a bound, and how much faster than programmed the robot may be."""

    bound: BoundKind = Field(BoundKind.TOLERANCE, description="Upper bound on the force.")
    confidence: float = Field(
        fm.ToleranceBound.confidence, ge=0.5, le=0.999, allow_inf_nan=False, description="Of the tolerance bound."
    )
    content: float = Field(
        fm.ToleranceBound.content, ge=0.5, le=0.999, allow_inf_nan=False, description="Share of states below it."
    )
    margin: float = Field(
        fm.FixedMargin.margin, ge=0, le=1, allow_inf_nan=False, description="Share added by the bound margin."
    )
    overshoot_mps: float = Field(
        fm.Allowance.speed, ge=0, le=1, allow_inf_nan=False, description="Speed overshoot, subtracted."
    )

    @property
    def allowance(self) -> fm.Allowance:
        """What the robot may deviate from its program."""
        return fm.Allowance(speed=self.overshoot_mps)

    def stated_bound(self, device_error: float) -> Bound:
        """The bound for a device with that error [N]."""
        if self.bound is BoundKind.MARGIN:
            return fm.FixedMargin(self.margin)
        return fm.ToleranceBound(self.confidence, self.content, device_error)

    def bound_of(self, force_map: fm.ForceMap) -> Bound:
        """The bound, with the device error of the map's campaign."""
        bound = self.stated_bound(force_map.conditions.device.error_or_default)
        bound.require(force_map)
        return bound


class Question(Bounded):
    """A body area or region, a bound and a kind of contact."""

    contact: fm.Contact = Field(fm.Contact.TRANSIENT, description="Kind of contact.")


class Place(Question):
    """A question about one place."""

    distance_m: Metres = Field(description="Distance from the base z-axis.")
    height_m: Metres = Field(description="Height above the base.")


class State(Place):
    """A question about one place and speed."""

    speed_mps: MetresPerSecond = Field(description="Speed at contact.")


class Resolution(Question):
    """A question about the whole measured range."""

    places: int = Field(DRAWN_PLACES, ge=1, le=40_000, description="About how many places, spread evenly.")


class Steps(Question):
    """A question about a grid of places over the measured range."""

    step_m: float = Field(PLACES_APART, ge=0.01, le=1, allow_inf_nan=False, description="Distance between places.")


class ComparisonQuestion(Area):
    """What the standard's contact model needs; masses as campaign.toml states them if not given."""

    body: Body = Field(Body.CONSTRAINED, description="Whether the body part can move away.")
    moving_mass_kg: float | None = Field(None, gt=0, le=10_000, allow_inf_nan=False, description="Of the robot.")
    payload_kg: float | None = Field(None, ge=0, le=10_000, allow_inf_nan=False, description="Effective payload.")


class Allowing(Question):
    """A question whose speeds hold wherever the robot may be beside its program, too."""

    position_tolerance_m: float = Field(
        fm.Allowance.position, ge=0, le=0.1, allow_inf_nan=False, description="Allowed for."
    )

    @property
    def allowance(self) -> fm.Allowance:
        """What the robot may deviate from its program."""
        return fm.Allowance(speed=self.overshoot_mps, position=self.position_tolerance_m)


class ZoneSize(Allowing):
    """What an export of zones needs."""

    zone_m: float = Field(ZONE_SIZE, ge=0.01, le=1, allow_inf_nan=False, description="Largest extent of a zone.")


class PathQuestion(Allowing):
    """A question about a point, or a path through points, of the contact point in the plane of distance and height."""

    points: str = Field(
        description="Distance and height of each point [m]: 0.7,0.4;0.7,0.2",
        pattern=f"^{_POINT}(;{_POINT}){{0,49}}$",
        examples=["0.7,0.4;0.7,0.2"],
    )
    programmed_mps: MetresPerSecond | None = Field(None, description="Programmed speed, if any.")
    acceleration_mps2: float = Field(
        fm.Task.acceleration, gt=0, le=MOST_ACCELERATION, allow_inf_nan=False, description="Along the path."
    )

    @property
    def places(self) -> list[tuple[float, float]]:
        """Distance and height of each point [m]."""
        pairs = (point.split(",") for point in self.points.split(";"))
        return [(float(d), float(h)) for d, h in pairs]

    @property
    def programmed(self) -> float:
        """Programmed speed [m/s]; NaN if none."""
        return math.nan if self.programmed_mps is None else self.programmed_mps
