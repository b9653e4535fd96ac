"""Maps that are held between requests: fitted once for each content of a campaign's files."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from forcemap import Accuracy, ForceMap, ImpactDataset, fit_force_map, map_accuracy, read_dataset
from forcemap.files import file_sha256
from forcemap.web.refusal import Refusal

_Found = TypeVar("_Found")

_ONE_FIT = threading.Lock()  # the same map is not fitted twice at a time
_TRIES = 5


class _ChangedError(Exception):
    """The files are no longer those whose hashes were taken."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A campaign's impacts and the map fitted to them.

    Parameters
    ----------
    dataset : ImpactDataset
    force_map : ForceMap
    accuracy : tuple of Accuracy
        The one to trust first.
    """

    dataset: ImpactDataset
    force_map: ForceMap
    accuracy: tuple[Accuracy, ...]


def impacts_of(campaign: Path) -> ImpactDataset:
    """The impacts of a campaign.

    Raises
    ------
    Refusal
        There are none yet, or the files are being changed.
    """
    return _settled(_impacts, campaign)


def fitted(campaign: Path) -> Fitted:
    """The map of a campaign, from memory while its files stay as they are.

    Raises
    ------
    Refusal
        There are no impacts yet, or the files are being changed.
    FitError
        They do not determine a map.
    """
    with _ONE_FIT:
        return _settled(_fitted, campaign)


_Contents = tuple[str, ...]

_FILES = ("impacts.csv", "campaign.toml", "recordings.csv")  # what a map rests on


def _contents(campaign: Path) -> _Contents:
    """SHA-256 of the files that a map rests on; empty for one that is not there."""
    if not (campaign / _FILES[0]).exists():
        message = "there are no impacts yet, so no map; add recordings, or run forcemap collect"
        raise Refusal(409, "no_impacts", message)
    return tuple(file_sha256(campaign / name) if (campaign / name).exists() else "" for name in _FILES)


def _settled(read: Callable[[Path, _Contents], _Found], campaign: Path) -> _Found:
    """What is read from files that stay as they are meanwhile."""
    for _ in range(_TRIES):
        try:
            return read(campaign, _contents(campaign))
        except _ChangedError:
            continue
    message = "its files are changed again and again while they are read; ask again when they stay"
    raise Refusal(409, "changing", message)


@lru_cache(maxsize=16)
def _impacts(campaign: Path, contents: _Contents) -> ImpactDataset:
    """The impacts of files with these hashes; an error is not kept."""
    try:
        dataset = read_dataset(campaign)
    finally:
        if _contents(campaign) != contents:
            raise _ChangedError
    if dataset.sha256 != contents[0]:
        raise _ChangedError
    return dataset


@lru_cache(maxsize=16)
def _fitted(campaign: Path, contents: _Contents) -> Fitted:
    dataset = _impacts(campaign, contents)
    force_map = fit_force_map(dataset)
    return Fitted(dataset, force_map, map_accuracy(force_map, dataset))
