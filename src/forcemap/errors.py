"""Every error forcemap raises on purpose.

    ForcemapError
    ├── InputError (also a ValueError)   a value, name or file that cannot be used
    │   ├── TableError                   a table of impacts or of limits: file, row, column
    │   ├── CampaignFileError            a file of a campaign
    │   │   └── ChangedMeanwhile         it was changed while it was used: try again
    │   ├── RecordingError               a file of recordings
    │   ├── MapFileError                 a map file
    │   └── UnknownName                  no body area, map, form or term of that name
    ├── FitError                         the impacts do not determine the map
    │   ├── TooFewStates
    │   └── RankDeficient
    ├── BoundNotAvailable                the map cannot carry the bound asked for
    ├── ContactNotPermitted              the standard permits no contact there (head)
    ├── NotReleasable                    what speeds rest on does not carry a program or a release
    └── MissingExtra                     an optional dependency is not installed

A message says what was found, what was expected and what to do; the numbers stay as attributes.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


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
        self.message = message
        self.file = file
        self.row = row
        self.column = column
        where = [
            *([file] if file else []),
            *([f"row {row}"] if row is not None else []),
            *([f"column {column}"] if column else []),
        ]
        super().__init__(": ".join([", ".join(where), message] if where else [message]))


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
    """A file of a campaign that was changed while it was used; nothing was written, trying again may do."""


class RecordingError(InputError):
    """A file of recordings, or a recording, that cannot be used; row is the line in the file."""

    kind = "recording"


class MapFileError(InputError):
    """A map file that cannot be used."""

    kind = "map_file"


class UnknownName(InputError):
    """A name that is not known; `nearest` lists the names most like it."""

    kind = "unknown_name"

    def __init__(self, what: str, name: str, known: Iterable[str]) -> None:
        self.name = name
        self.nearest = tuple(nearest_names(name, known))
        super().__init__(f"no {what} is named {name!r}; the nearest are {', '.join(self.nearest)}")


class FitError(ForcemapError):
    """The impacts do not determine the map; `remedy` is what to measure, beside a form with fewer terms."""

    kind = "fit"

    def __init__(self, found: str, *, remedy: str = "", **where: Any) -> None:
        self.found, self.remedy = found, remedy
        super().__init__(f"{found}; {remedy} or choose a form with fewer terms" if remedy else found, **where)


class TooFewStates(FitError):
    """Fewer measured states than the fit needs."""

    kind = "too_few_states"


class RankDeficient(FitError):
    """The measured states do not tell the terms of the form apart."""

    kind = "rank_deficient"


class BoundNotAvailable(ForcemapError):
    """The map cannot carry the bound asked for."""

    kind = "bound_not_available"


class ContactNotPermitted(ForcemapError):
    """The standard permits no contact with this body area, so no limit and no speed follow from it."""

    kind = "not_permitted"


class NotReleasable(ForcemapError):
    """What the speeds rest on may be looked at, but carries no robot program and no release."""

    kind = "not_releasable"


class MissingExtra(ForcemapError):
    """An optional dependency is not installed."""

    kind = "missing_extra"


def nearest_names(name: str, known: Iterable[str], count: int = 5) -> list[str]:
    """The known names most like `name`, best first: those that contain it, then those spelt alike."""
    names = list(known)
    wanted = name.strip().lower().replace(" ", "_").replace("-", "_")
    words = [word for word in wanted.split("_") if len(word) > 2]

    def likeness(candidate: str) -> float:
        lowered = candidate.lower().replace("-", "_")
        shared = sum(word in lowered for word in words)
        return shared + difflib.SequenceMatcher(None, wanted, lowered).ratio()

    return sorted(names, key=likeness, reverse=True)[:count]
