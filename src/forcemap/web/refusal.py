"""Requests that are refused, and errors as the JSON that answers them."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel

from forcemap.errors import ContactNotPermitted, ForcemapError, InputError


class Refusal(InputError):
    """A request that is refused, with its HTTP status and a kind of its own."""

    def __init__(self, status: int, kind: str, message: str, *, file: str | None = None) -> None:
        super().__init__(message, file=file)
        self.status = status
        self.kind = kind


class Problem(BaseModel):
    """What was found, what was expected and what to do, in one line; where, if that is known."""

    kind: str
    message: str
    file: str | None = None
    row: int | None = None
    column: str | None = None


class Refused(BaseModel):
    """The answer to a request that is refused."""

    error: Problem


def problem(error: ForcemapError) -> Problem:
    """An error for JSON, its file as the served folder calls it; control characters of files do not reach it."""

    def line(text: str | None) -> str | None:
        return None if text is None else " ".join("".join(c if c.isprintable() else " " for c in text).split())

    return Problem(
        kind=error.kind,
        message=line(error.message) or "",
        file=line(Path(error.file).name if error.file and Path(error.file).is_absolute() else error.file),
        row=error.row,
        column=line(error.column),
    )


def status_of(error: ForcemapError) -> int:
    """The HTTP status of an error: 422 for what was sent; 409 where the campaign, as it is, cannot give the answer."""
    if isinstance(error, Refusal):
        return error.status
    return 422 if isinstance(error, InputError | ContactNotPermitted) else 409
