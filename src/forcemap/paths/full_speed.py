"""Whether columns beside the times of a motion say that it ran at full speed, as it will when the program runs.

Names that mean something else are without number, so only what is known to be the robot's override, or an automatic
mode, tells of full speed; whatever else may be an override says that a run was slowed down, if it is below full.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.findings import Finding, FindingKind
from forcemap.recordings.cells import is_number

STANDS = 0.002
"""How far [m], or [rad], what stands may be seen to move: measured positions tremble. A choice."""

_PACES = {"speed", "spd", "velocity", "vel", "v", "geschw", "geschwindigkeit", "tempo", "vitesse", "feed"}
_SHARES = {"scaling", "scale", "scal", "factor", "faktor", "fraction", "slider", "ratio", "mul", "multiplier"}
_SHARES |= {"pct", "percent", "prozent", "%"}
_OVERRIDES = {"override", "ovr", "ovrd", "ov"}
_JOINED = {"speedoverride", "speedscaling", "speedratio", "speedfraction", "speedfactor", "geschwindigkeitsfaktor"}
_OF_ROBOT = {"rob", "robot", "roboter", "pro", "prog", "program", "actual", "act", "ist", "aktuell", "rate"}
_KNOWN = {"target_speed_fraction"}  # Universal Robots' RTDE: the speed slider
_MAY_BE = re.compile(
    r"override|ov_pro|red_?vel|redu[ckz]|(?<![a-z])ov(rd?)?(?![a-z])|"
    r"feed[\s_.-]*rate|scaling[\s_.-]*factor|geschwindigkeitsfaktor|"
    r"(speed|vel(ocity)?|geschw(indigkeit)?|tempo|vitesse|ovrd?|(?<![a-z])v)[\s_.(\[-]*"
    r"(scal|fraction|slider|ratio|factor|mul|pct|percent|prozent|%)",
    re.IGNORECASE,
)
_NO_SHARE = re.compile(r"[a-z]/(s|min)\b|limit\s*$", re.IGNORECASE)  # a speed, what it may be
_OF_OTHERS = {"jog", "gripper", "spindle", "laser", "fan", "pump", "feeder", "conveyor", "belt", "acc", "acceleration"}
_OF_OTHERS |= {"force", "torque", "request", "requested"}
_MODES = {"mode", "modus", "opmode", "betriebsart", "betriebsmodus"}
_NEUTRAL = _MODES | {"robot", "safety", "op", "operation", "program"}
_OF_PARTS = {"joint", "axis", "tool", "gripper", "digital", "analog", "output", "input", "io"}
_AUTOMATIC = {"auto", "aut", "automatic", "automatik", "automatikbetrieb", "ex", "ext", "extern", "external", "remote"}
_AUTOMATIC |= {"run", "running", "normal", "play", "production", "produktion"}
_RUNNING = {"safety_mode": "1", "robot_mode": "7"}  # Universal Robots' SafetyMode NORMAL, RobotMode RUNNING
_MANUAL_NAMES = {"t1", "t2", "krf", "manual", "manuell", "reduced", "reduziert", "teach", "teaching", "setup", "dry"}
_MANUAL_NAMES |= {"handbetrieb", "tippbetrieb", "einrichten", "einrichtbetrieb", "testbetrieb"}
_MANUAL = _MANUAL_NAMES | {"man", "manr", "hand", "slow", "local", "test"}
_OFF = {"", "0", "0.0", "false", "no", "off", "aus", "nein", "falsch"}
_WORD = re.compile(r"[A-ZÄÖÜ]?[a-zäöüß]+\d*|[A-ZÄÖÜ]+\d*(?![a-zäöüß])|\d+|%")
_PERCENT = re.compile(r"%|pct|percent|prozent|ov_pro", re.IGNORECASE)
_MOST_SHARE = 1.1  # greater numbers are percent
_FULL = 0.99  # share of full speed from which a run counts as not slowed down


def tells_of_speed(name: str) -> bool:
    """Whether a column may have the share of full speed that a robot ran at, or its mode of operation."""
    return bool(_may_slow(name) or _is_mode(name) or _words(name) & _MANUAL_NAMES)


def doubts_of_full_speed(
    columns: Sequence[tuple[str, Sequence[str]]], rows: FloatArray, *, log: bool, stands: float = STANDS
) -> Iterator[Finding]:
    """That columns beside the times of a motion say that it was slowed down, in shares or in percent, or that none says
    that it was not.

    Parameters
    ----------
    columns : sequence of (str, sequence of str)
        Name and cells of columns, a cell for each of n rows.
    rows : array, shape (n, k)
        Where the robot is in each row [m], or its joints.
    log : bool
        True of a log as a controller writes it, False of a path file with times.
    stands : float
        How far what stands may be seen to move, in the unit of `rows`.
    """
    full, lowest, others = [], dict[str, float](), dict[str, float]()
    for name, cells in columns:
        if not _may_slow(name) or not any(each.strip() for each in cells):
            continue
        shares = _shares(name, cells)
        if _is_override(name):
            full.append(_at_full(name, cells, shares, rows, stands))
        moving = shares[shares > 0]
        if moving.size and moving.min() < _FULL:
            (others if _words(name) & _OF_OTHERS else lowest)[name] = float(moving.min())
    told = bool(full) and all(full)
    lowest |= {} if told else others
    if any(_slower_mode(name, cells) for name, cells in columns) or not (told or lowest):
        yield Finding.of(FindingKind.LOG_FULL_SPEED_UNTOLD, log=log or None)
    if lowest:
        yield Finding.of(FindingKind.LOG_SLOWED, columns=tuple(lowest), lowest=min(lowest.values()))


def _words(text: str) -> set[str]:
    """The words of a name such as `OV_PRO` or `SpeedRatio`, in small letters."""
    return {word.lower() for word in _WORD.findall(text)}


def _may_slow(name: str) -> bool:
    return bool(_MAY_BE.search(name) and not _NO_SHARE.search(name))


def _is_override(name: str) -> bool:
    """Whether a name means the override of the robot's speed and nothing else."""
    words = _words(name)
    meant = words & (_OVERRIDES | _JOINED) or (words & _PACES and words & _SHARES)
    return name.lower() in _KNOWN or bool(meant and words <= _PACES | _SHARES | _OVERRIDES | _JOINED | _OF_ROBOT)


