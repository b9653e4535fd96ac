"""plan, collect, inspect and check as a program sees them."""

from __future__ import annotations

import csv
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

import forcemap as fm
from forcemap.campaigns.memory import MEMORY_FILE
from forcemap.campaigns.protocol import Protocol, read_protocol
from pulses import TOML, collect, pulse, register, save, write_campaign
from real_data import needs_real_data

PLAN = ("--distances-m", "0.5,0.9", "--heights-m", "0.2,0.4", "--speeds-mps", "0.1,0.3")
RUN, OTHER = "d500-h200-v100-r1", "d500-h200-v200-r1"
COMMANDS = ("plan", "collect", "inspect", "check")
HAND = ("--area", "back_of_hand")
STATED = TOML.replace("[device]", '[contact]\ndirection = "down"\n[device]')
DEVICE = ("--device-range-N", 500, "--device-spring-N-per-mm", 75)


@pytest.fixture
def curve_file(tmp_path):
    """Write a curve as a file of its own."""

    def write(name="run.csv", **options):
        save(tmp_path / name, *pulse(**options))
        return tmp_path / name

    return write


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_one_example(forcemap, name):
    code, out, _ = forcemap(name, "--help")
    assert code == 0
    assert out.count("Example: forcemap " + name) == 1


class TestPlan:
    def test_writes_a_campaign_that_is_read_and_is_not_overwritten(self, ask, forcemap, tmp_path):
        folder = tmp_path / "campaign"
        code, found = ask("plan", folder, *PLAN, "--device-range-N", 500, "--moving-mass-kg", 30, *HAND,
                          "--contact", "transient")  # fmt: skip
        assert code == 0
        assert found["files"] == ["campaign.toml", "plan.csv", "run_sheet.txt"]
        assert {path.name for path in folder.iterdir()} == {*found["files"], "recordings"}
        assert (found["states"], len(found["runs"])) == (27, 90)
        campaign = fm.read_campaign(folder)
        assert campaign.conditions.device.range == 500
        assert campaign.conditions.moving_mass == 30
        assert [run["recording"] for run in found["runs"]] == campaign.plan.recording.tolist() == campaign.missing
        sheet = (folder / "run_sheet.txt").read_text()
        assert all(name in sheet for name in campaign.plan.recording[:3])
        before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
        code, _, err = forcemap("plan", folder, *PLAN)
        assert (code, err.count("\n")) == (2, 1)
        assert "has a plan already" in err
        assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before

    def test_a_campaign_file_that_is_there_stays_but_for_the_table_of_the_plan(self, ask, tmp_path):
        (tmp_path / "campaign.toml").write_text(TOML)
        code, found = ask("plan", tmp_path, *PLAN)
        assert (code, found["files"]) == (0, ["plan.csv", "run_sheet.txt", "campaign.toml"])
        of_plan = "[plan]\nfastest_mps = 0.3\n"
        assert (tmp_path / "campaign.toml").read_text() == f"{TOML.rstrip()}\n\n{of_plan}"

    def test_every_entry_that_the_template_names_is_read(self, ask, tmp_path):
        """Each commented entry by itself, with the value its comment proposes or a plausible one."""
        ask("plan", tmp_path, *PLAN)
        path = tmp_path / "campaign.toml"
        template = path.read_text().splitlines()
        plausible = {
            "date": '"2026-05-30"',
            "calibrated": '"2026-01-31"',
            "calibration_expires": '"2027-01-31"',
            "speed": '"measured"',
            "speed_error": "0.03",
            "form": '"LOG_SPEED"',
            "slowest_mps": "0.2",
            "stiffness_N_per_m": "75000.0",
            "channel_frequency_class": "180",
        }
        tried = 0
        for number, line in enumerate(template):
            entry = re.match(r"# (\w+) =(.*)", line)
            if not entry:
                continue
            name, proposed = entry[1], entry[2].partition("#")[0].strip()
            assert proposed
            blank = proposed in ('""', "0.0")
            value = (
                plausible.get(name)
                or (not blank and proposed)
                or ("2.5" if re.search("_(kg|deg|m|N|N_per_m)$", name) else '"down"')
            )
            lines = [*template[:number], f"{name} = {value}", *template[number + 1 :]]
            if name in ("time_unit", "sign"):
                lines += ["time = 1", "force = 2"]
            if name == "direction":
                lines += ["time = 1", "force = [2, 3, 4]"]
            if name in ("time", "force", "force_unit"):
                lines += [{"time": "force = 2", "force": "time = 1", "force_unit": "time = 1\nforce = 2"}[name]]
            path.write_text("\n".join(lines) + "\n")
            campaign = fm.read_campaign(tmp_path)
            if campaign.columns is None:
                stated = campaign.conditions != fm.Conditions() or read_protocol(path) != Protocol()
                assert stated, line
            tried += 1
        assert tried >= 28


