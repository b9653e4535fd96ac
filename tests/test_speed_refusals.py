"""What speeds, paths and exports refuse: every sentence with its file, row and column, and what is just accepted."""

from __future__ import annotations

import csv

from speed_refusals import TABLE, refusals


def test_every_refusal_says_what_it_said():
    with TABLE.open(newline="") as stream:
        assert list(refusals()) == list(csv.reader(stream))
