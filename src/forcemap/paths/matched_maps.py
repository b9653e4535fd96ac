"""Which maps of an atlas hold for which pieces of a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray, Mask, Objects
from forcemap.direction import ON_AXIS
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.paths.atlas import Atlas, Loaded
from forcemap.paths.task import Task
from forcemap.paths.tool_path import ToolPath

CORNER = 1e-4
"""Within which a log has a row at a corner [m]; a choice."""

_ROUNDING = 1e-9  # [deg]
_ABOUT = 30.0  # [deg] within which an excluded motion goes about as a map does; a choice
_ACROSS = 0.5  # cosine of the angle between two motions, from which on they point the same way; a choice


_FLANGE = {"flange", "tool flange", "flansch", "bride", "flangia", "brida"}


@dataclass(frozen=True, eq=False)
class MatchedMaps:
    """Which maps hold for which pieces.

    Parameters
    ----------
    atlas : Atlas
        The maps.
    angle : float
        How far a motion may point away from the direction of a map [deg].
    needs : array of tuple of Loaded, shape (n,)
        The contact sites that can hit on each piece, with tool and payload; empty where contact is excluded.
    off_angles : array, shape (maps, n)
        Angle between each piece, or what the robot may drive beside it, and the direction of each map that holds for it
        [deg]; NaN where it does not, or where another contact site that can hit has no map.
    missing : array of bool, shape (n,)
        True where a contact site that can hit has no map.
    held : dict of Loaded to array of bool, shape (n,)
        For each contact site, with tool and payload, that can hit: pieces within the angle of one of its maps.
    offsets : dict of Loaded to array, shape (3,)
        Where each of them lies from the point of the path, in the frame of the base [m].
    stated : str
        The direction that the task states, so that maps of others do not count; empty if it states none.
    excluded_along : array of bool, shape (n,)
        True where contact is excluded, though the piece moves about in the direction of a map.
    """

    atlas: Atlas
    angle: float
    needs: Objects
    off_angles: FloatArray
    missing: Mask
    held: dict[Loaded, Mask]
    offsets: dict[Loaded, FloatArray]
    stated: str
    excluded_along: Mask

    @property
    def raised(self) -> bool:
        """True if a bound is raised because a piece points away from its map's direction."""
        return bool(np.any(self.off_angles > ON_AXIS))

    @property
    def not_hitting(self) -> tuple[str, ...]:
        """Contact sites of the atlas that the task takes as not hitting on some piece with contact."""
        known = dict.fromkeys(each.loaded.contact_site for each in self.atlas.campaigns)
        hitting = [{need.contact_site for need in needs} for needs in dict.fromkeys(self.needs) if needs]
        return tuple(site for site in known if any(site not in sites for sites in hitting))

    @property
    def at_flange(self) -> tuple[Finding, ...]:
        """That a path of the flange is held against maps of other contact sites; empty if there are none."""
        sites = {need.contact_site or "not stated" for need in self.offsets} - _FLANGE
        return (Finding.of(FindingKind.SITE_NOT_AT_FLANGE, sites=tuple(sorted(sites))),) if sites else ()

    @property
    def beside(self) -> tuple[Finding, ...]:
        """That contact sites lie beside the point of the path, whose tool must not turn then; empty if none does."""
        sites = [need.contact_site for need, offset in self.offsets.items() if offset.any()]
        return (Finding.of(FindingKind.SITES_BESIDE, sites=", ".join(dict.fromkeys(sites))),) if sites else ()

    def lengths_excluded_along(self, path: ToolPath) -> dict[str, float]:
        """The segments on which contact is excluded, though the path moves about in the direction of a map there, and
        how far it does [m]."""
        names, lengths = np.array(path.names)[self.excluded_along], path.lengths[self.excluded_along]
        return {name: float(lengths[names == name].sum()) for name in dict.fromkeys(names.tolist())}

    def named_late(self, path: ToolPath) -> tuple[Finding, ...]:
        """That the segments of a path may be named a row too late; empty if nothing tells it.

        Then what moves as a map holds for has the name of the motion before it, whose contact may be excluded: no
        motion with contact does so, or before a segment with contact such a motion, longer than a corner is logged to,
        ends a segment that began in another direction, or the segment with contact ends in another one.
        """
        names, possible = np.array(path.names), np.array([bool(needs) for needs in self.needs])
        begins = np.flatnonzero(names[1:] != names[:-1]) + 1
        before, starts, ends = begins - 1, np.append(0, begins)[:-1], np.append(begins, len(names))[1:] - 1
        across = [np.einsum("ij,ij->i", *path.directions[[before, each]]) < _ACROSS for each in (starts, ends)]
        along, reached = self.excluded_along, path.lengths.cumsum()
        from_where = np.maximum.accumulate(np.where(along, 0.0, reached))  # the end of the last piece not along a map
        from_where = np.maximum(from_where[before], np.append(0.0, reached)[starts])
        long = reached[before] - from_where > CORNER
        late = names[before][along[before] & long & possible[ends] & np.any(across, axis=0)]
        only = not (possible & ~self.missing).any()
        segments = tuple(self.lengths_excluded_along(path)) if only else tuple(dict.fromkeys(late.tolist()))
        if not segments:
            return ()
        figures = {
            "segments": segments,
            "directions": self.atlas.directions,
            "only": only,
            "timed": path.time is not None,
        }
        return (Finding.of(FindingKind.NAMED_LATE, **figures),)

    @property
    def payloads(self) -> FloatArray:
        """Payload on each piece [kg], shape (n,); NaN if not stated, or where contact is excluded."""
        payloads = [next((need.payload for need in needs), None) for needs in self.needs]
        return np.array(payloads, dtype=np.float64)

    def reasons(self, pieces: Mask) -> list[Finding]:
        """Why pieces have no map."""
        there = {each.loaded for each in self.atlas.maps}
        return [self._reason([need for need in needs if need not in there]) for needs in self.needs[pieces]]

    def _reason(self, unknown: list[Loaded]) -> Finding:
        """`unknown` are contact sites, with tool and payload, that have no map at all."""
        if unknown:
            sites, (first, *_) = tuple(need.contact_site for need in unknown), unknown
            payload = np.nan if first.payload is None else first.payload
            return Finding.of(FindingKind.NO_MAP_OF, sites=sites, tool=first.tool, payload_kg=payload)
        if self.stated and len(self.atlas.campaigns) > 1:
            return Finding.of(FindingKind.NOT_AS_STATED, angle_deg=self.angle, direction=self.stated)
        directions = self.atlas.directions
        kind = FindingKind.NOT_ALONG if len(directions) == 1 else FindingKind.NOT_ALONG_ANY
        return Finding.of(kind, angle_deg=self.angle, directions=directions)


