"""What speeds, paths and exports refuse: every sentence with its file, row and column, and what is just accepted."""

from __future__ import annotations

import csv

import pytest

from speed_refusals import GROUPS, TABLE, refusals

with TABLE.open(newline="") as stream:
    BEFORE = list(csv.reader(stream))


@pytest.mark.parametrize("group", GROUPS)
def test_every_refusal_says_what_it_said(group):
    assert list(refusals(group)) == [row for row in BEFORE if row[0].startswith(f"{group}: ")]
