"""What one server serves, for the routes of the pages and of their JSON twins."""

from __future__ import annotations

from dataclasses import dataclass

import forcemap as fm
from forcemap.web.campaign_map import CampaignMap
from forcemap.web.fitted_campaign import fitted_campaign
from forcemap.web.folder import Folder
from forcemap.web.intake import Intake
from forcemap.web.limits import given_table, limits_of
from forcemap.web.work_queue import WorkQueue


@dataclass(frozen=True)
class Site:
    """The campaigns of a folder, the intake of their files, the queue of slow answers, and the server's limits.

    Parameters
    ----------
    folder : Folder
    intake : Intake
    queue : WorkQueue
    limit_table : str
        File of the table given to the server; empty leaves the choice to each campaign.
    """

    folder: Folder
    intake: Intake
    queue: WorkQueue
    limit_table: str

    @property
    def table(self) -> fm.LimitTable | None:
        """The table given to the server, as its file is now."""
        return given_table(self.limit_table)

    def campaign_map(self, name: str) -> CampaignMap:
        """The fitted map of a campaign with its limits."""
        path = self.folder.campaign(name)
        limits = limits_of(path, self.table)
        limits.required()
        return CampaignMap(fitted_campaign(path), limits)
