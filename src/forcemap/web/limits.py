"""The table of limits behind a campaign's answers: the server's, else that of campaign.toml, else the standard's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import forcemap as fm
from forcemap.assessment.folder import campaign_limit_table
from forcemap.errors import UnknownName
from forcemap.web.question import Area
from forcemap.words import sentence


@dataclass(frozen=True)
class Limits:
    """A table of limits, and what is to be said of it.

    Parameters
    ----------
    table : LimitTable or None
        None is the standard's.
    statements : tuple of str
        What campaign.toml names and is not used, in words.
    """

    table: fm.LimitTable | None
    statements: tuple[str, ...] = ()

    @property
    def otherwise(self) -> dict[str, Any]:
        """The body area of a question that names none, where the table lacks the usual one."""
        table, usual = self.table or fm.standard_limit_table(), str(Area.model_fields["area"].default)
        try:
            table.find(usual)
        except UnknownName:
            return {"area": table.regions[0]}
        return {}

    def of(self, area: str) -> fm.ForceLimit:
        """The limits of a body area or region."""
        return fm.force_limit(area, table=self.table)


def limits_of(campaign: Path, given: fm.LimitTable | None) -> Limits:
    """The limits for a campaign; a table given to the server comes before that of campaign.toml.

    Raises
    ------
    CampaignFileError
        campaign.toml cannot be used.
    """
    described = campaign / "campaign.toml"
    if given is not None or not described.exists():
        return Limits(given)
    conditions = fm.read_conditions(described)
    chosen, name = campaign_limit_table(campaign, conditions), conditions.limit_table
    if chosen.file or not name:
        return Limits(chosen.table)
    unused = f"campaign.toml names the limit table {name}, which is not used here: start with --limit-table {name}"
    return Limits(None, (unused, *([sentence(chosen.finding)] if chosen.finding else [])))
