"""Run sheets, exported files and what a speed rests on: every line is what it was, and none moves unnoticed."""

from __future__ import annotations

import pytest

from sheets import MAPS, SHEETS, TEXTS, texts

KEPT = TEXTS.read_text().split("=== ")[1:]


@pytest.fixture(scope="module", autouse=True)
def maps():
    """The maps are fitted once, before anything is asked of them."""
    for make in MAPS.values():
        make()


@pytest.mark.parametrize("sheet", SHEETS)
def test_what_is_written_is_what_was_written(sheet):
    found = texts(sheet).split("=== ")[1:]
    expected = [part for part in KEPT if part.startswith(f"{sheet}: ")]
    assert [part.partition("\n")[0] for part in found] == [part.partition("\n")[0] for part in expected]
    for part, before in zip(found, expected, strict=True):
        assert part.rstrip().splitlines() == before.rstrip().splitlines()
