"""What the register holds as a file for other programs: CSV, JSON or, with pyarrow, Parquet."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import Connection, select

from forcemap.errors import InputError, MissingExtra
from forcemap.files import flush_to_disk, hidden_file
from forcemap.register.connection import Register
from forcemap.register.states import ReleaseState, cell_states
from forcemap.register.tables import METADATA, RELEASES
from forcemap.words import sentences

_AT_ONCE = 10_000  # rows that are fetched together; a choice
_STATE = ("cell", "in_force", "why_not", "points_not_permitted")

TABLES = tuple(sorted(METADATA.tables))
"""The tables that can be exported."""


def export(register: Register, table: str, file: str | Path) -> int:
    """Write a table of the register into a new file; the number of rows. Releases say whether they are in force.

    Parameters
    ----------
    register : Register
    table : str
        One of `TABLES`.
    file : str or Path
        Its name ends with .csv, .json or .parquet.

    Raises
    ------
    InputError
        No such table, another ending, a file that is there already or cannot be written.
    MissingExtra
        pyarrow is not installed.
    """
    if table not in TABLES:
        raise InputError(f"table: found {table[:100]!r}, expected one of {', '.join(TABLES)}")
    target = Path(file)
    if (write := _WRITERS.get(target.suffix.lower())) is None:
        raise InputError(f"found another ending, expected {', '.join(_WRITERS)}", file=str(file))
    if target.exists():
        raise InputError("the file is there already; choose another name", file=str(file))
    names = [column.name for column in METADATA.tables[table].columns]
    standing = _standing(register) if table == RELEASES.name else {}
    names += _STATE if table == RELEASES.name else ()
    count = 0

    def counted(connection: Connection) -> Iterator[dict[str, Any]]:
        nonlocal count
        query = select(METADATA.tables[table]).order_by(METADATA.tables[table].c.id)
        for row in connection.execution_options(yield_per=_AT_ONCE).execute(query).mappings():
            count += 1
            yield {**row, **standing.get(row["id"], {})}

    try:
        with register.reading() as connection, hidden_file(target.parent) as (hidden, stream):
            write(names, counted(connection), stream)
            stream.flush()
            os.fsync(stream.fileno())
            os.replace(hidden, target)
            flush_to_disk(target.parent)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=str(file)) from None
    return count


def _standing(register: Register) -> dict[int, Mapping[str, Any]]:
    """Whether each release is in force, why not, and beside which contact points that are not permitted."""
    releases = (release for state in cell_states(register) for release in state.releases)
    return {each.release: dict(zip(_STATE, _state_of(each), strict=True)) for each in releases}


def _state_of(release: ReleaseState) -> tuple[str, int, str, str]:
    points = "not known" if release.points_refused is None else "; ".join(release.points_refused)
    return release.cell, int(release.in_force), "; ".join(sentences(release.failed)), points


def _csv(names: list[str], rows: Iterable[dict[str, Any]], stream: BinaryIO) -> None:
    text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_cell(row.get(name)) for name in names] for row in rows)
    text.flush()
    text.detach()


def _cell(value: Any) -> Any:
    """A value for a cell; a text that a spreadsheet would take for a formula is quoted."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@")) else value


def _json(names: list[str], rows: Iterable[dict[str, Any]], stream: BinaryIO) -> None:
    between = b"[\n"
    for row in rows:
        stream.write(between + json.dumps({name: row.get(name) for name in names}, ensure_ascii=False).encode())
        between = b",\n"
    stream.write(b"[]\n" if between == b"[\n" else b"\n]\n")


def _parquet(names: list[str], rows: Iterable[dict[str, Any]], stream: BinaryIO) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError as error:
        raise MissingExtra(f"Parquet needs the package {error.name}; install it with: pip install pyarrow") from None
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for row in rows:
        for name, column in columns.items():
            column.append(row.get(name))
    parquet.write_table(pyarrow.table(columns), stream)


_WRITERS: dict[str, Callable[[list[str], Iterable[dict[str, Any]], BinaryIO], None]] = {
    ".csv": _csv,
    ".json": _json,
    ".parquet": _parquet,
}
