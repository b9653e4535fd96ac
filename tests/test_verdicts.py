"""Verdicts against limit lines worked out by hand, and what no curve may do: pass unseen, improve by hitting harder."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

import forcemap as fm
from curves import curve
from forcemap.findings import Finding, FindingKind
from forcemap.limits.device_spring import DeviceSuitability, device_suitability
from forcemap.verdicts.recording_results import judge_recordings, thinned
from forcemap.verdicts.verdict import Judgement, limit_line
from forcemap.words import sentence
from pulses import DEVICE, pulse, recording, save, write_campaign
from readings import KINDS, recordings

HAND = fm.force_limit("back_of_hand")  # 280 N transient, 140 N quasi-static
WITHIN, CANNOT_TELL, EXCEEDED = fm.VerdictOutcome.WITHIN, fm.VerdictOutcome.CANNOT_TELL, fm.VerdictOutcome.EXCEEDED
SEVERITY = {WITHIN: 0, CANNOT_TELL: 1, EXCEEDED: 2}
SEED = 202616


def impact_of(time, force, **options):
    return fm.find_impact(recording(time, force, **options))


def held(peak, level, *, dip=None, after=0.9):
    """A peak after 20 ms, a dip after 40 ms (the end of Phase I), a level from 80 ms on; cosines between."""
    time = np.arange(-400, round(after * 2000) + 1) / 2000
    dip = level - 30.0 if dip is None else dip
    force = np.where(time < 0.02, peak * np.sin(np.pi / 2 * np.clip(time / 0.02, 0, 1)), 0.0)
    for start, end, high, low in ((0.02, 0.04, peak, dip), (0.04, 0.08, dip, level)):
        inside = (time >= start) & (time < end)
        force[inside] = high + (low - high) * (1 - np.cos(np.pi * (time[inside] - start) / (end - start))) / 2
    force[time >= 0.08] = level
    return time, force


def judged(verdict):
    return {judgement.interpretation: judgement for judgement in verdict.judgements}


@pytest.mark.parametrize(
    ("peak", "outcome"),
    [(136.9, WITHIN), (137.1, CANNOT_TELL), (139.0, CANNOT_TELL), (142.9, CANNOT_TELL), (143.5, EXCEEDED)],
)
def test_the_devices_error_is_added_before_a_force_counts_as_within(peak, outcome):
    verdict = fm.check_impact(impact_of(*pulse(peak)), 140.0, spring_N_per_m=75e3)
    assert verdict.warnings == ()
    assert {judgement.outcome for judgement in verdict.judgements} == {outcome}
    assert verdict.outcome is outcome
    assert verdict.device_error == 3.0
    assert verdict.governing.force == pytest.approx(peak, abs=0.05)
    assert verdict.governing.margin == pytest.approx(140.0 - peak, abs=0.05)
    assert verdict.governing.margin_percent == pytest.approx((140.0 - peak) / 1.4, abs=0.05)
    assert verdict.governing.instant == pytest.approx(0.015, abs=0.001)


def test_a_device_that_states_no_error_has_three_newtons():
    verdict = fm.check_impact(impact_of(*pulse(139.0), device=fm.Device(range=500.0)), 140.0)
    assert (verdict.outcome, verdict.device_error) == (CANNOT_TELL, 3.0)
    exact = fm.Device(range=500.0, error=0.0)
    assert fm.check_impact(impact_of(*pulse(139.0), device=exact), 140.0).outcome is WITHIN


def test_clamping_at_160_newtons_after_a_peak_of_200():
    verdict = fm.check_impact(impact_of(*held(200.0, 160.0)), HAND)
    found = judged(verdict)
    assert verdict.impact.scenario is fm.ContactScenario.WITH_CLAMPING
    assert {judgement.outcome for judgement in found.values()} == {EXCEEDED}
    by_time = found[fm.Interpretation.BY_TIME]
    assert by_time.instant > 0.5
    assert (by_time.force, by_time.limit, by_time.margin) == pytest.approx((160.0, 140.0, -20.0), abs=0.2)
    by_shape = found[fm.Interpretation.BY_SHAPE]
    assert by_shape.instant > 0.04
    assert (by_shape.force, by_shape.limit, by_shape.margin) == pytest.approx((160.0, 140.0, -20.0), abs=0.2)
    by_scenario = found[fm.Interpretation.BY_SCENARIO]
    assert by_scenario.instant == pytest.approx(0.02, abs=0.002)
    assert (by_scenario.force, by_scenario.limit, by_scenario.margin) == pytest.approx((200.0, 140.0, -60.0), abs=0.2)
    assert verdict.governing is by_scenario


def test_clamping_at_120_newtons_is_disputed_and_the_strictest_governs_unless_one_is_named():
    impact = impact_of(*held(200.0, 120.0, dip=100.0))
    outcomes = {each: judgement.outcome for each, judgement in judged(fm.check_impact(impact, HAND)).items()}
    assert outcomes == {
        fm.Interpretation.BY_TIME: WITHIN,
        fm.Interpretation.BY_SCENARIO: EXCEEDED,
        fm.Interpretation.BY_SHAPE: WITHIN,
    }
    assert fm.check_impact(impact, HAND).outcome is EXCEEDED
    for named, outcome in outcomes.items():
        verdict = fm.check_impact(impact, HAND, interpretation=named)
        assert (verdict.outcome, verdict.governing.interpretation) == (outcome, named)


def test_a_force_that_is_gone_is_held_to_the_transient_limit_alone():
    for peak, outcome in ((270.0, WITHIN), (279.0, CANNOT_TELL), (290.0, EXCEEDED)):
        verdict = fm.check_impact(impact_of(*pulse(peak)), HAND)
        assert {judgement.outcome for judgement in verdict.judgements} == {outcome}
        assert verdict.governing.limit == 280.0


def test_undetermined_counts_as_clamping():
    impact = impact_of(*held(200.0, 120.0, dip=100.0, after=0.3))
    assert impact.scenario is fm.ContactScenario.UNDETERMINED
    found = judged(fm.check_impact(impact, HAND))
    assert found[fm.Interpretation.BY_SCENARIO].outcome is EXCEEDED
    assert found[fm.Interpretation.BY_SCENARIO].limit == 140.0
    assert found[fm.Interpretation.BY_SHAPE].outcome is CANNOT_TELL
    assert found[fm.Interpretation.BY_TIME].outcome is CANNOT_TELL
    assert "ends 0.300 s after onset while 120.0 N act" in sentence(found[fm.Interpretation.BY_TIME].reason)


def test_the_head_is_not_permitted():
    with pytest.raises(fm.ContactNotPermitted):
        fm.check_impact(impact_of(*pulse(20.0)), fm.force_limit("temple"))


@pytest.mark.parametrize("limit", [0.0, -140.0, math.nan, math.inf])
def test_a_limit_that_is_none_is_refused(limit):
    with pytest.raises(fm.InputError, match="expected a positive finite number"):
        fm.check_impact(impact_of(*pulse(20.0)), limit)


def test_the_largest_of_raw_corrected_and_filtered_peak_counts():
    time, force = pulse(130.0, seed=1)
    force[time == 0.008] = 150.0  # on the rise
    impact = impact_of(time, force)
    verdict = fm.check_impact(impact, 140.0)
    assert verdict.impact.peak_force < 135.0
    assert verdict.impact.raw_peak_force == pytest.approx(150.0, abs=0.5)
    assert verdict.outcome is EXCEEDED


def spoilt(number):
    """A drawn curve of which the peak cannot be known: too few samples, cut off by the device, or no baseline."""
    whole = curve(SEED, number)
    rng = np.random.default_rng([SEED, number])
    time, force, device = whole.time, whole.force - whole.force[0], fm.Device(range=1000.0, error=3.0, stiffness=75e3)
    if number % 3 == 0:
        kept = np.arange(rng.integers(10), time.size, max(2, whole.phase1_samples // 8))
        return recording(time[kept], force[kept], device=device)
    if number % 3 == 1:
        device = fm.Device(range=rng.uniform(0.3, 0.9) * whole.shape.peak, error=3.0, stiffness=75e3)
        return recording(time, np.minimum(force, device.range), device=device)
    kept = time >= whole.onset - rng.uniform(0, 0.002)
    return recording(time[kept], force[kept], device=device)


def test_what_the_recording_does_not_show_is_never_within(full_size):
    hidden = dict.fromkeys(fm.Quality, 0)
    for number in range(1500 if full_size else 300):
        for impact in fm.find_impacts(spoilt(number)):
            flags = {flag.name for flag in impact.flags}
            if number % 3 == 1:
                assert impact.saturated, number
            for flag in flags:
                hidden[flag] += 1
            if flags & {fm.Quality.SATURATED, fm.Quality.UNRESOLVED, fm.Quality.NO_BASELINE}:
                for limit in (5000.0, HAND):
                    verdict = fm.check_impact(impact, limit)
                    assert all(judgement.outcome is not WITHIN for judgement in verdict.judgements), number
    assert all(hidden[name] > 50 for name in (fm.Quality.SATURATED, fm.Quality.UNRESOLVED, fm.Quality.NO_BASELINE))


def test_a_higher_force_never_improves_an_outcome(full_size):
    """Every interpretation by itself, over curves scaled up step by step."""
    device = dataclasses.replace(DEVICE, range=5000.0)
    worse = 0
    for number in range(300 if full_size else 60):
        drawn = curve(SEED, number)
        if drawn.phase1_samples < 16:
            continue
        force = drawn.force - drawn.force[0]
        before = None
        for scale in (0.3, 0.5, 0.7, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0):
            verdict = fm.check_impact(impact_of(drawn.time, scale * force, device=device), HAND)
            outcomes = [SEVERITY[judgement.outcome] for judgement in verdict.judgements]
            if before is not None:
                better = [now < then for now, then in zip(outcomes, before, strict=True)]
                assert not any(better), (number, drawn.shape.name, scale, before, outcomes)
                worse += outcomes != before
            before = outcomes
    assert worse > 50


def test_a_thinned_curve_keeps_every_extreme():
    """60 intervals, half of them in the first 0.1 s: of each its lowest and highest sample, and both ends."""
    rng = np.random.default_rng(31)
    time, force = np.arange(20_000) / 20_000, rng.normal(0, 1, 20_000)
    thin_time, thin_force = thinned(time, force)
    kept = time.searchsorted(thin_time)
    np.testing.assert_array_equal(force[kept], thin_force)
    assert [kept[0], kept[-1]] == [0, 19_999]
    assert abs(np.sum(thin_time < 0.1) - 60) <= 2
    assert abs(np.sum(thin_time >= 0.1) - 58) <= 4
    for first, last, intervals in ((0.0, 0.1, 30), (0.1, time[-1], 29)):
        for start, stop in itertools.pairwise(np.linspace(first, last, intervals + 1).tolist()):
            inside = (time >= start) & (time < stop)
            assert force[inside].min() in thin_force
            assert force[inside].max() in thin_force
    short = thinned(time[:120], force[:120])
    np.testing.assert_array_equal(short, [time[:120], force[:120]])
    assert thinned(time[:121], force[:121])[0].size < 121
    early = thinned(time[:1500], force[:1500])[0]
    assert early[-1] == time[1499]


@pytest.mark.parametrize(("spring", "softer"), [(75e3, False), (76e3, True), (80e3, True), (70e3, False)])
def test_a_device_slightly_softer_than_the_limits_spring_is_named_beside_the_doubt(spring, softer):
    """A force just below the limit, that the softer spring and the device's error may have lowered."""
    impact = impact_of(*pulse(150.0, seed=3))
    limit = fm.NewtonLimit(impact.verdict_peak_force * math.sqrt(max(spring / 75e3, 1.0)) + 1.0, None, spring)
    reason = fm.check_impact(impact, limit).governing.reason
    assert reason.kind.value == "cannot_tell"
    assert ("softer" in sentence(reason)) == softer


