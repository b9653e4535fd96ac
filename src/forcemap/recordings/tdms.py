"""TDMS files (LabVIEW): channels named "group/channel"."""

from __future__ import annotations

import io
import logging
import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import MissingExtra, RecordingError
from forcemap.recordings.column_map import ALL_COLUMNS, ColumnMap, Names, listed, missing_column
from forcemap.recordings.components import other_components, refuse_one_of_several, still
from forcemap.recordings.overrange import OVERRANGE
from forcemap.recordings.recording import LEAST_SAMPLES
from forcemap.recordings.sampling import Curve, check_sampling, in_newtons, in_seconds, refuse_other_unit
from forcemap.recordings.units import ForceUnit, TimeUnit

SIGNATURE = b"TDSm"
_MOST_SCALES = 50  # of a channel; a choice: programs write one or two
_SAME_RATE = 0.01  # share by which two statements of the sampling rate may differ; a choice

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile  # type: ignore[import-untyped]


def read_tdms(content: bytes, columns: ColumnMap | None) -> list[Curve]:
    """The curves of a TDMS file; the time is a channel, or follows from the rate stated in file or column map.

    Parameters
    ----------
    content : bytes
        The file.
    columns : ColumnMap or None
        Which channels hold what; it must be stated, for a channel's name says nothing for sure.

    Raises
    ------
    RecordingError
        A damaged file, or channels that are missing or do not fit; `row` is the number of the sample.
    MissingExtra
        nptdms is not installed.
    """
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise MissingExtra(
            "TDMS files need nptdms; install it from the project's folder: pip install '.[tdms]'"
        ) from None
    try:
        with _warnings_refused(), TdmsFile.open(io.BytesIO(content)) as tdms:
            return _curves(tdms, len(content), columns)
    except RecordingError:
        raise
    except Exception as error:  # whatever nptdms stumbles over in a damaged file
        why = f"{type(error).__name__}: {error}"
        raise RecordingError(f"not a TDMS file, or damaged ({why}); export it again") from error


@contextmanager
def _warnings_refused() -> Iterator[None]:
    """Refuse what nptdms only warns of, such as a scale it does not know and leaves out; nothing goes to stderr."""
    from nptdms.log import log_manager  # type: ignore[import-untyped]

    log_manager.console_handler.setLevel(logging.ERROR)
    logger, warnings = logging.getLogger("nptdms"), _Warnings()
    logger.addHandler(warnings)
    try:
        yield
    finally:
        logger.removeHandler(warnings)
    if warnings.messages:
        raise RecordingError(f"{warnings.messages[0]}; export it again, from the program that wrote it")


