"""An atlas: several maps of one robot, each for a direction, a contact site, a tool and a payload."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.campaign import campaign_folders, is_campaign
from forcemap.campaigns.conditions import CAMPAIGN_FILE, ENTRIES, Conditions, normalised, read_conditions
from forcemap.campaigns.impacts_table import read_dataset
from forcemap.campaigns.point_list import POINTS_FILE, measured_at_points
from forcemap.campaigns.recordings_table import REGISTER_FILE, Use, read_register
from forcemap.direction import ON_AXIS, WIDEST_ANGLE, angle_between, direction_vector, direction_words, same_direction
from forcemap.errors import BoundNotAvailable, CampaignFileError, ForcemapError, InputError
from forcemap.files import read_bytes, sha256, toml_tables
from forcemap.findings import Finding, FindingKind
from forcemap.maps.bounds import Bound
from forcemap.maps.carry_over import campaign_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256, read_map
from forcemap.maps.same_impacts import states_alike
from forcemap.paths.task import Task, TaskSegment
from forcemap.speeds.basis import Basis

ATLAS_FILE = "atlas.toml"
SCHEMA = "forcemap-atlas/1"

_ONE_ROBOT = ("robot", "controller", "firmware", "moving_mass", "covers", "safety_settings", "simulated")


@dataclass(frozen=True)
class Loaded:
    """What a map holds for besides its direction: a contact site, with a tool and a payload.

    Parameters
    ----------
    contact_site, tool : str
        In small letters, single spaces; empty if not stated.
    payload : float or None
        Effective payload [kg]; None if not stated.
    """

    contact_site: str
    tool: str
    payload: float | None

    @classmethod
    def of(cls, contact_site: str, tool: str, payload: float) -> Self:
        """The same for texts however they are written, and a payload that is NaN if not stated."""
        return cls(normalised(contact_site), normalised(tool), None if math.isnan(payload) else float(payload))


@dataclass(frozen=True, eq=False)
class AtlasMap:
    """A campaign of an atlas: what it was measured under, and its map, or why it has none.

    Parameters
    ----------
    name : str
        Its folder or file, as the atlas names it.
    conditions : Conditions
        What it was measured under.
    force_map : ForceMap or None
        Its map; None if none can be fitted.
    error : ForcemapError or None
        Why there is none.
    folder : Path or None
        Of the campaign; None of a map file.
    """

    name: str
    conditions: Conditions
    force_map: ForceMap | None
    error: ForcemapError | None = None
    folder: Path | None = None

    @cached_property
    def direction(self) -> FloatArray:
        """Unit vector of its direction in the cylinder around the base, shape (3,); InputError if there is none."""
        return direction_vector(self.conditions.direction, whose="the campaign")

    @property
    def loaded(self) -> Loaded:
        """Its contact site, tool and payload."""
        return Loaded.of(self.conditions.contact_site, self.conditions.tool, self.conditions.payload)


@dataclass(frozen=True, eq=False)
class Atlas:
    """Maps of one robot under the same safety settings, for different directions, contact sites, tools and payloads.

    Parameters
    ----------
    campaigns : tuple of AtlasMap
        The campaigns, those without a map, too: their contact sites and tools are known.
    source : str
        The folder or file.

    Raises
    ------
    InputError
        No campaign has a map; a campaign states no direction that a motion can be compared with; two are of different
        robots or safety settings, or of the same contact site, tool and payload in nearly the same direction; a
        recording at a contact point lies in the folder of another campaign than the map that it is held against; two
        campaigns use the same impacts.
    """

    campaigns: tuple[AtlasMap, ...]
    source: str = ""

    def __post_init__(self) -> None:
        if not self.maps:
            why = "; ".join(f"{each.name}: {each.error.message}" for each in self.campaigns if each.error)
            raise InputError(
                f"no campaign of the atlas has a map{f' ({why})' if why else ''}", file=self.source or None
            )
        for each in self.campaigns:
            self._require_direction(each)
        for one, other in itertools.combinations(self.campaigns, 2):
            self._require_one_robot(one, other)
            between = angle_between(one.direction, other.direction)
            if between <= 2 * WIDEST_ANGLE and one.loaded == other.loaded:
                raise InputError(
                    f"{one.name} and {other.name} are of the same contact site, tool and payload, and their directions "
                    f"differ by {between:.3g} degrees, expected more than {2 * WIDEST_ANGLE:g}, so that one map holds "
                    "for a motion; keep one of them",
                    file=self.source or None,
                )

        self._require_own_impacts()
        for one, other in itertools.permutations(self.campaigns, 2):
            self._require_points_beside_their_map(one, other)

    def _require_own_impacts(self) -> None:
        """Refuse what two maps use: an impact was made once, of one direction, site, tool and payload.

        A recording is told by its file; of files that were saved anew, and of map files, the states of several impacts.
        """
        of = {each.name: _recordings(each.folder) for each in self.campaigns if each.folder is not None}
        for one, other in itertools.combinations(of, 2):
            if shared := [name for digest, name in of[one].items() if digest in of[other]]:
                raise InputError(
                    f"{len(shared)} recordings of {one} are those of {other}, too (the first: {shared[0]}); "
                    "a recording was made in one of them: take them out of the other, and collect it (of simulated "
                    "ones: simulate one of them with another --seed)",
                    file=self.source or None,
                )
        fitted = [(each.name, each.force_map.fit) for each in self.maps if each.force_map and each.force_map.fit]
        for (first, own), (second, others) in itertools.combinations(fitted, 2):
            if alike := states_alike(own.of_table, others.of_table):
                raise InputError(
                    f"{len(alike)} states of {first} have the forces of states of {second} (the first: "
                    f"{alike[0]}), as only the same impacts have; they were made for one of the two: measure the other "
                    "one, or take it out",
                    file=self.source or None,
                )

    def _require_points_beside_their_map(self, one: AtlasMap, other: AtlasMap) -> None:
        """Refuse recordings at contact points in one folder that speak for or against the map of another: a map is held
        against those of its own folder alone."""
        its, site = other.conditions, other.loaded.contact_site
        if one.folder is None or replace(one.loaded, contact_site=site) != other.loaded:
            return
        for made in measured_at_points(one.folder, its):
            if same_direction(made.direction, its.direction, within=WIDEST_ANGLE):
                raise InputError(
                    f"{made.recording} was made along {made.direction} at {its.contact_site}, as {other.name} was, and "
                    f"counts for its map only in its folder: move the file there from {one.name}, with the row of "
                    f"{POINTS_FILE} that names it, and collect both",
                    file=str(one.folder / POINTS_FILE),
                )

    def _require_direction(self, campaign: AtlasMap) -> None:
        try:
            _ = campaign.direction
        except InputError as error:
            where = f"{campaign.name}: " if len(self.campaigns) > 1 else ""
            raise InputError(f"{where}{error.message}", file=self.source or None) from None

    def _require_one_robot(self, one: AtlasMap, other: AtlasMap) -> None:
        entries = {name: entry for entry, (name, _) in ENTRIES.items()}
        for name in _ONE_ROBOT:
            stated = [_comparable(getattr(each.conditions, name)) for each in (one, other)]
            if stated[0] != stated[1]:
                texts = [("nothing" if value in ("", None) else repr(value)) for value in stated]
                raise InputError(
                    f"{entries[name]}: {one.name} states {texts[0]}, {other.name} {texts[1]}; an atlas is of one robot "
                    f"under the same safety settings: correct campaign.toml, or name those that belong together in "
                    f"{ATLAS_FILE}",
                    file=self.source or None,
                )

    @classmethod
    def of(cls, maps: ForceMap | Atlas) -> Atlas:
        """The atlas itself, or that of a single map."""
        return maps if isinstance(maps, Atlas) else Atlas((AtlasMap(maps.name, maps.conditions, maps),))

    @property
    def maps(self) -> tuple[AtlasMap, ...]:
        """The campaigns that have a map."""
        return tuple(each for each in self.campaigns if each.force_map)

    @property
    def force_maps(self) -> tuple[ForceMap, ...]:
        """The maps."""
        return tuple(each.force_map for each in self.campaigns if each.force_map)

    @property
    def conditions(self) -> Conditions:
        """What the first campaign was measured under; robot and safety settings are those of all."""
        return self.campaigns[0].conditions

    @property
    def simulated(self) -> bool:
        """True if the impacts of a map are simulated."""
        return any(force_map.simulated for force_map in self.force_maps)

    @cached_property
    def sha256(self) -> str:
        """Hash of a single map; of several one over their names and hashes."""
        hashes = [map_sha256(force_map) for force_map in self.force_maps]
        lines = (f"{digest}  {each.name}\n" for digest, each in zip(hashes, self.maps, strict=True))
        return hashes[0] if len(self.campaigns) == 1 else sha256("".join(lines).encode("utf-8", "surrogateescape"))

    @property
    def directions(self) -> tuple[str, ...]:
        """The directions of its maps in words, each once."""
        return tuple(dict.fromkeys(direction_words(each.direction) for each in self.maps))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """That several maps stand together; empty for a single one."""
        names = tuple(each.name for each in self.maps)
        return (Finding.of(FindingKind.OF_ATLAS, names=names),) if len(self.campaigns) > 1 else ()

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Which campaigns have no map, and why."""
        without = [(each.name, each.error) for each in self.campaigns if each.error]
        kind = FindingKind.CAMPAIGN_WITHOUT_MAP
        return tuple(Finding.of(kind, name=name, why=error.message) for name, error in without)

    def carrying(self, bound: Bound) -> Atlas:
        """The same, without the maps that cannot carry a bound; BoundNotAvailable if none can."""
        campaigns, errors = [], []
        for each in self.campaigns:
            try:
                if each.force_map:
                    bound.require(each.force_map)
                campaigns.append(each)
            except BoundNotAvailable as error:
                errors.append(error)
                campaigns.append(replace(each, force_map=None, error=error))
        if errors and not any(each.force_map for each in campaigns):
            raise errors[0]
        return replace(self, campaigns=tuple(campaigns)) if errors else self

    def require_task(self, task: Task) -> None:
        """Raise InputError unless the task is one of this robot: its safety settings, and a direction that has a map.

        A single map must be of the task's contact site and tool, too; of several, `needs` chooses.
        """
        if len(self.campaigns) == 1:
            task.require_same(self.conditions)
            return
        task.require_same(self.conditions, but=("direction", "contact_site", "tool"))
        if not any(self.in_direction(each, task) for each in self.maps):
            raise InputError(
                f"direction: the task states {task.conditions['direction']!r}, the atlas has maps for "
                f"{', '.join(self.directions)}",
                file=task.source or None,
            )

    @staticmethod
    def in_direction(campaign: AtlasMap, task: Task) -> bool:
        """True if a campaign is of the direction that the task states, or the task states none."""
        stated = task.conditions.get("direction")
        if stated is None:
            return True
        return angle_between(campaign.direction, direction_vector(stated, whose="the task")) <= ON_AXIS

    def require_maps(self, task: Task) -> None:
        """Raise InputError unless every contact site, with the tool and payload of its segment, has a map.

        And lies where the task's path is: a table for poses knows no offset.
        """
        if any(any(offset) for offset in task.site_offsets.values()):
            raise InputError(
                "site_offsets_m: a table of places is for the contact site itself, expected no offset; make the "
                "contact site the tool's centre point",
                file=task.source or None,
            )
        there = {each.loaded for each in self.maps}
        for segment in task.segments:
            for need in self.needs(task, segment) if segment.contact else ():
                if need not in there:
                    load = "" if need.payload is None else f", payload {need.payload:g} kg"
                    raise InputError(
                        f"segment {segment.name!r}: no map of contact site {need.contact_site or 'not stated'}, tool "
                        f"{need.tool or 'not stated'}{load}; measure it, or correct the task",
                        file=task.source or None,
                    )

    def needs(self, task: Task, segment: TaskSegment) -> tuple[Loaded, ...]:
        """The contact sites that can hit on a segment, with the tool and payload there; each needs a map.

        What neither segment nor task states is as in the campaigns, if all state the same.

        Raises
        ------
        InputError
            The campaigns differ in what the task does not state.
        """
        site, tool = task.conditions.get("contact_site"), segment.tool or task.conditions.get("tool")
        there = [each.loaded for each in self.campaigns]
        if tool is None:
            tool = self._only("tool", {each.tool for each in there}, segment)
        payload = task.payload if math.isnan(segment.payload) else segment.payload
        payloads = {each.payload for each in there if each.tool == normalised(tool)}
        if math.isnan(payload) and payloads:
            only = self._only("payload_kg", payloads, segment)
            payload = math.nan if only is None else only
        sites = segment.contact_sites or task.contact_sites
        if not sites:  # one that is named says nothing of the others
            only = self._only("contact_sites", {each.contact_site for each in there}, segment)
            sites = (only if site is None else site,)
        return tuple(dict.fromkeys(Loaded.of(each, tool, payload) for each in sites))

    def _only(self, entry: str, values: set[Any], segment: TaskSegment) -> Any:
        if len(values) == 1:
            return next(iter(values))
        listed = ", ".join(sorted("not stated" if value in ("", None) else str(value) for value in values))
        raise InputError(
            f"segment {segment.name!r}: the atlas has campaigns of different {entry} ({listed}); state in the task "
            f"file which of them this segment has ({entry}), of contact sites all that can hit"
        )