def expected_line(impact, rule, after, limit):
    """The limit line as the interpretations are worded."""
    lasting = impact.scenario in (fm.ContactScenario.WITH_CLAMPING, fm.ContactScenario.UNDETERMINED)
    if rule is fm.Interpretation.BY_TIME:
        late = after > 0.5
    elif rule is fm.Interpretation.BY_SCENARIO:
        late = np.full(after.size, lasting)
    else:
        late = lasting & (after > impact.phase1_end - impact.onset)
    return np.where(late, limit.quasi_static, limit.transient)


@pytest.mark.parametrize("error", [0.0, 3.0, 20.0])
@pytest.mark.parametrize("number", range(6))
def test_every_figure_of_a_judgement_is_that_of_the_instant_it_names(number, error):
    """Sample by sample: outcome, force, limit, margins and instant of every interpretation."""
    device = fm.Device(range=5000.0, error=error, stiffness=75e3)
    levels = [(200.0, 120.0), (200.0, 160.0), (265.0, 60.0), (290.0, 137.0), (100.0, 90.0), (275.0, 150.0)]
    impact = impact_of(*held(*levels[number], dip=50.0), device=device)
    after, force = impact.curve()
    peak = np.abs(after - (impact.peak_time - impact.onset)).argmin()
    force = force.copy()
    force[peak] = max(force[peak], impact.verdict_peak_force)
    drift = impact.contact.drift_allowance(after + impact.onset)
    drift = np.where(after > impact.phase1_end - impact.onset, drift, 0.0)
    most = force + error + drift
    most[peak] += impact.unseen_force
    for rule, found in judged(fm.check_impact(impact, HAND)).items():
        line = expected_line(impact, rule, after, HAND)
        severity = np.where(force - error - drift > line, 2, np.where(most <= line, 0, 1))
        shares = np.where(severity == severity.max(), force / line, 0.0)
        at = int(shares.argmax())
        assert SEVERITY[found.outcome] == severity.max()
        assert (found.force, found.limit, found.instant) == (force[at], line[at], after[at])
        assert found.margin == found.limit - found.force
        assert found.margin_percent == pytest.approx(100 * (1 - found.force / found.limit), rel=1e-9, abs=1e-9)
        assert found.gravity == (severity.max(), pytest.approx(shares.max()))


