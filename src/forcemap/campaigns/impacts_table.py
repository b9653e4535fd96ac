"""The impacts table as a file: `impacts.csv`, or a DataFrame with its columns."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forcemap.campaigns.binding import binding_of
from forcemap.campaigns.columns import COLUMNS, NUMBERS
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, StateTolerance
from forcemap.campaigns.remark import REMARK, including
from forcemap.campaigns.table import Table, csv_text, read_table
from forcemap.errors import InputError, TableError
from forcemap.files import read_bytes, sha256, write_atomically

if TYPE_CHECKING:
    import pandas as pd

TABLE_FILE = "impacts.csv"
PLAN_FILE = "plan.csv"

_REQUIRED = tuple(COLUMNS)[:4]
_DECISIVE = {  # words in a column's name that tell what it decides
    "censored": ("censored", "zensiert", "saturat", "clipped", "overload", "overrange"),
    "scenario": ("scenario", "clamp"),
    "phase2_force_N": ("phase2", "phaseii"),
}
_TRUTH = {"true": True, "1": True, "false": False, "0": False, "": False}


def read_dataset(
    path: str | Path,
    *,
    tolerance: StateTolerance | None = None,
    conditions: Conditions | None = None,
    device_stiffness: float | None = None,
) -> ImpactDataset:
    """Read an impacts table: a CSV file, or a campaign folder that holds `impacts.csv`.

    Commas with decimal points, or semicolons (tabs) with decimal points or commas; a byte-order mark is accepted.
    A `campaign.toml` beside the table says what the impacts were measured under; the column
    `not_in_table`, which `build_dataset` writes, what was discarded: that one of those clamped counts against a
    transient limit too. Whether the table is what its recordings gave stands in `binding`.

    Parameters
    ----------
    path : str or Path
        The file or folder.
    tolerance : StateTolerance, optional
        How far repeats of a state may lie apart; 5 mm and 10 mm/s if not given.
    conditions : Conditions, optional
        Used in place of the campaign.toml beside the table.
    device_stiffness : float, optional
        Spring constant of the measuring device [N/m], where campaign.toml does not state it.

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
    if Path(path).is_dir() and not table.exists() and (Path(path) / PLAN_FILE).exists():
        raise InputError(f"there is no {TABLE_FILE} yet; forcemap collect {path} writes it", file=str(path))
    content = read_bytes(table)
    if conditions is None:
        beside = table.parent / CAMPAIGN_FILE
        conditions = read_conditions(beside) if beside.exists() else Conditions()
    cells = None
    try:
        cells = read_table(content, table.name, what="impact")
        _require_columns(list(cells.columns), table.name, cells.header_row)
        if not cells.rows:
            message = "found a header and no impact, expected at least one; forcemap collect says why of each recording"
            raise TableError(message, file=table.name, row=cells.header_row)
        dataset = ImpactDataset.from_arrays(
            **_arguments(cells.with_decimal_points(NUMBERS)),
            conditions=conditions,
            device_stiffness=device_stiffness,
            tolerance=tolerance,
            source=table.name,
            sha256=sha256(content),
            rows=cells.rows,
        )
    except TableError as error:  # name the file as it was given; the dataset keeps its bare name
        changed = binding_of(table, cells.texts, conditions).refusal if cells else ""
        message = f"{error.message}; and {changed}" if changed else error.message
        raise TableError(message, file=str(table), row=error.row, column=error.column) from None
    binding = binding_of(table, cells.texts, dataset.conditions)
    return _with_remark(replace(dataset, binding=binding), str(table))


def _with_remark(dataset: ImpactDataset, file: str) -> ImpactDataset:
    """The dataset with what its table says of impacts that are not in it."""
    remarks = set(dataset.extra.get(REMARK, ()))
    if not remarks:
        return dataset
    if len(remarks) > 1:
        raise TableError("found several remarks, expected the same in every row", file=file, column=REMARK)
    try:
        return replace(dataset, phase_two=including(dataset.phase_two, remarks.pop()))
    except InputError as error:
        raise TableError(error.message, file=file, column=REMARK) from None


def write_dataset(dataset: ImpactDataset, path: str | Path) -> None:
    """Write an impacts table as CSV; `read_dataset` gives back the same figures to the last bit.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    write_atomically(path, csv_text(_cells(dataset)))


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
    return _with_remark(ImpactDataset.from_arrays(**known, extra=extra, **options), "data frame")


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
    if name in COLUMNS or name == REMARK:
        return ""
    plain = re.sub(r"[^a-z0-9]", "", name.lower())
    for column in COLUMNS:
        known = re.sub(r"[^a-z0-9]", "", column.lower())
        slip = difflib.SequenceMatcher(None, plain, known).ratio() > 0.85 and column not in _REQUIRED
        if plain == known or slip or any(word in plain for word in _DECISIVE.get(column, ())):
            return column
    return ""


def _arguments(table: Table) -> dict[str, Any]:
    """Arguments of ImpactDataset.from_arrays from the text of the columns."""
    columns = table.columns
    arguments: dict[str, Any] = {"extra": {n: c for n, c in columns.items() if n not in COLUMNS}}
    for column, argument in COLUMNS.items():
        if column not in columns:
            continue
        cells = columns[column]
        if column in NUMBERS:
            arguments[argument] = table.numbers(column, required=column in _REQUIRED)
        elif column == "repeat":
            arguments[argument] = table.whole_numbers(column)
        elif column == "censored":
            arguments[argument] = [_truth(c, table.file, row) for c, row in zip(cells, table.rows, strict=True)]
        else:
            arguments[argument] = [cell.lower() for cell in cells] if column == "role" else cells
    return arguments


def _truth(cell: str, file: str, row: int) -> bool:
    if cell.lower() not in _TRUTH:
        raise TableError(f"found {cell!r}, expected true or false", file=file, row=row, column="censored")
    return _TRUTH[cell.lower()]


def _cells(dataset: ImpactDataset) -> dict[str, list[str]]:
    """Text of every column to write; optional columns only where they say something."""
    columns: dict[str, list[str]] = {}
    for column, name in COLUMNS.items():
        values = getattr(dataset, name)
        if column in NUMBERS:
            cells = ["" if math.isnan(value) else repr(value) for value in values.tolist()]
        elif column == "censored":
            cells = ["true" if value else "false" for value in values]
        else:
            cells = ["" if value is None else str(value) for value in values]
        if column in _REQUIRED or column in ("state_id", "repeat", "role", "censored") or any(cells):
            columns[column] = cells
    return columns | {name: list(values) for name, values in dataset.extra.items()}
