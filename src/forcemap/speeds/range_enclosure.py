"""Where the measured range begins and ends in speed on patches of places, from the corners of the patches."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.maps.measured_range import TOLERANCE, MeasuredRange

_SLACK = 1e-8  # [m/s]; measured speeds this close are snapped to


def lowest_measured_speeds(
    measured_range: MeasuredRange, distance: FloatArray, height: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """At most the smallest, and at least the largest, lowest measured speed [m/s] on patches, each of shape (n,).

    Parameters
    ----------
    measured_range : MeasuredRange
        The range.
    distance, height : array, shape (n, k)
        Corners of convex patches [m].
    """
    least, most = np.full((2, len(distance)), -np.inf)
    for a_d, a_h, a_v, b in measured_range.facets.tolist():
        if a_v < -TOLERANCE:  # the lowest speed is the largest of these planes
            plane = -(a_d * distance + a_h * height + b) / a_v
            least = np.maximum(least, plane.min(axis=1))
            most = np.maximum(most, plane.max(axis=1))
    return np.maximum(least - _SLACK, 0.5 * measured_range.lowest[2]), most + _SLACK


def highest_measured_speed(measured_range: MeasuredRange, distance: FloatArray, height: FloatArray) -> FloatArray:
    """At least the largest highest measured speed [m/s] on patches with these corners (n, k), shape (n,)."""
    most = np.full(len(distance), np.inf)
    for a_d, a_h, a_v, b in measured_range.facets.tolist():
        if a_v > TOLERANCE:
            most = np.minimum(most, (-(a_d * distance + a_h * height + b) / a_v).max(axis=1))
    return most + _SLACK


def footprint(measured_range: MeasuredRange) -> MeasuredRange:
    """The range of places: the measured range seen along the axis of speed."""
    points = measured_range.points.copy()
    points[:, 2] = 0.0
    return MeasuredRange(points)