class _Warnings(logging.Handler):
    """The warnings of this thread."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []
        self._thread = threading.get_ident()

    def emit(self, record: logging.LogRecord) -> None:
        old_text = str(record.msg).startswith("Error decoding string")  # in Latin-1; a unit in it is not known
        if record.thread == self._thread and not old_text:
            self.messages.append(record.getMessage())


def _curves(tdms: TdmsFile, size: int, columns: ColumnMap | None) -> list[Curve]:
    channels = {f"{group.name}/{channel.name}": channel for group in tdms.groups() for channel in group.channels()}
    for holder in (tdms, *tdms.groups(), *channels.values()):
        _refuse_wrong_scales(holder.properties, str(getattr(holder, "name", "")))
    if not channels:
        raise RecordingError("found no channels, expected a force")
    if columns is None:
        problem = f"found the channels {listed(list(channels))}"
        raise RecordingError(f"{problem}; state in a column map which hold time and force")
    if tdms.file_status.incomplete_final_segment:
        raise RecordingError("the last segment is cut off, expected a whole file; copy or export it again")
    if columns.curve is not None or any(isinstance(column, int) for column in columns.columns):
        problem = "channels have names and no rows of other curves"
        raise RecordingError(f"{problem}; name them in the column map as group/channel")
    time = None if columns.time is None else _find(str(columns.time), channels)
    groups = [tuple(_find(str(column), channels) for column in group) for group in columns.groups]
    if columns.runs == ALL_COLUMNS:
        groups = [(name,) for name in channels if name != time]
    curves = []
    for group in groups:
        members = [channels[name] for name in group]
        named = list(zip(group, members, strict=True))
        stated = [refuse_other_unit(name, columns.force_unit, *_units(channel)) for name, channel in named]
        forces = [_force(name, channel, size, columns) for name, channel in named]
        if {len(force) for force in forces} != {len(forces[0])} or len(forces[0]) < LEAST_SAMPLES:
            lengths = ", ".join(str(len(force)) for force in forces)
            raise RecordingError(
                f"found {lengths} samples, expected at least {LEAST_SAMPLES} and as many in each", column=group[0]
            )
        of_force = _components(group, forces, channels if len(groups) == 1 else {}, size, columns)
        times, notes = _times(time, channels, members, size, columns)
        curves.append(Curve(group[0], times, forces, (*notes, *of_force), unit_stated=all(stated)))
    return curves


def _components(
    group: Sequence[str],
    forces: Sequence[FloatArray],
    channels: Mapping[str, TdmsChannel],
    size: int,
    columns: ColumnMap,
) -> tuple[str, ...]:
    """Notes on components of a force that never change; one that is read without the others is refused."""
    if len(group) > 1:
        return still(group, forces)
    names = list(channels)
    for other in (names[position] for position in other_components(group[0], names)):
        try:
            force = _force(other, channels[other], size, columns)
        except RecordingError:  # a channel of something else
            continue
        refuse_one_of_several(group[0], forces[0], [(other, force)])
    return ()


def _find(column: str, channels: Mapping[str, TdmsChannel]) -> str:
    names = list(channels)
    if (position := Names(names).position(column)) is None:
        raise RecordingError(missing_column(column, names), column=column)
    return names[position]


def _numbers(name: str, channel: TdmsChannel, size: int, *, finite: bool = True) -> FloatArray:
    """The values of a channel, never more than the file has room for; infinity, if allowed, is over the range."""
    stamps = channel.dtype.kind == "M"  # seconds from the first one on
    if not stamps and channel.dtype.kind not in "iuf":
        raise RecordingError(f"found values of {channel.dtype.name}, expected numbers", column=name)
    if len(channel) > size:  # scaled figures are wider than the bytes of a converter they come from
        raise RecordingError(f"found {len(channel)} samples stated, which the file has no room for", column=name)
    raw = channel[:]
    values = (raw - raw[:1]) / np.timedelta64(1, "s") if stamps else np.asarray(raw, dtype=np.float64)
    for wrong in np.flatnonzero(np.isnan(values) | (np.isinf(values) & finite))[:1]:
        raise RecordingError("found a value that is not finite, expected numbers", row=int(wrong) + 1, column=name)
    return np.asarray(np.nan_to_num(values, posinf=OVERRANGE, neginf=-OVERRANGE))


def _refuse_wrong_scales(properties: Mapping[str, object], name: str) -> None:
    """Refuse scales that cannot be meant: implausibly many, or a slope that makes every figure the same."""
    scales = properties.get("NI_Number_Of_Scales", 0)
    if not isinstance(scales, int) or not 0 <= scales <= _MOST_SCALES:
        raise RecordingError(f"found NI_Number_Of_Scales = {scales!r}, expected a small count", column=name)
    for entry, slope in properties.items():
        if entry.endswith("_Linear_Slope") and not (isinstance(slope, int | float) and math.isfinite(slope) and slope):
            raise RecordingError(f"found {entry} = {slope!r}, expected a finite number other than 0", column=name)


def _units(channel: TdmsChannel) -> tuple[str, ...]:
    """What a channel says of its unit: in its properties, in brackets, else in its name."""
    stated = [str(channel.properties.get(key, "")).strip() for key in ("unit_string", "NI_UnitDescription")]
    return (*(f"[{unit}]" for unit in stated if unit), channel.name)


def _force(name: str, channel: TdmsChannel, size: int, columns: ColumnMap) -> FloatArray:
    properties = channel.properties
    if properties.get("DecimationLevel", 0):
        problem = "found a channel of decimated data, in which peaks are missing"
        raise RecordingError(f"{problem}; name the group that holds all data", column=name)
    unscaled = properties.get("NI_Scaling_Status") == "unscaled" and not properties.get("NI_Number_Of_Scales")
    if unscaled and columns.force_unit is not ForceUnit.COUNTS:
        problem = "the channel says that it is not scaled, and states no scale"
        raise RecordingError(f"{problem}; state force_unit = 'counts' with newtons_per_count", column=name)
    values = _numbers(name, channel, size, finite=False)
    return in_newtons(values, columns, range(1, len(values) + 1), name)


def _times(
    time: str | None, channels: Mapping[str, TdmsChannel], forces: Sequence[TdmsChannel], size: int, columns: ColumnMap
) -> tuple[FloatArray, tuple[str, ...]]:
    """Times of the samples [s] from the time channel, else from the rate that column map or force channels state."""
    n = len(forces[0])
    rows = range(1, n + 1)
    if time is not None:
        stamps = channels[time].dtype.kind == "M"
        columns = replace(columns, time_unit=TimeUnit.SECONDS) if stamps else columns
        refuse_other_unit(time, columns.time_unit, *_units(channels[time]))
        values = _numbers(time, channels[time], size)
        if len(values) != n:
            raise RecordingError(f"found {len(values)} times for {n} samples of force, expected as many", column=time)
        measured, epoch = in_seconds(values, columns, rows, time)
        return measured, (*epoch, *check_sampling(measured, rows, time))
    for channel in forces:
        refuse_other_unit(channel.name, TimeUnit.SECONDS, f"[{channel.properties.get('wf_xunit_string') or 's'}]")
    stated = {(_property(channel, "wf_increment"), _property(channel, "wf_start_offset")) for channel in forces}
    if len(stated) > 1:
        raise RecordingError("the components state different sampling rates or offsets, expected the same")
    ((increment, offset),) = stated
    if math.isnan(columns.sampling_rate):
        if not increment > 0:
            raise RecordingError("the channel states no wf_increment; state time or sampling_rate_Hz in the column map")
    elif increment > 0 and abs(increment * columns.sampling_rate - 1) > _SAME_RATE:
        stated_here = f"the column map sampling_rate_Hz = {columns.sampling_rate:g}; correct the one that is wrong"
        raise RecordingError(f"the channel states {1 / increment:g} Hz and {stated_here}")
    else:
        increment = 1 / columns.sampling_rate
    seconds: FloatArray = offset + np.arange(n, dtype=np.float64) * increment
    return seconds, check_sampling(seconds, rows, "wf_increment")


def _property(channel: TdmsChannel, name: str) -> float:
    value = channel.properties.get(name, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RecordingError(f"found {name} = {value!r}, expected a finite number", column=str(channel.name))
    return float(value)
