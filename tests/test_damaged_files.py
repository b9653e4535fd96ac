"""A damaged file is read or refused; nothing else ever happens, and what is read is what was measured.

Not every damage shows: a digit that became another digit is a number like any other. What is held here: no error but
ours, and numbers only where the file has them in the columns that are read.
"""

from __future__ import annotations

import io
import itertools
import math
import re
import tracemalloc

import numpy as np
import pytest

from damages import (
    DAMAGES,
    a_piece_lost,
    a_piece_twice,
    beheaded,
    binary,
    random_bytes,
    shuffled_bytes,
    swapped_columns,
    truncated,
)
from forcemap.errors import ForcemapError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.read import read_recordings

ROWS = 300


def lines(rng, delimiter, decimal, end, header):
    time_ms = np.arange(ROWS) * 0.5
    force = 120 * np.exp(-(((time_ms - 60) / 15) ** 2)) + rng.normal(0, 0.4, ROWS)
    rows = [f"{t:.4f};{f:.3f};{k}" for k, (t, f) in enumerate(zip(time_ms, force, strict=True))]
    text = header + "".join(row + end for row in rows)
    return text.replace(".", decimal).replace(";", delimiter).encode()


HEADERS = ["", "time_ms;force_N;n\n", "Device 5\nRate;2000\n\ntime_ms;force_N;n\nms;N;-\n", "µs °\xff\n"]
MAPS = [
    {"time": 1, "time_unit": "ms", "force": 2},
    {"time": "time_ms", "time_unit": "ms", "force": "force_N"},
    {"time": 1, "time_unit": "ms", "runs": "all"},
    {"time": 1, "time_unit": "ms", "force": 2, "curve": 3},
    {"sampling_rate_Hz": 2000, "force": [1, 2, 3]},
    {"time": 1, "time_unit": "ms", "force": 2, "delimiter": "semicolon", "decimal": ".", "header_lines": 1},
    None,
]


def read_or_refuse(path, columns):
    """The recordings, or None; anything but an error of ours fails."""
    try:
        recordings = read_recordings(path, columns=columns)
    except ForcemapError as error:
        recordings, message = None, str(error)
    else:
        message = str(path)
    assert message.startswith(str(path))
    assert "\n" not in message
    assert len(message) < 1500
    return recordings


def holds(content, recording):
    """True if times and forces are those of the last lines, in one of the ways to read them; names may be swapped."""
    rows = content.decode("latin-1").split("\n")
    if recording.notes and (below := re.search(r"from row ([0-9]+) on", recording.notes[-1])):
        rows = rows[: int(below[1]) - 1]
    rows = [row for row in rows if row.strip()]
    if recording.notes and "cut off" in recording.notes[-1]:
        rows.pop()
    for delimiter, decimal, order in itertools.product([",", ";", "\t", None], ".,", (1, -1)):
        try:
            cells = [row.replace("\r", "").split(delimiter)[:2][::order] for row in rows[-recording.samples :]]
            found = np.array([[float(cell.replace(decimal, ".")) for cell in row] for row in cells])
        except ValueError:
            continue
        read = np.stack([recording.time * 1000, recording.force], axis=1)
        if found.shape == read.shape and np.allclose(found, read, rtol=1e-14, atol=0):
            return True
    return False


def test_damaged_text(tmp_path, full_size):
    rng = np.random.default_rng(20260501)
    path = tmp_path / "damaged.csv"
    read = refused = 0
    for number in range(5000 if full_size else 500):
        delimiter, decimal = [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")][rng.integers(5)]
        content = lines(rng, delimiter, decimal, ["\n", "\r\n"][rng.integers(2)], HEADERS[rng.integers(len(HEADERS))])
        content = DAMAGES[number % len(DAMAGES)](rng, content)
        path.write_bytes(content)
        columns = MAPS[rng.integers(len(MAPS))]
        recordings = read_or_refuse(path, columns)
        if recordings is None:
            refused += 1
            continue
        read += 1
        for recording in recordings:
            assert np.isfinite(recording.force).all()
            assert (np.diff(recording.time) > 0).all()
            assert recording.samples <= content.count(b"\n") + 1
            if len(recordings) == 1 and recording.force.ndim == 1 and columns is not MAPS[3]:
                assert holds(content, recording), path
    assert read > 20
    assert refused > 100


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_swapped_columns_are_refused(tmp_path, delimiter):
    """A force that rises and falls is no time: it does not increase."""
    rng = np.random.default_rng(7)
    path = tmp_path / "swapped.csv"
    for _ in range(20):
        path.write_bytes(swapped_columns(rng, lines(rng, delimiter, ".", "\n", "")))
        assert read_or_refuse(path, ColumnMap(time=1, force=2)) is None


def test_one_line_of_any_length(tmp_path, full_size):
    """Without a line end nothing is read: the error comes before cells are cut out and fill the memory."""
    size = 200_000_000 if full_size else 20_000_000
    path = tmp_path / "line.csv"
    head = b"time_ms,force_N\n0,1\n0.5,1\n"
    for start, cell in ((b"", b"0.5,"), (b"", b"1"), (b"", b";"), (b"", b"1 "), (head, b"1,")):
        path.write_bytes(start + cell * (size // len(cell)))
        for columns in (MAPS[0], None):
            tracemalloc.start()
            try:
                assert read_or_refuse(path, columns) is None
                most = tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()
            assert most < 2.5 * size  # the file itself, and once more without what surrounds it


def test_damaged_tdms(tmp_path, full_size):
    nptdms = pytest.importorskip("nptdms", reason="the extra tdms is not installed")
    rng = np.random.default_rng(11)
    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        for part in range(3):
            values = np.arange(200.0) + 200 * part
            force = nptdms.ChannelObject("g", "f", np.sin(values), {"wf_increment": 0.001, "unit_string": "N"})
            writer.write_segment([nptdms.ChannelObject("g", "t", values / 1000), force])
    whole = stream.getvalue()
    path = tmp_path / "damaged.tdms"
    path.write_bytes(whole)
    assert len(read_or_refuse(path, {"force": "g/f"})) == 1
    for _ in range(1500 if full_size else 60):
        damage = [truncated, beheaded, shuffled_bytes, random_bytes, a_piece_lost, a_piece_twice, binary][
            rng.integers(7)
        ]
        data = bytearray(damage(rng, whole))
        if data and rng.random() < 0.5:  # where the lengths stand
            for at in rng.integers(0, min(len(data), 300), 3):
                data[at] = [0, 1, 255, 127][rng.integers(4)]
        path.write_bytes(data)
        recordings = read_or_refuse(path, [{"force": "g/f"}, {"time": "g/t", "force": "g/f"}][rng.integers(2)])
        assert recordings is None or all(math.isfinite(each.duration) for each in recordings)