def matched_maps(atlas: Atlas, path: ToolPath, task: Task, *, angle: float, beside: float) -> MatchedMaps:
    """The maps that hold for each piece: of its tool and payload and a contact site, within `angle` of their direction.

    Parameters
    ----------
    atlas : Atlas
        The maps.
    path : ToolPath
        The path in short pieces.
    task : Task
        What can hit on each segment.
    angle : float
        How far a motion may point away from the direction of a map [deg].
    beside : float
        How far beside the path the robot may be [m].

    Raises
    ------
    InputError
        The task leaves open what the campaigns differ in.
    """
    of_segment = {segment.name: atlas.needs(task, segment) if segment.contact else () for segment in task.segments}
    numbers = {name: number for number, name in enumerate(of_segment)}
    which = np.array([numbers[name] for name in path.names])
    needs = np.empty(len(of_segment), dtype=object)
    needs[:] = list(of_segment.values())
    off_angles = np.full((len(atlas.maps), len(path)), np.nan)
    offsets = _offsets(task, path, needs)
    held = {need: np.zeros(len(path), dtype=np.bool_) for each in needs for need in each}
    for off_angle, entry in zip(off_angles, atlas.maps, strict=True):
        wanted = np.array([entry.loaded in each for each in needs])[which] & atlas.in_direction(entry, task)
        if wanted.any():
            angles = path.moved(offsets[entry.loaded]).angles_from(entry.direction, beside=beside)
            within = wanted & (angles <= angle + _ROUNDING)
            off_angle[within] = angles[within]
            held[entry.loaded] |= within
    missing = np.zeros(len(path), dtype=np.bool_)
    for number, each in enumerate(needs):
        for need in each:
            missing |= (which == number) & ~held[need]
    off_angles[:, missing] = np.nan
    excluded_along = np.array([not each for each in needs])[which]
    if excluded_along.any():
        excluded_along &= np.any([path.angles_from(each.direction) <= _ABOUT for each in atlas.maps], axis=0)
    stated = task.conditions.get("direction", "")
    return MatchedMaps(atlas, angle, needs[which], off_angles, missing, held, offsets, stated, excluded_along)


def _offsets(task: Task, path: ToolPath, needs: Objects) -> dict[Loaded, FloatArray]:
    """Where each contact site lies from the point of the path [m].

    Raises
    ------
    InputError
        That is not stated, or the tool may turn: then another point of it moves otherwise.
    """
    offsets = {need: task.site_offset(need.contact_site, alone=len(each) == 1) for each in needs for need in each}
    if path.turning is not None and any(offset.any() for offset in offsets.values()):
        raise InputError(
            "contact sites: on a path of joints the tool may turn; give each contact site a path of its own"
        )
    return offsets
