"""Safe speeds: a map, an upper bound on its force and a limit give the highest speed that may be driven."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import ROUND_FLOOR, Decimal
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Indices, Mask
from forcemap.errors import InputError
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound, ToleranceBound, contradiction, margins
from forcemap.maps.force_map import ForceMap
from forcemap.maps.saturation import saturation_doubt
from forcemap.speeds.exceedance import first_exceedance
from forcemap.speeds.usable_limits import usable_limit

_PLACES_AT_ONCE = 4096
SAME_PLACE = 0.005  # repeats of a state may lie so far apart [m]
"""States this close to a place were measured at it [m]."""

_COLUMNS = (
    "speed",
    "outcome",
    "extrapolated_speed",
    "lowest_measured_speed",
    "highest_measured_speed",
    "predicted_force",
    "bound_force",
    "reason",
)


class SpeedOutcome(StrEnum):
    """What is known of the safe speed at a place; the first that holds."""

    OUTSIDE = "outside"
    UNCONFIRMED = "unconfirmed"
    CAPPED = "capped"
    ADMISSIBLE = "admissible"

    @property
    def has_speed(self) -> bool:
        """True if a speed is given."""
        return self in (SpeedOutcome.CAPPED, SpeedOutcome.ADMISSIBLE)


_REASONS = {
    SpeedOutcome.OUTSIDE: "the place lies outside the measured range",
    SpeedOutcome.UNCONFIRMED: "the bound exceeds the limit already at the lowest speed measured there",
    SpeedOutcome.CAPPED: "even the highest speed measured there is admissible; no higher one was measured",
    SpeedOutcome.ADMISSIBLE: "the bound reaches the limit at this speed",
}


@dataclass(frozen=True, eq=False)
class SafeSpeed:
    """Safe speeds at places; floats and single values for one place, arrays of one shape for many.

    Parameters
    ----------
    speed : float or array
        Highest speed confirmed [m/s], unrounded; NaN unless the outcome is capped or admissible.
    outcome : SpeedOutcome or array of object
        What is known of it.
    extrapolated_speed : float or array
        Where to measure next [m/s], a hint and no permission: where the bound, continued below the measured
        speeds, rises to the limit; 0.0 if it never lies below. NaN unless the bound makes it unconfirmed.
    lowest_measured_speed, highest_measured_speed : float or array
        Measured speeds at the place [m/s]; NaN outside.
    predicted_force, bound_force : float or array
        Prediction and bound at that speed [N]; NaN where there is no speed.
    reason : str or array of object
        Why, in words.
    limit : float or array
        The force limit used [N].
    statements : tuple of str
        What the speeds depend on, a line each.
    warnings : tuple of str
        What must be said before the speeds, a line each.
    refusal : str
        Why no place has a speed, whatever the bound; empty if nothing forbids it.
    export_refusal : str
        Why nothing may be exported or released of them; empty if nothing forbids it.
    raised : float
        Factor by which the bound was raised, for the device's spring and for motion off the map's direction.
    """

    speed: Any
    outcome: Any
    extrapolated_speed: Any
    lowest_measured_speed: Any
    highest_measured_speed: Any
    predicted_force: Any
    bound_force: Any
    reason: Any
    limit: Any
    statements: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    refusal: str = ""
    export_refusal: str = ""
    raised: float = 1.0


def safe_speed(
    force_map: ForceMap,
    distance: ArrayLike,
    height: ArrayLike,
    *,
    limit: ForceLimit | NewtonLimit | ArrayLike,
    bound: Bound,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
    angle: float = 0.0,
) -> SafeSpeed:
    """Highest speed at which the bound on the force stays within a limit, as far as measurements reach.

    With B(v) the running maximum of `bound.upper` from the lowest speed measured at the place: `outside` the
    measured range; `unconfirmed` if B exceeds the limit already there; `capped` if B admits even the highest
    speed measured there; else `admissible`, the speed at which B crosses the limit (to 1e-6 m/s, never above).

    A transient limit is used only where Phase II allows it: if impacts clamp, are undetermined, or leave a force
    above the quasi-static limit, every place inside is `unconfirmed` with that reason; a limit in newtons opens no
    gate. So is every place inside where the device's spring is softer than 0.9 of the body area's or not stated, and
    where the impacts table is not what its recordings gave. A spring from 0.9 to 1 of the area's raises the bound by
    the root of their ratio.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    distance, height : float or array
        Places [m]; they and a numeric limit broadcast.
    limit : float, array, NewtonLimit or ForceLimit
        Force limit [N], positive, finite and not above the device range less its error (where no range is stated, the
        largest force that was measured); or the limits of a body area together with `contact`.
    bound : Bound
        `FixedMargin` or `ToleranceBound`.
    contact : Contact, optional
        Kind of contact. With a limit in newtons it may be left out only for a map whose impacts are all known to be
        over within 0.5 s.
    quasi_static_limit : float, optional
        With a transient limit in newtons, its quasi-static part [N]; expected where a Phase II force was recorded.
    spring_N_per_m : float, optional
        With a limit in newtons, the spring constant [N/m] of the body part it is meant for.
    angle : float
        How far the motion may point away from the map's direction [deg], at most 5; off it the bound is raised by 14 %.

    Returns
    -------
    SafeSpeed

    Raises
    ------
    InputError
        A place that is not finite, a limit or angle outside its range, or `contact` or `quasi_static_limit` missing.
    ContactNotPermitted
        The standard permits no contact with the body area.
    BoundNotAvailable
        The map cannot carry the bound.

    Examples
    --------
    >>> from forcemap import FixedMargin, published_map
    >>> result = safe_speed(published_map("ur10e"), 0.8, 0.4, limit=280.0, bound=FixedMargin(0.10))
    >>> result.outcome.value, round(result.speed, 4)
    ('admissible', 0.3212)
    """
    usable = usable_limit(
        force_map,
        limit,
        bound=bound,
        contact=contact,
        quasi_static_limit=quasi_static_limit,
        spring_N_per_m=spring_N_per_m,
        angle=angle,
    )
    refusal = usable.refusal or contradiction(force_map, bound)
    if np.ma.is_masked(distance) or np.ma.is_masked(height):
        raise InputError("place: found masked entries, expected numbers")
    try:
        arrays = [np.asarray(value, dtype=np.float64) for value in (distance, height, usable.level)]
        shape = np.broadcast_shapes(*(array.shape for array in arrays))
    except (TypeError, ValueError) as error:
        raise InputError(f"place: expected numbers, and arrays that broadcast: {error}") from None
    d, h, level = (np.ascontiguousarray(np.broadcast_to(array, shape).ravel()) for array in arrays)
    if not (np.isfinite(d).all() and np.isfinite(h).all()):
        raise InputError("place: found a distance or height that is not a finite number, expected metres")
    parts = [_safe_speed(force_map, d[part], h[part], level[part], bound, refusal) for part in _parts(d.size)]
    if usable.unseen:
        for part in parts:
            part[-1][:] = [f"{reason}; {usable.unseen}" for reason in part[-1]]
    columns = [np.concatenate(column).reshape(shape) for column in zip(*parts, strict=True)]
    values: dict[str, Any] = {
        name: column if shape else column.item() for name, column in zip(_COLUMNS, columns, strict=True)
    }
    values["bound_force"] = usable.raised * values["bound_force"]
    statements = (
        *force_map.conditions.assumptions(),
        f"map: {force_map.source}",
        force_map.phase_two.statement(),
        usable.words,
        f"bound: {bound}",
        *usable.statements,
        *_warnings(force_map, bound),
    )
    return SafeSpeed(
        **values,
        limit=usable.newtons,
        statements=statements,
        warnings=usable.warnings,
        refusal=refusal,
        export_refusal=usable.export_refusal,
        raised=usable.raised,
    )


def floor_speed(speed: float) -> str:
    """A speed [m/s] as it is shown: cut to 0.001 m/s in decimal, never rounded up; "-" where there is none.

    Examples
    --------
    >>> floor_speed(0.29), floor_speed(0.1599999)
    ('0.290', '0.159')
    """
    if not math.isfinite(speed):
        return "-"
    return str(Decimal(repr(float(speed))).quantize(Decimal("0.001"), rounding=ROUND_FLOOR))


def _parts(size: int) -> Iterator[slice]:
    return (slice(start, start + _PLACES_AT_ONCE) for start in range(0, max(size, 1), _PLACES_AT_ONCE))


def _safe_speed(
    force_map: ForceMap, d: FloatArray, h: FloatArray, limit: FloatArray, bound: Bound, refusal: str
) -> tuple[Any, ...]:
    """The first columns of SafeSpeed, in its order, for places of shape (n,)."""
    low, high = force_map.measured_range.speeds(d, h)
    speed = np.full(d.size, np.nan)
    hint = speed.copy()
    outcome, reason = np.empty((2, d.size), dtype=object)
    outcome[:], reason[:] = SpeedOutcome.OUTSIDE, _REASONS[SpeedOutcome.OUTSIDE]
    inside = np.flatnonzero(~np.isnan(low))

    def log_bound(places: Indices) -> Callable[[Indices, FloatArray], FloatArray]:
        def values(place: Indices, v: FloatArray) -> FloatArray:
            at = places[place][:, None]
            return np.asarray(np.log(np.clip(bound.upper(force_map, d[at], h[at], v), 1e-300, 1e300)))

        return values

    if refusal:
        outcome[inside] = SpeedOutcome.UNCONFIRMED
        reason[inside] = refusal
    else:
        last, following = first_exceedance(log_bound(inside), low[inside], high[inside], np.log(limit[inside]))
        unconfirmed, capped = np.isnan(last), np.isnan(following)
        speed[inside] = last
        for kind, mask in (
            (SpeedOutcome.ADMISSIBLE, np.ones(inside.size, dtype=np.bool_)),
            (SpeedOutcome.CAPPED, capped),
            (SpeedOutcome.UNCONFIRMED, unconfirmed),
        ):
            outcome[inside[mask]] = kind
            reason[inside[mask]] = _REASONS[kind]
        for state, where in _measured_beyond(force_map, d, h, limit, speed, "at_least"):
            outcome[where], speed[where] = SpeedOutcome.UNCONFIRMED, np.nan
            reason[where] = f"state {state}: the map is wrong here"
        for state, where in _measured_beyond(force_map, d, h, limit, speed, "highest"):
            reason[where] = [f"{why}; but state {state}" for why in reason[where]]
        slower = inside[unconfirmed]
        hint[slower] = _extrapolated(log_bound(slower), low[slower], limit[slower])
    with_speed = np.flatnonzero(~np.isnan(speed))
    predicted, bounded = np.full((2, d.size), np.nan)
    predicted[with_speed] = force_map.predict(d[with_speed], h[with_speed], speed[with_speed])
    bounded[with_speed] = bound.upper(force_map, d[with_speed], h[with_speed], speed[with_speed])
    return speed, outcome, hint, low, high, predicted, bounded, reason


def _measured_beyond(
    force_map: ForceMap, d: FloatArray, h: FloatArray, limit: FloatArray, speed: FloatArray, force: str
) -> Iterator[tuple[str, Mask]]:
    """States of the campaign, test ones too, whose `at_least` or `highest` force contradicts speeds at their place.

    At a speed not above the one given they exceeded the limit. How far a censored impact exceeded it nobody knows, so
    those refuse the speed; of measured ones the bound allows for some.
    """
    if force_map.fit is None:
        return
    words = {"at_least": "reached at least", "highest": "measured"}[force]
    for states in (force_map.fit.states, force_map.fit.left_out, force_map.fit.test):
        figures = (states.name, states.distance, states.height, states.speed, getattr(states, force))
        for name, d_state, h_state, v_state, newtons in zip(*figures, strict=True):
            here = (np.abs(d - d_state) <= SAME_PLACE) & (np.abs(h - h_state) <= SAME_PLACE)
            where = here & (speed >= v_state) & (limit < newtons)
            if where.any():
                yield f"{name} {words} {newtons:g} N at this place at {v_state:g} m/s", where


def _extrapolated(
    log_bound: Callable[[Indices, FloatArray], FloatArray], lowest: FloatArray, limit: FloatArray
) -> FloatArray:
    """Going down from the lowest measured speed, where the bound first falls below the limit; 0 if it never does."""

    def depth(place: Indices, below: FloatArray) -> FloatArray:
        return np.asarray(-log_bound(place, lowest[place][:, None] - below))

    _, following = first_exceedance(depth, np.zeros(lowest.size), lowest * (1 - 1e-6), -np.log(limit))
    return np.where(np.isnan(following), 0.0, lowest - following)


def _warnings(force_map: ForceMap, bound: Bound) -> list[str]:
    """What about the map and the bound a reader of the speed must know."""
    lines = [
        "person at rest",
        "pressure not assessed",
        *([] if force_map.rises_with_speed else ["the prediction falls with speed in part of the measured range"]),
        *(["device range not stated"] if math.isnan(force_map.device_range) else []),
        *(["device error not stated: 3 N assumed"] if math.isnan(force_map.conditions.device.error) else []),
    ]
    if isinstance(bound, ToleranceBound) and (too_small := int(np.sum(margins(bound, force_map) > 0.10))):
        lines.append(
            f"the tolerance bound exceeds prediction + 10 % at {too_small} of {len(force_map.measured_range.points)} "
            "measured states: the paper's margin is too small for this campaign"
        )
    fit = force_map.fit
    if fit is None:
        return lines
    scattered = int(np.sum(np.fmax(fit.states.highest, fit.states.at_least) > 1.05 * fit.states.force))
    if scattered:
        lines.append(f"at {scattered} states an impact lies more than 5 % above their mean, which the bound is for")
    censored = fit.censored_samples + int(fit.test.censored.sum())
    if doubt := saturation_doubt(fit.states.highest, fit.states.name, censored=censored):
        lines.append(doubt)
    if fit.between_states.degrees_of_freedom == 0:
        lines.append("as many coefficients as measured states: the fit says nothing about its own error")
    if fit.censored_samples and not fit.censored_fit:
        names = ", ".join(fit.left_out.name)
        lines.append(
            f"{fit.censored_samples} impacts above the device range are not in the fit, so near that range the bound "
            "may be too low" + (f"; states left out: {names}" if names else "")
        )
    elif fit.censored_samples:
        lines.append(
            f"{fit.censored_samples} impacts above the device range are in the fit as at least that force; nothing "
            "above the range was measured"
        )
    return lines
