"""Lines and cells of a delimited file."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

from forcemap.errors import RecordingError

LONGEST_LINE = 1 << 16

# ASCII digits only: other scripts' digits, thousands separators and a text such as "nan" are no numbers
NUMBER = re.compile(r"[+-]?([0-9]+[.,]?[0-9]*|[.,][0-9]+)([eE][+-]?[0-9]+)?")
_LIKE_A_NUMBER = re.compile(r"$|[+-]?[.,]?[0-9]|[+-]?(nan|inf)", re.IGNORECASE)
_MOST_HEADER_LINES = 200


def text_of(raw: bytes) -> str:
    """The text in UTF-8, else in Latin-1: units such as µs and °, which are never part of a number."""
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without blanks and quotation marks around them."""
    return [cell.strip().strip('"').strip() for cell in (line.split(delimiter) if delimiter else [line])]


def is_number(cell: str) -> bool:
    """True for a number with either decimal sign."""
    return NUMBER.fullmatch(cell) is not None


def like_a_number(cell: str) -> bool:
    """True for what stands in place of a number: one that is damaged, none, or "nan"."""
    return _LIKE_A_NUMBER.match(cell) is not None


def first_lines(content: bytes, start: int) -> Iterator[tuple[int, str]]:
    """(byte at which it begins, text) of the lines that may hold the header.

    Raises
    ------
    RecordingError
        A line longer than any table's.
    """
    for row in itertools.islice(itertools.count(1), _MOST_HEADER_LINES):
        end = content.find(b"\n", start, start + LONGEST_LINE)
        if end < 0 and start + LONGEST_LINE < len(content):
            raise RecordingError(f"found over {LONGEST_LINE} characters without a line end, expected lines", row=row)
        stop = len(content) if end < 0 else end
        yield start, text_of(content[start:stop]).removesuffix("\r")
        if end < 0:
            return
        start = end + 1
