"""Maps that are held between requests: fitted once for each content of a campaign's files."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from forcemap import Accuracy, ForceMap, ImpactDataset, fit_force_map, map_accuracy, read_dataset
from forcemap.files import file_sha256
from forcemap.web.refusal import Refusal

_ONE_FIT = threading.Lock()  # the same map is not fitted twice at a time


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
        There are none yet.
    """
    return _impacts(campaign, *_contents(campaign))


def fitted(campaign: Path) -> Fitted:
    """The map of a campaign, from memory while its files stay as they are.

    Raises
    ------
    Refusal
        There are no impacts yet.
    FitError
        They do not determine a map.
    """
    with _ONE_FIT:
        return _fitted(campaign, *_contents(campaign))


def _contents(campaign: Path) -> tuple[str, str]:
    table, described = campaign / "impacts.csv", campaign / "campaign.toml"
    if not table.exists():
        message = "there are no impacts yet, so no map; add recordings, or run forcemap collect"
        raise Refusal(409, "no_impacts", message)
    return file_sha256(table), file_sha256(described) if described.exists() else ""


@lru_cache(maxsize=16)
def _impacts(campaign: Path, _table: str, _conditions: str) -> ImpactDataset:
    return read_dataset(campaign)


@lru_cache(maxsize=16)
def _fitted(campaign: Path, table: str, conditions: str) -> Fitted:
    dataset = _impacts(campaign, table, conditions)
    force_map = fit_force_map(dataset)
    return Fitted(dataset, force_map, map_accuracy(force_map, dataset))
