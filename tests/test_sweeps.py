"""Sweeps: the same bytes in one process, in a pool, in parts, on a cluster, and after any of these was killed."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import forcemap as fm
from forcemap.lab.bench import simulate_peaks
from forcemap.lab.virtual_robot import virtual_robot
from forcemap.sweeps.block import compute
from forcemap.sweeps.cluster import TlsFiles, require_safe
from forcemap.sweeps.study import read_study
from sweeping import begun, dask_cluster, ended, members, parts, started, until

IMPACTS = """schema = "forcemap-study/1"
kind = "impacts"
speeds_mps = [0.1, 0.4]
impacts = {impacts}
block = {block}
[[robots]]
preset = "ur10e-like"
distances_m = [0.55, 0.85]
heights_m = [0.15, 0.45]
thresholds_Nm = [20, 40]
payloads_kg = [0, 5]
[[robots]]
preset = "iiwa7-like-30nm"
distances_m = [0.56, 0.70]
heights_m = [0.15, 0.45]
"""
VALIDITY = """schema = "forcemap-study/1"
kind = "validity"
truths = ["ur10e"]
designs = ["spread", "paper"]
speeds_mps = [0.1, 0.4]
place_sd = [0, 0.022]
state_sd = [0.015]
campaigns = {campaigns}
"""
PLACEMENT = """schema = "forcemap-study/1"
kind = "placement"
maps = ["ur10e", "own.json"]
paths = ["short.csv", "long.csv"]
task = "task.toml"
step_m = 0.1
"""


def study(folder, text, name="study.toml"):
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """A study of 25 blocks of simulated impacts, and its parts from one process."""
    from forcemap.cli.app import run

    home = tmp_path_factory.mktemp("serial")
    file = study(home, IMPACTS.format(impacts=100, block=20))
    assert run(["sweep", str(file), "-o", str(home / "out"), "--json"]) == 0
    return file, parts(home / "out")


@pytest.fixture(scope="module")
def long(tmp_path_factory, full_size):
    """A study whose blocks take some 0.05 s, to be killed in the middle."""
    from forcemap.cli.app import run

    home = tmp_path_factory.mktemp("long")
    file = study(home, IMPACTS.format(impacts=12000 if full_size else 2400, block=300))
    assert run(["sweep", str(file), "-o", str(home / "out"), "--json"]) == 0
    return file, parts(home / "out")


def figures(content):
    """Columns of a part or a summary as numbers, without its remarks."""
    rows = list(csv.DictReader(line for line in content.decode().splitlines() if not line.startswith("#")))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0] if name != "case"}


def test_a_part_is_what_the_lab_simulates_there(serial):
    _, found = serial
    first = next(content for path, content in found.items() if path.name.startswith("000000-"))
    head = json.loads(first.splitlines()[0][2:])
    assert head["index"] == 0
    assert "not a measurement" in first.decode().splitlines()[1]
    at = figures(first)
    robot = virtual_robot("ur10e-like").with_threshold(20).with_payload(0)
    again = simulate_peaks(robot, at["distance_m"], at["height_m"], at["speed_mps"])
    np.testing.assert_array_equal(again, at["peak_force_N"])
    drawn = np.concatenate([figures(content)["distance_m"] for path, content in found.items() if path.name[6] == "-"])
    assert len(set(drawn)) == len(drawn) == 500  # no block draws what another drew


def test_the_summary_is_of_all_parts(serial):
    _, found = serial
    (summary,) = [content for path, content in found.items() if path.name == "summary.csv"]
    blocks = [figures(found[path]) for path in sorted(found) if path.name != "summary.csv"][:5]
    peak, height = (np.concatenate([block[name] for block in blocks]) for name in ("peak_force_N", "height_m"))
    said = figures(summary)
    assert said["rows"].tolist() == [100] * 5
    assert said["mean_peak_force_N"][0] == pytest.approx(peak.mean(), rel=1e-12)
    assert said["highest_peak_force_N"][0] == peak.max()
    assert said["there_height_m"][0] == height[peak.argmax()]
    assert summary.decode().count("not a measurement of any robot") == 5


def test_a_pool_and_parts_of_a_job_array_give_the_same_bytes(serial, tmp_path, ask):
    file, found = serial
    code, answer = ask("sweep", file, "-o", tmp_path / "pool", "--workers", 2)
    assert (code, answer["computed"], answer["left"]) == (0, 25, 0)
    assert answer["processor_s"] > 0
    assert parts(tmp_path / "pool") == found
    for part, computed, left in (("2/3", 8, 17), ("3/3", 8, 9), ("2/3", 0, 9), ("1/3", 9, 0)):
        code, answer = ask("sweep", file, "-o", tmp_path / "parts", "--part", part)
        assert (code, answer["computed"], answer["left"]) == (0, computed, left)
        assert (answer["summary"] is None) == (left > 0)
    assert parts(tmp_path / "parts") == found


def test_what_is_missing_is_listed_and_computed_alone(serial, tmp_path, ask, forcemap):
    file, found = serial
    out = tmp_path / "out"
    ask("sweep", file, "-o", out)
    gone = sorted(out.glob("parts/*/*.csv"))[3:5]
    for path in gone:
        path.unlink()
    code, answer = ask("sweep", file, "-o", out, "--missing")
    assert (code, answer["left"], answer["computed"]) == (1, 2, 0)
    assert answer["missing"] == [
        f"ur10e-like, collision threshold 20 Nm, payload 0 kg, block {number} of 5" for number in (4, 5)
    ]
    code, text, _ = forcemap("sweep", file, "-o", out)
    assert code == 0
    assert "2 of 25 blocks computed, 23 were there, 0 left" in text
    assert "Cost: " in text
    assert parts(out) == found
    assert ask("sweep", file, "-o", out, "--missing")[0] == 0


def test_comments_make_no_other_study_but_figures_do(serial, tmp_path, ask):
    file, found = serial
    text, out = file.read_text(), tmp_path / "out"
    ask("sweep", study(tmp_path, text), "-o", out)
    assert ask("sweep", study(tmp_path, f"# again\n{text}"), "-o", out)[1]["there_before"] == 25
    code, answer = ask("sweep", study(tmp_path, text.replace("0.85", "0.84")), "-o", out)
    assert code == 2
    assert "parts of another sweep (sha256" in answer["error"]["message"]
    about = out / "study.json"
    about.write_text(about.read_text().replace('"forcemap ', '"forcemap 0.'))
    code, answer = ask("sweep", study(tmp_path, text), "-o", out)
    assert code == 2
    assert "software" in answer["error"]["message"]
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    assert "holds other files" in ask("sweep", file, "-o", tmp_path / "full")[1]["error"]["message"]
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["mine.txt"]
    assert parts(out) == found


def test_altered_parts_and_two_results_of_one_block_are_refused(serial, tmp_path, ask):
    file, _ = serial
    out = tmp_path / "out"
    ask("sweep", file, "-o", out)
    first, second = sorted(out.glob("parts/*/*.csv"))[:2]
    content = first.read_bytes()
    first.write_bytes(content[:-9] + bytes([content[-9] ^ 1]) + content[-8:])
    second.unlink()
    code, answer = ask("sweep", file, "-o", out)
    assert code == 2
    assert "not what was written; delete it" in answer["error"]["message"]
    assert answer["error"]["file"] == str(first)
    first.with_name(f"000000-{'0' * 64}.csv").write_bytes(content)
    code, answer = ask("sweep", file, "-o", out)
    assert code == 2
    assert "machines or packages differ" in answer["error"]["message"]


def test_one_block_that_fails_stops_no_other(tmp_path, ask):
    """Places that the second robot does not reach."""
    file = study(tmp_path, IMPACTS.format(impacts=40, block=20).replace("0.56, 0.70", "0.56, 1.50"))
    code, answer = ask("sweep", file, "-o", tmp_path / "out", "--workers", 2)
    assert code == 1
    assert (answer["computed"], answer["left"], answer["summary"]) == (8, 2, None)
    failed = sorted(each["block"] for each in answer["failed"])
    assert failed == ["iiwa7-like-30nm, block 1 of 2", "iiwa7-like-30nm, block 2 of 2"]
    assert "cannot reach" in answer["failed"][0]["reason"]


@pytest.fixture
def placement(tmp_path, example_folders):
    fm.write_map(fm.fit_force_map(fm.read_dataset(example_folders["ur10e"])), tmp_path / "own.json")
    (tmp_path / "short.csv").write_text("x_m,y_m,z_m\n0,0,0.06\n0,0,0\n")
    (tmp_path / "long.csv").write_text("x_m,y_m,z_m\n0,0,0.1\n0,0,0.02\n")
    (tmp_path / "task.toml").write_text(
        'schema = "forcemap-task/1"\n[[segments]]\nname = "path"\nareas = ["back_of_hand"]\nclamping_possible = false\n'
    )
    return study(tmp_path, PLACEMENT)


def test_placements_are_those_of_place_with_all_that_they_rest_on(placement, ask):
    home = placement.parent
    assert ask("sweep", placement, "-o", home / "out")[0] == 0
    content = next(content for path, content in parts(home / "out").items() if path.name.startswith("000003"))
    task = fm.read_task(home / "task.toml")
    places = fm.place_task(
        fm.read_map(home / "own.json"), fm.read_path(home / "long.csv"), task, bound=fm.ToleranceBound(), step=0.1
    )
    at = figures(content)
    np.testing.assert_array_equal(at["cycle_time_s"], places.duration.ravel())
    np.testing.assert_array_equal(at["permitted_share"], places.permitted.ravel())
    words = content.decode()
    for basis in places.bases:
        for finding in (*basis.warnings, *basis.statements):
            assert f"# {fm.sentence(finding)}\n" in words
    summary = figures((home / "out" / "summary.csv").read_bytes())
    best = (summary["there_distance_m"][3], summary["there_height_m"][3], summary["lowest_cycle_time_s"][3])
    assert best == pytest.approx(places.best, abs=0)


def test_a_file_that_a_study_names_is_part_of_it(placement, ask):
    home = placement.parent
    ask("sweep", placement, "-o", home / "out")
    (home / "long.csv").write_text("x_m,y_m,z_m\n0,0,0.1\n0,0,0.03\n")
    assert "another sweep" in ask("sweep", placement, "-o", home / "out")[1]["error"]["message"]


def test_validity_is_what_the_promise_says(tmp_path, ask, full_size):
    """95 % confidence: all campaigns but few are covered where the form fits, by the spread plan also with effects."""
    file = study(tmp_path, VALIDITY.format(campaigns=400 if full_size else 20))
    code, answer = ask("sweep", file, "-o", tmp_path / "out", "--workers", 2 if full_size else 1)
    assert code == 0
    said = figures((tmp_path / "out" / "summary.csv").read_bytes())
    few = 0.0 if full_size else 0.1
    print("\n", said["mean_covered"], said["mean_width_ln"], said["mean_refused"], answer["processor_s"])
    assert min(said["mean_covered"][:2]) >= 0.93 - few
    assert min(said["mean_share_below"]) > 0.95
    assert np.all(said["mean_refused"] <= 0.05)
    assert said["mean_width_ln"][1] > said["mean_width_ln"][0]  # effects of places cost


@pytest.mark.parametrize(
    ("wrong", "column", "expected"),
    [
        (("forcemap-study/1", "forcemap-study/2"), "schema", "expected schema"),
        (('kind = "impacts"', 'kind = "impact"'), "kind", "impacts"),
        (("speeds_mps = [0.1, 0.4]", "speeds_mps = [0.4, 0.1]"), "speeds_mps", "the lower first"),
        (("speeds_mps = [0.1, 0.4]", ""), "speeds_mps", "missing"),
        (("impacts = 100", "impacts = 0"), "impacts", "at least 1"),
        (("impacts = 100", "impacts = true"), "impacts", "at least 1"),
        (("impacts = 100", "impacts = 100\nimpact = 3"), "impact", "nearest"),
        (("[0, 5]", "[0, -5]"), "robots[1].payloads_kg", "at least 0"),
        (("[0, 5]", "[5, 5.0]"), "robots[1].payloads_kg", "twice"),
        (("thresholds_Nm", "threshold_Nm"), "robots[1].threshold_Nm", "nearest"),
        (("ur10e-like", "ur10"), None, "nearest"),
        (("block = 20", "block = 0.5"), "block", "whole number"),
        (("impacts = 100\nblock = 20", "impacts = 900000000\nblock = 1"), None, "make the blocks larger"),
    ],
)
def test_slips_in_a_study_are_refused(tmp_path, ask, wrong, column, expected):
    text = IMPACTS.format(impacts=100, block=20)
    assert wrong[0] in text
    code, answer = ask("sweep", study(tmp_path, text.replace(*wrong)), "-o", tmp_path / "out")
    assert code == 2
    assert answer["error"]["column"] == column
    assert expected in answer["error"]["message"]
    assert not (tmp_path / "out").exists()


def test_a_block_is_not_computed_by_another_version(serial):
    block = read_study(serial[0]).block(3)
    assert compute(block).text
    outcome = compute(replace(block, software="forcemap 0.0.1"))
    assert not outcome.text
    assert "expected forcemap 0.0.1" in outcome.reason


@pytest.mark.parametrize("part", ["0/3", "4/3", "1", "1/0", "a/b", "-1/3", "1/3/5"])
def test_a_part_is_k_of_n(serial, tmp_path, ask, part):
    assert "expected k/n" in ask("sweep", serial[0], "-o", tmp_path / "out", f"--part={part}")[1]["error"]["message"]


def test_a_pool_that_is_killed_leaves_no_process_and_goes_on(long, tmp_path):
    file, found = long
    out, log = tmp_path / "out", tmp_path / "log.txt"
    killed = started("sweep", file, "-o", out, "--workers", 2, log=log)
    until(begun(out, 5), log)
    assert len(members(killed.pid)) >= 3
    killed.kill()
    assert ended(killed) == -signal.SIGKILL  # and nobody else of its group is left
    before = parts(out)
    assert 5 <= len(before) < len(found)
    again = started("sweep", file, "-o", out, "--workers", 2, log=log)
    assert ended(again) == 0, log.read_text()
    assert parts(out) == found


def test_a_worker_of_a_pool_that_is_killed_is_said(long, tmp_path):
    file, found = long
    out, log = tmp_path / "out", tmp_path / "log.txt"
    running = started("sweep", file, "-o", out, "--workers", 2, log=log)
    until(begun(out, 5), log)
    os.kill(max(members(running.pid)), signal.SIGKILL)
    assert ended(running) == 2
    assert "run the same again to continue" in log.read_text()
    assert set(parts(out).items()) < set(found.items())


HASTY = """
import multiprocessing, sys, time
from forcemap.errors import ForcemapError
from forcemap.sweeps.pool import pool, results

