"""Zones, segments, paths and enclosures: every figure is what it was, and none moves unnoticed."""

from __future__ import annotations

import pytest

from pieces import PARTS_OF, TABLE, maps, rows
from recorded import hold, rows_of

BEFORE = rows_of(TABLE)


@pytest.fixture(scope="module", autouse=True)
def fitted():
    """The maps are fitted once, before anything is asked of them."""
    maps()


@pytest.mark.parametrize("part", PARTS_OF, ids=lambda part: part.__name__)
def test_what_speeds_are_made_of_is_what_it_was(part):
    hold(rows(part), [row for row in BEFORE if row[0].split()[0] == part.__name__])
