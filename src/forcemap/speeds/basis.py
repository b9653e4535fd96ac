"""What speeds rest on: one gate for every speed, whatever is typed.

Before any bound is computed: does the standard permit contact, is the impacts table what its recordings gave, is the
device stiff enough for the body area, does Phase II allow the kind of contact? From the answers follow what raises the
bound (the device's spring, a motion off the map's direction), what must be said first and what forbids an export.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import (
    DISAGREEMENT,
    SPEED_NOT_STATED,
    Binding,
    BindingState,
    Conditions,
    PhaseTwo,
    Quantity,
    States,
    StateTolerance,
    contradictions,
    unit_finding,
)
from forcemap.direction import RAISED_FROM, RAISED_OFF_AXIS, RAISED_SLOWER, WIDEST_ANGLE, raised_off_axis
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import MAX_TRANSIENT_FACTOR, standard_limit_table
from forcemap.limits.device_spring import DeviceSuitability, device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.above_bound import confirming_above, far_above, held, points_above, unit_of
from forcemap.maps.below_map import far_below
from forcemap.maps.bounds import PAPER_MARGIN, Bound, ToleranceBound, contradiction, margins, untested_margin, weakness
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import form_chosen
from forcemap.maps.saturation import saturation_doubt
from forcemap.maps.slower_impacts import cover_slower, slow_impacts_missing, slower_impacts, upper_of_slower
from forcemap.speeds.allowance import Allowance

_SCATTERED = 1.05
"""A state whose highest force is more than this many times its mean is noted as scattered. A choice: devices and robots
repeat within 1 to 3 %."""
_WITHIN_SCATTER = 2.0
"""Standard deviations of states about the map, by which one of a held force may fall with speed. A choice."""


@dataclass(frozen=True, eq=False)
class Basis:
    """What speeds rest on: a limit compared with what the impacts allow, and the map with its bound.

    Parameters
    ----------
    limit : ForceLimit or NewtonLimit
        The limit as stated.
    contact : Contact or None
        Kind of contact; None where it is not named.
    newtons : float or array
        The limit [N], of another quantity than the force in its unit; NaN where the standard permits no contact.
    raised : float
        Factor on the bound: for the device's spring, and for a motion off the map's direction.
    refusals : tuple of Finding
        Why no speed may rest on the impacts for this limit; empty if nothing forbids it.
    warnings : tuple of Finding
        What must be said before any speed.
    notes : tuple of Finding
        What else speeds depend on.
    export_refusal : Finding or None
        Why none of the speeds may be exported or released; None if nothing forbids it.
    conditions : Conditions
        The conditions of the measurement; they state the device.
    phase_two : PhaseTwo
        What is known of Phase II.
    bound : Bound or None
        The bound; None before there is a map.
    allowance : Allowance or None
        How far the robot may deviate, subtracted from speeds to program; None before there are speeds.
    source : str
        Where the map comes from.
    slower : float
        Factor c on the bound at the map's lowest speed, for motion slower than the map holds for: a place has a speed
        only where the limit does not lie below it. 0 without slower impacts.
    """

    limit: ForceLimit | NewtonLimit
    contact: Contact | None
    newtons: Any
    raised: float
    refusals: tuple[Finding, ...]
    warnings: tuple[Finding, ...]
    notes: tuple[Finding, ...]
    export_refusal: Finding | None
    conditions: Conditions
    phase_two: PhaseTwo
    bound: Bound | None = None
    allowance: Allowance | None = None
    source: str = ""
    slower: float = 0.0

    @property
    def level(self) -> Any:
        """Force that the bound, not raised, must not exceed [N]: the limit divided by what raises the bound."""
        return self.newtons / self.raised

    @property
    def permitted(self) -> bool:
        """False if the standard permits no contact."""
        return not isinstance(self.limit, ForceLimit) or self.limit.permitted

    @property
    def simulated(self) -> bool:
        """True if the impacts are simulated."""
        return self.conditions.simulated

    @property
    def speed_error(self) -> float:
        """Share by which the speeds of the campaign count lower than it states them; NaN, and 0, if not stated."""
        return self.conditions.speed_error

    @property
    def measure_more(self) -> bool:
        """True if more has to be measured first: the form does not fit, and no bound may cover that."""
        return any(each.kind is FindingKind.FORM_DOUBTED for each in self.warnings)

    @property
    def refusal(self) -> Finding | None:
        """Why no place has a speed, whatever the bound; None if nothing forbids it."""
        return self.refusals[0].and_(*self.refusals[1:]) if self.refusals else None

    @property
    def unseen(self) -> tuple[Finding, ...]:
        """What was not measured of Phase II, where that matters."""
        measured = self.contact is not Contact.TRANSIENT or self.phase_two.complete or not self.permitted
        return () if measured else (self.phase_two.finding,)

    @property
    def limit_finding(self) -> Finding:
        """The limit and its contact."""
        if isinstance(limit := self.limit, ForceLimit):
            figures = {"limit_N": self.newtons if limit.permitted else None, "contact": str(self.contact)}
            return Finding.of(FindingKind.LIMIT_OF_AREA, **figures, limit=str(limit))
        parts = {"quasi_static_N": limit.quasi_static, "spring_N_per_m": limit.spring_N_per_m}
        return Finding.of(FindingKind.LIMIT_IN_NEWTONS, contact=str(self.contact or ""), **parts)

    def warnings_beyond(self, other: Basis) -> tuple[Finding, ...]:
        """Its warnings that another basis does not have."""
        return tuple(each for each in self.warnings if each not in other.warnings)

    @property
    def statements(self) -> tuple[Finding, ...]:
        """Everything that speeds depend on."""
        source = [] if self.bound is None else [Finding.of(FindingKind.MAP_SOURCE, source=self.source)]
        bound = [] if self.bound is None else [Finding.of(FindingKind.BOUND, bound=str(self.bound))]
        limit = Finding.of(FindingKind.LIMIT, self.limit_finding)
        overshoot = [] if self.allowance is None else [self.allowance.of_speed]
        free = [Finding.of(FindingKind.TRANSIENT_FREE)] if self.contact is Contact.TRANSIENT and self.permitted else []
        of_limit = (self.phase_two.finding, limit, *free, *bound)
        return (*self.conditions.findings, *overshoot, *source, *of_limit, *self.notes)


def basis_of(
    force_map: ForceMap,
    limit: ForceLimit | NewtonLimit | ArrayLike,
    *,
    bound: Bound,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
    angle: float = 0.0,
) -> Basis:
    """Compare a limit with what a map rests on; arguments and errors as in `safe_speed`."""
    if isinstance(bound, type) or not isinstance(bound, Bound):
        raise InputError(f"bound: found {bound!r}, expected FixedMargin or ToleranceBound")
    bound.require(force_map)
    if not isinstance(limit, ForceLimit):
        limit = NewtonLimit.of(limit, quasi_static_limit, spring_N_per_m)
    elif quasi_static_limit is not None or spring_N_per_m is not None:
        raise InputError("limit: quasi_static_limit and spring_N_per_m go with a limit in newtons, not with an area")
    basis = _of_map(force_map, limit, contact)
    if isinstance(limit, NewtonLimit) and not basis.refusals:
        _require_contact(force_map, limit, contact)
    if not (basis.refusals and (math.isnan(force_map.device_range) or force_map.binding.refusal)):
        _require_measured(force_map, basis.newtons)
    off_axis = raised_off_axis(angle)
    kind = FindingKind.RAISED_OFF_AXIS if off_axis > 1 else FindingKind.ALONG_ONLY
    off: dict[str, Any] = {"off_mps": None, "no_off": None}  # at a contact point these are told
    direction = Finding.of(kind, widest_deg=WIDEST_ANGLE, angle_deg=angle, raised=RAISED_OFF_AXIS - 1, **off)
    transfer = fit.transfer if (fit := force_map.fit) else None
    weak, contradicted = weakness(bound, force_map), contradiction(force_map, bound)
    slower = cover_slower(force_map)
    confirmed, not_borne_out = _confirmed(force_map, limit, basis.contact, bound)
    raised = basis.raised * off_axis
    exceeded, refuses = (None, None) if weak else _measured_above(force_map, bound, basis.newtons, raised)
    at_points, refuse = (None, False) if weak else points_above(force_map, bound)
    against = (at_points if refuse else None) or far_above(force_map, bound)
    measured = tuple(filter(None, (slower.refusal, contradicted, refuses, against)))
    notes = map_notes(force_map, bound, confirmed)
    return replace(
        basis,
        raised=raised,
        slower=slower.raised,
        refusals=basis.refusals or measured,
        warnings=(
            *(each for each in (exceeded, at_points) if each and (basis.refusals or each not in measured)),
            *filter(None, (not_borne_out, weak or untested_margin(bound, force_map))),
            *(note for note in notes if note.kind is FindingKind.SLOWER_THAN_RAISED and off_axis > 1),
            *(transfer.warnings if transfer else ()),
            *basis.warnings,
            *_clamping_unseen(basis),
            *([] if basis.refusals or measured else unconfirmed(notes)),
            *basis.conditions.doubts,
            *own_limits_unused(limit, force_map.conditions),
            *_unchecked_units(force_map),
            *(contradictions(_as_stated(fit.states, force_map.conditions)) if fit else ()),
            *doubts_of_fit(force_map),
        ),
        notes=(*basis.notes, *(transfer.findings if transfer else ()), direction, *notes),
        export_refusal=exceeded or against or not_borne_out or weak or basis.export_refusal,
        bound=bound,
        source=force_map.source,
    )


def unconfirmed(notes: Iterable[Finding]) -> list[Finding]:
    """That nobody has measured whether a map holds at the speeds that it permits, of what these rest on."""
    return [note for note in notes if note.kind in (FindingKind.NOT_CONFIRMED, FindingKind.NOT_CONFIRMED_YET)]


def _confirmed(
    force_map: ForceMap, limit: ForceLimit | NewtonLimit, contact: Contact | None, bound: Bound
) -> tuple[Finding | None, Finding | None]:
    """What the impacts that were to confirm a map show, and the same if it is that they do not bear it out."""
    found = force_map.confirmed(limit, contact, bound) if force_map.confirmed else None
    failed = found is not None and found.kind is FindingKind.NOT_BORNE_OUT
    return found, found if failed else None


def _clamping_unseen(basis: Basis) -> list[Finding]:
    """Warnings where a transient limit is used though Phase II of some impacts is not known, or forces sink slowly."""
    unrecorded = basis.phase_two.unrecorded if basis.phase_two.recorded else 0
    unseen = [Finding.of(FindingKind.CLAMPING_UNSEEN, unrecorded=unrecorded)] if basis.unseen else []
    return [*unseen, *filter(None, [basis.phase_two.doubt])]


def own_limits_unused(limit: ForceLimit | NewtonLimit, conditions: Conditions) -> list[Finding]:
    """That the limits are the standard's although the campaign names a file of its own, whose limits may be lower."""
    if not (isinstance(limit, ForceLimit) and conditions.limit_table.lower().endswith(".csv")):
        return []
    if limit.sha256 != standard_limit_table().sha256:
        return []
    return [Finding.of(FindingKind.OTHER_LIMITS, table=conditions.limit_table, editions=limit.edition)]