sys.setswitchinterval(1e-6)  # so that what the pool does and what awaits it get into each other's way
with pool(2) as executor:
    try:
        for number, _ in enumerate(results(executor, time.sleep, [0.001] * 100_000, ahead=2_000)):
            if number == 20:
                multiprocessing.active_children()[0].kill()
    except ForcemapError as error:
        sys.exit(str(error))
"""


@pytest.mark.parametrize("attempt", range(4))
def test_a_broken_pool_ends_however_its_threads_take_turns(attempt, tmp_path):
    log = tmp_path / "log.txt"
    running = started("-c", HASTY, log=log, command=[sys.executable])
    assert ended(running) == 1
    assert log.read_text().startswith("a process of the pool was ended")


LARGE = """
import multiprocessing, sys, threading, time
from forcemap.errors import ForcemapError
from forcemap.sweeps.pool import pool, results

def kill(process):
    time.sleep(float(sys.argv[1]))
    process.kill()

with pool(2) as executor:
    try:
        for number, (size, result, _) in enumerate(results(executor, bytes, [20_000_000] * 1_000, ahead=2)):
            assert result == bytes(size)
            if number == 2:
                threading.Thread(target=kill, args=multiprocessing.active_children()[:1]).start()
    except ForcemapError as error:
        sys.exit(str(error))
