"""Tables of what results said before, a row for each: its name, then words and figures. Read, held against, written."""

from __future__ import annotations

import csv
import re
from collections import defaultdict

import numpy as np

# Searches end within some 1e-6; another processor adds up in another order and ends elsewhere within that.
ROUNDING = {"rtol": 1e-5, "atol": 1e-9}
FIGURE = re.compile(r"nan|-?(inf|[0-9]+([.][0-9]*)?(e[+-]?[0-9]+)?)")


def rows_of(table):
    """The rows of a table."""
    with table.open(newline="") as stream:
        return list(csv.reader(stream))


def parts(row):
    """Words and figures of a row."""
    cells = [word for cell in row[1:] for word in cell.split()]
    return [word for word in cells if not FIGURE.fullmatch(word)], [
        float(word) for word in filter(FIGURE.fullmatch, cells)
    ]


def hold(found, expected, **rounding):
    """Rows are those expected: same names, same words, figures within rounding."""
    assert [row[0] for row in found] == [row[0] for row in expected]
    for row, before in zip(found, expected, strict=True):
        if row != before:
            (words, figures), (words_before, figures_before) = parts(row), parts(before)
            assert words == words_before, row[0]
            np.testing.assert_allclose(figures, figures_before, **(ROUNDING | rounding), err_msg=row[0])


def write(table, rows, **rounding):
    """Write a table anew; a row in which nothing but rounding has moved stays as it was."""
    before = defaultdict(list)
    for row in rows_of(table) if table.exists() else []:
        before[row[0]].append(row)
    kept = [_kept(row, before[row[0]].pop(0), ROUNDING | rounding) if before[row[0]] else row for row in rows]
    with table.open("w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(kept)


def _kept(row, before, rounding):
    (words, figures), (words_before, figures_before) = parts(row), parts(before)
    same = words == words_before and len(figures) == len(figures_before)
    return before if same and np.allclose(figures, figures_before, **rounding, equal_nan=True) else row