def _of_map(force_map: ForceMap, limit: ForceLimit | NewtonLimit, contact: Contact | None) -> Basis:
    """Compare a limit with what the impacts of a map rest on; a map of another quantity alone is refused."""
    if force_map.quantity is not Quantity.FORCE:
        expected = "which permits nothing; expected one of the force, fitted to the same table"
        raise InputError(f"map: found a map of the {force_map.quantity.words} alone, {expected}")
    return limit_basis(
        limit,
        contact,
        force_map.conditions,
        phase_two=force_map.phase_two,
        binding=force_map.binding,
        clamping_mapped=force_map.other(Quantity.CLAMPING_FORCE) is not None,
    )


def exceeded_where_permitted(force_map: ForceMap, bound: Bound, limit: Any, raised: float) -> Finding | None:
    """States that measured more than a limit although the bound permits their speed at their place; None without any.

    Test states count, as those that were to confirm the map, and those slower than any that was fitted there; so do
    impacts at contact points alone. That the bound allows for some of them is no reason to release a speed at which a
    measurement exceeded the limit.

    Parameters
    ----------
    force_map : ForceMap
    bound : Bound
        One that the map can carry.
    limit : float or array
        In the unit of the map's quantity; NaN where no contact is permitted.
    raised : float
        Factor on the bound.
    """
    limits = np.unique(np.asarray(limit, dtype=np.float64))
    found = [each for each in exceedances(force_map, bound, limits, raised) if each.limits.any()]
    if not found:
        return None
    found.sort(key=lambda each: -each.force)
    highest = found[0]
    return highest.finding(force_map, limits, names=tuple(dict.fromkeys(each.name for each in found)))


