"""The impacts table as a file: `impacts.csv`, or a DataFrame with its columns."""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forcemap.campaigns.columns import COLUMNS
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, StateTolerance
from forcemap.errors import TableError
from forcemap.files import read_bytes, sha256, write_atomically

if TYPE_CHECKING:
    import pandas as pd

TABLE_FILE = "impacts.csv"

_REQUIRED = tuple(COLUMNS)[:4]
_DECISIVE = {  # words in a column's name that tell what it decides
    "censored": ("censored", "zensiert", "saturat", "clipped", "overload", "overrange"),
    "scenario": ("scenario", "clamp"),
    "phase2_force_N": ("phase2", "phaseii"),
}
_NUMBERS = (*_REQUIRED, "base_angle_deg", "phase2_force_N")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_TRUTH = {"true": True, "1": True, "false": False, "0": False, "": False}


def read_dataset(
    path: str | Path, *, tolerance: StateTolerance | None = None, conditions: Conditions | None = None
) -> ImpactDataset:
    """Read an impacts table: a CSV file, or a campaign folder that holds `impacts.csv`.

    Commas with decimal points, or semicolons (tabs) with decimal points or commas; a byte-order mark is accepted.
    A `campaign.toml` beside the table says what the impacts were measured under.

    Parameters
    ----------
    path : str or Path
        The file or folder.
    tolerance : StateTolerance, optional
        How far repeats of a state may lie apart; 5 mm and 10 mm/s if not given.
    conditions : Conditions, optional
        Used in place of the campaign.toml beside the table.

    Returns
    -------
    ImpactDataset

    Raises
    ------
    TableError
        The file is empty, not text or not a table; a column is missing; a cell cannot be used.
    CampaignFileError
        The campaign.toml beside the table cannot be used.
    """
    table = Path(path) / TABLE_FILE if Path(path).is_dir() else Path(path)
    content = read_bytes(table)
    if conditions is None:
        beside = table.parent / CAMPAIGN_FILE
        conditions = read_conditions(beside) if beside.exists() else Conditions()
    try:
        columns, rows = _read_columns(content, table.name)
        return ImpactDataset.from_arrays(
            **_arguments(columns, rows, table.name),
            conditions=conditions,
            tolerance=tolerance,
            source=table.name,
            sha256=sha256(content),
            rows=rows,
        )
    except TableError as error:  # name the file as it was given; the dataset keeps its bare name
        raise TableError(error.message, file=str(table), row=error.row, column=error.column) from None


def write_dataset(dataset: ImpactDataset, path: str | Path) -> None:
    """Write an impacts table as CSV; `read_dataset` gives back the same figures to the last bit.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    columns = _cells(dataset)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    write_atomically(path, stream.getvalue())


def to_frame(dataset: ImpactDataset) -> pd.DataFrame:
    """The impacts as a DataFrame with the columns of the impacts table."""
    import pandas as pd

    frame = {column: getattr(dataset, name) for column, name in COLUMNS.items()}
    frame["scenario"] = [None if scenario is None else scenario.value for scenario in dataset.scenario]
    return pd.DataFrame(frame | {name: list(values) for name, values in dataset.extra.items()})


def from_frame(frame: pd.DataFrame, **options: Any) -> ImpactDataset:
    """Impacts from a DataFrame; columns as in the impacts table, options as in `ImpactDataset.from_arrays`."""
    names = [str(column) for column in frame.columns]
    _require_columns(names, "data frame")
    columns: dict[str, Any] = {str(name): frame[name].to_numpy() for name in frame.columns}
    for name in columns.keys() & {"state_id", "role", "scenario", "recording", "flags"}:
        missing = frame[name].isna().tolist()
        columns[name] = [None if absent else cell for cell, absent in zip(columns[name], missing, strict=True)]
    if "censored" in columns and columns["censored"].dtype != bool:
        columns["censored"] = [_truth(str(cell), "data frame", i + 1) for i, cell in enumerate(columns["censored"])]
    known: dict[str, Any] = {arg: columns[column] for column, arg in COLUMNS.items() if column in columns}
    extra = {name: [str(cell) for cell in cells] for name, cells in columns.items() if name not in COLUMNS}
    return ImpactDataset.from_arrays(**known, extra=extra, **options)


def _read_columns(content: bytes, file: str) -> tuple[dict[str, list[str]], list[int]]:
    """Text of every column, and the line number of every row."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content[: error.start].count(b"\n") + 1
        raise TableError("not text in UTF-8; save the table as CSV in UTF-8", file=file, row=row) from None
    if "\0" in text:
        raise TableError("a binary file, expected a CSV table", file=file, row=text[: text.index("\0")].count("\n") + 1)
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise TableError("the file is empty, expected a header and at least one impact", file=file)
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    records: list[tuple[int, list[str]]] = []
    try:
        for record in reader:
            if any(cell.strip() for cell in record):
                records.append((reader.line_num, [cell.strip() for cell in record]))
    except csv.Error as error:
        raise TableError(f"not a CSV table ({error})", file=file, row=reader.line_num) from None
    if not records:
        raise TableError("found no header, expected the columns " + ", ".join(_REQUIRED), file=file)
    (header_row, header), *body = records
    while header and not header[-1] and all(len(record) == len(header) and not record[-1] for _, record in body):
        header.pop()  # empty columns at the end, as spreadsheets write them
        for _, record in body:
            record.pop()
    _require_columns(header, file, header_row)
    for row, record in body:
        if len(record) != len(header):
            raise TableError(f"found {len(record)} cells, expected {len(header)} as in the header", file=file, row=row)
    if not body:
        raise TableError("found a header and no impact, expected at least one", file=file, row=header_row)
    columns = {name: [record[i] for _, record in body] for i, name in enumerate(header)}
    rows = [row for row, _ in body]
    if delimiter != ",":
        _decimal_points(columns, rows, file)
    return columns, rows


