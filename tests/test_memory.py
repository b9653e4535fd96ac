"""What a campaign's folder remembers of its recordings changes nothing but the time that collecting takes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from forcemap.campaigns import build, impact_rows, readout, workers
from forcemap.campaigns.memory import MEMORY_FILE
from pulses import TOML, collect, pulse, save, write_campaign
from sizes import FULL_SIZE

SEED = 202618
TABLES = ("recordings.csv", "impacts.csv")
DEVICES = TOML.partition("[device]")[0] + "".join(
    f'[[devices]]\nrecordings = "{names}"\nrange_N = {newtons}.0\nerror_N = 3.0\nstiffness_N_per_m = 75000.0\n'
    for names, newtons in (("d500-*", 500), ("*", 400))
)


@pytest.fixture
def judged(monkeypatch):
    """Names of the files that were judged, as they are read."""
    names = []

    def listed(path, *arguments, name, **options):
        names.append(name)
        return recorded_impacts(path, *arguments, name=name, **options)

    recorded_impacts = readout.recorded_impacts
    monkeypatch.setattr(readout, "recorded_impacts", listed)
    return names


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A campaign that is not collected yet, with a recording of two impacts, one without and one that is no table."""
    folder = write_campaign(tmp_path_factory.mktemp("memory") / "campaign")
    files = sorted((folder / "recordings").iterdir())
    (time_s, force), (_, late) = pulse(120.0, rate=1000.0, after=2.0), pulse(0.0, rate=1000.0, after=2.0)
    save(files[0], time_s, force + np.roll(force, 1200))
    save(files[1], time_s, late)
    files[2].write_text("no table\n")
    return folder


@pytest.fixture
def campaign(measured, tmp_path):
    return shutil.copytree(measured, tmp_path / "campaign")


def tables(folder):
    return {name: (folder / name).read_bytes() for name in TABLES if (folder / name).exists()}


def collected(folder):
    """The tables of a folder once it is collected, and the error if it cannot be."""
    try:
        collect(folder)
    except fm.ForcemapError as error:
        return tables(folder), str(error).replace(str(folder), "")
    return tables(folder), ""


def from_nothing(folder, to):
    """The same of a copy of the folder that remembers nothing."""
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(folder, to)
    (to / MEMORY_FILE).unlink(missing_ok=True)
    return collected(to)


def rewrite(path, old, new):
    path.write_text(path.read_text().replace(old, new, 1))


def some_file(folder, rng):
    return rng.choice(sorted((folder / "recordings").iterdir()))


def new_register(folder, rng):
    (folder / "recordings.csv").unlink(missing_ok=True)


def another_curve(folder, rng):
    new_register(folder, rng)
    save(some_file(folder, rng), *pulse(float(rng.uniform(60, 300)), rate=1000.0, seed=int(rng.integers(1000))))


def a_longer_one(folder, rng):
    path = some_file(folder, rng)
    path.write_text(path.read_text() + "1.9,0.0\n")


def the_same_size_and_time(folder, rng):
    """A digit of the force at its peak, size and times of the file as they were."""
    new_register(folder, rng)
    path = some_file(folder, rng)
    content, before = path.read_text(), path.stat()
    digit = rng.choice([number for number, sign in enumerate(content) if sign.isdigit()])
    path.write_text(content[:digit] + str(rng.integers(10)) + content[digit + 1 :])
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def one_more(folder, rng):
    save(folder / "recordings" / f"d500-h200-v100-r{rng.integers(2, 9)}.csv", *pulse(100.0, rate=1000.0, seed=5))


def another_name(folder, rng):
    path = some_file(folder, rng)
    if not (other := path.with_name(f"x-{path.name}")).exists():
        path.rename(other)


def two_exchanged(folder, rng):
    new_register(folder, rng)
    one, other = some_file(folder, rng), some_file(folder, rng)
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)


def one_less(folder, rng):
    new_register(folder, rng)
    some_file(folder, rng).unlink()


def an_entry(folder, rng):
    """An entry of campaign.toml on which what is read depends, or one on which it does not."""
    path = folder / "campaign.toml"
    other = (
        *(
            TOML.replace("500.0", "180.0"),
            TOML.replace("error_N = 3.0", "error_N = 5.0"),
            TOML.replace("75000", "60000"),
        ),
        *(f"{TOML}channel_frequency_class = 30\n", f'{TOML}calibrated = "2020-01-01"\n', DEVICES),
        *(f"{TOML}[recordings]\n{line}\n" for line in COLUMNS),
        TOML.replace("[device]", 'date = "2026-02-03"\n[device]'),
        TOML.replace("[device]", '[robot]\nmodel = "another"\n[device]'),
        TOML,
    )
    path.write_text(str(rng.choice(other)))


