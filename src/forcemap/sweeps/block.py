"""A block of a study: what it computes, the draws that are its own, and the text of its part."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from forcemap._version import __version__
from forcemap.arrays import FloatArray
from forcemap.errors import ForcemapError, InputError, one_line

SOFTWARE = f"forcemap {__version__}"
SCHEMA = "forcemap-part/1"

_ENTROPY = 32  # hexadecimal digits of the study's hash that seed its draws: 128 bits, as numpy asks


@dataclass(frozen=True)
class Computed:
    """What a block gave: columns of numbers of one length, units in their names, and what must be said beside them."""

    columns: Mapping[str, FloatArray]
    notes: tuple[str, ...]


class Case(Protocol):
    """One combination of what a study goes through; its blocks differ in their draws alone."""

    means: ClassVar[tuple[str, ...]]
    """Columns whose mean the summary gives."""
    best: ClassVar[tuple[str, bool]]
    """A column, and True if the row with its highest value stands in the summary, False for the lowest."""

    @property
    def name(self) -> str:
        """What is combined, in words."""

    @property
    def blocks(self) -> int:
        """Number of its blocks."""

    def compute(self, number: int, rng: np.random.Generator) -> Computed:
        """What its block of that number, from 0, gives."""


@dataclass(frozen=True)
class Block:
    """A block of a study.

    Parameters
    ----------
    study : str
        SHA-256 of the study.
    index : int
        Its place in the study, from 0.
    case : Case
        What it belongs to.
    number : int
        Its place in the case, from 0.
    software : str
        What the sweep was begun with.
    """

    study: str
    index: int
    case: Case
    number: int
    software: str = SOFTWARE

    @property
    def name(self) -> str:
        """Its name: the case, and which of its blocks."""
        return f"{self.case.name}, block {self.number + 1} of {self.case.blocks}"

    @property
    def rng(self) -> np.random.Generator:
        """The source of its draws: from the study and the index, the same in whatever process and order."""
        return np.random.default_rng([int(self.study[:_ENTROPY], 16), self.index])


@dataclass(frozen=True)
class Outcome:
    """What became of a block: the text of its part, or why there is none; processor time [s]."""

    text: str = ""
    reason: str = ""
    processor: float = 0.0


def compute(block: Block) -> Outcome:
    """The part of a block; what goes wrong is its reason, so that one block stops no other."""
    begun = time.process_time()
    try:
        if block.software != SOFTWARE:
            problem = f"found {SOFTWARE} where this block was to be computed, expected {block.software}"
            raise InputError(f"{problem} as the rest of the sweep; install one version everywhere")
        text, reason = part_text(block, block.case.compute(block.number, block.rng)), ""
    except ForcemapError as error:
        text, reason = "", str(error)
    return Outcome(text, reason, time.process_time() - begun)


def part_text(block: Block, computed: Computed) -> str:
    """The part as CSV, numbers with every digit, nothing for NaN; before it remarks: what it is, what must be said."""
    head = {"schema": SCHEMA, "study": block.study, "index": block.index, "block": block.name}
    lines = [json.dumps(head | {"software": block.software}), *map(one_line, computed.notes)]
    rows = zip(*(np.asarray(column, dtype=np.float64).tolist() for column in computed.columns.values()), strict=True)
    table = [",".join(computed.columns), *(",".join(["" if x != x else repr(x) for x in row]) for row in rows)]
    return "\n".join([*(f"# {line}" for line in lines), *table, ""])


def part_content(text: str) -> tuple[dict[str, object], tuple[str, ...], dict[str, FloatArray]]:
    """Head, notes and columns of a part."""
    lines = text.splitlines()
    remarks = [line[2:] for line in lines if line.startswith("# ")]
    names, *rows = lines[len(remarks) :]
    cells = ",".join(rows).split(",") if rows else []
    values = np.array([float(cell or "nan") for cell in cells]).reshape(len(rows), -1).T
    return json.loads(remarks[0]), tuple(remarks[1:]), dict(zip(names.split(","), values, strict=True))
