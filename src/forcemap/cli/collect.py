"""forcemap collect."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from typer import Argument, Option, confirm

from forcemap import Campaign, ForcemapError, ImpactDataset, InputError, collect_campaign, read_campaign
from forcemap.answers.collect import AssignAnswer, CollectAnswer, ProposedRun, Repeatability
from forcemap.campaigns.build import entered_since, registered_recordings
from forcemap.campaigns.dataset import DISAGREEMENT
from forcemap.campaigns.recordings_table import Use
from forcemap.campaigns.run_order import RecordingOrder, assign_runs, propose_runs
from forcemap.campaigns.workers import processors
from forcemap.cli.check import SHOWN, shortened
from forcemap.cli.options import Json
from forcemap.cli.output import Progress, counted, emit, emit_error, listing, table, verdict_first
from forcemap.errors import one_line
from forcemap.planning.confirm import ConfirmationPlan
from forcemap.words import sentence

_STEADY = 1.5
"""How long files must stay as they are to count as complete [s]; a choice: a device writes without a longer pause."""

_LOOK_EVERY = 0.5
"""Time between two looks at a folder that is watched [s]; a choice."""

_LISTED_RUNS = 6
"""Missing runs that are named; of more the number is said. A choice."""


def collect(
    folder: Annotated[str, Argument(help="Campaign folder, as forcemap plan makes it.")],
    watch: Annotated[bool, Option("--watch", help="Go on and pick up new files until interrupted (Ctrl-C).")] = False,
    assign: Annotated[
        RecordingOrder | None,
        Option(
            "--assign",
            help="Take recordings whose names say no run for the missing runs, in the order of the run sheet: by the "
            "numbers in their names, or by the times of their files. Shown first, done after a yes.",
        ),
    ] = None,
    last: Annotated[str, Option("--last", help="With --assign: the run made last, if not all were.")] = "",
    yes: Annotated[bool, Option("--yes", help="With --assign: do it without asking.")] = False,
    as_json: Json = False,
) -> None:
    """Read and judge all recordings of a campaign and write its impacts table.

    What campaign.toml states since of tool, payload, contact site, direction or safety settings is entered with the
    recordings that were there before, and said.

    Example: forcemap collect my-campaign
    """
    if watch:
        if as_json or assign:
            left_out = "--json" if as_json else "--assign"
            raise InputError(f"watch: --watch goes on until interrupted and prints text; leave {left_out} out")
        _watch(folder)
        return
    if assign is not None and not _assigned(folder, assign, last, yes=yes, as_json=as_json):
        return
    before = registered_recordings(read_campaign(folder))
    try:
        campaign, dataset = _collect(folder, enter=True)
    except ForcemapError:
        if entered := entered_since(before, read_campaign(folder)):  # that of contact points, which come first
            print(sentence(entered), file=sys.stderr)
        raise
    confirming = campaign.plan.state_id[ConfirmationPlan.among(campaign.plan)]
    after = (
        f"Next: forcemap fit {folder} tells how good its map is, next what to measure; then confirm, report and export"
    )
    if np.isin(confirming, dataset.state).any():
        after = f"Next: forcemap confirm {folder}, with the same area and contact as when it was planned"
    if 2 * sum(entry.use is not Use.USED for entry in campaign.entries) > len(campaign.entries):
        after = "Next: mend what keeps most recordings from being used (above), and collect again"
    answer = CollectAnswer.of_campaign(campaign, dataset, entered_since(before, campaign))
    emit(answer, _lines(answer, folder, after), as_json=as_json)


def _assigned(folder: str, by: RecordingOrder, last: str, *, yes: bool, as_json: bool) -> bool:
    """Show which recording is taken for which run, and do so if a person says yes; True if it was done."""
    campaign = read_campaign(folder)
    with Progress("recordings read", len(campaign.files())) as progress:
        proposed = propose_runs(campaign, by=by, last=last, progress=lambda done, _: progress.show(done))
    if not (yes and as_json):
        answer = AssignAnswer(folder=folder, by=by, proposed=[ProposedRun.from_result(run) for run in proposed])
        emit(answer, _proposal_lines(answer), as_json=as_json)
    if not proposed:
        return not as_json or yes
    if not yes and (as_json or not sys.stdin.isatty() or not confirm("Register them so?")):
        if not as_json:
            up_to = f" --last {last}" if last else ""
            print(f"Nothing was written; with --yes it is: forcemap collect {folder} --assign {by}{up_to} --yes")
        return False
    assign_runs(campaign, proposed)
    return True


def _proposal_lines(answer: AssignAnswer) -> list[str]:
    if not answer.proposed:
        return ["Every recording says which run it is, or is excluded: nothing to assign."]
    header = ["recording", "written", "run", "d [m]", "h [m]", "v [m/s]", "exp. [N]", "peak [N]"]
    rows = []
    for run in answer.proposed:
        expected = "-" if run.expected_force_N is None else f"{run.expected_force_N:.0f}"
        figures = [f"{figure:.3f}" for figure in (run.distance_m, run.height_m, run.speed_mps)]
        sign, written = " *" if run.out_of_order else "", run.written.partition("-")[2]  # without the year
        rows.append([run.recording + sign, written, run.run, *figures, expected, f"{run.peak_force_N:.1f}"])
    other = "the times of the files" if answer.by == RecordingOrder.NAME else "the names"
    lines = table(header, [[one_line(cell) for cell in row] for row in rows])
    starred = sum(run.out_of_order for run in answer.proposed)
    return [
        *lines,
        *([f"* {starred} would be another run by {other}: look which order is the right one"] * bool(starred)),
    ]


def _collect(folder: str, *, enter: bool = False) -> tuple[Campaign, ImpactDataset]:
    with Progress("recordings read", 0) as progress:
        return collect_campaign(folder, progress=progress.show, workers=processors(), enter=enter)


class _Snapshot(NamedTuple):
    """What collecting depends on, as far as sizes and times of files tell."""

    recordings: dict[str, tuple[int, ...]]
    stated: tuple[tuple[int, ...], ...]
    register: str

    @classmethod
    def of_folder(cls, folder: str) -> _Snapshot:
        campaign = read_campaign(folder)
        recordings = {file: _state(campaign.recordings / file) for file in campaign.files()}
        stated = tuple(_state(campaign.folder / name) for name in ("campaign.toml", "plan.csv"))
        return cls(recordings, stated, campaign.register_sha256)


def _watch(folder: str) -> None:
    """Collect whenever the folder has changed and is complete, and say what is missing; what is wrong is said once.

    Files are complete once they have stayed as they are, by this program's own clock: the time a file bears may be that
    of another machine. One that goes on afterwards is read again as a whole.
    """
    seen = collected = _Snapshot({}, (), "")
    since, wrong = time.monotonic(), ""
    print(f"watching {read_campaign(folder).recordings}; Ctrl-C ends", flush=True)
    while True:
        try:
            now = _Snapshot.of_folder(folder)
            if now != seen:
                seen, since = now, time.monotonic()
            elif now != collected and time.monotonic() - since >= _STEADY:
                new = sorted(now.recordings.items() - collected.recordings.items())
                collected = now
                campaign, dataset = _collect(folder)
                collected = seen = now._replace(register=campaign.register_sha256)
                judged = {entry.file: entry for entry in campaign.entries}
                for entry in [judged[file] for file, _ in new if file in judged][-SHOWN:]:
                    print(one_line(f"  {entry.file}: {entry.use} {entry.reason}").rstrip())
                print(f"{len(dataset)} impacts; {_missing_words(campaign.missing)}", flush=True)
                wrong = ""
        except ForcemapError as error:
            if str(error) != wrong:
                emit_error(error, as_json=False)
            wrong = str(error)
        time.sleep(_LOOK_EVERY)


def _state(path: Path) -> tuple[int, ...]:
    """Size and times of a file, empty if it is gone; the second time cannot be set by a program."""
    try:
        status = path.stat()
    except OSError:
        return ()
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns


def _missing_words(missing: list[str]) -> str:
    if not missing:
        return "every planned run is there"
    more = f" and {len(missing) - _LISTED_RUNS} more" if len(missing) > _LISTED_RUNS else ""
    return f"missing runs: {len(missing)}, next {', '.join(missing[:_LISTED_RUNS])}{more}"


def _lines(answer: CollectAnswer, folder: str, after: str) -> list[str]:
    verdict = (
        f"{answer.recordings} recordings: {answer.used} used, in {answer.states} states; {answer.censored} of them "
        "saturated, at the device range or below it (censored)"
    )
    doubts = [f"NO SPEED from these impacts: {answer.no_speed}"] if answer.no_speed else []
    doubts += [*filter(None, [answer.stated_since]), *answer.contradictions]
    doubts += [answer.drift.finding] if answer.drift and answer.drift.found else []
    lines = verdict_first(verdict, doubts, simulated=answer.simulated)
    lines.append(_missing_words(answer.missing).capitalize())
    if answer.discards:
        lines += listing(
            "Not used", shortened([f"{file.recording}: {file.use}, {file.reason}" for file in answer.discards])
        )
    if unassigned := sum(discard.use == "unassigned" for discard in answer.discards):
        lines += _say_no_run(unassigned, len(answer.missing), folder)
    if answer.flags:
        lines += ["Flags of the used ones: " + ", ".join(f"{name} {count}" for name, count in answer.flags.items())]
    if answer.saturated:
        cut_off = [f"{each.recording}, at least {each.at_least_N:.0f} N" for each in answer.saturated]
        lines += listing("Saturated", shortened(cut_off))
    lines += ["", *contact_lines(answer), *scatter_lines(answer.repeatability)]
    if apart := answer.disagreeing_repeats:
        percent = 100 * (DISAGREEMENT - 1)
        lines.append(f"  repeats lie more than {percent:g} % apart, look at their recordings: {', '.join(apart)}")
    lines += [answer.drift.finding] if answer.drift and not answer.drift.found else []
    lines += [answer.units.capitalize()] if answer.units and answer.units != answer.no_speed else []
    if answer.not_stated:
        lines += ["", "campaign.toml does not state: " + ", ".join(answer.not_stated)]
    register, impacts, *of_points = (str(Path(folder, name)) for name in answer.files)
    recorded = counted(answer.point_recordings, "recording")
    return [
        *lines,
        "",
        f"Written: {register} (every recording and what became of it), {impacts}",
        *[f"{recorded} of contact points: {name}; what they show stands in forcemap report" for name in of_points],
        "Next: mend what is said first, and collect again" if answer.no_speed or answer.contradictions else after,
    ]


def _say_no_run(unassigned: int, missing: int, folder: str) -> list[str]:
    """How recordings come to their runs: by their order only if there is one for every run."""
    if unassigned == missing:
        return [f"{unassigned} say no run: forcemap collect {folder} --assign name (or time) shows an assignment"]
    said = f"{unassigned} say no run, and {missing} runs have no recording: name files as the run sheet does, or write"
    last = ", or, if the last runs alone are missing, --assign name --last RUN" * (unassigned < missing)
    return [f"{said} into recordings.csv which run each is (state_id, repeat){last}; then collect again"]


def contact_lines(answer: CollectAnswer) -> list[str]:
    """Which limits the impacts allow, and why."""
    barred = [f"{state.state_id}: {state.reason}" for state in answer.contacts if not state.transient_allowed]
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
    lines += [f"  outlier: {outlier.words}" for outlier in scatter.outliers]
    if symmetry is not None and symmetry.mean_difference_N is not None:
        lines.append(
            f"Rotational symmetry: forces on one circle differ by {symmetry.mean_difference_N:.1f} N on average "
            f"({symmetry.mean_difference_percent:.1f} %), {symmetry.max_difference_N:.1f} N at most "
            f"({symmetry.max_difference_percent:.1f} %)"
        )
    return lines
