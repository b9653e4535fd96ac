"""Zones, segments, paths and enclosures: every figure is what it was, and none moves unnoticed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from pieces import PARTS_OF, TABLE, maps, rows
from test_chain import parts

with TABLE.open(newline="") as stream:
    BEFORE = list(csv.reader(stream))


@pytest.fixture(scope="module", autouse=True)
def fitted():
    """The maps are fitted once, before anything is asked of them."""
    maps()


@pytest.mark.parametrize("part", PARTS_OF, ids=lambda part: part.__name__)
def test_what_speeds_are_made_of_is_what_it_was(part):
    found, expected = rows(part), [row for row in BEFORE if row[0].split()[0] == part.__name__]
    assert [name for name, _ in found] == [name for name, _ in expected]
    for (name, said), (_, before) in zip(found, expected, strict=True):
        words, figures = parts(said)
        words_before, figures_before = parts(before)
        assert words == words_before, name
        # Searches end within some 1e-6; another processor adds up in another order and ends elsewhere within that.
        np.testing.assert_allclose(figures, figures_before, rtol=1e-5, atol=1e-9, err_msg=name)
