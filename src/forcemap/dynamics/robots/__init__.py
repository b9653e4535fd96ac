"""The paper's two robots, from published figures of their descriptions."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import numpy as np

from forcemap.dynamics.effective_mass import DriveInertia
from forcemap.dynamics.rigid_body import Body, Frame, moved_body
from forcemap.dynamics.robot import Joint, JointKind, Robot
from forcemap.errors import UnknownName

ROBOTS = ("ur10e", "kuka-iiwa7")
_IDENTIFIED = ("ur10e",)


def robot_named(name: str) -> Robot:
    """A robot of the paper, without tool and without drive inertia; its base and flange are those of its maker.

    Parameters
    ----------
    name : str
        "ur10e" or "kuka-iiwa7" (KUKA LBR iiwa 7 R800).

    Raises
    ------
    UnknownName
        No robot has the name.

    Examples
    --------
    >>> round(robot_named("ur10e").moving_mass, 3)
    29.104
    """
    if name not in ROBOTS:
        raise UnknownName("robot", name, ROBOTS)
    facts = _facts(name)
    return Robot(
        name=name,
        source=facts["source"],
        joints=tuple(_joint(entry) for entry in facts["joints"]),
        flange=Frame.of(facts["flange_xyz_m"]),
        reference_posture=np.radians(facts["reference_posture_deg"]),
    )


def identified_drive_inertia(name: str) -> DriveInertia:
    """Published drive inertia of a robot, identified from its motion; the source is named in the result.

    Parameters
    ----------
    name : str
        "ur10e"; for the KUKA none is published.

    Raises
    ------
    UnknownName
        None is published for a robot of that name.

    Examples
    --------
    >>> identified_drive_inertia("ur10e").values[1]
    np.float64(3.7434)
    """
    if name not in _IDENTIFIED:
        raise UnknownName("robot with a published drive inertia", name, _IDENTIFIED)
    figures = _facts(name)["identified_drive_inertia_kg_m2"]
    return DriveInertia(np.array(figures["values"]), figures["source"])


def _facts(name: str) -> Any:
    return json.loads(resources.files(__name__).joinpath(f"{name}.json").read_text(encoding="utf-8"))


def _joint(entry: dict[str, Any]) -> Joint:
    lower, upper = np.radians(entry["limit_deg"]).tolist()
    i = entry["inertia_about_com_kg_m2"]
    inertia = [[i[f"i{min(a, b)}{max(a, b)}"] for b in "xyz"] for a in "xyz"]
    about_centre = Body.of(entry["mass_kg"], np.zeros(3), inertia)
    body = moved_body(about_centre, Frame.of(entry["com_m"], entry["inertial_rpy_rad"]))
    origin, axis = Frame.of(entry["origin_xyz_m"], entry["origin_rpy_rad"]), np.array(entry["axis"], dtype=np.float64)
    return Joint(entry["link"], JointKind.REVOLUTE, origin, axis, lower, upper, body)
