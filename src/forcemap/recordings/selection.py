"""Which columns of a file are read: their positions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from forcemap.errors import RecordingError
from forcemap.recordings.column_map import ColumnMap, Names, missing_column


@dataclass(frozen=True)
class Selection:
    """Positions of the columns that are read, counted from 0; a curve has one force column or three."""

    time: int | None
    forces: tuple[tuple[int, ...], ...]
    curve: int | None

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The columns that must hold numbers, the time first."""
        return (*([] if self.time is None else [self.time]), *(column for group in self.forces for column in group))

    @cached_property
    def used(self) -> tuple[int, ...]:
        """All columns that are read."""
        return (*self.numbers, *([] if self.curve is None else [self.curve]))


def select(columns: ColumnMap, names: Sequence[str], width: int) -> Selection:
    """The columns of a file with these names and this many columns.

    Raises
    ------
    RecordingError
        A column that is missing, or read twice.
    """
    known = Names(names)

    def position_of(column: str | int) -> int:
        if (position := known.position(column)) is None:
            raise RecordingError(missing_column(str(column), names), column=str(column))
        if position >= width:
            raise too_narrow(width, column)
        return position

    time = None if columns.time is None else position_of(columns.time)
    forces = [tuple(map(position_of, group)) for group in columns.groups]
    if not (forces := forces or [(column,) for column in range(width) if column != time]):
        raise RecordingError("found no column beside the time, expected a force; is the delimiter right?")
    selection = Selection(time, tuple(forces), None if columns.curve is None else position_of(columns.curve))
    if len(set(selection.used)) < len(selection.used):
        twice = Counter(selection.used).most_common(1)[0][0]
        message = "found a column that is named and numbered, expected each once"
        raise RecordingError(message, column=str(twice + 1))
    return selection


def too_narrow(width: int, column: str | int) -> RecordingError:
    """The error for a column beyond the width of the file."""
    problem = f"found {width} column{'s' if width != 1 else ''}, expected a column {column}"
    return RecordingError(f"{problem}; is the delimiter right?", column=str(column))
