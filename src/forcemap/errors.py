"""Every error forcemap raises on purpose.

    ForcemapError
    ├── InputError (also a ValueError)   a value, name or file that cannot be used
    │   ├── TableError                   a table of impacts or of limits: file, row, column
    │   ├── CampaignFileError            a file of a campaign
    │   │   └── ChangedMeanwhile         it was changed while it was used: try again
    │   ├── RecordingError               a file of recordings
    │   ├── MapFileError                 a map file
    │   ├── RegisterError                the team's register: its database, or what it holds
    │   └── UnknownName                  no body area, map, form or term of that name
    ├── FitError                         the impacts do not determine the map
    │   ├── TooFewStates
    │   ├── RankDeficient
    │   └── TransferRefused              new states contradict the map that was to be carried over
    ├── BoundNotAvailable                the map cannot carry the bound asked for
    ├── ContactNotPermitted              the standard permits no contact there (head)
    ├── NotReleasable                    what speeds rest on does not carry a program or a release
    └── MissingExtra                     an optional dependency is not installed

A message says what was found, what was expected and what to do; the numbers stay as attributes.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from typing import Any

# Characters of a message, of a column's name (docs/decisions.md): they may quote a whole damaged file.
_LONGEST, _LONGEST_NAME = 2000, 200
_NAMED = 6  # of many names in a message; the others are counted
_LONGEST_SOUGHT, _SHORTEST_WORD = 100, 3  # characters of a name that is looked up, of a word in it that counts


class ForcemapError(Exception):
    """Base of all errors raised on purpose; file, row and column say where, if that is known."""

    kind = "error"

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        message = one_line(message)
        self.message = message if len(message) <= _LONGEST else f"{message[:_LONGEST]}..."
        self.file = file
        self.row = row
        self.column = column
        where = [
            *([file] if file else []),
            *([f"row {row}"] if row is not None else []),
            *([f"column {column[:_LONGEST_NAME]}"] if column else []),
        ]
        super().__init__(one_line(": ".join([", ".join(where), self.message] if where else [self.message])))


class InputError(ForcemapError, ValueError):
    """A value, name or file that cannot be used."""

    kind = "input"


class TableError(InputError):
    """A table of impacts or of limits that cannot be used."""

    kind = "table"


class CampaignFileError(InputError):
    """A campaign.toml, or another file of a campaign, that cannot be used."""

    kind = "campaign_file"


class ChangedMeanwhile(CampaignFileError):
    """A file of a campaign that was changed while it was used; nothing was written, and trying again may help."""


class RecordingError(InputError):
    """A file of recordings, or a recording, that cannot be used; row is the line in the file."""

    kind = "recording"


class MapFileError(InputError):
    """A map file that cannot be used."""

    kind = "map_file"


class RegisterError(InputError):
    """The team's register cannot be used, or refuses what is to be entered."""

    kind = "register"


class UnknownName(InputError):
    """A name that is not known; `nearest` lists the names most like it, `listed` says where all are."""

    kind = "unknown_name"

    def __init__(self, what: str, name: str, known: Iterable[str], *, listed: str = "") -> None:
        self.name = name
        self.nearest = tuple(nearest_names(name, known))
        super().__init__(f"no {what} is named {name!r}; the nearest are {', '.join(self.nearest)}{listed}")


class FitError(ForcemapError):
    """The impacts do not determine the map: `problem` says why, `remedy` what to measure, besides fewer terms."""

    kind = "fit"

    def __init__(self, problem: str, *, remedy: str = "", **where: Any) -> None:
        self.problem, self.remedy = problem, remedy
        super().__init__(f"{problem}; {remedy} or choose a form with fewer terms" if remedy else problem, **where)


class TooFewStates(FitError):
    """Fewer measured states than the fit needs."""

    kind = "too_few_states"


class RankDeficient(FitError):
    """The measured states do not separate the terms of the form."""

    kind = "rank_deficient"


class TransferRefused(FitError):
    """The new states contradict the map that was to be carried over; `p_value` of the test."""

    kind = "transfer_refused"

    def __init__(self, p_value: float, problem: str, *, remedy: str) -> None:
        self.p_value = p_value
        super().__init__(f"{problem}; {remedy}")


class BoundNotAvailable(ForcemapError):
    """The map cannot carry the bound asked for."""

    kind = "bound_not_available"


class ContactNotPermitted(ForcemapError):
    """The standard permits no contact with this body area, so no limit and no speed follow from it."""

    kind = "not_permitted"


class NotReleasable(ForcemapError):
    """What the speeds rest on may be shown, but does not allow a robot program or a release."""

    kind = "not_releasable"


class MissingExtra(ForcemapError):
    """An optional dependency is not installed."""

    kind = "missing_extra"

    @classmethod
    def of(cls, error: ModuleNotFoundError) -> MissingExtra:
        """The error of a command line or page that needs a package that is not installed."""
        extra = "register" if error.name in ("sqlalchemy", "alembic") else "app"
        return cls(
            f"this needs the package {error.name}; install it from the project's folder: pip install '.[{extra}]'"
        )


_BREAKS = re.compile("[\n\r\v\f\x1c-\x1e\x85\u2028\u2029][\\s]*")
# control characters, and marks that turn the direction of text
_UNSEEN = re.compile("[\x00-\x08\x0e-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def few(names: Sequence[str], most: int = _NAMED, between: str = ", ") -> str:
    """The first of many names, and how many more there are."""
    more = len(names) - most
    return between.join(names[:most]) + f" and {more} more" * (more > 0)


def one_line(text: str) -> str:
    """A text on one line, without control characters: names and cells come from files, and go to a terminal."""
    return _UNSEEN.sub("\ufffd", _BREAKS.sub(" ", text).replace("\t", " "))


def words_of(name: str) -> list[str]:
    """Words of an identifier by which others are like it: `thigh` and `knee` of `thighs_and_knees`."""
    words = [word.removesuffix("s") for word in name.split("_") if word != "and"]
    return [word for word in words if len(word) >= _SHORTEST_WORD]


def nearest_names(name: str, known: Iterable[str], count: int = 5) -> list[str]:
    """The known names most like `name`, best first: those that contain it, then those spelt alike."""
    names = list(known)
    wanted = name[:_LONGEST_SOUGHT].strip().lower().replace(" ", "_").replace("-", "_")
    words = words_of(wanted)

    def likeness(candidate: str) -> float:
        lowered = candidate.lower().replace("-", "_")
        shared = sum(word in lowered for word in words)
        return shared + difflib.SequenceMatcher(None, wanted, lowered).ratio()

    return sorted(names, key=likeness, reverse=True)[:count]
