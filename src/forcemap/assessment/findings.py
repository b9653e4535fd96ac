"""What does not fit together in a campaign's folder: said first, before any result."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from forcemap.campaigns.build import build_dataset
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions
from forcemap.campaigns.impacts_table import TABLE_FILE
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.recordings_table import REGISTER_FILE
from forcemap.errors import ForcemapError
from forcemap.files import file_sha256, read_bytes
from forcemap.limits.device_spring import device_suitability
from forcemap.limits.force_limits import ForceLimit


@dataclass(frozen=True, eq=False)
class _Elsewhere(Campaign):
    """The same campaign, with what is written going to another folder; the raw files stay where they are."""

    raw: Path = Path()

    @property
    def recordings(self) -> Path:
        """The folder of raw files."""
        return self.raw


def conditions_findings(conditions: Conditions, limits: Sequence[ForceLimit]) -> list[str]:
    """What the stated conditions contradict or leave open that every result hangs on."""
    found = [limit.head_statement for limit in limits if limit.head_statement]
    for limit in limits:
        suits = device_suitability(limit.name, limit.stiffness, conditions.device.stiffness)
        if limit.permitted and suits.refusal:
            found.append(f"no speed and no verdict within limits for {limit.name}: {suits.refusal}")
    if conditions.date and conditions.device.expired(conditions.date):
        found.append(f"the calibration of the force measuring device had expired on {conditions.date}")
    if math.isnan(conditions.device.range):
        found.append("the device range is not stated: a saturated recording would pass for a good one")
    editions = list(dict.fromkeys(limit.edition for limit in limits))
    stated = conditions.standard_edition
    if stated and any(stated.split(",")[0].strip() not in edition for edition in editions):
        found.append(f"campaign.toml states the edition {stated}, the limits used here are of {', '.join(editions)}")
    return found


def file_findings(campaign: Campaign) -> list[str]:
    """What differs between recordings, register and impacts table.

    The register and the table are made again from the recordings, in a folder of their own, and compared.
    """
    try:
        there = set(campaign.files())
    except ForcemapError as error:
        return [f"the recordings cannot be read: {error.message}"]
    if not there and not campaign.entries:
        return ["there are no recordings: nothing here can be traced back to a force-time curve"]
    digests = {entry.file: entry.sha256 for entry in campaign.entries if entry.sha256}
    changed = [f for f, digest in digests.items() if f in there and file_sha256(campaign.recordings / f) != digest]
    gone = [file for file in digests if file not in there]
    new = sorted(there - {entry.file for entry in campaign.entries})
    found = [
        *([f"CHANGED since they were registered: {_named(changed)}; restore them"] if changed else []),
        *([f"registered, but the files are gone: {_named(gone)}"] if gone else []),
        *([f"not registered yet: {_named(new)}; run forcemap collect"] if new else []),
    ]
    return found or _table_findings(campaign)


def _table_findings(campaign: Campaign) -> list[str]:
    if not campaign.table_file.exists():
        return [f"there is no {TABLE_FILE}: run forcemap collect"]
    with tempfile.TemporaryDirectory() as home:
        for name in (CAMPAIGN_FILE, PLAN_FILE, REGISTER_FILE):
            if (campaign.folder / name).exists():
                shutil.copyfile(campaign.folder / name, Path(home, name))
        elsewhere = _Elsewhere(**(vars(campaign) | {"folder": Path(home), "raw": campaign.recordings}))
        try:
            build_dataset(elsewhere)
        except ForcemapError as error:
            return [f"the recordings do not give {TABLE_FILE}: {error.message}"]
        ours, made = (read_bytes(each.table_file).splitlines() for each in (campaign, elsewhere))
    if ours == made:
        return []
    rows = [i for i, (one, other) in enumerate(zip(ours, made, strict=False), start=1) if one != other]
    where = f"first in row {rows[0]}" if rows else f"{len(ours) - 1} impacts, not {len(made) - 1}"
    return [
        f"{TABLE_FILE} is NOT what its recordings give ({where}): changed by hand, or plan.csv, campaign.toml or the "
        f"software changed since; results are those of {TABLE_FILE} as it is"
    ]


def _named(files: Sequence[str]) -> str:
    more = f" and {len(files) - 6} more" if len(files) > 6 else ""
    return ", ".join(files[:6]) + more
