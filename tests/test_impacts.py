"""What must not change an impact's figures, what they are for built curves, and a curve for every quality flag."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import butter, filtfilt
from scipy.stats import linregress

import forcemap as fm
from curves import SHAPES, curve
from forcemap.impacts.baseline import contact_force, noise_sd
from forcemap.impacts.clipping import find_tops, hidden_force
from forcemap.impacts.detect import force_without_impact, no_impact
from forcemap.impacts.impact import Flag
from forcemap.impacts.interference import find_swing
from forcemap.impacts.phases import end_level, flanks, hold_force
from forcemap.impacts.quality import flags_of
from forcemap.impacts.smooth import mean_interval, moving_mean
from pulses import DEVICE, half_sine, pulse, recording

SEED = 202617
NUMBERS = range(6 * len(SHAPES))
FORCES = ("peak_force", "raw_peak_force", "largest_force", "phase2_force", "end_force", "impulse")
TIMES = ("onset", "peak_time", "phase1_end")
WIDE = fm.Device(range=1000.0, error=3.0)


def drawn(number):
    """The curve of that number; the next one of its kind if there are too few samples in it for its peak."""
    while (found := curve(SEED, number)).phase1_samples < 16:
        number += len(SHAPES)
    return found


def figures(impact, names):
    return np.array([getattr(impact, name) for name in names])


def same(one, two, *, delay=0.0, force=1e-6, time=1e-9):
    assert_allclose(figures(two, FORCES), figures(one, FORCES), atol=force, rtol=force)
    assert_allclose(figures(two, TIMES) - delay, figures(one, TIMES), atol=time)
    assert two.contact_duration == pytest.approx(one.contact_duration, abs=time)
    assert (two.scenario, two.bounces) == (one.scenario, one.bounces)
    assert [flag.name for flag in two.flags] == [flag.name for flag in one.flags]


@pytest.mark.parametrize("number", NUMBERS)
def test_offset_and_start_time_change_nothing(number):
    each = drawn(number)
    impact = fm.find_impact(recording(each.time, each.force, device=WIDE))
    same(impact, fm.find_impact(recording(each.time, each.force + 20.0, device=WIDE)))
    moved = fm.find_impact(recording(each.time + 1234.5, each.force, device=WIDE))
    same(impact, moved, delay=1234.5, time=1e-4, force=1e-5)
    assert fm.classify_contact(impact) is impact.scenario


@pytest.mark.parametrize("number", range(len(SHAPES)))
def test_sign_and_units_of_a_file_change_nothing(tmp_path, number):
    each = drawn(number)
    found = []
    for name, per_second, per_newton, options in (
        ("plain.csv", 1.0, 1.0, {}),
        ("milliseconds.csv", 1e3, 1.0, {"time_unit": "ms"}),
        ("kilonewtons.csv", 1e6, 1e-3, {"time_unit": "us", "force_unit": "kN"}),
        ("negative.csv", 1.0, -1.0, {"sign": -1}),
        ("counts.csv", 1.0, 8.0, {"force_unit": "counts", "newtons_per_count": 0.125}),
    ):
        table = np.column_stack([per_second * each.time, per_newton * each.force])
        np.savetxt(tmp_path / name, table, fmt="%.12g", delimiter=",")
        columns = fm.ColumnMap.from_table({"time": 1, "force": 2} | options)
        found.append(fm.find_impact(fm.read_recording(tmp_path / name, columns=columns, device=WIDE)))
    for other in found[1:]:
        same(found[0], other, force=1e-5, time=1e-6)


@pytest.mark.parametrize("number", NUMBERS)
def test_finer_sampling_changes_no_more_than_the_samples_tell(number):
    shape = drawn(number).shape
    impacts = []
    for rate in (4000, 16_000):
        time = np.arange(-round(0.3 * rate), rate) / rate
        impacts.append(fm.find_impact(recording(time, shape.force(time), device=WIDE)))
    coarse, fine = impacts
    assert_allclose(figures(fine, FORCES), figures(coarse, FORCES), rtol=0.01, atol=0.5)
    assert_allclose(figures(fine, TIMES), figures(coarse, TIMES), atol=0.0015)
    assert fine.scenario == coarse.scenario == shape.scenario
    assert fine.bounces == coarse.bounces


def components(force, rotation, offsets=(12.0, -7.0, 30.0)):
    """Three components of a force along x, turned, each with its own offset."""
    return np.outer(force, rotation[:, 0]) + offsets


def test_turning_three_components_leaves_the_norm_and_a_direction_projects():
    rng = np.random.default_rng(SEED)
    time, force = pulse(150.0, held=50.0)
    plain = fm.find_impact(recording(time, force))
    for _ in range(10):
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        along = rotation[:, 0]
        vector = components(force, rotation)
        norm = fm.find_impact(recording(time, vector))
        assert_allclose(figures(norm, FORCES), figures(plain, FORCES), atol=0.1)
        assert norm.scenario is plain.scenario
        projected = fm.find_impact(recording(time, vector, direction=tuple(3 * along)))
        assert_allclose(figures(projected, FORCES), figures(plain, FORCES), atol=0.1)
        across = rotation[:, 1]
        oblique = tuple(along + np.sqrt(3) * across)  # 60 degrees off: half of the force
        assert fm.find_impact(recording(time, vector, direction=oblique)).peak_force == pytest.approx(75.0, abs=0.1)
        beside = fm.find_impacts(recording(time, vector, direction=tuple(across)))
        assert all(impact.largest_force < 0.1 for impact in beside)


@pytest.mark.parametrize(("share", "flagged"), [(1.03, False), (1.09, True)])
def test_a_force_beside_the_stated_direction_is_oblique(share, flagged):
    time, force = pulse(300.0)
    vector = np.outer(force, [1.0, 0.0, np.sqrt(share**2 - 1)])
    impact = fm.find_impact(recording(time, vector, direction=(1.0, 0.0, 0.0)))
    assert ("oblique" in {flag.name for flag in impact.flags}) == flagged


def test_several_impacts_in_one_recording_are_found_each():
    time = np.arange(0, 6, 0.0005)
    peaks, starts = (150.0, 90.0, 210.0), (0.5, 2.0, 3.5)
    force = 7.0 + sum(half_sine(time, peak, 0.03, start) for peak, start in zip(peaks, starts, strict=True))
    impacts = fm.find_impacts(recording(time, force))
    assert [impact.number for impact in impacts] == [1, 2, 3]
    assert [impact.peak_force for impact in impacts] == pytest.approx(peaks, abs=0.5)
    assert [impact.onset for impact in impacts] == pytest.approx(starts, abs=0.001)
    assert {impact.scenario for impact in impacts} == {fm.ContactScenario.UNCONSTRAINED}
    assert impacts[0].end < impacts[1].onset
    assert not any(impact.flags for impact in impacts)


def test_a_recording_without_an_impact_says_how_far_the_force_goes():
    time, force = pulse(0.0, seed=1)
    assert fm.find_impacts(recording(time, force)) == []
    with pytest.raises(fm.InputError, match="no impact found: the force goes from"):
        fm.find_impact(recording(time, force))
    with pytest.raises(fm.InputError, match="sign = -1"):
        fm.find_impact(recording(time, -60.0 * np.clip(time / 0.02, 0, 1)))  # never rises


def test_a_contact_with_the_wrong_sign_is_not_taken_for_a_small_one():
    time, force = pulse(150.0, seed=1)
    assert fm.find_impacts(recording(time, -force)) == []
    with pytest.raises(fm.InputError, match="sign = -1"):
        fm.find_impact(recording(time, -force))


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_bounces_are_counted(count):
    time, force = pulse(150.0)
    for bounce in range(count):
        force = force + half_sine(time, 70.0 - 10.0 * bounce, 0.02, 0.06 + 0.05 * bounce)
    impact = fm.find_impact(recording(time, force))
    assert impact.bounces == count
    assert impact.scenario.value == ("constrained_without_clamping" if count else "unconstrained")


@pytest.mark.parametrize("duration", [0.01, 0.03, 0.06])
def test_figures_of_a_half_sine(duration):
    peak = 180.0
    impact = fm.find_impact(recording(*pulse(peak, rate=10_000.0, duration=duration, before=0.3)))
    assert impact.impulse == pytest.approx(2 * peak * duration / np.pi, rel=0.005)
    assert impact.contact_duration == pytest.approx(duration, abs=0.001)
    assert impact.peak_force == pytest.approx(peak, rel=0.001)
    assert impact.peak_time == pytest.approx(duration / 2, rel=0.05)
    assert impact.phase1_width == pytest.approx(2 * duration / 3, rel=0.02)
    assert impact.onset == pytest.approx(0.0, abs=0.0005)
    assert impact.phase2_force == pytest.approx(0.0, abs=0.01)
    assert (impact.contact_over, impact.flags) == (True, ())


def test_the_low_passed_peak_is_that_of_phase_one_alone():
    """A larger force that is held later is not the impact's."""
    time, force = pulse(100.0)
    later = 160.0 * np.clip((time - time[0] - 0.5) / 0.1, 0.0, 1.0)
    impact = fm.find_impact(recording(time, np.maximum(force, later)), channel_frequency_class=180)
    assert impact.peak_force == pytest.approx(100.0, abs=3.0)
    assert impact.filtered_peak_force == pytest.approx(100.0, abs=3.0)