@dataclass(frozen=True, eq=False)
class Exceedance:
    """A measured state that exceeds limits where the bound permits its speed.

    Parameters
    ----------
    name : str
        Of the state.
    force : float
        Its largest force, or what it reached at least; in the unit of the map's quantity.
    place : tuple of float
        Distance [m], height [m] and speed [m/s].
    limits : array of bool, shape (n,)
        Which of the limits that were asked for.
    """

    name: str
    force: float
    place: tuple[float, float, float]
    limits: Mask

    def finding(self, force_map: ForceMap, limits: FloatArray, *, names: tuple[str, ...]) -> Finding:
        """That it, the highest of several with `names`, exceeded the lowest of these limits, shape (n,)."""
        where: dict[str, float | None] = dict(zip(("distance_m", "height_m", "speed_mps"), self.place, strict=True))
        if self.place[2] <= SPEED_NOT_STATED:
            where["speed_mps"] = None
        figures = {"names": names, "force_N": self.force, "limit": float(limits[self.limits].min())}
        return Finding.of(FindingKind.EXCEEDED_WHERE_PERMITTED, **figures, **where, **unit_of(force_map.quantity))


def exceedances(force_map: ForceMap, bound: Bound, limits: FloatArray, raised: float) -> Iterator[Exceedance]:
    """Every measured state inside the range that lies above the bound there, and the limits between the two.

    The arguments are those of `exceeded_where_permitted`; limits of shape (n,).
    """
    for group in force_map.fit.measured if force_map.fit and not np.isnan(limits).all() else ():
        counts, speed = held(force_map, group)  # slower than was fitted there: permitted if the slowest fitted speed is
        inside, speed = group.select(counts), speed[counts]
        measured = np.fmax(inside.highest, inside.at_least)
        at_place = inside.distance, inside.height
        slower = np.where(inside.slowest < speed, upper_of_slower(force_map, bound, *at_place), 0.0)
        upper = raised * np.maximum(bound.upper(force_map, *at_place, speed), slower)
        for i in np.flatnonzero(measured > upper):
            place = float(inside.distance[i]), float(inside.height[i]), float(inside.slowest[i])
            between = (limits >= upper[i]) & (limits < measured[i])
            yield Exceedance(str(inside.name[i]), float(measured[i]), place, between)


