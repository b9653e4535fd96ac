"""Virtual robots of the lab: presets calibrated to published maps, and what-if changes to them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields, replace
from importlib import resources
from typing import Any, Self
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray, Mask
from forcemap.dynamics.inverse_kinematics import Reach, ReachOutcome, inverse_kinematics, places_in_plane
from forcemap.dynamics.kinematics import contact_point, posture_mass_matrix, posture_of
from forcemap.dynamics.robot import Robot
from forcemap.dynamics.robots import robot_named
from forcemap.errors import InputError, UnknownName
from forcemap.lab.course import DOWN, ContactLayer, ImpactSetup, PosedRobot, Servo
from forcemap.lab.reached_ranges import reached_ranges
from forcemap.lab.reaction import Reaction, ReactionKind

PRESETS = ("ur10e-like", "iiwa7-like-30nm", "iiwa7-like-10nm")

_POSED: WeakKeyDictionary[Robot, dict[Any, PosedRobot]] = WeakKeyDictionary()
"""The last places at which a robot was posed: whoever changes speeds, directions or reactions asks for them again."""
_POSED_AGAIN = 1000  # places that are kept at most; a choice: of more, posing is a small part of a simulation

_NAMED = 10  # places out of reach that are named; a choice
_LARGEST_SCATTER = 0.1  # share of the speed; more is percent typed as a share


@dataclass(frozen=True, kw_only=True)
class VirtualRobot:
    """A robot of the lab: a real robot's links, and figures chosen so that its impacts resemble a published map.

    Parameters
    ----------
    name : str
        Its name.
    robot : Robot
        Links, tool and payload, with drive inertia.
    tool_direction : tuple of float
        Where the z axis of the flange points at contact.
    contact_radius : float
        The contact point lies this far below the robot's own [m].
    servo : Servo
        How stiffly the joints follow.
    pad_stiffness, pad_damping : float
        Of the damping pad on the device, and any cover [N/m], [N s/m].
    reaction : Reaction
        How the controller reacts.
    speed_scatter : float
        Standard deviation of the speed at contact between repeats, as a share of it.
    changes : tuple of str
        What was changed about the preset, in words.
    source : str
        Where the figures come from.

    Raises
    ------
    InputError
        A robot without drive inertia, or a speed scatter outside its range.
    """

    name: str
    robot: Robot
    tool_direction: tuple[float, float, float]
    contact_radius: float
    servo: Servo
    pad_stiffness: float
    pad_damping: float
    reaction: Reaction
    speed_scatter: float = 0.0
    changes: tuple[str, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        if self.robot.drive_inertia is None:
            raise InputError(f"{self.name}: found no drive inertia, expected a robot with it (with_drive_inertia)")
        if not 0 <= self.speed_scatter < _LARGEST_SCATTER:
            raise InputError(
                f"speed scatter: found {self.speed_scatter:g}, expected a share from 0 to {_LARGEST_SCATTER:g}"
            )

    @property
    def described(self) -> str:
        """Name of the preset, and what was changed about it."""
        return ", ".join([self.name, *self.changes])

    def with_threshold(self, threshold: float) -> Self:
        """The robot with another safety setting.

        Parameters
        ----------
        threshold : float
            External torque at any joint beyond which a collision is noticed [N m].

        Raises
        ------
        InputError
            Not positive and finite.
        """
        reaction = replace(self.reaction, threshold=threshold)
        return self._changed(f"collision threshold {threshold:g} Nm", reaction=reaction)

    def with_hold_force(self, force: float) -> Self:
        """The robot with another force at which it settles after an impact.

        Parameters
        ----------
        force : float
            Clamping force [N].

        Raises
        ------
        InputError
            Not positive and finite, or the robot retreats.
        """
        if self.reaction.kind is ReactionKind.RETREAT:
            raise InputError(
                f"clamping force: found {force:g} N for {self.name}, which retreats and holds nothing; expected one "
                "that stops and holds, as the presets iiwa7-like-30nm and iiwa7-like-10nm"
            )
        return self._changed(f"clamping force {force:g} N", reaction=replace(self.reaction, hold_force=force))

    def with_payload(self, mass: float, centre_of_mass: ArrayLike = (0.0, 0.0, 0.05)) -> Self:
        """The robot with a payload.

        Parameters
        ----------
        mass : float
            Mass [kg].
        centre_of_mass : array, shape (3,)
            In the frame of the flange [m]; 5 cm in front of it if not given.

        Raises
        ------
        InputError
            A mass below zero, or numbers that are not finite.
        """
        robot = self.robot.with_payload(mass=mass, centre_of_mass=centre_of_mass)
        return self._changed(f"payload {mass:g} kg", robot=robot)

    def with_cover(self, stiffness: float, damping: float | None = None) -> Self:
        """The robot with a protective cover; cover and pad are taken as one layer that does not bottom out.

        Parameters
        ----------
        stiffness : float
            Spring constant of the cover [N/m].
        damping : float, optional
            Damping of the cover [N s/m]; if not given, as much as the pad's in proportion to its stiffness.

        Raises
        ------
        InputError
            A stiffness that is not positive and finite, or a damping below zero.
        """
        own = self.pad_damping * stiffness / self.pad_stiffness if damping is None else damping
        if not (0 < stiffness < math.inf and 0 <= own < math.inf):
            raise InputError(
                f"cover: found {stiffness:g} N/m and {own:g} N s/m, expected a stiffness above 0 N/m "
                "and a damping of at least 0 N s/m"
            )
        share = stiffness / (stiffness + self.pad_stiffness)  # of the compression that the pad takes
        return self._changed(
            f"cover of {stiffness / 1000:g} N/mm",
            pad_stiffness=self.pad_stiffness * share,
            pad_damping=share**2 * self.pad_damping + (1 - share) ** 2 * own,
        )

    def posed_at(self, distance: ArrayLike, height: ArrayLike) -> PosedRobot:
        """The robot posed with its lowest point of contact at places, shape (batch,) [m].

        Raises
        ------
        InputError
            The robot cannot reach a place.
        """
        d, h = np.array(np.broadcast_arrays(distance, height), dtype=np.float64)
        if d.size > _POSED_AGAIN:
            return self._posed(d, h)
        key = (self.tool_direction, self.contact_radius, d.tobytes(), h.tobytes())
        known = _POSED.setdefault(self.robot, {})
        if (posed := known.get(key)) is None:
            posed = self._posed(d, h)
            known.clear()
            known[key] = posed
        return posed

    def reaches(self, distance: FloatArray, height: FloatArray) -> Mask:
        """Which places, shape (n,) [m], the robot's lowest point of contact reaches."""
        return np.asarray(self._reach(distance, height).outcome != ReachOutcome.UNREACHABLE)

    def _reach(self, d: FloatArray, h: FloatArray) -> Reach:
        places = places_in_plane(d, h + self.contact_radius)
        return inverse_kinematics(self.robot, places, tool_direction=self.tool_direction)

    def _posed(self, d: FloatArray, h: FloatArray) -> PosedRobot:
        reach = self._reach(d, h)
        if (far := reach.outcome == ReachOutcome.UNREACHABLE).any():
            raise InputError(self._unreached(d, h, far))
        posture = posture_of(self.robot, reach.positions.T)
        rates = posture.rates(contact_point(self.robot, posture) + self.contact_radius * DOWN[:, None])
        return PosedRobot(np.moveaxis(posture_mass_matrix(self.robot, posture), -1, 0), rates, posture.turning)

    def _unreached(self, d: FloatArray, h: FloatArray, far: Mask) -> str:
        """Which places are not reached, and in which ranges of distance and height all are."""
        places = np.unique(np.column_stack([d, h])[far], axis=0).tolist()
        named = "; ".join(f"d = {distance:g} m, h = {height:g} m" for distance, height in places[:_NAMED])
        more = f" and {len(places) - _NAMED} more" if len(places) > _NAMED else ""
        ranges = reached_ranges(self.reaches, (float(d.min()), float(d.max())), (float(h.min()), float(h.max())))
        instead = "it reaches no place within these ranges"
        if ranges:
            (near, distant), (low, high) = ranges
            tested = "of a grid of places between them, all"
            instead = f"{tested} at distances {near:g} to {distant:g} m and heights {low:g} to {high:g} m are reached"
        found = f"found {len(places)} places it cannot reach with this tool direction"
        return f"{self.robot.name}: {found}: {named}{more}; leave them out of the plan; {instead}"

    def impact_setup(self, places: PosedRobot, device_stiffness: float, direction: FloatArray = DOWN) -> ImpactSetup:
        """The robot at places, moving along unit vectors (batch, 3), on a device with this spring constant [N/m]."""
        assert self.robot.drive_inertia is not None
        contact = ContactLayer(device_stiffness, self.pad_stiffness, self.pad_damping)
        impactor = places.with_drives(self.robot.drive_inertia.values, direction)
        return ImpactSetup(impactor, self.servo, contact, self.reaction)

    def _changed(self, change: str, **figures: Any) -> Self:
        return replace(self, **figures, changes=(*self.changes, change))