COLUMNS = (
    'time = "time_s"\nforce = "force_N"\nsign = -1',
    'time = "time_s"\nforce = "force_N"',
    'time = 1\nforce = 2\ntime_unit = "s"',
)


def a_plan(folder, rng):
    rewrite(folder / "plan.csv", "0.9,0.4,0.3,", "0.9,0.4,0.31,")


def an_exclusion(folder, rng):
    register = folder / "recordings.csv"
    if register.exists():
        lines = register.read_text().splitlines()
        where, row = lines[0].split(",").index("exclude"), int(rng.integers(1, len(lines)))
        cells = lines[row].split(",")
        cells[where] = "the device slipped"
        register.write_text("\n".join([*lines[:row], ",".join(cells), *lines[row + 1 :]]) + "\n")


def a_damaged_memory(folder, rng):
    path = folder / MEMORY_FILE
    content = bytearray(path.read_bytes()) if path.exists() else bytearray(b"x")
    content[int(rng.integers(len(content)))] ^= int(rng.integers(1, 256))
    path.write_bytes(content)


def half_a_memory(folder, rng):
    path = folder / MEMORY_FILE
    content = path.read_bytes() if path.exists() else b""
    path.write_bytes(content[: int(rng.integers(len(content) + 1))])


def an_edited_table(folder, rng):
    path = folder / str(rng.choice(TABLES))
    if path.exists():
        content = path.read_text()
        digit = rng.choice([number for number, sign in enumerate(content) if sign.isdigit()])
        path.write_text(content[:digit] + str(rng.integers(10)) + content[digit + 1 :])


def another_order(folder, rng):
    """Rows of the plan, or of the register, in another order."""
    path = folder / str(rng.choice(["plan.csv", "recordings.csv"]))
    if path.exists():
        head, *rows = path.read_text().splitlines()
        path.write_text("\n".join([head, *rows[1:], rows[0]]) + "\n")


def a_film(folder, rng):
    (folder / "pressures").mkdir(exist_ok=True)
    film = folder / "pressures" / f"{some_file(folder, rng).stem}.txt"
    film.write_text(f"unit: N/cm2\npitch: 6 mm\n0;{rng.integers(50, 90)}\n0;9\n")


def a_note(folder, rng):
    (folder / ".collecting").write_text("left by a killed run\n")


def no_memory(folder, rng):
    (folder / MEMORY_FILE).unlink(missing_ok=True)


CHANGES = (
    *(another_curve, a_longer_one, the_same_size_and_time, one_more, another_name, two_exchanged, one_less),
    *(an_entry, an_entry, an_entry, a_plan, an_exclusion, a_damaged_memory, half_a_memory, no_memory),
    *(an_edited_table, another_order, a_film, a_note),
)


@pytest.mark.parametrize("run", range(40 if FULL_SIZE else 2))
def test_property_the_tables_are_those_from_nothing_whatever_changed(campaign, tmp_path, run):
    rng = np.random.default_rng([SEED, run])
    for _ in range(8):
        for change in rng.choice(len(CHANGES), rng.integers(0, 3)).tolist():
            CHANGES[change](campaign, rng)
        expected = from_nothing(campaign, tmp_path / "nothing")
        assert collected(campaign) == expected
        assert from_nothing(campaign, tmp_path / "nothing") == expected  # what it wrote is taken again


@pytest.mark.parametrize("change", dict.fromkeys(CHANGES), ids=lambda change: change.__name__)
def test_after_every_kind_of_change_the_tables_are_those_from_nothing(campaign, tmp_path, change):
    collect(campaign)
    rng = np.random.default_rng(SEED)
    for _ in range(3):
        change(campaign, rng)
        assert collected(campaign) == from_nothing(campaign, tmp_path / "nothing")


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [("campaign.toml", "range_N = 500.0", "range_N = 490.0"), ("plan.csv", "0.9,0.4,0.3,", "0.9,0.4,0.31,")],
)
@pytest.mark.parametrize("before", [True, False], ids=["before it is built", "while it is built"])
def test_what_is_edited_while_a_folder_is_collected_counts_in_the_next(campaign, tmp_path, file, old, new, before):
    for path in sorted((campaign / "recordings").iterdir())[:3]:
        path.unlink()  # what was no impact
    read = fm.read_campaign(campaign)
    if before:
        rewrite(campaign / file, old, new)
    fm.build_dataset(read, progress=lambda *_: rewrite(campaign / file, old, new))
    assert new in (campaign / file).read_text()
    assert collected(campaign) == from_nothing(campaign, tmp_path / "nothing")


