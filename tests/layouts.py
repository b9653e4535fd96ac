"""Files as devices, loggers and programs write them: of each one impact, and the column map that reads it.

Nobody here has the devices: a layout is written after its maker's documentation, or as public programs that read it
expect it; `source` says which. Those that a recording or package at hand holds for real are read in the tests beside.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

N = 600
SECONDS = np.arange(N) / 1000
FORCE = np.round(0.3 * np.sin(np.arange(N)) + 150 * np.exp(-(((SECONDS - 0.15) / 0.012) ** 2)), 3)


@dataclass(frozen=True)
class Written:
    """A layout: the bytes of a file, the column map, and what it gives; `refused` is what the error says instead."""

    name: str
    source: str
    content: bytes
    columns: dict[str, Any] | None
    refused: str = ""
    tolerance: float = 0.0
    notes: tuple[str, ...] = ()
    file: str = "run.csv"
    force: np.ndarray = field(default_factory=lambda: FORCE)


def rows(*columns, delimiter=",", formats=("%.3f", "%.3f"), decimal=".", end="\n", quote="", lead="", tail=""):
    """Lines of numbers."""
    text = []
    for row in zip(*columns, strict=True):
        cells = [f % value if "%" in f else f for f, value in zip(formats, row, strict=True)]
        cells = [quote + cell.replace(".", decimal) + quote for cell in cells]
        text.append(lead + delimiter.join(cells) + tail + end)
    return "".join(text)


T, F = SECONDS, FORCE
MS, COUNT = SECONDS * 1000, np.arange(N)
BY_NUMBER = {"time": 1, "force": 2}
LVM_HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t{point}\n"
    "Multi_Headings\tNo\nX_Columns\t{columns}\nTime_Pref\tRelative\nOperator\tLab\nDate\t2026/05/04\n"
    "Time\t10:11:12,5\n***End_of_Header***\t\n\t\nChannels\t1\t\nSamples\t600\t\nDate\t2026/05/04\t\n"
    "Time\t10:11:12,5\t\nY_Unit_Label\t{unit}\t\nX_Dimension\tTime\t\nX0\t0{point}0000000000000000E+0\t\n"
    "Delta_X\t0{point}001000\t\n***End_of_Header***\t\t\n"
)
LVM = "NI, specification of the LabVIEW measurement file"
SCOPE = {"force_unit": "counts", "newtons_per_count": 50.0}
VOLTS = FORCE / 50
CATMAN = "HBM catman ASCII export, as public readers of it expect it"
CATMAN_HEAD = "HBM_CATMAN_DATAFILE_40 3.1\nDatum: 04.05.2026\nKommentar: Aufprall 7\n\n"
TEXTS = {"utf-16": "with a byte-order mark", "utf-16-le": "without one", "utf-16-be": "big-endian without one"}


def _lvm(body, *, point=".", columns="One", unit="Newton"):
    head = LVM_HEAD.format(point=point, columns=columns, unit=unit).replace("\n", "\r\n")
    return (head + body.replace("\n", "\r\n")).encode()


def text_layouts():
    """Layouts that are read to the right numbers."""
    lvm_rows = rows(T, F, delimiter="\t", formats=("%.6f", "%.6f"))
    first, rest = lvm_rows.split("\n", 1)
    lvm = {"time": "X_Value", "force": "Force"}
    yield Written("LVM, one X column", LVM, _lvm("X_Value\tForce\tComment\n" + lvm_rows), lvm)
    yield Written(
        "LVM, a comment in the first row", LVM, _lvm(f"X_Value\tForce\tComment\n{first}\tgood run\n{rest}"), lvm
    )
    yield Written(
        "LVM, no X column, decimal commas",
        LVM,
        _lvm(
            "X_Value\tForce\tComment\n" + rows(F, delimiter="\t", formats=("%.6f",), decimal=",", lead="\t"),
            point=",",
            columns="No",
        ),
        {"sampling_rate_Hz": 1000, "force": "Force"},
    )
    yield Written("LVM, columns by number", LVM, _lvm("X_Value\tForce\tComment\n" + lvm_rows), BY_NUMBER)
    yield Written(
        "DIAdem ASCII export",
        "NI DIAdem, ASCII export: names and units on lines of their own",
        ("Zeit\tKraft\ns\tN\n" + rows(T, F, delimiter="\t", decimal=",")).encode(),
        {"time": "Zeit", "force": "Kraft"},
    )
    for unit, factor in (("N", 1), ("kN", 1e-3)):
        yield Written(
            f"catman ASCII, {unit}",
            CATMAN,
            (
                CATMAN_HEAD
                + f"Zeit  1 - Standardmessrate [s]\tF_Dose [{unit}]\tMX440B_CH 3 [V]\n"
                + rows(T, F * factor, 0 * T, delimiter="\t", formats=("%.4f", "%.6f", "%.4f"), decimal=",", end="\r\n")
            ).encode("latin-1"),
            {"time": "Zeit  1 - Standardmessrate [s]", "force": f"F_Dose [{unit}]", "force_unit": unit},
            tolerance=1e-9,
        )
    yield Written(
        "catman ASCII, units on a line of their own, trailing tab",
        CATMAN,
        (CATMAN_HEAD + "Zeit\tKraft\t\nms\tN\t\nCH=1\tCH=2\t\n" + rows(MS, F, delimiter="\t", tail="\t")).encode(),
        {"time": "Zeit", "time_unit": "ms", "force": "Kraft"},
        tolerance=1e-9,
    )
    yield Written(
        "maXYmos-like process curve",
        "Kistler maXYmos, CSV export: a long header of several tables above the curve",
        (
            "Program;1\nDate;04.05.2026\nTime;10:11:12\nResult;OK\n\nChannel;Sensor;Range;Unit\nX;Time;1,0;s\n"
            "Y;9317B;500,0;N\n\nMeasuring curve\nTime;Force\ns;N\n" + rows(T, F, delimiter=";", decimal=",", end="\r\n")
        ).encode("latin-1"),
        {"time": "Time", "force": "Force"},
    )
    yield Written(
        "collision-measuring device, German export",
        "devices for pressure and force of collisions (GTE CoboSafe, Pilz PRMS): key and value, then the curve",
        (
            "Messgerät;CoboSafe-CBSF-75\nSeriennummer;1234\nFeder;75 N/mm\nDatum;04.05.2026 10:11\n"
            "Fmax [N];150,0\n\nZeit [ms];Kraft [N]\n" + rows(MS, F, delimiter=";", decimal=",", end="\r\n")
        ).encode("cp1252"),
        {"time": "Zeit [ms]", "time_unit": "ms", "force": "Kraft [N]"},
        tolerance=1e-9,
    )
    yield Written(
        "the same with a result below the curve",
        "as above, with the statistics behind the numbers",
        (
            "Zeit [ms];Kraft [N]\n" + rows(MS, F, delimiter=";", decimal=",") + "\nAuswertung\nMaximum;150,3\nEnde;\n"
        ).encode(),
        {"time": "Zeit [ms]", "time_unit": "ms", "force": "Kraft [N]"},
        tolerance=1e-9,
        notes=("what follows the numbers, from row 602 on, is no measurement and left out",),
    )
    yield Written(
        "Bluehill raw data",
        "Instron Bluehill, raw data CSV: quoted numbers, units on a line of their own",
        (
            '"Specimen label","1"\n"Rate 1","250 mm/min"\n\n"Time","Extension","Load"\n"(s)","(mm)","(N)"\n'
            + rows(T, 0 * T, F, quote='"', formats=("%.3f", "%.5f", "%.3f"), end="\r\n")
        ).encode(),
        {"time": "Time", "force": "Load"},
    )
    yield Written(
        "Bluehill raw data, decimal commas between commas",
        "Instron Bluehill on a German or French system: the quotes tell the commas apart",
        (
            '"Time","Load"\n"(s)","(kN)"\n' + rows(T, F / 1000, quote='"', decimal=",", formats=("%.3f", "%.6f"))
        ).encode(),
        {"time": "Time", "force": "Load", "force_unit": "kN"},
        tolerance=1e-9,
    )
    yield Written(
        "PicoScope CSV",
        "Pico Technology, PicoScope: names, units in brackets, a blank line",
        ("Time,Channel A,Channel B\n(ms),(V),(mV)\n\n" + rows(MS, VOLTS, 0 * T, formats=("%.8f",) * 3)).encode(),
        {"time": "Time", "time_unit": "ms", "force": "Channel A", **SCOPE},
        tolerance=1e-6,
    )
    yield Written(
        "Keysight InfiniiVision CSV",
        "Keysight InfiniiVision, CSV: x-axis and second,Volt",
        ("x-axis,1\nsecond,Volt\n" + rows(T, VOLTS, formats=("%+.9E", "%+.5E"))).encode(),
        {**BY_NUMBER, **SCOPE},
        tolerance=1e-2,
    )
    yield Written(
        "Rigol CSV, samples numbered",
        "Rigol DS1000Z, CSV: start and increment beside the names",
        b"X,CH1,Start,Increment,\nSequence,Volt,0.000000e+00,1.000000e-03\n"
        + rows(COUNT, VOLTS, formats=("%d", "%.6e"), tail=",").encode(),
        {"sampling_rate_Hz": 1000, "force": "CH1", **SCOPE},
        tolerance=1e-3,
    )
    yield Written(
        "Rigol CSV with times",
        "Rigol MSO5000, CSV: Time(s),CH1V",
        ("Time(s),CH1V\n" + rows(T, VOLTS, formats=("%.6e", "%.6e"))).encode(),
        {"time": "Time(s)", "force": "CH1V", **SCOPE},
        tolerance=1e-3,
    )
    yield Written(
        "Tektronix MSO CSV",
        "Tektronix MDO/MSO, CSV: a header of key and value, TIME,CH1",
        (
            "Model,MSO44\nFirmware Version,1.30\n\nWaveform Type,ANALOG\nHorizontal Units,s\nSample Interval,0.001\n"
            "Record Length,600\nVertical Units,V\n\n\nTIME,CH1\n" + rows(T, VOLTS, formats=("%.6f", "%.6f"))
        ).encode(),
        {"time": "TIME", "force": "CH1", **SCOPE},
        tolerance=1e-3,
    )
    yield Written(
        "Tektronix TDS CSV, header beside the numbers",
        "Tektronix TDS2000, CSV: settings in the first three columns, time and voltage in columns 4 and 5",
        (
            "".join(
                f"{head},{t:.12f},{v:9.5f},\n"
                for head, t, v in zip(
                    ["Record Length,6.000000e+02,", "Sample Interval,1.000000e-03,", *[",,"] * (N - 2)],
                    T,
                    VOLTS,
                    strict=True,
                )
            )
        ).encode(),
        {"time": 4, "force": 5, **SCOPE},
        tolerance=1e-3,
    )
    yield Written(
        "Dewesoft text export",
        "Dewesoft, export as text: header, then names with units in brackets, tabs",
        (
            "Data file: run 7.dxd\nStart time:\t5/4/2026 10:11:12.500\nSample rate:\t1000 Hz\n\nTime (s)\tForce (N)\n"
            + rows(T, F, delimiter="\t", formats=("%.6f", "%.6f"), end="\r\n")
        ).encode(),
        {"time": "Time (s)", "force": "Force (N)"},
    )
    yield Written(
        "MATLAB writematrix",
        "MathWorks, writematrix: no header, commas",
        rows(T, F, formats=("%.15g", "%.15g")).encode(),
        BY_NUMBER,
    )
    yield Written(
        "MATLAB writetable",
        "MathWorks, writetable",
        ("time_s,force_N\n" + rows(T, F, formats=("%.15g", "%.15g"))).encode(),
        None,
    )
    yield Written(
        "MATLAB save -ascii",
        "MathWorks, save -ascii: blanks before every number",
        rows(T, F, delimiter="  ", formats=("%.15e", "%.15e"), lead="   ").encode(),
        BY_NUMBER,
    )
    yield Written(
        "numpy savetxt",
        "NumPy, savetxt: one blank, header behind #",
        ("# time_s force_N\n" + rows(T, F, delimiter=" ", formats=("%.18e", "%.18e"))).encode(),
        None,
    )
    yield Written(
        "numpy savetxt, a unit apart, a footer",
        "NumPy, savetxt with header and footer",
        ("# t [s] F [N]\n" + rows(T, F, delimiter=" ", formats=("%.18e", "%.18e")) + "# end of run\n").encode(),
        {"time": "t [s]", "force": "F [N]"},
        notes=("what follows the numbers, from row 602 on, is no measurement and left out",),
    )
    yield Written(
        "pandas to_csv",
        "pandas, to_csv with its index",
        (",time_s,force_N\n" + rows(COUNT, T, F, formats=("%d", "%.17g", "%.17g"))).encode(),
        None,
    )
    yield Written(
        "pandas to_csv, German",
        "pandas, to_csv(sep=';', decimal=',')",
        (";time_s;force_N\n" + rows(COUNT, T, F, formats=("%d", "%.6f", "%.6f"), delimiter=";", decimal=",")).encode(),
        {"time": "time_s", "force": "force_N"},
    )
    yield Written(
        "R write.csv",
        "R, write.csv: quoted names and row names",
        (
            '"","time_s","force_N"\n'
            + "".join(f'"{i + 1}",{t!r},{f!r}\n' for i, (t, f) in enumerate(zip(T.tolist(), F.tolist(), strict=True)))
        ).encode(),
        {"time": "time_s", "force": "force_N"},
    )
    stamps = 1_780_000_000_000_000_000 + COUNT.astype(np.int64) * 1_000_000
    yield Written(
        "ROS 1 bag as CSV",
        "ROS, rostopic echo -p: %time and field names, nanoseconds since 1970",
        (
            "%time,field.header.seq,field.header.frame_id,field.wrench.force.x,field.wrench.force.z\n"
            + "".join(f"{s},{i},ft_sensor,0.1,{-f}\n" for i, (s, f) in enumerate(zip(stamps, F.tolist(), strict=True)))
        ).encode(),
        {"time": "%time", "time_unit": "ns", "force": "field.wrench.force.z", "sign": -1},
        tolerance=1e-6,
        notes=("times count from 1970; the first, 1780000000.000000 s, is taken for 0",),
    )
    yield Written(
        "PlotJuggler CSV",
        "PlotJuggler: __time in seconds since 1970, names with slashes",
        (
            "__time,/wrench/wrench/force/z\n"
            + "".join(f"{1_780_000_000 + i / 1000:.9f},{f!r}\n" for i, f in enumerate(F.tolist()))
        ).encode(),
        {"time": "__time", "force": "/wrench/wrench/force/z"},
        tolerance=1e-6,
        notes=("times count from 1970; the first, 1780000000.000000 s, is taken for 0",),
    )
    yield Written(
        "UR RTDE record",
        "Universal Robots, RTDE Python client, record.py: names and numbers between blanks",
        (
            "timestamp actual_TCP_force_0 actual_TCP_force_1 actual_TCP_force_2\n"
            + rows(T + 1234.5, 0 * T, 0 * T, -F, delimiter=" ", formats=("%.3f", "%.3f", "%.3f", "%.3f"))
        ).encode(),
        {"time": "timestamp", "force": "actual_TCP_force_2", "sign": -1},
        tolerance=1e-9,
    )
    yield Written(
        "Franka log",
        "libfranka, a log of the robot state as CSV",
        (
            "time,O_F_ext_hat_K[0],O_F_ext_hat_K[1],O_F_ext_hat_K[2],success rate\n"
            + rows(MS, 0 * T, 0 * T, F, 0 * T + 1, formats=("%.0f", "%.3f", "%.3f", "%.3f", "%.2f"))
        ).encode(),
        {"time": "time", "time_unit": "ms", "force": "O_F_ext_hat_K[2]"},
        tolerance=1e-9,
    )
    yield Written(
        "robot trace between blanks, aligned",
        "a controller's trace (KUKA, Kawasaki): columns aligned by blanks, names with one blank in them",
        (
            "Trace 7\nTime [s]    Contact Force [N]    State\n"
            + "".join(f"{t:10.3f}{f:16.3f}      RUN\n" for t, f in zip(T, F, strict=True))
        ).encode(),
        {"time": "Time [s]", "force": "Contact Force [N]"},
    )
    yield Written(
        "robot log between blanks with decimal commas",
        "a controller's log on a German system",
        ("Zeit Kraft\n" + rows(T, F, delimiter="   ", decimal=",")).encode(),
        {"time": "Zeit", "force": "Kraft"},
    )
    yield Written(
        "Excel, German",
        "Microsoft Excel, CSV (semicolons, decimal commas), empty columns and rows at the end",
        (
            "Zeit [s];Kraft [N];;\n" + rows(T, F, delimiter=";", decimal=",", end="\r\n", tail=";;") + ";;;\r\n;;;\r\n"
        ).encode("cp1252"),
        {"time": "Zeit [s]", "force": "Kraft [N]"},
        notes=("what follows the numbers, from row 602 on, is no measurement and left out",),
    )
    yield Written(
        "Excel, the delimiter said in the first line",
        "Microsoft Excel and programs that write for it: sep=;",
        ("sep=;\nt [s];F [N]\n" + rows(T, F, delimiter=";", end="\r\n")).encode(),
        None,
    )
    yield Written(
        "names over two lines in quotes",
        "Microsoft Excel: a line break within a cell",
        ('"Time\n[s]";"Force\n[N]"\n' + rows(T, F, delimiter=";")).encode(),
        {"time": "Time [s]", "force": "Force [N]"},
    )
    yield Written(
        "value and unit in turn",
        "handheld force gauges: every number followed by its unit",
        rows(T, F, delimiter=" s ", tail=" N").encode(),
        {"time": 1, "force": 3},
    )
    yield Written(
        "a header of 1,000 lines",
        "loggers that write their settings above the numbers",
        ("".join(f"Setting {i};{i};on\n" for i in range(998)) + "t;F\ns;N\n" + rows(T, F, delimiter=";")).encode(),
        {"time": "t", "force": "F"},
    )
    yield Written(
        "Excel, French",
        "Microsoft Excel, CSV UTF-8",
        ("Temps (s);Force (N)\n" + rows(T, F, delimiter=";", decimal=",", end="\r\n")).encode("utf-8-sig"),
        None,
    )
    for encoding, words in TEXTS.items():
        yield Written(
            f"Excel, Unicode text, {words}",
            "Microsoft Excel, Unicode text: UTF-16, tabs",
            ("Zeit [µs]\tKraft [N]\n" + rows(T * 1e6, F, delimiter="\t", decimal=",", end="\r\n")).encode(encoding),
            {"time": "Zeit [µs]", "time_unit": "us", "force": "Kraft [N]"},
            tolerance=1e-9,
        )
    yield Written(
        "old Macintosh line ends",
        "programs that end lines with a carriage return alone",
        ("time_s;force_N\r" + rows(T, F, delimiter=";", end="\r")).encode(),
        None,
    )
    yield Written(
        "line ends doubled in transfer",
        "a text file transferred twice between systems",
        ("time_s;force_N\r\r\n" + rows(T, F, delimiter=";", end="\r\r\n")).encode(),
        None,
    )
    yield Written(
        "counts of an Arduino",
        "a serial log: micros() and the reading of a converter, names with words of units",
        ("time (usec),reading (digits)\n" + rows(T * 1e6, F * 20 + 512, formats=("%.0f", "%.0f"))).encode(),
        {
            "time": "time (usec)",
            "time_unit": "us",
            "force": "reading (digits)",
            "force_unit": "counts",
            "newtons_per_count": 0.05,
            "zero_count": 512.0,
        },
        tolerance=0.05,
    )
    yield Written(
        "words for units",
        "programs that spell units out",
        ("Time, milliseconds;Force, kNewton\n" + rows(MS, F / 1000, delimiter=";", formats=("%.1f", "%.6f"))).encode(),
        {"time": "Time, milliseconds", "time_unit": "ms", "force": "Force, kNewton", "force_unit": "kN"},
        tolerance=1e-9,
    )


def refused_layouts():
    """Layouts that are refused, with what to do."""
    table = rows(T, F)
    for unit, words in (
        ("[min]", "convert, or state sampling_rate_Hz"),
        ("[h]", "convert, or state sampling_rate_Hz"),
        ("[S]", "convert, or state sampling_rate_Hz"),
        (", min", "convert, or state sampling_rate_Hz"),
        ("_h", "convert, or state sampling_rate_Hz"),
        ("[msec]", "the file says 'ms', the column map time_unit = 's'"),
        ("[milliseconds]", "the file says 'ms', the column map time_unit = 's'"),
        (" ns", "the file says 'ns', the column map time_unit = 's'"),
    ):
        name = f"Time{unit}"
        content = f"{name};Force [N]\n{rows(T, F, delimiter=';')}".encode()
        yield Written(f"time in {unit}", "a slip of a unit", content, {"time": name, "force": "Force [N]"}, words)
    units = "[bit] [Digits] [pC] [%FS] [mV/V] [N/mm] [Ncm] [daN] [kgf] [lbf] [V] (V) (g) _lbf [N·s] (sn) [MPa] [mN] [n]"
    for unit in units.split():
        name = f"Force {unit}" if unit[0] in "[(" else f"Force{unit}"
        content = f"Time [s];{name}\n{rows(T, F, delimiter=';')}".encode()
        yield Written(f"force in {unit}", "a slip of a unit", content, {"time": 1, "force": name}, "newtons_per_count")
    for line in ("Force unit: kgf", "# units: ms, N", "Einheit der Kraft = daN", "Y_Unit_Label;lbf"):
        content = f"{line}\nZeit;Kraft\n{rows(T, F, delimiter=';')}".encode()
        yield Written(f"a remark {line}", "a slip of a unit", content, {"time": 1, "force": 2}, "the file says")
    for unit, beside in (("daN", ";"), ("kN", ";"), ("lbf", " ")):
        content = rows(T, F, delimiter=beside, tail=f"{beside}{unit}").encode()
        yield Written(f"{unit} beside every number{beside}", "a slip of a unit", content, BY_NUMBER, "the file says")
    for header, delimiter in (
        ("Time Force\n(s) (kN)", " "),
        ("t / s F / kN", " "),
        ("# column 1: time [s]\n# column 2: force [kN]", " "),
        ('"Time\n[s]";"Force\n[kN]"', ";"),
        ("s;kN\nt;F", ";"),
    ):
        content = f"{header}\n{rows(T, F, delimiter=delimiter)}".encode()
        yield Written(f"kN in the header {header!r}", "a slip of a unit", content, BY_NUMBER, "the file says 'kN'")
    for name in ("force_daN_filtered", "F, %", "F/kp", "F N/rev", "N/cm2", "kgf force", "Force kN Sensor 3", "F daN 1"):
        content = f"Zeit;{name}\n{rows(T, F, delimiter=';')}".encode()
        yield Written(f"within a name, {name}", "a slip of a unit", content, {"time": 1, "force": 2}, "the file says")
    for line in ("ms;kN", "(ms);(daN)", "s;kgf", "[s];[V]", "Einheit;lbf", "[s];[foo]", "s;ozin", "min;N"):
        content = f"Zeit;Kraft\n{line}\n{rows(T, F, delimiter=';')}".encode()
        yield Written(f"a line of units {line}", "a slip of a unit", content, {"time": 1, "force": 2}, "the file says")
    yield Written(
        "kN of catman taken for N", CATMAN, f"t [s]\tF [kN]\n{table}".replace(",", "\t").encode(), BY_NUMBER, "'kN'"
    )
    yield Written("LVM in volts", LVM, _lvm("X_Value\tForce\tComment\n" + table.replace(",", "\t"), unit="Volts"),
                  {"time": "X_Value", "force": "Force"}, "the file says 'Volts'")  # fmt: skip
    yield Written("LVM of two segments", LVM, _lvm("X_Value\tForce\tComment\n" + table.replace(",", "\t")) * 2,
                  {"time": "X_Value", "force": "Force"}, "export each by itself")  # fmt: skip
    yield Written("Rigol, the number of a sample for a time", "Rigol DS1000Z",
                  b"X,CH1,Start,Increment,\nSequence,Volt,0,1.0e-03\n"
        + rows(COUNT, VOLTS, formats=("%d", "%.6e"), tail=",").encode(),
                  {"time": "X", "force": "CH1", **SCOPE}, "is time_unit in the column map right")  # fmt: skip
    yield Written(
        "decimal commas between commas",
        "a German system",
        rows(T, F, decimal=",").encode(),
        BY_NUMBER,
        "may separate columns",
    )
    yield Written(
        "decimal commas between commas, names",
        "a German system",
        ("t,F\n" + rows(T, F, decimal=",")).encode(),
        {"time": "t", "force": "F"},
        "found 4 cells below 2 names",
    )
    yield Written(
        "thousands",
        "a German system",
        "".join(f"{i};{1000 + i:,}\n".replace(",", ".") for i in range(90)).encode(),
        {"time": 1, "time_unit": "ms", "force": 2},
        "group thousands",
    )
    clock = "".join(f"10:11:{t:06.3f};{f}\n" for t, f in zip(T, F, strict=True))
    yield Written(
        "times of day",
        "loggers with a clock",
        ("Zeit;Kraft\n" + clock).encode(),
        {"time": "Zeit", "force": "Kraft"},
        "sampling_rate_Hz",
    )
    iso = "".join(f"2026-05-04T10:11:{t:06.3f},{f}\n" for t, f in zip(T, F, strict=True))
    yield Written(
        "times with a date",
        "loggers with a clock",
        ("time,force\n" + iso).encode(),
        {"time": "time", "force": "force"},
        "sampling_rate_Hz",
    )
    yield Written(
        "Excel workbook",
        "Microsoft Excel",
        b"PK\x03\x04\x14\0\x06\0 [Content_Types].xml xl/workbook.xml",
        BY_NUMBER,
        "save the sheet as CSV",
        file="run.xlsx",
    )
    yield Written(
        "Excel 97 workbook",
        "Microsoft Excel",
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600),
        BY_NUMBER,
        "export the recording as CSV",
        file="run.xls",
    )
    yield Written(
        "MATLAB file",
        "MathWorks",
        b"MATLAB 5.0 MAT-file, Platform: GLNXA64" + bytes(90),
        BY_NUMBER,
        "writematrix",
        file="run.mat",
    )
    yield Written("HDF5", "HDF5", b"\x89HDF\r\n\x1a\n" + bytes(90), BY_NUMBER, "CSV", file="run.h5")
    yield Written("ROS bag", "ROS", b"#ROSBAG V2.0\nE\0\0\0", BY_NUMBER, "rostopic echo", file="run.bag")
    yield Written("a page saved", "HTML", b"<!DOCTYPE html><table>", BY_NUMBER, "HTML", file="run.xls")
    yield Written(
        "rows quoted whole",
        "Excel, a CSV saved twice",
        "".join(f'"{r}"\n' for r in table.splitlines()).encode(),
        BY_NUMBER,
        "found",
    )
    yield Written(
        "numbers go on after a text",
        "two recordings in a file",
        (table + "\nRun 2\n" + table).encode(),
        BY_NUMBER,
        "blank line",
    )


LAYOUTS = [*text_layouts(), *refused_layouts()]
