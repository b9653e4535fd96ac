"""forcemap estimate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.comparison import Body
from forcemap.answers.estimate import EstimateAnswer
from forcemap.cli.options import DeviceSpring, Json, bound_from, force_map_from, number, stiffness
from forcemap.cli.output import emit, listing, verdict_first
from forcemap.findings import Finding
from forcemap.limits.body_areas import body_region
from forcemap.limits.covers import Cover
from forcemap.limits.estimate import OtherContact, Reading, estimate_force
from forcemap.maps.bounds import Bound
from forcemap.speeds.basis import against_bound, doubts_of_fit
from forcemap.words import sentence

_Source = Annotated[
    str | None,
    Argument(help=f"Map file, impacts table, campaign folder, or {', '.join(fm.PUBLISHED_MAPS)}; or --force-N."),
]
_Force = Annotated[
    float | None, Option("--force-N", help="Largest force of a contact with a fixed device, in place of SOURCE.")
]
_Area = Annotated[str | None, Option("--area", help="Body area or region: its spring and, with --body free, its mass.")]
_BodyKind = Annotated[
    Body, Option("--body", help="constrained: the body part cannot move away; free: the mass of --area.")
]
_RobotMass = Annotated[
    str | None,
    Option(
        "--robot-mass-kg",
        metavar="KG|LOW:HIGH",
        help="Effective robot mass along the motion, or its bounds; default: as the reading shows.",
    ),
]


@dataclass(frozen=True)
class _Read:
    """A reading, where it is from, and the map it is of, if it is of one."""

    reading: Reading
    source: str
    force_map: fm.ForceMap | None = None
    bound: Bound | None = None

    @property
    def simulated(self) -> bool:
        return self.force_map is not None and self.force_map.simulated

    @property
    def warnings(self) -> list[Finding]:
        """What must be said first of the map that it is read of."""
        if self.force_map is None or self.bound is None:
            return []
        if broken := self.force_map.binding.refusal:
            return [broken]
        return [*against_bound(self.force_map, self.bound), *doubts_of_fit(self.force_map)]


def estimate(
    source: _Source = None,
    force: _Force = None,
    distance: Annotated[float | None, Option("--distance", help="Distance from the base z-axis [m].")] = None,
    height: Annotated[float | None, Option("--height", help="Height above the base [m].")] = None,
    speed: Annotated[float | None, Option("--speed-mps", help="Speed at contact.")] = None,
    device_spring: DeviceSpring = None,
    area: _Area = None,
    body: _BodyKind = Body.CONSTRAINED,
    body_mass: Annotated[
        float | None, Option("--body-mass-kg", help="Mass of a free body part, in place of that of --area.")
    ] = None,
    robot_mass: _RobotMass = None,
    payload_change: Annotated[
        float, Option("--payload-change-kg", help="Effective payload more, or less (-), than was measured with.")
    ] = 0.0,
    cover_spring: Annotated[float | None, Option("--cover-N-per-mm", help="Spring constant of a cover.")] = None,
    cover_thickness: Annotated[
        float | None, Option("--cover-thickness-mm", help="By how much the cover can be compressed.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Estimate a force where the body part is free, its spring or the payload is another, or there is a cover.

    By the standard's contact model, from a force on a fixed device: always a MODEL ESTIMATE, never a permission. It
    gives no speed and no verdict, and says what to measure instead.

    Example: forcemap estimate ur10e --distance 0.8 --height 0.4 --speed-mps 0.25 --area back_of_hand --body free
    """
    read = _read(source, force, (distance, height, speed), device_spring)
    other = OtherContact(
        body_mass=_body_mass(area, body, body_mass),
        stiffness=math.nan if area is None else _spring(area),
        payload_change=payload_change,
        cover=_cover(cover_spring, cover_thickness),
    )
    found = estimate_force(read.reading, other, robot_mass=_bounds(robot_mass))
    answer = EstimateAnswer.from_result(
        found,
        estimate=sentence(found.findings[0]),
        simulated=read.simulated,
        warnings=read.warnings,
        force_N=read.reading.force,
        force_source=read.source,
        device_spring_N_per_m=read.reading.stiffness,
        speed_mps=read.reading.speed,
        robot_mass_of_reading_kg=read.reading.robot_mass,
        robot_mass_source="shown by the reading" if robot_mass is None else "stated",
        body_mass_kg=other.body_mass,
        spring_N_per_m=_spring_of(read.reading, other),
        payload_change_kg=payload_change,
        cover_spring_N_per_m=other.cover and other.cover.stiffness,
        cover_thickness_m=other.cover and other.cover.thickness,
        rests_on=found.findings[1:],
        measure=_to_measure(read, other, source),
    )
    emit(answer, _lines(answer), as_json=as_json)


