"""Plans of measurements: which impacts to make, in which order, and what they will and will not tell."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from forcemap.campaigns.plan import Device, MeasurementPlan
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import InputError
from forcemap.maps.force_map import ForceMap
from forcemap.planning.expectation import Expectation, StandardExpectation, expected_at, factor_of, source_of

_FEW_STATES = 18  # twice the nine coefficients of the default map; fewer leave a wide bound
_SLOWEST_PROPOSED = 0.05  # [m/s]
_SAME_ANGLE = 1.0  # [deg], as in campaigns.repeatability


class Design(StrEnum):
    """Which states are measured (paper, section IV-C)."""

    TRAINING = "training"
    FULL_GRID = "full-grid"
    SYMMETRY = "symmetry"


# Values a range (lowest, highest) is divided into, and the fewest values that tell the map's squares.
_DIVISIONS = {Design.TRAINING: 3, Design.FULL_GRID: 5, Design.SYMMETRY: 0}
_FEWEST = {Design.TRAINING: 3, Design.FULL_GRID: 4, Design.SYMMETRY: 1}


def plan_measurements(
    distances: ArrayLike,
    heights: ArrayLike,
    speeds: ArrayLike,
    *,
    design: Design = Design.TRAINING,
    repeats: int = 3,
    base_angles: Sequence[float] = (),
    reach: float = math.inf,
    device: Device = Device(),  # noqa: B008 - frozen
    expected_force: Expectation | None = None,
    limit: float = math.nan,
    tolerance: StateTolerance = StateTolerance(),  # noqa: B008 - frozen
) -> MeasurementPlan:
    """Plan the impacts of a campaign, slow before fast, far before near, repeats of a state together.

    TRAINING measures every combination of three or more values along each axis. FULL_GRID measures a finer grid:
    every second value, and the last, trains; the others test. SYMMETRY measures every combination at several angles
    of the base joint, all with role test; the repeats of a state are numbered on over the angles.

    Parameters
    ----------
    distances, heights, speeds : float or array
        Values to measure [m], [m], [m/s]. Just two are the ends of a range for TRAINING, which adds the middle, and
        for FULL_GRID, which adds three values between (to 0.001). More, and all of SYMMETRY, are measured as given.
    design : Design
        Which states are measured.
    repeats : int
        Impacts of every state; for SYMMETRY at every angle.
    base_angles : sequence of float
        Angles of the base joint [deg]; two or more for SYMMETRY, else none or one.
    reach : float
        Largest distance of a place from the origin of the base [m]; farther ones are left out.
    device : Device
        The force measuring device; states expected above its range less its error are left out.
    expected_force : ForceMap, StandardExpectation or callable, optional
        The force to expect [N] at (distance, height, speed).
    limit : float
        Force limit that is to be confirmed [N]; NaN if none. A warning says where the speeds are not low enough.
    tolerance : StateTolerance
        How far repeats of a state may lie apart; values must lie further apart.

    Returns
    -------
    MeasurementPlan

    Raises
    ------
    InputError
        A figure that is not in its range, too few values, values too close together, or no state is left.

    Examples
    --------
    >>> plan = plan_measurements((0.56, 0.86), (0.14, 0.46), (0.2, 0.4))
    >>> len(plan.states), len(plan), plan.recording[0].item()
    (27, 81, 'd860-h140-v200-r1')
    """
    if not isinstance(design, Design):
        raise InputError(f"design: found {design!r}, expected one of {', '.join(f'Design.{d.name}' for d in Design)}")
    axes = (
        _axis("distances", distances, "metres above 0 and up to 10", 0.0, design, tolerance.place),
        _axis("heights", heights, "metres from -10 to 10", -math.inf, design, tolerance.place),
        _axis("speeds", speeds, "metres per second above 0 and up to 10", 0.0, design, tolerance.speed),
    )
    angles = _angles(base_angles, design)
    if isinstance(repeats, bool) or not isinstance(repeats, int | np.integer) or repeats < 1:
        raise InputError(f"repeats: found {repeats!r}, expected a whole number of at least 1")
    _check_figures(reach, limit, device)

    names = [_names(letter, values) for letter, values in zip("dhv", axes, strict=True)]
    training = [{*values[::2], values[-1]} for values in axes]
    planned = {state: "-".join(name[x] for name, x in zip(names, state, strict=True)) for state in _in_order(axes)}
    expected = {state: expected_at(expected_force, *state) for state in planned}
    kept, left_out = [], []
    for state, name in planned.items():
        away = math.hypot(state[0], state[1])
        if away > reach:
            left_out.append(f"{name}: {away:.3f} m from the base, beyond the reach of {reach:g} m")
        elif expected[state] > device.highest_limit:
            most = f"the device measures up to {device.highest_limit:g} N (range less error)"
            left_out.append(f"{name}: {expected[state]:.0f} N expected, {most}")
        else:
            kept.append(state)
    if not kept:
        raise InputError(f"no state is left to measure, the first of {len(left_out)}: {left_out[0]}; change the values")

    def role(state: tuple[float, float, float]) -> str:
        trains = all(x in chosen for x, chosen in zip(state, training, strict=True))
        return "train" if design is Design.TRAINING or (design is Design.FULL_GRID and trains) else "test"

    runs = [
        (planned[state], number, role(state), *state, angle, expected[state])
        for state in kept
        for number, (angle, _) in enumerate(itertools.product(angles, range(repeats)), start=1)
    ]
    state_id, repeat, roles, distance, height, speed, base_angle, force = (
        np.array(each) for each in zip(*runs, strict=True)
    )
    reached = [state for state in planned if math.hypot(state[0], state[1]) <= reach]
    warnings = [
        *_few_states(sum(role(state) == "train" for state in kept), design),
        *_unchecked(expected_force, device, limit),
        *_unconfirmed(reached, set(kept), expected_force, limit, tolerance.speed),
    ]
    return MeasurementPlan(
        state_id=state_id,
        repeat=repeat,
        role=roles,
        distance=distance,
        height=height,
        speed=speed,
        base_angle=base_angle,
        expected_force=force,
        left_out=tuple(left_out),
        warnings=tuple(warnings),
        expected_from=source_of(expected_force, list(planned)),
    )


def _axis(name: str, values: ArrayLike, expected: str, above: float, design: Design, apart: float) -> list[float]:
    """The values to measure along an axis, ascending."""
    if np.ma.is_masked(values):
        raise InputError(f"{name}: found masked entries, expected {expected}")
    try:
        given = np.sort(np.atleast_1d(np.asarray(values, dtype=np.float64)))
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {values!r}, expected {expected}") from None
    if given.ndim != 1:
        raise InputError(f"{name}: found an array of shape {given.shape}, expected a row of values, {expected}")
    for value in given[~((given > above) & (np.abs(given) <= 10))][:1]:
        raise InputError(f"{name}: found {value:g}, expected {expected}")
    if given.size == 2 and _DIVISIONS[design]:
        between = np.linspace(given[0], given[1], _DIVISIONS[design])[1:-1]
        given = np.array([given[0], *np.round(between, 3), given[1]])
    if given.size < _FEWEST[design]:
        fewest = f"at least {_FEWEST[design]} values" if given.size else "at least one"
        raise InputError(f"{name}: found {given.size}, expected (lowest, highest) or {fewest}")
    gaps = np.diff(given)
    if np.any(gaps <= apart * (1 + 1e-9)):
        i = int(gaps.argmin())
        raise InputError(
            f"{name}: found {given[i]:g} and {given[i + 1]:g}, expected values more than {apart:g} apart: "
            "closer ones count as repeats of one state; widen the range or lower the tolerance"
        )
    return [float(value) for value in given]


def _angles(base_angles: Sequence[float], design: Design) -> list[float]:
    """The angles of the base joint [deg]; NaN where none is stated."""
    angles = [float(angle) for angle in base_angles]
    for angle in angles:
        if not abs(angle) <= 3600:
            raise InputError(f"base angles: found {angle:g}, expected degrees from -3600 to 3600")
    if design is not Design.SYMMETRY:
        if len(angles) > 1:
            raise InputError(f"base angles: found {len(angles)}, expected at most one; several are Design.SYMMETRY")
        return angles or [math.nan]
    if len(angles) < 2:
        raise InputError(f"base angles: found {len(angles)}, expected at least two for Design.SYMMETRY")
    for one, other in itertools.combinations(angles, 2):
        if abs(math.remainder(one - other, 360)) <= _SAME_ANGLE:
            raise InputError(
                f"base angles: found {one:g} and {other:g} deg, expected more than {_SAME_ANGLE:g} between"
            )
    return sorted(angles)


def _check_figures(reach: float, limit: float, device: Device) -> None:
    if not reach > 0:
        raise InputError(f"reach: found {reach:g}, expected metres above 0")
    if not (math.isnan(limit) or 0 < limit < math.inf):
        raise InputError(f"limit: found {limit:g}, expected newtons above 0 and finite")
    if limit > device.highest_limit:
        raise InputError(
            f"limit: found {limit:g} N, expected at most {device.highest_limit:g} N, the device's range "
            "less its error: this device cannot confirm it"
        )


def _names(letter: str, values: list[float]) -> dict[float, str]:
    """Names of values in thousandths, with as many decimals as it takes to tell them apart; no point in a file name."""
    for decimals in itertools.count():
        names = {value: f"{letter}{1000 * value:.{decimals}f}".replace(".", "_") for value in values}
        if len(set(names.values())) == len(values):
            return names
    raise AssertionError("distinct numbers differ in some decimal")  # pragma: no cover


def _in_order(axes: Sequence[list[float]]) -> Iterator[tuple[float, float, float]]:
    """Slow to fast, so that forces grow; at a speed far to near, at a distance low to high."""
    distances, heights, speeds = axes
    return ((d, h, v) for v in speeds for d in reversed(distances) for h in heights)


def _few_states(training: int, design: Design) -> Iterator[str]:
    if design is not Design.SYMMETRY and training < _FEW_STATES:
        yield (
            f"{training} states to train remain, fewer than {_FEW_STATES}: too few for the nine coefficients of the "
            "default map and a useful bound; choose lower speeds, nearer places or a device of larger range"
        )


def _unchecked(expectation: Expectation | None, device: Device, limit: float) -> Iterator[str]:
    """What could not be checked for want of a figure."""
    if expectation is None:
        if not math.isnan(device.range):
            yield "no expected force is given, so no state was checked against the device range"
        if not math.isnan(limit):
            yield f"no expected force is given, so nothing tells whether {limit:g} N can be confirmed at these speeds"
    elif math.isnan(device.range):
        yield "the device range is not stated, so no state was checked against it"


def _unconfirmed(
    states: list[tuple[float, float, float]],
    kept: set[tuple[float, float, float]],
    expectation: Expectation | None,
    limit: float,
    apart: float,
) -> Iterator[str]:
    """Where even the slowest planned speed is expected to exceed the limit, and the speed to add.

    No speed below the lowest measured one is ever confirmed, so a plan without it cannot answer there. As for safe
    speeds, only the first rise of the force counts, searched from below.
    """
    if expectation is None or math.isnan(limit):
        return
    by_standard = isinstance(expectation, StandardExpectation)
    factor = factor_of(expectation)
    slowest: dict[tuple[float, float], float] = {}
    for distance, height, speed in sorted(states, key=lambda state: (state not in kept, state[2])):
        slowest.setdefault((distance, height), speed)
    proposed: list[float] = []
    exceeding = 0
    for place, speed in slowest.items():
        if factor * expected_at(expectation, *place, speed) > limit:
            exceeding += 1
            proposed += _slower(expectation, place, speed - apart, limit / factor)
    if not exceeding:
        return
    hopeless = exceeding - len(proposed)
    force = f"{factor:g} times the expected force"
    parts = [
        f"{limit:g} N is not expected to be confirmed at {exceeding} of {len(slowest)} places: {force} exceeds it "
        "already at the slowest planned speed"
    ]
    if proposed:
        parts.append(f"add {min(proposed):.2f} m/s, which is expected to confirm it at {len(proposed)} of these")
    if hopeless:
        parts.append(f"at {hopeless} no speed from {_SLOWEST_PROPOSED:g} m/s up is expected to be confirmed")
    if isinstance(expectation, ForceMap):
        lowest = expectation.measured_range.lowest[2]
        parts.append(f"below its lowest measured speed, {lowest:g} m/s, the map extrapolates")
    elif by_standard:
        parts.append(
            "the contact model's force vanishes at rest, a robot's does not: an even lower speed may be needed"
        )
    yield "; ".join(parts)


def _slower(expectation: Expectation, place: tuple[float, float], below: float, force: float) -> list[float]:
    """The highest speed [m/s] below another, in whole 0.01 m/s, up to which the expected force stays within `force`."""
    highest: list[float] = []
    for step in range(round(100 * _SLOWEST_PROPOSED), 1001):
        if step / 100 >= below or expected_at(expectation, *place, step / 100) > force:
            break
        highest = [step / 100]
    return highest
