"""Lowest and highest measured speeds on patches of places, enclosed by the corners of the patches."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.maps.measured_range import TOLERANCE, MeasuredRange

_SLACK = 1e-8  # [m/s]; more than the tolerance within which the range snaps to a measured speed


def lowest_measured_speeds(
    measured_range: MeasuredRange, distance: FloatArray, height: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lower bound of the smallest and upper bound of the largest lowest measured speed [m/s] on patches, shapes (n,).

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
    # Where the planes cross below the range, any lower bound above 0 will do: forms may hold ln v.
    return np.maximum(least - _SLACK, 0.5 * measured_range.lowest[2]), most + _SLACK


def highest_measured_speed(measured_range: MeasuredRange, distance: FloatArray, height: FloatArray) -> FloatArray:
    """Upper bound of the highest measured speed [m/s] on patches with corners of shape (n, k), shape (n,)."""
    most = np.full(len(distance), np.inf)
    for a_d, a_h, a_v, b in measured_range.facets.tolist():
        if a_v > TOLERANCE:
            most = np.minimum(most, (-(a_d * distance + a_h * height + b) / a_v).max(axis=1))
    return most + _SLACK


def footprint(measured_range: MeasuredRange) -> MeasuredRange:
    """The range of places: the measured range projected along the axis of speed."""
    points = measured_range.points.copy()
    points[:, 2] = 0.0
    return MeasuredRange(points)