@pytest.mark.parametrize("channel_frequency_class", [60, 180])
@pytest.mark.parametrize("duration", [0.008, 0.03])
def test_the_low_passed_peak_stands_beside_the_raw_one(channel_frequency_class, duration):
    """Against SAE J211 built here: second-order Butterworth, corner 2.0775 CFC, forwards and backwards."""
    rate = 10_000.0
    time, force = pulse(150.0, rate=rate, duration=duration)
    made = recording(time, force + 12.0)
    plain = fm.find_impact(made)
    filtered = fm.find_impact(made, channel_frequency_class=channel_frequency_class)
    expected = filtfilt(*butter(2, 2.0775 * channel_frequency_class, fs=rate), force)[time < duration].max()
    assert filtered.filtered_peak_force == pytest.approx(expected, abs=0.05)
    assert np.isnan(plain.filtered_peak_force)
    same(plain, filtered)


def test_a_class_that_the_sampling_does_not_carry_is_refused():
    with pytest.raises(fm.InputError, match="needs more than 2493 Hz, the recording has 2000 Hz"):
        fm.find_impact(recording(*pulse()), channel_frequency_class=600)


CLEAN = pulse(150.0, seed=3)
TIME, FORCE = CLEAN
NOISE = np.random.default_rng(SEED).normal(0, 0.3, TIME.size)
SHORT = fm.Device(range=120.0, error=3.0)


