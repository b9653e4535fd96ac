"""What plan, next and confirm share: options and what they stand for, and plans as text, as files and as a sheet."""

from __future__ import annotations

import dataclasses
import itertools
import shlex
import textwrap
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

import forcemap as fm
from forcemap.arrays import Mask
from forcemap.campaigns.conditions import CAMPAIGN_FILE, PLAN_TABLE
from forcemap.campaigns.plan import PLAN_FILE
from forcemap.campaigns.recordings_table import REGISTER_FILE
from forcemap.campaigns.template import campaign_text, completed_text
from forcemap.cli.options import number, stated, stiffness
from forcemap.cli.output import WIDEST, table
from forcemap.exports.run_sheet import restated, run_sheet, with_added
from forcemap.files import file_sha256, read_bytes, write_atomically

SHEET = "run_sheet.txt"
Distances = Annotated[
    str | None, Option("--distances-m", help="Nearest and farthest distance from the base z-axis, or all of them.")
]
Heights = Annotated[str | None, Option("--heights-m", help="Lowest and highest height above the base, or all of them.")]
Repeats = Annotated[int, Option("--repeats", help="Impacts of every state.")]
DeviceRange = Annotated[
    float | None, Option("--device-range-N", help="Largest force the device can measure; else as campaign.toml states.")
]
Expect = Annotated[
    list[str] | None,
    Option(
        "--moving-mass-kg",
        "--map",
        metavar="KG|MAP",
        help="What force to expect: mass of the robot's moving parts, for the standard's contact model; or a map, "
        "file or published name.",
    ),
]


DryRun = Annotated[bool, Option("--dry-run", help="Tell only, and write nothing.")]


def limit_words(limit: Sequence[str] | None, contact: fm.Contact | None) -> dict[str, object]:
    """The options that name the limit again."""
    given = stated(limit)
    parts: dict[str, Sequence[object]] = {"--area": given.names, "--limit-N": given.newtons}
    parts |= {"--contact": [contact], "--limit-table": given.tables}
    return {name: next(iter(values), None) for name, values in parts.items()}


def expected_of(expect: Sequence[str] | None) -> tuple[float | None, str | None]:
    """The moving mass [kg] and the name of a map that the option gives; None where it does not."""
    masses = [mass for mass in map(number, expect or ()) if mass is not None]
    maps = [text for text in expect or () if number(text) is None]
    if len(masses) > 1 or len(maps) > 1:
        raise fm.InputError("expected force: found several, expected one --moving-mass-kg and one --map at most")
    return masses[0] if masses else None, maps[0] if maps else None


def conditions_of(
    folder: str, device_range: float | None, device_spring: float | None, moving_mass: float | None
) -> fm.Conditions:
    """What the folder's campaign.toml states; without one what the options state."""
    conditions, more = completed_conditions(folder, device_range, device_spring, moving_mass)
    if more and Path(folder, CAMPAIGN_FILE).exists():
        raise _stated_there(folder, more)
    return conditions


def completed_conditions(
    folder: str,
    device_range: float | None,
    device_spring: float | None,
    moving_mass: float | None,
    **others: Any,
) -> tuple[fm.Conditions, dict[str, Any]]:
    """What the folder's campaign.toml and the options state, and of that what is not in the file.

    What is stated of the plan (`reach`, `fastest`) may change: nothing measured rests on it.

    Raises
    ------
    InputError
        The file states otherwise, or its campaign has recordings already, which were made under what it states.
    """
    toml = Path(folder, CAMPAIGN_FILE)
    conditions = fm.read_conditions(toml) if toml.exists() else fm.Conditions()
    device = conditions.with_device_stiffness(stiffness(device_spring)).device
    described = dataclasses.replace(
        conditions,
        device=device if device_range is None else dataclasses.replace(device, range=device_range),
        moving_mass=conditions.moving_mass if moving_mass is None else moving_mass,
        **others,
    )
    before = conditions.stated
    more = {entry: value for entry, value in described.stated.items() if before.get(entry) != value}
    bound = {entry: value for entry, value in more.items() if not entry.startswith(f"{PLAN_TABLE}.")}
    if toml.exists() and bound and (bound.keys() & before.keys() or Path(folder, REGISTER_FILE).exists()):
        raise _stated_there(folder, bound)
    return described, more


def _stated_there(folder: str, entries: Mapping[str, Any]) -> fm.InputError:
    lines = ", ".join(f"{entry} = {value}" for entry, value in entries.items())
    return fm.InputError(
        f"this campaign.toml is there already; state it there ({lines}), not as options",
        file=str(Path(folder, CAMPAIGN_FILE)),
    )


def complete(folder: str, conditions: fm.Conditions, entries: Mapping[str, Any]) -> list[str]:
    """Add entries to the folder's campaign.toml; what was added, nothing where there is no such file."""
    toml = Path(folder, CAMPAIGN_FILE)
    if not entries or not toml.exists():
        return []
    text = completed_text(read_bytes(toml).decode(), entries)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError:  # a section in another form than under a head of its own
        raise _stated_there(folder, entries) from None
    others = ("schema", "protocol", "recordings")
    if fm.Conditions.from_tables({name: part for name, part in tables.items() if name not in others}) != conditions:
        raise _stated_there(folder, entries)
    write_atomically(toml, text)
    return [f"{entry} = {value}" for entry, value in entries.items()]


def command_line(command: str, source: str, options: Mapping[str, object]) -> str:
    """A command with the options that are given, one that has several values with each of them."""
    given = [(name, one) for name, value in options.items() for one in (value if isinstance(value, list) else [value])]
    words = [(name, f"{one:.12g}" if isinstance(one, float) else str(one)) for name, one in given if one is not None]
    return shlex.join(["forcemap", command, source, *itertools.chain(*words)])