def confirming_states(force_map: ForceMap) -> States:
    """The states that were measured to confirm a map, and that it holds for."""
    return force_map.tested.select(force_map.tested.confirms)


def _measured_above(
    force_map: ForceMap, bound: Bound, newtons: Any, raised: float
) -> tuple[Finding | None, Finding | None]:
    """What was measured above the limit or the bound, and what of it refuses every speed: of several limits each does
    for itself."""
    above = confirming_above(force_map, bound)
    exceeded = exceeded_where_permitted(force_map, bound, newtons, raised) or above
    return exceeded, exceeded if np.ndim(newtons) == 0 else above


def against_bound(force_map: ForceMap, bound: Bound) -> tuple[Finding, ...]:
    """What measurements say against a map with a bound, whatever the limit; none of a bound that it cannot carry.

    Of the maps of other quantities of the same impacts, too.
    """
    others = (of_quantity(other.quantity, each) for other in force_map.others for each in against_bound(other, bound))
    try:
        bound.require(force_map)
    except BoundNotAvailable:
        return tuple(others)
    found = (
        *(contradiction(force_map, bound), confirming_above(force_map, bound)),
        *(points_above(force_map, bound)[0], far_above(force_map, bound)),
    )
    return (*filter(None, found), *others)


def of_quantity(quantity: Quantity, finding: Finding) -> Finding:
    """A finding, said of a quantity; that of the force as it is."""
    if quantity is Quantity.FORCE:
        return finding
    return Finding.of(FindingKind.OF_QUANTITY, finding, quantity=quantity.words)


