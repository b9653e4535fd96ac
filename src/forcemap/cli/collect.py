"""forcemap collect."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from forcemap import (
    Campaign,
    CampaignSummary,
    ForcemapError,
    ImpactDataset,
    InputError,
    Repeatability,
    build_dataset,
    campaign_summary,
    read_campaign,
    repeatability,
)
from forcemap.cli.options import Json
from forcemap.cli.output import Progress, emit, emit_error, listing

_SHOWN = 12  # lines of a list
_STEADY = 1.5  # files that stay as they are for so long are complete [s]


def collect(
    folder: Annotated[str, typer.Argument(help="Campaign folder, as forcemap plan makes it.")],
    watch: Annotated[
        bool, typer.Option("--watch", help="Go on and pick up new files until interrupted (Ctrl-C).")
    ] = False,
    as_json: Json = False,
) -> None:
    """Read and judge all recordings of a campaign and write its impacts table.

    Example: forcemap collect my-campaign
    """
    if watch:
        if as_json:
            raise InputError("watch: --watch goes on until interrupted and prints text; leave --json out")
        _watch(folder)
        return
    campaign, dataset = _collect(folder)
    summary, scatter = campaign_summary(campaign, dataset), repeatability(dataset)
    emit(_result(campaign, dataset, summary, scatter), _lines(campaign, dataset, summary, scatter), as_json=as_json)


def _collect(folder: str) -> tuple[Campaign, ImpactDataset]:
    campaign = read_campaign(folder)
    with Progress("recordings read", len(campaign.files())) as progress:
        dataset = build_dataset(campaign, progress=lambda done, _: progress.show(done))
    return read_campaign(folder), dataset


def _watch(folder: str) -> None:
    """Collect whenever files have been added and are complete, and say what is missing.

    Files are complete once they have stayed as they are, by this program's own clock: the time a file bears may be that
    of another machine.
    """
    seen: dict[str, tuple[int, int]] = {}
    collected, since = seen, time.monotonic()
    print(f"watching {read_campaign(folder).recordings}; Ctrl-C ends", flush=True)
    while True:
        campaign = read_campaign(folder)
        files = {file: _state(campaign.recordings / file) for file in campaign.files()}
        if files != seen:
            seen, since = files, time.monotonic()
        elif files != collected and time.monotonic() - since >= _STEADY:
            new = sorted(file for file in files if files[file] != collected.get(file))
            collected = files
            try:
                campaign, dataset = _collect(folder)
                judged = {entry.file: entry for entry in campaign.entries}
                for file in new[-_SHOWN:]:
                    entry = judged.get(file)
                    print(f"  {file}: {entry.use if entry else 'unknown'} {entry.reason if entry else ''}".rstrip())
                print(f"{len(dataset)} impacts; {_missing_words(campaign.missing)}", flush=True)
            except ForcemapError as error:
                emit_error(error, as_json=False)
        time.sleep(0.5)


def _state(path: Path) -> tuple[int, int]:
    """Size and time of a file, as long as it is there."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_size, status.st_mtime_ns


def _missing_words(missing: list[str]) -> str:
    if not missing:
        return "every planned run is there"
    more = f" and {len(missing) - 6} more" if len(missing) > 6 else ""
    return f"missing runs: {len(missing)}, next {', '.join(missing[:6])}{more}"


def _result(
    campaign: Campaign, dataset: ImpactDataset, summary: CampaignSummary, scatter: Repeatability
) -> dict[str, Any]:
    phase_two = summary.phase_two
    symmetry = scatter.symmetry
    return {
        "folder": str(campaign.folder),
        "simulated": dataset.simulated,
        "binding": {"state": dataset.binding.state.value, "reason": dataset.binding.reason},
        "recordings": summary.recordings,
        "used": summary.used,
        "states": len(dataset.states),
        "censored": int(dataset.censored.sum()),
        "discards": [
            {"recording": entry.name, "use": entry.use.value, "reason": entry.reason} for entry in summary.discards
        ],
        "missing": list(summary.missing),
        "flags": summary.flags,
        "scenarios": {scenario.value: count for scenario, count in phase_two.scenarios.items()},
        "largest_phase2_force_N": phase_two.largest_force,
        "contacts": [
            {"state_id": each.state, "transient_allowed": each.transient_allowed, "reason": each.reason}
            for each in summary.contacts
        ],
        "repeatability": {
            "max_sd_N": scatter.max_sd,
            "mean_sd_N": scatter.mean_sd,
            "max_sd_percent": scatter.max_sd_percent,
            "mean_sd_percent": scatter.mean_sd_percent,
            "within_state_sd_percent": scatter.within_state_sd_percent,
            "between_state_sd_percent": scatter.between_state_sd_percent,
            "outliers": [
                {
                    "state_id": each.state,
                    "repeat": each.repeat,
                    "recording": each.recording,
                    "force_N": each.force,
                    "deviation_N": each.deviation,
                }
                for each in scatter.outliers
            ],
            "symmetry": None
            if symmetry is None
            else {
                "max_difference_N": symmetry.max_difference,
                "mean_difference_N": symmetry.mean_difference,
                "max_difference_percent": symmetry.max_difference_percent,
                "mean_difference_percent": symmetry.mean_difference_percent,
            },
        },
        "not_stated": list(summary.not_stated),
        "files": [campaign.register_file.name, campaign.table_file.name],
    }


