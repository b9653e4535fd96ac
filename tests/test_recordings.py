"""Every layout reads back to the same numbers; every broken file is refused with its row, its column and a remedy."""

from __future__ import annotations

import io
import itertools
from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from numpy.testing import assert_array_equal

from forcemap.errors import InputError, RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.layout import find_layout
from forcemap.recordings.numbers import checked_numbers, plain_numbers
from forcemap.recordings.read import read_recording, read_recordings
from forcemap.recordings.recording import Recording
from forcemap.recordings.units import ForceUnit, TimeUnit

TIME = np.arange(40) / 2000
FORCE = np.round(150 * np.sin(np.arange(40) / 12) ** 2 - 1.5, 3)
PLAIN = ColumnMap(time=1, force=2)


def table(*columns, delimiter=",", decimal=".", end="\n", formats=None):
    formats = formats or ["%.4f"] * len(columns)
    rows = (
        delimiter.join(f % value for f, value in zip(formats, row, strict=True)) for row in zip(*columns, strict=True)
    )
    text = end.join(rows) + end
    return text if decimal == "." else text.replace(".", ",")


@pytest.fixture
def write(tmp_path):
    def write(content, name="curve.csv"):
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


def refused(path, columns=None):
    with pytest.raises(RecordingError) as caught:
        read_recordings(path, columns=columns)
    assert caught.value.file == str(path)
    return caught.value


