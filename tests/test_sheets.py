"""Run sheets, exported files and what a speed rests on: every line is what it was, and none moves unnoticed."""

from __future__ import annotations

import pytest

from sheets import SHEETS, TEXTS, texts, without_hashes

KEPT = TEXTS.read_text().split("\n=== ")


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.__name__)
def test_what_is_written_is_what_was_written(sheet):
    found = [part.strip() for part in without_hashes("\n" + texts(sheet)).split("\n=== ")[1:]]
    expected = [part.removeprefix("=== ").strip() for part in KEPT]
    expected = [part for part in expected if part.startswith(f"{sheet.__name__}: ")]
    assert [part.partition("\n")[0] for part in found] == [part.partition("\n")[0] for part in expected]
    for part, before in zip(found, expected, strict=True):
        assert part.splitlines() == before.splitlines()
