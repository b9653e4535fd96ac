"""Layouts of files as devices and programs write them: each gives the right numbers, or says what to do."""

from __future__ import annotations

import re
from importlib import resources

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.device import Device
from forcemap.recordings.read import read_recording, read_recordings
from forcemap.recordings.units import ForceUnit, TimeUnit, plain_unit, remarked_units, stated_unit
from layouts import FORCE, LAYOUTS, SECONDS

WAVE = {"wf_increment": 0.001}


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_read_rightly_or_refused_with_a_remedy(tmp_path, layout):
    path = tmp_path / layout.file
    path.write_bytes(layout.content)
    if layout.refused:
        with pytest.raises(RecordingError) as caught:
            read_recordings(path, columns=layout.columns)
        assert layout.refused in str(caught.value)
        return
    recording = read_recording(path, columns=layout.columns)
    assert_allclose(recording.time - recording.time[0], SECONDS, rtol=0, atol=1e-6)
    assert_allclose(recording.force, FORCE, rtol=0, atol=layout.tolerance + 1e-12)
    assert recording.notes == layout.notes
    assert recording.sampling_rate == pytest.approx(1000, rel=1e-3)


def test_there_are_enough():
    assert sum(not layout.refused for layout in LAYOUTS) >= 40
    assert len({layout.name for layout in LAYOUTS}) == len(LAYOUTS)


@pytest.mark.parametrize("layout", [each for each in LAYOUTS if not each.refused], ids=lambda layout: layout.name)
def test_no_other_unit_is_ever_taken_for_the_one_stated(tmp_path, layout):
    """Wherever a layout states a unit, a column map that states another one is refused."""
    if layout.columns is None:
        return
    columns = ColumnMap.from_table(layout.columns)
    text = layout.content.decode("utf-16" if layout.content[:2] in (b"\xff\xfe",) else "latin-1").split("\n", 40)
    states_force = any(word in line for line in text[:40] for word in ("[N]", "(N)", "Newton", "kN", "(kN)", "\tN"))
    if states_force and columns.force_unit is not ForceUnit.COUNTS:
        other = "kN" if columns.force_unit is ForceUnit.NEWTONS else "N"
        path = tmp_path / layout.file
        path.write_bytes(layout.content)
        with pytest.raises(RecordingError, match="the file says"):
            read_recordings(path, columns=layout.columns | {"force_unit": other})


class TestOverrange:
    """What a device writes in place of a reading above its range stands for its range: the peak is cut off there."""

    @pytest.mark.parametrize("sign", ["OL", "O.L.", "+OVER", "∞", "Overflow", "OVLD", ">500", "9.9E+37"])
    def test_counts_as_the_range(self, tmp_path, sign):
        cells = [sign if f > 120 else f"{f:.3f}" for f in FORCE]
        path = tmp_path / "run.csv"
        path.write_text("time_s,force_N\n" + "".join(f"{t:.3f},{c}\n" for t, c in zip(SECONDS, cells, strict=True)))
        recording = read_recording(path, device=Device(range=140.0))
        assert_array_equal(recording.force, np.where(FORCE > 120, 140.0, FORCE))
        assert_array_equal(recording.beyond_range, FORCE > 120)

    def test_without_a_stated_range_counts_as_the_largest_reading(self, tmp_path):
        path = tmp_path / "run.csv"
        path.write_text("time_s,force_N\n0.000,1.5\n0.001,130.0\n0.002,OL\n0.003,2.5\n")
        recording = read_recording(path)
        assert_array_equal(recording.force, [1.5, 130.0, 130.0, 2.5])
        assert_array_equal(recording.beyond_range, [False, False, True, False])

    def test_at_the_end_is_no_remark(self, tmp_path):
        path = tmp_path / "run.csv"
        path.write_text("force_N\n" + "".join(f"{force:.3f}\n" for force in FORCE) + "OL\n" * 9)
        columns = {"sampling_rate_Hz": 1000, "force": "force_N"}
        recording = read_recording(path, columns=columns, device=Device(range=140.0))
        assert_array_equal(recording.beyond_range, [False] * len(FORCE) + [True] * 9)

    def test_of_the_other_sign(self, tmp_path):
        path = tmp_path / "run.csv"
        path.write_text("time_s,force_N\n0.000,-1.5\n0.001,-OL\n0.002,-2.5\n")
        pressed = {"time": "time_s", "force": "force_N", "sign": -1}
        assert_array_equal(read_recording(path, columns=pressed, device=Device(range=50)).force, [1.5, 50.0, 2.5])

    @pytest.mark.parametrize("cell", ["1e38", "nan", "inf", "----", "9.9E+36", "old"])
    def test_nothing_else_does(self, tmp_path, cell):
        path = tmp_path / "run.csv"
        path.write_text(f"time_s,force_N\n0.000,1.5\n0.001,{cell}\n0.002,2.5\n")
        with pytest.raises(RecordingError):
            read_recording(path, device=Device(range=140.0))