def with_spike(at, force):
    return TIME, FORCE + force * (np.abs(TIME - at) < 1e-9)


def shifted(by):
    """The force that much later."""
    return np.interp(TIME + by, TIME, FORCE)


def without(first, last):
    kept = (first > TIME) | (last < TIME)
    return TIME[kept], FORCE[kept]


FLAGGED = {
    "saturated": [
        (TIME, np.minimum(FORCE, 120.0), {"device": SHORT}, r"120\.0 N of a device range of 120 N"),
        (TIME, np.minimum(FORCE, 120.0), {}, r"\d+ samples alike within the noise at the top, 120\.0 N"),
        (TIME, np.minimum(FORCE + 4, 120.0), {}, r"\d+ samples alike within the noise at the top, 120\.0 N"),
        (
            TIME,
            np.minimum(pulse(150.0)[1], 120.0) + NOISE,
            {},
            r"\d+ samples alike within the noise at the top, 12[01]\.\d N",
        ),
    ],
    "unresolved": [(*pulse(150.0, rate=250.0), {}, r"\d+ samples across Phase I.* it takes \d+ Hz or more")],
    "no_baseline": [
        (TIME[TIME >= 0], FORCE[TIME >= 0], {}, r"0\.0\d* s before contact"),
        (TIME[TIME >= -0.003], FORCE[TIME >= -0.003], {}, r"0\.0\d* s before contact"),
    ],
    "oblique": [
        (
            TIME,
            np.outer(FORCE, [0.6, 0.0, 0.8]),
            {"direction": (1.0, 0.0, 0.0)},
            r"150\.\d N act, 9\d\.\d N of them in",
        ),
    ],
    "offset": [
        (TIME, FORCE + 60.0, {}, r"60\.\d N before contact"),
        (TIME, FORCE + 110.0, {"device": WIDE}, r"110\.\d N before contact"),
        (TIME, FORCE + 60.0, {"device": fm.Device()}, r"60\.\d N before contact"),
    ],
    "unquiet": [
        (TIME, FORCE + 40.0 * np.minimum(TIME, 0.03), {}, r"changes by (39|40)\.\d N/s before contact"),
        (TIME, FORCE + half_sine(TIME, 9.0, 0.08, -0.15), {}, r"\d\d% of the samples before contact are not quiet"),
    ],
    "cut_off": [(TIME[TIME < 0.01], FORCE[TIME < 0.01], {}, r"ends while 1\d\d\.\d N act, before the peak is over")],
    "spike": [
        (*with_spike(0.008, 200.0), {}, r"and back at 0\.0080 s, 1 such sample in all: interference; 3\d\d\.\d N with")
    ],
    "jump": [
        (
            TIME,
            np.where(TIME < 0.004, FORCE, shifted(0.018)),
            {},
            r"changes by \+\d\d\.\d N from one sample to the next 0\.00",
        ),
    ],
    "step": [
        (TIME, np.where(TIME < 0.016, FORCE, shifted(0.004)), {}, r"changes by -\d\d\.\d N from one sample to the next")
    ],
    "stuck": [
        (TIME, np.where((TIME > 0.006) & (TIME < 0.022), FORCE[TIME > 0.006][0], FORCE), {}, r"\d\d equal readings"),
    ],
    "hum": [
        (
            TIME,
            FORCE + 9.0 * np.sin(100 * np.pi * TIME),
            {},
            r"swings by (8\.[5-9]|9\.[0-5]) N about [45]\d times a second, 6% of",
        )
    ],
    "unit": [
        (
            np.arange(-20_000, 5_000) / 1e6,
            half_sine(np.arange(-20_000, 5_000) / 1e6, 150.0, 4e-4),
            {},
            r"0\.2\d* ms wide",
        )
    ],
    "drift": [(TIME, FORCE + 12.0 * TIME, {}, r"drifts by 1[12]\.\d N/s")],
    "double_hit": [(TIME, FORCE + half_sine(TIME, 140.0, 0.03, 0.15), {}, r"1[34]\d\.\d N after a Phase I peak of 1")],
    "later_peak": [
        (TIME, np.maximum(FORCE, half_sine(TIME, 190.0, 0.05, 0.02)), {}, r"1(89|90)\.\d N after a Phase I peak of 1")
    ],
    "slow_return": [
        (
            TIME,
            np.maximum(FORCE, np.where(TIME > 0.015, 60.0 * np.exp(-(TIME - 0.015) / 0.05), 0.0)),
            {},
            r"the force sinks from 30 to 3 % of its peak in \d+ ms, after \d+ ms to there",
        )
    ],
    "ringing": [(*with_spike(0.008, 60.0), {}, r"2\d\.\d N above the peak without noise")],
    "too_short": [(TIME[TIME < 0.3], FORCE[TIME < 0.3], {}, r"recorded for 0\.\d+ s after onset")],
    "braking_transient": [(TIME, FORCE + half_sine(TIME, 13.0, 0.01, -0.1), {}, r"1[234]\.\d N before contact")],
    "gap": [(*without(0.010, 0.016), {}, r"no sample for 0\.00[67]\d s of Phase I")],
    "reversed": [(TIME, FORCE - half_sine(TIME, 120.0, 0.03, 0.05), {}, r"1[12]\d\.\d N against the stated direction")],
    "calibration_expired": [
        (
            *CLEAN,
            {
                "device": fm.Device(range=500.0, calibrated="2024-01-31"),
                "metadata": {"date": "2025-02-01"},
            },
            "2025-02-01",
        ),
    ],
}
CASES = [(name, case) for name, cases in FLAGGED.items() for case in cases]


