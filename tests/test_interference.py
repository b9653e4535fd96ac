"""What is not the contact's: spikes, lost samples, a stuck logger, hum; signs of an exceeded range; fast sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import forcemap as fm
from forcemap.impacts.interference import find_corner
from forcemap.impacts.quality import MOST_LIFTED, MOST_LOWERED, UNKNOWN_PEAK
from pulses import DEVICE, collect, half_sine, pulse, recording, register, rows, save, write_campaign

SEED = 202672
RATE = 2000.0
TIME, WHOLE = pulse(165.0, rate=RATE, seed=SEED)
COLUMNS = {"time": "time_s", "force": "force_N"}


def flags(impact):
    return {flag.name for flag in impact.flags}


def flag(impact, name):
    (found,) = [each for each in impact.flags if each.name is name]
    return found.figure


def at(time):
    return int(TIME.searchsorted(time))


def is_within(impact, limit):
    return fm.check_impact(impact, limit).outcome is fm.VerdictOutcome.WITHIN


@pytest.mark.parametrize("samples", [1, 2, 3])
@pytest.mark.parametrize("when", [0.005, 0.015, 0.022], ids=["rise", "top", "fall"])
def test_a_spike_is_flagged_with_its_figure_and_lowers_no_verdict(when, samples):
    force = WHOLE.copy()
    force[at(when) : at(when) + samples] += 230.0
    impact = fm.find_impact(recording(TIME, force))
    assert flags(impact) & {fm.Quality.SPIKE} or impact.map_force == pytest.approx(165.0, rel=0.05)
    assert not is_within(impact, 160.0)
    assert fm.check_impact(impact, 140.0).outcome is fm.VerdictOutcome.EXCEEDED


def test_the_figure_of_a_spike_names_the_force_with_and_without_it():
    force = WHOLE.copy()
    force[at(0.009) : at(0.009) + 2] = 351.0
    figure = flag(fm.find_impact(recording(TIME, force)), fm.Quality.SPIKE)
    assert "2 such samples" in figure
    assert "351" in figure
    assert any(f"{newtons}." in figure for newtons in range(163, 168))


def test_readings_that_fall_out_on_the_rise_end_no_phase():
    force = WHOLE.copy()
    force[at(0.006) : at(0.006) + 2] = 0.0
    impact = fm.find_impact(recording(TIME, force))
    assert not is_within(impact, 160.0)
    assert flags(impact) & set(UNKNOWN_PEAK) or impact.map_force == pytest.approx(165.0, rel=0.05)


@pytest.mark.parametrize("lost", [0.010, 0.012, 0.016])
def test_a_top_that_the_logger_lost_and_closed_up(lost):
    time, force = pulse(165.0, rate=10_000.0, seed=SEED)
    kept = np.abs(time - 0.015) > lost / 2
    impact = fm.find_impact(recording(time[: kept.sum()], force[kept]))
    assert flags(impact) & set(UNKNOWN_PEAK)
    assert not is_within(impact, 160.0)


def test_a_logger_that_stood_still_at_the_top():
    force = WHOLE.copy()
    force[at(0.007) : at(0.021)] = force[at(0.007)]
    impact = fm.find_impact(recording(TIME, force))
    assert impact.saturated or fm.Quality.STUCK in flags(impact)
    assert not is_within(impact, 160.0)


def test_a_logger_that_stands_still_where_the_force_hardly_moves():
    time, force = pulse(165.0, rate=10_000.0, seed=SEED)
    stood = (time > 0.0125) & (time < 0.0175)
    force[stood] = force[stood][0]
    impact = fm.find_impact(recording(time, force))
    assert impact.map_force == pytest.approx(165.0, rel=0.05)
    assert not is_within(impact, 200.0)


@pytest.mark.parametrize("change", [-10.0, 10.0])
def test_a_small_jump_beside_the_top_bars_within_and_leaves_the_map_alone(change):
    force = np.where(np.abs(TIME - 0.020) < 0.005, WHOLE + change * np.sign(TIME - 0.0151), WHOLE)
    impact = fm.find_impact(recording(TIME, force))
    assert fm.Quality.STEP in flags(impact)
    assert not flags(impact) & set(UNKNOWN_PEAK)
    assert not is_within(impact, 200.0)


def test_a_first_peak_that_was_lost_but_for_its_foot_and_tail():
    time = np.arange(-400, 3000) / 10_000.0
    rise, tail = 45.0 * np.sin(np.pi / 2 * np.clip(time / 0.003, 0, 1)), 45.0 * np.clip((0.04 - time) / 0.038, 0, 1)
    force = np.minimum(rise, tail) + 60.0 * half_sine(time, 1.0, 0.02, 0.045)
    impact = fm.find_impact(recording(time, force + np.random.default_rng(SEED).normal(0, 1.0, time.size)))
    assert "as long as it rose" in flag(impact, fm.Quality.STEP)
    assert not is_within(impact, 90.0)


def test_a_logger_that_stays_where_it_stood_still():
    force = WHOLE.copy()
    force[at(0.006) :] = force[at(0.006)]
    impact = fm.find_impact(recording(TIME, force))
    assert not is_within(impact, 160.0)


def test_readings_in_coarse_steps_are_not_stuck():
    impact = fm.find_impact(recording(TIME, np.round(WHOLE)))
    assert not flags(impact) & {fm.Quality.STUCK, fm.Quality.JUMP, fm.Quality.STEP, fm.Quality.SPIKE}


@pytest.mark.parametrize("frequency", [50.0, 60.0])
@pytest.mark.parametrize("phase", [0.0, 2.0, 4.0])
def test_hum_is_flagged_with_its_figure(frequency, phase):
    time, force = pulse(72.0, rate=RATE, seed=SEED)
    impact = fm.find_impact(recording(time, force + 5.0 * np.sin(2 * np.pi * frequency * time + phase)))
    figure = flag(impact, fm.Quality.HUM)
    assert "times a second" in figure
    swing, often = float(figure.split("swings by ")[1].split()[0]), float(figure.split("about ")[1].split()[0])
    assert swing == pytest.approx(5.0, rel=0.25)
    assert often == pytest.approx(frequency, rel=0.15)
    assert not is_within(impact, 68.0)


@pytest.mark.parametrize("frequency", [50.0, 60.0])
@pytest.mark.parametrize("phase", np.arange(8) * np.pi / 4)
@pytest.mark.parametrize("third", [0.0, 0.3])
def test_hum_that_moves_the_peak_takes_it_out_of_the_map(frequency, phase, third):
    time, force = pulse(72.0, rate=RATE, seed=SEED)
    turn = 2 * np.pi * frequency * time + phase
    hum = 5.0 * (np.sin(turn) + third * np.sin(3 * turn))
    impact = fm.find_impact(recording(time, force + hum))
    assert fm.Quality.HUM in flags(impact)
    moved = (force + hum).max() / force.max() - 1
    if moved < -MOST_LOWERED - 0.005 or moved > MOST_LIFTED + 0.005:
        assert fm.Quality.UNQUIET in flags(impact)
    if -MOST_LOWERED + 0.005 < moved < MOST_LIFTED - 0.005:
        assert fm.Quality.UNQUIET not in flags(impact)


@pytest.mark.parametrize("frequency", [23.0, 37.0, 83.0])
@pytest.mark.parametrize("phase", [0.0, 2.0, 4.0])
def test_what_swings_but_is_no_hum_of_the_mains_may_do_what_it_can(frequency, phase):
    time, force = pulse(72.0, rate=RATE, seed=SEED)
    impact = fm.find_impact(recording(time, force + 6.0 * np.sin(2 * np.pi * frequency * time + phase)))
    assert {fm.Quality.HUM, fm.Quality.UNQUIET} <= flags(impact)


def test_hum_that_hardly_matters_counts_in_a_verdict_alone():
    hum = 5.0 * np.sin(2 * np.pi * 50.0 * TIME)
    impact = fm.find_impact(recording(TIME, WHOLE + hum))
    assert not flags(impact) & set(UNKNOWN_PEAK)
    assert impact.unseen_force >= 4.0
    assert not is_within(impact, impact.map_force + DEVICE.error + 2.0)


def test_a_noisy_baseline_is_no_hum():
    force = WHOLE + np.random.default_rng(SEED).normal(0, 4.0, TIME.size)
    assert fm.Quality.HUM not in flags(fm.find_impact(recording(TIME, force)))


def test_a_recording_that_ends_on_the_way_to_a_higher_force_is_cut_off():
    force = 40 * half_sine(TIME, 1.0, 0.01) + 300 * half_sine(TIME, 1.0, 0.05, 0.01)
    kept = TIME < 0.02
    assert fm.Quality.CUT_OFF in flags(fm.find_impact(recording(TIME[kept], force[kept])))


def test_a_spike_is_not_used_for_the_map(tmp_path):
    folder = write_campaign(tmp_path / "campaign")
    name = "d500-h200-v100-r1"
    force = WHOLE.copy()
    force[at(0.009) : at(0.009) + 2] = 351.0
    save(folder / "recordings" / f"{name}.csv", TIME, force)
    collect(folder)
    assert register(folder)[f"{name}.csv"]["use"] == "discarded"
    assert "interference" in register(folder)[f"{name}.csv"]["reason"]
    assert name not in {row["recording"] for row in rows(folder / "impacts.csv")}


SIGNS = (
    "∞",
    "OL",
    "O.L",
    "+OVER",
    "-OVER",
    "OVL",
    "OVLD",
    "OVRNG",
    "OVERFLOW",
    "Overload",
    "over range",
)


PRESSED = [(sign, pressing) for sign in (*SIGNS, "9.9E+37", ">150", "Überlast") for pressing in (1, -1)]
PRESSED.remove(("-OVER", 1))  # the device is pulled beyond its range


def check_saturated_at_150(path, columns):
    for device in (None, fm.Device(range=150.0, error=3.0)):
        impact = fm.find_impact(fm.read_recording(path, columns=columns, device=device))
        assert impact.saturated
        assert not flags(impact) & set(UNKNOWN_PEAK)
        assert 135 < impact.map_force < 151
        assert fm.check_impact(impact, 160.0).outcome is fm.VerdictOutcome.CANNOT_TELL
        assert fm.check_impact(impact, 120.0).outcome is fm.VerdictOutcome.EXCEEDED


@pytest.mark.parametrize(("sign", "pressing"), PRESSED)
def test_a_sign_that_the_range_was_exceeded_is_saturation(tmp_path, sign, pressing):
    lines = (
        f"{time:.6f};{pressing * force:.3f}\n" if force < 150 else f"{time:.6f};{sign}\n"
        for time, force in zip(TIME, WHOLE, strict=True)
    )
    (tmp_path / "run.csv").write_text("time_s;force_N\n" + "".join(lines), encoding="utf-8")
    check_saturated_at_150(tmp_path / "run.csv", COLUMNS | {"sign": pressing})


def write_tdms(path, time, force):
    nptdms = pytest.importorskip("nptdms", reason="the extra tdms is not installed")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("g", "time", time), nptdms.ChannelObject("g", "force", force)])
    return {"time": "g/time", "force": "g/force"}


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize(("pressing", "beyond"), [(1, np.inf), (-1, -np.inf), (-1, np.inf)])
def test_infinity_in_a_tdms_file_is_saturation(tmp_path, kind, pressing, beyond):
    force = np.where(WHOLE < 150, pressing * WHOLE, beyond).astype(kind)
    columns = write_tdms(tmp_path / "run.tdms", TIME, force)
    check_saturated_at_150(tmp_path / "run.tdms", columns | {"sign": pressing})


@pytest.mark.parametrize(("what", "value"), [("force", np.nan), ("time", np.nan), ("time", np.inf)])
def test_other_values_that_are_not_finite_in_a_tdms_file_are_refused(tmp_path, what, value):
    values = {"time": TIME.copy(), "force": WHOLE.copy()}
    values[what][300] = value
    columns = write_tdms(tmp_path / "run.tdms", **values)
    with pytest.raises(fm.RecordingError, match="not finite") as caught:
        fm.read_recording(tmp_path / "run.tdms", columns=columns)
    assert caught.value.row == 301


@pytest.mark.parametrize("cell", ["nan", "inf", "", "--", "OK", "old", "error", "1.2.3"])
def test_other_words_are_still_no_numbers(tmp_path, cell):
    lines = (f"{time:.6f};{cell if k == 300 else 1.0}\n" for k, time in enumerate(TIME))
    (tmp_path / "run.csv").write_text("time_s;force_N\n" + "".join(lines))
    with pytest.raises(fm.RecordingError):
        fm.read_recordings(tmp_path / "run.csv", columns=COLUMNS)


def test_a_sign_in_the_time_is_refused(tmp_path):
    lines = (f"{'OL' if k == 300 else f'{time:.6f}'};1.0\n" for k, time in enumerate(TIME))
    (tmp_path / "run.csv").write_text("time_s;force_N\n" + "".join(lines))
    with pytest.raises(fm.RecordingError):
        fm.read_recordings(tmp_path / "run.csv", columns=COLUMNS)


def fast(rate, before=0.02, after=0.05):
    time = np.arange(-round(before * rate), round(after * rate)) / rate
    return time, half_sine(time, 165.0, 0.02)


@pytest.mark.parametrize("rate", [200e3, 250e3, 1e6])
def test_recordings_at_200_kHz_and_more_are_read(tmp_path, rate):
    save(tmp_path / "run.csv", *fast(rate))
    impact = fm.find_impact(fm.read_recording(tmp_path / "run.csv", columns=COLUMNS, device=DEVICE))
    assert impact.peak_force == pytest.approx(165.0, rel=0.01)
    assert not flags(impact) & set(UNKNOWN_PEAK)


def test_ten_megahertz_are_read_and_no_more(tmp_path):
    _, force = fast(1e7, before=0.011, after=0.022)
    (tmp_path / "run.csv").write_text("force_N\n" + "".join(f"{each:.1f}\n" for each in force))
    read = fm.read_recording(tmp_path / "run.csv", columns={"force": "force_N", "sampling_rate_Hz": 1e7})
    assert read.sampling_rate == pytest.approx(1e7)
    with pytest.raises(fm.InputError, match="1e\\+07"):
        fm.read_recording(tmp_path / "run.csv", columns={"force": "force_N", "sampling_rate_Hz": 2e7})


def test_seconds_read_as_milliseconds_are_refused_or_flagged(tmp_path):
    time, force = pulse(165.0, rate=1000.0)
    save(tmp_path / "run.csv", time, force)
    with pytest.raises(fm.RecordingError, match="time_unit"):
        fm.read_recording(tmp_path / "run.csv", columns=COLUMNS | {"time_unit": "ms"})
    time = np.arange(-20_000, 5_000) / 1e6  # 25 s at 1 kHz, a contact of 0.4 s
    impact = fm.find_impact(recording(time, 165.0 * np.sin(np.pi * np.clip(time / 0.0004, 0, 1))))
    assert fm.Quality.UNIT in flags(impact)


@pytest.mark.parametrize("rate", [250.0, 400.0])
def test_the_rate_that_an_unresolved_peak_names_would_do(rate):
    def force(time):
        return half_sine(time, 165.0, 0.014)

    time = np.arange(-round(0.2 * rate), round(0.8 * rate)) / rate
    figure = flag(fm.find_impact(recording(time, force(time))), fm.Quality.UNRESOLVED)
    enough = float(figure.split("it takes ")[1].split()[0])
    time = np.arange(-round(0.2 * enough), round(0.8 * enough)) / enough
    assert fm.Quality.UNRESOLVED not in flags(fm.find_impact(recording(time, force(time))))


@pytest.mark.parametrize("when", [0.001, 0.015, 0.4])
def test_the_device_counts_how_often_its_range_was_exceeded_in_an_impact(when):
    beyond = np.zeros(TIME.size, dtype=bool)
    beyond[at(when) : at(when) + 3] = True
    impact = fm.find_impact(recording(TIME, WHOLE, beyond_range=beyond))
    assert "3 times" in flag(impact, fm.Quality.SATURATED)
    assert impact.saturated
    before = np.roll(beyond, at(-0.1) - at(when))
    assert not fm.find_impact(recording(TIME, WHOLE, beyond_range=before)).saturated


@pytest.mark.parametrize("later", [494.0, 505.0])
def test_contact_force_after_the_peak_may_be_beyond_the_range_though_no_reading_is(later):
    """A zero of -30 N: what is read stays below 500 N, what acts does not."""
    force = WHOLE + half_sine(TIME, later, 0.03, 0.1) - 30.0
    impact = fm.find_impact(recording(TIME, force))
    assert impact.saturated == (later > 500)
    assert impact.later_force == pytest.approx(later, abs=3)


@pytest.mark.parametrize(("rise_time", "fall_time"), [(0.02, 0.02), (0.017, 0.023), (0.02, 0.031)])
@pytest.mark.parametrize("rate", [2000.0, 5000.0])
def test_a_corner_states_the_slopes_of_both_its_sides(rise_time, fall_time, rate):
    rise, fall = find_corner(triangle(rise_time, fall_time, rate), np.zeros(1))
    assert rise == pytest.approx(150.0 / rise_time, rel=1e-6)
    assert fall == pytest.approx(-150.0 / fall_time, rel=1e-6)


def triangle(rise_time, fall_time, rate):
    """The impact of a force from 0 to 150 N and back to 0 on straight flanks."""
    time = np.arange(-int(0.2 * rate), int(0.5 * rate)) / rate
    force = np.interp(time, [0.0, rise_time, rise_time + fall_time], [0.0, 150.0, 0.0])
    return fm.find_impact(recording(time, force))


@pytest.mark.parametrize(("ratio", "corner"), [(0.37, False), (0.43, True), (1 / 0.43, True), (1 / 0.37, False)])
def test_a_top_with_one_flank_of_two_fifths_of_the_others_slope_is_the_bluntest_corner(ratio, corner):
    """Over the shorter flank, the force rises to the top by it and falls by two fifths of it: 1.4 tops in all."""
    assert (find_corner(triangle(0.04, 0.04 * ratio, 10000.0), np.zeros(1)) is not None) == corner


@pytest.mark.parametrize(("share", "corner"), [(0.9, True), (1.1, False)])
@pytest.mark.parametrize("rate", [2000.0, 5000.0, 20000.0])
def test_a_corner_is_sure_to_two_standard_errors_of_its_slopes(share, corner, rate):
    """Straight flanks turn by two tops, 0.6 more than a corner must."""
    impact = triangle(0.04, 0.04, rate)
    width = 0.04 * rate  # samples across half of the top
    error = width * np.sqrt(12.0 / (width / 4) ** 3)  # of the rise over it by a line through a quarter
    noise = share * 0.6 * 150.0 / (2.0 * error)
    noisy = replace(impact, contact=replace(impact.contact, baseline_sd=noise))
    assert (find_corner(noisy, np.zeros(1)) is not None) == corner


@pytest.mark.parametrize(("share", "flagged"), [(0.024, False), (0.028, False), (0.032, True), (0.05, True)])
def test_a_spike_that_changes_no_peak_by_more_than_3_percent_is_not_worth_a_flag(share, flagged):
    """On the rise, its top a little higher than that of the curve."""
    time, force = pulse(150.0, rate=RATE)
    force[int(force.argmax()) - 8] = (1 + share) * 150.0
    impact = fm.find_impact(recording(time, force))
    assert impact.map_force == pytest.approx((1 + share) * 150.0)
    assert impact.has(fm.Quality.SPIKE) == flagged
