"""The map of a campaign's folder as the folder stands: its recordings looked at, and what confirms it at hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from forcemap.assessment.confirmation import Confirmations, confirmations, saying
from forcemap.assessment.folder import as_recorded, beside
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.impacts_table import read_dataset
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.maps.carry_over import campaign_map
from forcemap.maps.fit import CensoredImpacts
from forcemap.maps.force_map import ForceMap
from forcemap.maps.forms import Form


@dataclass(frozen=True, eq=False)
class FolderMap:
    """The impacts of a folder or table, and the map fitted to them.

    Parameters
    ----------
    dataset : ImpactDataset
        Without any speed where a recording beside them is no longer the one that was registered.
    force_map : ForceMap
        Its speeds say whether the folder's impacts confirm them.
    confirmed : callable
        The result of these impacts, for a limit, a contact and a bound.
    """

    dataset: ImpactDataset
    force_map: ForceMap
    confirmed: Confirmations


def folder_map(
    source: str | Path,
    dataset: ImpactDataset,
    *,
    form: Form | None = None,
    impacts: CensoredImpacts = CensoredImpacts.AT_LEAST,
) -> FolderMap:
    """The map of impacts that were read from a campaign's folder, its impacts table, or another table.

    Parameters
    ----------
    source : str or Path
        Where they were read from.
    dataset : ImpactDataset
    form, impacts
        As in `campaign_map`.

    Raises
    ------
    FitError
        The impacts do not determine a map.
    """
    dataset = as_recorded(dataset, source)
    force_map = campaign_map(source, dataset, form=form, impacts=impacts)
    confirmed = confirmations(beside(source), dataset, force_map)
    planned = (beside(source) / PLAN_FILE).exists()  # without it nobody can tell what an impact was made for
    return FolderMap(dataset, saying(force_map, confirmed) if planned else force_map, confirmed)


def map_of_folder(folder: str | Path) -> ForceMap:
    """The map of a campaign's folder, as `folder_map` has it."""
    return folder_map(folder, read_dataset(folder)).force_map
