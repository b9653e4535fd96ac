"""A part of an assessment that is not there, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from forcemap.errors import ForcemapError, InputError

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
    """What `make` returns, or why it failed."""
    try:
        return make()
    except ForcemapError as error:
        return Missing(error_words(error))


def present(part: Part | Missing) -> Part:
    """The part.

    Raises
    ------
    InputError
        It is missing; the message is the reason.
    """
    if isinstance(part, Missing):
        raise InputError(part.reason)
    return part


def error_words(error: ForcemapError) -> str:
    """An error in words, with the file's bare name, so that it is the same in whatever folder the campaign is."""
    return str(error).replace(error.file, Path(error.file).name, 1) if error.file else str(error)