@pytest.mark.parametrize("rate", [800.0, 1000.0, 2000.0])
@pytest.mark.parametrize("error", [0.0, 3.0])
def test_an_outcome_changes_exactly_where_the_force_with_its_doubt_meets_the_limit(rate, error):
    """With the device's error and what may lie between the samples; the limit itself is within, and not exceeded."""
    impact = impact_of(
        *pulse(150.0, rate=rate, duration=0.02), device=fm.Device(range=500.0, error=error, stiffness=75e3)
    )
    force = impact.verdict_peak_force
    assert (impact.unseen_force > 5.0) == (rate < 2000)
    most, least = force + error + impact.unseen_force, force - error

    def outcome(limit):
        return fm.check_impact(impact, limit, spring_N_per_m=75e3).outcome

    assert outcome(least - 1e-9) is EXCEEDED
    between = CANNOT_TELL if most > least else WITHIN
    assert outcome(least) is between
    assert outcome(most - 1e-9) is (CANNOT_TELL if most > least else EXCEEDED)
    assert outcome(most) is WITHIN


@pytest.mark.parametrize("after", [0.05, 0.3, 0.9])
def test_the_transient_limit_holds_up_to_and_including_the_end_of_its_time(after):
    """Of impacts that clamp, of which nobody knows, and that are gone: 0.5 s, Phase I, or all of the contact."""
    for level in (0.0, 120.0):
        time, force = held(200.0, level, dip=0.0 if level == 0 else 100.0, after=after)
        impact = impact_of(time, force)
        phase1 = impact.phase1_end - impact.onset
        instants = np.array([0.0, *(t + step for t in (phase1, 0.5) for step in (-1e-9, 0.0, 1e-9)), 2.0])
        for rule in fm.Interpretation:
            line = limit_line(impact, rule, instants, 280.0, 140.0)
            np.testing.assert_array_equal(line, expected_line(impact, rule, instants, HAND))


