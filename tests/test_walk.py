"""One answer everywhere to what a campaign's recordings are: by collect, report, check, inspect and the page."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import forcemap as fm
from forcemap.words import sentence
from pulses import TOML, collect, pulse, register, save, write_campaign
from web_server import client_of

RUN = "d500-h200-v100-r1"
HAND = ("--area", "back_of_hand")
PLAIN = {"content-type": "application/octet-stream"}


@pytest.fixture
def folder(tmp_path):
    """A campaign with a low-pass."""
    return write_campaign(tmp_path / "served" / "cell", toml=f"{TOML}channel_frequency_class = 180\n")


def unevenly(path, peak=120.0, held=0.0):
    """A recording that no low-pass may be applied to."""
    time, force = pulse(peak, rate=2000.0, held=held, seed=1)
    kept = np.random.default_rng(7).random(time.size) > 0.1
    save(path, time[kept], force[kept])


def judged(folder, file, **more):
    """What the page says of a file."""
    with client_of(folder.parent) as client:
        asked = {"area": "back_of_hand", "file": file.name} | more
        return client.post(
            f"/api/campaigns/{folder.name}/judge", params=asked, content=file.read_bytes(), headers=PLAIN
        )


@pytest.mark.parametrize(
    ("peak", "outcome", "code", "unfiltered"), [(120.0, "cannot_tell", 2, 0), (350.0, "exceeded", 1, 1)]
)
def test_a_file_that_cannot_be_filtered(folder, ask, peak, outcome, code, unfiltered):
    """It is not judged, and says why; the others are. That it exceeds a limit counts all the same."""
    file = folder / "recordings" / f"{RUN}.csv"
    unevenly(file, peak)
    assert len(collect(folder)) == 26
    row = register(folder)[file.name]
    assert row["use"] == "discarded"
    why = row["reason"]
    assert "needs even sampling" in why

    limit = fm.force_limit("back_of_hand")
    results = {each.entry.file: each for each in fm.assess_campaign(folder, limits=[limit]).recordings.results}
    (judgement,) = results[file.name].judgements
    assert (judgement.outcome if judgement else "cannot_tell") == outcome
    assert sentence(results[file.name].not_judged) == why
    assert [each.not_judged for name, each in results.items() if name != file.name] == [None] * 26

    found_code, found = ask("check", folder, *HAND)
    assert (found_code, found["outcome"]) == (code, outcome)
    assert found["unjudged"] == [{"recording": file.name, "reason": why}]
    assert (found["counts"]["within"], found["counts"]["exceeded"], len(found["impacts"])) == (
        26,
        unfiltered,
        26 + unfiltered,
    )

    found_code, found = ask("check", file, *HAND)
    assert (found_code, found["outcome"], found["unjudged"]) == (
        code,
        outcome,
        [{"recording": file.name, "reason": why}],
    )
    (inspected,) = ask("inspect", file)[1]["recordings"]
    assert (inspected["problem"], len(inspected["impacts"])) == (why, 1)
    assert judged(folder, file).json() == found


def test_its_scenario_counts_all_the_same(folder):
    unevenly(folder / "recordings" / f"{RUN}.csv", held=90.0)
    dataset = collect(folder)
    assert dataset.phase_two.scenarios[fm.ContactScenario.WITH_CLAMPING] == 1


def test_a_file_that_cannot_be_read(folder, ask):
    file = folder / "recordings" / f"{RUN}.csv"
    file.write_text("time_s,force_N\n0.0,1.0\n0.1,broken\n")
    collect(folder)
    row = register(folder)[file.name]
    assert row["use"] == "unreadable"
    code, found = ask("check", folder, *HAND)
    assert (code, found["unjudged"]) == (2, [{"recording": file.name, "reason": row["reason"]}])
    assert row["reason"].startswith("row 3, found 'broken'")
    results = fm.assess_campaign(folder).recordings.results
    assert [sentence(each.not_judged) for each in results if each.not_judged] == [row["reason"]]
    code, found = ask("check", file, *HAND)
    answer = judged(folder, file)
    assert (code, answer.status_code) == (2, 422)
    assert {"row": 3, "column": "force_N"}.items() <= found["error"].items()
    assert {"row": 3, "column": "force_N"}.items() <= answer.json()["error"].items()


@pytest.mark.parametrize("name", ["d500-h200-v100-r01", "D500-H200-V100-R1", "d500-h200-v100-r7", "d500-h200-v100-r0"])
def test_a_name_says_one_run_to_collect_and_to_the_page(folder, name):
    """By content: the same file is the same run, whether it is copied into the folder or dropped on the page."""
    old = folder / "recordings" / f"{RUN}.csv"
    content = old.read_bytes()
    old.unlink()
    with client_of(folder.parent) as client:
        address = f"/api/campaigns/{folder.name}/recordings"
        asked = {"area": "back_of_hand", "file": f"{name}.csv"}
        stored = client.post(address, params=asked, content=content, headers=PLAIN).json()
    row = register(folder)[stored["stored_as"]]
    by_page = row["state_id"], row["repeat"], row["use"]
    (folder / "recordings" / stored["stored_as"]).rename(folder / "recordings" / f"{name}.csv")
    for file in ("recordings.csv", "impacts.csv"):
        (folder / file).unlink()
    collect(folder)
    row = register(folder)[f"{name}.csv"]
    assert (row["state_id"], row["repeat"], row["use"]) == by_page
    assert (row["use"] == "used") == (name[-1] != "0")


@pytest.mark.parametrize("area", ["back_of_hand", "chest", "face"])
def test_check_and_the_page_give_the_same_object(folder, ask, area):
    file = folder / "recordings" / f"{RUN}.csv"
    _, found = ask("check", file, "--area", area)
    answer = judged(folder, file, area=area)
    assert answer.json() == found
    drawn = judged(folder, file, area=area, curves="true").json()
    curve, *none = drawn.pop("curves")
    assert (drawn, none) == (found, [])
    assert max(curve["force_N"]) == pytest.approx(found["impacts"][0]["largest_force_N"], abs=0.1)
    assert json.loads(json.dumps(found)) == found


def test_collect_and_the_page_give_the_same_object(folder, ask):
    unevenly(folder / "recordings" / f"{RUN}.csv", held=90.0)
    code, found = ask("collect", folder)
    assert (code, found["used"], len(found["discards"])) == (0, 26, 1)
    with client_of(folder.parent) as client:
        assert client.post(f"/api/campaigns/{folder.name}/collect").json() == found
        (folder / "recordings" / f"{RUN}.csv").unlink()
        answer = client.post(f"/api/campaigns/{folder.name}/collect")
    code, refused = ask("collect", folder)
    assert (code, answer.status_code) == (2, 422)
    error = answer.json()["error"]
    assert (error["kind"], error["message"]) == (refused["error"]["kind"], refused["error"]["message"])


def excluded(folder, **why):
    """The register as a person leaves it who excludes recordings."""
    rows = list(register(folder).values())
    for row in rows:
        row["exclude"] = why.get(row["file"].partition(".")[0].replace("-", "_"), row["exclude"])
    with (folder / "recordings.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def test_one_of_two_copies_that_are_gone_is_the_new_file(folder, ask):
    """The one that nobody excluded: what exceeds the limit in it counts."""
    for name in ("a", "b"):
        save(folder / "recordings" / f"{name}.csv", *pulse(350.0, rate=1000.0, seed=5))
    collect(folder)
    excluded(folder, b="a copy")
    assert ask("check", folder, *HAND)[0] == 1
    for name in ("a", "b"):
        (folder / "recordings" / f"{name}.csv").unlink()
    save(folder / "recordings" / "new.csv", *pulse(350.0, rate=1000.0, seed=5))
    code, found = ask("check", folder, *HAND)
    assert code == 1
    assert [each["recording"] for each in found["unjudged"]] == ["b.csv"]


@pytest.mark.parametrize("peak", [None, 120.0, 350.0])
def test_an_exclusion_holds_for_the_recording_that_was_excluded(folder, ask, peak):
    """Not for nothing, nor for another one under its name."""
    collect(folder)
    excluded(folder, **{RUN.replace("-", "_"): "the device slipped"})
    assert ask("check", folder, *HAND)[0] == 0
    file = folder / "recordings" / f"{RUN}.csv"
    file.unlink()
    if peak is not None:
        save(file, *pulse(peak, rate=1000.0, seed=99))
    code, found = ask("check", folder, *HAND)
    assert (code, found["outcome"]) == ((1, "exceeded") if peak == 350.0 else (2, "cannot_tell"))
    assert [each["recording"] for each in found["unjudged"]] == [file.name]
