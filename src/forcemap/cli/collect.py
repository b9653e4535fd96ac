"""forcemap collect."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from forcemap import Campaign, ForcemapError, ImpactDataset, InputError, build_dataset, read_campaign
from forcemap.answers.collect import CollectAnswer, Repeatability
from forcemap.cli.check import SHOWN, SIMULATED, shortened
from forcemap.cli.options import Json
from forcemap.cli.output import Progress, emit, emit_error, listing

_STEADY = 1.5  # files that stay as they are for so long are complete [s]


def collect(
    folder: Annotated[str, Argument(help="Campaign folder, as forcemap plan makes it.")],
    watch: Annotated[bool, Option("--watch", help="Go on and pick up new files until interrupted (Ctrl-C).")] = False,
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
    answer = CollectAnswer.of_campaign(*_collect(folder))
    emit(answer, _lines(answer, folder), as_json=as_json)


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
                for file in new[-SHOWN:]:
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


def _lines(answer: CollectAnswer, folder: str) -> list[str]:
    lines = [SIMULATED] * answer.simulated
    lines += [f"NO SPEED from these impacts: {answer.no_speed}"] if answer.no_speed else []
    lines += [
        f"{answer.recordings} recordings: {answer.used} used, in {answer.states} states; {answer.censored} of them "
        "reached the device range (censored)",
        _missing_words(answer.missing).capitalize(),
    ]
    if answer.discards:
        lines += listing("Not used", shortened([f"{e.recording}: {e.use}, {e.reason}" for e in answer.discards]))
    if answer.flags:
        lines += ["Flags of the used ones: " + ", ".join(f"{name} {count}" for name, count in answer.flags.items())]
    lines += ["", *contact_lines(answer), *scatter_lines(answer.repeatability)]
    if answer.not_stated:
        lines += ["", "campaign.toml does not state: " + ", ".join(answer.not_stated)]
    register, table = (Path(folder, name) for name in answer.files)
    return [
        *lines,
        "",
        f"Written: {register} (every recording and what became of it), {table}",
        f"Next: forcemap fit {folder}",
    ]


def contact_lines(answer: CollectAnswer) -> list[str]:
    """Which limits the impacts allow, and why."""
    barred = [f"{each.state_id}: {each.reason}" for each in answer.contacts if not each.transient_allowed]
    if not answer.transient_refused:
        return [answer.phase_two, "Transient limit: may be used, no impact clamps or was left undetermined"]
    refused = f"Transient limit: not for a map of this campaign: {'; '.join(answer.transient_refused)}"
    why = shortened(barred) if len(barred) < len(answer.contacts) else []
    return [answer.phase_two, refused, *(f"  - {line}" for line in why)]


def scatter_lines(scatter: Repeatability) -> list[str]:
    """How far repeats agree."""
    lines, symmetry = [], scatter.symmetry
    if scatter.mean_sd_N is not None:
        lines.append(
            f"Repeatability: SD of the repeats of a state {scatter.mean_sd_N:.1f} N on average "
            f"({scatter.mean_sd_percent:.1f} %), {scatter.max_sd_N:.1f} N at most"
        )
    lines += [f"  outlier: {each.words}; look at the recording" for each in scatter.outliers]
    if symmetry is not None and symmetry.mean_difference_N is not None:
        lines.append(
            f"Rotational symmetry: forces on one circle differ by {symmetry.mean_difference_N:.1f} N on average "
            f"({symmetry.mean_difference_percent:.1f} %), {symmetry.max_difference_N:.1f} N at most "
            f"({symmetry.max_difference_percent:.1f} %)"
        )
    return lines
