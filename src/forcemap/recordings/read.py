"""A file of a force measuring device -> its recordings."""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.errors import RecordingError
from forcemap.files import read_bytes, sha256
from forcemap.recordings.column_map import ColumnMap, listed
from forcemap.recordings.delimited import read_delimited
from forcemap.recordings.device import Device
from forcemap.recordings.overrange import lower_bounds
from forcemap.recordings.recording import Recording
from forcemap.recordings.tdms import SIGNATURE, read_tdms

_LARGEST_FILE = 500_000_000  # bytes


def read_recordings(
    path: str | Path, *, columns: ColumnMap | Mapping[str, Any] | None = None, device: Device | None = None
) -> list[Recording]:
    """Read the recordings in a file, in order of appearance.

    Files ending with .tdms, or beginning as TDMS files do, are read as TDMS, all others as delimited text. Without a
    column map a text needs a header that names one time and one force with their units, such as `time_ms;force_N`, and
    nothing else.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : ColumnMap or mapping, optional
        How the device writes its files, or the table of campaign.toml that says it.
    device : Device, optional
        What it was measured with.

    Returns
    -------
    list of Recording

    Raises
    ------
    RecordingError
        Anything in the file that could be read wrongly; nothing is repaired.
    InputError
        No such file, or a column map that cannot be used.
    MissingExtra
        A TDMS file without the package that reads it.
    """
    if columns is not None and not isinstance(columns, ColumnMap):
        columns = ColumnMap.from_table(columns)
    file = str(path)
    content = _content(path)
    is_tdms = Path(path).suffix.lower() == ".tdms" or content.startswith(SIGNATURE)
    read = read_tdms if is_tdms else read_delimited
    try:
        curves = read(content, columns)
        checksum = sha256(content)
        recordings = []
        for curve in curves:
            forces = curve.forces[0] if len(curve.forces) == 1 else np.stack(curve.forces, axis=1)
            force, beyond = lower_bounds(forces, device.range if device else math.nan)
            recordings.append(
                Recording(
                    time=curve.time,
                    force=force,
                    direction=columns.direction if columns else None,
                    device=device or Device(),
                    beyond_range=beyond if beyond.any() else None,
                    file=file,
                    curve=curve.name if len(curves) > 1 else "",  # one alone has no name
                    sha256=checksum,
                    size=len(content),
                    notes=curve.notes,
                    metadata=curve.metadata,
                    unit_stated=curve.unit_stated,
                )
            )
        return recordings
    except RecordingError as error:
        # names and remarks come from the file: on one line they cannot imitate another message
        message, column = (" ".join(text.split())[:1000] for text in (error.message, error.column or ""))
        raise RecordingError(message, file=file, row=error.row, column=column[:100] or None) from None


def read_recording(
    path: str | Path, *, columns: ColumnMap | Mapping[str, Any] | None = None, device: Device | None = None
) -> Recording:
    """Read the only recording in a file; arguments as in read_recordings.

    Raises
    ------
    RecordingError
        More than one recording, or anything in the file that could be read wrongly.
    InputError
        No such file, or a column map that cannot be used.
    MissingExtra
        A TDMS file without the package that reads it.
    """
    recordings = read_recordings(path, columns=columns, device=device)
    if len(recordings) > 1:
        names = listed([recording.curve for recording in recordings])
        problem = f"found {len(recordings)} curves ({names})"
        raise RecordingError(f"{problem}, expected one; read them all with read_recordings", file=str(path))
    return recordings[0]


def _content(path: str | Path) -> bytes:
    if "\0" in (file := str(path)):
        raise RecordingError(f"found {file!r}, expected the name of a file")
    with suppress(OSError):
        status = os.stat(path)
        if not stat.S_ISREG(status.st_mode):
            raise RecordingError("this is no file, expected a file of recordings", file=file)
        if status.st_size > _LARGEST_FILE:
            size, most = status.st_size / 1e6, _LARGEST_FILE / 1e6
            raise RecordingError(f"found {size:.0f} MB, expected at most {most:.0f} MB; export a part of it", file=file)
    return read_bytes(path)