class TestUnits:
    @pytest.mark.parametrize(
        ("name", "unit"),
        [
            ("Zeit [ms]", TimeUnit.MILLISECONDS),
            ("Time (SEC)", TimeUnit.SECONDS),
            ("t / µs", TimeUnit.MICROSECONDS),
            ("Time, nanoseconds", TimeUnit.NANOSECONDS),
            ("force_kN", ForceUnit.KILONEWTONS),
            ("Kraft in Newton", ForceUnit.NEWTONS),
            ("F [N] (filtered)", ForceUnit.NEWTONS),
            ("raw [Digits]", ForceUnit.COUNTS),
            ("Force [N] [kN]", "N and kN"),
            ("Force [Ncm]", "Ncm"),
            ("Force [kg·m/s²]", "kg·m/s²"),
            ("Force N/mm", "N/mm"),
            ("Force %FS", "%FS"),
            ("Force (foo)", "foo"),
            ("ForceKgf", "ForceKgf"),
            ("Kraft in kilopond", "Kraft in kilopond"),
            ("Force kiloN", "Force kiloN"),
            ("F [hN]", "hN"),
            ("Force*10 [N]", "Force*10 [N]"),
            ("Force [x10N]", "Force [x10N]"),
            ("Force [10 N]", "Force [10 N]"),
            ("Voltage", "Voltage"),
            ("Force Decade N", ForceUnit.NEWTONS),
            *((name, None) for name in ("Force redundant", "Force abundance", "standard", "Kraft_Gedankt")),
            ("F(t)", None),
            ("Fx (TCP)", None),
            ("F_t", None),
            ("F_s", None),
            ("A1", None),
            ("d890-h140-v100-r1", None),
        ],
    )
    def test_stated(self, name, unit):
        assert stated_unit(name) == unit
        assert type(stated_unit(name)) is type(unit)

    @pytest.mark.parametrize("prefix", ["kilo", "Deka", "deca", "hekto", "milli", "k", "da", "m"])
    @pytest.mark.parametrize("name", ["Force {}-newton", "Kraft in {} Newton", "F_{}_N", "Force {} N"])
    def test_a_power_of_ten_before_a_unit_makes_it_another_one(self, tmp_path, prefix, name):
        """ "Deka-Newton" was read as newtons: 45 N where 450 N were measured."""
        name = name.format(prefix)
        assert stated_unit(name)
        assert not isinstance(stated_unit(name), (ForceUnit, TimeUnit))
        path = tmp_path / "run.csv"
        path.write_text(f"time_s,{name}\n" + "".join(f"{i / 1000:.3f},{force:.3f}\n" for i, force in enumerate(FORCE)))
        with pytest.raises(RecordingError, match="unit"):
            read_recording(path, columns={"time": 1, "force": 2}, device=Device(range=500.0))

    @pytest.mark.parametrize("unit", [*ForceUnit, *TimeUnit])
    def test_a_symbol_in_other_capitals_is_another_unit_wherever_it_stands(self, unit):
        kind = type(unit)
        for written in {unit.value.upper(), unit.value.lower(), unit.value.title()} - {unit.value, "N", "n", "S", "s"}:
            if written in ("counts", "Counts", "COUNTS"):
                continue
            for name in (f"F_{written}_filtered", f"Force {written} filtered", f"{written}"):
                assert not isinstance(stated_unit(name, of_time=kind is TimeUnit), kind), name
                assert stated_unit(name, of_time=kind is TimeUnit), name
            for line in (f"Force unit: {written}", f"Units: {written}"):
                said = remarked_units(line, of_time=kind is TimeUnit)
                assert said, line
                assert not any(isinstance(each, kind) for each in said), line

    @pytest.mark.parametrize(
        "name",
        [
            *("Force in tens of N", "Force [N] in deca", "Kilo Force [N]", "Time in milli s", "hundert Newton"),
            *("Kraft in Zehner N", "Kraft thousand N", "Zehntel-Newton", "dizaines de N", "10er N", "10^1 N", "0,1 N"),
            *("Force [N] 10x", "Kraft [N], Faktor 10", "Force (N) tenfold", "Force per 10 [N]", "ForcekN", "dekaN"),
        ],
    )
    def test_a_power_of_ten_anywhere_in_a_name_is_no_plain_unit(self, name):
        assert stated_unit(name) == name

    @pytest.mark.parametrize(
        ("lines", "said"),
        [
            ("time_s,ForceKgf\n", "ForceKgf"),
            *((f"time_s,Force{unit.name.title()}\n", "Force") for unit in ForceUnit if unit is not ForceUnit.COUNTS),
            ("time_s,Force*10 [N]\n", "10"),
            ("time_s,Voltage\n", "Voltage"),
            ("Dimension: daN\ntime_s,Kraft\n", "daN"),
            ("Force unit: 10 N\ntime_s,Kraft\n", "10 N"),
            ("time_s,Kraft\n[s],[daN]\n", "daN"),
        ],
    )
    def test_a_file_that_states_another_is_refused(self, tmp_path, lines, said):
        path = tmp_path / "run.csv"
        path.write_text(lines + "".join(f"{t:.3f},{f:.3f}\n" for t, f in zip(SECONDS, FORCE, strict=True)))
        with pytest.raises(RecordingError, match="the file says '.*" + re.escape(said)):
            read_recording(path, columns={"time": 1, "force": 2})

    @pytest.mark.parametrize("said", ["x10 N", "all values in this column x10 N", "reading must be multiplied by 10 N"])
    def test_a_factor_above_the_names_is_refused_however_long_its_words(self, tmp_path, said):
        path = tmp_path / "run.csv"
        rows = "".join(f"{t:.3f},{f:.3f}\n" for t, f in zip(SECONDS, FORCE, strict=True))
        path.write_text(f"-,{said}\nt,F\n{rows}")
        with pytest.raises(RecordingError, match="expected N or kN"):
            read_recording(path, columns={"time": 1, "force": 2, "time_unit": "s", "force_unit": "N"})

    @pytest.mark.parametrize(
        ("name", "unit"), [("ForceNewton", "N"), ("Force [KN]", "kN"), ("ForceKilonewton", "kN"), ("Force [hN]", None)]
    )
    def test_a_unit_that_is_spelled_otherwise_is_said_to_be(self, tmp_path, name, unit):
        path = tmp_path / "run.csv"
        path.write_text(f"time_s,{name}\n" + "".join(f"{t:.3f},{f:.3f}\n" for t, f in zip(SECONDS, FORCE, strict=True)))
        for stated in ("N", "kN"):
            with pytest.raises(RecordingError) as refused:
                read_recording(path, columns={"time": 1, "force": 2, "force_unit": stated})
            way = f"if it is in {stated}, write so there: 'Force [{stated}]'"
            assert (way in str(refused.value)) == (stated == unit or name == "ForceKilonewton")

    def test_hours_and_minutes_are_no_axes(self):
        assert stated_unit("time_h", of_time=True) == "h"
        assert stated_unit("F_h") is None

    @pytest.mark.parametrize("name", ["Force [min]", "lag_ms", "time", "Time of flight (s)", "t", "Kraft", "count_N"])
    def test_not_plain(self, name):
        assert plain_unit(name, TimeUnit) is None


