"""Recordings and campaign folders that once gave, or could give, a verdict or a speed that is too good."""

from __future__ import annotations

import csv
import shutil
from dataclasses import replace

import numpy as np
import pytest

import forcemap as fm
from forcemap.campaigns.binding import Binding, BindingState
from forcemap.campaigns.copies import Edges, edge_of
from forcemap.campaigns.phase_two import unused_cells
from forcemap.campaigns.recordings_table import Use
from forcemap.errors import CampaignFileError, RecordingError, TableError
from forcemap.recordings.units import ForceUnit, listed
from forcemap.words import sentence
from pulses import TOML, collect, half_sine, pulse, recording, register, rows, save, write_campaign

FORCES = listed([unit for unit in ForceUnit if unit is not ForceUnit.COUNTS])

RUN, AGAIN = "d500-h200-v100-r1", "d500-h200-v100-r2"
HAND = fm.force_limit("back_of_hand")  # 280 N transient, 140 N quasi-static
HAND_OPTIONS = ("--area", "back_of_hand")
WITHIN, UNDETERMINED = fm.VerdictOutcome.WITHIN, fm.ContactScenario.UNDETERMINED
RNG_SEED = 202631


def times(before, after=0.8, rate=2000.0):
    """Time [s] with the hit at 0."""
    return np.arange(-round(before * rate), round(after * rate)) / rate


def noisy(force, sd=0.3):
    """A force with noise, as a device with a resolution of 0.1 N shows it."""
    return np.round(force + np.random.default_rng(RNG_SEED).normal(0, sd, force.shape), 1)


def hit(time, peak):
    return half_sine(time, peak, 0.03)


def ramp(time, start, end):
    return np.clip((time - start) / (end - start), 0, 1)


def outcomes(time, force, limit, **options):
    """The outcomes of all impacts; empty if there is none, which nobody may take for "within"."""
    impacts = fm.find_impacts(recording(time, force, **options))
    return [fm.check_impact(impact, limit).outcome for impact in impacts]


def not_within(time, force, limit, **options):
    found = outcomes(time, force, limit, **options)
    return not found or any(outcome is not WITHIN for outcome in found)


