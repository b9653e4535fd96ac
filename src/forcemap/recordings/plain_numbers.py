"""Lines that hold nothing but numbers, read at once; whatever is not plain is left to the reader of single cells.

What is read here is what that reader reads: `tests/test_recordings.py` compares the two.
"""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.recordings.layout import Layout

_COMMA, _LINE_END, _POINT, _PLUS, _MINUS, _ZERO = b",\n.+-0"
_COMMA_FOR_LINE_END = bytes.maketrans(b"\n", b",")
# whole numbers and powers of ten up to these are exact in a float, and so their quotient is rounded once
_EXACT_WHOLE, _EXACT_POWER = 1 << 53, 22


def plain_numbers(chunk: bytes, layout: Layout) -> FloatArray | None:
    """The columns read of whole lines, or None if a line is not plain.

    Parameters
    ----------
    chunk : bytes
        Whole lines, the last with its line end.
    layout : Layout
        The layout of the file.
    """
    if layout.selection.curve is not None:
        return None
    if b"\r" in chunk:
        chunk = chunk.replace(b"\r\n", b"\n")
    delimiter, point = layout.delimiter.encode(), layout.decimal.encode()
    # What remains of such lines is known. A blank is not plain: to numpy a cell of blanks is -1.
    rest = chunk.translate(None, b"0123456789+-eE")
    ends = rest.translate(None, point)
    end_of_row = delimiter * (layout.width - 1) + b"\n"
    rows = len(ends) // len(end_of_row)
    if ends != end_of_row * rows:
        return None
    if point == b",":
        chunk = chunk.replace(b",", b".")
    if delimiter not in (b"", b","):
        chunk = chunk.replace(delimiter, b",")
    numbers = list(layout.selection.numbers)
    row = rest[: rest.find(b"\n") + 1]
    if rest == row * rows:
        signs = [sign == point for sign in (row[at : at + 1] for at in range(len(row)))]
        fixed = _fixed_decimals(chunk, signs, rows, numbers)
        if fixed is not None:
            return fixed
    try:
        values = np.fromstring(chunk[:-1].replace(b"\n", b","), dtype=np.float64, sep=",")
    except (ValueError, DeprecationWarning):  # a cell such as "1.2.3", "1-2" or ""
        return None
    return values.reshape(rows, layout.width)[:, numbers] if values.size == rows * layout.width else None


def _fixed_decimals(chunk: bytes, signs: list[bool], rows: int, numbers: list[int]) -> FloatArray | None:
    """Numbers with the same count of decimals all down a column, read as whole numbers in a quarter of the time.

    `signs` are the points (true) and cell ends (false) of every row.
    """
    characters = np.frombuffer(chunk, dtype=np.uint8)
    # To numpy a sign alone is 0, and ".-5" is a number once its point is gone: a sign stands before a digit and begins
    # its cell (before the first of all stands, by wrapping around, the end of the last).
    plus_minus = np.flatnonzero((characters == _PLUS) | (characters == _MINUS))
    end = (characters == _COMMA) | (characters == _LINE_END)
    if (characters[plus_minus + 1] < _ZERO).any() or not end[plus_minus - 1].all():
        return None
    at = np.flatnonzero(end | (characters == _POINT)).reshape(rows, len(signs))
    decimals = [0] * signs.count(False)
    for sign in [each for each, pointed in enumerate(signs) if pointed]:
        behind = at[:, sign + 1] - at[:, sign] - 1
        if signs[sign + 1] or (behind != behind[0]).any() or behind[0] > _EXACT_POWER:
            return None
        decimals[signs[:sign].count(False)] = int(behind[0])
    try:
        whole = np.fromstring(chunk[:-1].translate(_COMMA_FOR_LINE_END, b"."), dtype=np.int64, sep=",")
    except (ValueError, DeprecationWarning):
        return None
    if whole.size != rows * len(decimals) or whole.min() <= -_EXACT_WHOLE or whole.max() >= _EXACT_WHOLE:
        return None
    powers = np.array([float(10 ** decimals[column]) for column in numbers])
    values: FloatArray = whole.reshape(rows, len(decimals))[:, numbers] / powers
    return values
