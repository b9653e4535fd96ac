"""forcemap simulate."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from typer import Argument, Option

import forcemap as fm
from forcemap.answers.simulation import SimulationAnswer
from forcemap.campaigns.protocol import read_protocol
from forcemap.cli.options import Json
from forcemap.cli.output import emit
from forcemap.direction import direction_vector
from forcemap.impacts.scenario import ContactScenario

if TYPE_CHECKING:
    from forcemap.lab.virtual_robot import VirtualRobot

_PRESETS = "ur10e-like, iiwa7-like-30nm, iiwa7-like-10nm"
_PRESSED = (
    "Clamping, though the robot retreats: it stops while its soft cover is still pressed in "
    "(docs/virtual_lab.md, What if)"
)


def simulate(
    plan: Annotated[str, Argument(help="Plan (CSV), or a campaign folder that holds one.")],
    preset: Annotated[str, Option("--preset", help=f"Virtual robot: {_PRESETS}.")],
    folder: Annotated[
        str | None, Option("-o", "--folder", help="New folder; default: beside the plan, named for the preset.")
    ] = None,
    seed: Annotated[int, Option("--seed", help="The same seed gives the same files.")] = 1,
    threshold: Annotated[
        float | None, Option("--threshold-Nm", help="Another safety setting: external joint torque.")
    ] = None,
    payload: Annotated[
        float | None, Option("--payload-kg", help="A payload at the flange; default: as campaign.toml states.")
    ] = None,
    cover: Annotated[
        float | None, Option("--cover-N-per-m", help="A protective cover with this spring constant.")
    ] = None,
    hold: Annotated[
        float | None, Option("--hold-force-N", help="Another clamping force, of a robot that stops and holds.")
    ] = None,
    contact_area: Annotated[
        float | None, Option("--contact-area-cm2", help="Also films of the pressure under a flat face of this area.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate the recordings of a planned campaign in the virtual lab, into a new folder. Nothing of it is measured.

    Direction, payload and device are those that campaign.toml states beside the plan, else straight down, none, and
    the paper's; robot, tool, contact site and safety settings are the preset's.

    Example: forcemap simulate my-campaign --preset ur10e-like
    """
    from forcemap.lab.contact_surface import ContactSurface
    from forcemap.lab.reaction import ReactionKind
    from forcemap.lab.simulated_campaign import simulate_campaign
    from forcemap.lab.simulated_device import PAPER_DEVICE, SimulatedDevice
    from forcemap.lab.virtual_robot import virtual_robot

    toml = (Path(plan) if Path(plan).is_dir() else Path(plan).parent) / "campaign.toml"
    conditions = fm.read_conditions(toml) if toml.exists() else fm.Conditions()
    payload = conditions.payload if payload is None and conditions.payload > 0 else payload
    robot = _changed(virtual_robot(preset), threshold=threshold, payload=payload, cover=cover, hold_force=hold)
    surface = None if contact_area is None else ContactSurface(contact_area)
    if seed < 0:
        raise fm.InputError(f"seed: found {seed}, expected a whole number of at least 0")
    tolerance = fm.StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    runs, target = fm.read_plan(plan, tolerance=tolerance), Path(folder) if folder else _beside(Path(plan), preset)
    stated = {key: value for key, value in vars(conditions.device).items() if value == value and value != ""}
    device = SimulatedDevice(device=dataclasses.replace(PAPER_DEVICE, **stated))
    along = direction_vector(conditions.direction, whose=str(toml)) if conditions.direction else None
    given: dict[str, Any] = {"conditions": conditions, "along": along, "surface": surface}
    simulated = simulate_campaign(runs, robot, device, np.random.default_rng(seed), target, **given)
    peaks, scenarios = simulated.impacts.peak_force, sorted({str(scenario) for scenario in simulated.impacts.scenario})
    answer = SimulationAnswer(
        folder=str(target),
        preset=preset,
        seed=seed,
        changes=robot.changes,
        recordings=len(simulated.recording),
        lowest_peak_force_N=peaks.min(),
        highest_peak_force_N=peaks.max(),
        beyond_device_range=int(np.sum(peaks >= device.device.range)),
        scenarios=scenarios,
        not_simulated=[*_replaced(conditions, target), *_left_out(toml)],
    )
    retreats = robot.reaction.kind is ReactionKind.RETREAT
    emit(answer, _lines(answer, device.device.range, pressed=cover is not None and retreats), as_json=as_json)


def _left_out(toml: Path) -> list[str]:
    """The table of who measured what, where campaign.toml states any of it: nothing of it was."""
    stated = toml.exists() and any(value == value and value != "" for value in vars(read_protocol(toml)).values())
    return ["protocol"] if stated else []


def _beside(plan: Path, preset: str) -> Path:
    """A folder beside a plan or its campaign, named for the preset."""
    name = plan.resolve()
    return name.with_name(f"{name.stem if name.is_file() else name.name}-{preset}")


def _changed(robot: VirtualRobot, **changes: float | None) -> VirtualRobot:
    """The robot with what is asked otherwise of it, by the name of the change."""
    for change, figure in changes.items():
        robot = robot if figure is None else getattr(robot, f"with_{change}")(figure)
    return robot


def _replaced(conditions: fm.Conditions, target: Path) -> list[str]:
    """Entries of the campaign's campaign.toml in whose place the simulated one has those of the lab."""
    of_lab = fm.read_conditions(target / "campaign.toml").changed_from(conditions)
    return [entry for entry, then, _ in of_lab if then and entry != "simulated"]


def _lines(answer: SimulationAnswer, device_range: float, *, pressed: bool) -> list[str]:
    """What was simulated, and what to do next; `pressed`, a robot that retreats hits with a soft cover."""
    low, high = answer.lowest_peak_force_N, answer.highest_peak_force_N
    return [
        f"SIMULATED with {', '.join([answer.preset, *answer.changes])}: not a measurement of any robot",
        f"{answer.recordings} recordings in {answer.folder}, peaks {low:.0f} to {high:.0f} N, "
        f"{answer.beyond_device_range} at or above the device range of {device_range:g} N; "
        f"{', '.join(answer.scenarios).replace('_', ' ')}",
        *[_PRESSED] * (pressed and ContactScenario.WITH_CLAMPING in answer.scenarios),
        *(
            [f"NOT SIMULATED of campaign.toml, the lab has its own: {', '.join(answer.not_simulated)}"]
            if answer.not_simulated
            else []
        ),
        "truth.csv holds the true peaks; nothing of the evaluation reads it",
        f"Next: forcemap collect {answer.folder}",
    ]
