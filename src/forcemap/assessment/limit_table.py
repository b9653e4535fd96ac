"""The table of limits that a campaign names for itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from forcemap.assessment.missing import error_words
from forcemap.campaigns.conditions import Conditions
from forcemap.errors import ForcemapError
from forcemap.limits.body_areas import LimitTable, read_limit_table, standard_limit_table


@dataclass(frozen=True)
class CampaignLimitTable:
    """The table of limits of a campaign.

    Parameters
    ----------
    table : LimitTable
        That of the campaign, else the standard's.
    file : str
        Its file in the campaign's folder; empty for the standard's.
    finding : str
        Why a table that campaign.toml names was not used; empty if none is, or it was.
    """

    table: LimitTable
    file: str
    finding: str


def campaign_limit_table(folder: str | Path, conditions: Conditions) -> CampaignLimitTable:
    """The table that campaign.toml names, if it is a file of the folder, else the standard's.

    Parameters
    ----------
    folder : str or Path
        The campaign's folder; a file outside it is not read.
    conditions : Conditions
        Of the campaign.
    """
    standard, name = standard_limit_table(), conditions.limit_table
    if not name.lower().endswith(".csv"):  # a name in words
        return CampaignLimitTable(standard, "", "")
    home = Path(folder).resolve()
    try:
        file = (home / name).resolve()
        inside = file.is_relative_to(home) and file.is_file()
    except (OSError, ValueError):  # what no file can be named
        inside = False
    if not inside:
        finding = f"the limit table {name!r} of campaign.toml is no file of this folder; it was not used"
        return CampaignLimitTable(standard, "", finding)
    try:
        return CampaignLimitTable(read_limit_table(file), file.relative_to(home).as_posix(), "")
    except ForcemapError as error:
        finding = f"the limit table of campaign.toml cannot be used: {error_words(error)}; it was not used"
        return CampaignLimitTable(standard, "", finding)
