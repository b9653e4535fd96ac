"""Which of a file's columns are read: a column map applied to its names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap
from forcemap.recordings.units import ForceUnit, TimeUnit, force_unit_in, other_unit_in, time_unit_in


@dataclass(frozen=True)
class Selection:
    """Positions of the columns that are read, counted from 0; a curve has one force column or three."""

    time: int | None
    forces: tuple[tuple[int, ...], ...]
    curve: int | None

    @property
    def numbers(self) -> tuple[int, ...]:
        """The columns that must hold numbers, the time first."""
        return (*([] if self.time is None else [self.time]), *(one for group in self.forces for one in group))

    @property
    def last(self) -> int:
        """The rightmost column that is read."""
        return max((*self.numbers, *([] if self.curve is None else [self.curve])))


def position(column: str | int, names: Sequence[str]) -> int | None:
    """Position of a column: its number less 1, or where its name stands (in any case, if that is unique)."""
    if isinstance(column, int):
        return column - 1
    wanted = column.strip()
    found = [at for at, name in enumerate(names) if name == wanted]
    if not found:
        found = [at for at, name in enumerate(names) if name.casefold() == wanted.casefold()]
    return found[0] if len(found) == 1 else None


def select(columns: ColumnMap, names: Sequence[str], width: int) -> Selection:
    """The columns of a file with these names and this many columns.

    Raises
    ------
    RecordingError
        A column that is not there, or not once.
    """

    def at(column: str | int) -> int:
        found = position(column, names)
        if found is None:
            raise RecordingError(missing_column(str(column), names), column=str(column))
        if found >= width:
            there = f"found {width} column{'s' if width > 1 else ''}"
            raise RecordingError(f"{there}, expected a column {column}; is the delimiter right?", column=str(column))
        return found

    time = None if columns.time is None else at(columns.time)
    if columns.components:
        forces = [tuple(at(column) for column in columns.components)]
    elif columns.named_runs:
        forces = [(at(column),) for column in columns.named_runs]
    else:
        forces = [(column,) for column in range(width) if column != time]
    if not forces:
        raise RecordingError("found no column beside the time, expected a force; is the delimiter right?")
    selection = Selection(time, tuple(forces), None if columns.curve is None else at(columns.curve))
    used = [*selection.numbers, *([] if selection.curve is None else [selection.curve])]
    for column in used:
        if used.count(column) > 1:
            raise RecordingError(
                "found a column that is named and numbered, expected each once", column=str(column + 1)
            )
    return selection


def refuse_other_units(columns: ColumnMap, selection: Selection, names: Sequence[str]) -> None:
    """Refuse names (or a line of units) that state another unit than the column map: one of the two is wrong."""
    if selection.time is not None and selection.time < len(names):
        refuse_unit(names[selection.time], time_unit_in(names[selection.time]), columns.time_unit, "time_unit")
    for column in (one for group in selection.forces for one in group if one < len(names)):
        refuse_unit(names[column], force_unit_in(names[column]), columns.force_unit, "force_unit")
        refuse_other_unit(names[column], names[column], columns.force_unit)


def refuse_other_unit(column: str, text: str, stated: ForceUnit) -> None:
    """Refuse a unit of force that forcemap does not know, unless the column map counts the readings."""
    unit = other_unit_in(text)
    if unit is not None and stated is not ForceUnit.COUNTS:
        raise RecordingError(
            f"the file says {unit!r}, expected N or kN; convert, or state force_unit = 'counts' with newtons_per_count",
            column=column,
        )


def refuse_unit(name: str, found: TimeUnit | ForceUnit | None, stated: TimeUnit | ForceUnit, entry: str) -> None:
    """Refuse a unit that the file states and the column map states otherwise."""
    if found is not None and found is not stated:
        raise RecordingError(
            f"the file says {found.value!r}, the column map {entry} = {stated.value!r}; correct the one that is wrong",
            column=name,
        )


def missing_column(column: str, names: Sequence[str]) -> str:
    """Why a column is not found among these names."""
    times = sum(name.casefold() == column.strip().casefold() for name in names)
    if times > 1:
        return f"found {times} columns of that name, expected one; give its number"
    return (
        f"no column has that name; found {listed(names)}" if names else "the file has no names of columns; give numbers"
    )


def listed(names: Sequence[str]) -> str:
    """The names for a message: not more than a person would read."""
    shown = ", ".join(repr(name if len(name) <= 40 else name[:37] + "...") for name in names[:20])
    return shown + (", ..." if len(names) > 20 else "")
