"""From campaigns to exports, every figure is what it was: none moves unnoticed."""

from __future__ import annotations

import pytest

from chain import PARTS, TABLE, rows
from recorded import hold, rows_of

BEFORE = rows_of(TABLE)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_what_is_said_is_what_was_said(part):
    hold(rows(part), [row for row in BEFORE if row[0].split()[0] == part.__name__])
