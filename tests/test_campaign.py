"""A campaign folder from raw files to its impacts table: what is used, what is not and why, and what never changes."""

from __future__ import annotations

import csv
import math
import re
import sys

import numpy as np
import pytest

import forcemap as fm
from curves import curve
from forcemap.campaigns.walk import walk
from forcemap.errors import CampaignFileError
from forcemap.words import sentence
from pulses import TOML, collect, half_sine, pulse, register, rows, save, truth, write_campaign

RUN, OTHER = "d500-h200-v100-r1", "d500-h200-v200-r1"  # two runs of the plan
SEED = 202614


@pytest.fixture
def folder(tmp_path):
    """A campaign with a plan and no recordings."""
    return write_campaign(tmp_path / "campaign", recorded=False)


@pytest.fixture
def raw(folder):
    """Write a raw file of a run."""
    return lambda name, time, force: save(folder / "recordings" / f"{name}.csv", time, force)


def written(folder):
    return (folder / "impacts.csv").read_bytes(), (folder / "recordings.csv").read_bytes()


def raw_files(folder):
    files = sorted(path for path in (folder / "recordings").rglob("*") if path.is_file())
    return [(path.name, path.read_bytes(), path.stat().st_mtime_ns) for path in files]


def edit_register(folder, edits, *, delimiter=",", decimal="."):
    """Change cells of recordings.csv as a person does, by recording."""
    table = register(folder)
    for name, cells in edits.items():
        table[name].update(cells)
    with (folder / "recordings.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, next(iter(table.values())), delimiter=delimiter)
        writer.writeheader()
        for row in table.values():
            numbers = {
                key: cell.replace(".", decimal) for key, cell in row.items() if key.endswith(("_N", "_mps", "_s"))
            }
            writer.writerow(row | numbers)


def test_peaks_and_scenarios_agree_with_the_truth(folder):
    """The truth is that of the generator: the largest force within 0.5 s, of Phase I or after it."""
    plan = fm.read_plan(folder)
    drawn = (curve(SEED, number) for number in range(1000))
    usable = (each for each in drawn if each.phase1_samples >= 20 and each.time.size < 8000 and each.shape.peak < 420)
    curves = dict(zip(plan.recording.tolist(), usable, strict=False))
    for name, each in curves.items():
        save(folder / "recordings" / f"{name}.csv", each.time, each.force)
    collect(folder)
    table = rows(folder / "impacts.csv")
    assert len(table) == len(curves) == 27
    for row in table:
        each = curves[f"{row['state_id']}-r{row['repeat']}"]
        highest = each.shape.force(np.linspace(0, 0.5, 100_001)).max()
        assert float(row["peak_force_N"]) == pytest.approx(highest, rel=0.01, abs=1 + 4 * each.noise), each.shape.name
        assert row["scenario"] == each.shape.scenario
        assert ("later_peak" in row["flags"] or "double_hit" in row["flags"]) >= (highest > 1.02 * each.shape.peak)


def test_the_same_folder_gives_the_same_bytes_and_raw_files_stay(tmp_path):
    folder = write_campaign(tmp_path / "campaign")
    before = raw_files(folder)
    dataset = collect(folder)
    first = written(folder)
    assert len(dataset) == 27
    collect(folder)
    assert written(folder) == first
    assert raw_files(folder) == before
    (folder / "recordings.csv").unlink()
    collect(folder)
    assert written(folder) == first


def test_added_files_leave_earlier_rows_alone(tmp_path):
    whole = write_campaign(tmp_path / "whole")
    files = sorted((whole / "recordings").iterdir())
    folder = write_campaign(tmp_path / "campaign", recorded=False)
    for path in files[9:]:
        (folder / "recordings" / path.name).write_bytes(path.read_bytes())
    collect(folder)
    impacts, registered = written(folder)
    for path in files[:9]:  # names that sort before the others
        (folder / "recordings" / path.name).write_bytes(path.read_bytes())
    collect(folder)
    after = written(folder)
    assert after[0].startswith(impacts)
    assert after[1].startswith(registered)
    assert len(rows(folder / "impacts.csv")) == 27


def test_a_raw_file_that_changed_or_vanished_is_named(folder, raw):
    raw(RUN, *pulse(150.0))
    raw(OTHER, *pulse(160.0))
    collect(folder)
    kept = written(folder)
    path = folder / "recordings" / f"{RUN}.csv"
    content = path.read_bytes()
    path.write_bytes(content[:-3] + b"1" + content[-2:])
    with pytest.raises(
        CampaignFileError, match=r"changed since it was registered.*restore it; .* takes another repeat"
    ) as e:
        collect(folder)
    assert e.value.file == str(path)
    path.unlink()
    with pytest.raises(CampaignFileError, match="the file is gone; put it back, or delete its row") as e:
        collect(folder)
    assert e.value.file == str(path)
    assert written(folder) == kept
    path.write_bytes(content)
    collect(folder)
    assert written(folder) == kept
    path.unlink()
    for name in ("recordings.csv", "impacts.csv"):  # as the refusal says
        lines = (folder / name).read_text().splitlines(keepends=True)
        (folder / name).write_text("".join(line for line in lines if RUN not in line))
    collect(folder)
    assert [row["recording"] for row in rows(folder / "impacts.csv")] == [f"{OTHER}.csv"]


def test_a_table_of_before_says_that_the_last_collect_could_use_nothing(folder, raw):
    """Not that somebody changed it."""
    raw(RUN, *pulse(150.0))
    raw(OTHER, *pulse(160.0))
    collect(folder)
    text = (folder / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(
        text + '\n[recordings]\ntime = "time_s"\nforce = "force_N"\ntime_unit = "ms"\n'
    )
    with pytest.raises(CampaignFileError, match="none of 2 recordings gave an impact"):
        collect(folder)
    said = fm.sentence(fm.read_dataset(folder).binding.refusal)
    assert said.startswith("impacts.csv is from before: none of 2 recordings gave an impact that can be used")
    (folder / "campaign.toml").write_text(text)
    collect(folder)
    assert fm.read_dataset(folder).binding.refusal is None


def test_half_a_file_that_goes_on_is_read_again(tmp_path):
    """Cut at any byte: before, within and after the impact, in the middle of a line; several times, too."""
    whole = write_campaign(tmp_path / "whole")
    collect(whole)
    folder = write_campaign(tmp_path / "campaign")
    path = folder / "recordings" / f"{RUN}.csv"
    content, rng = path.read_bytes(), np.random.default_rng(SEED)
    used = set()
    for cut in [0, 5, len(content) - 1, *rng.integers(len(content) // 5, len(content) // 2, 8)]:
        was, before = "", b""
        for part in (content[:cut], content[: (cut + len(content)) // 2], content):
            path.write_bytes(part)
            if was == "used" and part != before:
                (doubt,) = [each.doubt for each in walk(fm.read_campaign(folder)) if each.entry.file == path.name]
                assert doubt.kind == "file_grown"
            collect(folder)
            was, before = register(folder)[path.name]["use"], part
            used.add(was)
        assert written(folder) == written(whole)
        (folder / "recordings.csv").unlink()
    assert used == {"used", "discarded", "unreadable"}


def test_what_gave_nothing_may_be_replaced_and_nothing_else(folder, raw):
    """A corrected export of a file that was unreadable, or held no impact, is simply read again."""
    time, force = pulse(150.0)
    raw(OTHER, *pulse(160.0))
    path = folder / "recordings" / f"{RUN}.csv"
    for gave_nothing in (b"time_s,force_N\n0,1\n1,x\n", b"", b"PK\x03\x04", "flat"):
        raw(RUN, time, 0 * force)
        if gave_nothing != "flat":
            path.write_bytes(gave_nothing)
        collect(folder)
        assert register(folder)[path.name]["use"] in ("unreadable", "discarded")
        before = path.read_bytes()
        raw(RUN, time, force)
        assert len(collect(folder)) == 2
        assert (register(folder)[path.name]["use"], register(folder)[path.name]["reason"]) == ("used", "")
        path.write_bytes(before)
        with pytest.raises(CampaignFileError, match="changed since it was registered"):
            collect(folder)
        (folder / "recordings.csv").unlink()
    collect(folder)
    edit_register(folder, {path.name: {"exclude": "cut off"}})
    collect(folder)
    raw(RUN, *pulse(400.0))
    with pytest.raises(CampaignFileError, match="changed since it was registered"):
        collect(folder)


def test_a_package_that_is_missing_takes_no_row_out(tmp_path, ask, monkeypatch):
    pytest.importorskip("nptdms")
    folder = write_campaign(tmp_path / "campaign")
    collect(folder)
    before = written(folder)
    path = folder / "recordings" / f"{RUN}.csv"
    path.rename(path.with_suffix(".tdms"))
    monkeypatch.setitem(sys.modules, "nptdms", None)
    code, found = ask("collect", folder)
    assert (code, found["error"]["kind"]) == (2, "missing_extra")
    assert "pip install '.[tdms]'" in found["error"]["message"]
    assert written(folder) == before


def test_every_discard_has_its_reason_and_no_row(folder, raw):
    names = fm.read_plan(folder).recording.tolist()
    time, force = pulse(150.0, before=0.2, after=2.5)
    built = {
        "flat": ((time, 0 * force), "discarded", "no impact found"),
        "two impacts": ((time, force + half_sine(time, 120.0, 0.03, 1.5)), "discarded", "2 impacts, at"),
        "unresolved": (pulse(150.0, rate=200.0), "discarded", "unresolved"),
        "no baseline": (pulse(150.0, before=0.001), "discarded", "no_baseline"),
    }
    expected = {}
    for name, (curve_of, use, reason) in zip(names, built.values(), strict=False):
        raw(name, *curve_of)
        expected[f"{name}.csv"] = (use, reason)
    raw("some-other-name", *pulse(150.0))
    expected["some-other-name.csv"] = ("unassigned", "no run of the plan has this name")
    raw(names[10], *pulse(150.0, seed=2))
    raw(f"again/{names[10]}", *pulse(150.0, duration=0.02, seed=3))
    expected[f"{names[10]}.csv"] = ("discarded", f"again/{names[10]}.csv is that run already")
    (folder / "recordings" / f"{names[11]}.csv").write_text("time_s,force_N\n0.0,1.0\n0.1,broken\n")
    expected[f"{names[11]}.csv"] = ("unreadable", "row 3")
    collect(folder)
    found = register(folder)
    for name, (use, reason) in expected.items():
        assert found[name]["use"] == use, name
        assert reason in found[name]["reason"]
    assert [row["recording"] for row in rows(folder / "impacts.csv")] == [f"again/{names[10]}.csv"]
    assert {name for name, row in found.items() if not row["reason"]} == {f"again/{names[10]}.csv"}


def test_nothing_usable_is_an_error_that_gives_a_reason(folder, raw):
    raw(RUN, *pulse(0.0))
    with pytest.raises(CampaignFileError, match=r"none of 1 recordings.*no impact found"):
        collect(folder)
    assert register(folder)[f"{RUN}.csv"]["use"] == "discarded"


def test_a_saturated_impact_is_censored_with_a_lower_bound(tmp_path):
    folder = write_campaign(tmp_path / "campaign", recorded=False, toml=TOML.replace("500.0", "200.0"))
    time, force = pulse(260.0, seed=1)
    save(folder / "recordings" / f"{RUN}.csv", time, np.minimum(force, 200.0))
    dataset = collect(folder)
    (row,) = rows(folder / "impacts.csv")
    assert row["censored"] == "true"
    assert 199.0 < float(row["peak_force_N"]) <= 201.0
    assert dataset.censored.tolist() == [True]


@pytest.mark.parametrize(("delimiter", "decimal"), [(",", "."), (";", "."), (";", ",")])
def test_what_a_person_edits_survives_and_acts(folder, raw, delimiter, decimal):
    raw(RUN, *pulse(150.0))
    raw(OTHER, *pulse(160.0))
    raw("run seven", *pulse(170.0))
    collect(folder)
    edits = {
        f"{RUN}.csv": {"exclude": "gripper was open, see notes"},
        f"{OTHER}.csv": {"speed_mps": "0.2035", "repeat": "3"},
        "run seven.csv": {"state_id": "d900-h400-v300", "repeat": "2"},
    }
    for _ in range(2):
        edit_register(folder, edits, delimiter=delimiter, decimal=decimal)
        collect(folder)
        found = register(folder)
        for name, cells in edits.items():
            assert found[name].items() >= cells.items()
        assert found[f"{RUN}.csv"]["use"] == "excluded"
        assert found[f"{RUN}.csv"]["reason"] == "gripper was open, see notes"
        table = {row["recording"]: row for row in rows(folder / "impacts.csv")}
        assert table.keys() == {f"{OTHER}.csv", "run seven.csv"}
        assert (table[f"{OTHER}.csv"]["speed_mps"], table[f"{OTHER}.csv"]["repeat"]) == ("0.2035", "3")
        assert table["run seven.csv"]["state_id"] == "d900-h400-v300"
        assert float(table["run seven.csv"]["distance_m"]) == 0.9


def test_a_long_file_and_a_wide_file_hold_several_runs(tmp_path):
    time, one = pulse(150.0)
    two = 1.1 * one
    content = {
        'time = "t_ms"\ntime_unit = "ms"\nforce = "F_N"\ncurve = "run"\n': "run;t_ms;F_N\n"
        + "".join(
            f"{name};{1000 * t:.3f};{f:.4f}\n"
            for name, force in ((RUN, one), (OTHER, two))
            for t, f in zip(time, force, strict=True)
        ),
        'time = "t_s"\nruns = "all"\n': f"t_s;{RUN};{OTHER}\n"
        + "".join(f"{t:.6f};{a:.4f};{b:.4f}\n" for t, a, b in zip(time, one, two, strict=True)),
    }
    for number, (columns, text) in enumerate(content.items()):
        toml = f"{TOML}[recordings]\n{columns}"
        folder = write_campaign(tmp_path / f"campaign{number}", recorded=False, toml=toml)
        (folder / "recordings" / "all.csv").write_text(text)
        collect(folder)
        table = {row["recording"]: float(row["peak_force_N"]) for row in rows(folder / "impacts.csv")}
        assert table == pytest.approx({f"all.csv#{RUN}": 150.0, f"all.csv#{OTHER}": 165.0}, abs=0.2)
        first = written(folder)
        edit_register(folder, {f"all.csv#{OTHER}": {"exclude": "touched by hand"}})
        collect(folder)
        assert [row["recording"] for row in rows(folder / "impacts.csv")] == [f"all.csv#{RUN}"]
        edit_register(folder, {f"all.csv#{OTHER}": {"exclude": ""}})
        collect(folder)
        assert written(folder) == first


def test_a_tdms_file(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    toml = f'{TOML}[recordings]\nforce = "PFMD/force"\n'
    toml += "sampling_rate_Hz = 2000.0\n"
    folder = write_campaign(tmp_path / "campaign", recorded=False, toml=toml)
    _, force = pulse(150.0)
    properties = {"wf_increment": 0.0005, "unit_string": "N"}
    with nptdms.TdmsWriter(str(folder / "recordings" / f"{RUN}.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject("PFMD", "force", force, properties=properties)])
    collect(folder)
    (row,) = rows(folder / "impacts.csv")
    assert float(row["peak_force_N"]) == pytest.approx(150.0, abs=0.5)
    assert row["recording"] == f"{RUN}.tdms"


def test_a_campaign_without_a_device_range_is_refused(tmp_path):
    folder = write_campaign(tmp_path / "campaign", toml='schema = "forcemap-campaign/1"\n')
    with pytest.raises(CampaignFileError, match="state it in N") as e:
        collect(folder)
    assert e.value.column == "device.range_N"
    assert e.value.file == str(folder / "campaign.toml")


@pytest.mark.parametrize(
    ("columns", "entry"),
    [
        ('tiem = "t"\nforce = "F"', "tiem"),
        ('time = 0\nforce = "F"', "time"),
        ('time = "t"\ntime_unit = "min"\nforce = "F"', "time_unit"),
        ('time = "t"\nforce = [1, 2]', "force"),
        ('time = "t"', "force"),
        ('time = "t"\nforce = "F"\nforce_unit = "counts"', "newtons_per_count"),
        ('time = "t"\nforce = "F"\nsign = 0', "sign"),
        ('time = "t"\nforce = "F"\nsampling_rate_Hz = 1000.0', "sampling_rate_Hz"),
        ('time = "t"\nforce = "F"\ndirection = [0.0, 0.0, -1.0]', "direction"),
        ('time = "t"\nforce = "F"\ndecimal = ","\ndelimiter = "comma"', "decimal"),
    ],
)
def test_mistakes_in_the_column_map_are_named(tmp_path, columns, entry):
    folder = write_campaign(tmp_path / "campaign", recorded=False, toml=f"{TOML}[recordings]\n{columns}\n")
    with pytest.raises(CampaignFileError) as e:
        fm.read_campaign(folder)
    assert e.value.column == f"recordings.{entry}"
    assert e.value.file == str(folder / "campaign.toml")


@pytest.mark.parametrize("words", ["dwon", "towards the wall", "0,0,0", "1,0", "down and up"])
def test_a_direction_that_is_none_is_refused_where_it_is_read(tmp_path, words):
    toml = f'{TOML}[contact]\ndirection = "{words}"\n'
    folder = write_campaign(tmp_path / "campaign", recorded=False, toml=toml)
    with pytest.raises(CampaignFileError, match="expected one of down, up, out, in, left, right") as e:
        fm.read_campaign(folder)
    assert (e.value.column, e.value.file) == ("contact.direction", str(folder / "campaign.toml"))


def test_a_recording_may_be_registered_anew_as_its_refusal_says(tmp_path):
    folder = write_campaign(tmp_path / "campaign")
    before = collect(folder)
    name = str(before.recording[3])
    file = folder / "recordings" / name
    save(file, *pulse(99.0, rate=1000.0, seed=7))
    with pytest.raises(CampaignFileError, match=r"delete its row in recordings\.csv first"):
        collect(folder)
    other = folder / "recordings" / str(before.recording[5])
    content = other.read_bytes()
    other.write_bytes((folder / "recordings" / str(before.recording[6])).read_bytes())
    with pytest.raises(CampaignFileError, match=f"the same holds for {re.escape(other.name)}"):
        collect(folder)
    mine = file.read_bytes()
    file.write_bytes(content)
    with pytest.raises(CampaignFileError, match=f"it holds what was registered as {re.escape(other.name)}"):
        collect(folder)
    file.write_bytes(mine)
    other.write_bytes(content)
    register_file = folder / "recordings.csv"
    lines = register_file.read_text().splitlines(keepends=True)
    register_file.write_text("".join(line for line in lines if name not in line))
    after = collect(folder)
    then, now = (dict(zip(each.recording.tolist(), each.peak_force.tolist(), strict=True)) for each in (before, after))
    assert {each for each in then if now[each] != then[each]} == {name}
    assert (now.keys(), now[name]) == (then.keys(), pytest.approx(99.0, abs=2.0))


def speed_at(folder):
    fitted = fm.fit_force_map(collect(folder))
    limits = {"limit": fm.force_limit("back_of_hand"), "contact": fm.Contact.TRANSIENT}
    return fm.safe_speed(fitted, 0.7, 0.3, **limits, bound=fm.FixedMargin(0.1))


CLAMPING = {
    "unresolved": pulse(150.0, rate=200.0, held=60.0),
    "no baseline": pulse(150.0, before=0.001, held=60.0),
    "second of two impacts": (
        pulse(150.0, after=3.0)[0],
        pulse(150.0, after=3.0)[1] + 60.0 * np.clip((pulse(150.0, after=3.0)[0] - 1.5) / 0.01, 0, 1),
    ),
    "of no run": pulse(150.0, held=60.0),
}


@pytest.mark.parametrize("doubt", CLAMPING)
def test_a_discarded_recording_that_clamps_bars_the_transient_limit(tmp_path, doubt):
    folder = write_campaign(tmp_path / "campaign")
    assert speed_at(folder).outcome in (fm.SpeedOutcome.ADMISSIBLE, fm.SpeedOutcome.CAPPED)
    name = "another" if doubt == "of no run" else RUN.replace("-r1", "-r2")
    save(folder / "recordings" / f"{name}.csv", *CLAMPING[doubt])
    found = speed_at(folder)
    assert register(folder)[f"{name}.csv"]["use"] in ("discarded", "unassigned")
    assert found.outcome is fm.SpeedOutcome.UNCONFIRMED
    assert math.isnan(found.speed)
    assert "clamp" in sentence(found.reason)
    edit_register(folder, {f"{name}.csv": {"exclude": "pressed by hand to try the device"}})
    assert speed_at(folder).outcome in (fm.SpeedOutcome.ADMISSIBLE, fm.SpeedOutcome.CAPPED)


def test_a_recording_that_cannot_be_low_passed_still_tells_that_it_clamps(tmp_path):
    folder = write_campaign(tmp_path / "campaign", toml=f"{TOML}channel_frequency_class = 180\n")
    name = RUN.replace("-r1", "-r2")
    save(folder / "recordings" / f"{name}.csv", *pulse(150.0, rate=700.0, held=60.0))
    assert speed_at(folder).outcome is fm.SpeedOutcome.UNCONFIRMED
    assert "channel frequency class" in register(folder)[f"{name}.csv"]["reason"]


@pytest.mark.parametrize(("start", "flag"), [(0.045, "later_peak"), (0.2, "double_hit")])
def test_a_later_hump_that_is_higher_takes_the_peaks_place(folder, raw, start, flag):
    time, force = pulse(150.0, duration=0.05)
    raw(RUN, time, np.maximum(force, half_sine(time, 190.0, 0.05, start)))
    collect(folder)
    (row,) = rows(folder / "impacts.csv")
    assert float(row["peak_force_N"]) == pytest.approx(190.0, abs=0.5)
    assert flag in row["flags"]


def test_the_summary_says_what_is_missing_and_what_each_state_allows(tmp_path):
    folder = write_campaign(tmp_path / "campaign", repeats=2)
    (folder / "recordings" / f"{OTHER}.csv").unlink()
    save(folder / "recordings" / f"{RUN}.csv", *pulse(truth(0.5, 0.2, 0.1), held=50.0))
    dataset = collect(folder)
    summary = fm.campaign_summary(fm.read_campaign(folder), dataset)
    assert summary.missing == (OTHER,)
    barred = [each for each in summary.contacts if not each.transient_allowed]
    assert [each.state for each in barred] == [RUN.removesuffix("-r1")]
    assert "1 of 2 impacts" in sentence(barred[0].reason)
    assert "device.calibrated" in summary.not_stated
