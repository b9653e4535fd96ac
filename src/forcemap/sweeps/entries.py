"""The entries of a study's file: each of a stated kind, none unknown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from forcemap.errors import InputError, nearest_names


class Entries:
    """A table of a study's TOML file; what was not asked for in the end is a slip.

    Parameters
    ----------
    tables : mapping
        The entries.
    file : Path
        The study's file; names of files in it are beside it.
    where : str
        Name of the table, with a point behind it.
    """

    def __init__(self, tables: Mapping[str, Any], file: Path, where: str = "") -> None:
        self._tables, self._asked = tables, list[str]()
        self.file, self.where = file, where

    def error(self, key: str, message: str) -> InputError:
        """The error of an entry."""
        return InputError(message, file=str(self.file), column=f"{self.where}{key}")

    def _take(self, key: str, default: Any) -> Any:
        self._asked.append(key)
        if key not in self._tables and default is None:
            raise self.error(key, "the entry is missing")
        return self._tables.get(key, default)

    def texts(self, key: str, default: list[str] | None = None) -> list[str]:
        """A list of different texts."""
        found = self._take(key, default)
        if not isinstance(found, list) or not all(isinstance(text, str) and text for text in found):
            raise self.error(key, f"found {found!r}, expected a list of texts")
        return self._different(key, found)

    def text(self, key: str, default: str | None = None) -> str:
        """A text."""
        found = self._take(key, default)
        if not isinstance(found, str):
            raise self.error(key, f"found {found!r}, expected a text")
        return found

    def numbers(self, key: str, default: list[float] | None = None) -> list[float]:
        """A list of different finite numbers of at least 0; empty where that is the default."""
        found = self._take(key, default)
        if default == [] == found:
            return []
        if not isinstance(found, list) or not found or not all(map(_number, found)):
            raise self.error(key, f"found {found!r}, expected a list of finite numbers of at least 0")
        return self._different(key, [float(value) for value in found])

    def span(self, key: str) -> tuple[float, float]:
        """The ends of a range, the lower first."""
        low, *high = self.numbers(key)
        if len(high) != 1 or low >= high[0]:
            raise self.error(key, f"found {[low, *high]}, expected two numbers, the lower first")
        return low, high[0]

    def number(self, key: str, default: float) -> float:
        """A positive finite number."""
        found = self._take(key, default)
        if not _number(found) or found == 0:
            raise self.error(key, f"found {found!r}, expected a positive finite number")
        return float(found)

    def whole(self, key: str, default: int | None = None) -> int:
        """A whole number of at least 1."""
        found = self._take(key, default)
        if not isinstance(found, int) or isinstance(found, bool) or found < 1:
            raise self.error(key, f"found {found!r}, expected a whole number of at least 1")
        return found

    def tables(self, key: str) -> Iterator[Entries]:
        """The tables of a list, [[key]]; each is finished when the next is asked for."""
        found = self._take(key, None)
        if not isinstance(found, list) or not found or not all(isinstance(table, Mapping) for table in found):
            raise self.error(key, f"expected tables [[{key}]], at least one")
        for number, table in enumerate(found, start=1):
            yield (entries := Entries(table, self.file, f"{key}[{number}]."))
            entries.finish()

    def finish(self) -> None:
        """Refuse what was not asked for."""
        for key in self._tables:
            if key not in self._asked:
                near = ", ".join(nearest_names(key, self._asked, 3))
                raise self.error(key, f"unknown entry; the nearest known ones are {near}")

    def _different(self, key: str, found: list[Any]) -> list[Any]:
        if len(set(found)) != len(found):
            raise self.error(key, f"found {found!r}, expected no value twice")
        return found


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < math.inf