class TestLayouts:
    @pytest.mark.parametrize("end", ["\n", "\r\n"])
    @pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
    @pytest.mark.parametrize(
        ("delimiter", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")], ids=repr
    )
    @pytest.mark.parametrize("header", ["", "time_s{d}force_N\n", "Device 7\nRate{d}2000\n\nTime{d}Force\n[s]{d}[N]\n"])
    def test_delimiters_decimal_signs_and_headers(self, write, end, mark, delimiter, decimal, header):
        text = header.format(d=delimiter).replace("\n", end) + table(
            TIME, FORCE, delimiter=delimiter, decimal=decimal, end=end
        )
        recording = read_recording(write(mark + text.encode()), columns=PLAIN)
        assert_array_equal(recording.time, TIME)
        assert_array_equal(recording.force, FORCE)
        assert recording.notes == ()
        assert recording.regular

    @pytest.mark.parametrize(
        ("names", "time_unit", "per_second", "force_unit", "per_newton"),
        [
            ("time_s;force_N", "s", 1, "N", 1),
            ("Time [ms];Force [N]", "ms", 1e3, "N", 1),
            ("Zeit (µs);Kraft (kN)", "us", 1e6, "kN", 1e-3),
            ("t / s;F / kN", "s", 1, "kN", 1e-3),
        ],
    )
    @pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
    def test_units(self, write, names, time_unit, per_second, force_unit, per_newton, encoding):
        text = f"{names}\n" + table(TIME * per_second, FORCE * per_newton, delimiter=";", formats=["%.4f", "%.6f"])
        path = write(text.encode(encoding))
        time, force = names.split(";")
        stated = {"time": time, "force": force, "time_unit": time_unit, "force_unit": force_unit}
        for columns in (None, stated):
            recording = read_recording(path, columns=columns)
            np.testing.assert_allclose(recording.time, TIME, rtol=1e-15)
            np.testing.assert_allclose(recording.force, FORCE, rtol=1e-15)

    def test_counts_and_sign(self, write):
        counts = np.round(FORCE / 0.05).astype(int) + 2048
        path = write("t,raw\n" + table(TIME, counts, formats=["%.4f", "%d"]))
        columns = ColumnMap(time="t", force="raw", force_unit=ForceUnit.COUNTS, newtons_per_count=0.05, zero_count=2048)
        assert_array_equal(read_recording(path, columns=columns).force, (counts - 2048.0) * 0.05)
        pressed = columns.to_table() | {"sign": -1}
        assert_array_equal(read_recording(path, columns=pressed).force, -(counts - 2048.0) * 0.05)

    def test_three_components(self, write):
        path = write(
            "t,x,y,z,note\n" + "\n".join(f"{t},{f},{-f},0.5,a" for t, f in zip(TIME, FORCE, strict=True)) + "\n"
        )
        recording = read_recording(path, columns={"time": "T", "force": ["x", "y", "z"], "direction": [-3, 0, 4]})
        assert_array_equal(recording.force, np.stack([FORCE, -FORCE, np.full(40, 0.5)], axis=1))
        assert recording.direction == (-0.6, 0.0, 0.8)
        assert read_recording(path, columns={"time": 1, "force": [2, 3, 4]}).direction is None

    def test_a_rate_in_place_of_time(self, write):
        for text in (table(FORCE), table(FORCE, decimal=",")):
            columns = {"sampling_rate_Hz": 2000, "force": 1, "decimal": "," if "," in text else "."}
            recording = read_recording(write(text), columns=columns)
            np.testing.assert_allclose(recording.time, TIME, rtol=1e-15)
            assert_array_equal(recording.force, FORCE)

    def test_wide(self, write):
        path = write("time_ms;Run 1;Run 2\n" + table(TIME * 1e3, FORCE, 2 * FORCE, delimiter=";"))
        for runs in ("all", ["Run 1", "Run 2"], [2, 3]):
            one, two = read_recordings(path, columns={"time": "time_ms", "time_unit": "ms", "runs": runs})
            assert (one.curve, two.curve) == ("Run 1", "Run 2")
            assert two.name == f"{path}#Run 2"
            assert_array_equal(two.force, 2 * FORCE)
            assert_array_equal(one.time, TIME)
        with pytest.raises(RecordingError, match=r"found 2 curves \('Run 1', 'Run 2'\), expected one"):
            read_recording(path, columns={"time": 1, "time_unit": "ms", "runs": "all"})

    def test_wide_without_names(self, write):
        path = write(table(TIME, FORCE, FORCE + 1))
        assert [each.curve for each in read_recordings(path, columns={"time": 1, "runs": "all"})] == [
            "column 2",
            "column 3",
        ]

    def test_long_and_interleaved(self, write):
        rows = [
            f"{curve},{t},{f * factor}"
            for t, f in zip(TIME, FORCE, strict=True)
            for curve, factor in (("b", 1), ("a", 3))
        ]
        path = write("curve,t_s,f_N\n" + "\n".join(rows) + "\n")
        one, two = read_recordings(path, columns={"curve": "curve", "time": "t_s", "force": "f_N"})
        assert (one.curve, two.curve) == ("b", "a")
        assert_array_equal(one.time, TIME)
        assert_array_equal(two.force, FORCE * 3)

    def test_numbers_as_names_of_curves_stay_as_written(self, write):
        path = write("v,t,f\n" + "".join(f"{v},{t},{t}\n" for v in ("1.0", "1.50") for t in TIME))
        assert [r.curve for r in read_recordings(path, columns={"curve": "v", "time": "t", "force": "f"})] == [
            "1.0",
            "1.50",
        ]

    def test_other_columns_are_left_alone(self, write):
        path = write("".join(f"{t:.4f},,x;y,{f},00000000\r\n" for t, f in zip(TIME, FORCE, strict=True)))
        assert_array_equal(read_recording(path, columns={"time": 1, "force": 4, "delimiter": "comma"}).force, FORCE)

    def test_metadata_and_checksum(self, write):
        path = write("PFMD 7\nSpring: 75 N/mm; °C\ntime_s,force_N\n" + table(TIME, FORCE))
        recording = read_recording(path, device=Device(range=500))
        assert recording.metadata == {"header 1": "PFMD 7", "header 2": "Spring: 75 N/mm; °C"}
        assert len(recording.sha256) == 64
        assert recording.device.range == 500
        assert (recording.file, recording.curve) == (str(path), "")

    def test_header_lines_may_be_stated(self, write):
        path = write("0.1,7\nx,y\n" + table(TIME, FORCE))
        assert read_recording(path, columns={"time": 1, "force": 2, "header_lines": 2}).samples == 40
        assert refused(path, {"time": 1, "force": 2, "header_lines": 1}).row == 2

    def test_exponents_and_blanks(self, write):
        path = write("".join(f" {t:.6E} , {f:+.3e}\n" for t, f in zip(TIME, FORCE, strict=True)))
        np.testing.assert_allclose(read_recording(path, columns=PLAIN).force, FORCE, rtol=1e-3)

    def test_a_file_of_many_chunks(self, write):
        n = 300_000
        path = write(table(np.arange(n) * 1e-4, np.arange(n) % 977, formats=["%.4f", "%.9f"]))
        recording = read_recording(path, columns=PLAIN)
        assert_array_equal(recording.force, np.arange(n) % 977)
        broken = path.read_bytes().splitlines(keepends=True)
        broken[250_000] = b"25.0,\n"
        assert refused(write(b"".join(broken)), PLAIN).row == 250_001


class TestNotes:
    def test_a_cut_off_last_line_is_left_out_and_said(self, write):
        whole = table(TIME, FORCE)
        for cut in ("0.02", "0.0200,", "0.0200,1e", "0.0200,-", "0.00,1.5"):
            recording = read_recording(write(whole + cut), columns=PLAIN)
            assert recording.notes == ("the last line, row 41, is cut off and left out",)
            assert_array_equal(recording.force, FORCE)
        assert read_recording(write(whole + "0.0200,1"), columns=PLAIN).samples == 41
        assert read_recording(write(whole[:-1]), columns=PLAIN).notes == ()
        assert refused(write(whole + "0.02,1,5"), PLAIN).row == 41

    def test_a_cut_off_last_line_of_a_long_file(self, write):
        rows = "".join(f"{t},{f},3.1\n" for t, f in zip(TIME, FORCE, strict=True))
        columns = {"time": "t", "force": "f", "curve": "c"}
        for last in ("1.0,2.0,3.1", "1.0,2.0,4"):  # half a name may be the name of another curve
            recording = read_recording(write("t,f,c\n" + rows + last), columns=columns)
            assert recording.samples == 40
            assert recording.notes == ("the last line, row 42, is cut off and left out",)

    def test_gaps_and_irregular_sampling(self, write):
        time = TIME + 0.01 * (np.arange(40) > 20)
        recording = read_recording(write(table(time, FORCE)), columns=PLAIN)
        irregular, gaps = recording.notes
        assert irregular == "sampled irregularly: 0.0005 s to 0.0105 s apart, median 0.0005 s"
        assert gaps == "gaps of over 5 median intervals: 0.0105 s after 0.01 s (row 21)"
        assert not recording.regular
        assert recording.largest_gap == pytest.approx(0.0105)
        assert recording.sampling_rate == pytest.approx(2000)

    def test_blank_lines_at_the_end_are_no_matter(self, write):
        for end in ("\n", "\n\n  \n", "\r\n\t\r\n", "   "):
            recording = read_recording(write(table(TIME, FORCE) + end), columns=PLAIN)
            assert recording.samples == 40
            assert recording.notes == ()


def broken(row, line, *, count=40):
    lines = table(TIME[:count], FORCE[:count]).splitlines()
    lines[row - 1] = line
    return "\n".join(lines) + "\n"


BROKEN = [
    # (content, row, column, what the message says)
    (broken(7, "0.0030,"), 7, "2", "found an empty cell"),
    (broken(7, "0.0030,NaN"), 7, "2", "found 'NaN'"),
    (broken(7, "0.0030,-inf"), 7, "2", "found '-inf'"),
    (broken(7, "0.0030,abc"), 7, "2", "found 'abc'"),
    (broken(7, "0.0030,1_000"), 7, "2", "found '1_000'"),
    (broken(7, "0.0030,0x1F"), 7, "2", "found '0x1F'"),
    (broken(7, "0.0030, "), 7, "2", "found an empty cell"),
    (broken(7, ",1.5"), 7, "1", "found an empty cell"),
    (broken(7, "0.0030,1.2.3"), 7, "2", "decimal sign"),
    (broken(7, "0.0030,1-2"), 7, "2", "found '1-2'"),
    (broken(7, "0.0030,١٢"), 7, "2", "expected a number"),
    (broken(7, "0.0030,²").encode("latin-1"), 7, "2", "expected a number"),
    (broken(7, "0.0030,1.5\r0.0031,2.0"), 7, None, "found 3 cells"),
    (broken(7, '"0.0030","1.5'), 7, None, "quotes that do not fit"),
    (broken(7, '"0.0030"1,"1.5"'), 7, None, "quotes that do not fit"),
    (broken(1, "nan,1.5"), 1, "1", "before the first line of numbers"),
    (broken(1, "0.00x0,1.5"), 1, "1", "before the first line of numbers"),
    (broken(7, "0.0030"), 7, None, "found 1 cell, expected 2"),
    (broken(7, "0.0030,1,5"), 7, None, "found 3 cells, expected 2"),
    (broken(7, ""), 7, None, "blank line"),
    (broken(7, "0.0025,1.5"), 7, "1", "found time 0.0025 s after 0.0025 s in row 6"),
    (broken(7, "0.0010,1.5"), 7, "1", "found time 0.001 s after 0.0025 s in row 6"),
    (broken(7, "0.0030,2000000"), 7, "2", "found a force of 2e+06 N"),
    (broken(7, "0.0030,1e999"), 7, "2", "found a force of inf N"),
    (broken(40, "3e9,1"), 40, "1", "found a time of 3e+09 s"),
    (broken(7, "0.0030;1.5"), 7, None, "found 1 cell"),
    (broken(7, "0.0030\0,1.5"), 7, None, "NUL"),
    (broken(1, "0.0000,1.5", count=1), 1, None, "1 sample"),
    (table(FORCE, TIME), 21, "1", "if this is the force"),
    (table(TIME * 1e4, FORCE), None, "1", "time_unit"),
    (table(TIME * 1e-4, FORCE, formats=["%.10f", "%.3f"]), None, "1", "time_unit"),
    (table(TIME, FORCE, delimiter="|"), None, None, "found one column"),
    (table(TIME, FORCE, delimiter=";") + "0.03;1,5\n", 41, "2", "decimal sign"),
    (table(TIME, FORCE, delimiter=";", decimal=",") + "0.03;1,5\n", 41, "1", "decimal sign"),
    (table(TIME, FORCE, delimiter=";", decimal=",") + "0,03;1.000,5\n", 41, "2", "decimal sign"),
    ("".join(f"{t};{f}\n" for t, f in ((0, "998"), (1, "1.002"), (2, "1.004"))), 2, None, "group thousands"),
    ("".join(f"{t};{f}\n" for t, f in ((0, "998"), (1, "1,002"), (2, "1,004"))), 2, None, "group thousands"),
    ("0,5,12,3\n1,0,13,2\n1,5,14,7\n", 1, None, "may separate columns or be decimal signs"),
    ("time,force\n0,5,12,3\n1,0,13,2\n", 2, None, "found 4 cells below 2 names"),
    ("a,b\n" + broken(1, "nan,1.5"), 2, "1", "before the first line of numbers"),
    ("", None, None, "empty"),
    ("\ufeff\n\n", None, None, "empty"),
    ("x,y\n", None, None, "no line with numbers"),
    (b"0.1,2\x00\x00\n0.2,3\n", 1, None, "NUL"),
    (b"PK\x03\x04\x00\x00 xl/workbook.xml", None, None, "save the sheet as CSV UTF-8"),
    (b"PK\x03\x04\x00\x00", None, None, "unpack it"),
    ("0.1,2\n0.2,3\n".encode("utf-16-le") + b"\x00\xdc\n\x00", 3, None, "UTF-16"),
    (b"1" * 600_000, 1, None, "without a line end"),
    (broken(7, "0.0030," + "x" * 600_000), 7, None, "in one line"),
]


@pytest.mark.parametrize("case", BROKEN, ids=lambda case: case[3][:30])
def test_broken_files(write, case):
    content, row, column, message = case
    error = refused(write(content), PLAIN)
    assert message in error.message, error
    assert (error.row, error.column) == (row, column), error


class TestColumns:
    def test_names_in_any_case_if_that_is_unique(self, write):
        path = write(" Time , FORCE,force\n" + table(TIME, FORCE, FORCE + 1))
        assert read_recording(path, columns={"time": "time", "force": "force"}).force[0] == FORCE[0] + 1
        error = refused(path, {"time": "time", "force": "Force"})
        assert error.message == "found 2 columns of that name, expected one; give its number"

    @pytest.mark.parametrize("stamp", ["10:15:00.{:03d}", "2026-11-02 10:15:00.{:03d}"])
    def test_a_time_of_day_is_named(self, write, stamp):
        lines = "".join(f"{stamp.format(i)};{5 + i % 3}\n" for i in range(200))
        error = refused(write("clock;force\n" + lines), None)
        assert error.message.startswith(f"found the time of day '{stamp.format(0)}', expected seconds; state sampling")
        assert error.row == 2

    def test_a_time_of_day_above_the_columns_is_none_of_theirs(self, write):
        lines = "".join(f"{i};{5 + i % 3};21.5\n" for i in range(200))
        error = refused(write("Uhrzeit;10:21:00\nZeit [ms];Kraft [N];Temperatur [C]\n" + lines), None)
        assert error.message.startswith("found the columns 'Zeit [ms]', 'Kraft [N]', 'Temperatur [C]'")

    def test_a_name_that_is_missing_lists_those_found(self, write):
        error = refused(write("t,f\n" + table(TIME, FORCE)), {"time": "t", "force": "F1"})
        assert error.column == "F1"
        assert error.message.startswith("no column is named ")
        assert error.message.endswith("; found 't', 'f'; columns by number fit files that name them otherwise")
        assert "no names of columns" in refused(write(table(TIME, FORCE)), {"time": "t", "force": "f"}).message

    def test_a_number_beyond_the_width(self, write):
        error = refused(write(table(TIME, FORCE)), {"time": 1, "force": 22})
        assert error.message == "found 2 columns, expected a column 22; is the delimiter right?"
        assert error.column == "22"

    def test_a_header_that_contradicts_the_column_map(self, write):
        path = write("time_ms,force_kN\n" + table(TIME, FORCE))
        error = refused(path, {"time": "time_ms", "force": "force_kN", "force_unit": "kN"})
        assert error.message == (
            "the file says 'ms', the column map time_unit = 's' (s is the default, too); "
            "state time_unit = 'ms', or correct the file"
        )
        assert refused(path, {"time": 1, "time_unit": "ms", "force": 2}).column == "force_kN"
        lines = write("time,force\nms,N\n" + table(TIME, FORCE))
        assert refused(lines, {"time": "time", "force": "force"}).column == "ms"

    @pytest.mark.parametrize(
        "names", ["time,force", "time_ms,force", "t_s,force_N,x", "time_s,time_ms", "time_s,F1_N", "", "x\ny"]
    )
    def test_without_a_column_map_nothing_is_guessed(self, write, names):
        width = 3 if names.count(",") == 2 else 2
        error = refused(write(f"{names}\n" * bool(names) + table(*[TIME, FORCE, FORCE][:width])))
        assert "column map" in error.message
        if "," in names:
            assert all(repr(name) in error.message for name in names.split(","))

    def test_neither_time_nor_rate(self, write):
        assert "neither time nor sampling_rate_Hz" in refused(write(table(TIME, FORCE)), {"force": 2}).message


class TestColumnMap:
    @pytest.mark.parametrize(
        "entries",
        [
            {"time": "t", "force": 2},
            {"sampling_rate_Hz": 2000.0, "force": ["x", "y", 4], "direction": [0.0, -1.0, 0.0], "sign": -1},
            {"time": 1, "time_unit": "ms", "runs": "all", "delimiter": "tab", "decimal": ",", "header_lines": 0},
            {"time": 1, "curve": "c", "force": 3, "force_unit": "counts", "newtons_per_count": 0.1, "zero_count": 4.0},
        ],
    )
    def test_tables_round_trip(self, entries):
        columns = ColumnMap.from_table(entries)
        assert columns.to_table() == entries
        assert repr(ColumnMap.from_table(columns.to_table())) == repr(columns)

    def test_units_are_words(self):
        columns = ColumnMap.from_table({"time": 1, "force": 2, "time_unit": "us"})
        assert columns.time_unit is TimeUnit.MICROSECONDS

    @pytest.mark.parametrize(
        ("entries", "column"),
        [
            ({"time": 1, "forces": 2}, "forces"),
            ({"time": 1}, "force"),
            ({"time": True, "force": 2}, "time"),
            ({"time": 0, "force": 2}, "time"),
            ({"time": 1.5, "force": 2}, "time"),
            ({"time": "", "force": 2}, "time"),
            ({"time": 1, "force": [2, 3]}, "force"),
            ({"time": 1, "force": {}}, "force"),
            ({"time": 1, "force": 2, "runs": [3]}, "runs"),
            ({"time": 1, "runs": "every"}, "runs"),
            ({"time": 1, "runs": 2}, "runs"),
            ({"time": 1, "force": 2, "sampling_rate_Hz": 1000}, "sampling_rate_Hz"),
            ({"force": 2, "sampling_rate_Hz": 0}, "sampling_rate_Hz"),
            ({"force": 2, "sampling_rate_Hz": "1000"}, "sampling_rate_Hz"),
            ({"force": 2, "sampling_rate_Hz": 1000, "time_unit": "ms"}, "time_unit"),
            ({"time": 1, "force": 2, "time_unit": "min"}, "time_unit"),
            ({"time": 1, "force": 2, "force_unit": "counts"}, "newtons_per_count"),
            ({"time": 1, "force": 2, "newtons_per_count": 2.0}, "newtons_per_count"),
            ({"time": 1, "force": 2, "force_unit": "counts", "newtons_per_count": -1}, "newtons_per_count"),
            ({"time": 1, "force": 2, "zero_count": 2.0}, "zero_count"),
            ({"time": 1, "force": 2, "direction": [1, 0, 0]}, "direction"),
            ({"time": 1, "force": [2, 3, 4], "direction": [0, 0, 0]}, "direction"),
            ({"time": 1, "force": [2, 3, 4], "direction": [1, 0]}, "direction"),
            ({"time": 1, "force": 2, "sign": 0}, "sign"),
            ({"time": 1, "force": 2, "sign": True}, "sign"),
            ({"time": 1, "force": 2, "delimiter": "|"}, "delimiter"),
            ({"time": 1, "force": 2, "delimiter": ["comma"]}, "delimiter"),
            ({"time": 1, "force": 2, "decimal": "'"}, "decimal"),
            ({"time": 1, "force": 2, "delimiter": "comma", "decimal": ","}, "decimal"),
            ({"time": 1, "force": 2, "header_lines": -1}, "header_lines"),
            ({"time": 1, "force": 2, "header_lines": True}, "header_lines"),
            ({"time": 1, "runs": [2], "curve": 3}, "curve"),
            ({"time": 1, "force": 1}, "time, force, runs, curve"),
        ],
    )
    def test_what_cannot_be_is_refused(self, entries, column):
        with pytest.raises(InputError) as caught:
            ColumnMap.from_table(entries)
        assert caught.value.column == column

    def test_an_unknown_entry_names_the_nearest(self):
        with pytest.raises(InputError, match="sampling_rate_Hz"):
            ColumnMap.from_table({"sampling_rate": 1000, "force": 1})


class TestRecording:
    def test_from_arrays(self):
        recording = Recording(time=[0, 1, 2], force=[1, 5, 2], device=Device(range=500))
        assert (recording.duration, recording.sampling_rate, recording.samples) == (2, 1, 3)
        assert recording.name == ""
        assert not recording.force.flags.writeable

    @pytest.mark.parametrize(
        ("entries", "message"),
        [
            ({"force": FORCE[:5]}, "expected \\(n,\\)"),
            ({"time": TIME[:1], "force": FORCE[:1]}, "1 samples"),
            ({"time": np.zeros((40, 1))}, "shape"),
            ({"force": np.zeros((40, 2))}, "shape"),
            ({"time": np.zeros(40)}, "samples 2 and 1"),
            ({"time": TIME[::-1]}, "strictly increasing"),
            ({"force": np.full(40, np.nan)}, "finite"),
            ({"time": np.append(TIME[:-1], np.inf)}, "finite"),
            ({"force": ["1"] * 40}, "numbers"),
            ({"force": FORCE + 1j}, "numbers"),
            ({"force": np.ma.masked_less(FORCE, 0)}, "masked"),
            ({"direction": (1, 0, 0)}, "one component"),
            ({"force": np.ones((40, 3)), "direction": (0, 0, 0)}, "direction"),
            ({"force": np.ones((40, 3)), "direction": (0, 1)}, "direction"),
            ({"force": np.ones((40, 3)), "direction": (0, 1, np.nan)}, "direction"),
        ],
    )
    def test_what_cannot_be_is_refused(self, entries, message):
        with pytest.raises(RecordingError, match=message):
            Recording(**({"time": TIME, "force": FORCE} | entries))


class TestDevice:
    def test_calibration(self):
        assert not Device().calibration_stated
        assert not Device().expired("2026-05-01")
        yearly = Device(calibrated="2026-05-01")
        assert yearly.calibration_stated
        assert not yearly.expired("2027-05-01")
        assert yearly.expired("2027-05-02")
        stated = Device(calibrated="2026-05-01", calibration_expires="2026-11-01")
        assert not stated.expired("2026-11-01")
        assert stated.expired("2026-11-02")
        assert Device(calibrated="2024-02-29").expired("2025-03-01")
        assert Device(calibrated=str(date(2026, 5, 1))) == yearly

    @pytest.mark.parametrize("text", ["May 2026", "2026-13-01", "20260501", "2026-5-1", "2026-02-30", "２０２６-05-01"])
    def test_dates(self, text):
        for entries in ({"calibrated": text}, {"calibration_expires": text}):
            with pytest.raises(InputError, match="YYYY-MM-DD"):
                Device(**entries)
        with pytest.raises(InputError, match="YYYY-MM-DD"):
            Device().expired(text)

    def test_no_calibration_expires_before_it_was_made(self):
        with pytest.raises(InputError, match="no date before"):
            Device(calibrated="2026-05-01", calibration_expires="2026-04-30")


CELL = st.one_of(
    st.decimals(-2000, 2000, places=3).map(str),
    st.floats(-1e5, 1e5).map(repr),
    st.integers(-(10**20), 10**20).map(str),
    st.text("0123456789+-.,eE \t\r;xn_", max_size=7),
)


@settings(max_examples=400)
@given(
    st.lists(st.lists(CELL, min_size=1, max_size=3), min_size=1, max_size=6),
    st.sampled_from([",", ";", "\t", ""]),
    st.sampled_from(".,"),
    st.sampled_from([(0,), (0, 1), (1, 0), (0, 2)]),
)
@example([["1", " ", "2"], ["1", "2", "3"]], ",", ".", (0, 1))  # to numpy a cell of blanks is -1
@example([["-"]], ",", ".", (0,))  # to numpy a sign alone is a whole number, 0
@example([["-.", "1.5"]], ",", ".", (0, 1))
@example([["1.2", "1"], ["5.4.2", "12"]], ",", ".", (0, 1))
@example([["9007199254740993.0"], ["99999999999999999999.0"]], ",", ".", (0,))
def test_the_fast_reading_accepts_nothing_that_the_careful_one_refuses(rows, delimiter, decimal, numbers):
    """And where both read, they read the same."""
    if decimal == delimiter:
        return
    layout = find_layout(b"0.5,1\n0.6,2\n", PLAIN)
    width = len(rows[0]) if delimiter else 1
    if max(numbers) >= width:
        return
    selection = replace(layout.selection, time=None, forces=tuple((number,) for number in numbers))
    layout = replace(layout, selection=selection, delimiter=delimiter, decimal=decimal, width=width)
    chunk = "".join(delimiter.join(row) + "\n" for row in rows).encode()
    fast = plain_numbers(chunk, layout)
    if fast is not None:
        careful, _ = checked_numbers(chunk, layout, 1)
        assert_array_equal(fast, careful)


def test_no_cell_of_up_to_five_characters_is_read_that_is_no_number():
    """Every cell there is of digits, points, signs, exponents and blanks, alone and below another of its kind."""
    layout = find_layout(b"0.5\n0.6\n", ColumnMap(sampling_rate=1000, force=1))
    read = 0
    for length in range(6):
        for characters in itertools.product("01.-+e ", repeat=length):
            cell = "".join(characters)
            for chunk in (f"{cell}\n", f"1.1\n{cell}\n"):
                fast = plain_numbers(chunk.encode(), layout)
                if fast is not None:
                    assert fast[-1, 0] == checked_numbers(chunk.encode(), layout, 1)[0][-1, 0]
                    read += 1
    assert read > 1000


@given(st.lists(st.tuples(st.integers(0, 10**7), st.integers(0, 6)), min_size=1, max_size=30), st.integers(0, 6))
def test_plain_numbers_are_read_fast_and_exactly(figures, places):
    layout = find_layout(b"0.5,1\n0.6,2\n", PLAIN)
    for texts in (
        [f"{-a / 10**places:.{places}f},{a / 10**places:.{places}f}" for a, _ in figures],
        [f"{a / 10**b:.{b}f},{a:E}" for a, b in figures],
    ):
        read = plain_numbers(("\n".join(texts) + "\n").encode(), layout)
        assert read is not None
        assert_array_equal(read, [[float(cell) for cell in text.split(",")] for text in texts])


class TestTdms:
    @pytest.fixture
    def tdms(self, write):
        nptdms = pytest.importorskip("nptdms", reason="the extra tdms is not installed")

        def tdms(*channels):
            stream = io.BytesIO()
            with nptdms.TdmsWriter(stream) as writer:
                writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
            return write(stream.getvalue(), "curve.TDMS")

        return tdms

    def test_a_time_channel(self, tdms):
        path = tdms(
            ("Impact", "Time", TIME * 1e3, {"unit_string": "ms"}), ("Impact", "F/z", -FORCE, {"unit_string": "N"})
        )
        columns = {"time": "Impact/Time", "time_unit": "ms", "force": "impact/f/z", "sign": -1}
        recording = read_recording(path, columns=columns)
        np.testing.assert_allclose(recording.time, TIME, rtol=1e-15)
        assert_array_equal(recording.force, FORCE)
        assert "'Impact/F/z'" in refused(path).message
        assert refused(path, columns | {"time_unit": "s"}).column == "Impact/Time"
        assert refused(path, columns | {"force": "Impact/F"}).column == "Impact/F"
        assert refused(path, columns | {"force": 2}).message.startswith("channels have names")

    def test_waveforms(self, tdms):
        wave = {"wf_increment": 0.0005, "wf_start_offset": 0.25}
        path = tdms(("g", "x", FORCE, wave), ("g", "y", -FORCE, wave), ("g", "z", 0 * FORCE, wave))
        recording = read_recording(path, columns={"force": ["g/x", "g/y", "g/z"], "direction": [1, 0, 0]})
        np.testing.assert_allclose(recording.time, TIME + 0.25, rtol=1e-15)
        assert recording.force.shape == (40, 3)
        assert [each.curve for each in read_recordings(path, columns={"runs": "all"})] == ["g/x", "g/y", "g/z"]
        assert "2000 Hz" in refused(path, {"force": "g/x", "sampling_rate_Hz": 1000}).message

    def test_a_rate_and_counts(self, tdms):
        path = tdms(("g", "x", np.arange(40, dtype=np.int16)))
        assert "wf_increment" in refused(path, {"force": "g/x"}).message
        columns = {"force": "g/x", "sampling_rate_Hz": 1000, "force_unit": "counts", "newtons_per_count": 0.5}
        assert_array_equal(read_recording(path, columns=columns).force, np.arange(40) / 2)

    def test_what_cannot_be_is_refused(self, tdms):
        path = tdms(
            ("g", "t", TIME), ("g", "short", FORCE[:-1]), ("g", "nan", FORCE * np.nan), ("g", "text", ["a", "b"])
        )
        for force, column in (("g/short", "g/t"), ("g/nan", "g/nan"), ("g/text", "g/text")):
            assert refused(path, {"time": "g/t", "force": force}).column == column
        assert refused(path, {"time": "g/nan", "force": "g/t"}).row == 1

    def test_a_cut_off_file_is_refused(self, tdms, write):
        path = tdms(("g", "t", TIME), ("g", "f", FORCE))
        content = path.read_bytes()
        for length in (0, 3, 30, 200, len(content) - 3):
            refused(write(content[:length], "cut.tdms"), {"time": "g/t", "force": "g/f"})


class TestFiles:
    def test_what_is_no_file(self, tmp_path):
        with pytest.raises(InputError, match="no such file"):
            read_recordings(tmp_path / "none.csv", columns=PLAIN)
        with pytest.raises(InputError, match="this is no file"):
            read_recordings(tmp_path, columns=PLAIN)
        with pytest.raises(InputError, match="expected the name of a file"):
            read_recordings("a\0b", columns=PLAIN)

    def test_files_over_500_megabytes_are_refused(self, tmp_path):
        with (tmp_path / "large.csv").open("wb") as stream:
            stream.truncate(500_000_001)  # a hole: it takes no room
        with pytest.raises(RecordingError, match="found 500 MB, expected at most 500 MB"):
            read_recordings(tmp_path / "large.csv", columns=PLAIN)


@pytest.mark.real_data
class TestRealRecordings:
    def test_clamped_runs_of_a_robot(self, real_data):
        """No header, 40 columns, some no numbers; irregular sampling at about 90 Hz."""
        columns = {"time": 1, "time_unit": "ms", "force": [20, 21, 22], "direction": [-1, 0, 0]}
        paths = sorted((real_data / "ur_clamp").glob("*.csv"))
        assert len(paths) == 6
        for path in paths:
            recording = read_recording(path, columns=columns)
            expected = np.genfromtxt(path, delimiter=",", usecols=(0, 19, 20, 21))
            np.testing.assert_allclose(recording.time, expected[:, 0] / 1e3, rtol=1e-15)
            assert_array_equal(recording.force, expected[:, 1:])
            assert 80 < recording.sampling_rate < 95
            assert not recording.regular
            assert recording.notes[0].startswith("sampled irregularly")

    def test_curves_of_crash_tests(self, real_data):
        """Long format with gaps; curves named by text such as 3.1a."""
        columns = {"time": "time_ms", "time_unit": "ms", "force": "force_N", "curve": "speed_m_s_label"}
        expected = {
            "Impact-H3_Legs-Robot133Kg.csv": {"1.0": 1626, "1.5": 1639, "3.1a": 836, "3.1b": 1159, "3.1c": 1561},
            "Impact-Q3-Chest-Robot60Kg.csv": {"1.0": 1125, "1.5": 1482, "3.0": 1318, "3.1": 1409},
        }
        for name, curves in expected.items():
            recordings = read_recordings(real_data / "dummy_impact" / name, columns=columns)
            assert {each.curve: each.samples for each in recordings} == curves
            assert all(any("gaps" in note for note in each.notes) for each in recordings)
            assert "'speed_m_s_label'" in refused(real_data / "dummy_impact" / name).message


HEADERS = {
    "lvm": "LabVIEW Measurement\n***End_of_Header***\nDelta_X\t{interval}\n***End_of_Header***\nForce\n",
    "interval": "Device,K1\nSampling interval (ms): {ms}\nForce\n",
    "rate": "Device,K1\nSample rate [Hz];{rate}\nForce\n",
    "kilohertz": "Sampling frequency = {khz} kHz\nForce\n",
    "german": "Abtastrate: {rate} Hz\nForce\n",
}


@pytest.mark.parametrize("kind", HEADERS)
@pytest.mark.parametrize(("rate", "stated"), [(1000.0, 1000.0), (1000.0, 10000.0), (2000.0, 500.0)])
def test_a_rate_that_the_header_contradicts_is_refused(tmp_path, kind, rate, stated):
    """Ten times too fast, a force that is held for two seconds looks like one of 0.2 s."""
    head = HEADERS[kind].format(interval=1 / rate, ms=1000 / rate, rate=f"{rate:g}", khz=rate / 1000)
    path = tmp_path / "run.lvm"
    path.write_text(head + "".join(f"{force:.3f}\n" for force in PULSE))
    columns = {"force": "Force", "sampling_rate_Hz": stated}
    if stated == rate:
        assert read_recording(path, columns=columns).sampling_rate == pytest.approx(rate)
    else:
        with pytest.raises(RecordingError, match=f"sampling_rate_Hz = {stated:g}; correct the one that is wrong"):
            read_recording(path, columns=columns)


PULSE = 0.3 * np.sin(np.arange(600) * 1.7) + 150 * np.exp(-(((np.arange(600) - 150) / 12) ** 2))


@pytest.mark.parametrize("names", ["Fx [N],Fy [N],Fz [N]", "force_x_N,force_y_N,force_z_N", "Kraft X,Kraft Y,Kraft Z"])
@pytest.mark.parametrize(("across", "refused"), [(0.0, False), (0.1, False), (0.7, True)])
def test_one_component_of_a_force_is_not_read_alone_where_others_move_as_much(tmp_path, names, across, refused):
    noise = np.random.default_rng(1).normal(0, 0.2, (600, 3))
    forces = PULSE[:, None] * [across, 0, 1] + noise
    path = tmp_path / "run.csv"
    rows = (",".join([f"{i / 1000:.3f}", *(f"{x:.3f}" for x in row)]) for i, row in enumerate(forces))
    path.write_text(f"time_s,{names}\n" + "\n".join(rows) + "\n")
    one, every = names.split(",")[2], names.split(",")
    whole = read_recording(path, columns={"time": "time_s", "force": every})
    assert whole.force.shape == (600, 3)
    if refused:
        with pytest.raises(RecordingError, match="name the three columns as force"):
            read_recording(path, columns={"time": "time_s", "force": one})
    else:
        assert read_recording(path, columns={"time": "time_s", "force": one}).force.shape == (600,)


def test_a_component_that_never_changes_is_noted(tmp_path):
    path = tmp_path / "run.csv"
    for still in (True, False):
        forces = np.column_stack([np.zeros(600), np.zeros(600), PULSE]) + np.random.default_rng(1).normal(
            0, 1, (600, 3)
        )
        forces[:, 0] = np.where(still, 0.12, forces[:, 0])
        rows = (",".join([f"{i / 1000:.3f}", *(f"{x:.3f}" for x in row)]) for i, row in enumerate(forces))
        path.write_text("time_s,Fx,Fy,Fz\n" + "\n".join(rows) + "\n")
        found = read_recording(path, columns={"time": "time_s", "force": ["Fx", "Fy", "Fz"]})
        assert ("Fx is 0.12 in all rows: does its channel read?" in found.notes) is still


def test_a_component_that_stands_still_is_not_read_alone_beside_others_that_move(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time_s,Fx,Fz\n" + "".join(f"{i / 1000:.3f},{x:.3f},0.5\n" for i, x in enumerate(PULSE)))
    with pytest.raises(RecordingError, match="where Fz, which is read alone, moves by 0; expected all components"):
        read_recording(path, columns={"time": "time_s", "force": "Fz"})


def test_an_interval_of_a_second_in_the_header_says_nothing(tmp_path):
    """LabVIEW writes it where it knows none."""
    path = tmp_path / "run.lvm"
    path.write_text(HEADERS["lvm"].format(interval="1.000000") + "".join(f"{force:.3f}\n" for force in PULSE))
    assert read_recording(path, columns={"force": "Force", "sampling_rate_Hz": 1000.0}).sampling_rate == pytest.approx(
        1000
    )