def test_every_flag_has_a_curve_and_a_clean_curve_has_none():
    assert {fm.Quality(name) for name in FLAGGED} == set(fm.Quality)
    assert fm.find_impact(recording(*CLEAN)).flags == ()
    for offset in (-45.0, 45.0):  # a zero that is off by that much is taken off
        assert fm.find_impact(recording(TIME, FORCE + offset)).flags == ()
    along = recording(TIME, np.outer(FORCE, [0.6, 0.0, 0.8]), direction=(3.0, 0.0, 4.0))
    assert fm.find_impact(along).flags == ()
    calibrated = fm.Device(range=500.0, calibrated="2024-01-31")
    assert fm.find_impact(recording(*CLEAN, device=calibrated, metadata={"date": "2025-01-31"})).flags == ()


@pytest.mark.parametrize(("name", "case"), CASES, ids=[name for name, _ in CASES])
def test_flags_with_their_figures(name, case):
    time, force, options, figure = case
    impact = fm.find_impact(recording(time, force, **options))
    found = {flag.name.value: flag.figure for flag in impact.flags}
    assert name in found, found
    assert re.search(figure, found[name]), found[name]


@pytest.mark.parametrize("rate", [120.0, 200.0, 300.0, 400.0])
@pytest.mark.parametrize("duration", [0.01, 0.03])
def test_the_sampling_rate_that_is_said_to_suffice_does(rate, duration):
    impact = fm.find_impact(recording(*pulse(150.0, rate=rate, duration=duration)))
    (flag,) = [flag for flag in impact.flags if flag.name is fm.Quality.UNRESOLVED]
    assert not impact.resolved
    enough = float(re.search(r"it takes (\d+) Hz", flag.figure)[1])
    again = fm.find_impact(recording(*pulse(150.0, rate=enough, duration=duration)))
    assert again.resolved, (enough, again.flags)
    assert again.peak_force == pytest.approx(150.0, rel=0.01)


@pytest.mark.parametrize("duration", [0.03, 0.06, 0.15])
@pytest.mark.parametrize("rate", [1000.0, 5000.0])
def test_a_baseline_too_short_is_flagged_and_never_eats_into_the_peak(rate, duration):
    for before in (0.0, 0.002, 0.005, 0.008, 0.011, 0.015, 0.02, 0.03, 0.05):
        time, force = pulse(300.0, rate=rate, duration=duration, before=before, seed=1)
        impact = fm.find_impact(recording(time, force))
        assert impact.peak_force == pytest.approx(300.0, abs=3.0), before
        assert impact.has(fm.Quality.NO_BASELINE) or before > 0.005
        assert not impact.has(fm.Quality.NO_BASELINE) or before < 0.02


def test_the_range_of_a_device_counts_with_its_offset_and_for_three_components():
    rotation, _ = np.linalg.qr(np.random.default_rng(SEED).normal(size=(3, 3)))
    assert fm.find_impact(recording(TIME, np.minimum(FORCE, 118.0) + 2.0, device=SHORT)).saturated
    assert fm.find_impact(recording(TIME, components(np.minimum(FORCE, 120.0), rotation, 0.0), device=SHORT)).saturated
    assert not fm.find_impact(recording(TIME, FORCE, device=DEVICE)).saturated


def test_a_class_below_one_is_a_class():
    """A low corner flattens the peak, and is refused no more than a high one."""
    time, force = pulse(150.0, seed=3)
    peaks = [
        fm.find_impact(recording(time, force), channel_frequency_class=each).filtered_peak_force
        for each in (0.5, 5, 50)
    ]
    assert 0 < peaks[0] < peaks[1] < peaks[2] < 160
    for each in (0.0, -1.0, 1e6):
        with pytest.raises(fm.InputError):
            fm.find_impact(recording(time, force), channel_frequency_class=each)


