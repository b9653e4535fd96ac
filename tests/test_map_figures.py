"""Of form tests, ranges, roots, bounds and tables of limits every figure is what it was: none moves unnoticed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from map_figures import PARTS, TABLE, rows
from test_chain import parts

with TABLE.open(newline="") as stream:
    BEFORE = list(csv.reader(stream))


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_what_is_said_is_what_was_said(part):
    found, expected = rows(part), [row for row in BEFORE if row[0].split()[0] == part.__name__]
    assert [name for name, _ in found] == [name for name, _ in expected]
    for (name, said), (_, before) in zip(found, expected, strict=True):
        if said == before:
            continue
        words, figures = parts(said)
        words_before, figures_before = parts(before)
        assert words == words_before, name
        np.testing.assert_allclose(figures, figures_before, rtol=1e-5, atol=1e-9, err_msg=name)