def _lines(campaign: Campaign, dataset: ImpactDataset, summary: CampaignSummary, scatter: Repeatability) -> list[str]:
    lines = ["SIMULATED recordings: not a measurement of any robot"] if dataset.simulated else []
    lines += [f"NO SPEED from these impacts: {dataset.binding.refusal}"] if dataset.binding.refusal else []
    if math.isnan(dataset.conditions.device.stiffness):
        lines += ["NO SPEED for a body area yet: campaign.toml does not state the device's spring, stiffness_N_per_m"]
    lines += [
        f"{summary.recordings} recordings: {summary.used} used, in {len(dataset.states)} states; "
        f"{int(dataset.censored.sum())} of them reached the device range (censored)"
    ]
    if summary.discards:
        lines += listing("Not used", _shortened([f"{e.name}: {e.use}, {e.reason}" for e in summary.discards]))
    if summary.flags:
        lines += ["Flags of the used ones: " + ", ".join(f"{name} {count}" for name, count in summary.flags.items())]
    lines += [
        _missing_words(list(summary.missing)).capitalize(),
        "",
        *contact_lines(summary),
        *scatter_lines(scatter),
    ]
    if summary.not_stated:
        lines += ["", "campaign.toml does not state: " + ", ".join(summary.not_stated)]
    return [
        *lines,
        "",
        f"Written: {campaign.register_file} (every recording and what became of it), {campaign.table_file}",
        f"Next: forcemap fit {campaign.folder}",
    ]


def contact_lines(summary: CampaignSummary) -> list[str]:
    """Which limits the impacts allow, and why."""
    barred = [each for each in summary.contacts if not each.transient_allowed]
    refusal = summary.phase_two.transient_refusal(math.inf, 0.0)
    lines = [summary.phase_two.statement()]
    if not refusal:
        return [*lines, "Transient limit: may be used, no impact clamps or was left undetermined"]
    lines.append(f"Transient limit: not for a map of this campaign: {refusal}")
    if len(barred) < len(summary.contacts):
        lines += [f"  - {line}" for line in _shortened([f"{each.state}: {each.reason}" for each in barred])]
    return lines


def scatter_lines(scatter: Repeatability) -> list[str]:
    """How far repeats agree."""
    lines = []
    if not math.isnan(scatter.mean_sd):
        lines.append(
            f"Repeatability: SD of the repeats of a state {scatter.mean_sd:.1f} N on average "
            f"({scatter.mean_sd_percent:.1f} %), {scatter.max_sd:.1f} N at most"
        )
    lines += [
        f"  outlier: {each.recording or each.state} repeat {each.repeat}: {each.force:.1f} N, "
        f"{each.deviation:+.1f} N from the others; look at the recording"
        for each in scatter.outliers
    ]
    if scatter.symmetry is not None:
        symmetry = scatter.symmetry
        lines.append(
            f"Rotational symmetry: forces on one circle differ by {symmetry.mean_difference:.1f} N on average "
            f"({symmetry.mean_difference_percent:.1f} %), {symmetry.max_difference:.1f} N at most "
            f"({symmetry.max_difference_percent:.1f} %)"
        )
    return lines


def _shortened(lines: list[str]) -> list[str]:
    more = [f"... and {len(lines) - _SHOWN} more; recordings.csv and --json list all"] if len(lines) > _SHOWN else []
    return [*lines[:_SHOWN], *more]
