"""Many campaigns as one HTML page: what failed and why, what is due, what changed, and what holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from forcemap.report.document import environment

FLEET_MARK = "forcemap-fleet"
"""Name of the meta entry by which the page is known."""


def fleet_html(fleet: Mapping[str, Any], links: Mapping[str, str]) -> str:
    """The page of a fleet: no script, nothing fetched.

    Parameters
    ----------
    fleet : mapping
        What `forcemap fleet --json` says.
    links : mapping of str to str
        Where the report of a folder is, from the page.
    """
    return environment().get_template("fleet.html").render(fleet=fleet, links=links, mark=FLEET_MARK)