def doubts_of_fit(force_map: ForceMap) -> tuple[Finding, ...]:
    """Doubts about a map: impacts that were taken out, its form, and the drift that states measured again show."""
    tested, drift = force_map.form_test, force_map.fit.drift if force_map.fit else None
    excluded = force_map.binding.reason if force_map.binding.state is BindingState.BOUND else None
    apart = force_map.fit.disagreeing if force_map.fit else ()
    saturated = force_map.fit is not None and force_map.fit.between_states.degrees_of_freedom == 0
    return (
        *([excluded] if excluded else []),
        *([Finding.of(FindingKind.NO_RESIDUALS)] if saturated else []),
        *([Finding.of(FindingKind.REPEATS_DISAGREE, names=apart, apart=DISAGREEMENT - 1)] if apart else []),
        *filter(None, (slower_impacts(force_map), slow_impacts_missing(force_map))),
        *([below] if (below := far_below(force_map, force_map.tested)) else []),
        *_falls(force_map),
        *(tested.warnings if tested else ()),
        *([drift.finding] if drift and drift.significant else []),
    )


def _falls(force_map: ForceMap) -> tuple[Finding, ...]:
    """Where the prediction falls most with speed; nothing of a map that rises, or of a held force within scatter."""
    if force_map.rises_with_speed:
        return ()
    distance, height, speed = force_map.steepest_fall
    held = force_map.quantity is Quantity.CLAMPING_FORCE
    # which hardly depends on speed: its terms of speed fit the scatter
    if held and force_map.fit and force_map.largest_fall <= _WITHIN_SCATTER * force_map.fit.state_sd:
        return ()
    where = {"distance_m": distance, "height_m": height, "speed_mps": speed, "form_helps": None if held else True}
    return (Finding.of(FindingKind.FALLS_WITH_SPEED, **where),)