def _read(
    source: str | None, force: float | None, state: tuple[float | None, ...], device_spring: float | None
) -> _Read:
    """The reading that is named: newtons, or a map's upper bound at a state."""
    distance, height, speed = state
    if force is not None and source is None and distance is None and height is None:
        spring = stiffness(device_spring)
        if spring is None:
            raise fm.InputError("device spring: expected --device-spring-N-per-mm beside --force-N")
        at = math.nan if speed is None else speed
        return _Read(Reading(force, spring, at, largest=force), "as stated, without the device's error")
    if force is not None or source is None or distance is None or height is None or speed is None:
        raise fm.InputError(
            "estimate: expected --force-N, or a SOURCE with --distance, --height and --speed-mps, and not both"
        )
    force_map = force_map_from(source, None, device_spring)[0]
    bound = bound_from(force_map)
    low, high = (float(each[0]) for each in force_map.measured_range.speeds(np.array([distance]), np.array([height])))
    if not low <= speed <= high:
        here = (
            "a place outside the measured range"
            if math.isnan(low)
            else f"expected {low:g} to {high:g}, as measured there"
        )
        raise fm.InputError(f"speed: found {speed:g} m/s at d = {distance:g} m, h = {height:g} m, {here}")
    spring = force_map.conditions.device.stiffness
    if math.isnan(spring):
        raise fm.InputError(
            "device spring: not stated; state device.stiffness_N_per_m in campaign.toml, or --device-spring-N-per-mm; "
            "a map file keeps what its impacts stated: forcemap fit IMPACTS --device-spring-N-per-mm N -o MAP.json",
            file=source,
        )
    upper = float(bound.upper(force_map, distance, height, speed))
    predicted = float(force_map.predict(distance, height, speed))
    words = f"Phase I, upper bound of {force_map.name}: {bound}; prediction {predicted:.1f} N"
    return _Read(Reading(upper, spring, speed), words, force_map, bound)


def _body_mass(area: str | None, body: Body, stated: float | None) -> float:
    if stated is not None:
        return stated
    if body is Body.CONSTRAINED:
        return math.inf
    if area is None:
        raise fm.InputError("body: expected --area or --body-mass-kg for the mass of a free body part")
    return body_region(area).mass


def _spring(area: str) -> float:
    """Spring constant of a body area [N/m]; the standard permits none of the head."""
    fm.force_limit(area).require_permitted()
    return body_region(area).stiffness


def _cover(spring: float | None, thickness: float | None) -> Cover | None:
    if spring is None and thickness is None:
        return None
    if spring is None or thickness is None:
        raise fm.InputError("cover: expected --cover-N-per-mm and --cover-thickness-mm together")
    return Cover(1000 * spring, thickness / 1000)


def _bounds(text: str | None) -> tuple[float, float] | None:
    """Bounds of the effective robot mass [kg]."""
    if text is None:
        return None
    figures = [number(part) for part in text.split(":")]
    low, high = figures[0], figures[-1]
    if low is None or high is None or len(figures) > 2:
        raise fm.InputError(f"effective robot mass: found {text!r}, expected kilograms, or LOW:HIGH such as 4:15")
    return low, high


def _spring_of(reading: Reading, other: OtherContact) -> float:
    return reading.stiffness if math.isnan(other.stiffness) else other.stiffness