@pytest.mark.parametrize("samples", [10, 19, 39, 80, 99, 100, 421, 999])
@pytest.mark.parametrize("columns", [1, 3])
def test_without_an_impact_the_force_counts_from_the_median_of_the_first_twentieth(samples, columns):
    """A slow ramp of 45 N: it moves by 45 N less its mean over that part."""
    time, start = np.arange(samples) / 100.0, (max(samples // 20, 1) - 1) / 2
    ramp = 45.0 * np.arange(samples) / (samples - 1)
    force = ramp if columns == 1 else np.outer(ramp, [0.6, 0.0, 0.8])
    direction = {} if columns == 1 else {"direction": (0.6, 0.0, 0.8)}
    given = recording(time * 40, force, **direction)
    assert fm.find_impacts(given) == []
    high, low = 45.0 * (1 - start / (samples - 1)), 0.0 - 45.0 * start / (samples - 1)
    words = f"goes from {low:.1f} to {high:.1f} N about" if columns == 1 else f"moves by up to {high:.1f} N from"
    assert words in no_impact(given)
    assert force_without_impact(given) == pytest.approx(high, rel=1e-9)


@pytest.mark.parametrize(("top", "counts"), [(9.9, False), (10.1, True), (-10.1, True)])
def test_a_force_without_an_impact_counts_above_10_newtons(top, counts):
    """A rise too slow for an impact, then a force that stays."""
    time = np.arange(4000) / 100.0
    force = top * np.clip((time - 10.0) / 20.0, 0, 1)
    found = force_without_impact(recording(time, force))
    assert found == (pytest.approx(abs(top)) if counts else 0.0)


@pytest.mark.parametrize(("share", "counts"), [(0.97, False), (1.03, True)])
def test_a_force_without_an_impact_counts_above_six_standard_deviations_of_the_noise(share, counts):
    """The force swings over the first twentieth; five samples are averaged."""
    number = np.arange(4000)
    rest = np.where((number < 200) & (number % 50 // 15 == 1), 6.0, 0.0)
    noise = np.convolve(rest, np.full(5, 0.2), mode="same")[:200].std()
    force = rest + share * 6 * noise * np.clip((number - 1000) / 2000, 0, 1)
    found = force_without_impact(recording(number / 100.0, force))
    assert found == (pytest.approx(share * 6 * noise) if counts else 0.0)


def test_the_mean_interval_is_the_time_over_the_number_of_intervals():
    for samples in (2, 3, 10, 1001):
        assert mean_interval(3.0 + np.arange(samples) / 250.0) == pytest.approx(0.004, rel=1e-9)
    assert mean_interval(np.array([0.0, 0.1, 0.5])) == pytest.approx(0.25)
    assert mean_interval(np.array([7.0])) == 1.0


@pytest.mark.parametrize("columns", [None, 3])
def test_a_moving_mean_is_that_of_the_samples_around_as_many_on_either_side(columns):
    """Fewer at the ends: as many as there are before the first or behind the last."""
    for size in range(1, 13):
        values = np.random.default_rng(size).normal(size=size if columns is None else (size, columns))
        for samples in range(1, 12, 2):
            halves = [min(samples // 2, i, size - 1 - i) for i in range(size)]
            expected = [values[i - half : i + half + 1].mean(axis=0) for i, half in enumerate(halves)]
            assert_allclose(moving_mean(values, samples), expected, atol=1e-12)


def test_the_tops_of_components_are_the_same_whichever_way_they_point():
    time, force = pulse(150.0, seed=5)
    force = np.minimum(force, 140.0)
    shares = np.array([0.6, 0.0, 0.8])
    tops = [
        find_tops(fm.find_impact(recording(time, np.outer(force, along), direction=tuple(along))))
        for along in (shares, shares * [-1, 1, 1], shares * [1, 1, -1], -shares)
    ]
    assert [round(top.reading, 6) for top in tops[0]] == pytest.approx([140, 84, 112], rel=0.01)
    for others in tops[1:]:
        for one, other in zip(tops[0], others, strict=True):
            for name in vars(one):
                assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-6, abs=1e-6), name


@pytest.mark.parametrize("hidden", [0.0, 0.5, 4.0, 60.0])
@pytest.mark.parametrize(("shallow", "deep"), [(0.5, 10.0), (2.0, 3.0), (0.0, 5.0)])
def test_the_force_above_a_cut_parabola_is_told_by_the_times_near_its_top(hidden, shallow, deep):
    """The time within a depth x of the largest reading grows as sqrt(x + h)."""
    ratio = (shallow + hidden) / (deep + hidden)
    bounded = hidden_force(ratio, shallow, deep)
    assert bounded == pytest.approx(hidden if ratio <= 0.99 else (0.99 * deep - shallow) / 0.01, abs=1e-9)
    assert hidden_force(0.9 * shallow / deep, shallow, deep) == 0.0  # more pointed than a parabola
    assert hidden_force(1.0, shallow, deep) == hidden_force(0.99, shallow, deep) < np.inf


def test_what_lies_below_a_level_beside_a_peak():
    rng = np.random.default_rng(7)
    for size in (1, 2, 3, 8, 30):
        for _ in range(20):
            force = rng.integers(0, 5, size).astype(float)
            peak = int(force.argmax())
            level = float(min(rng.integers(0, 5), force[peak]))
            before = [i for i in range(peak) if force[i] < level]
            after = [i for i in range(peak, size) if force[i] < level]
            assert flanks(force, peak, level) == (max(before, default=-1), min(after, default=size))


@pytest.mark.parametrize("rate", [100.0, 270.0, 910.0, 4900.0])
def test_the_force_at_the_end_is_the_larger_mean_over_its_last_times(rate):
    """12.5 ms and 4 ms, at least three samples each; whether it falls or rises there."""
    time = np.arange(200) / rate
    for force in (np.cos(time * rate / 3.0), np.sin(time * rate / 2.0), time * rate, -time * rate):
        windows = [max(int(window * rate) + 1, 3) for window in (0.0125, 0.004)]
        assert end_level(time, force) == pytest.approx(max(force[-n:].mean() for n in windows), abs=1e-12)


@pytest.mark.parametrize(("last", "known"), [(0.59, False), (0.61, True), (0.65, True), (0.69, True), (0.9, True)])
def test_a_held_force_is_the_mean_from_half_a_second_to_seven_tenths(last, known):
    after = np.arange(0.0005, last, 0.001)
    force = np.where(after < 0.5, 200.0, np.where(after < 0.7, 50.0 + 100.0 * (after - 0.5), 300.0))
    held = hold_force(after, force)
    assert held == pytest.approx(50.0 + 50.0 * (min(last, 0.7) - 0.5), abs=0.06) if known else np.isnan(held)


def test_the_contact_scenario_follows_from_what_is_measured():
    """Every combination of what lies on either side of a boundary, against the definition."""
    whole = fm.find_impact(recording(*pulse(150.0, seed=1)))
    seen = set()
    for recorded, duration, contact_over, gap, acts, hold, end in itertools.product(
        (0.45, 0.55, 0.9), (0.3, 0.49, 0.51), (True, False), (0.0, 0.03), (True, False),
        (np.nan, 4.0, 6.0, 9.0, 40.0), (1.0, 4.4, 4.6, 9.9, 10.1, 14.9, 15.1, 19.9, 20.1, 30.0),
    ):  # fmt: skip
        for peak in (50.0, 150.0):
            impact = replace(
                whole, onset=0.0, end=recorded, contact_duration=duration, contact_over=contact_over, gap=gap,
                acts_after_phase1=acts, hold_force=hold, end_force=end, floor=8.0, hold_floor=5.0, peak_force=peak,
            )  # fmt: skip
            if recorded < 0.5:
                over = end <= max(10.0, 0.1 * peak)
            else:
                over = contact_over and duration < 0.5 and not hold > 5.0
            if gap or not (over or (hold > 8.0 and end >= hold / 2)):
                expected = fm.ContactScenario.UNDETERMINED
            elif over and acts:
                expected = fm.ContactScenario.WITHOUT_CLAMPING
            else:
                expected = fm.ContactScenario.UNCONSTRAINED if over else fm.ContactScenario.WITH_CLAMPING
            assert fm.classify_contact(impact) is expected
            seen.add(expected)
    assert seen == set(fm.ContactScenario)


@pytest.mark.parametrize("rate", [200.0, 2000.0])
@pytest.mark.parametrize(("drift", "noise"), [(0.0, 0.4), (20.0, 0.4), (-5.0, 0.9), (1.0, 0.05)])
@pytest.mark.parametrize(("start", "end"), [(0, 60), (7, 200), (0, 25)])
def test_the_baseline_is_a_line_whose_slope_is_shrunk_by_its_uncertainty(rate, drift, noise, start, end):
    """b = b_ls p^2 / (p^2 + s^2) with p = 3 N/s, and what it leaves over the samples before contact."""
    time = 3.0 + np.arange(400) / rate
    force = 12.0 + drift * time + noise * np.clip(np.random.default_rng(3).normal(size=400), -2, 2)
    found = contact_force(recording(time, force), start, end)
    t, f = time[start:end], force[start:end]
    fitted = linregress(t, f)
    trust = 9.0 / (9.0 + fitted.stderr**2)
    slope = fitted.slope * trust
    removed = f.mean() + slope * (time - t.mean())
    spread = f - removed[start:end]
    assert_allclose(found.force, force - removed, atol=1e-9)
    sd = np.sqrt(np.sum(spread**2) / (end - start - 2))
    assert (found.baseline_sd, found.drift) == pytest.approx((sd, slope), rel=1e-6)
    assert found.drift_sd == pytest.approx(fitted.stderr * np.sqrt(trust), rel=1e-6)
    assert (found.baseline_samples, found.unquiet) == (end - start, 0.0)
    assert (found.baseline_start, found.baseline_end) == (t[0], t[-1])
    assert found.baseline_level == pytest.approx(abs(removed[end - 1]), rel=1e-9)
    allowed = 2.0 * found.drift_sd * np.maximum(time - (t[0] + t[-1]) / 2, 0.0)
    assert_allclose(found.drift_allowance(time), allowed, rtol=1e-9)
    assert_allclose(found.floor_at(time), max(5.0, 4.0 * sd) + allowed, rtol=1e-6)
    assert_allclose(found.mean_floor_at(time), max(5.0, 2.0 * sd) + allowed, rtol=1e-6)


@pytest.mark.parametrize(("samples", "rate", "enough"), [(5, 200.0, False), (6, 200.0, True), (11, 1200.0, False)])
def test_a_baseline_has_six_samples_and_ten_milliseconds(samples, rate, enough):
    time = np.arange(300) / rate
    force = 7.0 + 0.1 * np.cos(np.arange(300) ** 2.0)
    found = contact_force(recording(time, force), 0, samples)
    assert (found.baseline_samples, found.drift_sd == 3.0) == ((samples, False) if enough else (0, True))
    if not enough:
        assert_allclose(found.force, force)
        assert (found.baseline_level, found.baseline_sd) == (0.0, noise_sd(force))
        assert_allclose(found.drift_allowance(time), 6.0 * time, atol=1e-12)


@pytest.mark.parametrize("components", [1, 3])
def test_the_norm_of_noise_is_taken_off_and_a_direction_projects(components):
    rng = np.random.default_rng(11)
    time = np.arange(500) / 1000.0
    force = np.array([3.0, -5.0, 9.0])[:components] + rng.normal(0, 0.3, (500, components))
    given = force[:, 0] if components == 1 else force
    found = contact_force(recording(time, given), 0, 400)
    lines = [contact_force(recording(time, axis), 0, 400) for axis in force.T]
    quiet = np.array([line.force for line in lines])
    power = np.mean(np.sum(quiet[:, :400] ** 2, axis=0))
    norm = quiet[0] if components == 1 else np.sqrt(np.maximum(np.sum(quiet**2, axis=0) - power, 0.0))
    assert_allclose(found.force, norm, atol=1e-9)
    assert abs(found.drift) == pytest.approx(np.linalg.norm([line.drift for line in lines]), rel=1e-9)
    assert found.drift_sd == pytest.approx(np.linalg.norm([line.drift_sd for line in lines]), rel=1e-9)
    assert found.baseline_level == pytest.approx(np.linalg.norm([line.baseline_level for line in lines]), rel=1e-9)


def test_the_noise_of_a_curve_is_told_from_its_second_differences():
    rng = np.random.default_rng(13)
    assert noise_sd(5.0 + 3.0 * np.arange(20_001) + rng.normal(0, 0.7, 20_001)) == pytest.approx(0.7, rel=0.02)
    assert noise_sd(rng.normal(size=4)) == 0.0
    bends = np.array([1.0, -2.0, 4.0])  # of five samples
    force = np.concatenate([[0.0, 0.0], np.cumsum(np.cumsum(bends))])
    assert noise_sd(force) == pytest.approx(2.0 * 1.4826 / np.sqrt(6.0))


CLEAN_IMPACT = fm.find_impact(recording(*CLEAN))
CLEAN_TOPS = find_tops(CLEAN_IMPACT)


@pytest.mark.parametrize("forces", list(itertools.permutations((140.0, 150.0, 160.0))))
@pytest.mark.parametrize("low_passed", [True, False])
def test_a_verdict_takes_the_largest_reading_of_the_peak(forces, low_passed):
    peak, raw, filtered = forces if low_passed else (*forces[:2], np.nan)
    impact = replace(CLEAN_IMPACT, peak_force=peak, raw_peak_force=raw, filtered_peak_force=filtered)
    assert impact.verdict_peak_force == np.nanmax([peak, raw, filtered])


@pytest.mark.parametrize("flags", [(), ("saturated",), ("later_peak",), ("double_hit",), ("saturated", "later_peak")])
@pytest.mark.parametrize("later", [100.0, 200.0])
def test_a_map_takes_a_later_force_that_is_flagged_and_the_largest_sample_of_a_peak_cut_off(flags, later):
    named = tuple(Flag(fm.Quality(name), "") for name in flags)
    impact = replace(CLEAN_IMPACT, peak_force=150.0, raw_peak_force=155.0, later_force=later, flags=named)
    peak = 155.0 if "saturated" in flags else 150.0
    assert impact.map_force == (max(peak, later) if set(flags) & {"later_peak", "double_hit"} else peak)


BOUNDARIES = {  # flag, what is measured (of the contact force: with a point), just not enough and just enough for it
    "scatter": ("no_baseline", ".baseline_sd", 9.9, 10.1, {}),
    "scatter of a high peak": ("no_baseline", ".baseline_sd", 19.9, 20.1, {"peak_force": 400.0}),
    "no baseline": ("no_baseline", ".baseline_samples", 6, 0, {}),
    "offset": ("offset", ".baseline_level", 49.9, 50.1, {}),
    "growing force": ("unquiet", ".drift", 16.9, 17.1, {".drift_sd": 1.0}),
    "falling force": ("unquiet", ".drift", -16.9, -17.1, {".drift_sd": 1.0}),
    "a quarter is not quiet": ("unquiet", ".unquiet", 0.249, 0.251, {}),
    "a tenth is not quiet": ("drift", ".unquiet", 0.099, 0.101, {}),
    "drift": ("drift", ".drift", 2.99, 3.01, {"onset": 0.0, "end": 2.0}),
    "drift over half a second": ("drift", ".drift", -5.99, -6.01, {"onset": 0.0, "end": 0.5}),
    "braking": ("braking_transient", "force_before", 9.9, 10.1, {".baseline_sd": 0.1}),
    "braking with noise": ("braking_transient", "force_before", 15.9, 16.1, {".baseline_sd": 2.0}),
    "braking before a high peak": ("braking_transient", "force_before", 19.9, 20.1, {"peak_force": 400.0}),
    "ringing": ("ringing", "raw_peak_force", 157.4, 157.6, {"peak_force": 150.0, ".baseline_sd": 0.1}),
    "ringing in noise": ("ringing", "raw_peak_force", 159.9, 160.1, {"peak_force": 150.0, ".baseline_sd": 2.0}),
    "second hit": ("double_hit", "later_force", 119.9, 120.1, {"peak_force": 150.0, "bounces": 1}),
    "later peak": ("later_peak", "later_force", 159.9, 160.1, {"raw_peak_force": 160.0, "bounces": 0}),
    "end": ("too_short", "end", 0.501, 0.499, {"onset": 0.0}),
    "width": ("unit", "phase1_width", 4.01e-4, 3.99e-4, {}),
    "samples": ("unresolved", "phase1_samples", 16, 15, {}),
    "early samples": ("unresolved", "early_samples", 10, 9, {"onset": 0.0, "end": 0.06}),
    "early samples of how long": ("unresolved", "end", 0.049, 0.051, {"onset": 0.0, "early_samples": 9}),
    "gap": ("gap", "gap", 0.0, 0.021, {}),
}


@pytest.mark.parametrize("name", BOUNDARIES)
def test_a_flag_is_set_beyond_its_boundary_and_not_before(name):
    flag, figure, without, enough, others = BOUNDARIES[name]
    for value, expected in ((without, False), (enough, True)):
        given = {**others, figure: value}
        contact = replace(CLEAN_IMPACT.contact, **{key[1:]: each for key, each in given.items() if key[0] == "."})
        impact = replace(CLEAN_IMPACT, contact=contact, **{key: each for key, each in given.items() if key[0] != "."})
        before, smooth = np.zeros(10), np.full(10, 20.0)
        flags = flags_of(impact, CLEAN_TOPS, before, smooth, [], find_swing(impact))
        assert (flag in {each.name.value for each in flags}) == expected, (value, flags)


@pytest.mark.parametrize("lost", [0.04, 0.06, 0.1])
def test_samples_missing_right_before_a_small_contact_do_not_hide_it(lost):
    """A larger contact follows 0.2 s later; nothing was read in the time in which the first one may have begun."""
    time = np.arange(-400, 900) / 1000
    force = half_sine(time, 60.0, 0.03) + half_sine(time, 300.0, 0.03, 0.2)
    force += np.random.default_rng(1).normal(0, 0.2, time.size)
    kept = (time < 0.005 - lost) | (time > 0.005)
    impact = fm.find_impact(recording(time[kept], force[kept]))
    assert impact.peak_force == pytest.approx(60.0, abs=1.0)
    assert impact.later_force == pytest.approx(300.0, abs=1.0)
    assert {fm.Quality.GAP, fm.Quality.DOUBLE_HIT} <= {flag.name for flag in impact.flags}


@pytest.mark.parametrize(("level", "lost"), [(40.0, 0.03), (0.0, 0.06)])
@pytest.mark.parametrize(("start", "counts"), [(0.1, True), (0.68, True), (0.72, False)])
def test_a_gap_counts_if_it_begins_within_the_time_that_is_looked_at(level, lost, start, counts):
    """20 ms while a force acts, 50 ms at rest, up to 0.7 s after the onset."""
    time, force = pulse(150.0, held=level, after=1.0, rate=1000.0, seed=4)
    for missing, gap in ((lost, counts), (lost - 0.015, False)):
        kept = (time < start) | (time > start + missing)
        impact = fm.find_impact(recording(time[kept], force[kept]))
        assert (impact.gap > 0) == gap
        assert impact.gap == pytest.approx(missing if gap else 0.0, abs=0.0021)
        assert impact.has(fm.Quality.GAP) == gap


@pytest.mark.parametrize(("beyond", "said"), [(1, "1 time that"), (2, "2 times that"), (3, "3 times that")])
def test_how_often_the_range_was_exceeded_is_said(beyond, said):
    time, force = pulse(150.0)
    mask = np.zeros(time.size, bool)
    mask[np.argsort(force)[-beyond:]] = True
    impact = fm.find_impact(recording(time, force, beyond_range=mask))
    flag = next(flag for flag in impact.flags if flag.name is fm.Quality.SATURATED)
    assert flag.figure.startswith(f"the device said {said} its range was exceeded: at least 150.0 N")


@pytest.mark.parametrize(
    ("rate", "duration", "asked"),
    [(40, 0.03, 1000), (80, 0.015, 1300), (100, 0.015, 1700), (100, 0.02, 5200), (150, 0.01, 3800), (150, 0.02, 1300)],
)
def test_the_sampling_rate_that_is_asked_for(rate, duration, asked):
    """16 samples in Phase I less one interval, in a quarter of it at least; 7 across the half width; 10 in 50 ms."""
    impact = fm.find_impact(recording(*pulse(150.0, rate=float(rate), duration=duration, before=0.5)))
    flag = next(flag for flag in impact.flags if flag.name is fm.Quality.UNRESOLVED)
    assert flag.figure.endswith(f"it takes {asked} Hz or more, this is {rate} Hz")
    shown = impact.phase1_end - impact.onset
    few = 16 / max(shown - 1 / rate, shown / 4)
    assert asked >= 100 * np.ceil(few / 100)


@pytest.mark.parametrize("share", [0.07, 0.12, 0.2, 0.28])
@pytest.mark.parametrize("rebound", [False, True])
@pytest.mark.parametrize("cut", [False, True])
def test_a_component_that_is_cut_off_far_below_the_peak_is_found(share, rebound, cut):
    """Two components of one size, one of a small range: what it shows of the peak says nothing of what it hides, also
    where it swings back by more."""
    force = np.column_stack([FORCE, np.zeros_like(FORCE), -FORCE])
    ceiling = share * np.linalg.norm(force, axis=1).max()
    if rebound:
        force[:, 0] -= 1.2 * ceiling * np.interp(TIME - 0.06, TIME, FORCE) / FORCE.max()
    if cut:
        force[:, 0] = np.minimum(force[:, 0], ceiling)
    (impact,) = fm.find_impacts(recording(TIME, force + 0.2 * np.random.default_rng(4).normal(size=force.shape)))
    flags = [flag.name for flag in impact.flags]
    assert ("saturated" in flags) == cut, flags


@pytest.mark.parametrize("share", [0.05, 0.15, 0.25])
@pytest.mark.parametrize("seed", range(4))
def test_a_small_component_of_its_own_shape_is_not_taken_for_cut_off(share, seed):
    """It rings, or follows the force with a lag, as a side force does."""
    rng = np.random.default_rng(seed)
    side = (
        share * np.interp(TIME - rng.uniform(0, 0.004), TIME, FORCE) * (1 + 0.3 * np.sin(rng.uniform(200, 900) * TIME))
    )
    force = np.column_stack([side, 0.3 * side, FORCE]) + 0.2 * rng.normal(size=(TIME.size, 3))
    (impact,) = fm.find_impacts(recording(TIME, force))
    assert "saturated" not in [flag.name for flag in impact.flags]
