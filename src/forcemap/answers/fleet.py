"""Many campaigns at once: what `fleet` prints, and what its page and table show."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from forcemap.answers.answer import Answer, Figure, Said, if_any


class LastMapAnswer(Answer):
    """What impacts newer than a campaign's last map say of it."""

    outcome: str
    reason: Said
    next_step: Said
    mean_ratio: Figure


class FleetCampaign(Answer):
    """A campaign; `report` is what `forcemap report --json` says of it, null where nothing could be made.

    With a register `entered` is true if it was new there.
    """

    folder: str = ""
    made_again: bool
    failed: str | None = None
    changed: list[str] = Field(default_factory=list)
    due: list[str] = Field(default_factory=list)
    states: int | None = None
    missing_runs: int | None = None
    last_map: LastMapAnswer | None = None
    report: dict[str, Any] | None = None
    entered: bool | None = if_any()


class FleetAnswer(Answer):
    """All campaigns, in the order they were named."""

    date: str
    software: str
    made_again: int
    unchanged: int
    failed: int
    campaigns: list[FleetCampaign]
    files: list[str]