def _lines(answer: EstimateAnswer) -> list[str]:
    """The estimate in words, forces rounded up."""
    low, high = answer.robot_mass_kg
    at = "" if answer.speed_mps is None else f" at {answer.speed_mps:g} m/s"
    mass = f"{low:.1f}" if low == high else f"{low:.1f} to {high:.1f}"
    between = "" if low == high else f"{_up(answer.lowest_N)} to "
    verdict = f"ESTIMATED, no permission: {between}{_up(answer.highest_N)} N for {_contact(answer)}"
    if answer.lab_highest_N is not None:
        verdict += f"; with the error found in the virtual lab up to {_up(answer.lab_highest_N)} N"
    lines = [
        *verdict_first(verdict, [answer.estimate, *answer.warnings], simulated=answer.simulated),
        f"read on a fixed device of {answer.device_spring_N_per_m / 1000:g} N/mm{at}: {_up(answer.force_N)} N "
        f"({answer.force_source})",
    ]
    if answer.at_most_N is not None:
        lines.append(
            f"by the model at most {_up(answer.at_most_N)} N, whatever the robot's mass, while nothing else stops the "
            "body part and the contact point is never faster"
        )
    if answer.bottoms_out:
        lines.append("THE COVER BOTTOMS OUT: it is compressed fully before this force is reached")
    shown = answer.robot_mass_of_reading_kg
    also = "" if shown is None or answer.robot_mass_source != "stated" else f"; the reading shows {shown:.1f} kg"
    lines += [f"effective robot mass: {mass} kg, {answer.robot_mass_source}{also}", ""]
    return [*lines, *listing("Rests on", answer.rests_on), "", *listing("To know, measure", answer.measure)]


def _contact(answer: EstimateAnswer) -> str:
    """What is other, in words."""
    free = answer.body_mass_kg is not None
    words = [f"a free body part of {answer.body_mass_kg:g} kg" if free else "a body part that cannot move away"]
    words += [f"{answer.spring_N_per_m / 1000:g} N/mm"]
    words += [f"{answer.payload_change_kg:+g} kg of payload"] if answer.payload_change_kg else []
    if answer.cover_spring_N_per_m is not None and answer.cover_thickness_m is not None:
        thick = f"{1000 * answer.cover_thickness_m:g} mm"
        words.append(f"a cover of {answer.cover_spring_N_per_m / 1000:g} N/mm and {thick}")
    return ", ".join(words)


def _to_measure(read: _Read, other: OtherContact, source: str | None) -> list[str]:
    """What would make it a measurement: the plan of the other contact, and the comparison of both from data."""
    spring = f"--device-spring-N-per-mm {_spring_of(read.reading, other) / 1000:g}"
    ranges = "--distances-m LOW,HIGH --heights-m LOW,HIGH --speeds-mps SLOWEST,FASTEST"
    if read.force_map is not None:
        box = read.force_map.measured_range
        low_high = [f"{low:g},{high:g}" for low, high in zip(box.lowest, box.highest, strict=True)]
        ranges = "--distances-m {} --heights-m {} --speeds-mps {}".format(*low_high)
        if not math.isnan(read.force_map.conditions.device.range):
            ranges += f" --device-range-N {read.force_map.conditions.device.range:g}"
    steps = [_set_up(other), f"forcemap plan other-contact {ranges} {spring}"]
    alike = not other.free and _spring_of(read.reading, other) == read.reading.stiffness
    if read.force_map is not None and read.force_map.fit is not None and alike:
        steps.append(f"with fewer states: forcemap fit {source} -o map.json")
        steps.append("then: forcemap plan other-contact --transfer map.json")
    return [*steps, "forcemap collect other-contact", f"forcemap compare {source or 'MAP'} other-contact"]


def _set_up(other: OtherContact) -> str:
    """How the device and the robot have to stand for the other contact."""
    changes = [*(["the cover mounted"] if other.cover else []), *(["the new payload"] if other.payload_change else [])]
    if not other.free:
        return ", ".join(["the device fixed", *changes])
    movable = f"the device on a slide or pendulum, free along the motion, {other.body_mass:g} kg in all"
    said = "say so in the note of campaign.toml: what is measured there holds for body parts that can move"
    return f"{', '.join([movable, *changes])}; {said}"


def _up(force: float) -> str:
    """A force for text, rounded up to 0.1 N."""
    return f"{math.ceil(10 * force - 1e-9) / 10:.1f}"
