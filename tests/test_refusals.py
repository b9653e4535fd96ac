"""What maps and limits refuse: every sentence is what it was, and so is what is accepted beside it."""

from __future__ import annotations

import csv

import pytest

from refusals import PARTS, TABLE, rows

with TABLE.open(newline="") as stream:
    BEFORE = list(csv.reader(stream))


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_what_is_refused_is_refused_in_the_same_words(part):
    assert rows(part) == [row for row in BEFORE if row[0].split()[0] == part.__name__]
