"""Printing: one JSON object, or lines and tables of text."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from forcemap.errors import ForcemapError, InputError
from forcemap.files import read_bytes, write_atomically


def emit(result: dict[str, Any], lines: Iterable[str], *, as_json: bool) -> None:
    """Print a result as one JSON object, or as lines of text."""
    print(json_text(result) if as_json else "\n".join(lines))


def emit_error(error: ForcemapError, *, as_json: bool) -> None:
    """Print an error as one line on stderr, and as JSON on stdout if asked for."""
    print(f"error: {error}", file=sys.stderr)
    if as_json:
        found = {
            "kind": error.kind,
            "message": error.message,
            "file": error.file,
            "row": error.row,
            "column": error.column,
        }
        print(json.dumps({"error": found}, ensure_ascii=False))


def write_result(path: str, text: str, *, mark: str) -> None:
    """Write a result file; an existing file is replaced only if it holds `mark`, so is such a result itself.

    Raises
    ------
    InputError
        The file is another one, or cannot be written.
    """
    if Path(path).exists() and mark not in read_bytes(path)[:4000].decode(errors="replace"):
        raise InputError(
            "this is another file, not an earlier result; it is not overwritten, choose another name", file=path
        )
    write_atomically(path, text)


class Progress:
    """Counts on stderr, for work that takes over a second; shown on a terminal only."""

    def __init__(self, what: str, total: int) -> None:
        self._what, self._total = what, total
        self._start = self._last = time.monotonic()

    def __enter__(self) -> Progress:
        return self

    def show(self, done: int) -> None:
        """Show how many are done."""
        now = time.monotonic()
        if now - self._start > 1.0 and now - self._last > 0.1 and sys.stderr.isatty():
            self._last = now
            filled = 30 * done // max(self._total, 1)
            bar = "#" * filled + "." * (30 - filled)
            print(f"\r[{bar}] {done} of {self._total} {self._what}", end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self._last > self._start:
            print("\r" + " " * 78 + "\r", end="", file=sys.stderr, flush=True)


def json_text(value: Any) -> str:
    """JSON with null for NaN and infinities."""
    return json.dumps(_plain(value), indent=1, allow_nan=False, ensure_ascii=False)


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a text table, the first column left-aligned, the others right-aligned."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    return [
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    ]


def listing(title: str, lines: Iterable[str]) -> list[str]:
    """A title and a dash before each line."""
    return [title, *(f"  - {line}" for line in lines)]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
