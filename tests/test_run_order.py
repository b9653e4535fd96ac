"""Recordings under the names that a device gave: assigned to the runs of the sheet in order, after they were shown."""

from __future__ import annotations

import os

import pytest

import forcemap as fm
from forcemap.campaigns.run_order import RecordingOrder, assign_runs, propose_runs
from pulses import collect, pulse, register, rows, save, truth, write_campaign

NOON = 1_780_000_000


@pytest.fixture
def measured(tmp_path):
    """A campaign of 27 runs whose recordings the device numbered in the order in which they were made."""
    folder = write_campaign(tmp_path / "campaign", recorded=False)
    plan = fm.read_plan(folder)
    for i in range(len(plan)):
        peak = truth(plan.distance[i], plan.height[i], plan.speed[i])
        path = folder / "recordings" / f"Messung {i + 1}.csv"
        save(path, *pulse(peak, rate=1000.0, seed=i))
        os.utime(path, (NOON + 60 * i,) * 2)
    return folder


def test_in_the_order_of_the_sheet(measured):
    """ "Messung 2" comes before "Messung 10"; names stay, and every force is that of its run."""
    before = {path.name: path.read_bytes() for path in (measured / "recordings").iterdir()}
    campaign = fm.read_campaign(measured)
    proposed = propose_runs(campaign)
    assert [each.name for each in proposed] == [f"Messung {i + 1}.csv" for i in range(27)]
    assert [each.run for each in proposed] == campaign.plan.recording.tolist()
    assert not any(each.out_of_order for each in proposed)
    assert not (measured / "recordings.csv").exists()
    dataset = assign_runs(campaign, proposed)
    assert len(dataset) == 27
    expected = truth(dataset.distance, dataset.height, dataset.speed)
    assert dataset.peak_force == pytest.approx(expected, abs=1.5)
    assert {path.name: path.read_bytes() for path in (measured / "recordings").iterdir()} == before
    assert fm.read_campaign(measured).missing == []
    table = (measured / "impacts.csv").read_bytes()
    collect(measured)  # the register holds what was assigned
    assert (measured / "impacts.csv").read_bytes() == table
    assert propose_runs(fm.read_campaign(measured)) == ()


def test_a_folder_that_was_collected_first_is_assigned_all_the_same(measured):
    """The folder is as it was left, but for what is to be registered now."""
    plan, count = fm.read_plan(measured), 21
    for i in range(count):
        (measured / "recordings" / f"Messung {i + 1}.csv").rename(measured / "recordings" / f"{plan.recording[i]}.csv")
    for _ in range(2):
        collect(measured)
    assert [row["use"] for row in register(measured).values()].count("unassigned") == len(plan) - count
    campaign = fm.read_campaign(measured)
    assert len(assign_runs(campaign, propose_runs(campaign))) == len(plan)
    assert fm.read_campaign(measured).missing == []


def test_runs_that_have_a_recording_are_passed_over(measured):
    plan = fm.read_plan(measured)
    for at in (0, 5):
        run = plan.recording[at]
        (measured / "recordings" / f"Messung {at + 1}.csv").rename(measured / "recordings" / f"{run}.csv")
    proposed = propose_runs(fm.read_campaign(measured))
    assert [(each.name, each.run) for each in proposed] == [
        (f"Messung {i + 1}.csv", plan.recording[i]) for i in range(27) if i not in (0, 5)
    ]


def test_by_time_where_the_counter_of_the_device_began_again(measured):
    folder = measured / "recordings"
    for i in range(20, 27):
        (folder / f"Messung {i + 1}.csv").rename(folder / f"Lauf {i - 19}.csv")
    campaign = fm.read_campaign(measured)
    by_time = propose_runs(campaign, by=RecordingOrder.TIME)
    assert [each.run for each in by_time if each.name.startswith("Lauf")] == campaign.plan.recording[20:].tolist()
    assert all(each.out_of_order for each in by_time)
    assert propose_runs(campaign)[0].name == "Lauf 1.csv"


def test_what_cannot_be_told_is_refused(measured):
    recordings = measured / "recordings"
    flat = recordings / "Messung 7b.csv"
    save(flat, *pulse(0.0, rate=1000.0, seed=1))
    with pytest.raises(fm.InputError, match=r"'Messung 7b.csv' without exactly one impact"):
        propose_runs(fm.read_campaign(measured))
    flat.write_text("broken")
    with pytest.raises(
        fm.InputError, match=r"Messung 7b.csv, found one column, .*state the layout in campaign.toml.*exclude"
    ):
        propose_runs(fm.read_campaign(measured))
    (measured / "recordings.csv").write_text("file,exclude\nMessung 7b.csv,the guard was open\n")
    assert len(propose_runs(fm.read_campaign(measured))) == 27
    save(recordings / "Messung 28.csv", *pulse(100.0, rate=1000.0))
    with pytest.raises(fm.InputError, match="found 28 recordings that say no run, and 27 runs"):
        propose_runs(fm.read_campaign(measured))


