"""Carrying a fitted map over to a changed robot by a few new states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from forcemap.arrays import Mask
from forcemap.campaigns.dataset import ImpactDataset, Quantity, States, StateTolerance
from forcemap.direction import same_direction
from forcemap.errors import BoundNotAvailable, FitError, InputError, TransferRefused, few
from forcemap.findings import Finding, FindingKind
from forcemap.maps.above_bound import confirming_above, far_above, held, highest_above, points_above
from forcemap.maps.bounds import FEW_STATES, ToleranceBound, contradiction
from forcemap.maps.fit import CensoredImpacts, fit_force_map, phase_two_with_points, repeat_variance, states_at_points
from forcemap.maps.force_map import Fit, ForceMap, of_earlier
from forcemap.maps.forms import Form, form_of
from forcemap.maps.map_file import map_sha256, read_map
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.same_impacts import states_alike
from forcemap.maps.slower_impacts import cover_slower
from forcemap.maps.transfer import REFUSED_BELOW, Earlier, Transfer, joint_fit, range_of, usual_shift

EARLIER_MAP = "maps/earlier.json"
"""Where a campaign's folder holds the map that its few states carry over; `plan --transfer` puts it there."""

_EARLIER = " (of the earlier map)"


def campaign_map(
    folder: str | Path,
    dataset: ImpactDataset,
    *,
    form: Form | None = None,
    impacts: CensoredImpacts = CensoredImpacts.AT_LEAST,
) -> ForceMap:
    """The map of a campaign: carried over from the map that its folder holds for that, else fitted.

    Parameters
    ----------
    folder : str or Path
        Folder of the campaign, or a table, beside which no map counts.
    dataset : ImpactDataset
        Its impacts.
    form : Form, optional
        Terms of ln F; as in `fit_force_map` if not given. A map that is carried over has its own.
    impacts : CensoredImpacts
        How censored impacts enter the fit; discarded they cannot be carried over.

    Raises
    ------
    InputError
        Another form or discarded impacts are asked of a map that is carried over; `MapFileError`, the earlier map is
        no map.
    FitError
        As `fit_force_map` and `transfer_map`.
    """
    earlier = Path(folder) / EARLIER_MAP
    if not earlier.is_file():
        return fit_force_map(dataset, form=form, impacts=impacts)
    old_map = read_map(earlier)
    wanted = form_of(dataset.conditions, form) if form or dataset.conditions.form else old_map.form
    if wanted != old_map.form or impacts is not CensoredImpacts.AT_LEAST:
        raise InputError(
            "this campaign carries this map over, with its form and every impact; leave other forms than "
            f"{old_map.form.name} (--form, map.form in campaign.toml) and --discard-censored out, or move the file "
            "away to fit the campaign by itself",
            file=str(earlier),
        )
    return transfer_map(old_map, dataset)


