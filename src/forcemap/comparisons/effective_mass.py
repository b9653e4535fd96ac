"""Forces over the workspace beside F = v sqrt(k m_u), the force that effective mass alone would give (paper, II-C)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.state import StateTolerance
from forcemap.comparisons.force_models import rank_correlation
from forcemap.dynamics.effective_mass import EffectiveMass
from forcemap.dynamics.inverse_kinematics import DOWN
from forcemap.dynamics.mass_map import robot_effective_mass_at
from forcemap.dynamics.rigid_body import unit_direction
from forcemap.dynamics.robot import Robot
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.limits.pfl import LEAST_STIFFNESS
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.force_map import ForceMap

_LEAST_PLACES = 4  # a choice: three places give perfect rank correlation by chance in one case of three
_SAME_SPEED = StateTolerance().speed  # measured points of a map no further apart are of one speed [m/s]
_PAPER_DEVICE_STIFFNESS = 75_000.0  # spring constant of the paper's device [N/m] (section IV-B)


@dataclass(frozen=True, eq=False)
class MassExplanation:
    """How well one effective mass explains the forces.

    Parameters
    ----------
    name : str
        Which effective mass: of the links alone, or with which drive inertia.
    mass : EffectiveMass
        Effective mass at the places [kg], NaN with a named outcome where there is none.
    force : array, shape (n,)
        F = v sqrt(k m_u) [N].
    ratio : array, shape (n,)
        Force of the map or measurement over it.
    rank_correlation : float
        Spearman's, between the forces and F; NaN where F is constant.
    explained_share : float
        Share of the variance of ln force that F explains; negative if the mean of ln force says more.
    explained_share_scaled : float
        The same for F times the one factor that fits best.
    accuracy : Accuracy
        How far F is from the forces, as of any other model.
    """

    name: str
    mass: EffectiveMass
    force: FloatArray
    ratio: FloatArray
    rank_correlation: float
    explained_share: float
    explained_share_scaled: float
    accuracy: Accuracy

    @property
    def places(self) -> int:
        """Places with an effective mass."""
        return int(np.isfinite(self.force).sum())

    @property
    def ratio_spread(self) -> float:
        """Largest over smallest ratio: 1 if effective mass explained how the force depends on the place."""
        return float(np.nanmax(self.ratio) / np.nanmin(self.ratio))


@dataclass(frozen=True, eq=False)
class MassComparison:
    """Forces at one speed beside what effective mass would give. It is no prediction, and no speed follows from it.

    Parameters
    ----------
    on : str
        Where the forces come from.
    robot : str
        The robot whose effective mass it is.
    speed : float
        The speed [m/s].
    stiffness : float
        Spring constant k of the contact [N/m].
    distance, height : array, shape (n,)
        The places [m].
    measured_force : array, shape (n,)
        Forces of the map or the measurement [N].
    measured_mass : array, shape (n,)
        Effective mass that the forces would take, (F / v)^2 / k [kg].
    postures : tuple of dict, or None
        The robot's posture at each place, positions by joint with the unit; None where it does not reach the place.
    explanations : tuple of MassExplanation
        Links alone; with drive inertia, if the robot has it.
    statements : tuple of Finding
        What the comparison depends on.
    """

    on: str
    robot: str
    speed: float
    stiffness: float
    distance: FloatArray
    height: FloatArray
    measured_force: FloatArray
    measured_mass: FloatArray
    postures: tuple[dict[str, float] | None, ...]
    explanations: tuple[MassExplanation, ...]
    statements: tuple[Finding, ...]

    @property
    def force_spread(self) -> float:
        """Largest over smallest force."""
        return float(self.measured_force.max() / self.measured_force.min())


def compare_effective_mass(
    forces: ForceMap | ImpactDataset,
    robot: Robot,
    *,
    stiffness: float = _PAPER_DEVICE_STIFFNESS,
    speed: float | None = None,
    tool_direction: ArrayLike = DOWN,
) -> MassComparison:
    """Compare the forces of a map, or measured ones, with F = v sqrt(k m_u) at one speed over the workspace.

    Parameters
    ----------
    forces : ForceMap or ImpactDataset
        A map, taken at its measured places; or impacts, taken at the states of that speed below the device range.
    robot : Robot
        The robot, with its tool; with drive inertia the links alone are compared, too.
    stiffness : float
        Spring constant of the contact [N/m]; that of the paper's device if not given.
    speed : float, optional
        Speed [m/s]; the middle measured one if not given.
    tool_direction : array, shape (3,)
        Where the z axis of the flange points; down if not given. The impact goes down.

    Raises
    ------
    InputError
        A stiffness or speed outside its range, a speed that was not measured, or fewer than four places with an
        effective mass.
    """
    if not LEAST_STIFFNESS <= stiffness < np.inf:
        raise InputError(
            f"stiffness: found {stiffness:g} N/m, expected at least {LEAST_STIFFNESS:g}: it is not in N/mm"
        )
    compared, towards = _forces(forces, speed), unit_direction(tool_direction, 3)
    variants = [("links alone", replace(robot, drive_inertia=None))]
    if robot.drive_inertia is not None:
        variants.append(("with drive inertia", robot))
    explanations = tuple(_explanation(*variant, compared, stiffness, tool_direction) for variant in variants)
    return MassComparison(
        on=compared.on,
        robot=robot.name,
        speed=compared.typical_speed,
        stiffness=stiffness,
        distance=compared.distance,
        height=compared.height,
        measured_force=compared.force,
        measured_mass=(compared.force / compared.speed) ** 2 / stiffness,
        postures=tuple(robot.stated_postures(explanations[0].mass.positions)),
        explanations=explanations,
        statements=(
            *robot.findings,
            *forces.conditions.findings,
            Finding.of(
                FindingKind.FORCES_COMPARED,
                on=compared.on,
                speed_mps=compared.typical_speed,
                stiffness_N_per_m=stiffness,
            ),
            _posture(robot, towards),
            *(in_words(explanation.mass.assumption) for explanation in explanations),
            Finding.of(FindingKind.MASS_PREDICTS_NOTHING),
        ),
    )


def _posture(robot: Robot, towards: FloatArray) -> Finding:
    """How the robot stands and is hit."""
    reference = tuple(robot.stated(robot.reference_posture).items())
    figures = {"tool_axis": robot.tool_axis, "towards": towards, "contact_offset_m": robot.contact_offset}
    places = {name: tuple(vector.tolist()) for name, vector in figures.items()}
    return Finding.of(FindingKind.POSTURE, robot=robot.name, load_kg=float(robot.load), reference=reference, **places)


@dataclass(frozen=True, eq=False)
class _Forces:
    """Forces to compare and where they come from; places [m], speeds [m/s], forces [N], shape (n,)."""

    on: str
    name: tuple[str, ...]
    distance: FloatArray
    height: FloatArray
    speed: FloatArray
    force: FloatArray

    @property
    def typical_speed(self) -> float:
        return float(np.median(self.speed))


def _forces(forces: ForceMap | ImpactDataset, wanted: float | None) -> _Forces:
    """At the map's measured places, or at the measured states below the device range."""
    if isinstance(forces, ForceMap):
        points = forces.measured_range.points
        chosen = _measured_speed(points[:, 2], _SAME_SPEED, wanted)
        d, h = np.unique(points[np.abs(points[:, 2] - chosen) <= _SAME_SPEED, :2], axis=0).T
        on, speed = f"map {forces.name} at its measured places", np.full(d.size, chosen)
        names = tuple(f"d = {x:.4g} m, h = {y:.4g} m" for x, y in zip(d, h, strict=True))
        return _Forces(on, names, d, h, speed, np.asarray(forces.predict(d, h, chosen)))
    states, tolerance = forces.states.uncensored, forces.tolerance.speed
    here = states.select(np.abs(states.speed - _measured_speed(states.speed, tolerance, wanted)) <= tolerance)
    return _Forces("measured states", tuple(here.name), here.distance, here.height, here.speed, here.force)