class TestWhatARowHolds:
    ROWS = tuple(f"{t:.3f},{f:.3f}" for t, f in zip(SECONDS, FORCE, strict=True))
    COLUMNS = ColumnMap(time="time_s", time_unit=TimeUnit.SECONDS, force="force_N")

    def test_a_comment_may_be_missing(self, tmp_path):
        path = tmp_path / "run.csv"
        path.write_text("time_s,force_N,Comment\n" + "\n".join((self.ROWS[0] + ",start", *self.ROWS[1:])) + "\n")
        assert_allclose(read_recording(path, columns=self.COLUMNS).force, FORCE, atol=0.0005)

    def test_numbers_in_a_column_of_comments_are_refused(self, tmp_path):
        path = tmp_path / "run.csv"
        path.write_text("time_s,force_N,Comment\n" + "".join(f"{row},{n}\n" for n, row in enumerate(self.ROWS)))
        with pytest.raises(RecordingError, match="found numbers in the column 'Comment'") as refused:
            read_recording(path, columns=self.COLUMNS)
        assert refused.value.row == 2

    def test_an_unknown_header_is_refused_with_its_row_and_columns(self, tmp_path):
        path = tmp_path / "run.csv"
        path.write_text("Device X\nserial 12\nZeit,Kraft\n" + "\n".join(self.ROWS) + "\n")
        with pytest.raises(RecordingError, match="'Zeit', 'Kraft'") as refused:
            read_recording(path)
        assert refused.value.row == 3