def virtual_robot(name: str) -> VirtualRobot:
    """A preset of the lab. Its figures are no facts about any robot: they make its impacts resemble a published map.

    Parameters
    ----------
    name : str
        "ur10e-like", "iiwa7-like-30nm" or "iiwa7-like-10nm".

    Raises
    ------
    UnknownName
        No preset has the name.

    Examples
    --------
    >>> virtual_robot("iiwa7-like-10nm").reaction.threshold
    10.0
    """
    if name not in PRESETS:
        raise UnknownName("preset of the lab", name, PRESETS)
    text = resources.files("forcemap.lab").joinpath("presets", f"{name}.json").read_text(encoding="utf-8")
    return virtual_robot_of(json.loads(text))


def virtual_robot_of(figures: dict[str, Any]) -> VirtualRobot:
    """A virtual robot from the entries of a preset's file."""
    robot = robot_named(figures["robot"])
    groups, values = figures["drive_inertia_joints"], figures["drive_inertia_kg_m2"]
    pad, entries = figures["pad"], figures["reaction"]
    names = [entry.name for entry in fields(Reaction)]  # an entry's key is the field's name with the unit
    reaction = {name: value for name in names for key, value in entries.items() if key.startswith(name)}
    return VirtualRobot(
        **{key: figures[key] for key in ("name", "speed_scatter", "source")},
        robot=robot.with_drive_inertia(np.repeat(values, groups)),
        tool_direction=tuple(figures["tool_direction"]),
        contact_radius=figures["contact_radius_m"],
        servo=Servo(figures["servo"]["frequency_Hz"], figures["servo"]["damping"]),
        pad_stiffness=pad["stiffness_N_per_m"],
        pad_damping=pad["damping_N_s_per_m"],
        reaction=Reaction(**reaction | {"kind": ReactionKind(reaction["kind"])}),
    )