def test_a_force_that_the_device_cut_off_exceeds_a_limit_by_at_least_so_much():
    time, force = pulse(300.0)
    cut = fm.check_impact(impact_of(time, np.minimum(force, 200.0), device=fm.Device(range=200.0)), 140.0).governing
    whole = fm.check_impact(impact_of(time, force), 140.0).governing
    assert (cut.outcome, whole.outcome) == (EXCEEDED, EXCEEDED)
    assert "at least" in sentence(cut.reason)
    assert "at least" not in sentence(whole.reason)


@pytest.mark.parametrize(("spring", "most"), [(75e3, 137.0), (71e3, 140.0 / math.sqrt(75 / 71) - 3.0)])
def test_a_force_before_the_impact_is_held_against_the_quasi_static_limit_less_the_devices_error(spring, most):
    """Nobody has judged it; a softer spring than the limit's lowers what it may be."""
    impact = impact_of(*pulse(60.0), device=dataclasses.replace(DEVICE, stiffness=spring))
    for force, outcome in ((most - 0.01, WITHIN), (most + 0.01, CANNOT_TELL)):
        before = dataclasses.replace(impact, force_before=force)
        verdict = fm.check_impact(before, 140.0, spring_N_per_m=75e3)
        assert verdict.outcome is outcome, (spring, force)


