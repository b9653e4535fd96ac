"""Results are values: nobody changes one afterwards, and one that holds arrays is compared by identity."""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
import re

import pytest

FILLED_STEP_BY_STEP = {"UsedRecordings", "_Strictest", "_Exchange", "_Desk"}
COMPARED_NOWHERE = {"Candidates", "Curve", "NumberBlock", "Swing", "Symmetry", "_Course"}
ROOMS = ("maps", "speeds", "limits", "verdicts", "impacts", "paths", "exports", "campaigns", "recordings", "planning")


def dataclasses_of(room):
    package = importlib.import_module(f"forcemap.{room}")
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        for each in vars(importlib.import_module(found.name)).values():
            if isinstance(each, type) and dataclasses.is_dataclass(each) and each.__module__ == found.name:
                yield each


CLASSES = [each for room in ROOMS for each in dataclasses_of(room)]


@pytest.mark.parametrize("each", CLASSES, ids=lambda each: each.__qualname__)
def test_a_result_cannot_be_changed(each):
    if each.__name__ in FILLED_STEP_BY_STEP:
        return
    blank = object.__new__(each)
    for field in dataclasses.fields(each):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(blank, field.name, None)


def test_what_holds_arrays_is_compared_by_identity():
    """Equality of arrays is an array and has no truth; the same holds of a result that holds such a result."""
    names = {each.__name__: words(each) for each in CLASSES}
    holding, before = {"FloatArray", "Indices", "Objects", "Mask", "Texts"}, 0
    while len(holding) > before:
        before = len(holding)
        holding |= {name for name, inside in names.items() if inside & holding}
    held = [each for each in CLASSES if each.__name__ in holding - COMPARED_NOWHERE]
    assert len(held) > 40
    assert [each.__name__ for each in held if each.__eq__ is not object.__eq__] == []


def words(each):
    return {word for field in dataclasses.fields(each) for word in re.findall(r"\w+", str(field.type))}
