"""What is read of curves of every kind is what was read when the rules were chosen: no rule moves unnoticed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from readings import KINDS, TABLE, read

with TABLE.open(newline="") as stream:
    ROWS = list(csv.reader(stream))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_what_is_read_is_what_was_read(kind):
    found, expected = read(kind), [row for row in ROWS if row[0].split()[0] == kind.__name__]
    assert [row[0] for row in found] == [row[0] for row in expected]
    for row, before in zip(found, expected, strict=True):
        words, figures = parts(row)
        words_before, figures_before = parts(before)
        assert words == words_before, row[0]
        np.testing.assert_allclose(figures, figures_before, rtol=1e-6, atol=1e-9, err_msg=row[0])


def parts(row):
    """Words and figures of a row."""
    cells = [word for cell in row[1:] for word in cell.split()]
    figures = [word for word in cells if word.lstrip("-")[:1].isdigit() or word == "nan"]
    return [word for word in cells if word not in figures], [float(word) for word in figures]