def test_the_gravest_impact_of_a_campaign_takes_the_largest_share_of_the_limit(tmp_path):
    """Whatever the order of the files, all of them within the limit."""
    folder = write_campaign(tmp_path / "cell", recorded=False)
    limit = fm.force_limit("back_of_hand")
    for name, peak in (("a", 60.0), ("b", 128.0), ("c", 90.0)):
        save(folder / "recordings" / f"{name}.csv", *pulse(peak))
    judged_ones = judge_recordings(fm.read_campaign(folder), [limit])
    assert judged_ones.gravest is not None
    assert judged_ones.gravest.governing.force == pytest.approx(128.0, abs=0.5)
    assert judged_ones.gravest_limit == limit


def reason_hidden(impact, before):
    """Why a recording shows nothing, as the documentation orders it: the first that holds."""
    if impact.force_before > before:
        return Finding.of(FindingKind.FORCE_BEFORE_IMPACT, force_N=impact.force_before)
    if impact.verdict_peak_force < max(5.0, 4.0 * impact.contact.baseline_sd):
        return Finding.of(FindingKind.NO_PEAK, force_N=impact.verdict_peak_force)
    notes = {"drift", "double_hit", "later_peak", "ringing", "too_short", "braking_transient", "calibration_expired"}
    notes |= {"slow_return"}
    for flag in impact.flags:
        if flag.name.value not in notes:
            return Finding.of(FindingKind.FLAGGED, flag=flag.name, figure=flag.figure)
    if impact.scenario is fm.ContactScenario.UNDETERMINED and impact.recorded_time < 0.5:
        return Finding.of(FindingKind.ENDS_EARLY, after_s=impact.recorded_time, force_N=impact.end_force)
    return None


