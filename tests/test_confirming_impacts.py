"""Which impacts confirm a map: each once, at the speeds released now, and no others for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import forcemap as fm
from forcemap.findings import in_words
from forcemap.planning.confirm import Confirmed
from forcemap.planning.runs import runs_of

BOUND = fm.FixedMargin(0.10)
CASE = {"bound": BOUND, "contact": fm.Contact.QUASI_STATIC}


@pytest.fixture(scope="module")
def force_map():
    return fm.published_map("ur10e")


def made(force_map, runs, share):
    """An impact at every run, whose force is a share of the bound there, and whether it is within a limit."""
    at = runs.distance, runs.height, runs.speed
    force = share * np.asarray(BOUND.upper(force_map, *at))
    dataset = fm.ImpactDataset.from_arrays(
        distance=at[0], height=at[1], speed=at[2], peak_force=force, state=runs.state_id, repeat=runs.repeat,
        role=runs.role, recording=runs.recording,
    )  # fmt: skip

    def within(limit):
        return {
            str(name): (bool(f + 3 <= limit), in_words("judged")) for name, f in zip(runs.recording, force, strict=True)
        }

    return dataset, within


def test_impacts_that_fail_above_the_speed_released_now_are_made_again_at_it(force_map):
    """Below the bound of their own speed they agree with the map; at or below the released speed they contradict it."""
    first = fm.confirm_plan(force_map, 280.0, **CASE)
    dataset, within = made(force_map, first.plan, 0.995)
    plan = {"planned": first.plan, "recorded": first.plan.state_id.tolist()}
    lower = fm.confirm_plan(force_map, 278.0, **CASE, **plan).judged(dataset, within(278.0))
    assert {impact.outcome for impact in lower.result.impacts} == {Confirmed.CANNOT_TELL}
    assert set(lower.superseded) == set(first.plan.state_id)
    again = fm.confirm_plan(force_map, 278.0, **CASE, **plan, superseded=lower.superseded)
    again = again.judged(dataset, within(278.0))
    assert again.result is None
    assert (len(again.added), len(again.earlier)) == (6, 6)
    places = [
        fm.safe_speed(force_map, d, h, limit=278.0, **CASE).speed
        for d, h in zip(again.added.distance, again.added.height, strict=True)
    ]
    assert (again.added.speed <= np.array(places) + 1e-9).all()
    for limit, outcome in ((280.0, Confirmed.DOES_NOT_PASS), (282.0, Confirmed.PASSES)):
        found = fm.confirm_plan(force_map, limit, **CASE, **plan).judged(dataset, within(limit)).result
        assert (found.outcome, len(found.impacts)) == (outcome, 6)
    saturated = replace(dataset, censored=np.full(6, True))
    found = fm.confirm_plan(force_map, 278.0, **CASE, **plan).judged(saturated, within(278.0))
    assert (found.result.outcome, found.superseded) == (Confirmed.DOES_NOT_PASS, ())
    above, _ = made(force_map, first.plan, 1.01)
    found = fm.confirm_plan(force_map, 278.0, **CASE, **plan).judged(above, within(278.0))
    assert (found.result.outcome, found.superseded) == (Confirmed.DOES_NOT_PASS, ())


def test_impacts_that_the_device_cannot_tell_from_the_limit_are_made_again_where_slower_ones_are_released(force_map):
    """At the speed released now no repeat would tell more: more states do."""
    first = fm.confirm_plan(force_map, 280.0, **CASE)
    dataset, _ = made(force_map, first.plan, 0.995)
    cannot = {str(name): (None, in_words("within the device's error")) for name in first.plan.recording}
    plan = {"planned": first.plan, "recorded": first.plan.state_id.tolist()}
    found = fm.confirm_plan(force_map, 280.0, **CASE, **plan).judged(dataset, cannot)
    assert (found.result.outcome, found.superseded, len(found.added)) == (Confirmed.CANNOT_TELL, (), 0)
    assert found.result.reason.figure("near") == 6
    lower = fm.confirm_plan(force_map, 278.0, **CASE, **plan).judged(dataset, cannot)
    assert set(lower.superseded) == set(first.plan.state_id)
    again = fm.confirm_plan(force_map, 278.0, **CASE, **plan, superseded=lower.superseded).judged(dataset, cannot)
    assert (again.result, len(again.added), len(again.earlier)) == (None, 6, 6)
    weak, _ = made(force_map, first.plan, 0.9)  # for another reason than its force
    found = fm.confirm_plan(force_map, 278.0, **CASE, **plan).judged(weak, cannot)
    assert (found.result.outcome, found.superseded) == (Confirmed.CANNOT_TELL, ())
    assert found.result.reason.figure("near") is None


def test_impacts_whose_force_sinks_unlike_the_maps_confirm_nothing_until_they_were_made_again(force_map):
    """A channel that lets a held force sink reads peaks too low; a robot that lets go slowly did so before, too."""
    plan = fm.confirm_plan(force_map, 280.0, **CASE)
    dataset, within = made(force_map, plan.plan, 0.9)
    assert plan.judged(dataset, within(280.0)).result.outcome is Confirmed.PASSES
    sinks = np.array(["slow_return: 0.2 s", *[""] * 5])
    found = plan.judged(replace(dataset, flags=sinks), within(280.0)).result
    assert found.outcome is Confirmed.CANNOT_TELL
    assert [impact.reason.kind for impact in found.impacts].count(fm.FindingKind.SINKS_UNLIKE_MAP) == 1
    again = {name: np.concatenate([getattr(dataset, name)] * 2) for name in ("distance", "height", "state")}
    force = np.concatenate([dataset.peak_force] * 2)
    both = fm.ImpactDataset.from_arrays(
        **again, speed=np.tile(dataset.stated_speed, 2), peak_force=force, repeat=np.repeat([1, 2], 6),
        role=np.tile(dataset.role, 2), flags=[*sinks, *[""] * 6],
        recording=[*dataset.recording, *(f"{name}-again" for name in dataset.recording)],
    )  # fmt: skip
    judged = within(280.0) | {f"{name}-again": why for name, why in within(280.0).items()}
    assert plan.judged(both, judged).result.outcome is Confirmed.PASSES
    alike = fm.ImpactDataset.from_arrays(
        distance=[*dataset.distance, *dataset.distance], height=[*dataset.height, *dataset.height],
        speed=[*dataset.stated_speed, *(0.9 * dataset.stated_speed)], peak_force=force,
        flags=["slow_return: 0.2 s"] * 12,
        state=[*dataset.state, *(f"t{i}" for i in range(6))], role=[*dataset.role, *["train"] * 6],
        recording=[*dataset.recording, *(f"t{i}" for i in range(6))],
    )  # fmt: skip
    assert plan.judged(alike, within(280.0)).result.outcome is Confirmed.PASSES
    assert alike.phase_two.doubt is not None  # and it is said before every speed


@pytest.mark.parametrize("faster_by", [0.0, 0.004, 0.009])
def test_an_impact_above_the_bound_stays_whatever_a_faster_repeat_of_its_state_shows(force_map, faster_by):
    """Nothing that is made again in the place of the repeat takes away what contradicts the map."""
    first = fm.confirm_plan(force_map, 280.0, **CASE).plan
    speed = first.speed + np.where(np.arange(6) == 2, 0.003, 0.0)  # a little faster than is released
    force = 0.9 * np.asarray(BOUND.upper(force_map, first.distance, first.height, speed))
    force[2] /= 0.9 / 1.004
    again = {"speed": speed[2] + faster_by, "force": 0.0}
    again["force"] = 0.998 * float(BOUND.upper(force_map, first.distance[2], first.height[2], again["speed"]))
    rows = [0, 1, 2, 2, 3, 4, 5]
    both = fm.ImpactDataset.from_arrays(
        distance=first.distance[rows], height=first.height[rows], state=first.state_id[rows], role=first.role[rows],
        speed=np.insert(speed, 3, again["speed"]), peak_force=np.insert(force, 3, again["force"]),
        repeat=[1, 1, 1, 2, 1, 1, 1], recording=[f"{name}-{i}" for i, name in enumerate(first.state_id[rows])],
    )  # fmt: skip
    checked = {name: (True, in_words("judged")) for name in both.recording.tolist()}
    checked[both.recording[2].item()] = checked[both.recording[3].item()] = (None, in_words("near the limit"))
    plan = {"planned": first, "recorded": first.state_id.tolist()}
    found = fm.confirm_plan(force_map, 280.0, **CASE, **plan).judged(both, checked)
    assert (found.result.outcome, found.superseded) == (Confirmed.DOES_NOT_PASS, ())
    elsewhere = fm.confirm_plan(force_map, 280.0, **CASE, **plan, superseded=[first.state_id[2].item()])
    assert elsewhere.judged(both, checked).result.outcome is Confirmed.DOES_NOT_PASS


def test_repeats_of_one_state_are_one_and_each_impact_counts_once(force_map):
    first = fm.confirm_plan(force_map, 280.0, **CASE).plan
    one = np.array([[first.distance[0], first.height[0], first.speed[0]]])
    runs = runs_of(one, 6, np.array([100.0]), role="test", prefix="c-")
    dataset, within = made(force_map, runs, 0.9)
    plan = fm.confirm_plan(force_map, 280.0, **CASE, planned=runs, recorded=runs.state_id.tolist())
    found = plan.judged(dataset, within(280.0))
    assert len({*found.plan.state_id}) == 6
    assert (len(found.result.impacts), found.result.outcome, len(found.result.missing)) == (6, Confirmed.CANNOT_TELL, 5)


@pytest.mark.parametrize("tolerance", [0.01, 0.03, 0.2])
def test_impacts_confirm_no_speed_that_is_much_faster_however_far_repeats_may_lie_apart(force_map, tolerance):
    wide = replace(force_map, conditions=replace(force_map.conditions, speed_tolerance=tolerance))
    first = fm.confirm_plan(wide, 280.0, **CASE).plan
    dataset, within = made(wide, first, 0.9)
    plan = fm.confirm_plan(wide, 310.0, **CASE, planned=first, recorded=first.state_id.tolist())
    found = plan.judged(dataset, within(310.0))
    assert len(found.earlier) > 3
    assert found.result is None or found.result.outcome is Confirmed.CANNOT_TELL


@pytest.mark.parametrize(
    ("first", "censored", "second", "passes"),
    [
        (0.95, False, True, True),  # what its flanks leave open cannot be told; the repeat is within
        (0.95, False, None, False),  # neither tells
        (0.95, True, True, False),  # saturated: it may have been any higher
        (0.999, False, True, False),  # too near the limit by itself
    ],
)
def test_an_impact_that_cannot_tell_is_settled_by_a_repeat_that_passes(force_map, first, censored, second, passes):
    """Excluding the first, which is not at fault, was the only other way."""
    runs = fm.confirm_plan(force_map, 280.0, **CASE).plan
    again = runs_of(np.array([[runs.distance[0], runs.height[0], runs.speed[0]]]), 2, np.array([100.0]),
                    role="test", prefix="c-").select(np.array([1]))  # fmt: skip
    joined = {name: np.concatenate([column, again.arrays[name]]) for name, column in runs.arrays.items()}
    whole = replace(runs, **joined)
    share = np.append(np.full(len(runs), 0.95), 0.95)
    share[0] = first
    dataset, within = made(force_map, whole, share)
    dataset = replace(dataset, censored=np.arange(len(whole)) == 0) if censored else dataset
    checked = within(280.0)
    checked[str(whole.recording[0])] = (None, in_words("10 N that its flanks leave open"))
    checked[str(whole.recording[-1])] = (second, in_words("judged"))
    plan = fm.confirm_plan(force_map, 280.0, **CASE, planned=whole, recorded=whole.state_id.tolist())
    result = plan.judged(dataset, checked).result
    assert (result.outcome is Confirmed.PASSES) is passes, result.reason
    assert [impact.recording for impact in result.settled] == [str(whole.recording[0])] * passes
    assert len(result.impacts) == len(whole) - passes
