"""What is read of curves of every kind is what was read when the rules were chosen: no rule moves unnoticed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from readings import EDGES, KINDS, TABLE, read, words


def rows_of(table):
    with table.open(newline="") as stream:
        return list(csv.reader(stream))


ROWS, EDGE_ROWS = rows_of(TABLE), rows_of(EDGES)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_what_is_read_is_what_was_read(kind):
    found, expected = read(kind), [row for row in ROWS if row[0].split()[0] == kind.__name__]
    assert [row[0] for row in found] == [row[0] for row in expected]
    for row, before in zip(found, expected, strict=True):
        said, figures = parts(row)
        said_before, figures_before = parts(before)
        assert said == said_before, row[0]
        np.testing.assert_allclose(figures, figures_before, rtol=1e-6, atol=1e-9, err_msg=row[0])


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_other_words_are_read_of_a_curve_where_they_were_before(kind):
    """On either side of every share at which flags or the scenario change."""
    for name, number, low, high, *before in EDGE_ROWS:
        if name == kind.__name__:
            assert [words(kind, int(number), float(share)) for share in (low, high)] == before, (number, low, high)


def parts(row):
    """Words and figures of a row."""
    cells = [word for cell in row[1:] for word in cell.split()]
    figures = [word for word in cells if word.lstrip("-")[:1].isdigit() or word == "nan"]
    return [word for word in cells if word not in figures], [float(word) for word in figures]