"""


@pytest.mark.parametrize("after", [0.0, 0.01, 0.02, 0.03])
def test_a_process_that_is_killed_while_it_sends_is_said(after, tmp_path):
    """Half a result in a pipe that the others hold open: nobody must wait for the rest."""
    log = tmp_path / "log.txt"
    running = started("-c", LARGE, after, log=log, command=[sys.executable])
    assert ended(running) == 1
    assert log.read_text().startswith("a process of the pool was ended")


def test_a_cluster_gives_the_same_bytes_whoever_is_killed(long, tmp_path):
    """One of two workers in the middle; then the scheduler, and the sweep goes on here."""
    pytest.importorskip("distributed")
    file, found = long
    out, log = tmp_path / "out", tmp_path / "log.txt"
    with dask_cluster(tmp_path) as (address, scheduler, workers):
        running = started("sweep", file, "-o", out, "--dask", address, "--json", log=log)
        until(begun(out, len(found) // 4), log)
        workers[0].kill()
        assert len(parts(out)) < len(found)
        assert ended(running) == 0, log.read_text()
        assert json.loads(log.read_text())["computed"] == len(found) - 1  # but for the summary
        assert parts(out) == found
        other = tmp_path / "other"
        running = started("sweep", file, "-o", other, "--dask", address, log=log)
        until(begun(other, len(found) // 4), log)
        scheduler.kill()
        assert ended(running) == 2
        assert log.read_text().splitlines()[-1].startswith("error: the cluster is gone")
    assert set(parts(other).items()) < set(found.items())
    again = started("sweep", file, "-o", other, "--part", "1/1", log=log)
    assert ended(again) == 0
    assert parts(other) == found


@pytest.mark.parametrize(
    "address",
    [
        "tcp://10.0.0.7:8786",
        "tcp://0.0.0.0:8786",
        "tcp://[::]:8786",
        "tcp://127.0.0.1.example.org:8786",
        "tcp://127.0.0.1@10.0.0.7:8786",
        "tcp://localhost:8786",
        "127.0.0.1:8786",
        "inproc://127.0.0.1/1/2",
        "ws://127.0.0.1:8786",
        "ucx://127.0.0.1:8786",
        "",
        "tls://10.0.0.7:8786",
    ],
)
def test_no_cluster_that_others_can_write_to(serial, tmp_path, ask, address):
    """Nothing is connected to: nobody listens there."""
    code, answer = ask("sweep", serial[0], "-o", tmp_path / "out", f"--dask={address}")
    assert code == 2
    assert answer["error"]["column"] == "dask"
    assert "expected" in answer["error"]["message"]


def test_addresses_of_this_machine_and_over_tls_pass(tmp_path):
    require_safe("tcp://127.0.0.1:8786", TlsFiles())
    require_safe("tcp://[::1]:8786", TlsFiles())
    files = [tmp_path / name for name in ("ca.pem", "cert.pem", "key.pem")]
    for file in files:
        file.touch()
    require_safe("tls://10.0.0.7:8786", TlsFiles(*map(str, files)))
    with pytest.raises(fm.InputError, match="found no file: not named"):
        require_safe("tls://10.0.0.7:8786", TlsFiles(str(files[0])))
    with pytest.raises(fm.InputError, match="tls://HOST"):
        require_safe("tcp://127.0.0.1:8786", TlsFiles(*map(str, files)))


def test_nobody_listens_there(serial, tmp_path, ask):
    pytest.importorskip("distributed")
    code, answer = ask("sweep", serial[0], "-o", tmp_path / "out", "--dask", "tcp://127.0.0.1:9")
    assert code == 2
    assert "no scheduler answers at tcp://127.0.0.1:9" in answer["error"]["message"]


@pytest.fixture
def certificates(tmp_path):
    """A certificate of its own authority, and its key."""
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("needs openssl, to make a certificate")
    key, certificate = tmp_path / "key.pem", tmp_path / "cert.pem"
    made = [openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    made += ["-keyout", key, "-out", certificate, "-days", "2", "-subj", "/CN=sweep"]
    subprocess.run(made, check=True, capture_output=True)
    return ["--tls-ca-file", certificate, "--tls-cert", certificate, "--tls-key", key]


def test_a_cluster_over_tls(serial, tmp_path, ask, certificates):
    pytest.importorskip("distributed")
    file, found = serial
    _, authority, _, certificate, _, key = certificates
    tls = ["--tls-ca", authority, "--tls-cert", certificate, "--tls-key", key]
    with dask_cluster(tmp_path, workers=1, tls=certificates) as (address, _, _):
        code, answer = ask("sweep", file, "-o", tmp_path / "out", "--dask", address, *tls)
        assert (code, answer["computed"]) == (0, 25)
        assert (
            "expected --tls-ca" in ask("sweep", file, "-o", tmp_path / "none", "--dask", address)[1]["error"]["message"]
        )
    assert parts(tmp_path / "out") == found