def test_what_is_known_is_not_judged_again(campaign, judged):
    collect(campaign)
    files = sorted(path.name for path in (campaign / "recordings").iterdir())
    assert sorted(judged) == files
    before = {path: path.stat().st_mtime_ns for path in campaign.iterdir()}
    judged.clear()
    collect(campaign)
    assert judged == []
    assert {path: path.stat().st_mtime_ns for path in campaign.iterdir()} == before  # nothing is written again
    os.utime(campaign / "recordings" / files[5])
    rewrite(campaign / "campaign.toml", "[device]", '[robot]\nmodel = "another"\n[device]')
    collect(campaign)
    assert judged == []  # neither a date nor the robot's name changes what is read
    save(campaign / "recordings" / "d500-h200-v100-r7.csv", *pulse(100.0))
    collect(campaign)
    assert judged == ["d500-h200-v100-r7.csv"]


def test_a_folder_as_it_was_left_is_read_alone_and_one_that_changed_is_not(campaign, monkeypatch, tmp_path):
    collect(campaign)
    walked = []
    monkeypatch.setattr(build, "registered", lambda *each, **also: walked.append(each) or registered(*each, **also))
    registered = impact_rows.registered
    before = tables(campaign)
    collect(campaign)
    assert not walked
    assert tables(campaign) == before
    for change in (an_edited_table, a_plan, a_note, one_more):
        shutil.rmtree(tmp_path / "other", ignore_errors=True)
        other = shutil.copytree(campaign, tmp_path / "other")
        change(other, np.random.default_rng(SEED))
        collected(other)
        assert walked, change
        walked.clear()


@pytest.mark.parametrize("entry", ["range_N = 500.0", "[device]"])
def test_what_is_read_otherwise_is_judged_again(campaign, judged, entry):
    collect(campaign)
    judged.clear()
    rewrite(
        campaign / "campaign.toml", entry, {"[device]": 'date = "2026-02-03"\n[device]'}.get(entry, "range_N = 490.0")
    )
    collected(campaign)
    assert len(judged) == 27


def test_of_several_devices_the_state_tells_which(campaign, tmp_path):
    """Names that say nothing of the device, a register that says the state: judged and remembered by its device."""
    (campaign / "campaign.toml").write_text(DEVICES)
    path = next(path for path in sorted((campaign / "recordings").iterdir()) if path.name.startswith("d500-h400"))
    path.rename(path.with_name("mine.csv"))
    (campaign / "recordings.csv").write_text("file,state_id,repeat\nmine.csv,d500-h400-v300,1\n")
    expected = from_nothing(campaign, tmp_path / "nothing")
    for _ in range(3):
        assert collected(campaign) == expected


def forged(folder, lower):
    """The memory with lower peaks, its seal as it was."""
    seal, text, as_it_is = (folder / MEMORY_FILE).read_text().split("\n")
    entries = json.loads(text)
    for entry in entries:
        for recording in entry[4]:
            for impact in recording[-1]:
                impact[2:5] = [lower * figure for figure in impact[2:5]]
    return "\n".join([seal, json.dumps(entries, separators=(",", ":")), as_it_is])


def test_a_memory_edited_to_lower_forces_counts_for_nothing(campaign, tmp_path, monkeypatch):
    expected = from_nothing(campaign, tmp_path / "nothing")
    collect(campaign)
    (campaign / MEMORY_FILE).write_text(forged(campaign, 0.5))
    (campaign / "impacts.csv").unlink()
    assert collected(campaign) == expected
    # nor one that another account sealed, with the very same software
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "another account"))
    collect(campaign)
    monkeypatch.undo()
    (campaign / "impacts.csv").unlink()
    assert collected(campaign) == expected


def test_reports_and_verdicts_judge_the_recordings_whatever_is_remembered(campaign, judged):
    collect(campaign)
    judged.clear()
    fm.assess_campaign(campaign)
    assert sorted(judged) == sorted(path.name for path in (campaign / "recordings").iterdir())  # each once
    judged.clear()
    fm.check_campaign(fm.read_campaign(campaign), fm.force_limit("back_of_hand"))
    assert len(judged) == 27