def names(impact):
    return {flag.name.value for flag in impact.flags}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A campaign of 27 runs that gives a transient speed."""
    folder = write_campaign(tmp_path_factory.mktemp("campaigns") / "whole")
    collect(folder)
    assert speed(folder).outcome.has_speed
    return folder


@pytest.fixture
def folder(whole, tmp_path):
    """A copy of it to spoil."""
    return shutil.copytree(whole, tmp_path / "campaign")


@pytest.fixture
def empty(tmp_path):
    """A campaign with a plan and no recordings."""
    return write_campaign(tmp_path / "empty", recorded=False)


def put(folder, name, time, force):
    save(folder / "recordings" / f"{name}.csv", time, force)


def edit(path, change):
    """Change the rows of a CSV file as a person does."""
    table = rows(path)
    for number, row in enumerate(table):
        change(number, row)
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, table[0])
        writer.writeheader()
        writer.writerows(table)


def speed(table, *, limit=HAND, contact=fm.Contact.TRANSIENT):
    fitted = fm.fit_force_map(fm.read_dataset(table))
    return fm.safe_speed(fitted, 0.7, 0.3, limit=limit, contact=contact, bound=fm.FixedMargin(0.1))


def written(folder):
    return [(folder / name).read_bytes() for name in ("recordings.csv", "impacts.csv")]


SHORT, LONG = times(0.1), times(2.8)
LOADED = {  # time, force, limit below the total force
    "95 N until the hit, 295 N": (SHORT, np.where(SHORT < 0.03, 95.0, 0.0) + hit(SHORT, 200.0), HAND),
    "60 N until the hit, 260 N": (SHORT, np.where(SHORT < 0.03, 60.0, 0.0) + hit(SHORT, 200.0), 220.0),
    "130 N put on slowly, released before the hit": (
        LONG, 130.0 * ramp(LONG, -2.5, -2.2) * (LONG < -0.3) + hit(LONG, 400.0), fm.force_limit("abdominal_muscle")
    ),
    "creep of 40 N/s for 1 s": (
        times(1.0), 40.0 * np.where(times(1.0) < 0.03, ramp(times(1.0), -1.0, 0.0), 0.0) + hit(times(1.0), 150.0), 160.0
    ),
    "150 N throughout": (SHORT, 150.0 + hit(SHORT, 100.0), 140.0),
}  # fmt: skip


@pytest.mark.parametrize("load", LOADED)
def test_a_load_before_the_hit_is_no_zero(empty, load):
    time, force, limit = LOADED[load]
    assert not_within(time, noisy(force), limit)
    put(empty, RUN, time, noisy(force))
    with pytest.raises(CampaignFileError, match="none of 1 recordings"):
        collect(empty)
    assert register(empty)[f"{RUN}.csv"]["use"] == "discarded"


def triangle(time, start, rate, top):
    return np.clip(np.minimum(rate * (time - start), 2 * top - rate * (time - start)), 0, None)


QUICK, ALONE, QUIET = times(3.0), times(1.0, 3.0), times(11.7)
PRESSED = {
    "250 N over 2 s": (QUICK, half_sine(QUICK, 250.0, 2.0, -2.5) + hit(QUICK, 100.0), 120.0),
    "130 N over 2 s": (QUICK, half_sine(QUICK, 130.0, 2.0, -2.8) + hit(QUICK, 100.0), 120.0),
    "250 N at 100 N/s after 6 s of quiet": (QUIET, triangle(QUIET, -5.7, 100.0, 250.0) + hit(QUIET, 100.0), 120.0),
    "250 N at 60 N/s": (times(15.0), triangle(times(15.0), -9.0, 60.0, 250.0) + hit(times(15.0), 100.0), 120.0),
    "250 N, no hit": (ALONE, half_sine(ALONE, 250.0, 2.0), 140.0),
    "250 N within 0.8 s, no hit": (ALONE, half_sine(ALONE, 250.0, 0.8), 140.0),
}


@pytest.mark.parametrize("press", PRESSED)
def test_a_slow_press_is_not_passed_over(ask, tmp_path, press):
    time, force, limit = PRESSED[press]
    assert not_within(time, noisy(force), limit)
    save(tmp_path / "run.csv", time, noisy(force))
    code, found = ask("check", tmp_path / "run.csv", "--limit-N", limit, "--device-range-N", 500)
    assert code in (1, 2)
    assert found["outcome"] != "within"


@pytest.mark.parametrize(("rate", "sd"), [(4000.0, 0.3), (20_000.0, 2.0)])
@pytest.mark.parametrize("share", [0.1, 0.4, 0.61, 0.9, 0.99])
@pytest.mark.parametrize("duration", [0.03, 0.15])
def test_a_recording_that_ends_in_the_rise_has_no_peak(empty, share, duration, rate, sd):
    time = times(0.3, rate=rate)
    kept = time <= duration * np.arcsin(share) / np.pi
    force = noisy(half_sine(time, 200.0, duration), sd)
    (impact,) = fm.find_impacts(recording(time[kept], force[kept]))
    assert "cut_off" in names(impact)
    assert not_within(time[kept], force[kept], 210.0)
    put(empty, RUN, time[kept], force[kept])
    with pytest.raises(CampaignFileError, match="cut_off"):
        collect(empty)


def clamping(folder):
    """The campaign with a recording that clamps, and is discarded for its sampling."""
    put(folder, AGAIN, *pulse(150.0, rate=200.0, held=60.0))
    collect(folder)
    assert register(folder)[f"{AGAIN}.csv"]["use"] == "discarded"
    return folder


def elsewhere(folder):
    target = folder.parent / "elsewhere"
    target.mkdir()
    return shutil.copy(folder / "impacts.csv", target / "impacts.csv")


def excluded_in_the_register(folder):
    edit(folder / "recordings.csv", lambda _, row: row.update(use="excluded"))
    return folder


def frame(folder):
    from_frame = fm.ImpactDataset.from_frame
    target = folder / "again.csv"
    fm.write_dataset(from_frame(fm.read_dataset(folder).to_frame()), target)
    return target


MOVED = {
    "left alone": lambda folder: folder,
    "without its register": lambda folder: (folder / "recordings.csv").unlink() or folder,
    "elsewhere": elsewhere,
    "renamed": lambda folder: (folder / "impacts.csv").rename(folder / "april.csv"),
    "use edited": excluded_in_the_register,
    "written again": frame,
}


@pytest.mark.parametrize("move", MOVED)
def test_discarded_clamping_goes_wherever_the_table_goes(folder, move):
    found = speed(MOVED[move](clamping(folder)))
    assert found.outcome is fm.SpeedOutcome.UNCONFIRMED
    assert np.isnan(found.speed)
    assert "impacts that clamp: 1" in sentence(found.reason)


def test_use_is_found_anew_whatever_the_register_says(folder):
    collect(excluded_in_the_register(clamping(folder)))
    assert register(folder)[f"{AGAIN}.csv"]["use"] == "discarded"
    assert speed(folder).outcome is fm.SpeedOutcome.UNCONFIRMED


def test_a_data_frame_keeps_what_its_table_says(folder):
    dataset = fm.read_dataset(clamping(folder))
    again = fm.ImpactDataset.from_frame(dataset.to_frame())
    assert again.phase_two == dataset.phase_two


CLAMPED = "unused_constrained_with_clamping"


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        *((CLAMPED, cell) for cell in ("", "some", "-1", "0.9", "1 or 2", "nan")),
        ("unused_unreadable", "0.5"),
        ("unused_phase2_force_N", "nan"),
        ("unused_phase2_force_N", "-3"),
        ("not_in_table", "constrained_with_clamping=1"),  # as older versions wrote it
    ],
)
def test_garbled_figures_of_unused_recordings_are_refused(folder, column, cell):
    edit(clamping(folder) / "impacts.csv", lambda _, row: row.update({column: cell}))
    with pytest.raises(TableError) as caught:
        fm.read_dataset(folder)
    assert caught.value.column == column
    assert "forcemap collect" in str(caught.value)


def test_noise_below_zero_after_the_contact_of_an_unused_recording_does_not_garble_the_table(folder):
    entries = fm.read_campaign(clamping(folder)).entries
    free = [replace(each, phase2_force=-0.16) for each in entries if each.use is not Use.USED]
    cells = unused_cells(free)
    assert cells["unused_phase2_force_N"] == "0.00"
    edit(folder / "impacts.csv", lambda _, row: row.update(cells))
    assert fm.read_dataset(folder).phase_two.largest_force >= 0


def test_figures_of_unused_recordings_that_differ_between_rows_are_refused(folder):
    edit(clamping(folder) / "impacts.csv", lambda number, row: row.update({CLAMPED: "0"} if number == 3 else {}))
    with pytest.raises(TableError, match="several figures") as caught:
        fm.read_dataset(folder)
    assert caught.value.column == CLAMPED


def test_one_of_the_columns_of_unused_recordings_cannot_just_be_deleted(folder):
    edit(clamping(folder) / "impacts.csv", lambda _, row: row.pop(CLAMPED))
    with pytest.raises(TableError, match="the column is missing") as caught:
        fm.read_dataset(folder)
    assert caught.value.column == CLAMPED


@pytest.mark.parametrize("registered", [True, False])
def test_a_table_that_lost_what_it_says_of_unused_recordings_permits_nothing(folder, registered):
    def lose(_, row):
        for name in [name for name in row if name.startswith("unused_")]:
            del row[name]

    edit(clamping(folder) / "impacts.csv", lose)
    if not registered:
        (folder / "recordings.csv").unlink()
    assert fm.read_dataset(folder).binding.state is BindingState.BROKEN
    assert speed(folder).outcome is fm.SpeedOutcome.UNCONFIRMED


@pytest.mark.parametrize("exclude", ["", "pressed by hand"])
def test_a_recording_that_counted_cannot_just_be_deleted(folder, exclude):
    clamping(folder)
    edit(
        folder / "recordings.csv",
        lambda _, row: row.update(exclude=exclude if AGAIN in row["file"] else row["exclude"]),
    )
    before = written(folder)
    (folder / "recordings" / f"{AGAIN}.csv").unlink()
    with pytest.raises(CampaignFileError, match="the file is gone; put it back"):
        collect(folder)
    assert written(folder) == before


def test_a_renamed_file_belongs_to_the_run_of_its_new_name(empty):
    right = "d900-h400-v300-r1"
    put(empty, RUN, *pulse(210.0, seed=1))
    collect(empty)
    path = empty / "recordings" / f"{RUN}.csv"
    path.rename(path.with_stem(right))
    collect(empty)
    (row,) = rows(empty / "impacts.csv")
    assert (row["state_id"], row["speed_mps"]) == ("d900-h400-v300", "0.3")
    path.with_stem(right).rename(path.with_stem("no run at all"))
    collect(empty)
    (row,) = rows(empty / "impacts.csv")
    assert row["state_id"] == "d900-h400-v300"


def test_a_wide_files_own_name_names_no_run(tmp_path):
    toml = f'{TOML}[recordings]\ntime = "t_s"\nruns = "all"\n'
    folder = write_campaign(tmp_path / "wide", recorded=False, toml=toml)
    time, force = pulse(250.0)
    lines = (f"{t:.6f};{0.5 * f:.4f};{f:.4f}\n" for t, f in zip(time.tolist(), force.tolist(), strict=True))
    (folder / "recordings" / f"{RUN}.csv").write_text("t_s;filtered;raw\n" + "".join(lines))
    with pytest.raises(CampaignFileError, match="no run of the plan has this name"):
        collect(folder)
    assert {row["use"] for row in register(folder).values()} == {"unassigned"}


GAPS = {  # time, force, first and last missing sample
    "a hold hidden": (
        times(0.1, 1.2),
        250.0 * ramp(times(0.1, 1.2), 0.04, 0.05) * (times(0.1, 1.2) < 0.98),
        0.038,
        1.0,
    ),
    "a second hit hidden": (SHORT, half_sine(SHORT, 270.0, 0.1, 0.1), 0.038, 0.45),
    "30 ms while a force acts": (SHORT, 60.0 * ramp(SHORT, 0.03, 0.1), 0.2, 0.23),
    "30 ms in a tail": (SHORT, 40.0 * ramp(SHORT, 0.02, 0.03) * (1 - ramp(SHORT, 0.03, 0.3)), 0.1, 0.13),
}


@pytest.mark.parametrize("gap", GAPS)
def test_a_gap_that_may_hide_a_force(empty, gap):
    time, more, first, last = GAPS[gap]
    force = noisy(hit(time, 130.0) + more)
    kept = (time < first) | (time > last)
    (impact,) = fm.find_impacts(recording(time[kept], force[kept]))
    assert impact.scenario is UNDETERMINED
    assert "gap" in names(impact)
    assert fm.check_impact(impact, HAND).outcome is fm.VerdictOutcome.CANNOT_TELL
    put(empty, RUN, time[kept], force[kept])
    with pytest.raises(CampaignFileError, match="gap: no sample"):
        collect(empty)


def leave_out(folder, chosen, reason="slip"):
    """Exclude the recordings of which `chosen` holds, by their row, and collect."""
    edit(folder / "recordings.csv", lambda _, row: row.update(exclude=reason if chosen(row) else ""))
    collect(folder)
    return folder


def unplanned(folder, state):
    """Take the rows of a state out of the plan; collect then finds its recordings in no run."""
    lines = (folder / "plan.csv").read_text().splitlines(keepends=True)
    (folder / "plan.csv").write_text("".join(line for line in lines if not line.startswith(state)))
    collect(folder)
    return folder


STATE = "d500-h200-v100"
LEFT_OUT = {
    "nothing": (lambda folder: folder, ""),
    "a slip or two": (lambda folder: leave_out(folder, lambda row: row["file"] in (f"{RUN}.csv",)), ""),
    "many": (
        lambda folder: leave_out(folder, lambda row: row["file"].endswith("r1.csv") and row["file"] > "d6"),
        "with forces of up to",
    ),
    "a whole state": (
        lambda folder: leave_out(folder, lambda row: row["file"].startswith(STATE)), f"all those of {STATE}"
    ),
    "a state taken out of the plan": (lambda folder: unplanned(folder, STATE), f"all those of {STATE}"),
}  # fmt: skip


@pytest.mark.parametrize("case", LEFT_OUT)
def test_impacts_that_a_person_left_out_are_said_before_every_speed(case, tmp_path):
    """Who leaves out what is inconvenient gets a better map of the same robot; so does a map that is carried over."""
    leave, words = LEFT_OUT[case]
    folder = write_campaign(tmp_path / "cell", repeats=3, toml=TOML)
    collect(folder)
    leave(folder)
    left = [row for row in rows(folder / "recordings.csv") if row["use"] != "used"]
    force_map = fm.fit_force_map(fm.read_dataset(folder))
    fm.write_map(force_map, tmp_path / "map.json")
    for each in (force_map, fm.read_map(tmp_path / "map.json")):
        found = fm.safe_speed(each, 0.6, 0.3, limit=HAND, contact=fm.Contact.TRANSIENT, bound=fm.ToleranceBound())
        first = [sentence(warning) for warning in found.basis.warnings if warning.kind == "impacts_left_out"]
        assert len(first) == bool(words)
        for line in first:
            assert line.startswith(f"IMPACTS LEFT OUT: {len(left)} of ")
            assert words in line
            assert f"up to {max(float(row['peak_force_N']) for row in left):.0f} N" in line
    sound = Binding(BindingState.BOUND)
    for one, other in ((force_map.binding, sound), (sound, force_map.binding)):
        assert one.weaker(other).reason == force_map.binding.reason


def test_check_of_a_folder_names_what_it_does_not_judge(folder, ask):
    assert ask("check", folder, *HAND_OPTIONS)[0] == 0
    edit(folder / "recordings.csv", lambda number, row: row.update(exclude="gripper was open" if number == 0 else ""))
    first, second, third = (row["file"] for row in rows(folder / "recordings.csv")[:3])
    code, found = ask("check", folder, *HAND_OPTIONS)
    assert (code, found["excluded"]) == (0, [{"recording": first, "reason": "gripper was open"}])
    with (folder / "recordings" / second).open("a") as stream:
        stream.write("9.000000,0.000\n")
    code, found = ask("check", folder, *HAND_OPTIONS)
    assert (code, found["outcome"]) == (2, "cannot_tell")
    grown = "the file has grown since it was registered: collect the campaign again"
    assert found["unjudged"] == [{"recording": second, "reason": grown}]
    (folder / "recordings" / third).unlink()
    code, found = ask("check", folder, *HAND_OPTIONS)
    assert code == 2
    assert {"recording": third, "reason": "registered, but the file is gone"} in found["unjudged"]


@pytest.mark.parametrize("command", [("collect",), ("check", *HAND_OPTIONS)])
def test_a_linked_folder_is_not_passed_over(folder, ask, tmp_path, command):
    save(tmp_path / "day2" / f"{AGAIN}.csv", *pulse(450.0))
    (folder / "recordings" / "day2").symlink_to(tmp_path / "day2")
    code, found = ask(command[0], folder, *command[1:])
    assert code == 2
    assert "not followed" in found["error"]["message"]


@pytest.mark.parametrize("unit", ["lbf", "kgf", "kp", "daN", "N/cm2", "%", "kn", "LBF", "mN", "kg", "V", "psi"])
@pytest.mark.parametrize("name", ["Force [{}]", "Force ({})", "F / {}"])
def test_other_units_of_force_are_refused(tmp_path, unit, name):
    column = name.format(unit)
    path = tmp_path / "run.csv"
    path.write_text(f"t_s;{column}\n" + "".join(f"{i / 1000};{20.5 + i}\n" for i in range(20)))
    columns = {"time": "t_s", "force": column}
    for told in (columns, columns | {"force_unit": "kN"}, {"time": 1, "force": 2}):
        with pytest.raises(RecordingError, match=rf"expected {FORCES}|correct the one"):
            fm.read_recording(path, columns=told)
    counted = fm.read_recording(path, columns=columns | {"force_unit": "counts", "newtons_per_count": 2.0})
    assert counted.force[0] == 41.0


@pytest.mark.parametrize(
    "column",
    ["force_lbf", "Kraft_kgf", "my_force_daN", "force in lbf", "Force lbf", "F/kp", "Force, %", "N/cm2", "lbf"],
)
def test_other_units_at_the_end_of_a_name_are_refused(tmp_path, column):
    path = tmp_path / "run.csv"
    path.write_text(f"t_s;{column}\n" + "".join(f"{i / 1000};{20.5 + i}\n" for i in range(20)))
    with pytest.raises(RecordingError, match=f"expected {FORCES}"):
        fm.read_recording(path, columns={"time": "t_s", "force": column})


@pytest.mark.parametrize("unit", ["lbf", "kgf", "daN", "%"])
def test_other_units_of_a_tdms_channel_are_refused(tmp_path, unit):
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "run.tdms"
    properties = {"wf_increment": 0.0005, "unit_string": unit}
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([nptdms.ChannelObject("PFMD", "force", pulse(30.0)[1], properties=properties)])
    columns = {"force": "PFMD/force", "sampling_rate_Hz": 2000.0}
    with pytest.raises(RecordingError, match=f"the file says '{unit}'"):
        fm.read_recording(path, columns=columns)
    counted = fm.read_recording(path, columns=columns | {"force_unit": "counts", "newtons_per_count": 4.448})
    assert counted.force.max() == pytest.approx(133.44, abs=0.01)


def clipped():
    time, force = pulse(300.0, seed=RNG_SEED)
    rng = np.random.default_rng(RNG_SEED)
    yield "exactly", time, np.minimum(force, 130.0), {}
    yield "then noise", time, np.round(np.minimum(pulse(300.0)[1], 130.0) + rng.normal(0, 0.3, time.size), 1), {}
    yield "then drift taken off", time, np.minimum(force, 130.0) - 2.0 * time, {}
    vector = rng.normal(0, 0.3, (time.size, 3))
    vector[:, 2] += force
    vector[:, 2] = np.minimum(vector[:, 2], 130.0)
    yield "one of three", time, vector, {}
    yield "one of three, projected", time, vector, {"direction": (0.0, 0.0, 1.0)}


@pytest.mark.parametrize(("time", "force", "options"), [pytest.param(*case, id=name) for name, *case in clipped()])
def test_a_curve_cut_off_below_the_range_is_saturated(time, force, options):
    (impact,) = fm.find_impacts(recording(time, force, **options))
    assert impact.saturated
    assert fm.check_impact(impact, 140.0).outcome is fm.VerdictOutcome.CANNOT_TELL
    assert fm.check_impact(impact, 120.0).outcome is fm.VerdictOutcome.EXCEEDED


@pytest.mark.parametrize("later", [half_sine(SHORT, 300.0, 0.04, 0.1), 300.0 * ramp(SHORT, 0.05, 0.1)])
def test_a_later_hump_is_judged_by_what_is_read(later):
    """Cut off at the device's range it is saturated; below the range it counts as read, and is flagged."""
    force = hit(SHORT, 120.0) + later + np.random.default_rng(RNG_SEED).normal(0, 0.3, SHORT.size)
    cut = np.minimum(force, 130.0)
    (impact,) = fm.find_impacts(recording(SHORT, cut, device=fm.Device(range=130.0, error=3.0)))
    assert impact.saturated
    assert fm.check_impact(impact, 140.0).outcome is not WITHIN
    (impact,) = fm.find_impacts(recording(SHORT, cut))
    assert "double_hit" in names(impact)
    assert fm.check_impact(impact, 132.0).outcome is not WITHIN
    assert fm.check_impact(impact, 125.0).outcome is fm.VerdictOutcome.EXCEEDED