def transfer_map(old_map: ForceMap, dataset: ImpactDataset, *, shift: Form | None = None) -> ForceMap:
    """Carry a fitted map over to a changed robot: new tool, firmware, safety setting, or a sister robot.

    ln F of the new robot = ln F of the earlier map + a shift; all coefficients are fitted together to the states of the
    earlier campaigns and to the new ones, with role train (`joint_fit`). An F test asks whether the shift misses more
    than states scatter. The result is a map like any other, measured where the new states are: its hull is theirs,
    within the earlier map's range. New states outside that range are left out; they still speak against a speed.

    Parameters
    ----------
    old_map : ForceMap
        A fitted map; it may have been carried over itself.
    dataset : ImpactDataset
        The new impacts, at places that no earlier campaign measured: effects that a place keeps would make the shift
        seem to fit better than it does.
    shift : Form, optional
        Terms of the shift; 1, d, h and v if not given, ln v in place of v where the map is linear in ln v.

    Returns
    -------
    ForceMap
        `fit.transfer` says what it was carried over from and how well the shift fits.

    Raises
    ------
    InputError
        The earlier map is published, so its states are not known.
    FitError
        No new impact has role train; new states are those of an earlier campaign; the earlier map's own test states
        contradict it, its forces drifted, or impacts above the device range were discarded from it; the campaigns state
        different directions, or one of them states none.
    BoundNotAvailable
        The earlier map has too few states or places for a tolerance bound of its own.
    TransferRefused
        The new states contradict the shift (p below 0.05).
    TooFewStates, RankDeficient
        The states and their places do not determine map and shift, or nothing is left to tell whether the shift fits.
    """
    slowest = float(np.fmax(dataset.conditions.slowest, old_map.conditions.slowest))
    dataset = replace(dataset, conditions=replace(dataset.conditions, slowest=slowest))
    old, train = old_map.require_fit(), dataset.train
    if not len(train):
        raise FitError("found no impact with role train, expected new states; give role train to the impacts to fit")
    require_sound(old_map)
    _require_direction(old_map, dataset)
    within = _within(old_map, train)
    new, left_out = train.states.select(within), train.states.select(~within)
    if not len(new):
        raise FitError("found no new state within the measured range of the earlier map, expected some")
    earlier = Earlier(
        name=old_map.name,
        map_sha256=map_sha256(old_map),
        states=old.states,
        different=dataset.conditions.changed_from(old_map.conditions),
    )
    chain, form = old.transfer, old.transfer.form if old.transfer else old_map.form
    campaigns = (*(chain.earlier if chain else ()), earlier)
    shifts = (*(chain.shifts if chain else ()), shift or usual_shift(old_map.form))
    variance = max(repeat_variance(train), old.repeat_variance())
    _require_new(new, campaigns, dataset)
    joint = joint_fit(form, [*(each.states for each in campaigns), new], shifts, variance)
    if not joint.p_value >= REFUSED_BELOW:  # unknown, too
        raise _refused(joint.p_value, joint.new)
    near = np.any([new.at_places_of(each.states) for each in campaigns], axis=0)
    transfer = Transfer(form, campaigns, shifts, joint, int(near.sum()))
    conditions = replace(dataset.conditions, simulated=dataset.simulated or old_map.simulated)
    pressures = dataset.pressures or old_map.unmapped or old_map.other(Quantity.PRESSURE)
    measured_range = range_of(new, campaigns)
    return ForceMap(
        name=dataset.source or "carried over",
        form=joint.form,
        coefficients=joint.regression.coefficients,
        measured_range=measured_range,
        fit=Fit(
            states=new,
            test=dataset.again.test.states,
            slower=dataset.slower_train.states.and_(_named_for(old_map)),
            at_points=states_at_points(dataset, measured_range),
            disagreeing=(*(_of_earlier(name) for name in old.disagreeing), *dataset.disagreeing_repeats),
            other_sites=dataset.other_sites,
            left_out=left_out,
            between_states=joint.regression,
            place_effect=joint.place_effect,
            states_found=dataset.states_found,
            table=dataset.source,
            table_sha256=dataset.sha256,
            transfer=transfer,
        ),
        phase_two=phase_two_with_points(dataset).and_(old_map.phase_two),
        conditions=conditions.with_device_of(old_map.conditions),
        device_range=float(np.min([old_map.device_range, dataset.device_range])),
        binding=dataset.binding.weaker(old_map.binding),
        unmapped=_pressure_lost(dataset) if pressures else None,
        source=f"carried over from {old_map.name} by {dataset.source or 'arrays'}",
    )


def _of_earlier(state: str) -> str:
    """A state of an earlier campaign, as a doubt of the map that is carried over names it."""
    return f"{state.removesuffix(_EARLIER)}{_EARLIER}"


def _named_for(old_map: ForceMap) -> States:
    """The slower states of an earlier map by other names than new ones have: they are no repeats of these."""
    slower = old_map.slower
    return replace(slower, name=tuple(f"{name}{of_earlier(old_map.name)}" for name in slower.name))


def _pressure_lost(dataset: ImpactDataset) -> Finding:
    """That pressures are not carried over."""
    why = {"words": "a map is carried over for the force alone", "impacts": dataset.pressures}
    return Finding.of(FindingKind.PRESSURE_NOT_MAPPED, **why, without=len(dataset) - dataset.pressures)


