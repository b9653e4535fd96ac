"""Commands killed at any moment: nothing that was there is lost, nothing is half, and the next run completes it."""

from __future__ import annotations

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest

import forcemap as fm
from killing import run_until
from pulses import TOML, collect, write_campaign
from sizes import FULL_SIZE
from web_server import client_of

SEED = 202614
KILLS = {"collect": 140, "watch": 80, "report": 60, "export": 70, "next": 80, "fit": 70}  # 500
HAND = ("--area", "back_of_hand", "--contact", "transient")
COMMANDS = {
    "collect": ("collect",),
    "watch": ("collect", "--watch"),
    "report": ("report", "--area", "back_of_hand", "--date", "2026-02-02"),
    "export": ("export", "--format", "urscript", *HAND),
    "next": ("next", *HAND),
    "fit": ("fit",),
}
WRITES = {"export": "speeds.script", "fit": "map.json"}
EARLIER = {
    "report": ("report", "--area", "back_of_hand", "--date", "2026-01-01"),
    "export": ("export", "--format", "urscript", "--area", "chest", "--contact", "transient"),
    "next": ("next", *HAND, "--batch", "3"),
    "fit": ("fit", "--form", "LOG_SPEED"),
}
TABLES = ("recordings.csv", "impacts.csv")


@dataclass
class Killed:
    """A folder before and after a command, and how many calls it makes, all and those that write."""

    name: str
    folder: object
    before: dict
    after: dict
    calls: tuple


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def put(folder, files):
    shutil.rmtree(folder, ignore_errors=True)
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def command(name, folder, stated=COMMANDS):
    kind, *options = stated[name]
    written = ["-o", folder / WRITES[name]] if name in WRITES else []
    return [kind, str(folder), *options, *map(str, written)]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A campaign of 27 recordings: whole, not collected, and with a third of it collected, one file of it half."""
    folder = write_campaign(
        tmp_path_factory.mktemp("killed") / "campaign",
        toml=TOML.replace("[device]", '[contact]\ndirection = "down"\n[device]'),
    )
    raw = contents(folder)
    files = sorted(name for name in raw if name.startswith("recordings/"))
    half = {files[0]: raw[files[0]][: len(raw[files[0]]) // 2]}
    put(folder, {name: content for name, content in raw.items() if name not in files[9:]} | half)
    collect(folder)
    part = raw | {name: (folder / name).read_bytes() for name in TABLES}
    put(folder, raw)
    collect(folder)
    return folder, raw, part, contents(folder)


def scenarios(campaign, name):
    """The folders in which a command is killed."""
    folder, raw, part, whole = campaign
    said = folder.parent / "said.txt"
    for before in {"collect": (raw, part), "watch": (part,)}.get(name, (whole,)):
        put(folder, before)
        if name in EARLIER:
            run_until(command(name, folder, EARLIER), said)
            earlier = {file: content for file, content in contents(folder).items() if file != "plan.csv"}
            assert earlier != before
            before = before | earlier
        put(folder, before)
        calls = run_until(command(name, folder), said, call=0, enough="27 impacts;" if name == "watch" else None)
        after = contents(folder)
        assert after != before
        assert name not in ("collect", "watch") or after == whole
        yield Killed(name, folder, before, after, calls)


@pytest.mark.parametrize("name", [name for name in COMMANDS if FULL_SIZE or name != "report"])  # it takes seconds each
def test_killed_at_any_moment(campaign, full_size, name):
    rng = np.random.default_rng([SEED, list(COMMANDS).index(name)])
    cases = list(scenarios(campaign, name))
    found = {"killed": 0, "old": 0, "between": 0, "new": 0, "hidden": 0}
    for number in range(KILLS[name] if full_size else 2):
        case, writing = cases[number // 2 % len(cases)], number % 2 == 0
        call = int(rng.integers(1, case.calls[writing] + 1))
        put(case.folder, case.before)
        said = case.folder.parent / "said.txt"
        enough = "27 impacts;" if name == "watch" else None
        found["killed"] += (
            run_until(command(name, case.folder), said, call=call, writing=writing, enough=enough) is None
        )
        judged(case, found)
    print(f"\n{name}: {found}")
    assert found["killed"] >= (0.95 * KILLS[name] if full_size else 1)


def judged(case, found):
    """Nothing lost, nothing half, no table that passes for another's; one more run gives what it would have given."""
    now = contents(case.folder)
    hidden = {file for file in now if file.startswith(".")}
    for file in now.keys() - hidden:
        assert now[file] in (case.before.get(file), case.after.get(file)), f"{file} is neither the old nor the new one"
    assert case.before.keys() <= now.keys(), "a file is lost"
    changed = {file for file in case.after if case.before.get(file) != case.after[file]}
    done = {file for file in changed if now.get(file) == case.after[file]}
    found["new" if done == changed else "between" if done else "old"] += 1
    found["hidden"] += bool(hidden)
    if "impacts.csv" in now:
        of_one_run = len({now[table] == case.before.get(table) for table in TABLES}) == 1
        bound = fm.read_dataset(case.folder).binding.state == "bound"
        assert bound == of_one_run, "a table passes for that of other recordings"
    once_more = command("collect" if case.name == "watch" else case.name, case.folder)
    run_until(once_more, case.folder.parent / "said.txt")
    assert contents(case.folder) == case.after


def test_a_simulation_that_was_killed_says_so(campaign, tmp_path, ask):
    folder, raw, _, _ = campaign
    put(folder, raw)
    made, said = tmp_path / "made", tmp_path / "said.txt"
    simulate = ("simulate", folder, "--preset", "ur10e-like", "-o", made)
    _, calls = run_until(simulate, said, call=0)
    assert ask("collect", made)[0] == 0
    for call in (calls // 4, calls // 2, calls - 12):
        shutil.rmtree(made)
        assert run_until(simulate, said, call=call, writing=True) is None
        for command in (("collect", made), ("check", made, "--limit-N", 200), ("report", made), ("fit", made)):
            code, found = ask(*command)
            assert code == 2
            assert "unfinished simulation" in found["error"]["message"]
            assert "delete the folder and simulate again" in found["error"]["message"]
        with client_of(tmp_path) as client:
            assert "unfinished simulation" in client.get("/").text


def test_several_at_once_lose_nothing(campaign):
    folder, raw, _, whole = campaign
    put(folder, raw)
    said = [folder.parent / f"said-{number}.txt" for number in range(3)]
    with ThreadPoolExecutor() as crowd:
        list(crowd.map(lambda each: run_until(command("collect", folder), each), said))
    assert contents(folder) == whole
    assert all("27 recordings: 27 used" in each.read_text() for each in said)


def test_what_a_killed_run_leaves_is_swept(campaign):
    folder, _, _, whole = campaign
    put(folder, whole | dict.fromkeys((".forcemap-part-0123", ".forcemap-part-4567.csv"), b"half"))
    collect(folder)
    assert contents(folder) == whole


@pytest.mark.parametrize("name", ["impacts.csv", "recordings.csv"])
def test_a_table_of_other_recordings_does_not_pass(campaign, tmp_path, name):
    """Not where a kill between the two files would explain it, either."""
    folder, _, part, _ = campaign
    other = write_campaign(tmp_path / "other", seed=7)
    collect(other)
    put(folder, part | {name: (other / name).read_bytes(), ".collecting": b"0" * 64})
    assert fm.read_dataset(folder).binding.state == "broken"
    with pytest.raises(fm.InputError):
        collect(folder)
    assert (folder / name).read_bytes() == (other / name).read_bytes()
