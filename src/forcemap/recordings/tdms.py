"""TDMS files (LabVIEW): channels named "group/channel"."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import MissingExtra, RecordingError
from forcemap.recordings.column_map import ALL_COLUMNS, ColumnMap, listed, missing_column, position
from forcemap.recordings.sampling import Curve, check_sampling, in_newtons, in_seconds, refuse_other_unit

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
        from nptdms.log import log_manager  # type: ignore[import-untyped]
    except ImportError:
        raise MissingExtra("TDMS files need nptdms; install it with: pip install 'forcemap[tdms]'") from None
    log_manager.set_level("ERROR")  # what it only warns of on stderr is refused here
    try:
        with TdmsFile.open(io.BytesIO(content)) as tdms:
            return _curves(tdms, len(content), columns)
    except RecordingError:
        raise
    except Exception as error:  # whatever nptdms stumbles over in a damaged file
        why = f"{type(error).__name__}: {error}"
        raise RecordingError(f"not a TDMS file, or damaged ({why}); export it again") from error


def _curves(tdms: TdmsFile, size: int, columns: ColumnMap | None) -> list[Curve]:
    channels = {f"{group.name}/{channel.name}": channel for group in tdms.groups() for channel in group.channels()}
    if not channels:
        raise RecordingError("found no channels, expected a force")
    if columns is None:
        found = f"found the channels {listed(list(channels))}"
        raise RecordingError(f"{found}; state in a column map which hold time and force")
    if tdms.file_status.incomplete_final_segment:
        raise RecordingError("the last segment is cut off, expected a whole file; copy or export it again")
    if columns.curve is not None or any(isinstance(column, int) for column in columns.columns):
        found = "channels have names and no rows of other curves"
        raise RecordingError(f"{found}; name them in the column map as group/channel")
    time = None if columns.time is None else _find(str(columns.time), channels)
    groups = [tuple(_find(str(column), channels) for column in group) for group in columns.groups]
    if columns.runs == ALL_COLUMNS:
        groups = [(name,) for name in channels if name != time]
    curves = []
    for group in groups:
        members = [channels[name] for name in group]
        forces = [_force(name, channel, size, columns) for name, channel in zip(group, members, strict=True)]
        if {len(force) for force in forces} != {len(forces[0])} or len(forces[0]) < 2:
            lengths = ", ".join(str(len(force)) for force in forces)
            raise RecordingError(f"found {lengths} samples, expected at least 2 and as many in each", column=group[0])
        times, notes = _times(time, channels, members, size, columns)
        curves.append(Curve(group[0], times, forces, notes))
    return curves


def _find(column: str, channels: Mapping[str, TdmsChannel]) -> str:
    names = list(channels)
    if (found := position(column, names)) is None:
        raise RecordingError(missing_column(column, names), column=column)
    return names[found]


def _numbers(name: str, channel: TdmsChannel, size: int) -> FloatArray:
    """The values of a channel, never more than the file has room for."""
    if channel.dtype.kind not in "iuf":
        raise RecordingError(f"found values of {channel.dtype.name}, expected numbers", column=name)
    if len(channel) * channel.dtype.itemsize > size:
        raise RecordingError(f"found {len(channel)} samples stated, which the file has no room for", column=name)
    values = np.asarray(channel[:], dtype=np.float64)
    for wrong in np.flatnonzero(~np.isfinite(values))[:1]:
        raise RecordingError("found a value that is not finite, expected numbers", row=int(wrong) + 1, column=name)
    return values


def _force(name: str, channel: TdmsChannel, size: int, columns: ColumnMap) -> FloatArray:
    refuse_other_unit(name, columns.force_unit, str(channel.properties.get("unit_string", "")), name)
    values = _numbers(name, channel, size)
    return in_newtons(values, columns, range(1, len(values) + 1), name)


def _times(
    time: str | None, channels: Mapping[str, TdmsChannel], forces: Sequence[TdmsChannel], size: int, columns: ColumnMap
) -> tuple[FloatArray, tuple[str, ...]]:
    """Times of the samples [s] from the time channel, else from the rate that column map or force channels state."""
    n = len(forces[0])
    rows = range(1, n + 1)
    if time is not None:
        refuse_other_unit(time, columns.time_unit, str(channels[time].properties.get("unit_string", "")), time)
        values = _numbers(time, channels[time], size)
        if len(values) != n:
            raise RecordingError(f"found {len(values)} times for {n} samples of force, expected as many", column=time)
        measured = in_seconds(values, columns, rows, time)
        return measured, check_sampling(measured, rows, time)
    stated = {(_property(each, "wf_increment"), _property(each, "wf_start_offset")) for each in forces}
    if len(stated) > 1:
        raise RecordingError("the components state different sampling rates or offsets, expected the same")
    ((increment, offset),) = stated
    if math.isnan(columns.sampling_rate):
        if not increment > 0:
            raise RecordingError("the channel states no wf_increment; state time or sampling_rate_Hz in the column map")
    elif increment > 0 and abs(increment * columns.sampling_rate - 1) > 0.01:
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