_CONFIRMATION = (FindingKind.CONFIRMED_BY, FindingKind.NOT_CONFIRMED, FindingKind.NOT_CONFIRMED_YET)


def told_apart(bases: Sequence[tuple[str, Basis]], atlas: Atlas) -> tuple[Basis, ...]:
    """Bases with the name of their map; a warning that not every map gives, and what confirms them, says which do."""
    if len(atlas.campaigns) == 1:
        return tuple(basis for _, basis in bases)
    names: dict[Finding, list[str]] = {}
    for name, basis in bases:
        for finding in (*basis.warnings, *basis.notes):
            names.setdefault(finding, []).append(name)
    every = len({name for name, _ in bases})

    def told(finding: Finding) -> Finding:
        of = tuple(dict.fromkeys(names[finding]))
        return finding if len(of) == every else Finding.of(FindingKind.OF_MAP, finding, names=of)

    return tuple(
        replace(
            basis,
            warnings=tuple(map(told, basis.warnings)),
            notes=tuple(told(note) if note.kind in _CONFIRMATION else note for note in basis.notes),
        )
        for _, basis in bases
    )


def read_atlas(path: str | Path, *, map_of: Callable[[Path], ForceMap] | None = None) -> Atlas:
    """Read the maps of one robot: a file `atlas.toml`, its folder, or a folder of campaigns.

    `atlas.toml` holds `schema = "forcemap-atlas/1"` and `maps`, a list of campaign folders and map files, from where it
    lies. Without it every folder below with a `campaign.toml` counts. A campaign whose map cannot be fitted has none,
    and its error says why; what it was measured under still counts.

    Parameters
    ----------
    path : str or Path
        The file or folder.
    map_of : callable, optional
        The map of a campaign's folder; if not given, that of its impacts table, whatever has become of its recordings.

    Returns
    -------
    Atlas

    Raises
    ------
    CampaignFileError
        Not TOML, not of this schema, an unknown entry, or a folder without campaigns.
    InputError
        A campaign's conditions or a map file cannot be read, or the campaigns do not fit together (`Atlas`).
    """
    root, names = atlas_names(path)
    return Atlas(tuple(_campaign(root, name, map_of or _map_of_table) for name in names), str(path))