def require_sound(old_map: ForceMap) -> None:
    """Refuse to carry over an earlier map that does not hold itself; errors as in `transfer_map`."""
    old, refused = old_map.require_fit(), "the earlier map cannot be carried over"
    if not old.transfer and old.censored_samples and not old.censored_fit:
        raise FitError(
            f"{refused}: {old.censored_samples} impacts above the device range were discarded, so it may lie too low; "
            "fit it again with them"
        )
    if (cover := cover_slower(old_map)).refusal or cover.raised > 1:
        raise FitError(
            f"{refused}: impacts slower than it holds for measured more than it predicts, and what they measure at the "
            "changed robot is not known; measure a new map"
        )
    try:
        ToleranceBound().require(old_map)
    except BoundNotAvailable as error:
        raise BoundNotAvailable(f"{refused}: {error.message}") from None
    if against := contradiction(old_map, ToleranceBound()):
        above = f"{against.figure('count')} of {against.figure('states')} of its test states lie above its bound"
        raise FitError(f"{refused}: {above}, so it does not hold itself")
    if old.drift and old.drift.significant:
        raise FitError(f"{refused}: its forces drifted while it was measured, so it does not hold itself")
    if failed := few([*_above_bound(old_map)]):
        raise FitError(f"{refused}: impacts measured more than its bound: {failed}; forcemap speed says which of them")


def _above_bound(old_map: ForceMap) -> Iterator[str]:
    """Impacts of an earlier campaign that no carried over map may forget: confirming ones, and those at contact points,
    that lie above its bound, and those of any state far above it."""
    bound, at_points = ToleranceBound(), old_map.require_fit().at_points
    found = (confirming_above(old_map, bound), far_above(old_map, bound), points_above(old_map, bound)[0])
    faster = at_points.select(~held(old_map, at_points)[0])  # than the map holds for: its bound continued
    names = [name for above in found if above for name in above.figure("names")]
    names += np.array(faster.name, dtype=np.str_)[highest_above(old_map, bound, faster)].tolist()
    yield from dict.fromkeys(names)


def _require_direction(old_map: ForceMap, dataset: ImpactDataset) -> None:
    """Refuse another direction, for which a shift misses up to 12 % of the force (docs/directions.md), or unknown."""
    then, now = (each.direction.strip() for each in (old_map.conditions, dataset.conditions))
    if same_direction(then, now):
        return
    held = f"for {then!r}" if then else "in a direction that is not stated"
    measured = repr(now) if now else "in a direction that is not stated"
    whose = " of the earlier campaign and fit it again" if now else ""
    advice = "measure that one by itself" if then and now else f"state contact.direction in campaign.toml{whose}"
    raise FitError(
        f"directions differ: the earlier map holds {held}, the new impacts were measured {measured}; a map is not "
        f"carried over to another direction, {advice}",
        file=dataset.source or None,
    )


def _require_new(new: States, campaigns: Sequence[Earlier], dataset: ImpactDataset) -> None:
    """Refuse states of an earlier campaign among the new ones: counted twice, they would make the bound too low."""
    known = {figures for each in campaigns for figures in _figures(each.states)}
    copies = [name for name, figures in zip(new.uncensored.name, _figures(new), strict=True) if figures in known]
    copies = copies if len(copies) > 1 else []  # one state may agree to the last digit by chance
    if copies := copies or states_alike([new], [each.states for each in campaigns]):
        raise FitError(
            f"found {len(copies)} states of an earlier campaign among the new ones ({', '.join(copies[:3])}, ...), "
            "expected new impacts",
            file=dataset.source or None,
        )


def _figures(states: States) -> list[tuple[float, ...]]:
    """Coordinates and ln F of each state with an uncensored repeat."""
    known = states.uncensored
    return list(map(tuple, np.column_stack([known.coordinates, known.log_force]).tolist()))


def _within(old_map: ForceMap, train: ImpactDataset) -> Mask:
    """New states within the range of every earlier campaign, or no further outside than repeats of a state usually lie.

    Of the last one alone, they would lie further out each time a map is carried over.
    """
    chain = old_map.require_fit().transfer
    earlier = chain.earlier if chain else ()
    ranges = [old_map.measured_range, *(MeasuredRange(each.states.coordinates) for each in earlier)]
    facets = np.vstack([measured.facets for measured in ranges])
    allowed = np.minimum(train.tolerance.scale, StateTolerance().scale)
    beyond = train.states.coordinates @ facets[:, :3].T + facets[:, 3] - np.abs(facets[:, :3]) @ allowed
    return np.asarray((beyond <= 0).all(axis=1))


def _refused(p_value: float, new: int) -> TransferRefused:
    more = max(FEW_STATES - new, 0)
    return TransferRefused(
        p_value,
        f"the {new} new states contradict the earlier map with this shift (p = {p_value:.1g}, refused below "
        f"{REFUSED_BELOW:g}): the shape of the force has changed",
        remedy=f"measure {more} more states in the same range and fit them all as a map of their own (forcemap fit)"
        if more
        else "fit them as a map of their own (forcemap fit)",
    )
