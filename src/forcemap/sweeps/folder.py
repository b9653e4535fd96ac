"""The folder of a sweep: what study it is of, a file for each block that is there, and the summary."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from forcemap.csv_table import csv_cell, csv_text
from forcemap.errors import InputError, one_line
from forcemap.files import read_bytes, sha256, write_atomically
from forcemap.sweeps.block import SOFTWARE, Block, Case, part_content
from forcemap.sweeps.study import Study

_ABOUT, _PARTS, SUMMARY_FILE = "study.json", "parts", "summary.csv"
_IN_A_FOLDER = 1000  # parts; a choice: a folder that is listed at every write stays short
_PART = re.compile(r"(\d{6})-([0-9a-f]{64})\.csv")


@dataclass(frozen=True)
class SweepFolder:
    """Where the parts of a study are; several processes and machines may write into it at once.

    A part is named for its block and for the SHA-256 of its content, and written in one step. So a block that was
    computed twice is one file, two results of one block are two, and what is half or altered is found.

    Parameters
    ----------
    folder : Path
    study : Study
    """

    folder: Path
    study: Study

    @classmethod
    def of(cls, folder: str | Path, study: Study) -> SweepFolder:
        """A new or empty folder, or one that this study was begun in with this version of the software.

        Raises
        ------
        InputError
            It holds other files, another study's parts or another version's, or cannot be made.
        """
        root = Path(folder)
        about = {"study": study.name, "kind": study.kind, "sha256": study.sha256, "software": SOFTWARE}
        text = json.dumps({"schema": "forcemap-sweep/1", **about, "blocks": len(study)}, indent=1) + "\n"
        try:
            root.mkdir(parents=True, exist_ok=True)
            if not (root / _ABOUT).exists():
                names = {path.name for path in root.iterdir() if not path.name.startswith(".")}
                if names - {_ABOUT, _PARTS}:  # another process may have begun it just now
                    problem = "the folder holds other files, expected a new or empty one, or a sweep's"
                    raise InputError(problem, file=str(folder))
                write_atomically(root / _ABOUT, text)
            (root / _PARTS).mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(f"the folder cannot be made ({error.strerror})", file=str(folder)) from error
        if (found := read_bytes(root / _ABOUT)) != text.encode():
            try:
                of = {key: json.loads(found)[key] for key in about}
            except (ValueError, KeyError, TypeError):
                of = {"study": "?"}
            other = next(
                (f"{key} {of.get(key)!r}, not {value!r}" for key, value in about.items() if of.get(key) != value), ""
            )
            raise InputError(f"holds parts of another sweep ({other}); name another folder", file=str(root / _ABOUT))
        return cls(root, study)

    def files(self) -> dict[int, Path]:
        """The parts that are there, by index.

        Raises
        ------
        InputError
            Two results of one block: software or processors differ between the machines.
        """
        found: dict[int, Path] = {}
        for path in sorted((self.folder / _PARTS).glob("*/*.csv")):
            if name := _PART.fullmatch(path.name):
                index = int(name[1])
                if index in found:
                    problem = f"another result of the block is {found[index].name}: machines or packages differ"
                    raise InputError(f"{problem}; find out which, and delete one or both", file=str(path))
                found[index] = path
        return found

    def write(self, block: Block, text: str) -> Path:
        """Write the part of a block, once."""
        folder = self.folder / _PARTS / f"{block.index // _IN_A_FOLDER:03d}"
        folder.mkdir(exist_ok=True)
        path = folder / f"{block.index:06d}-{sha256(text)}.csv"
        if not path.exists():
            write_atomically(path, text)
        return path

    def write_summary(self) -> Path:
        """Write what the parts of each case say together; the same parts give the same bytes.

        Raises
        ------
        InputError
            A block is missing, or a part is not what was written.
        """
        files, first = self.files(), 0
        remarks, rows = list[str](), list[dict[str, str]]()
        for case in self.study.cases:
            of_case = _OfCase(case)
            for index in range(first, first := first + case.blocks):
                if index not in files:
                    raise InputError(f"block {index} is missing; run the sweep again", file=str(self.folder))
                of_case.add(_intact(files[index]))
            remarks += [one_line(f"# {case.name}: {note}") for note in of_case.notes]
            rows.append(of_case.row)
        head = [f"# {SOFTWARE}, study {self.study.name}, SHA-256 {self.study.sha256}", *remarks]
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        path = self.folder / SUMMARY_FILE
        write_atomically(path, "\n".join([*head, csv_text(columns)]))
        return path


def _intact(path: Path) -> str:
    """The text of a part."""
    content = read_bytes(path)
    if sha256(content) not in path.name:
        raise InputError("the part is not what was written; delete it and run the sweep again", file=str(path))
    return content.decode()


@dataclass
class _OfCase:
    """What the parts of a case say together, part by part, so that no more than one is in memory."""

    case: Case
    rows: int = 0
    sums: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    best: dict[str, float] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)
    _columns: tuple[str, ...] = ()

    def add(self, text: str) -> None:
        """Add a part."""
        _, notes, columns = part_content(text)
        self.notes |= dict.fromkeys(notes)
        self.rows += len(next(iter(columns.values())))
        for name in self.case.means:
            there = columns[name][~np.isnan(columns[name])]
            self.sums[name] = self.sums.get(name, 0.0) + float(there.sum())
            self.counts[name] = self.counts.get(name, 0) + there.size
        name, highest = self.case.best
        sign = 1 if highest else -1
        if not np.isnan(columns[name]).all():
            row = int(np.nanargmax(sign * columns[name]))
            if not self.best or sign * columns[name][row] > sign * self.best[name]:
                self.best = {column: float(values[row]) for column, values in columns.items()}
        self._columns = tuple(columns)

    @property
    def row(self) -> dict[str, str]:
        """The row of the summary: number of rows, means, and the row that is looked for."""
        name, highest = self.case.best
        means = {f"mean_{key}": self.sums[key] / self.counts[key] if self.counts[key] else None for key in self.sums}
        end = f"{'highest' if highest else 'lowest'}_{name}"
        best = {f"there_{key}" if key != name else end: self.best.get(key) for key in self._columns}
        cells = {"case": self.case.name, "blocks": self.case.blocks, "rows": self.rows, **means, **best}
        return {key: csv_cell(value) for key, value in cells.items()}