def test_fewer_recordings_than_runs_need_the_last_one(measured):
    """A run that was not saved would shift all after it: only the right number up to the last is taken."""
    plan, recordings = fm.read_plan(measured), measured / "recordings"
    for i in range(20, 27):
        (recordings / f"Messung {i + 1}.csv").unlink()
    with pytest.raises(fm.InputError, match=r"20 recordings that say no run, and 27 runs without one;.*--last"):
        propose_runs(fm.read_campaign(measured))
    last = str(plan.recording[19])
    proposed = propose_runs(fm.read_campaign(measured), last=last)
    assert [each.run for each in proposed] == plan.recording[:20].tolist()
    (recordings / "Messung 3.csv").unlink()
    with pytest.raises(fm.InputError, match=rf"19 recordings .* 20 runs without one up to '{last}'"):
        propose_runs(fm.read_campaign(measured), last=last)
    with pytest.raises(fm.InputError, match="no run 'd1'"):
        propose_runs(fm.read_campaign(measured), last="d1")


def test_nothing_is_written_if_the_register_changed_meanwhile(measured):
    campaign = fm.read_campaign(measured)
    proposed = propose_runs(campaign)
    (measured / "recordings.csv").write_text("file,exclude\nMessung 1.csv,slipped\n")
    with pytest.raises(fm.InputError, match="changed meanwhile"):
        assign_runs(campaign, proposed)
    assert not (measured / "impacts.csv").exists()


class TestCommand:
    def test_shows_first_and_writes_after_a_yes(self, measured, forcemap, ask):
        code, out, _ = forcemap("collect", measured, "--assign", "name")
        assert code == 0
        assert "Messung 10.csv" in out
        assert "Nothing was written" in out
        assert not (measured / "recordings.csv").exists()
        code, shown = ask("collect", measured, "--assign", "name")
        assert (code, len(shown["proposed"])) == (0, 27)
        assert shown["proposed"][0] | {"peak_force_N": 0, "written": ""} == {
            "recording": "Messung 1.csv", "run": "d900-h200-v100-r1", "written": "", "distance_m": 0.9,
            "height_m": 0.2, "speed_mps": 0.1, "expected_force_N": None, "peak_force_N": 0, "out_of_order": False,
        }  # fmt: skip
        assert not (measured / "recordings.csv").exists()
        code, found = ask("collect", measured, "--assign", "name", "--yes")
        assert (code, found["used"], found["missing"]) == (0, 27, [])
        code, out, _ = forcemap("collect", measured, "--assign", "name")
        assert code == 0
        assert "nothing to assign" in out

    def test_another_order_is_said(self, measured, forcemap):
        os.utime(measured / "recordings" / "Messung 3.csv", (NOON - 60,) * 2)
        _, out, _ = forcemap("collect", measured, "--assign", "name")
        assert "3 would be another run by the times of the files" in " ".join(out.split())

    def test_collect_names_the_way(self, measured, forcemap):
        code, _, err = forcemap("collect", measured)
        assert code == 2
        assert "--assign" in err
        run = fm.read_plan(measured).recording[0]
        (measured / "recordings" / "Messung 1.csv").rename(measured / "recordings" / f"{run}.csv")
        code, out, _ = forcemap("collect", measured)
        assert code == 0
        assert "26 say no run: forcemap collect" in out

    def test_collect_names_another_way_where_the_order_does_not_tell(self, measured, forcemap):
        run = fm.read_plan(measured).recording[0]
        (measured / "recordings" / "Messung 1.csv").rename(measured / "recordings" / f"{run}.csv")
        (measured / "recordings" / "Messung 2.csv").unlink()
        out = " ".join(forcemap("collect", measured)[1].split())
        assert "25 say no run, and 26 runs have no recording: name files as the run sheet does" in out
        assert "if the last runs alone are missing, --assign name --last RUN" in out


class TestRegister:
    """What a spreadsheet shows and a person edits: no cell of a recording's name runs as a formula."""

    NAMES = ("=HYPERLINK(1).csv", "+1+cmd.csv", "@SUM(1).csv", "-2+3.csv", "'quoted.csv", "'=twice.csv")

    def test_formulas_stay_text_and_come_back(self, tmp_path):
        folder = write_campaign(tmp_path / "campaign", recorded=False)
        plan = fm.read_plan(folder)
        for i, name in enumerate(self.NAMES):
            save(folder / "recordings" / name, *pulse(100 + i, rate=1000.0, seed=i))
        for i in range(len(self.NAMES), 27):
            save(folder / "recordings" / f"{plan.recording[i]}.csv", *pulse(100 + i, rate=1000.0, seed=i))
        campaign = fm.read_campaign(folder)
        assign_runs(campaign, propose_runs(campaign))
        for file in ("recordings.csv", "impacts.csv"):
            for row in rows(folder / file):
                for cell in row.values():
                    assert not cell.startswith(("=", "+", "@", "\t")), cell
                    assert not cell.startswith("-") or float(cell) < 0
        assert {entry.file for entry in fm.read_campaign(folder).entries} >= set(self.NAMES)
        before = (folder / "recordings.csv").read_bytes()
        assert len(collect(folder)) == 27
        assert (folder / "recordings.csv").read_bytes() == before
        assert set(register(folder)) >= {"'=HYPERLINK(1).csv", "''=twice.csv", "'quoted.csv"}