def limit_basis(
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
    conditions: Conditions,
    *,
    phase_two: PhaseTwo,
    binding: Binding,
    clamping_mapped: bool = False,
) -> Basis:
    """Compare a limit with what impacts rest on, before there is a map.

    Parameters
    ----------
    limit : ForceLimit or NewtonLimit
    contact : Contact or None
        Kind of contact; required with a ForceLimit.
    conditions : Conditions
        The conditions of the measurement; they state the device.
    phase_two : PhaseTwo
        What is known of Phase II.
    binding : Binding
        Whether the impacts are what their recordings gave.
    clamping_mapped : bool
        True if the quasi-static limit is held against a map of the clamping force, too.

    Raises
    ------
    InputError
        `contact` is missing.
    """
    kind = None if contact is None else Contact.parse(contact)
    error, suits = conditions.device.error_or_default, DeviceSuitability()
    broken = binding.refusal
    unbound = binding.reason if binding.state is BindingState.UNBOUND else None
    first: tuple[Finding, ...] = ()
    if isinstance(limit, ForceLimit):
        if kind is None:
            raise InputError("contact: expected transient or quasi-static, which of the limits of a body area to use")
        newtons: Any = limit.force(kind) if limit.permitted else math.nan
        lowest, quasi_static, first = newtons, limit.tabulated_quasi_static, limit.doubts
        suits = device_suitability(limit.name, limit.stiffness, conditions.device.stiffness)
    else:
        newtons = limit.force
        lowest = float(np.min(newtons)) if np.size(newtons) else math.inf
        quasi_static = math.inf if limit.quasi_static is None else limit.quasi_static
        if limit.spring_N_per_m is None:
            first = (Finding.of(FindingKind.DEVICE_ALONE),)
        else:
            suits = device_suitability("the limit", limit.spring_N_per_m, conditions.device.stiffness)
    if kind is Contact.TRANSIENT:
        clamping = phase_two.transient_refusal(quasi_static, error, suits.raised)
    else:
        mapped = clamping_mapped and kind is Contact.QUASI_STATIC
        clamping = phase_two.quasi_static_refusal(lowest, error, suits.raised, mapped=mapped)
    refusals = [broken, suits.refusal, clamping]
    if isinstance(limit, ForceLimit) and not limit.permitted:
        refusals = [limit.refusal]
    return Basis(
        limit=limit,
        contact=kind,
        newtons=newtons,
        raised=suits.raised,
        refusals=tuple(refusal for refusal in refusals if refusal),
        warnings=(*first, *([unbound] if unbound else [])),
        notes=(suits.statement,) if suits.statement else (),
        export_refusal=broken or (None if isinstance(limit, ForceLimit) else next(iter(first), None)),
        conditions=conditions,
        phase_two=phase_two,
    )


def _as_stated(states: States, conditions: Conditions) -> States:
    """States with the speeds that the campaign states, as in their names."""
    return replace(states, speed=conditions.as_stated(states.speed), slowest=conditions.as_stated(states.slowest))


def _unchecked_units(force_map: ForceMap) -> list[Finding]:
    """A warning if the units of the forces and speeds of a fitted map could not be checked."""
    if (fit := force_map.fit) is None:
        return []
    units = unit_finding(force_map.conditions, *fit.of_table)
    return [units] if units and units.kind is FindingKind.UNITS_NOT_CHECKED else []


def map_notes(force_map: ForceMap, bound: Bound, confirmed: Finding | None = None) -> list[Finding]:
    """What a reader of the speed must know about the map and the bound, and what impacts that confirm it show."""
    kind, notes, fit = FindingKind, [], force_map.fit

    def note(kind: FindingKind, holds: Any = True, **figures: Any) -> None:
        if holds:
            notes.append(Finding.of(kind, **figures))

    note(kind.PERSON_AT_REST)
    note(kind.AROUND_THE_BASE)
    note(kind.AS_IT_STOOD)
    measured = np.concatenate([force_map.measured_range.lowest[2:], *(s.speed for s in (fit.of_table if fit else ()))])
    lowest, stated = float(measured.min()), float(force_map.conditions.as_stated(measured).min())
    slowest = {"lowest_mps": lowest, "stated_mps": stated if stated > lowest else None}
    note(kind.SLOWER_UNMEASURED, not (len(force_map.slower) or slow_impacts_missing(force_map)), **slowest)
    note(kind.PRESSURE_NOT_ASSESSED)
    note(kind.DEVICE_RANGE_NOT_STATED, math.isnan(force_map.device_range))
    device = force_map.conditions.device
    note(kind.DEVICE_ERROR_NOT_STATED, math.isnan(device.error), assumed_N=device.error_or_default)
    if isinstance(bound, ToleranceBound):
        too_small = int(np.sum(margins(bound, force_map) > PAPER_MARGIN))
        states = len(force_map.measured_range.points)
        note(kind.PAPER_MARGIN_TOO_SMALL, too_small, count=too_small, states=states)
        note(kind.BOUND_OF_FORM, not ((tested := force_map.form_test) and tested.misses))
    notes += form_chosen(force_map.form.name) if fit else []
    begins = float(force_map.measured_range.lowest[2])  # at contact, whatever was stated
    slow = begins < RAISED_FROM - StateTolerance().speed
    factors = {"from_mps": RAISED_FROM, "raised": RAISED_OFF_AXIS - 1, "slower": RAISED_SLOWER}
    note(kind.SLOWER_THAN_RAISED, slow, lowest_mps=begins, **factors)
    if fit is None:
        return notes
    notes.append(confirmed or Finding.of(kind.NOT_CONFIRMED, made=len(confirming_states(force_map)) or None))
    sites = tuple(f"{site} ({count} up to {force:.0f} N)" for site, count, force in fit.other_sites)
    note(kind.OTHER_SITES, sites, sites=sites)
    scattered = int(np.sum(np.fmax(fit.states.highest, fit.states.at_least) > _SCATTERED * fit.states.force))
    note(kind.SCATTERED, scattered, states=scattered)
    censored = fit.censored_samples + int(fit.test.censored.sum() + fit.slower.censored.sum())
    doubt = saturation_doubt(fit.states.highest, fit.states.name, censored=censored)
    notes += [doubt] if doubt else []
    if fit.censored_samples and not fit.censored_fit:
        wholly = fit.left_out.select(fit.left_out.impacts == 0).name
        note(kind.CENSORED_NOT_IN_FIT, impacts=fit.censored_samples, left_out=", ".join(wholly))
    note(kind.CENSORED_IN_FIT, fit.censored_samples and fit.censored_fit, impacts=fit.censored_samples)
    tested = force_map.form_test
    return [*notes, tested.finding] if tested and tested.misses and tested.covered else notes


