"""A part of an assessment that is not there, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from forcemap.errors import ForcemapError

Part = TypeVar("Part")


@dataclass(frozen=True)
class Missing:
    """A part of an assessment that is not there.

    Parameters
    ----------
    reason : str
        Why, in words.
    """

    reason: str


def attempt(make: Callable[[], Part]) -> Part | Missing:
    """What `make` gives, or why it cannot be had."""
    try:
        return make()
    except ForcemapError as error:
        return Missing(error_words(error))


def error_words(error: ForcemapError) -> str:
    """An error in words, the file by its bare name: the same in whatever folder the campaign lies."""
    where = [
        *([Path(error.file).name] if error.file else []),
        *([f"row {error.row}"] if error.row is not None else []),
        *([f"column {error.column}"] if error.column else []),
    ]
    return ": ".join([", ".join(where), error.message] if where else [error.message])