def command_lines(command: str, head: str = "  ") -> list[str]:
    """A command as lines of at most 100 characters, that a shell takes for one."""
    parts = textwrap.wrap(
        command,
        WIDEST - 2,
        initial_indent=head,
        subsequent_indent=" " * (len(head) + 4),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [*(f"{part} \\" for part in parts[:-1]), parts[-1]]


def write_campaign(
    target: Path,
    whole: fm.MeasurementPlan,
    new: fm.MeasurementPlan,
    conditions: fm.Conditions,
    notes: Sequence[str] = (),
    *,
    upper: Sequence[float] = (),
    waiting: fm.MeasurementPlan | None = None,
) -> list[str]:
    """Write a campaign's files, the sheet with the new runs and those still to be measured; the names of the files."""
    wrapped = [line for note in notes for line in textwrap.wrap(note, WIDEST, subsequent_indent="    ")]
    sheet = [*wrapped, *run_sheet(new, conditions, upper_force=upper, waiting=waiting)]
    try:
        (target / "recordings").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise fm.InputError(f"the folder cannot be made ({error.strerror})", file=str(target)) from error
    files = ["plan.csv", SHEET]
    if not (target / "campaign.toml").exists():
        write_atomically(target / "campaign.toml", campaign_text(conditions))
        files.insert(0, "campaign.toml")
    write_atomically(target / SHEET, "\n".join(sheet) + "\n")
    fm.write_plan(whole, target)
    return files


def state_again(folder: str) -> int:
    """Write what campaign.toml states now into the run sheet of a folder, and the runs that were added to plan.csv.

    The runs of the sheet stay as they are; how many were added.
    """
    sheet, conditions = Path(folder, SHEET), fm.read_conditions(Path(folder, CAMPAIGN_FILE))
    try:
        lines = restated(read_bytes(sheet).decode().splitlines(), conditions)
        lines, added = with_added(lines, waiting_runs(fm.read_campaign(folder)))
    except (fm.InputError, UnicodeDecodeError) as error:
        raise fm.InputError(f"no run sheet to write again ({error})", file=str(sheet)) from error
    write_atomically(sheet, "\n".join(lines) + "\n")
    return added


def time_words(plan: fm.MeasurementPlan, place_minutes: float = 10.0, impact_minutes: float = 1.0) -> str:
    """How long the runs of a plan take, by the minutes that putting up the device and an impact are assumed to take."""
    minutes = plan.minutes(place_minutes, impact_minutes)
    assumed = f"if a place takes {place_minutes:g} min and an impact {impact_minutes:g} min (assumed)"
    times = "once" if plan.set_ups == 1 else f"{plan.set_ups} times"
    return f"the device is put up {times}: {minutes // 60:.0f} h {minutes % 60:02.0f} min, {assumed}"


def waiting_runs(campaign: fm.Campaign, *, but: Sequence[str] = ()) -> fm.MeasurementPlan:
    """The planned runs without a used recording, except some: runs of an earlier sheet are printed again."""
    names = campaign.plan.recording
    return campaign.plan.select(np.isin(names, campaign.missing) & ~np.isin(names, list(but)))


def refuse_waiting(campaign: fm.Campaign, runs: Mask, dataset: fm.ImpactDataset | None, what: str) -> None:
    """Refuse to go on while states of the runs have no impact."""
    states = set() if dataset is None else set(dataset.state.tolist())
    waiting = [name for name in dict.fromkeys(campaign.plan.state_id[runs].tolist()) if name not in states]
    if waiting:
        raise fm.InputError(
            f"{what} without an impact: {len(waiting)}, the first {waiting[0]}; measure them and run forcemap "
            "collect, or take their rows out of plan.csv",
            file=str(campaign.folder),
        )


def measuring_lines(folder: str, files: Sequence[str], then: str) -> list[str]:
    """What was written, and the way from the printed sheet to the next answer."""
    plan = f"{file_sha256(Path(folder, PLAN_FILE))}  {PLAN_FILE}" if files else ""
    lists = [read_bytes(file).decode("utf-8", "replace") for file in Path(folder).glob("*.sha256")]  # of each report
    older = any(f"  {PLAN_FILE}" in listed and plan not in listed for listed in lists)
    return [
        *([f"Written to {folder}: {', '.join(files)}"] if files else []),
        *(["The report in this folder rests on the plan before: write it again (forcemap report)"] if older else []),
        "Next:",
        f"  1. print {folder}/{SHEET} and measure; save each file in {folder}/recordings under the name it says",
        f"  2. forcemap collect {shlex.quote(folder)}",
        *command_lines(then, "  3. "),
    ]


def unwritten_lines(again: str) -> list[str]:
    """What a question alone leaves as it was, and the command that plans it."""
    return ["Nothing written (--dry-run); to put this into the plan:", *command_lines(again)]


def runs_table(plan: fm.MeasurementPlan, upper: Sequence[float]) -> list[str]:
    """A line for every state."""
    rows = {
        name: [name, f"{d:.3f}", f"{h:.3f}", f"{v:.3f}", f"{force:.1f}", f"{most:.1f}"]
        for name, d, h, v, force, most in zip(
            plan.state_id.tolist(), plan.distance, plan.height, plan.speed, plan.expected_force, upper, strict=True
        )
    }
    return table(["state", "d [m]", "h [m]", "v [m/s]", "expected [N]", "at most [N]"], rows.values())
