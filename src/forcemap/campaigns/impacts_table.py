"""The impacts table as a file: `impacts.csv`, or a DataFrame with its columns."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.campaigns.binding import binding_of
from forcemap.campaigns.columns import COLUMNS, NUMBERS, REQUIRED, Where, require_columns
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_conditions
from forcemap.campaigns.dataset import ImpactDataset, StateTolerance
from forcemap.campaigns.one_campaign import require_one_scenario, require_one_series
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.point_list import at_other_sites, measured_at_points
from forcemap.campaigns.recordings_table import REGISTER_FILE, Use, none_used, read_register
from forcemap.csv_table import Table, csv_cell, csv_text, read_table
from forcemap.errors import InputError, TableError
from forcemap.files import read_bytes, sha256, write_atomically

TABLE_FILE = "impacts.csv"


def read_dataset(
    path: str | Path,
    *,
    tolerance: StateTolerance | None = None,
    conditions: Conditions | None = None,
    device_stiffness: float | None = None,
) -> ImpactDataset:
    """Read an impacts table: a CSV file, or a campaign folder that holds `impacts.csv`.

    Commas with decimal points, or semicolons (tabs) with decimal points or commas; a byte-order mark is accepted.
    A `campaign.toml` beside the table says what the impacts were measured under; the columns
    `unused_...`, which `build_dataset` writes, what is known of recordings that are not in the table: that one of those
    clamped counts against a transient limit too. Whether the table is what its recordings gave stands in `binding`.

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
        The file is empty, not text or not a table; a column is missing; a cell cannot be used; the impacts are of
        several campaigns; the list of contact points, where something was measured at them, cannot be used.
    CampaignFileError
        The campaign.toml beside the table cannot be used.
    """
    table = Path(path) / TABLE_FILE if Path(path).is_dir() else Path(path)
    if conditions is None:
        beside = table.parent / CAMPAIGN_FILE
        conditions = read_conditions(beside) if beside.exists() else Conditions()
    if table.name == TABLE_FILE and not table.exists():
        if (table.parent / PLAN_FILE).exists():
            raise InputError(_not_there(table.parent), file=str(path))
        if Path(path).is_dir():
            message = (
                f"there is neither {TABLE_FILE} nor {PLAN_FILE}, expected a campaign's folder; forcemap plan makes one"
            )
            raise InputError(message, file=str(path))
    content = read_bytes(table)
    cells = None
    try:
        cells = read_table(content, table.name, what="impact")
        require_columns(list(cells.columns), table.name, cells.header_row)
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
        if conditions and conditions.devices and not (table.parent / PLAN_FILE).exists():
            names = zip(dataset.state.tolist(), dataset.recording.tolist(), strict=True)
            conditions.require_devices_used(names, str(table.parent / CAMPAIGN_FILE))
        where, known = Where(table.name, cells.rows), np.where(dataset.censored, np.nan, dataset.peak_force)
        require_one_scenario(dataset.scenario, dataset.recording, where)
        require_one_series(np.char.add(dataset.role, dataset.state), known, dataset.recording, dataset.extra, where)
    except TableError as error:  # name the file as it was given; the dataset keeps its bare name
        broken = cells is not None and binding_of(table, cells.texts, conditions).refusal is not None
        message = f"{error.message}; and the table is not what forcemap collect wrote" if broken else error.message
        raise TableError(message, file=str(table), row=error.row, column=error.column) from None
    bound = dataset.bound_by(binding_of(table, cells.texts, dataset.conditions)).with_unused(str(table))
    bound = replace(bound, conditions=as_entered(bound.conditions, table.parent))
    if table.name != TABLE_FILE:
        return bound
    others = at_other_sites(table.parent, dataset.conditions.contact_site)
    return replace(bound, at_points=measured_at_points(table.parent, dataset.conditions), other_sites=others)


def as_entered(conditions: Conditions, folder: Path) -> Conditions:
    """Conditions of a campaign, whose speeds count as commanded if one of its impacts has none that was measured."""
    missing = not_entered(conditions, folder)[0]
    return replace(conditions, speed_kind="commanded") if missing else conditions


def not_entered(conditions: Conditions, folder: Path) -> tuple[int, int]:
    """Of how many of the recordings in use no measured speed was entered, where speeds are said to be measured, and how
    many are in use: for those the planned speed counts."""
    register = folder / REGISTER_FILE
    entries = read_register(register) if conditions.speed_kind == "measured" and register.exists() else ()
    used = [entry.speed for entry in entries if entry.use is Use.USED]
    return sum(math.isnan(speed) for speed in used), len(used)


def _not_there(folder: Path) -> str:
    """Why a planned campaign has no impacts table, and what writes it."""
    missing, register = f"there is no {TABLE_FILE}", folder / REGISTER_FILE
    entries = read_register(register) if register.exists() else ()
    if not entries:
        return f"{missing} yet: not collected; forcemap collect {folder} writes it"
    if used := sum(entry.use is Use.USED for entry in entries):
        return f"{missing}, but {REGISTER_FILE} has {used} used recordings; forcemap collect {folder} writes it again"
    why = f"see {REGISTER_FILE}, mend that or measure again, then forcemap collect {folder}"
    return f"{missing}: collected, but {none_used(entries)}; {why}"


def write_dataset(dataset: ImpactDataset, path: str | Path) -> None:
    """Write an impacts table as CSV; `read_dataset` gives back the same figures to the last bit.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    write_atomically(path, csv_text(_cells(dataset)))


def _arguments(table: Table) -> dict[str, Any]:
    """Arguments of ImpactDataset.from_arrays from the text of the columns."""
    columns = table.columns
    arguments: dict[str, Any] = {"extra": {n: c for n, c in columns.items() if n not in COLUMNS}}
    for column, argument in COLUMNS.items():
        if (cells := columns.get(column)) is None:
            continue
        if column in NUMBERS:
            arguments[argument] = table.numbers(column, required=column in REQUIRED)
        elif column == "repeat":
            arguments[argument] = table.whole_numbers(column)
        else:
            arguments[argument] = [cell.lower() for cell in cells] if column == "role" else cells
    return arguments


def _cells(dataset: ImpactDataset) -> dict[str, list[str]]:
    """Text of every column to write; optional columns only where they say something."""
    columns: dict[str, list[str]] = {}
    stated = dataset.as_stated
    for column, name in COLUMNS.items():
        cells = [csv_cell(value) for value in getattr(stated, name).tolist()]
        if column == "pressure_censored" and "peak_pressure_N_per_cm2" not in columns:
            continue
        if column in REQUIRED or column in ("state_id", "repeat", "role", "censored") or any(cells):
            columns[column] = cells
    return columns | {name: list(values) for name, values in dataset.extra.items()}
