"""Whether impacts at released speeds confirm a campaign's map, as its folder stands."""

from __future__ import annotations

from pathlib import PurePosixPath

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.recordings_table import Use
from forcemap.findings import Finding, in_words
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound, weakness
from forcemap.maps.force_map import ForceMap
from forcemap.planning.confirm import ConfirmationPlan, ConfirmationResult, confirm_plan
from forcemap.verdicts.recording_results import check_campaign
from forcemap.verdicts.verdict import VerdictOutcome

_WITHIN = {VerdictOutcome.WITHIN: True, VerdictOutcome.CANNOT_TELL: None, VerdictOutcome.EXCEEDED: False}


def confirmation(
    campaign: Campaign,
    dataset: ImpactDataset,
    force_map: ForceMap,
    *,
    bound: Bound,
    limit: ForceLimit,
    contact: Contact,
) -> ConfirmationResult | None:
    """Whether the impacts at released speeds that were measured confirm the map for a limit; None if there are none.

    Parameters
    ----------
    campaign : Campaign
        With the plan and the recordings of these impacts.
    dataset : ImpactDataset
        Its impacts.
    force_map : ForceMap
        The map that released the speeds.
    bound : Bound
        The bound that released them.
    limit : ForceLimit
    contact : Contact
    """
    if not ConfirmationPlan.among(campaign.plan).any() or not limit.permitted or weakness(bound, force_map):
        return None
    if set(campaign.files()) - {entry.file for entry in campaign.entries}:
        return None  # not collected yet
    recorded = campaign.recorded.union(dataset.state.tolist())
    plan = confirm_plan(force_map, limit, bound=bound, contact=contact, planned=campaign.plan, recorded=recorded)
    return plan.judged(dataset, checked_impacts(campaign, limit, contact)).result


def checked_impacts(
    campaign: Campaign, limit: ForceLimit | NewtonLimit, contact: Contact | None
) -> dict[str, tuple[bool | None, Finding]]:
    """Whether the recordings of confirming runs are within the limit (as `forcemap check`), and why.

    By recording; by run where a recording is there that is not used.
    """
    plan = campaign.plan
    confirming = plan.select(ConfirmationPlan.among(plan)).states
    check = check_campaign(campaign, limit, contact=contact)
    recordings = {recording.name: recording for recording in check.recordings}
    checked: dict[str, tuple[bool | None, Finding]] = {}
    for entry in campaign.entries:
        named = plan.run_named(PurePosixPath(entry.file).stem) or plan.run_named(entry.curve) or ("", 0)
        state, repeat = (entry.state_id, entry.repeat) if entry.state_id else named
        if state in confirming and entry.use is not Use.USED:
            checked[f"{state}-r{repeat}"] = None, in_words(f"{entry.use}: {entry.reason}")
        elif state in confirming:
            recording = recordings.get(entry.name)  # None: its file has another name now
            verdicts = recording.verdicts if recording else ()
            worst = max(verdicts, key=lambda verdict: verdict.outcome.severity, default=None)
            gone = in_words("not judged as it was registered; run forcemap collect")
            why = worst.governing.reason if worst else (recording and recording.not_judged) or gone
            within = _WITHIN[worst.outcome] if worst else None
            pressure = recording.pressure if recording else None
            if pressure and within is not False and pressure.outcome is not VerdictOutcome.WITHIN:
                within, why = _WITHIN[pressure.outcome], pressure.reason
            checked[entry.name] = within, why
    return checked
