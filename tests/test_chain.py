"""From campaigns to exports, every figure is what it was: none moves unnoticed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from chain import PARTS, TABLE, rows

with TABLE.open(newline="") as stream:
    BEFORE = list(csv.reader(stream))


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_what_is_said_is_what_was_said(part):
    found, expected = rows(part), [row for row in BEFORE if row[0].split()[0] == part.__name__]
    assert [name for name, _ in found] == [name for name, _ in expected]
    for (name, said), (_, before) in zip(found, expected, strict=True):
        words, figures = parts(said)
        words_before, figures_before = parts(before)
        assert words == words_before, name
        # Searches end within some 1e-6; another processor adds up in another order and ends elsewhere within that.
        np.testing.assert_allclose(figures, figures_before, rtol=1e-5, atol=1e-9, err_msg=name)


def parts(said):
    """Words and figures of a row."""
    figures = [each for each in said.split() if each in ("nan", "inf", "-inf") or each.lstrip("-")[:1].isdigit()]
    return [each for each in said.split() if each not in figures], [float(each) for each in figures]
