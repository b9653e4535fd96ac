"""What of a force limit a map may be held against: one gate for every speed, whatever is typed.

Before any bound is looked at: is the impacts table what its recordings gave, is the device stiff enough for the body
area, does Phase II allow the kind of contact? What raises the bound (the device's spring, a motion off the map's
direction), what must be said first, and what forbids an export follow from the same look.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.campaigns.dataset import Binding, BindingState, Conditions, PhaseTwo
from forcemap.errors import InputError
from forcemap.limits.body_areas import MAX_TRANSIENT_FACTOR
from forcemap.limits.device_spring import DEVICE_ALONE, DeviceSuitability, device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound, weakness
from forcemap.maps.direction import RAISED_OFF_AXIS, WIDEST_ANGLE, raised_off_axis
from forcemap.maps.force_map import ForceMap


@dataclass(frozen=True)
class UsableLimit:
    """A force limit as impacts may be held against it.

    Parameters
    ----------
    newtons : float or array
        The limit [N], as stated.
    raised : float
        Factor on the bound: for the device's spring, and for a motion off the map's direction.
    refusal : str
        Why no speed may rest on the impacts for this limit; empty if nothing forbids it.
    unseen : str
        What of Phase II was not measured; empty if all was, or it does not matter.
    words : str
        The limit, a line for the assumptions.
    warnings : tuple of str
        What must be said before any speed.
    statements : tuple of str
        What else speeds depend on, a line each.
    export_refusal : str
        Why no program or table may be made of the speeds; empty if nothing forbids it.
    """

    newtons: Any
    raised: float
    refusal: str
    unseen: str
    words: str
    warnings: tuple[str, ...]
    statements: tuple[str, ...]
    export_refusal: str

    @property
    def level(self) -> Any:
        """What the bound as it stands must not exceed [N]: the limit less what raises the bound."""
        return self.newtons / self.raised


def usable_limit(
    force_map: ForceMap,
    limit: ForceLimit | NewtonLimit | ArrayLike,
    *,
    bound: Bound,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
    angle: float = 0.0,
) -> UsableLimit:
    """Hold a limit against what a map rests on; arguments and errors as in `safe_speed`."""
    if isinstance(bound, type) or not isinstance(bound, Bound):
        raise InputError(f"bound: found {bound!r}, expected FixedMargin or ToleranceBound")
    bound.require(force_map)
    if not isinstance(limit, ForceLimit):
        limit = NewtonLimit.of(limit, quasi_static_limit, spring_N_per_m)
    elif quasi_static_limit is not None or spring_N_per_m is not None:
        raise InputError("limit: quasi_static_limit and spring_N_per_m go with a limit in newtons, not with an area")
    usable = limit_for(limit, contact, force_map.conditions, phase_two=force_map.phase_two, binding=force_map.binding)
    if isinstance(limit, NewtonLimit) and not usable.refusal:
        _require_contact(force_map, limit, contact)
    if not (usable.refusal and math.isnan(force_map.device_range)):
        _require_measured(force_map, usable.newtons)
    weak, off_axis = weakness(bound, force_map), raised_off_axis(angle)
    tilted = (
        f"motion up to {angle:g} degrees off the map's direction: forces raised by {100 * (off_axis - 1):.0f} %"
        if off_axis > 1
        else f"ONLY for motion straight along the map's direction: up to {WIDEST_ANGLE:g} degrees off it forces count "
        f"{100 * (RAISED_OFF_AXIS - 1):.0f} % higher, which is not in this speed; beyond that no speed holds"
    )
    return replace(
        usable,
        raised=usable.raised * off_axis,
        warnings=(*([weak] if weak else []), *usable.warnings),
        statements=(*usable.statements, tilted),
        export_refusal=weak or usable.export_refusal,
    )


def limit_for(
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
    conditions: Conditions,
    *,
    phase_two: PhaseTwo,
    binding: Binding,
) -> UsableLimit:
    """Hold a limit against what impacts rest on, before there is a map.

    Parameters
    ----------
    limit : ForceLimit or NewtonLimit
    contact : Contact or None
        Kind of contact; expected with a ForceLimit.
    conditions : Conditions
        What the impacts are measured under; they state the device.
    phase_two : PhaseTwo
        What is known of Phase II.
    binding : Binding
        Whether the impacts are what their recordings gave.

    Raises
    ------
    InputError
        `contact` is missing.
    ContactNotPermitted
        The standard permits no contact with the body area.
    """
    kind = None if contact is None else Contact.parse(contact)
    device = conditions.device
    suits, warnings, no_export = DeviceSuitability(1.0, "", ""), [], binding.refusal
    if isinstance(limit, ForceLimit):
        if kind is None:
            raise InputError("contact: expected transient or quasi-static, which of the limits of a body area to use")
        newtons: Any = limit.force(kind)
        lowest, quasi_static = newtons, limit.quasi_static
        suits = device_suitability(limit.name, limit.stiffness, device.stiffness)
        words = f"limit: {newtons:g} N, {kind} contact, {limit}"
        warnings += [limit.head_statement] if limit.head_statement else []
    else:
        newtons = limit.force
        lowest = float(np.min(newtons)) if np.size(newtons) else math.inf
        quasi_static = math.inf if limit.quasi_static is None else limit.quasi_static
        if limit.spring_N_per_m is None:
            warnings, no_export = [DEVICE_ALONE], no_export or DEVICE_ALONE
        else:
            suits = device_suitability("the limit", limit.spring_N_per_m, device.stiffness)
        words = f"limit: given in newtons by the user{f', {kind} contact' if kind else ''}"
        words += "" if limit.quasi_static is None else f", quasi-static part {quasi_static:g} N"
        words += "" if limit.spring_N_per_m is None else f", for a spring of {limit.spring_N_per_m / 1000:g} N/mm"
    if kind is Contact.TRANSIENT:
        why = phase_two.transient_refusal(quasi_static, device.error_or_default, suits.raised)
        gate = f"no transient limit may be used: {why}" if why else ""
    else:
        gate = phase_two.quasi_static_refusal(lowest, device.error_or_default, suits.raised)
    warnings += [binding.reason] if binding.state is BindingState.UNBOUND else []
    return UsableLimit(
        newtons=newtons,
        raised=suits.raised,
        refusal="; ".join(why for why in (binding.refusal, suits.refusal, gate) if why),
        unseen="" if kind is not Contact.TRANSIENT or phase_two.complete else phase_two.statement(),
        words=words,
        warnings=tuple(warnings),
        statements=(suits.statement,) if suits.statement else (),
        export_refusal=no_export,
    )


def _require_contact(force_map: ForceMap, limit: NewtonLimit, contact: Contact | None) -> None:
    """Refuse a limit in newtons of which is not said what Phase II has to be held against.

    Unnamed contact is taken only where impacts are known to be over within 0.5 s and to leave no force above half of
    the limit, the smallest quasi-static part that a limit of the standard has.
    """
    phase_two, kind = force_map.phase_two, None if contact is None else Contact.parse(contact)
    lowest = float(np.min(limit.force)) if np.size(limit.force) else math.inf
    if kind is None:
        over = phase_two.complete and not phase_two.barred
        held = phase_two.largest_force + force_map.conditions.device.error_or_default
        if not over or held > lowest / MAX_TRANSIENT_FACTOR:
            raise InputError(
                "contact: expected transient or quasi-static (--contact) beside a limit in newtons, because this map "
                f"is not known to be free of clamping ({phase_two.statement()})"
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
    highest = force_map.highest_force - force_map.conditions.device.error_or_default
    if np.any(np.asarray(newtons) > highest):
        what = "the range of the measuring device"
        if math.isnan(force_map.device_range):
            what = "the largest force that was measured, because the device range is not stated,"
        raise InputError(
            f"force limit: found {np.max(newtons):g} N, expected at most {highest:g} N, {what} less its error; nothing "
            f"above was ever measured"
        )