class TestTdmsOfOtherPrograms:
    """Files that LabVIEW, SignalExpress and DAQmx wrote, as the package that reads them brings along."""

    @pytest.fixture
    def files(self):
        nptdms = pytest.importorskip("nptdms", reason="the extra tdms is not installed")
        return nptdms, resources.files(nptdms) / "test" / "data"

    def test_labview_big_endian(self, files):
        nptdms, folder = files
        path = folder / "big_endian.tdms"
        recording = read_recording(path, columns={"force": "Measured Data/Amplitude sweep"})
        assert (recording.samples, recording.sampling_rate) == (3500, pytest.approx(1000))
        expected = nptdms.TdmsFile.read(path)["Measured Data"]["Amplitude sweep"][:]
        assert_array_equal(recording.force, expected)
        assert recording.force.max() > 0.9

    def test_daqmx_scaled_volts(self, files):
        """Raw counts, a linear scale and the unit volts: read with a factor, never as newtons."""
        nptdms, folder = files
        path = folder / "raw1.tdms"
        columns = {"force": "Layer Data/First  Channel", "force_unit": "counts", "newtons_per_count": 75.0}
        recording = read_recording(path, columns=columns)
        assert recording.sampling_rate == pytest.approx(50_000)
        volts = nptdms.TdmsFile.read(path)["Layer Data"]["First  Channel"][:]
        assert_allclose(recording.force, 75.0 * volts, rtol=1e-15)
        with pytest.raises(RecordingError, match="the file says 'Volts'"):
            read_recordings(path, columns={"force": "Layer Data/First  Channel"})

    def test_signal_express_all_and_decimated_data(self, files):
        """Three groups of the same channel: the decimated ones have lost their peaks."""
        _, folder = files
        path = folder / "Digital_Input.tdms"
        group = "07/09/2012 06:58:23 PM - Digital Input - "
        line = "/Dev1_port3_line7 - line 0"
        recording = read_recording(path, columns={"force": f"{group}All Data{line}"})
        assert (recording.samples, recording.sampling_rate) == (20_000, pytest.approx(2000))
        for level in (1, 2):
            with pytest.raises(RecordingError, match="decimated"):
                read_recordings(path, columns={"force": f"{group}Decimated Data_Level{level}{line}"})

    def test_labview_waveform(self, files):
        _, folder = files
        recording = read_recording(folder / "raw_timestamps.tdms", columns={"force": "Untitled/Untitled"})
        assert (recording.samples, recording.sampling_rate) == (128, pytest.approx(1000))

    def test_by_content_whatever_the_name(self, files, tmp_path):
        _, folder = files
        path = tmp_path / "run 1.dat"
        path.write_bytes((folder / "raw_timestamps.tdms").read_bytes())
        assert read_recording(path, columns={"force": "Untitled/Untitled"}).samples == 128


