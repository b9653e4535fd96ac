"""Texts of files that end in a terminal, and TOML that no campaign needs: shown or refused, never acted on."""

from __future__ import annotations

import time

import numpy as np
import pytest

import forcemap as fm
from forcemap.csv_table import csv_text, read_table
from pulses import TOML, pulse, save, write_campaign

STEERING = "\x1b[2J\x1b]0;title\x07\x9b31m\u202e\x08"


def steers(text):
    """True if a terminal would act on it."""
    return any(not sign.isprintable() for sign in text.replace("\n", ""))


@pytest.mark.parametrize("content", [
    f"time_s,force_N\n0.000,{STEERING}\n0.001,2\n",
    f"time_s,force{STEERING}_N\n0.000,1\n0.001,2\n",
    f"{STEERING}\nerror: imitated\n",
])  # fmt: skip
def test_what_a_recording_holds(tmp_path, content, forcemap):
    path = tmp_path / "run.csv"
    path.write_text(content, encoding="utf-8")
    code, out, err = forcemap("inspect", path)
    assert code == 2
    assert len(err.splitlines()) == 1
    assert not steers(out + err)


def test_names_of_files(tmp_path, forcemap):
    folder = write_campaign(tmp_path / "campaign")
    save(folder / "recordings" / f"a{STEERING}\nerror: imitated.csv", *pulse(rate=1000.0))
    for command in (("collect", folder), ("check", folder, "--area", "back_of_hand")):
        _, out, err = forcemap(*command)
        assert not steers(out + err)
        assert not any(line.startswith("error: imitated") for line in (out + err).splitlines())


def test_errors_say_no_more_than_a_person_reads():
    error = fm.InputError("x" * 100_000, column="y" * 100_000)
    assert len(str(error)) < 2500


@pytest.mark.parametrize(
    "added",
    [
        f"[device]\nrange_N = {'9' * 30}\n",
        f"[device]\nrange_N = {'9' * 400}\n",
        f"[device]\nrange_N = {'9' * 5000}\n",
        "[device]\nrange_N = 1_000_000_000_000_000_000_000\n",
        f"note = {'[' * 30}{']' * 30}\n",
        f"note = {'[' * 100_000}\n",
        f"{'a.' * 1000}b = 1\n",
        f"{'a.' * 50_000}b = 1\n",
        "x = '" + "y" * 300_000 + "'\n",
    ],
    ids=lambda text: text[:20],
)
def test_toml_beyond_any_need(tmp_path, added):
    for reader, name, start in (
        (fm.read_conditions, "campaign.toml", 'schema = "forcemap-campaign/1"\n'),
        (fm.read_task, "task.toml", 'schema = "forcemap-task/1"\n'),
    ):
        path = tmp_path / name
        path.write_text(start + added)
        begin = time.process_time()
        with pytest.raises(fm.InputError) as caught:
            reader(path)
        assert time.process_time() - begin < 1
        assert str(path) in str(caught.value)
        assert len(str(caught.value)) < 2500


def test_a_campaign_file_is_far_within(tmp_path):
    path = tmp_path / "campaign.toml"
    path.write_text(TOML + f'[tool]\nname = "{"a" * 3000}"\n')
    assert fm.read_conditions(path).device.range == 500


@pytest.mark.parametrize(
    "cell", ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "'=x", "''", "'", "-", "=", "-3.5", "+1", "a=b", "'a"]
)
def test_no_cell_runs_as_a_formula(cell):
    text = csv_text({"name": [cell], "other": ["1"]})
    assert read_table(text.encode(), "table.csv", what="row").columns["name"] == [cell]
    written = text.splitlines()[1].strip('"')
    try:
        float(cell)
    except ValueError:
        assert not written.startswith(("=", "+", "-", "@"))
    else:
        assert written.startswith(cell)


@pytest.mark.parametrize("columns", [{"force": "r7"}, {"runs": "all"}, {"runs": ["r1", "r19999"]}])
def test_twenty_thousand_columns(tmp_path, columns):
    """In time that the width of the table bounds: what is asked for, and a look at the header."""
    path = tmp_path / "wide.csv"
    names = ",".join(["t_s", *(f"r{i}" for i in range(20_000))])
    ones = ",1" * 20_000
    path.write_text(names + "\n" + "".join(f"{i / 1000:.3f}{ones}\n" for i in range(20)))
    begin = time.process_time()
    recordings = fm.read_recordings(path, columns={"time": "t_s"} | columns)
    assert time.process_time() - begin < 5
    assert len(recordings) == (20_000 if columns.get("runs") == "all" else len(columns.get("runs", "1")))
    assert np.all(recordings[-1].force == 1)


def test_a_table_of_twenty_thousand_columns(tmp_path):
    names = ["distance_m", "height_m", "speed_mps", "peak_force_N", *(f"x{i}" for i in range(20_000))]
    rows = [[0.5 + 0.1 * (k % 3), 0.2 + 0.1 * (k // 3 % 3), 0.1 + 0.1 * (k // 9), 100 + k] for k in range(27)]
    path = tmp_path / "impacts.csv"
    path.write_text(",".join(names) + "\n" + "".join(",".join(map(str, row)) + ",1" * 20_000 + "\n" for row in rows))
    begin = time.process_time()
    assert len(fm.read_dataset(path)) == 27
    assert time.process_time() - begin < 5
