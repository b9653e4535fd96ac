"""Whether impacts at released speeds confirm a campaign's map, as its folder stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from forcemap.campaigns.campaign import Campaign, read_campaign
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.recordings_table import Use
from forcemap.errors import ForcemapError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit
from forcemap.maps.bounds import Bound, weakness
from forcemap.maps.force_map import ForceMap
from forcemap.planning.confirm import ConfirmationPlan, ConfirmationResult, Confirmed, confirm_plan
from forcemap.speeds.basis import confirming_states
from forcemap.verdicts.recording_results import check_campaign
from forcemap.verdicts.verdict import VerdictOutcome

_WITHIN = {VerdictOutcome.WITHIN: True, VerdictOutcome.CANNOT_TELL: None, VerdictOutcome.EXCEEDED: False}


def confirmation_plan(
    campaign: Campaign,
    dataset: ImpactDataset,
    force_map: ForceMap,
    *,
    bound: Bound,
    limit: ForceLimit | NewtonLimit,
    contact: Contact | None,
    impacts: int | None = None,
) -> ConfirmationPlan:
    """The impacts that confirm a campaign's map, planned and judged.

    One that fails at a higher speed than is released now is replaced by one at a speed that is.

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
    limit, contact, impacts
        As in `confirm_plan`.
    """
    recorded, checked = campaign.recorded.union(dataset.state.tolist()), checked_impacts(campaign, limit, contact)
    case: dict[str, Any] = {"bound": bound, "contact": contact, "impacts": impacts, "recorded": recorded}
    case["planned"] = campaign.plan
    plan = confirm_plan(force_map, limit, **case).judged(dataset, checked)
    if plan.superseded:
        plan = confirm_plan(force_map, limit, superseded=plan.superseded, **case).judged(dataset, checked)
    confirming = campaign.plan.recording[ConfirmationPlan.among(campaign.plan)]
    if missing := [name for name in campaign.missing if name not in confirming]:
        found = Finding.of(FindingKind.CONFIRM_RUNS_MISSING, runs=len(missing), first=missing[0])
        plan = replace(plan, warnings=(found, *plan.warnings))
    return plan


Confirmations = Callable[[ForceLimit | NewtonLimit, Contact | None, Bound], ConfirmationResult | None]
"""The result of the impacts that were made to confirm a map, for a limit, a contact and a bound; None without any."""


def confirmations(
    folder: str | Path, dataset: ImpactDataset, force_map: ForceMap, campaign: Campaign | None = None
) -> Confirmations:
    """Those of a campaign's map; each is worked out once, and the folder read when the first is asked for."""

    known: dict[tuple[ForceLimit | NewtonLimit, Contact | None, Bound], ConfirmationResult | None] = {}

    def of(limit: ForceLimit | NewtonLimit, contact: Contact | None, bound: Bound) -> ConfirmationResult | None:
        if (limit, contact, bound) not in known:
            known[limit, contact, bound] = judged(limit, contact, bound)
        return known[limit, contact, bound]

    def judged(limit: ForceLimit | NewtonLimit, contact: Contact | None, bound: Bound) -> ConfirmationResult | None:
        if campaign is None and not (Path(folder) / PLAN_FILE).exists():
            return None
        whole = campaign or read_campaign(folder)
        if not ConfirmationPlan.among(whole.plan).any() or weakness(bound, force_map):
            return None
        if isinstance(limit, ForceLimit) and not limit.permitted:
            return None
        plan = confirmation_plan(whole, dataset, force_map, bound=bound, limit=limit, contact=contact)
        result = plan.result or _none_measured(plan)
        waiting = sorted(set(whole.files()) - {entry.file for entry in whole.entries})
        if result is None or result.outcome is Confirmed.DOES_NOT_PASS or not waiting:
            return result
        new = Finding.of(FindingKind.RECORDINGS_NEW, files=tuple(waiting))
        return replace(result, outcome=Confirmed.CANNOT_TELL, reason=new)

    return of


def _none_measured(plan: ConfirmationPlan) -> ConfirmationResult | None:
    """The result where runs are planned and none is measured; None if none is planned for these speeds."""
    missing = tuple(name for name in plan.plan.recording.tolist() if name not in plan.added.recording)
    if plan.refusal or not missing:
        return None
    reason = Finding.of(FindingKind.RUNS_MISSING, runs=len(missing), of=len(plan.plan))
    return ConfirmationResult((), missing, Confirmed.CANNOT_TELL, reason)


def saying(force_map: ForceMap, confirmed: Confirmations) -> ForceMap:
    """The map, whose speeds say what the impacts that were to confirm it show."""

    def finding(limit: ForceLimit | NewtonLimit, contact: Contact | None, bound: Bound) -> Finding | None:
        if np.ndim(limit.force) if isinstance(limit, NewtonLimit) else not limit.permitted:
            return None
        newtons = limit.force if isinstance(limit, NewtonLimit) else limit.force(contact or Contact.TRANSIENT)
        of: dict[str, Any] = {"limit_N": float(newtons), "contact": contact and str(contact)}
        try:
            result = confirmed(limit, contact, bound)
        except ForcemapError as error:
            return Finding.of(FindingKind.NOT_CONFIRMED_YET, in_words(error.message), **of)
        if result is None:
            made = Finding.of(FindingKind.CONFIRMED_OTHERWISE)
            return Finding.of(FindingKind.NOT_CONFIRMED_YET, made, **of) if confirming_states(force_map) else None
        if result.outcome is Confirmed.PASSES:
            return Finding.of(FindingKind.CONFIRMED_BY, impacts=len(result.impacts), **result.missed, **of)
        if result.outcome is Confirmed.DOES_NOT_PASS:
            return Finding.of(FindingKind.NOT_BORNE_OUT, result.reason)
        return Finding.of(FindingKind.NOT_CONFIRMED_YET, result.reason, **of)

    return replace(force_map, confirmed=finding)


def checked_impacts(
    campaign: Campaign, limit: ForceLimit | NewtonLimit, contact: Contact | None
) -> dict[str, tuple[bool | None, Finding]]:
    """Whether the recordings of confirming runs are within the limit (as `forcemap check`), and why.

    By recording; by run where a recording is there that is not used.
    """
    plan = campaign.plan
    confirming = frozenset(plan.select(ConfirmationPlan.among(plan)).states)
    check = check_campaign(campaign, limit, contact=contact, states=confirming)
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
