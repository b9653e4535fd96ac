"""The campaigns of a folder together, if they are of one robot: what a path through space is allowed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from pydantic import Field

import forcemap as fm
from forcemap.answers.answer import Answer
from forcemap.answers.atlas import AtlasMapAnswer
from forcemap.answers.path import PathAnswer
from forcemap.campaigns.campaign import campaign_folders
from forcemap.paths.atlas import ATLAS_FILE, Atlas, AtlasMap
from forcemap.paths.task import MOST_ACCELERATION
from forcemap.web.campaign_map import LONGEST_PATH
from forcemap.web.fitted_campaign import fitted_campaign
from forcemap.web.limits import Limits, limits_of
from forcemap.web.question import Allowing, MetresPerSecond
from forcemap.web.request_error import RequestError
from forcemap.web.site import Site
from forcemap.words import sentences

_NUMBER = r"-?[0-9]{1,2}(\.[0-9]{1,6})?"
_POINT = f"{_NUMBER},{_NUMBER},{_NUMBER}"


class WayQuestion(Allowing):
    """A question about a path through space, in the frame of the base, and what can hit on it."""

    points: str = Field(
        description="x, y and z of each point [m]: 0.7,0,0.4;0.7,0,0.3",
        pattern=f"^{_POINT}(;{_POINT}){{1,49}}$",
        examples=["0.7,0,0.4;0.7,0,0.3"],
    )
    contact_sites: str = Field("", max_length=400, description="All contact sites that can hit, between semicolons.")
    tool: str = Field("", max_length=200, description="The tool, if the campaigns have several.")
    payload_kg: float | None = Field(None, ge=0, le=10_000, allow_inf_nan=False, description="Payload, likewise.")
    programmed_mps: MetresPerSecond | None = Field(None, description="Programmed speed, if any.")
    acceleration_mps2: float = Field(
        fm.Task.acceleration, gt=0, le=MOST_ACCELERATION, allow_inf_nan=False, description="Along the path."
    )

    @property
    def path(self) -> fm.ToolPath:
        """The path.

        Raises
        ------
        InputError
            It has no length between two points, or is longer than any task needs.
        """
        path = fm.ToolPath.through([[float(x) for x in point.split(",")] for point in self.points.split(";")])
        length = float(path.lengths.sum())
        if length > LONGEST_PATH:
            expected = f"expected at most {LONGEST_PATH:g} m; ask in parts"
            raise fm.InputError(f"points: found a path of {length:.1f} m, {expected}")
        return path

    def task(self, area: str) -> fm.Task:
        """The task: one segment with everything that can hit on it, and the body area that it can hit."""
        sites = tuple(site.strip() for site in self.contact_sites.split(";") if site.strip())
        speed = math.nan if self.programmed_mps is None else self.programmed_mps
        payload = math.nan if self.payload_kg is None else self.payload_kg
        segment = fm.TaskSegment("path", (area,), self.contact, speed, sites, self.tool.strip(), payload)
        return fm.Task((segment,), self.acceleration_mps2)


class TogetherAnswer(Answer):
    """The maps of a folder together; `without_map` says which campaigns have none, and why."""

    simulated: bool
    without_map: list[str]
    maps: list[AtlasMapAnswer]
    map_sha256: str


def together(site: Site) -> tuple[Atlas, Limits]:
    """The maps of the folder's campaigns, and the table of limits that they share.

    Raises
    ------
    RequestError
        They are of different robots, directions that are not known, or tables of limits.
    """
    if not site.folder.single and ((root := site.folder.root) / ATLAS_FILE).exists():
        raise RequestError(409, "not_together", f"{ATLAS_FILE} may name more than this page serves; ask forcemap path")
    try:
        _ = [] if site.folder.single else campaign_folders(root)
    except fm.InputError as error:
        raise RequestError(409, "not_together", error.message) from None
    found, tables, areas = [], {}, set[str]()
    for name, folder in site.folder.campaigns().items():
        try:
            fitted = fitted_campaign(site.folder.campaign(name))
            campaign = AtlasMap(name, fitted.force_map.conditions, fitted.force_map, folder=folder)
        except fm.ForcemapError as error:
            stated = folder / "campaign.toml"
            conditions = fm.read_conditions(stated) if stated.exists() else fm.Conditions()
            campaign = AtlasMap(name, conditions, None, error, folder)
        found.append(campaign)
        limits = limits_of(folder, site.table)
        limits.required()
        tables[limits.used.sha256] = limits
        areas |= {*limits.areas}
    if len(tables) > 1:
        message = "the campaigns name different tables of limits; start with --limit-table"
        raise RequestError(409, "not_together", message)
    try:
        atlas = Atlas(tuple(found))
    except fm.InputError as error:
        raise RequestError(409, "not_together", f"these campaigns make no atlas: {error.message}") from None
    own = tuple(areas) if len(areas) == 1 else ()  # of several none is the first
    return atlas, replace(next(iter(tables.values()), Limits(site.table)), areas=own)


def together_answer(atlas: Atlas) -> TogetherAnswer:
    """Which maps stand together."""
    return TogetherAnswer(
        simulated=atlas.simulated,
        without_map=sentences(atlas.warnings),
        maps=[AtlasMapAnswer.of_map(each) for each in atlas.maps],
        map_sha256=atlas.sha256,
    )


def by_map(
    atlas: Atlas, limits: Limits, question: WayQuestion, answer: PathAnswer
) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """What a path rests on: what does not depend on the map, then by the name of each map what it alone says."""
    own: list[tuple[str, list[str]]] = []
    for campaign, force_map in zip(atlas.maps, atlas.force_maps, strict=True):
        bound = question.stated_bound(force_map.conditions.device.error_or_default)
        case: dict[str, Any] = {"bound": bound, "contact": question.contact, "limit": limits.of(question.area)}
        place = (force_map.measured_range.lowest + force_map.measured_range.highest)[:2] / 2
        basis = fm.safe_speed(force_map, *place.tolist(), **case, allowance=question.allowance).basis
        own.append((campaign.name, sentences(basis.statements)))
    shared = [line for line in answer.assumptions if all(line in lines for _, lines in own)]
    of_one = {line for _, lines in own for line in lines} - {*shared}
    common = [line for line in answer.assumptions if line not in of_one]
    stated = {*answer.assumptions}
    return common, [(name, [line for line in lines if line in of_one and line in stated]) for name, lines in own]


def way_answer(atlas: Atlas, limits: Limits, question: WayQuestion) -> PathAnswer:
    """What a path through space is allowed, as `forcemap path --json`."""
    error = max(force_map.conditions.device.error_or_default for force_map in atlas.force_maps)
    bound = question.stated_bound(error)
    case: dict[str, Any] = {"bound": bound, "allowance": question.allowance, "table": limits.required()}
    speeds = fm.path_speeds(atlas, question.path, question.task(limits.area(question.area)), **case)
    return PathAnswer.of_path(speeds, bound, limits.statements)