def test_a_copy_under_another_runs_name_is_no_repeat(folder):
    shutil.copy(folder / "recordings" / f"{RUN}.csv", folder / "recordings" / f"{AGAIN}.csv")
    dataset = collect(folder)
    assert len(dataset) == 27
    assert "a copy is no repeat" in register(folder)[f"{AGAIN}.csv"]["reason"]


def rewritten(recording, time=lambda t: t, force=lambda f: f, cut=slice(None), unit="N"):
    """The text of a recording written otherwise."""
    header, *lines = recording.read_text().splitlines()
    t, f = np.array([line.split(",") for line in lines[cut]], dtype=float).T
    rows = "".join(f"{x:.6f},{y!r}\n" for x, y in zip(time(t).tolist(), force(f).tolist(), strict=True))
    return f"{header.replace('_N', f'_{unit}')}\n{rows}"


COPIES = {
    "whole": {},
    "end": {"cut": slice(None, -1)},
    "both": {"cut": slice(30, -200)},
    **{f"first {n} samples": {"cut": slice(n, None)} for n in (7, 20, 45, 70, 100)},
    "another zero of time": {"time": lambda t: t - 0.123456},
    "an offset": {"force": lambda f: f + 7.3},
    "rounded to 1 N": {"force": np.round},
    "in kN": {"force": lambda f: np.round(f / 1000, 3), "unit": "kN"},
    "single precision": {"force": lambda f: (f + 1.1).astype(np.float32).astype(float)},
}


