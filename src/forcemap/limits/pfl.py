"""The standard's contact model for power and force limiting (ISO/TS 15066:2016, A.3.4, eq. A.6; paper, eq. 1).

Two masses and a spring: F = v sqrt(k mu) with mu = (1/m_R + 1/m_H)^-1. A body part that is held in place
(constrained) has m_H = infinity.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

LEAST_STIFFNESS = 1000.0
"""Spring constant of a body part [N/m] below which a figure is in N/mm: the softest body region has 10 N/mm. N/mm in
place of N/m would give 30 times the speed."""

# Beyond these, too, a figure is in another unit, and the speed would come out too high.
_LEAST_MASS = 0.01  # [kg]
_LARGEST_AREA = 0.05  # [m^2]; far more than any contact of a limb
_LARGEST_FORCE = 1e5  # [N]; several hundred times the limits of the standard


def pfl_robot_mass(moving_mass: ArrayLike, payload: ArrayLike = 0.0) -> Any:
    """Effective robot mass m_R = M / 2 + m_L.

    Parameters
    ----------
    moving_mass : float or array
        Total mass M of the moving parts of the robot [kg].
    payload : float or array
        Effective payload m_L, tool and workpiece [kg].

    Raises
    ------
    InputError
        A mass that is not positive and finite (a payload of 0 is accepted).

    Examples
    --------
    >>> pfl_robot_mass(30.0)
    15.0
    """
    load = np.asarray(payload, dtype=np.float64)
    if not np.all((load >= 0) & (load < np.inf)):
        raise InputError("payload: expected kilograms, at least 0 and finite")
    return _result(_positive("moving mass", moving_mass, "kilograms") / 2 + load)


def pfl_contact_force(speed: ArrayLike, *, robot_mass: ArrayLike, body_mass: ArrayLike, stiffness: ArrayLike) -> Any:
    """Contact force F = v sqrt(k mu).

    Parameters
    ----------
    speed : float or array
        Relative speed v [m/s], at least 0.
    robot_mass : float or array
        Effective robot mass m_R [kg], see `pfl_robot_mass`.
    body_mass : float or array
        Effective mass m_H of the body region [kg]; math.inf if the body part is constrained.
    stiffness : float or array
        Spring constant k of the body region [N/m].

    Returns
    -------
    float or array
        Force [N].

    Raises
    ------
    InputError
        A figure outside its range.

    Examples
    --------
    >>> import math
    >>> round(pfl_contact_force(0.3, robot_mass=15.0, body_mass=math.inf, stiffness=75e3), 1)
    318.2
    """
    v = np.asarray(speed, dtype=np.float64)
    if not np.all((v >= 0) & (v < np.inf)):
        raise InputError("speed: expected metres per second, at least 0 and finite")
    return _result(v * _force_per_speed(robot_mass, body_mass, stiffness))


def pfl_speed_limit(max_force: ArrayLike, *, robot_mass: ArrayLike, body_mass: ArrayLike, stiffness: ArrayLike) -> Any:
    """Speed limit v = F_max / sqrt(k mu), the inverse of `pfl_contact_force`.

    Parameters
    ----------
    max_force : float or array
        Force limit F_max [N].
    robot_mass, body_mass, stiffness : float or array
        As in `pfl_contact_force` [kg], [kg], [N/m].

    Returns
    -------
    float or array
        Speed [m/s].

    Raises
    ------
    InputError
        A figure outside its range.

    Examples
    --------
    >>> import math
    >>> round(pfl_speed_limit(140.0, robot_mass=15.0, body_mass=math.inf, stiffness=75e3), 4)
    0.132
    """
    force = _positive("force limit", max_force, "newtons", most=_LARGEST_FORCE)
    return _result(force / _force_per_speed(robot_mass, body_mass, stiffness))


def pfl_pressure_speed_limit(
    max_pressure: ArrayLike,
    *,
    contact_area: ArrayLike,
    robot_mass: ArrayLike,
    body_mass: ArrayLike,
    stiffness: ArrayLike,
) -> Any:
    """Speed limit of the pressure form, v = p_max A / sqrt(k mu).

    Parameters
    ----------
    max_pressure : float or array
        Pressure limit p_max [Pa]; 1 N/cm^2 is 10 000 Pa.
    contact_area : float or array
        Contact area A [m^2].
    robot_mass, body_mass, stiffness : float or array
        As in `pfl_contact_force` [kg], [kg], [N/m].

    Returns
    -------
    float or array
        Speed [m/s].

    Raises
    ------
    InputError
        A figure outside its range.
    """
    pressure = _positive("pressure limit", max_pressure, "pascals")
    area = _positive("contact area", contact_area, "square metres (1 cm^2 is 0.0001 m^2)", most=_LARGEST_AREA)
    return _result(pressure * area / _force_per_speed(robot_mass, body_mass, stiffness))


def pfl_governing_speed_limit(
    max_force: ArrayLike,
    max_pressure: ArrayLike,
    *,
    contact_area: ArrayLike,
    robot_mass: ArrayLike,
    body_mass: ArrayLike,
    stiffness: ArrayLike,
) -> Any:
    """The lower of the force form's and the pressure form's speed limit [m/s]; arguments as there."""
    masses = {"robot_mass": robot_mass, "body_mass": body_mass, "stiffness": stiffness}
    by_force = pfl_speed_limit(max_force, **masses)
    by_pressure = pfl_pressure_speed_limit(max_pressure, contact_area=contact_area, **masses)
    return _result(np.minimum(by_force, by_pressure))


def pfl_energy(force: ArrayLike, *, stiffness: ArrayLike) -> Any:
    """Energy E = F^2 / (2 k) [J] that a contact force [N] stores in a spring constant [N/m] (A.3.4).

    Raises
    ------
    InputError
        A figure that is not positive and finite.
    """
    return _result(
        _positive("force", force, "newtons") ** 2 / (2 * _positive("stiffness", stiffness, "N/m", LEAST_STIFFNESS))
    )


def _force_per_speed(robot_mass: ArrayLike, body_mass: ArrayLike, stiffness: ArrayLike) -> FloatArray:
    """sqrt(k mu) [N s/m]."""
    body = np.asarray(body_mass, dtype=np.float64)
    if np.ma.is_masked(body_mass) or not np.all(body >= _LEAST_MASS):
        raise InputError(f"body mass: expected kilograms from {_LEAST_MASS:g}, math.inf for a constrained body part")
    robot = _positive("robot mass", robot_mass, "kilograms", _LEAST_MASS)
    k = _positive("stiffness", stiffness, "N/m (75 N/mm is 75000 N/m)", LEAST_STIFFNESS)
    return np.asarray(np.sqrt(k / (1 / robot + 1 / body)))


def _positive(name: str, value: ArrayLike, unit: str, least: float = 0.0, most: float = np.inf) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if np.ma.is_masked(value) or not np.all((array > 0) & (array >= least) & (array <= most) & (array < np.inf)):
        floor = f"at least {least:g}" if least else "above 0"
        raise InputError(f"{name}: expected {unit}, {floor} and {f'at most {most:g}' if most < np.inf else 'finite'}")
    return array


def _result(value: Any) -> Any:
    """A float for a scalar, else the array."""
    return float(value) if np.ndim(value) == 0 else value