def atlas_names(path: str | Path) -> tuple[Path, list[str]]:
    """The folder of an atlas, and the campaign folders and map files that it names below it; errors as `read_atlas`."""
    root = Path(path)
    if not root.exists():
        raise CampaignFileError("there is no such file or folder", file=str(path))
    file = root / ATLAS_FILE if root.is_dir() else root
    names = _named_maps(file) if file.is_file() else campaign_folders(root)
    if not names:
        raise CampaignFileError(f"found neither {ATLAS_FILE} nor folders with a {CAMPAIGN_FILE} in it", file=str(path))
    return file.parent, names


def is_atlas(path: str | Path) -> bool:
    """True if a path is an atlas: a TOML file, a folder with `atlas.toml`, or one with campaigns and itself none."""
    root = Path(path)
    if not root.is_dir():
        return root.suffix.lower() == ".toml" and root.is_file()
    if (root / ATLAS_FILE).is_file():
        return True
    return not is_campaign(root) and any(map(is_campaign, root.glob("[!.]*")))


def _named_maps(file: Path) -> list[str]:
    try:
        tables = toml_tables(read_bytes(file))
    except InputError as error:
        raise CampaignFileError(error.message, file=str(file)) from None
    if tables.get("schema") != SCHEMA:
        found = tables.get("schema")
        raise CampaignFileError(f"found {found!r}, expected schema = {SCHEMA!r}", file=str(file), column="schema")
    for key in tables.keys() - {"schema", "note", "maps"}:
        raise CampaignFileError("unknown entry, expected schema, note and maps", file=str(file), column=key)
    maps = tables.get("maps")
    if not isinstance(maps, list) or not maps or not all(isinstance(name, str) and name for name in maps):
        message = 'expected a list of campaign folders and map files, such as ["down", "out"]'
        raise CampaignFileError(message, file=str(file), column="maps")
    if len({*maps}) < len(maps):
        raise CampaignFileError("found a campaign twice, expected each once", file=str(file), column="maps")
    return maps


def _map_of_table(folder: Path) -> ForceMap:
    return campaign_map(folder, read_dataset(folder))


def _campaign(folder: Path, name: str, map_of: Callable[[Path], ForceMap]) -> AtlasMap:
    """The campaign of a folder or map file; what it states must be readable, its map need not be there."""
    root = folder / name
    if not root.is_dir():
        force_map = read_map(root)
        return AtlasMap(name, force_map.conditions, force_map)
    conditions = read_conditions(root / CAMPAIGN_FILE)
    try:
        force_map = map_of(root)
    except ForcemapError as error:
        return AtlasMap(name, conditions, None, error, root)
    return AtlasMap(name, force_map.conditions, force_map, folder=root)


def _recordings(folder: Path) -> dict[str, str]:
    """The recordings that a campaign uses, and their names, by the hash of their files; none without a register."""
    register = folder / REGISTER_FILE
    entries = read_register(register) if register.exists() else ()
    return {entry.sha256: entry.name for entry in entries if entry.use is Use.USED}


def _comparable(value: Any) -> Any:
    """A stated value as it is compared: texts however they are written, NaN as None."""
    if isinstance(value, str):
        return normalised(value)
    return None if isinstance(value, float) and np.isnan(value) else value