@pytest.mark.parametrize("copy", COPIES)
def test_a_copy_that_was_written_otherwise_is_a_copy(folder, copy):
    text = rewritten(folder / "recordings" / f"{RUN}.csv", **COPIES[copy])
    (folder / "recordings" / f"{AGAIN}.csv").write_text(text)
    assert len(collect(folder)) == 27
    assert "a copy is no repeat" in register(folder)[f"{AGAIN}.csv"]["reason"]


@pytest.mark.parametrize("share", [(-0.6, 0.8, 0.0), (0.1, -0.2, -0.9)])
def test_a_copy_of_three_components_is_a_copy(share):
    def edge(time, force):
        (impact,) = fm.find_impacts(shown := recording(time, force))
        return edge_of(impact, shown)

    (time, one), (_, other) = (pulse(200.0, rate=1000.0, seed=seed) for seed in (3, 4))
    one, other = (np.round(force[:, None] * np.array(share), 1) for force in (one, other))
    every = Edges([edge(time, one), edge(time, other)])
    assert every.same_as(edge(time[45:] - 0.0123, one[45:] + 2.5)).tolist() == [0]


@pytest.mark.parametrize("copy", ["whole", "first 45 samples", "in kN"])
def test_forces_of_two_states_count_for_neither(folder, copy):
    """Whichever was read first: nothing tells which of the two was made where its name says."""
    other = next(name for name in fm.read_plan(folder).recording.tolist() if not name.startswith(RUN[:-3]))
    text = rewritten(folder / "recordings" / f"{RUN}.csv", **COPIES[copy])
    (folder / "recordings" / f"{other}.csv").write_text(text)
    for name in ("recordings.csv", "impacts.csv"):
        (folder / name).unlink(missing_ok=True)
    assert len(collect(folder)) == 25
    for name in (RUN, other):
        assert "is of another state: one of the two is wrong" in register(folder)[f"{name}.csv"]["reason"]