def expected_judgements(impact, limit, contact):
    """Outcome, figures and reason of every interpretation, sample by sample."""
    device, quasi = impact.recording.device, contact is fm.Contact.QUASI_STATIC
    area = isinstance(limit, fm.ForceLimit)
    transient = (limit.quasi_static if quasi else limit.transient) if area else limit.force
    lasting = limit.quasi_static if area or limit.quasi_static is not None else limit.force
    spring = limit.stiffness if area else limit.spring_N_per_m
    suits = DeviceSuitability()
    if spring is not None:
        suits = device_suitability(limit.name if area else "the limit", spring, device.stiffness)
    error = 3.0 if math.isnan(device.error) else device.error
    hidden = suits.refusal or reason_hidden(impact, lasting / suits.raised - error)
    clamps = impact.scenario.value in ("constrained_with_clamping", "undetermined")
    if hidden is None and clamps and not area and limit.quasi_static is None and not quasi:
        hidden = Finding.of(FindingKind.LIMIT_UNNAMED, scenario=impact.scenario, limit_N=limit.force)
    after, force = (each.tolist() for each in impact.curve())
    phase1, peak_at = impact.phase1_end - impact.onset, impact.peak_time - impact.onset
    peak = min(range(len(after)), key=lambda k: (abs(after[k] - peak_at), k))
    force[peak] = max(force[peak], impact.verdict_peak_force)
    found = []
    for rule in fm.Interpretation:
        worst = None
        for k, (t, f) in enumerate(zip(after, force, strict=True)):
            late = {"by-time": t > 0.5, "by-scenario": clamps, "by-shape": clamps and t > phase1}[rule.value]
            line = lasting if late else transient
            drift = float(impact.contact.drift_allowance(np.asarray(t + impact.onset))) if t > phase1 else 0.0
            unseen = impact.unseen_force if k == peak else 0.0
            outcome = EXCEEDED if f - error - drift > line else CANNOT_TELL
            outcome = WITHIN if suits.raised * (f + error + drift + unseen) <= line else outcome
            if worst is None or (SEVERITY[outcome], f / line) > worst[0]:
                worst = (SEVERITY[outcome], f / line), outcome, f, line, t, drift, unseen
        _, outcome, f, line, t, drift, unseen = worst
        figures, doubt = {"force_N": f, "limit_N": line}, {"error_N": error, "drift_N": drift, "unseen_N": unseen}
        if outcome is EXCEEDED:
            at_least = hidden is not None and f >= impact.raw_peak_force
            reason = Finding.of(FindingKind.FORCE_EXCEEDS, **figures, at_least=at_least)
        elif hidden is not None:
            outcome, reason = CANNOT_TELL, Finding.of(FindingKind.CANNOT_TELL, hidden)
        elif outcome is CANNOT_TELL:
            softer = [suits.statement] if suits.raised > 1.0 else []
            reason = Finding.of(FindingKind.FORCE_NEAR_LIMIT, **figures, **doubt)
            reason = Finding.of(FindingKind.CANNOT_TELL, reason, *softer)
        else:
            reason = Finding.of(FindingKind.FORCE_WITHIN, **figures, **doubt)
        margin = line - f
        found.append(Judgement(rule, outcome, f, line, margin, 100 * margin / line, t, reason))
    return found