def test_another_version_of_the_software_remembers_nothing(campaign, tmp_path):
    """A copy of the source with another comment in a room that judges; a changed sentence elsewhere does not count."""
    source = Path(fm.__file__).parent
    copied = tmp_path / "source" / "forcemap"
    shutil.copytree(source, copied, ignore=shutil.ignore_patterns("__pycache__"))
    memories = []
    for room in ("maps/forms.py", "impacts/detect.py", "recordings/numbers.py", "errors.py"):
        with (copied / room).open("a") as stream:
            stream.write("# another version\n")
        script = "import sys, forcemap as fm; fm.build_dataset(fm.read_campaign(sys.argv[1]))"
        environment = os.environ | {"PYTHONPATH": str(copied.parent)}
        subprocess.run([sys.executable, "-c", script, str(campaign)], env=environment, check=True)
        memories.append((campaign / MEMORY_FILE).read_text().split("\n"))
    seals, texts, of_folders = map(set, zip(*memories, strict=True))
    assert len(seals) == len(of_folders) == 4
    assert len(texts) == 1


def test_without_a_place_for_the_secret_nothing_is_remembered(campaign, tmp_path, monkeypatch, judged):
    expected = from_nothing(campaign, tmp_path / "nothing")
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    judged.clear()
    for _ in range(2):
        assert collected(campaign) == expected
    assert len(judged) == 54
    assert not (campaign / MEMORY_FILE).exists()


def test_a_secret_that_others_can_read_is_none(campaign, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    collect(campaign)
    secret = tmp_path / "forcemap" / "memory.key"
    assert secret.stat().st_mode & 0o077 == 0
    secret.chmod(0o644)
    (campaign / MEMORY_FILE).unlink()
    collect(campaign)
    assert not (campaign / MEMORY_FILE).exists()


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """More recordings than one process judges alone."""
    return write_campaign(tmp_path_factory.mktemp("many") / "campaign", repeats=3)


@pytest.mark.parametrize("processes", [2, 3, 7])
def test_several_processes_give_the_same_tables_and_memory(many, tmp_path, processes):
    alone, together = (shutil.copytree(many, tmp_path / name) for name in ("alone", "together"))
    collect(alone)
    seen = []
    fm.build_dataset(fm.read_campaign(together), workers=processes, progress=lambda *done: seen.append(done))
    assert tables(together) == tables(alone)
    assert (together / MEMORY_FILE).read_bytes() == (alone / MEMORY_FILE).read_bytes()
    assert seen == [(number, 81) for number in range(1, 82)]


def test_what_a_killed_process_leaves_undone_is_done(many, tmp_path, monkeypatch):
    """One is killed at its fifth file, in the middle of an answer; another fails, and its error is said."""
    folder = shutil.copytree(many, tmp_path / "campaign")
    expected, _ = from_nothing(folder, tmp_path / "nothing")
    here, count = os.getpid(), [0]

    def dying(path, *arguments, **options):
        count[0] += 1
        if os.getpid() != here and count[0] == 5:
            os.kill(os.getpid(), signal.SIGKILL)
        return recorded_impacts(path, *arguments, **options)

    recorded_impacts = readout.recorded_impacts
    monkeypatch.setattr(readout, "recorded_impacts", dying)
    fm.build_dataset(fm.read_campaign(folder), workers=2)
    assert tables(folder) == expected
    assert count[0] > 60  # by this process, after the others were gone


def test_an_error_in_a_process_is_said_by_the_one_that_asked(many, tmp_path, monkeypatch, capfd):
    folder = shutil.copytree(many, tmp_path / "campaign")

    def failing(path, *arguments, **options):
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr(readout, "recorded_impacts", failing)
    with pytest.raises(ZeroDivisionError, match="a defect"):
        fm.build_dataset(fm.read_campaign(folder), workers=2)
    assert capfd.readouterr() == ("", "")
    assert not (folder / "recordings.csv").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_no_process_is_left_when_the_command_is_ended(tmp_path, how):
    folder = write_campaign(tmp_path / "campaign", repeats=12)
    script = (
        "import sys, forcemap as fm\n"
        "from forcemap.campaigns import workers\n"
        "started = workers._judge_all\n"
        "def told(*arguments):\n"
        "    import os\n"
        "    os.write(1, f'{os.getpid()}\\n'.encode())\n"
        "    started(*arguments)\n"
        "workers._judge_all = told\n"
        "fm.build_dataset(fm.read_campaign(sys.argv[1]), workers=2)\n"
    )
    command = [sys.executable, "-c", script, str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        children = [int(process.stdout.readline()) for _ in range(2)]
        process.send_signal(how)
        process.wait()
    until = time.monotonic() + 60
    while any(Path(f"/proc/{child}").exists() and not zombie(child) for child in children):
        assert time.monotonic() < until, "a process goes on"
        time.sleep(0.05)


def zombie(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def test_few_files_start_no_process(campaign, monkeypatch):
    monkeypatch.setattr(workers, "_started", lambda *_: pytest.fail("a process was started"))
    fm.build_dataset(fm.read_campaign(campaign), workers=2)