def _require_contact(force_map: ForceMap, limit: NewtonLimit, contact: Contact | None) -> None:
    """Refuse a limit in newtons that does not say what Phase II must be compared with.

    The contact may stay unnamed only where all impacts are known to be over within 0.5 s and to leave no force above
    half of the limit, the smallest quasi-static part that a limit of the standard has.
    """
    phase_two, kind = force_map.phase_two, None if contact is None else Contact.parse(contact)
    lowest = float(np.min(limit.force)) if np.size(limit.force) else math.inf
    if kind is None:
        over = phase_two.complete and not phase_two.barred
        largest = phase_two.largest_force + force_map.conditions.device.error_or_default
        if not over or largest > lowest / MAX_TRANSIENT_FACTOR:
            why = f"{phase_two.barred} impacts clamp, or may" if phase_two.barred else "Phase II not measured"
            why = why if not over else f"a Phase II force of {phase_two.largest_force:.1f} N"
            raise InputError(
                "contact: expected transient or quasi-static (--contact) beside a limit in newtons, because this map "
                f"is not known to be free of clamping ({why})"
            )
    elif kind is Contact.TRANSIENT and limit.quasi_static is None and not math.isnan(phase_two.largest_force):
        raise InputError(
            "quasi-static limit: expected it beside a transient limit in newtons (--quasi-static-limit-N, "
            "quasi_static_limit=), to hold the measured Phase II forces against it"
        )
    elif kind is Contact.QUASI_STATIC and limit.quasi_static not in (None, lowest):
        raise InputError("quasi-static limit: expected none beside a limit that is quasi-static itself")


def _require_measured(force_map: ForceMap, newtons: Any) -> None:
    """Refuse a limit [N] above what the device can confirm: nothing above was ever measured."""
    error = force_map.conditions.device.error_or_default
    highest = force_map.highest_force - error
    if np.any(np.asarray(newtons) > highest):
        found = f"force limit: found {np.max(newtons):g} N, expected at most {highest:g} N"
        if math.isnan(force_map.device_range):
            way = "state device.range_N in a campaign.toml beside the impacts, and fit again"
            said = (
                f"the largest force measured less the device's error of {error:g} N, for the device range is not stated"
            )
            raise InputError(f"{found}, {said}; {way}")
        whole = force_map.conditions.device.range
        what = "the device range"
        if whole > force_map.highest_force:
            what = (
                f"the force at which impacts look cut off, below the device range of {whole:g} N (collect names them),"
            )
        raise InputError(f"{found}, {what} less its error of {error:g} N; nothing above was ever measured")