@pytest.mark.parametrize(
    ("step", "noise", "whole", "cut_off"),
    [
        (0.01, 0.02, 0, 0),
        (0.01, 0.4, 0, 0),
        (0.5, 0.4, 0, 0),
        (2.0, 0.4, 0, 0),
        (0.5, 0.02, 0, 10),
        (2.0, 0.02, 40, 100),
    ],
)
@pytest.mark.parametrize("saturated", [False, True])
def test_repeats_are_no_copies(step, noise, whole, cut_off, saturated):
    """Of a robot that repeats well, by a device that reads coarsely: hardly two of 19,900 pairs are alike."""
    rng, edges, top = np.random.default_rng(17), [], 150.0 if saturated else np.inf
    for _ in range(200):
        time, force = pulse(rng.normal(200.0, 0.4), rate=1000.0)
        shift = rng.uniform(0, 1e-3)
        force = np.minimum(np.interp(time + shift, time, force) + rng.normal(0, noise, time.size), top)
        (impact,) = fm.find_impacts(shown := recording(time, step * np.round(force / step)))
        edges.append(edge_of(impact, shown))
    every = Edges(edges)
    assert sum(every.same_as(edge).size for edge in edges) - 200 <= 2 * (cut_off if saturated else whole)


@pytest.mark.parametrize("cut", [None, -1], ids=["whole", "cut off"])
def test_a_copy_of_an_excluded_recording_is_no_other_run(folder, cut):
    """An exclusion takes the impact out, not one of its files: the copy is no repeat of its state, either."""
    collect(folder)
    other = next(name for name in fm.read_plan(folder).recording.tolist() if name != RUN)
    text = (folder / "recordings" / f"{RUN}.csv").read_text().splitlines(keepends=True)
    (folder / "recordings" / f"{other}.csv").unlink()
    shown = [row for row in register(folder).values() if row["file"] != f"{other}.csv"]
    for row in shown:
        row["exclude"] = "wrong place" if row["file"] == f"{RUN}.csv" else row["exclude"]
    with (folder / "recordings.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, shown[0])
        writer.writeheader()
        writer.writerows(shown)
    (folder / "recordings" / f"{other}.csv").write_text("".join(text[:cut]))
    assert len(collect(folder)) == 25
    assert "which is excluded: a copy is no other run" in register(folder)[f"{other}.csv"]["reason"]
    (folder / "recordings" / f"{AGAIN}.csv").write_text("".join(text[:cut]))
    assert len(collect(folder)) == 25
    assert "which is excluded: a copy is no other run" in register(folder)[f"{AGAIN}.csv"]["reason"]


@pytest.mark.parametrize("linked", ["", "linked"], ids=["itself", "through a link"])
def test_a_file_in_a_subfolder_is_read_as_its_campaign_says(tmp_path, ask, linked):
    toml = f'{TOML}[recordings]\ntime = "t"\ntime_unit = "ms"\nforce = "F"\nforce_unit = "kN"\n'
    folder = write_campaign(tmp_path / "campaign", recorded=False, toml=toml)
    time, force = pulse(300.0)
    path = folder / "recordings" / "monday" / "late" / "run.csv"
    path.parent.mkdir(parents=True)
    lines = (f"{1e3 * t:.4f};{1e-3 * f:.7f}\n" for t, f in zip(time.tolist(), force.tolist(), strict=True))
    path.write_text("t;F\n" + "".join(lines))
    if linked:
        (tmp_path / linked).symlink_to(path)
        path = tmp_path / linked
    code, found = ask("check", path, *HAND_OPTIONS)
    assert (code, found["outcome"], found["device_range_stated"]) == (1, "exceeded", True)


@pytest.mark.parametrize("sd", [5.0, 8.0, 12.0])
def test_noise_does_not_hide_a_hold(sd):
    time = times(0.3)
    held = np.where(time > 0.02, 3.5 * sd, 0.0)
    for seed in range(5):
        noise = np.random.default_rng(seed).normal(0, sd, time.size)
        (impact,) = fm.find_impacts(recording(time, hit(time, 230.0) + held + noise))
        assert impact.scenario in (UNDETERMINED, fm.ContactScenario.WITH_CLAMPING)
        assert fm.check_impact(impact, HAND).outcome is not WITHIN


@pytest.mark.parametrize("stated", ["0.2", "0.05"])
def test_a_speed_far_from_the_plan_is_discarded(folder, stated):
    edit(folder / "recordings.csv", lambda _, row: row.update(speed_mps=stated if RUN in row["file"] else ""))
    assert len(collect(folder)) == 26
    assert "far from the planned 0.1 m/s" in register(folder)[f"{RUN}.csv"]["reason"]
    edit(folder / "recordings.csv", lambda _, row: row.update(speed_mps="0.11" if RUN in row["file"] else ""))
    assert len(collect(folder)) == 27


def test_a_register_edited_meanwhile_is_kept(folder):
    def exclude(done, _):
        if done == 5:
            edit(
                folder / "recordings.csv",
                lambda number, row: row.update(exclude="gripper was open" if number == 0 else ""),
            )

    table = (folder / "impacts.csv").read_bytes()
    (folder / ".judged").unlink()  # else the folder is as it was left, and nothing is judged
    with pytest.raises(CampaignFileError, match="was changed meanwhile, so nothing was written"):
        fm.build_dataset(fm.read_campaign(folder), progress=exclude)
    assert rows(folder / "recordings.csv")[0]["exclude"] == "gripper was open"
    assert (folder / "impacts.csv").read_bytes() == table
    assert len(collect(folder)) == 26


@pytest.mark.parametrize("appears", [True, False])
def test_a_register_that_comes_or_goes_meanwhile(folder, appears):
    path = folder / "recordings.csv"
    content = path.read_bytes()
    if appears:
        path.unlink()

    def swap(done, _):
        if done == 5:
            path.write_bytes(content) if appears else path.unlink()

    table = (folder / "impacts.csv").read_bytes()
    (folder / ".judged").unlink()  # else the folder is as it was left, and nothing is judged
    with pytest.raises(CampaignFileError, match="was changed meanwhile"):
        fm.build_dataset(fm.read_campaign(folder), progress=swap)
    assert path.exists() == appears
    assert (folder / "impacts.csv").read_bytes() == table


def slow_clamp(folder):
    time = times(1.0, 6.0)
    put(folder, AGAIN, time, noisy(450.0 * ramp(time, 0.0, 5.0)))


def test_a_slow_clamp_without_an_impact_counts(folder):
    slow_clamp(folder)
    collect(folder)
    assert "no impact found" in register(folder)[f"{AGAIN}.csv"]["reason"]
    transient = speed(folder)
    assert transient.outcome is fm.SpeedOutcome.UNCONFIRMED
    assert "a Phase II force of 4" in sentence(transient.reason)
    quasi_static = speed(folder, contact=fm.Contact.QUASI_STATIC)
    assert quasi_static.outcome is fm.SpeedOutcome.UNCONFIRMED
    assert "exceed the Phase I peaks" in sentence(quasi_static.reason)
    assert speed(folder, limit=200.0, contact=None).outcome is fm.SpeedOutcome.UNCONFIRMED


def test_an_unreadable_file_makes_phase_two_incomplete(folder):
    (folder / "recordings" / f"{AGAIN}.csv").write_text("time_s,force_N\n0.0,1.0\n0.1,broken\n")
    dataset = collect(folder)
    assert not dataset.phase_two.complete
    assert "Phase II not measured for 1 impacts" in sentence(speed(folder).reason)


def test_a_limit_in_newtons_meets_forces_after_phase_one(empty, ask):
    plan = fm.read_plan(empty)
    for seed, (name, v) in enumerate(zip(plan.recording.tolist(), plan.speed.tolist(), strict=True)):
        put(empty, name, *pulse(80.0 + 200.0 * v, held=250.0, rate=1000.0, seed=seed))
    collect(empty)
    code, found = ask("speed", empty, "--distance", 0.7, "--height", 0.3, "--limit-N", 200)
    assert (code, found["outcome"], found["speed_mps"]) == (1, "unconfirmed", None)
    assert "exceed the Phase I peaks" in found["reason"]


def test_an_expired_calibration_is_said_everywhere(folder, ask):
    text = (folder / "campaign.toml").read_text() + 'calibrated = "2024-01-31"\n'
    (folder / "campaign.toml").write_text(text.replace("[device]", 'date = "2025-06-01"\n[device]'))
    _, found = ask("check", folder, *HAND_OPTIONS)
    flags = [[flag["name"] for flag in impact["flags"]] for impact in found["impacts"]]
    assert len(flags) == 27
    assert all("calibration_expired" in each for each in flags)
    collect(folder)
    held = "CALIBRATION of the force measuring device held until 2025-01-31 (one year, as no last day is stated)"
    said = f"{held}: expired when it measured, on 2025-06-01"
    assert said in [fm.sentence(each) for each in speed(folder).basis.warnings]


@pytest.mark.parametrize(("duration", "first"), [(0.045, 0.020), (0.04, 0.018), (0.01, 0.004)])
def test_samples_missing_at_the_top(duration, first):
    """Four samples; a narrow peak of 200 N on a wide one of 120 N hides in them."""
    time = times(0.1, rate=1000.0)
    force = half_sine(time, 120.0, duration) + half_sine(time, 90.0, 0.0041, first)
    kept = (time < first - 1e-4) | (time > first + 0.0031)
    (impact,) = fm.find_impacts(recording(time[kept], noisy(force[kept])))
    assert "gap" in names(impact) or "unresolved" in names(impact)
    assert fm.check_impact(impact, 140.0).outcome is not WITHIN


@pytest.mark.parametrize("share", [0.0, 0.2, 0.7])
def test_a_direction_across_the_force(empty, share):
    time, force = pulse(300.0, seed=1)
    vector = np.random.default_rng(RNG_SEED).normal(0, 0.3, (time.size, 3))
    vector[:, 2] += force
    vector[:, 0] += share * force
    impacts = fm.find_impacts(recording(time, vector, direction=(1.0, 0.0, 0.0)))
    assert all("oblique" in names(impact) for impact in impacts)
    assert not_within(time, vector, HAND, direction=(1.0, 0.0, 0.0))


@pytest.mark.parametrize("cell", ["no", "No", "false", "0", "-", "none"])
def test_exclude_takes_a_reason_and_not_a_no(folder, cell):
    edit(folder / "recordings.csv", lambda number, row: row.update(exclude=cell if number == 0 else ""))
    with pytest.raises(TableError, match="expected a reason") as caught:
        fm.read_campaign(folder)
    assert (caught.value.column, caught.value.row) == ("exclude", 2)


def test_an_emptied_checksum_is_refused(folder):
    edit(folder / "recordings.csv", lambda number, row: row.update(sha256="" if number == 0 else row["sha256"]))
    with pytest.raises(TableError, match="delete the whole row") as caught:
        fm.read_campaign(folder)
    assert (caught.value.column, caught.value.row) == ("sha256", 2)


def test_a_simulated_recording_says_so_wherever_it_is_taken(tmp_path, ask):
    """A file of the virtual lab in a campaign of measured ones, or alone: what is made of it is simulated."""
    from forcemap.lab.simulated_device import recording_text

    folder = write_campaign(tmp_path / "campaign")
    assert not collect(folder).simulated
    file = sorted((folder / "recordings").glob("*.csv"))[0]
    time, force = np.loadtxt(file, delimiter=",", skiprows=1).T
    file.write_text(recording_text(time, force, "SIMULATED by the virtual impact lab of forcemap"))
    (alone := tmp_path / "run.csv").write_text(file.read_text())
    (folder / "recordings.csv").unlink()
    (folder / "impacts.csv").unlink()
    dataset = collect(folder)
    assert dataset.simulated
    assert fm.fit_force_map(dataset).simulated
    for source in (alone, file):
        assert ask("inspect", source, "--device-range-N", 500)[1]["simulated"]
    for source in (alone, folder):
        assert ask("check", source, "--limit-N", 280, "--device-range-N", 500)[1]["simulated"]
