"""Two maps beside each other, over the range that both have measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.conditions import Conditions
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256

_GRID = 33  # values along each axis of the common range: a choice, some 36,000 points
# entries of campaign.toml that differ between any two campaigns, or that results state themselves
_UNLIKE = ("date", "operator", "note", "simulated")


@dataclass(frozen=True)
class RatioAt:
    """The ratio of two maps' forces at a state.

    Parameters
    ----------
    ratio : float
        Force of the map `other` over that of the map `one`.
    distance, height, speed : float
        The state [m], [m], [m/s].
    one_force, other_force : float
        What they predict [N].
    """

    ratio: float
    distance: float
    height: float
    speed: float
    one_force: float
    other_force: float


@dataclass(frozen=True)
class MapComparison:
    """Two maps over the range that both have measured.

    Parameters
    ----------
    one, other : Finding
        What the maps are: form, source, states, what became of censored impacts, start of the SHA-256.
    same : bool
        True if they are the same map: their files would be equal, byte by byte.
    mean_ratio, geometric_mean_ratio : float
        Mean ratio over the common range, of the force of `other` to that of `one`.
    smallest, largest : RatioAt
        The extremes and where they are.
    higher_share : float
        Share of the common range in which `other` is the higher one.
    points : int
        Points compared, evenly over the common range.
    lowest, highest : tuple of float
        Box around them: distance [m], height [m], speed [m/s].
    statements : tuple of Finding
        What the comparison depends on.
    """

    one: Finding
    other: Finding
    same: bool
    mean_ratio: float
    geometric_mean_ratio: float
    smallest: RatioAt
    largest: RatioAt
    higher_share: float
    points: int
    lowest: tuple[float, float, float]
    highest: tuple[float, float, float]
    statements: tuple[Finding, ...]


def compare_maps(one: ForceMap, other: ForceMap) -> MapComparison:
    """Compare two maps over the measured range they have in common, on a dense grid.

    Parameters
    ----------
    one, other : ForceMap
        The maps; ratios are the force of `other` over that of `one`.

    Returns
    -------
    MapComparison

    Raises
    ------
    InputError
        The measured ranges have nothing in common.

    Examples
    --------
    >>> from forcemap import compare_maps, published_map
    >>> round(compare_maps(published_map("kuka-iiwa7-30nm"), published_map("kuka-iiwa7-10nm")).mean_ratio, 2)
    0.95
    """
    ranges = (one.measured_range, other.measured_range)
    lowest = np.max([measured.lowest for measured in ranges], axis=0)
    highest = np.min([measured.highest for measured in ranges], axis=0)
    axes = [np.unique(np.linspace(low, max(low, high), _GRID)) for low, high in zip(lowest, highest, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def common(points: FloatArray) -> FloatArray:
        return points[np.logical_and.reduce([measured.contains(*points.T) for measured in ranges])]

    evenly = common(grid)
    corners = common(np.vstack([measured.points for measured in ranges]))  # a grid misses the corners of a hull
    if not len(evenly) or np.any(lowest > highest + 1e-9):
        raise InputError(
            f"found no state that both maps have measured: {_range_words(one)} and {_range_words(other)}; "
            "expected ranges that overlap"
        )
    ratio = other.predict(*evenly.T) / one.predict(*evenly.T)
    points = np.vstack([evenly, corners])
    forces = np.column_stack([one.predict(*points.T), other.predict(*points.T)])
    ratios = forces[:, 1] / forces[:, 0]
    smallest, largest = (
        RatioAt(float(ratios[i]), *points[i].tolist(), *forces[i].tolist()) for i in (ratios.argmin(), ratios.argmax())
    )
    simulated = one.simulated or other.simulated
    return MapComparison(
        one=_described(one),
        other=_described(other),
        same=map_sha256(one) == map_sha256(other),
        mean_ratio=float(ratio.mean()),
        geometric_mean_ratio=float(np.exp(np.log(ratio).mean())),
        smallest=smallest,
        largest=largest,
        higher_share=float(np.mean(ratio > 1)),
        points=len(evenly),
        lowest=(float(evenly[:, 0].min()), float(evenly[:, 1].min()), float(evenly[:, 2].min())),
        highest=(float(evenly[:, 0].max()), float(evenly[:, 1].max()), float(evenly[:, 2].max())),
        statements=(
            *([Finding.of(FindingKind.SIMULATED)] if simulated else []),
            Finding.of(FindingKind.WITHOUT_BOUNDS),
            *differences(one.conditions, other.conditions, ("the one", "the other")),
        ),
    )


def _described(force_map: ForceMap) -> Finding:
    fit = force_map.fit
    return Finding.of(
        FindingKind.MAP_COMPARED,
        form=force_map.form.name,
        source=force_map.source,
        states=0 if fit is None else len(fit.states),
        counted=fit.censored_samples if fit is not None and fit.censored_fit else 0,
        discarded=fit.censored_samples if fit is not None and not fit.censored_fit else 0,
        sha256=map_sha256(force_map)[:8],
    )


def _range_words(force_map: ForceMap) -> str:
    axes = zip("dhv", force_map.measured_range.lowest, force_map.measured_range.highest, ("m", "m", "m/s"), strict=True)
    return f"{force_map.name} " + ", ".join(f"{axis} {low:g} to {high:g} {unit}" for axis, low, high, unit in axes)


def differences(of_one: Conditions, of_other: Conditions, called: tuple[str, str]) -> list[Finding]:
    """Entries of campaign.toml that differ, and in one more finding those that only one of the two states."""
    one, other = _entries(of_one), _entries(of_other)
    differing = [
        Finding.of(FindingKind.DIFFERS, entry=name, one=called[0], says=one[name], other=called[1], but=other[name])
        for name in one
        if name in other and one[name] != other[name]
    ]
    alone = tuple(sorted(one.keys() ^ other.keys()))
    return [*differing, Finding.of(FindingKind.STATED_BY_ONE, entries=alone)] if alone else differing


def _entries(conditions: Conditions) -> dict[str, object]:
    entries: dict[str, object] = {}
    for section, value in conditions.to_tables().items():
        inner = {f"{section}.{key}": entry for key, entry in value.items()} if isinstance(value, dict) else {}
        entries |= inner or {section: value}
    return {name: value for name, value in entries.items() if name.split(".")[-1] not in _UNLIKE}
