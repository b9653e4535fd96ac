"""The limits behind a campaign's answers: which table, and which body area where a question names none.

The table is the server's, else that of campaign.toml, else the standard's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import forcemap as fm
from forcemap.assessment.contact_points import POINTS_FILE, read_contact_points
from forcemap.assessment.folder import campaign_limit_table
from forcemap.assessment.missing import Missing, attempt
from forcemap.errors import CampaignFileError
from forcemap.web.request_error import RequestError

NO_AREA = (
    "area: no body area was chosen, and none is assumed; expected the one that can be hit, such as area=back_of_hand "
    f"(forcemap limits lists them), or contact points in {POINTS_FILE}"
)


def given_table(file: str) -> fm.LimitTable | None:
    """The table of limits given to the server, as its file is now; None without one. Errors as `read_limit_table`."""
    return fm.read_limit_table(file) if file else None


@dataclass(frozen=True)
class Limits:
    """A table of limits, what is to be said of it, and whose limits are asked for where a question names no body area.

    Parameters
    ----------
    table : LimitTable or None
        None is the standard's.
    statements : tuple of str
        What campaign.toml names and is not used, in words.
    areas : tuple of str
        Body areas of the campaign's contact points, as they are listed; none if it lists none that can be used.
    points : int
        How many contact points it lists.
    points_problem : str
        Why its list cannot be used; empty if it can, or if there is none.
    refusal : ForcemapError or None
        Why the table that campaign.toml names cannot be used: then there are no limits.
    """

    table: fm.LimitTable | None
    statements: tuple[str, ...] = ()
    areas: tuple[str, ...] = ()
    points: int = 0
    points_problem: str = ""
    refusal: fm.ForcemapError | None = None

    @property
    def used(self) -> fm.LimitTable:
        """The table."""
        return self.table or fm.standard_limit_table()

    @property
    def otherwise(self) -> dict[str, Any]:
        """The body area of a question that names none: the first of the contact points, or none."""
        return {"area": self.areas[0]} if self.areas else {}

    def area(self, asked: str) -> str:
        """The body area that is asked for, else the first of the contact points.

        Raises
        ------
        RequestError
            There is neither; none is assumed.
        """
        if not asked and not self.areas:
            raise RequestError(422, "area", NO_AREA)
        return asked or self.areas[0]

    def of(self, area: str) -> fm.ForceLimit:
        """The limits of a body area or region; errors as `area` and `required`."""
        return fm.force_limit(self.area(area), table=self.required())

    def required(self) -> fm.LimitTable | None:
        """The table, None for the standard's; `refusal` is raised if there is one."""
        if self.refusal:
            raise self.refusal
        return self.table


def limits_of(campaign: Path, given: fm.LimitTable | None) -> Limits:
    """The limits for a campaign; a table given to the server comes before that of campaign.toml.

    Raises
    ------
    CampaignFileError
        campaign.toml cannot be used.
    """
    limits = _table_of(campaign, given)
    if not (listed := campaign / POINTS_FILE).exists():
        return limits
    points = attempt(lambda: read_contact_points(listed, table=limits.required()))
    if isinstance(points, Missing):
        return replace(limits, points_problem=points.reason)
    return replace(limits, points=len(points), areas=tuple(dict.fromkeys(point.limit.name for point in points)))


def _table_of(campaign: Path, given: fm.LimitTable | None) -> Limits:
    described = campaign / "campaign.toml"
    if given is not None or not described.exists():
        return Limits(given)
    conditions = fm.read_conditions(described)
    try:
        chosen, name = campaign_limit_table(campaign, conditions), conditions.limit_table
    except CampaignFileError as error:
        return Limits(None, refusal=error)
    if chosen.file or not name:
        return Limits(chosen.table)
    unused = f"campaign.toml names the limit table {name}, which is not used here: start with --limit-table {name}"
    return Limits(None, (unused,))
