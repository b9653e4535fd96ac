"""What a path lacks maps for: the directions to measure, what each would permit, and what it costs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask
from forcemap.direction import DIRECTIONS, WIDEST_ANGLE, direction_vector, direction_words, same_direction
from forcemap.maps.bounds import FEW_STATES
from forcemap.paths.atlas import Loaded
from forcemap.paths.path_speeds import PathSpeeds, PieceOutcome

CARRIED_STATES = 9
"""States that usually carry a map over to another tool or payload (docs/transfer.md)."""

_MOST = 7  # directions that are proposed for a contact site; a choice: who needs more bends the path
_ROUNDED = 2  # decimals of the directions that are tried
_LEAST = 1e-3  # [m]; a gap shorter than this is not proposed


@dataclass(frozen=True)
class Gap:
    """A map that is missing along a path.

    Parameters
    ----------
    direction : str
        Direction to measure, in the words of campaign.toml.
    loaded : Loaded
        Contact site, tool and payload to measure with.
    segments : tuple of str
        Names of the segments that it would cover, or a part of.
    length : float
        Length of the path that it would cover [m], as far as nothing else forbids a speed there.
    states : int
        States to measure: of a map of its own, or fewer where the same direction and contact site has a map with
        another tool or payload that may be carried over.
    gain : float
        Estimated time gained on that length against the standard's one speed [s], if the map allowed as much as the
        others on average; NaN where either is not known. Starting and stopping are not reckoned with.
    """

    direction: str
    loaded: Loaded
    segments: tuple[str, ...]
    length: float
    states: int
    gain: float


def map_gaps(speeds: PathSpeeds) -> tuple[Gap, ...]:
    """The maps that a path lacks, those that cover most first.

    Directions are chosen one after the other, each so that it covers most of what is left; at most seven for each
    contact site. Where the task states a direction, that one alone: other directions are its to allow, not the maps'.

    Parameters
    ----------
    speeds : PathSpeeds
        Speeds along the path.
    """
    matched, lengths = speeds.matched, speeds.path.lengths
    may_be = speeds.outcome != PieceOutcome.NOT_PERMITTED  # no map permits contact that the limits do not
    saved = _saved_per_metre(speeds)
    found = []
    for need, held in matched.held.items():
        left = np.array([need in needs for needs in matched.needs]) & ~held & may_be
        measured = [each.direction for each in speeds.atlas.maps if each.loaded == need]
        for _ in range(_MOST):
            words = (matched.stated or _widest(speeds, left, measured)) if left.any() else ""
            if not words:
                break
            covers = left & (speeds.path.angles_from(direction_vector(words, whose="a gap")) <= matched.angle)
            if lengths[covers].sum() < _LEAST:
                break
            length = float(lengths[covers].sum())
            names = tuple(dict.fromkeys(itertools.compress(speeds.path.names, covers)))
            found.append(Gap(words, need, names, length, _states(speeds, need, words), saved * length))
            left &= ~covers
    return tuple(sorted(found, key=lambda gap: -gap.length))


def _widest(speeds: PathSpeeds, left: Mask, measured: Sequence[FloatArray]) -> str:
    """The direction within whose angle the longest part of these pieces lies; a named one if it does as well.

    None that is too close to a direction that is measured already; empty if there is no other.
    """
    path, angle = speeds.path, speeds.matched.angle
    towards, which = np.unique(np.round(_in_cylinder(speeds)[left], _ROUNDED), axis=0, return_inverse=True)
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    weights = np.bincount(which.ravel(), path.lengths[left])
    tried = np.vstack([*DIRECTIONS.values(), towards[np.argsort(-weights)[:100]]])
    near = [tried @ each >= math.cos(math.radians(2 * WIDEST_ANGLE)) for each in measured]
    covered = (tried @ towards.T >= math.cos(math.radians(angle))) @ weights
    covered[np.any(near, axis=0) if near else []] = 0.0
    if not covered.max() > 0:
        return ""
    return direction_words(tried[int(np.argmax(np.round(covered, 9)))])


def _in_cylinder(speeds: PathSpeeds) -> FloatArray:
    """Direction of each piece in the cylinder around the base at its middle, shape (n, 3)."""
    middle = (speeds.path.points[1:] + speeds.path.points[:-1]) / 2
    azimuth = np.arctan2(middle[:, 1], middle[:, 0])
    x, y, z = speeds.path.directions.T
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    return np.stack([x * cosine + y * sine, y * cosine - x * sine, z], axis=1)


def _states(speeds: PathSpeeds, need: Loaded, words: str) -> int:
    maps = speeds.atlas.maps
    others = (each for each in maps if each.loaded.contact_site == need.contact_site and each.loaded != need)
    carried = any(same_direction(each.conditions.direction, words) for each in others)
    return CARRIED_STATES if carried else FEW_STATES


def _saved_per_metre(speeds: PathSpeeds) -> float:
    """Time per length [s/m] that a mean allowed speed of this path saves against the standard's; NaN if unknown."""
    driven = ~speeds.refused & ~np.isnan(speeds.contact_speed)
    if not driven.any():
        return math.nan
    lengths = speeds.path.lengths[driven]
    pace = float(np.sum(lengths / speeds.speed[driven]) / lengths.sum())
    return 1 / speeds.standard.speed - pace