def _require_columns(header: Sequence[str], file: str, row: int | None = None) -> None:
    for name in header:
        if header.count(name) > 1:
            raise TableError(f"found column {name!r} twice, expected it once", file=file, row=row, column=name)
        meant = _meant(name)
        if meant:
            raise TableError(
                f"found a column {name!r} that would not be read; name it {meant!r} if that is what it holds, "
                "else give it a name that differs more",
                file=file,
                row=row,
                column=name,
            )
    for name in _REQUIRED:
        if name not in header:
            unknown = [column for column in header if column not in COLUMNS]
            near = difflib.get_close_matches(name, unknown, n=1, cutoff=0.6)
            similar = f"; {near[0]!r} may be it: convert to the unit in the name and rename it" if near else ""
            if len(header) == 1:
                similar = "; expected commas, semicolons or tabs between columns"
            raise TableError(
                f"the column is missing, expected at least {', '.join(_REQUIRED)}{similar}",
                file=file,
                row=row,
                column=name,
            )


def _meant(name: str) -> str:
    """The optional column that an unknown column's name is a slip of; empty if none is.

    A saturated or clamping impact in a column that nobody reads would be taken for a good one.
    """
    if name in COLUMNS:
        return ""
    plain = re.sub(r"[^a-z0-9]", "", name.lower())
    for column in COLUMNS:
        known = re.sub(r"[^a-z0-9]", "", column.lower())
        slip = difflib.SequenceMatcher(None, plain, known).ratio() > 0.85 and column not in _REQUIRED
        if plain == known or slip or any(word in plain for word in _DECISIVE.get(column, ())):
            return column
    return ""


def _decimal_points(columns: dict[str, list[str]], rows: list[int], file: str) -> None:
    """Turn decimal commas into points, in place; a file that mixes both is refused as ambiguous."""
    numeric = [name for name in _NUMBERS if name in columns]
    commas = any("," in cell for name in numeric for cell in columns[name])
    for name in numeric if commas else ():
        for position, cell in enumerate(columns[name]):
            if "." in cell:
                raise TableError(
                    f"found {cell!r} in a table with decimal commas, expected one decimal sign throughout",
                    file=file,
                    row=rows[position],
                    column=name,
                )
        columns[name] = [cell.replace(",", ".") for cell in columns[name]]


def _arguments(columns: Mapping[str, list[str]], rows: list[int], file: str) -> dict[str, Any]:
    """Arguments of ImpactDataset.from_arrays from the text of the columns."""
    arguments: dict[str, Any] = {"extra": {n: c for n, c in columns.items() if n not in COLUMNS}}
    for column, argument in COLUMNS.items():
        if column not in columns:
            continue
        cells = columns[column]
        if column in _NUMBERS:
            required = column in _REQUIRED
            arguments[argument] = [_number(c, required, file, row, column) for c, row in zip(cells, rows, strict=True)]
        elif column == "repeat":
            arguments[argument] = [_whole(c, file, row) for c, row in zip(cells, rows, strict=True)]
        elif column == "censored":
            arguments[argument] = [_truth(c, file, row) for c, row in zip(cells, rows, strict=True)]
        else:
            arguments[argument] = [cell.lower() for cell in cells] if column == "role" else cells
    return arguments


def _number(cell: str, required: bool, file: str, row: int, column: str) -> float:
    if cell == "" and not required:
        return math.nan
    if not _NUMBER.fullmatch(cell):
        raise TableError(f"found {cell!r}, expected a number", file=file, row=row, column=column)
    return float(cell)


def _whole(cell: str, file: str, row: int) -> int:
    if not re.fullmatch(r"\d{1,9}", cell, re.ASCII):
        raise TableError(f"found {cell!r}, expected a whole number", file=file, row=row, column="repeat")
    return int(cell)


def _truth(cell: str, file: str, row: int) -> bool:
    if cell.lower() not in _TRUTH:
        raise TableError(f"found {cell!r}, expected true or false", file=file, row=row, column="censored")
    return _TRUTH[cell.lower()]


def _cells(dataset: ImpactDataset) -> dict[str, list[str]]:
    """Text of every column to write; optional columns only where they say something."""
    columns: dict[str, list[str]] = {}
    for column, name in COLUMNS.items():
        values = getattr(dataset, name)
        if column in _NUMBERS:
            cells = ["" if math.isnan(value) else repr(value) for value in values.tolist()]
        elif column == "censored":
            cells = ["true" if value else "false" for value in values]
        else:
            cells = ["" if value is None else str(value) for value in values]
        if column in _REQUIRED or column in ("state_id", "repeat", "role", "censored") or any(cells):
            columns[column] = cells
    return columns | {name: list(values) for name, values in dataset.extra.items()}
