"""The safe speeds of several maps at one place: what `speed` answers of an atlas."""

from __future__ import annotations

from typing import Any, Self

from forcemap.answers.answer import AllSaid, Answer, AtPlace, Bound, Figure
from forcemap.answers.speed import SpeedAnswer
from forcemap.maps.map_file import map_sha256
from forcemap.paths.atlas import Atlas, AtlasMap
from forcemap.words import by_map, of_maps, sentences


class AtlasMapAnswer(Answer):
    """A map that speeds rest on, and what it holds for."""

    name: str
    direction: str
    contact_site: str
    tool: str
    payload_kg: Figure
    map_sha256: str

    @classmethod
    def of_map(cls, campaign: AtlasMap) -> Self:
        """The answer for a campaign with a map."""
        assert campaign.force_map is not None
        conditions = campaign.conditions
        return cls(
            name=campaign.name,
            direction=conditions.direction,
            contact_site=conditions.contact_site,
            tool=conditions.tool,
            payload_kg=campaign.loaded.payload,
            map_sha256=map_sha256(campaign.force_map),
        )


class MapSpeed(Answer):
    """A map, and the safe speed that it gives."""

    map: AtlasMapAnswer
    speed: SpeedAnswer


class AtlasSpeedAnswer(AtPlace):
    """Safe speeds of all maps at a place.

    `speed_to_program_mps` is the lowest, whatever direction, contact site, tool and payload of the atlas; null if a map
    gives none there, or a campaign has no map. A warning that not every map gives begins with the names of those that
    give it; `assumptions_by_map` has the assumptions by the names of their maps, those of all maps by no name.
    """

    speed_to_program_mps: Figure
    governed_by: str
    without_map: list[str]
    simulated: bool
    warnings: AllSaid
    assumptions: AllSaid
    assumptions_by_map: dict[str, AllSaid]
    bound: Bound
    maps: list[MapSpeed]
    map_sha256: str

    @classmethod
    def of_place(cls, atlas: Atlas, place: tuple[float, float], **case: Any) -> Self:
        """The answer for a place, distance and height [m]; `case` are the other arguments of `safe_speed`."""
        atlas = atlas.carrying(case["bound"])
        maps = []
        for campaign, force_map in zip(atlas.maps, atlas.force_maps, strict=True):
            answer = SpeedAnswer.of_place(force_map, place, None, **case)
            maps.append(MapSpeed(map=AtlasMapAnswer.of_map(campaign), speed=answer))
        lowest = min(maps, key=lambda each: each.speed.speed_to_program_mps or 0.0)
        assumed = [(each.map.name, [str(line) for line in each.speed.assumptions]) for each in maps]
        of_all = sentences(atlas.findings)
        without = [each.name for each in atlas.campaigns if each.force_map is None]
        return cls(
            distance_m=place[0],
            height_m=place[1],
            speed_to_program_mps=None if without else lowest.speed.speed_to_program_mps,
            governed_by=without[0] if without else lowest.map.name,
            without_map=without,
            simulated=atlas.simulated,
            warnings=[*sentences(atlas.warnings), *of_maps((each.map.name, each.speed.warnings) for each in maps)],
            assumptions=[*of_all, *dict.fromkeys(line for _, lines in assumed for line in lines)],
            assumptions_by_map=by_map((name, [*of_all, *lines]) for name, lines in assumed),
            bound=case["bound"],
            maps=maps,
            map_sha256=atlas.sha256,
        )