def _measured_speed(speeds: FloatArray, tolerance: float, wanted: float | None) -> float:
    """The measured speed asked for, else the middle one of those measured at most places."""
    if wanted is not None:
        near = np.abs(speeds - wanted)
        if not near.min() <= tolerance:
            known = ", ".join(f"{speed:g}" for speed in np.unique(np.round(speeds, 3)))
            raise InputError(f"speed: found {wanted:g} m/s, expected a measured one: {known}")
        return float(speeds[near.argmin()])
    step = max(tolerance, 1e-6)
    levels, counts = np.unique(np.round(speeds / step), return_counts=True)
    most = levels[counts == counts.max()]
    return float(speeds[np.abs(speeds - most[most.size // 2] * step).argmin()])


def _explanation(
    name: str, robot: Robot, compared: _Forces, stiffness: float, tool_direction: ArrayLike
) -> MassExplanation:
    mass = robot_effective_mass_at(robot, compared.distance, compared.height, tool_direction=tool_direction)
    measured, force = compared.force, compared.speed * np.sqrt(stiffness * mass.value)
    known = np.isfinite(force)
    if known.sum() < _LEAST_PLACES:
        raise InputError(
            f"found {int(known.sum())} places with an effective mass ({name}), expected at least {_LEAST_PLACES}; "
            "the robot does not reach the others with this tool direction"
        )
    misfit = np.log(measured[known] / force[known])
    variance = float(np.var(np.log(measured[known])))
    shares = [1 - part / variance if variance > 0 else np.nan for part in (np.mean(misfit**2), np.var(misfit))]
    correlation = rank_correlation(force[known], measured[known])
    names = [compared.name[i] for i in np.flatnonzero(known)]
    accuracy = Accuracy.of_forces(force[known], measured[known], names, on=compared.on)
    explained, scaled = map(float, shares)
    return MassExplanation(name, mass, force, measured / force, correlation, explained, scaled, accuracy)