class TestTdmsProperties:
    @pytest.fixture
    def tdms(self, tmp_path):
        nptdms = pytest.importorskip("nptdms", reason="the extra tdms is not installed")

        def tdms(*channels, group=None):
            path = tmp_path / "run.tdms"
            with nptdms.TdmsWriter(str(path)) as writer:
                objects = [nptdms.GroupObject("g", group or {})]
                writer.write_segment([*objects, *(nptdms.ChannelObject("g", *each) for each in channels)])
            return path

        return tdms

    @pytest.mark.parametrize(
        ("properties", "message"),
        [
            ({"unit_string": "lbf"}, "the file says 'lbf'"),
            ({"unit_string": "foo"}, "the file says 'foo'"),
            ({"NI_UnitDescription": "Kilonewtons"}, "the file says 'kN'"),
            ({"wf_xunit_string": "ms"}, "the file says 'ms'"),
            ({"wf_xunit_string": "Hz"}, "the file says 'Hz'"),
            ({"NI_Scaling_Status": "unscaled"}, "not scaled, and states no scale"),
            ({"NI_Number_Of_Scales": 2**31 - 1}, "NI_Number_Of_Scales"),
            (
                {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.0},
                "NI_Scale\\[0\\]_Linear_Slope = 0.0",
            ),
            (
                {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": np.nan},
                "NI_Scale\\[0\\]_Linear_Slope = nan",
            ),
            ({"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Magic"}, "Unsupported scale type: Magic"),
            ({"DecimationLevel": 1}, "decimated"),
        ],
    )
    def test_refused(self, tdms, properties, message, capfd):
        with pytest.raises(RecordingError, match=message):
            read_recordings(tdms(("f", FORCE, WAVE | properties)), columns={"force": "g/f"})
        assert capfd.readouterr().err == ""

    def test_texts_in_latin_1_are_no_damage(self, tdms):
        """Older programs wrote the code page of their computer."""
        path = tdms(("f", FORCE, WAVE | {"Messger#t": "W#gezelle", "unit_string": "N"}))
        path.write_bytes(path.read_bytes().replace(b"Messger#t", "Messgerät".encode("latin-1")))
        assert_array_equal(read_recording(path, columns={"force": "g/f"}).force, FORCE)

    def test_a_linear_scale_is_applied(self, tdms):
        scale = {
            "NI_Number_Of_Scales": 1,
            "NI_Scaling_Status": "unscaled",
            "NI_Scale[0]_Scale_Type": "Linear",
            "NI_Scale[0]_Linear_Slope": 0.05,
            "NI_Scale[0]_Linear_Y_Intercept": -2.0,
            "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
            "unit_string": "N",
        }
        counts = np.round(FORCE * 20).astype(np.int16)
        recording = read_recording(tdms(("f", counts, WAVE | scale)), columns={"force": "g/f"})
        assert_allclose(recording.force, counts * 0.05 - 2.0, rtol=1e-12)

    def test_time_stamps(self, tdms):
        start = np.datetime64("2026-05-04T10:11:12", "us")
        stamps = start + (SECONDS * 1e6).round().astype("timedelta64[us]")
        path = tdms(("time", stamps), ("f", FORCE, {"unit_string": "N"}))
        recording = read_recording(path, columns={"time": "g/time", "force": "g/f"})
        assert_allclose(recording.time, SECONDS, rtol=0, atol=1e-6)
        assert_array_equal(recording.force, FORCE)
