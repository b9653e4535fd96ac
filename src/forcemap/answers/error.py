"""Why there is no answer: the same object for `--json` and the page."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from forcemap.answers.answer import Answer
from forcemap.errors import ForcemapError


class Problem(Answer):
    """What was found, what was expected and what to do, in one line; and where, if known."""

    kind: str
    message: str
    file: str | None = None
    row: int | None = None
    column: str | None = None


class ErrorAnswer(Answer):
    """The answer that is an error."""

    error: Problem

    @classmethod
    def of_error(cls, error: ForcemapError, *, remote: bool = False) -> Self:
        """The answer for an error; `remote` leaves out this machine's folders and control characters from files."""

        def line(text: str | None) -> str | None:
            printable = "".join(c if c.isprintable() else " " for c in text or "")
            return " ".join(printable.split()) if remote and text is not None else text

        file = Path(error.file).name if remote and error.file and Path(error.file).is_absolute() else error.file
        message, column = line(error.message) or "", line(error.column)
        return cls(error=Problem(kind=error.kind, message=message, file=line(file), row=error.row, column=column))