def _is_mode(name: str) -> bool:
    words = _words(name)
    return bool(words & _MODES and not words & _OF_PARTS)


def _shares(name: str, cells: Sequence[str]) -> FloatArray:
    """The share of full speed in each row; NaN where a cell has no number."""
    texts = [cell.replace("%", "").strip().replace(",", ".") for cell in cells]
    shares = np.array([float(text) if is_number(text) else np.nan for text in texts])
    percent = _PERCENT.search(name + "".join(cells[:1])) or np.nanmax(shares, initial=0.0) > _MOST_SHARE
    return shares / 100 if percent else shares


def _at_full(name: str, cells: Sequence[str], shares: FloatArray, rows: FloatArray, stands: float) -> bool:
    """Whether an override is full wherever the robot moves; the last row begins no motion."""
    shares = shares[:-1] if not cells[-1].strip() else shares
    flag = _words(name) & _OVERRIDES and {*map(str.strip, cells)} == {"1"}  # a share, one percent, or "on"
    if flag or len(cells) != len(rows) or np.isnan(shares).any() or not (shares > 0).any():
        return False
    runs = np.split(np.arange(len(shares)), np.flatnonzero(np.diff(shares > 0)) + 1)
    resting = all(np.ptp(rows[run], axis=0).max() < stands for run in runs if shares[run[0]] <= 0)
    moving = shares[shares > 0]
    return bool(resting and moving.min() >= _FULL and moving.max() <= _MOST_SHARE)


def _slower_mode(name: str, cells: Sequence[str]) -> bool:
    """Whether a column says of a mode that is not known to be automatic, or of a manual or reduced one."""
    found = {cell.strip() for cell in cells}
    if _is_mode(name) and not _words(name) & _MANUAL_NAMES:
        known = _RUNNING.get(name.lower())
        told = (_words(cell) - _NEUTRAL for cell in found - {known})
        return not all(words and words <= _AUTOMATIC for words in told)
    if _words(name) & _MANUAL_NAMES:
        return not {cell.lower() for cell in found} <= _OFF
    return any(
        words & _MANUAL_NAMES or (words & _MANUAL and words <= _MANUAL | _NEUTRAL) for words in map(_words, found)
    )
