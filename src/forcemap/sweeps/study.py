"""A study: a file that says what to go through, cut into named blocks."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from pathlib import Path

from forcemap.errors import InputError, UnknownName, one_line
from forcemap.files import file_sha256, read_bytes, sha256, toml_tables
from forcemap.sweeps.block import Block, Case
from forcemap.sweeps.entries import Entries
from forcemap.sweeps.impacts import impact_cases
from forcemap.sweeps.placement import placement_cases
from forcemap.sweeps.validity import validity_cases

SCHEMA = "forcemap-study/1"
KINDS: dict[str, Callable[[Entries], Iterator[Case]]] = {
    "impacts": impact_cases,
    "placement": placement_cases,
    "validity": validity_cases,
}
_MOST_BLOCKS = 1_000_000  # a choice: as many files as a disk takes


@dataclass(frozen=True)
class Study:
    """A study.

    Parameters
    ----------
    name, kind : str
        Name of its file, and what it goes through.
    sha256 : str
        Of its entries and of the files that it names: other comments are the same study.
    cases : tuple of Case
        What is combined.
    """

    name: str
    kind: str
    sha256: str
    cases: tuple[Case, ...]

    @cached_property
    def ends(self) -> list[int]:
        """Number of blocks up to the end of each case."""
        return list(accumulate(case.blocks for case in self.cases))

    def __len__(self) -> int:
        return self.ends[-1]

    def block(self, index: int) -> Block:
        """The block of an index, from 0."""
        ends = self.ends
        case = bisect_right(ends, index)
        return Block(self.sha256, index, self.cases[case], index - ends[case] + self.cases[case].blocks)


def read_study(path: str | Path) -> Study:
    """Read a study's file (TOML).

    Raises
    ------
    InputError
        Not TOML, not of this schema, an unknown or missing entry, a file it names that cannot be used, or more blocks
        than a million; file and column say where.
    """
    file = Path(path)
    try:
        tables = toml_tables(read_bytes(file))
    except InputError as error:
        raise InputError(error.message, file=str(file), column=error.column) from None
    entries = Entries(tables, file)
    if (schema := entries.text("schema", "")) != SCHEMA:
        raise entries.error("schema", f"found {schema!r}, expected schema = {SCHEMA!r}")
    if (kind := entries.text("kind")) not in KINDS:
        raise entries.error("kind", UnknownName("kind of study", kind, KINDS).message)
    entries.text("note", "")
    cases = tuple(KINDS[kind](entries))
    entries.finish()
    study = Study(one_line(file.name), kind, _sha256(tables, file.parent), cases)
    if not 0 < len(study) <= _MOST_BLOCKS:
        raise InputError(
            f"found a study of {len(study)} blocks, expected 1 to {_MOST_BLOCKS}; make the blocks larger",
            file=str(file),
        )
    return study


def _sha256(tables: dict[str, object], beside: Path) -> str:
    """Of the entries, and of every file that a text among them names."""
    texts = [text for value in tables.values() for text in (value if isinstance(value, list) else [value])]
    files = sorted({text for text in texts if isinstance(text, str) and text and (beside / text).is_file()})
    hashes = {name: file_sha256(beside / name) for name in files}
    return sha256(json.dumps([tables, hashes], sort_keys=True, default=str))