class TestCollect:
    def test_json(self, ask, tmp_path):
        folder = write_campaign(tmp_path / "campaign", repeats=2)
        save(folder / "recordings" / "loose.csv", *pulse(150.0))
        (folder / "recordings" / f"{RUN}.csv").unlink()
        code, found = ask("collect", folder)
        assert code == 0
        assert set(found) >= {
            "folder", "recordings", "used", "states", "censored", "discards", "missing", "flags", "scenarios",
            "largest_phase2_force_N", "contacts", "repeatability", "not_stated", "files", "simulated",
        }  # fmt: skip
        assert (found["recordings"], found["used"], found["states"]) == (54, 53, 27)
        assert found["missing"] == [RUN]
        (discard,) = found["discards"]
        assert (discard["recording"], discard["use"]) == ("loose.csv", "unassigned")
        assert found["scenarios"] == {"unconstrained": 54}  # the discarded one counts
        assert len(found["contacts"]) == 27
        assert found["repeatability"]["max_sd_N"] < 2.0
        assert found["files"] == ["recordings.csv", "impacts.csv"]

    def test_text(self, forcemap, tmp_path):
        code, out, err = forcemap("collect", write_campaign(tmp_path / "campaign"))
        assert (code, err) == (0, "")
        assert "27 recordings: 27 used, in 27 states" in out
        assert "Every planned run is there" in out
        assert "Transient limit: may be used" in out

    @pytest.mark.parametrize("missing", [54, 1, 0])
    def test_speeds_that_are_said_to_be_measured_and_were_not_entered_count_as_commanded(
        self, forcemap, tmp_path, missing
    ):
        """The planned ones are used for them, so nothing tells how far off these are."""
        toml = STATED.replace("[contact]\n", '[contact]\nspeed = "measured"\n')
        assert "measured" in toml
        folder = write_campaign(tmp_path / "campaign", toml=toml, repeats=2)
        out = " ".join(forcemap("collect", folder)[1].split())
        if missing < 54:
            register = folder / "recordings.csv"
            rows = list(csv.DictReader(register.read_text().splitlines()))
            for row in rows[missing:]:
                row["speed_mps"] = f"{float(row['state_id'].split('-v')[1]) / 1000:.3f}"
            with register.open("w", newline="") as file:
                writer = csv.DictWriter(file, rows[0])
                writer.writeheader()
                writer.writerows(rows)
            out = " ".join(forcemap("collect", folder)[1].split())
        first = (
            f"SPEEDS NOT ENTERED: contact.speed says measured, and {missing} of 54 recordings have no measured speed"
        )
        assert (first in out) == ("NOT ENTERED" in out) == (missing > 0)
        case = ("--distance", 0.7, "--height", 0.3, "--limit-N", 200, "--contact", "quasi-static")
        other = shutil.copy(folder / "impacts.csv", folder / "renamed.csv")
        for table in (folder, other):
            said = " ".join(forcemap("speed", table, *case)[1].split())
            assert ("! SPEED COMMANDED, error not stated" in said) is (missing > 0)
        first = [finding.kind for finding in fm.assess_campaign(folder).findings]
        assert ("speed_error_not_stated" in first) is (missing > 0)

    def test_what_bars_every_speed_comes_before_the_next_step(self, forcemap, tmp_path):
        folder = write_campaign(tmp_path / "campaign", toml=STATED)
        last = f"Next: forcemap fit {folder} tells how good its map is, next what to measure; then confirm, report "
        last += "and export"
        assert " ".join(forcemap("collect", folder)[1].split()).endswith(last)
        toml = (folder / "campaign.toml").read_text()
        (folder / "campaign.toml").write_text(toml.replace('"down"', '"outward"'))
        _, out, _ = forcemap("collect", folder)
        assert "contact.direction" in out
        assert out.splitlines()[-1] == "Next: mend what is said first, and collect again"

    @pytest.mark.parametrize("missing", ["recordings", "campaign.toml", "plan.csv", "folder"])
    def test_what_is_missing_is_one_clear_line(self, forcemap, tmp_path, missing):
        folder = write_campaign(tmp_path / "campaign", recorded=False)
        if missing == "folder":
            folder = tmp_path / "elsewhere"
        elif missing != "recordings":
            (folder / missing).unlink()
        code, out, err = forcemap("collect", folder)
        assert (code, out) == (2, "")
        assert err.startswith(f"error: {folder}")
        assert err.count("\n") == 1
        assert {"recordings": "found no recording", "folder": "no such folder"}.get(missing, f"no {missing}") in err

    def test_watch_picks_up_a_file_and_ends_whole(self, tmp_path):
        folder = write_campaign(tmp_path / "campaign", recorded=False)
        save(folder / "recordings" / f"{RUN}.csv", *pulse(100.0))
        save(tmp_path / "other.csv", *pulse(110.0))
        with watching(folder) as (process, until, errors):
            assert f"{RUN}.csv: used" in until("1 impacts; missing runs: 26")
            os.replace(tmp_path / "other.csv", folder / "recordings" / f"{OTHER}.csv")
            assert f"{OTHER}.csv: used" in until("2 impacts; missing runs: 25")
            process.send_signal(signal.SIGINT)
            assert process.stdout.read() == ""
            assert process.wait() in (0, 130)
        assert "Traceback" not in errors.read_text()
        found = (folder / "impacts.csv").read_bytes(), (folder / "recordings.csv").read_bytes()
        collect(folder)
        assert ((folder / "impacts.csv").read_bytes(), (folder / "recordings.csv").read_bytes()) == found
        assert [path.name for path in folder.glob(".*")] == [MEMORY_FILE]

    def test_watch_loses_nothing(self, tmp_path):
        """A clock that is behind, files that rest half-way, a campaign.toml that is half saved, a second process."""
        folder = write_campaign(tmp_path / "campaign", recorded=False)
        ahead, resting, late, other = (folder / "recordings" / f"{name}.csv" for name in folder_runs(folder)[:4])
        save(tmp_path / "ahead.csv", *pulse(100.0))
        os.utime(tmp_path / "ahead.csv", (time.time() + 36_000,) * 2)
        os.replace(tmp_path / "ahead.csv", ahead)
        save(tmp_path / "whole.csv", *pulse(110.0))
        whole = (tmp_path / "whole.csv").read_bytes()
        with watching(folder) as (process, until, errors):
            until("1 impacts;")
            for share, use in ((0.1, "discarded"), (0.22, ""), (0.5, "used")):
                resting.write_bytes(whole[: int(share * len(whole))])
                assert f"{resting.name}: {use}" in until(" impacts;")
            resting.write_bytes(whole)
            assert f"{resting.name}: used" in until("2 impacts;")
            stated = (folder / "campaign.toml").read_bytes()
            (folder / "campaign.toml").write_bytes(stated[:-20])
            save(late, *pulse(120.0))
            while "campaign.toml" not in errors.read_text():
                assert process.poll() is None
                time.sleep(0.05)
            (folder / "campaign.toml").write_bytes(stated)
            assert f"{late.name}: used" in until("3 impacts;")
            save(other, *pulse(130.0))
            collect(folder)
            assert f"{other.name}: used" in until("4 impacts;")
        assert errors.read_text().count("\n") == 1
        found = (folder / "impacts.csv").read_bytes(), (folder / "recordings.csv").read_bytes()
        (folder / "recordings.csv").unlink()
        collect(folder)
        assert sorted(found[0].splitlines()) == sorted((folder / "impacts.csv").read_bytes().splitlines())
        assert sorted(found[1].splitlines()) == sorted((folder / "recordings.csv").read_bytes().splitlines())

    def test_watch_prints_no_json(self, forcemap, tmp_path):
        code, _, err = forcemap("collect", tmp_path, "--watch", "--json")
        assert code == 2
        assert "leave --json out" in err


