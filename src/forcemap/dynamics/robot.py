"""A robot: a chain of joints and bodies from its base to the contact point."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.dynamics.effective_mass import DriveInertia, as_drive_inertia, standard_effective_mass
from forcemap.dynamics.rigid_body import Body, Frame, moved_body, turn, unit_direction, united
from forcemap.errors import InputError
from forcemap.findings import Finding

_AT_LIMIT = 1e-6  # a position this little beyond its limit is at it, but for rounding [rad], [m]


class JointKind(StrEnum):
    """How a joint moves: it turns within limits, turns without limits, or slides."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint that moves, and the body it moves.

    Parameters
    ----------
    name : str
        Name in the robot's description.
    kind : JointKind
        How it moves.
    origin : Frame
        The joint's frame at position zero, in the frame of the joint before it.
    axis : array, shape (3,)
        Axis of the motion, a unit vector in the joint's frame.
    lower, upper : float
        Limits of the position [rad], [m] for a prismatic joint; infinite for a continuous one.
    body : Body
        What the joint carries, up to the next joint: links that are fixed to each other are one body.
    """

    name: str
    kind: JointKind
    origin: Frame
    axis: FloatArray
    lower: float
    upper: float
    body: Body

    def frame_nearest_zero(self) -> Frame:
        """The joint's frame at the allowed position nearest to zero, in the frame of the joint before it."""
        position, slides = min(max(0.0, self.lower), self.upper), self.kind is JointKind.PRISMATIC
        moved = Frame(self.axis * position, np.eye(3)) if slides else Frame(np.zeros(3), turn(self.axis, position))
        return self.origin.then(moved)

    def with_body(self, body: Body, frame: Frame) -> Self:
        """The joint carrying one more body, described in a frame given in the joint's."""
        return replace(self, body=united([self.body, moved_body(body, frame)]))


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot arm with what it carries.

    Parameters
    ----------
    name, source : str
        Name; where its figures come from.
    joints : tuple of Joint
        The moving joints from the base to the contact point; fixed joints are part of origins and bodies.
    flange : Frame
        Where tools are mounted, in the frame of the last joint.
    reference_posture : array, shape (n,)
        Posture that inverse kinematics keeps near to [rad], [m].
    contact_offset : array, shape (3,)
        Contact point in the frame of the flange [m].
    load : float
        Mass of tool and payload, the standard's m_L [kg].
    drive_inertia : DriveInertia or None
        Inertia of the drives; None if only the links count.
    held_joints : tuple of str
        Joints beside the chain (fingers of a gripper), held where they are nearest to zero; their bodies are carried.
    tool_axis : array, shape (3,)
        Direction of the tool in the frame of the flange, a unit vector: what a tool direction turns.
    findings : tuple of Finding
        Which parts of its description do not count as they stand.
    """

    name: str
    source: str
    joints: tuple[Joint, ...]
    flange: Frame
    reference_posture: FloatArray
    contact_offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    load: float = 0.0
    drive_inertia: DriveInertia | None = None
    held_joints: tuple[str, ...] = ()
    tool_axis: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    findings: tuple[Finding, ...] = ()

    @property
    def lower(self) -> FloatArray:
        """Lower limits of the joints [rad], [m]."""
        return np.array([joint.lower for joint in self.joints])

    @property
    def upper(self) -> FloatArray:
        """Upper limits of the joints [rad], [m]."""
        return np.array([joint.upper for joint in self.joints])

    @property
    def _per_radian(self) -> FloatArray:
        """Degrees in a radian for joints that turn, 1 for those that slide."""
        return np.array([1.0 if joint.kind is JointKind.PRISMATIC else math.degrees(1.0) for joint in self.joints])

    def stated(self, positions: ArrayLike) -> dict[str, float]:
        """Positions of the joints, shape (n,) [rad], [m], by name with the unit: `elbow_deg`, `rail_m`."""
        names = [f"{joint.name}_{'m' if joint.kind is JointKind.PRISMATIC else 'deg'}" for joint in self.joints]
        return dict(zip(names, (np.asarray(positions) * self._per_radian).tolist(), strict=True))

    def stated_postures(self, positions: FloatArray) -> list[dict[str, float] | None]:
        """The same for many postures, shape (..., n), as a flat list; None where a posture is not known (NaN)."""
        flat = positions.reshape(-1, len(self.joints))
        return [None if np.isnan(q).any() else self.stated(q) for q in flat]

    def from_degrees(self, positions: ArrayLike) -> FloatArray:
        """Positions [rad], [m] from those in degrees, or in m for a joint that slides; shape (n,).

        Raises
        ------
        InputError
            Not one number for every joint.
        """
        return self._checked_posture(positions) / self._per_radian

    def _checked_posture(self, positions: ArrayLike) -> FloatArray:
        q = np.array(positions, dtype=np.float64)
        if q.shape != (len(self.joints),):
            names = ", ".join(joint.name for joint in self.joints)
            raise InputError(f"posture: found {q.size} positions, expected one for each joint of {self.name}: {names}")
        return q

    @property
    def moving_mass(self) -> float:
        """Mass M of the moving parts of the robot, without tool and payload [kg]."""
        return float(sum(joint.body.mass for joint in self.joints)) - self.load

    @property
    def standard_effective_mass(self) -> float:
        """The standard's effective mass m_R = M / 2 + m_L [kg]."""
        return standard_effective_mass(self.moving_mass, self.load)

    def with_tool(
        self,
        *,
        mass: float = 0.0,
        centre_of_mass: ArrayLike = (0.0, 0.0, 0.0),
        contact_offset: ArrayLike = (0.0, 0.0, 0.0),
        inertia: ArrayLike | None = None,
        axis: ArrayLike = (0.0, 0.0, 1.0),
    ) -> Self:
        """The robot with a tool on its flange, touching at a point of the tool.

        Parameters
        ----------
        mass : float
            Mass of the tool [kg]; 0 if contact point and axis alone change.
        centre_of_mass, contact_offset : array, shape (3,)
            Centre of mass and contact point in the frame of the flange [m].
        inertia : array, shape (3, 3), optional
            Inertia about the centre of mass, in axes of the flange [kg m^2]; without it the tool is a point mass.
        axis : array, shape (3,)
            Direction of the tool in the frame of the flange, of any length but zero; its z axis if not given.

        Raises
        ------
        InputError
            A mass below zero, an impossible inertia, an axis of length zero, or numbers that are not finite.
        """
        loaded = self.with_payload(mass=mass, centre_of_mass=centre_of_mass, inertia=inertia)
        offset = np.array(contact_offset, dtype=np.float64)
        if offset.shape != (3,) or not np.isfinite(offset).all():
            raise InputError(f"contact offset: found {contact_offset!r}, expected three finite numbers in m")
        direction = unit_direction(axis, 3)
        if direction.ndim != 1:
            raise InputError(f"tool axis: found the shape {direction.shape}, expected three numbers")
        return replace(loaded, contact_offset=offset, tool_axis=direction)

    def with_payload(self, *, mass: float, centre_of_mass: ArrayLike, inertia: ArrayLike | None = None) -> Self:
        """The robot with a workpiece in its tool; the contact point stays.

        Parameters
        ----------
        mass : float
            Mass of the payload [kg].
        centre_of_mass : array, shape (3,)
            Centre of mass in the frame of the flange [m].
        inertia : array, shape (3, 3), optional
            Inertia about the centre of mass, in axes of the flange [kg m^2]; without it a point mass.

        Raises
        ------
        InputError
            A mass below zero, an impossible inertia, or numbers that are not finite.
        """
        added = Body.of(mass, centre_of_mass, np.zeros((3, 3)) if inertia is None else inertia)
        *others, last = self.joints
        return replace(self, joints=(*others, last.with_body(added, self.flange)), load=self.load + added.mass)

    def with_reference(self, positions: ArrayLike) -> Self:
        """The robot with another posture that inverse kinematics keeps near to.

        Parameters
        ----------
        positions : array, shape (n,)
            Positions of the joints [rad], [m].

        Raises
        ------
        InputError
            Not one number within the limits for every joint.
        """
        q = self._checked_posture(positions)
        if (beyond := ~((q >= self.lower - _AT_LIMIT) & (q <= self.upper + _AT_LIMIT))).any():
            (name, stated), lower, upper = (
                list(self.stated(posture).items())[beyond.argmax()] for posture in (q, self.lower, self.upper)
            )
            raise InputError(f"posture: found {name} = {stated:g}, expected {lower[1]:g} to {upper[1]:g}")
        return replace(self, reference_posture=q)

    def with_drive_inertia(self, drive_inertia: ArrayLike | DriveInertia) -> Self:
        """The robot with the inertia of its drives.

        Parameters
        ----------
        drive_inertia : array, shape (n,), or DriveInertia
            One figure per joint as seen at the joint [kg m^2], for a prismatic joint [kg].

        Raises
        ------
        InputError
            Not one finite figure of at least 0 for every joint.
        """
        return replace(self, drive_inertia=as_drive_inertia(drive_inertia, len(self.joints)))
