"""What is read of curves of every kind is what was read when the rules were chosen: no rule moves unnoticed."""

from __future__ import annotations

import pytest

from readings import EDGES, KINDS, TABLE, read, words
from recorded import hold, rows_of

ROWS, EDGE_ROWS = rows_of(TABLE), rows_of(EDGES)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_what_is_read_is_what_was_read(kind):
    hold(read(kind), [row for row in ROWS if row[0].split()[0] == kind.__name__], rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_other_words_are_read_of_a_curve_where_they_were_before(kind):
    """On either side of every share at which flags or the scenario change."""
    for name, number, low, high, *before in EDGE_ROWS:
        if name == kind.__name__:
            assert [words(kind, int(number), float(share)) for share in (low, high)] == before, (number, low, high)
