"""A whole campaign simulated into a folder like a real one's: what the device would have written, and no more."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.campaigns.campaign import RECORDINGS_FOLDER
from forcemap.campaigns.conditions import CAMPAIGN_FILE, UNFINISHED, Conditions
from forcemap.campaigns.plan import MeasurementPlan, write_plan
from forcemap.campaigns.pressures import PRESSURES_FOLDER
from forcemap.campaigns.template import campaign_text
from forcemap.csv_table import csv_text
from forcemap.dynamics.inverse_kinematics import DOWN
from forcemap.files import new_folder, write_atomically
from forcemap.lab.bench import SimulatedImpacts, simulate_impacts
from forcemap.lab.contact_surface import ContactSurface, SimulatedFilm, film_text
from forcemap.lab.course import STEP
from forcemap.lab.simulated_device import COLUMNS, SimulatedDevice, recording_text
from forcemap.lab.virtual_robot import VirtualRobot
from forcemap.recordings.film import Film

TRUTH_FILE = "truth.csv"


@dataclass(frozen=True, eq=False)
class SimulatedCampaign:
    """A campaign that the lab has written.

    Parameters
    ----------
    folder : Path
        Its folder.
    recording : tuple of str
        Names of the recordings, in the order of the plan.
    impacts : SimulatedImpacts
        The impacts themselves, at the true speeds of the repeats.
    """

    folder: Path
    recording: tuple[str, ...]
    impacts: SimulatedImpacts


def simulate_campaign(
    plan: MeasurementPlan,
    robot: VirtualRobot,
    device: SimulatedDevice,
    rng: np.random.Generator,
    folder: str | Path,
    *,
    conditions: Conditions | None = None,
    along: ArrayLike | None = None,
    surface: ContactSurface | None = None,
) -> SimulatedCampaign:
    """Simulate all runs of a plan into a new folder: campaign.toml, plan.csv, recordings/, every file marked simulated.

    truth.csv holds what the lab knows (peaks, scenarios, true speeds); nothing of the evaluation reads it.

    Parameters
    ----------
    plan : MeasurementPlan
        The runs.
    robot : VirtualRobot
        The robot.
    device : SimulatedDevice
        The measuring device.
    rng : numpy.random.Generator
        Source of scatter and noise.
    folder : str or Path
        A new or empty folder: simulated recordings never go where measured ones may be.
    conditions : Conditions, optional
        What else campaign.toml states; robot, tool, safety setting and device are always those of the lab.
    along : array, shape (3,), optional
        The direction that the conditions state, as in `simulate_impacts`; straight down if not given.
    surface : ContactSurface, optional
        What presses on a film: then every run has a file of it in pressures/, and truth.csv the pressure. The film is
        that of the conditions, with a range of 600 N/cm^2 and a mean over 1 cm^2 where they state none.

    Raises
    ------
    InputError
        The folder holds files or cannot be made, or the robot does not reach a place of the plan.
    """
    target = new_folder(folder)
    speed = plan.speed * (1 + robot.speed_scatter * rng.standard_normal(len(plan)))
    states, stiffness = (plan.distance, plan.height, speed), device.device.stiffness
    towards = DOWN if along is None else along
    course: dict[str, Any] = {"device_stiffness": stiffness, "duration": device.after, "step": STEP}
    impacts = simulate_impacts(robot, *states, direction=towards, **course)
    described = robot.described.replace(", ", "; ")  # a comma would put "100 N" above the forces, as their factor
    origin = f"SIMULATED by the virtual impact lab of forcemap ({described}): not a measurement of any robot"
    readings = device.readings(impacts.force, STEP, device.scale(rng), rng)
    conditions = conditions or Conditions()
    if surface is not None:
        conditions = replace(conditions, film=_film(conditions.film))
    stated = campaign_text(_stated(robot, device, conditions, turned=along is not None), COLUMNS)
    write_atomically(target / CAMPAIGN_FILE, f"{UNFINISHED} = true  # until all recordings are written\n{stated}")
    (target / RECORDINGS_FOLDER).mkdir()
    write_plan(plan, target, remark=origin)
    times, names = device.times(), tuple(plan.recording.tolist())
    for name, column in zip(names, readings.T, strict=True):
        text = recording_text(times, column, origin)
        (target / RECORDINGS_FOLDER / f"{name}.csv").write_text(text, encoding="utf-8")
    if surface is not None:
        _write_films(target, names, surface, conditions, impacts, origin, rng)
    write_atomically(target / TRUTH_FILE, _truth(names, impacts, origin, surface))
    write_atomically(target / CAMPAIGN_FILE, stated)
    return SimulatedCampaign(target, names, impacts)


def _stated(robot: VirtualRobot, device: SimulatedDevice, conditions: Conditions | None, *, turned: bool) -> Conditions:
    given, reaction = conditions or Conditions(), robot.reaction
    settings = f"external torque limit {reaction.threshold:.3g} Nm at any joint, then {reaction.kind.replace('_', ' ')}"
    return replace(
        given,
        simulated=True,
        note=f"SIMULATED by the virtual impact lab: {robot.described}; {robot.source}",
        operator="virtual impact lab",
        robot=f"virtual {robot.name}",
        controller="",
        firmware="",
        moving_mass=round(robot.robot.moving_mass, 3) if math.isnan(given.moving_mass) else given.moving_mass,
        tool="none",
        payload=robot.robot.load,
        covers="; ".join(change for change in robot.changes if "cover" in change) or "none",
        contact_site="flange",
        direction=given.direction if turned else "down",
        base_angle=math.nan,
        safety_settings=settings,
        speed_kind="commanded",
        device=device.device,
    )


def _film(stated: Film) -> Film:
    """The film with what the conditions do not state."""
    given: dict[str, Any] = {name: value for name, value in vars(stated).items() if value == value and value != ""}
    usual: dict[str, Any] = {"sensor": "simulated film", "range": 600.0, "error": 0.05, "mean_over": 1.0}
    return Film(**usual | given)


def _write_films(
    target: Path,
    names: tuple[str, ...],
    surface: ContactSurface,
    conditions: Conditions,
    impacts: SimulatedImpacts,
    origin: str,
    rng: np.random.Generator,
) -> None:
    """A file of the film for every run."""
    film = SimulatedFilm(film=conditions.film)
    scale = film.scale(rng)
    (target / PRESSURES_FOLDER).mkdir()
    for name, force in zip(names, impacts.force.max(axis=0).tolist(), strict=True):
        text = film_text(film.readings(surface, force, scale, rng), film.pitch, origin)
        (target / PRESSURES_FOLDER / f"{name}.csv").write_text(text, encoding="utf-8")


def _truth(names: tuple[str, ...], impacts: SimulatedImpacts, origin: str, surface: ContactSurface | None) -> str:
    columns = {
        "recording": list(names),
        "true_speed_mps": [f"{speed:.6f}" for speed in impacts.speed],
        "true_peak_force_N": [f"{peak:.3f}" for peak in impacts.peak_force],
        "true_held_force_N": ["" if math.isnan(force) else f"{force:.3f}" for force in impacts.held_force],
        "true_scenario": [str(scenario) for scenario in impacts.scenario],
    }
    if surface is not None:
        pressures = surface.pressure(impacts.force.max(axis=0))
        columns["true_peak_pressure_N_per_cm2"] = [f"{pressure:.3f}" for pressure in pressures]
    return f"# {origin}\n{csv_text(columns)}"
