"""Maps kept in memory between requests: fitted once for every content of a campaign's files."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from forcemap import Accuracy, ForceMap, ImpactDataset, map_accuracy, read_dataset
from forcemap.assessment.confirmation import Confirmations
from forcemap.assessment.folder_map import folder_map
from forcemap.campaigns.point_list import POINT_REGISTER, POINTS_FILE
from forcemap.campaigns.recordings_table import REGISTER_FILE
from forcemap.files import file_sha256, sha256
from forcemap.maps.carry_over import EARLIER_MAP
from forcemap.web.request_error import RequestError

_Result = TypeVar("_Result")

_ONE_FIT = threading.Lock()  # requests for the same map wait for one fit

_READINGS = 5
"""How often files that change while they are read are read again; a choice: a collect is over sooner."""

_IN_MEMORY = 16
"""Campaigns whose impacts and map stay in memory; a choice: the overview of a folder asks for all of them."""


class _ChangedError(Exception):
    """The files are no longer those whose hashes were taken."""


@dataclass(frozen=True, eq=False)
class FittedCampaign:
    """A campaign's impacts and the map fitted to them.

    Parameters
    ----------
    dataset : ImpactDataset
    force_map : ForceMap
    accuracy : tuple of Accuracy
        The most trustworthy first.
    confirmed : callable
        The result of the impacts that were made to confirm the map, for a limit, a contact and a bound.
    """

    dataset: ImpactDataset
    force_map: ForceMap
    accuracy: tuple[Accuracy, ...]
    confirmed: Confirmations


def impacts_of(campaign: Path) -> ImpactDataset:
    """The impacts of a campaign.

    Raises
    ------
    RequestError
        There are none yet, or the files are being changed.
    """
    return _read_unchanged(_impacts, campaign)


def fitted_campaign(campaign: Path) -> FittedCampaign:
    """The impacts and map of a campaign, from memory while its files stay as they are.

    Raises
    ------
    RequestError
        There are no impacts yet, or the files are being changed.
    FitError
        They do not determine a map.
    """
    with _ONE_FIT:
        return _read_unchanged(_fitted, campaign)


_Contents = tuple[str, ...]

_FOLDERS = ("recordings", "points", "pressures")
_FILES = ("impacts.csv", "campaign.toml", "recordings.csv", "plan.csv", EARLIER_MAP, POINTS_FILE, POINT_REGISTER)
"""What a map rests on, by content; the recordings, by `_stamp`."""


def _contents(campaign: Path) -> _Contents:
    """SHA-256 of the files that a map rests on; empty for one that is not there."""
    if not (campaign / _FILES[0]).exists():
        message = "there are no impacts yet, so no map; add recordings, or run forcemap collect"
        if (campaign / REGISTER_FILE).exists():
            message = "no map: none of the recordings that were collected can be used; why stands beside each"
        raise RequestError(409, "no_impacts", message)
    hashes = (file_sha256(campaign / name) if (campaign / name).exists() else "" for name in _FILES)
    return (*hashes, *(_stamp(campaign / name) for name in _FOLDERS))


def _stamp(folder: Path) -> str:
    """What changes when a file below a folder does: names, sizes and times, as thousands cannot be hashed each time."""
    lines = []
    for root, _, names in os.walk(folder):
        for file in (os.path.join(root, name) for name in names):
            with contextlib.suppress(OSError):  # removed meanwhile, or a link that leads nowhere
                of = os.stat(file)
                lines.append(f"{file} {of.st_size} {of.st_mtime_ns}")
    return sha256("\n".join(sorted(lines)))


def _read_unchanged(read: Callable[[Path, _Contents], _Result], campaign: Path) -> _Result:
    """Read files again until they did not change meanwhile."""
    for _ in range(_READINGS):
        try:
            return read(campaign, _contents(campaign))
        except _ChangedError:
            continue
    message = "its files are changed again and again while they are read; ask again when they stay"
    raise RequestError(409, "changing", message)


@lru_cache(maxsize=_IN_MEMORY)
def _impacts(campaign: Path, contents: _Contents) -> ImpactDataset:
    """The impacts of files with these hashes; errors are not kept in memory."""
    try:
        dataset = read_dataset(campaign)
    finally:
        if _contents(campaign) != contents:
            raise _ChangedError
    if dataset.sha256 != contents[0]:
        raise _ChangedError
    return dataset


@lru_cache(maxsize=_IN_MEMORY)
def _fitted(campaign: Path, contents: _Contents) -> FittedCampaign:
    dataset = _impacts(campaign, contents)
    found = folder_map(campaign, dataset)
    return FittedCampaign(found.dataset, found.force_map, map_accuracy(found.force_map, found.dataset), found.confirmed)
