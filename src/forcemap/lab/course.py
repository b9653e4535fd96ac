"""The course of impacts: robots, contact and reaction stepped through time, all impacts at once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Self

import numpy as np
from numpy.typing import NDArray

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.lab.reaction import Reaction

STEP = 2e-4  # [s]; longer ones are refused
FALLEN = 0.9  # Phase I is over once the force is below this share of its running maximum (docs/decisions.md)
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class Impactor:
    """Robots in their postures at contact, moving straight; mass matrix and Jacobian stay what they are there.

    The servo of every joint has a stiffness and a damping in proportion to its own inertia A_ii, A the mass matrix with
    the drives. So the joints' motion falls apart into modes that only the contact couples:
    y'' = s (w^2 (a r - y) + 2 z w (a r' - y')) - s l F, with r the commanded path, w and z frequency and damping of the
    servo, F the contact force; the depth of the contact point is l . y.

    Parameters
    ----------
    shares : array, shape (n, batch)
        s, by how much a mode is stiffer than the servo of a single joint [1].
    levers : array, shape (n, batch)
        l, motion of the contact point per mode [kg^-1/2].
    approach : array, shape (n, batch)
        a, motion of the modes per motion along the commanded path [kg^1/2].
    joint_lever : array, shape (batch,)
        Largest torque at a joint per force at the contact point [m].
    """

    shares: FloatArray
    levers: FloatArray
    approach: FloatArray
    joint_lever: FloatArray

    def at_places(self, places: NDArray[np.intp]) -> Impactor:
        """The robots for impacts at these places, by the places' numbers; a place may appear often."""
        return Impactor(*(figures[..., places] for figures in vars(self).values()))


@dataclass(frozen=True, eq=False)
class PosedRobot:
    """A robot in its postures at places, without drives.

    Parameters
    ----------
    mass : array, shape (batch, n, n)
        Mass matrices of the links [kg m^2].
    rates : array, shape (3, n, batch)
        How the joints move the contact point [m/rad].
    turning : array, shape (3, n, batch)
        How they turn the tool [1].
    """

    mass: FloatArray
    rates: FloatArray
    turning: FloatArray

    def with_drives(self, drive_inertia: FloatArray, direction: FloatArray = DOWN) -> Impactor:
        """The robots with the inertia of their drives [kg m^2], shape (n,), moving along unit vectors (batch, 3)."""
        along = np.broadcast_to(direction, (self.rates.shape[-1], 3))
        lever = (self.rates * along.T[:, None]).sum(axis=0)
        path = np.concatenate([self.rates, self.turning])
        wanted = np.concatenate([along, np.zeros_like(along)], axis=1)[..., None]
        motion = (np.linalg.pinv(np.moveaxis(path, -1, 0)) @ wanted)[..., 0].T  # the tool keeps its orientation
        motion /= (lever * motion).sum(axis=0)
        mass = self.mass + np.diag(drive_inertia)
        inertia = np.sqrt(np.diagonal(mass, axis1=1, axis2=2))  # (batch, n)
        # eigenvectors of the scaled matrix are those of its inverse; the shares are one over the eigenvalues
        values, vectors = np.linalg.eigh(mass / (inertia[:, :, None] * inertia[:, None, :]))
        turned = np.swapaxes(vectors, 1, 2)
        levers = (turned @ (lever.T / inertia)[..., None])[..., 0]
        approach = (turned @ (motion.T * inertia)[..., None])[..., 0]
        return Impactor(1 / values.T, levers.T, approach.T, np.abs(lever).max(axis=0))


@dataclass(frozen=True)
class ContactLayer:
    """A pad (spring and damper side by side) on the spring of the device, without mass; it can only be pushed.

    A spring in series with the pad keeps the force from jumping at contact, as a damper alone would make it.

    Parameters
    ----------
    device_stiffness : float
        Spring constant of the device [N/m].
    pad_stiffness : float
        Spring constant of the pad [N/m].
    pad_damping : float
        Damping of the pad [N s/m].

    Raises
    ------
    InputError
        A figure that is not positive and finite.
    """

    device_stiffness: float
    pad_stiffness: float
    pad_damping: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 < value < math.inf:
                raise InputError(f"{name.replace('_', ' ')}: found {value:g}, expected a positive finite number")

    def force(self, depth: FloatArray, pad: FloatArray) -> FloatArray:
        """Force on the device [N] at a depth of the robot below first contact and a compression of the pad [m]."""
        return self.device_stiffness * np.maximum(depth - pad, 0.0)

    def compressed(self, depth: FloatArray, pad: FloatArray, step: float) -> FloatArray:
        """Compression of the pad [m] one time step [s] later, the depth held: exact for that."""
        touching = depth > pad
        total = self.device_stiffness + self.pad_stiffness
        rest = np.where(touching, depth * (self.device_stiffness / total), 0.0)
        in_contact = math.exp(-step * total / self.pad_damping)
        alone = math.exp(-step * self.pad_stiffness / self.pad_damping)
        return np.asarray(rest + (pad - rest) * np.where(touching, in_contact, alone))


