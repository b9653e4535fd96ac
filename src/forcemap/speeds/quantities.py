"""Other quantities beside the force: which of them a limit names, and what speeds of all of them together rest on."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forcemap.campaigns.dataset import Quantity
from forcemap.errors import BoundNotAvailable, InputError
from forcemap.findings import Finding, FindingKind
from forcemap.limits.body_areas import PASCALS
from forcemap.limits.force_limits import PHASE_TWO_SHARE, Contact, ForceLimit, NewtonLimit
from forcemap.maps.above_bound import confirming_above, far_above, points_above
from forcemap.maps.bounds import Bound, contradiction, weakness
from forcemap.maps.force_map import ForceMap
from forcemap.maps.slower_impacts import cover_slower
from forcemap.speeds.basis import Basis, basis_of, doubts_of_fit, exceeded_where_permitted, map_notes, of_quantity

_OF_FORCE = (FindingKind.PRESSURE_NOT_ASSESSED, FindingKind.DEVICE_ERROR_NOT_STATED)


@dataclass(frozen=True, eq=False)
class QuantityCase:
    """A map and what a limit asks of it.

    Parameters
    ----------
    force_map : ForceMap
        The map of the quantity.
    basis : Basis
        Its limit, in the unit of the quantity, and what raises its bound.
    """

    force_map: ForceMap
    basis: Basis

    @property
    def quantity(self) -> Quantity:
        """The quantity."""
        return self.force_map.quantity


def cases_of(force_map: ForceMap, limit: Any, *, bound: Bound, **stated: Any) -> tuple[QuantityCase, ...]:
    """The force, with what speeds of all quantities rest on, and the other quantities that the limit names.

    A ForceLimit names pressure; a quasi-static one in newtons or of a body area the clamping force. Where anything
    refuses every speed there is the force alone, with that reason. Arguments and errors as in `safe_speed`.
    """
    of_force = basis_of(force_map, limit, bound=bound, **stated)
    others = [
        QuantityCase(each, basis)
        for each in named_by(force_map, of_force.limit, of_force.contact)
        if (basis := _other_basis(force_map, each, of_force))
    ]
    basis = together(of_force, force_map, others)
    return (
        (QuantityCase(force_map, basis),)
        if basis.refusal or not basis.permitted
        else (QuantityCase(force_map, basis), *others)
    )


def named_by(
    force_map: ForceMap, limit: ForceLimit | NewtonLimit | float, contact: Contact | None
) -> tuple[ForceMap, ...]:
    """The maps of other quantities that a limit names, so that speeds rest on them, too: pressure one of a body area,
    the clamping force a quasi-static one."""
    held = contact is not None and Contact.parse(contact) is Contact.QUASI_STATIC
    named = {Quantity.PRESSURE: isinstance(limit, ForceLimit), Quantity.CLAMPING_FORCE: held}
    return tuple(other for other in force_map.others if named[other.quantity])


def together(of_force: Basis, force_map: ForceMap, others: Iterable[QuantityCase]) -> Basis:
    """What speeds of the force and of other quantities together rest on."""
    refusals, warnings, notes = [*of_force.refusals], [*of_force.warnings], [*of_force.notes]
    export_refusal, names_pressure = of_force.export_refusal, isinstance(of_force.limit, ForceLimit)
    if names_pressure and of_force.permitted and force_map.unmapped:
        refusals.append(force_map.unmapped)
    for case in others:
        refusals += [of_quantity(case.quantity, why) for why in case.basis.refusals]
        said = [of_quantity(case.quantity, why) for why in case.basis.warnings]
        warnings = [*said, *warnings] if case.basis.export_refusal else [*warnings, *said]
        if case.basis.export_refusal:
            export_refusal = export_refusal or of_quantity(case.quantity, case.basis.export_refusal)
        if case.quantity is Quantity.PRESSURE:
            notes = [note for note in notes if note.kind is not FindingKind.PRESSURE_NOT_ASSESSED]
        notes += case.basis.notes[:1] + tuple(of_quantity(case.quantity, why) for why in case.basis.notes[1:])
    found: dict[str, Any] = {"refusals": tuple(refusals), "warnings": tuple(warnings), "notes": tuple(notes)}
    return replace(of_force, **found, export_refusal=export_refusal)


def _other_basis(force_map: ForceMap, other: ForceMap, of_force: Basis) -> Basis | None:
    """What the speeds of a quantity that the limit names rest on; None if the limit permits none anyway.

    What the binding, the device's spring and Phase II forbid, the force's basis says for all.
    """
    assert of_force.bound is not None
    limit, bound, states = of_force.limit, of_force.bound, len(other.require_fit().states)
    figures: dict[str, Any] = {"states": states, "without": other.without}
    if other.quantity is Quantity.PRESSURE:
        assert isinstance(limit, ForceLimit)
        if not limit.permitted or of_force.contact is None:
            return None
        newtons, note, raised = _pressure(force_map, other, limit, of_force, figures)
    else:
        if not of_force.permitted:
            return None
        newtons, raised = of_force.newtons, of_force.raised
        note = Finding.of(FindingKind.CLAMPING_FORCE_ASSESSED, limit=float(np.min(newtons)), **figures)
    slower, refusals, measured, at_points = cover_slower(other), list[Finding](), None, None
    try:
        bound.require(other)
    except BoundNotAvailable as error:
        if other.quantity is Quantity.CLAMPING_FORCE and _below_limit(force_map, of_force):
            return None
        refusals.append(Finding.of(FindingKind.WORDS, words=error.message))
    else:
        if other.quantity is Quantity.PRESSURE:
            _require_within(newtons, other, other.highest_force * of_force.raised / raised)
        at_points, refuse = points_above(other, bound)
        measured = confirming_above(other, bound) or (at_points if refuse else None) or far_above(other, bound)
        refusals += filter(None, (slower.refusal, contradiction(other, bound), measured))
    weak = None if refusals else weakness(bound, other)
    exceeded = None if refusals or weak else exceeded_where_permitted(other, bound, newtons, raised)
    notes = [] if refusals else map_notes(other, bound)
    notes = [each for each in notes if each not in of_force.notes and each.kind not in _OF_FORCE]
    alone = exceeded if np.ndim(newtons) == 0 else None  # of several limits each refuses for itself
    refusals += [alone] if alone else []
    said = (None if alone else exceeded, None if at_points in refusals else at_points, weak)
    return replace(
        of_force,
        newtons=newtons,
        raised=raised,
        slower=slower.raised,
        refusals=tuple(refusals),
        warnings=(*filter(None, said), *doubts_of_fit(other)),
        notes=(note, *notes),
        export_refusal=exceeded or measured or weak,
    )


def _below_limit(force_map: ForceMap, of_force: Basis) -> bool:
    """True if no clamping force that was recorded may exceed the quasi-static limit: then no map of it is needed."""
    error, lowest = force_map.conditions.device.error_or_default, float(np.min(of_force.newtons))
    return force_map.phase_two.quasi_static_refusal(lowest, error, of_force.raised) is None


def _pressure(
    force_map: ForceMap, other: ForceMap, limit: ForceLimit, of_force: Basis, figures: dict[str, Any]
) -> tuple[float, Finding, float]:
    """The limit of pressure [N/cm^2], what it is and rests on, and the factor on the bound.

    A film's error is a share that all of its readings may have in common, so it raises the bound. Beside a transient
    contact whose Phase II leaves a force, the pressure that goes on is not known: a film keeps the largest of all. Then
    all of it is held against the quasi-static limit.
    """
    film, phase_two = force_map.conditions.film, other.phase_two
    least = float(np.nanmin(force_map.require_fit().states.force))
    contact, goes_on = of_force.contact, phase_two.largest_force > PHASE_TWO_SHARE * least
    instead = contact is Contact.TRANSIENT and goes_on
    assert contact is not None
    pressure = limit.pressure(Contact.QUASI_STATIC if instead else contact) / PASCALS
    note = Finding.of(
        FindingKind.PRESSURE_ASSESSED,
        limit=pressure,
        contact=str(Contact.QUASI_STATIC if instead else contact),
        quasi_static_instead=instead,
        phase2_N=phase_two.largest_force,
        **figures,
        sensor=film.sensor,
        range=film.range,
        error=film.error_or_default,
        error_stated=not math.isnan(film.error),
        mean_over=film.mean_over or math.nan,
        largest=film.mean_over == 0,
        unknown=math.isnan(film.mean_over),
    )
    return pressure, note, of_force.raised * (1 + film.error_or_default)


def _require_within(pressure: float, other: ForceMap, highest: float) -> None:
    """Refuse a limit of pressure [N/cm^2] above the film's range less its error: nothing above was ever measured."""
    if not pressure > highest:
        return
    what = "the range of the film"
    if math.isnan(other.device_range):
        what = (
            "the largest pressure that was measured, because pressure.range_N_per_cm2 is not stated in campaign.toml,"
        )
    raise InputError(
        f"pressure limit: found {pressure:g} N/cm^2, expected at most {highest:.4g} N/cm^2, {what} less its error; "
        "nothing above was ever measured"
    )