@contextmanager
def watching(folder):
    """`collect --watch`: the process, what it says until it has said some words, and the file of what goes wrong."""
    script = [sys.executable, "-c", "from forcemap.cli import main; main()"]
    errors = folder.parent / "errors.txt"
    with errors.open("w") as stderr:
        process = subprocess.Popen(
            [*script, "collect", folder, "--watch"],
            text=True,
            stdout=subprocess.PIPE,
            stderr=stderr,
            # a shell starts what runs in its background with interrupts ignored, which a child would inherit
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
    hanging = threading.Timer(300, process.kill)

    def until(words):
        said = ""
        for line in process.stdout:
            said += line
            if words in line:
                return said
        raise AssertionError(f"ended without {words!r}: {said}{errors.read_text()}")

    hanging.start()
    try:
        yield process, until, errors
    finally:
        hanging.cancel()
        process.kill()
        process.wait()
        process.stdout.close()


def folder_runs(folder):
    return fm.read_plan(folder).recording.tolist()


class TestInspect:
    def test_json(self, ask, curve_file):
        code, found = ask("inspect", curve_file(peak=180.0, held=40.0), "--device-range-N", 500)
        assert code == 0
        (recording,) = found["recordings"]
        (impact,) = recording["impacts"]
        assert recording["sampling_rate_Hz"] == pytest.approx(2000)
        assert impact["peak_force_N"] == pytest.approx(180, abs=0.5)
        assert impact["phase2_mean_force_N"] == pytest.approx(40, abs=0.5)
        assert impact["peak_time_s"] == pytest.approx(0.015, abs=0.001)
        assert (impact["scenario"], impact["flags"]) == ("constrained_with_clamping", [])

    def test_text_shows_figures_flags_and_the_curve(self, forcemap, curve_file):
        code, out, err = forcemap("inspect", curve_file(peak=180.0, rate=250.0), "--device-range-N", 500)
        assert (code, err) == (0, "")
        for words in ("unconstrained", "Phase I peak", "FLAG unresolved", "Hz or more", "*", "0 ms"):
            assert words in out
        assert "--device-range-N" not in out
        assert "--device-range-N" in forcemap("inspect", curve_file())[1]

    def test_text_begins_with_whether_it_can_be_used(self, forcemap, curve_file, tmp_path):
        for rate, words in (
            (2000.0, "; usable for a map, as far as the curve tells"),
            (250.0, "; NOT USABLE for a map where flagged unresolved: the peak is not"),
        ):
            out = forcemap("inspect", curve_file(peak=180.0, rate=rate), "--device-range-N", 500)[1]
            assert words in " ".join(out.split())
        out = forcemap("inspect", curve_file(peak=180.0), "--device-range-N", 180)[1]
        assert "; usable for a map, as at least their force where saturated" in " ".join(out.split())
        assert "usable" not in forcemap("inspect", curve_file(peak=1.0), "--device-range-N", 500)[1].lower()
        seconds, force = pulse(180.0)
        save(tmp_path / "two.csv", np.concatenate([seconds, seconds + 1.0005]), np.tile(force, 2))
        code, out, err = forcemap("inspect", tmp_path / "two.csv", "--device-range-N", 500)
        assert (code, err) == (0, "")
        assert "; for a map a recording holds one impact alone" in " ".join(out.split())

    def test_columns_by_option_and_a_file_without_an_impact(self, ask, tmp_path):
        t, force = pulse(180.0)
        np.savetxt(tmp_path / "odd.txt", np.column_stack([1000 * t, 0 * t, -force]), delimiter=";", fmt="%.4f")
        columns = [f"--column={entry}" for entry in ("time=1", "time_unit=ms", "force=3", "sign=-1")]
        code, found = ask("inspect", tmp_path / "odd.txt", *columns)
        assert code == 0
        assert found["recordings"][0]["impacts"][0]["peak_force_N"] == pytest.approx(180, abs=0.5)
        columns[2:] = ["--column=force=2"]
        code, found = ask("inspect", tmp_path / "odd.txt", *columns)
        assert (code, found["recordings"][0]["impacts"]) == (0, [])
        code, found = ask("inspect", tmp_path / "odd.txt", "--column=force=3")
        assert (code, found["error"]["kind"]) == (2, "recording")


class TestCheck:
    @pytest.mark.parametrize(
        ("peak", "code", "outcome"), [(120.0, 0, "within"), (139.0, 2, "cannot_tell"), (150.0, 1, "exceeded")]
    )
    def test_exit_codes(self, ask, curve_file, peak, code, outcome):
        found_code, found = ask("check", curve_file(peak=peak), "--limit-N", 140, *DEVICE)
        assert (found_code, found["outcome"]) == (code, outcome)
        (impact,) = found["impacts"]
        assert impact["outcome"] == outcome
        assert impact["margin_N"] == pytest.approx(140 - peak, abs=0.1)
        assert [each["interpretation"] for each in impact["interpretations"]] == ["by-time", "by-scenario", "by-shape"]

    def test_the_head_is_not_permitted(self, ask, curve_file):
        code, found = ask("check", curve_file(peak=20.0), "--area", "temple", "--device-range-N", 500)
        assert (code, found["outcome"]) == (1, "not_permitted")

    def test_a_named_interpretation_governs(self, ask, forcemap, curve_file):
        path = curve_file(peak=200.0, held=100.0)
        code, found = ask("check", path, *HAND, *DEVICE)
        assert (code, found["impacts"][0]["interpretation"]) == (1, "by-scenario")
        code, found = ask("check", path, *HAND, *DEVICE, "--interpretation", "by-time")
        assert (code, found["outcome"]) == (0, "within")
        _, out, _ = forcemap("check", path, *HAND, *DEVICE)
        assert out.startswith("EXCEEDED: 280 N transient, 140 N quasi-static")
        assert "pressure is not assessed" in out

    def test_a_file_without_an_impact_is_not_within(self, ask, curve_file):
        code, found = ask("check", curve_file(peak=0.0), *HAND)
        assert (code, found["outcome"], found["counts"]["unjudged"]) == (2, "cannot_tell", 1)

    def test_a_campaign_is_as_good_as_its_worst_recording(self, ask, tmp_path):
        folder = write_campaign(tmp_path / "campaign")
        assert ask("check", folder, *HAND)[0] == 0
        broken = folder / "recordings" / "another.csv"
        broken.write_text("time_s,force_N\n0,1\n0.1,\n")
        code, found = ask("check", folder, *HAND)
        assert (code, found["counts"]["within"], found["counts"]["unjudged"]) == (2, 27, 1)
        broken.unlink()
        save(broken, *pulse(300.0))
        code, found = ask("check", folder, *HAND)
        assert (code, found["counts"]["exceeded"]) == (1, 1)

    def test_one_excluded_curve_does_not_hide_the_others_of_its_file(self, ask, tmp_path):
        folder = write_campaign(
            tmp_path / "campaign", recorded=False, toml=f'{TOML}[recordings]\ntime = "t_s"\nruns = "all"\n'
        )
        t, force = pulse(100.0)
        table = np.column_stack([t, force, 3 * force])
        names = f"t_s,{RUN},{OTHER}"
        np.savetxt(folder / "recordings" / "all.csv", table, delimiter=",", fmt="%.5f", header=names, comments="")
        collect(folder)
        text = (folder / "recordings.csv").read_text()
        exclude(folder, f"all.csv#{RUN}")
        collect(folder)
        assert register(folder)[f"all.csv#{RUN}"]["use"] == "excluded"
        code, found = ask("check", folder, *HAND)
        assert (code, len(found["impacts"])) == (1, 1)
        (folder / "recordings.csv").write_text(text)
        exclude(folder, f"all.csv#{OTHER}")
        collect(folder)
        assert ask("check", folder, *HAND)[0] == 0

    @pytest.mark.parametrize("options", [(), ("--limit-N", 140, *HAND), ("--limit-N", "nan"), ("--area", "elbw")])
    def test_a_limit_that_is_none_is_refused(self, ask, curve_file, options):
        code, found = ask("check", curve_file(), *options)
        assert code == 2
        assert found["error"]["message"]


def exclude(folder, name):
    """Exclude a recording, as a person does in recordings.csv."""
    lines = (folder / "recordings.csv").read_text().splitlines()
    at = lines[0].split(",").index("exclude")
    for number, line in enumerate(lines):
        cells = line.split(",")
        if "#".join(cells[:2]) == name:
            cells[at] = "by hand"
            lines[number] = ",".join(cells)
    (folder / "recordings.csv").write_text("\n".join(lines) + "\n")


def test_what_was_collected_and_gave_nothing_is_not_called_not_collected(ask, tmp_path):
    """Four recordings too coarse to show their peak, one of them of no run, and one without an impact: all counted."""
    folder = write_campaign(tmp_path / "campaign", recorded=False)
    names = fm.read_plan(folder).recording.tolist()
    for name in (*names[:3], "hand"):
        save(folder / "recordings" / f"{name}.csv", *pulse(150.0, rate=100.0, seed=len(name)))
    save(folder / "recordings" / f"{names[3]}.csv", *pulse(0.0, rate=1000.0, seed=9))
    code, found = ask("collect", folder)
    assert code == 2
    counted = "none of 5 recordings gave an impact that can be used: "
    assert found["error"]["message"].startswith(counted)
    assert f"{counted}4 discarded, 1 unassigned; flags: 4 unresolved" in found["error"]["message"]
    entry = register(folder)["hand.csv"]
    assert entry["use"] == "unassigned"
    assert entry["reason"].startswith("no run of the plan has this name; ")
    assert "; unresolved: " in entry["reason"]
    for command in (("speed-map", folder, *HAND, "--contact", "transient"), ("fit", folder)):
        code, found = ask(*command)
        assert code == 2
        assert found["error"]["message"].startswith(f"there is no impacts.csv: collected, but {counted}")
        assert "not collected" not in found["error"]["message"]


def test_a_table_that_is_gone_is_written_again(ask, tmp_path):
    campaign = write_campaign(tmp_path / "campaign")
    collect(campaign)
    (campaign / "impacts.csv").unlink()
    message = ask("fit", campaign)[1]["error"]["message"]
    assert message.startswith("there is no impacts.csv, but recordings.csv has 27 used recordings")
    assert message.endswith(f"forcemap collect {campaign} writes it again")


@pytest.mark.real_data
@needs_real_data
def test_the_reasons_of_a_check_begin_with_what_exceeds_and_its_doubt(forcemap, real_data, tmp_path):
    """An arm's own force sensor: one sample that may be interference decides, and the verdict stays."""
    columns = ["time = 1", 'time_unit = "ms"', "force = [20, 21, 22]", "direction = [-1.0, 0.0, 0.0]"]
    toml = STATED.partition("[recordings]")[0] + "\n".join(["[recordings]", *columns]) + "\n"
    folder = write_campaign(tmp_path / "campaign", recorded=False, toml=toml)
    shutil.copytree(real_data / "ur_clamp", folder / "recordings", dirs_exist_ok=True)
    code, out, _ = forcemap("check", folder, *HAND)
    said = " ".join(out.split())
    assert (code, said.startswith("EXCEEDED (6 impacts: 0 within, 5 cannot tell, 1 exceeded)")) == (1, True)
    first, second = said.partition("Why - ")[2].split(" - ")[:2]
    assert first.startswith("Drift00_WF_1.csv: exceeded by 118.0 N, but its peak is in doubt, spike: ")
    assert "258.0 N with, 41.6 N without (flags: " in first
    assert "unresolved)" in first or "unresolved," in first
    assert first.endswith("record it again")
    assert second.startswith("Drift00_NF_1.csv: cannot tell: unresolved")
    assert "cannot be told from these samples" in second
    assert not re.search(r"\d{3,}% above", said)


def test_an_impact_without_doubt_that_exceeds_says_the_limit(forcemap, tmp_path):
    campaign = write_campaign(tmp_path / "campaign")
    out = forcemap("check", campaign, "--limit-N", 150, "--quasi-static-limit-N", 150)[1]
    said = " ".join(out.split()).partition("Why - ")[2]
    assert re.match(r"\S+\.csv: exceeded by [\d.]+ N, [\d.]+ N exceed the limit of 150 N", said)
    by = [float(figure) for figure in re.findall(r"exceeded by ([\d.]+) N", said)]
    assert by == sorted(by, reverse=True)