@dataclass(frozen=True)
class Servo:
    """How stiffly the joints follow the commanded motion.

    Parameters
    ----------
    frequency : float
        Natural frequency of a joint by itself [Hz].
    damping : float
        Its damping ratio [1].
    """

    frequency: float
    damping: float


@dataclass(frozen=True, eq=False)
class ImpactSetup:
    """Impacts to be simulated: the robots, and what they meet.

    Parameters
    ----------
    impactor : Impactor
        The robots at contact.
    servo : Servo
        How stiffly their joints follow.
    contact : ContactLayer
        Pad and device.
    reaction : Reaction
        How their controllers react.
    body_mass : float or array, shape (batch,)
        What the device is fixed to, at rest before contact and free to move along the impact [kg]; infinite: a device
        that cannot move.
    """

    impactor: Impactor
    servo: Servo
    contact: ContactLayer
    reaction: Reaction
    body_mass: FloatArray | float = math.inf

    def at_places(self, places: NDArray[np.intp]) -> Self:
        """The setup for impacts at these places, by the places' numbers."""
        return replace(self, impactor=self.impactor.at_places(places))


def force_course(setup: ImpactSetup, speed: FloatArray, *, duration: float, step: float = STEP) -> FloatArray:
    """Force on the device from first contact on, shape (times, batch) [N], a row every step.

    Parameters
    ----------
    setup : ImpactSetup
        The impacts.
    speed : array, shape (batch,)
        Speed at contact [m/s].
    duration, step : float
        Time after contact, and the time step [s].
    """
    return np.array(list(islice(_forces(setup, speed, step), round(duration / step) + 1)))


def phase_one_peaks(setup: ImpactSetup, speed: FloatArray, *, step: float = STEP, longest: float = 1.0) -> FloatArray:
    """Phase I peaks, shape (batch,) [N]: the first maximum after which the force falls clearly; then simulation ends.

    Parameters
    ----------
    setup : ImpactSetup
        The impacts.
    speed : array, shape (batch,)
        Speed at contact [m/s].
    step, longest : float
        The time step, and the time after contact at which Phase I is taken to be over [s].
    """
    return first_peaks(islice(_forces(setup, speed, step), round(longest / step)))


def first_peaks(forces: Iterable[FloatArray]) -> FloatArray:
    """Phase I peaks, shape (batch,) [N], of a course of forces: arrays (batch,), one for each time."""
    peak, going = np.zeros(()), np.ones((), dtype=bool)
    for force in forces:
        going = going & (force >= FALLEN * peak)
        peak = np.where(going, np.maximum(peak, force), peak)
        if not going.any():
            break
    return peak


def _forces(setup: ImpactSetup, speed: FloatArray, step: float) -> Iterator[FloatArray]:
    """Forces step by step, without end; velocities and pad are taken at half steps: the error is of second order."""
    robot, contact, reaction = setup.impactor, setup.contact, setup.reaction
    w, z = 2 * np.pi * setup.servo.frequency, setup.servo.damping
    spring, damper, push = robot.shares * w**2, robot.shares * (2 * z * w), robot.shares * robot.levers
    spring_path, damper_path = spring * robot.approach, damper * robot.approach
    # the damper acts on the mean of the velocities before and after a step
    whole_step = (1 - step / 2 * damper) / (1 + step / 2 * damper), step / (1 + step / 2 * damper)
    before, after = 1 - step / 2 * damper, step / 2 * np.ones_like(damper)  # half a step from the velocity at contact
    modes, rates = np.zeros_like(robot.levers), robot.approach * speed
    pull, scratch = np.empty_like(modes), np.empty_like(modes)
    pad, path, noticed, torque, depth, force, body, body_rate = np.zeros((8, speed.size))
    begun, first = np.full(speed.size, np.inf), math.inf  # when the reaction begins, and when the first of all does
    keep = np.exp(-step / reaction.torque_filter)
    noticing, approaching = (1 - keep) * robot.joint_lever, reaction.before(speed)
    free, gained = np.isfinite(setup.body_mass).any(), step / setup.body_mass
    now = 0.0

    def commanded(time: float) -> FloatArray:
        return approaching if time <= first else reaction.commanded_speed(speed, time - begun, force)

    while True:
        yield force
        np.multiply(spring_path, path, out=pull)
        pull += np.multiply(damper_path, commanded(now), out=scratch)
        pull -= np.multiply(spring, modes, out=scratch)
        pull -= np.multiply(push, force, out=scratch)
        rates *= before
        rates += np.multiply(after, pull, out=scratch)
        before, after = whole_step
        modes += np.multiply(step, rates, out=scratch)
        now += step
        path += step * commanded(now - step / 2)
        previous, depth = depth, np.multiply(robot.levers, modes, out=scratch).sum(axis=0)
        if free:
            body_rate += gained * force
            body += step * body_rate
            depth -= body
        pad = contact.compressed((previous + depth) / 2, pad, step)
        force = contact.force(depth, pad)
        noticed, torque = torque, keep * torque + noticing * force
        over = torque > reaction.threshold
        if over.any() and (over := over & np.isinf(begun)).any():
            share = (reaction.threshold - noticed[over]) / (torque[over] - noticed[over])
            begun[over] = now - step + share * step + reaction.delay
            first = float(begun.min())