def near(impact, spring):
    """Limits near an impact's own force, and others: of an area, in newtons, with and without their parts."""
    force, raised = impact.verdict_peak_force, math.sqrt(max(1.0, spring / 75e3))
    most = raised * (force + 3.0 + impact.unseen_force)
    yield from ((HAND, None), (HAND, fm.Contact.QUASI_STATIC), (fm.force_limit("abdomen"), None))
    for limit in (max(force - 2.0, 1.0), force + 1.0, most, most + 5.0):
        yield fm.NewtonLimit(limit, None, spring), None
        yield fm.NewtonLimit(limit, None, spring), fm.Contact.QUASI_STATIC
        yield fm.NewtonLimit(limit, 0.6 * limit, spring), None
    yield fm.NewtonLimit(most + 1.0), fm.Contact.TRANSIENT


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_verdict_is_that_of_its_samples_one_by_one(kind):
    """Over curves of every kind: outcome, figures, reason of every interpretation; the strictest, and one named."""
    for number, (name, each) in enumerate(itertools.islice(recordings(kind), 0, 48, 6)):
        later = dataclasses.replace(each, time=each.time + 4.0 * (number % 2))
        impact = next(iter(fm.find_impacts(later)), None)
        if impact is None or impact.curve()[0].size > 800:
            continue
        for limit, contact in itertools.islice(near(impact, (75e3, 78e3, 90e3)[number % 3]), number % 4, None, 4):
            expected = expected_judgements(impact, limit, contact)
            verdict = fm.check_impact(impact, limit, contact=contact)
            assert list(verdict.judgements) == expected, (name, limit)
            assert verdict.governing == max(expected, key=lambda one: (SEVERITY[one.outcome], one.force / one.limit))
            for one in expected:
                named = fm.check_impact(impact, limit, contact=contact, interpretation=one.interpretation)
                assert (named.governing, named.outcome) == (one, one.outcome)


@pytest.mark.parametrize("after", [0.3, 0.49, 0.51, 0.55, 0.65, 0.9])
@pytest.mark.parametrize("level", [120.0, 40.0, 0.0])
def test_a_force_that_is_held_shows_it_to_half_a_second_at_least(after, level):
    """Before, a recording that ends on a force cannot tell; between, its scenario counts as clamping. Drift counts."""
    time, force = held(130.0, level, dip=level / 2, after=after)
    impact = impact_of(time + 2.0, force + np.random.default_rng(8).normal(0, 0.4, time.size))
    for limit, contact in ((HAND, None), (fm.NewtonLimit(200.0, 150.0, 75e3), None), (fm.NewtonLimit(200.0), None)):
        verdict = fm.check_impact(impact, limit, contact=contact)
        assert list(verdict.judgements) == expected_judgements(impact, limit, contact)


def test_a_peak_below_the_floor_is_none():
    impact = impact_of(*pulse(60.0))
    for force, kind in ((4.9, FindingKind.CANNOT_TELL), (5.1, FindingKind.FORCE_WITHIN)):
        low = dataclasses.replace(impact, peak_force=force, raw_peak_force=force)
        reason = fm.check_impact(low, HAND).governing.reason
        assert reason.kind is kind
        if kind is FindingKind.CANNOT_TELL:
            assert reason.also == (Finding.of(FindingKind.NO_PEAK, force_N=force),)


@pytest.mark.parametrize("stated", [{"quasi_static_limit": 100.0}, {"spring_N_per_m": 75e3}])
def test_what_goes_with_a_limit_in_newtons_is_refused_beside_a_body_area(stated):
    impact = impact_of(*pulse(60.0))
    with pytest.raises(fm.InputError, match="quasi_static_limit and spring_N_per_m go with a limit in newtons"):
        fm.check_impact(impact, HAND, **stated)
    with pytest.raises(fm.InputError, match="found figures beside a NewtonLimit, expected them in it"):
        fm.check_impact(impact, fm.NewtonLimit(140.0), **stated)
    with pytest.raises(fm.InputError, match="expected one limit in newtons"):
        fm.check_impact(impact, np.array([140.0, 150.0]))


def test_what_must_be_said_of_a_limit_is_said_before_the_outcome():
    impact = impact_of(*pulse(20.0))
    head = dataclasses.replace(HAND, head_contact="by the words of a table")
    assert fm.check_impact(impact, head).warnings == (head.head_finding,)
    assert head.head_finding is not None
    assert fm.check_impact(impact, HAND).warnings == ()
    assert fm.check_impact(impact, 140.0).warnings == (Finding.of(FindingKind.DEVICE_ALONE),)
    assert fm.check_impact(impact, 140.0, spring_N_per_m=75e3).warnings == ()
