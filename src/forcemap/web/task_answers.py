"""A task in the plane of distance and height: a point, or a path with its allowed speeds and cycle times."""

from __future__ import annotations

import numpy as np

from forcemap import Zones, zone_speeds
from forcemap.answers.answer import Answer, Figure, Said
from forcemap.answers.basis import RestsOn, rests_on
from forcemap.answers.path import PathAnswer
from forcemap.answers.speed import SpeedAnswer
from forcemap.web.campaign_map import CampaignMap
from forcemap.web.question import PathQuestion


class Stop(Answer):
    """A task of one point: the speed to program there, overshoot subtracted, anywhere within the position tolerance."""

    outcome: str
    reason: Said
    speed_mps: Figure
    contact_speed_mps: Figure
    programmed_speed_mps: Figure
    too_fast: bool


class TaskAnswer(RestsOn):
    """A task: its points without the allowances of a task, and what one of them, or the path through more, allows."""

    points: list[SpeedAnswer]
    point: Stop | None
    path: PathAnswer | None


def task_answer(campaign_map: CampaignMap, question: PathQuestion) -> TaskAnswer:
    """A task of one point, or of a path through points."""
    force_map = campaign_map.fitted.force_map
    points = [campaign_map.speed_at(question, place) for place in question.places]
    if len(points) > 1:
        path = campaign_map.path(question)
        of_path = {"bound": question.bound_of(force_map), "assumptions": path.assumptions}
        return TaskAnswer.from_result(points[0], points=points, point=None, path=path, **of_path)
    allowance, (distance, height) = question.allowance, np.array(question.places).T
    around = Zones(distance, distance, height, height).grown(allowance.position)
    zone, programmed = zone_speeds(force_map, around, **campaign_map.case(question)), question.programmed_mps
    speed = float(zone.speed_to_program[0])
    stop = Stop(
        outcome=zone.to_program_outcome[0],
        reason=zone.to_program_reason[0],
        speed_mps=speed,
        contact_speed_mps=zone.speed[0],
        programmed_speed_mps=programmed,
        too_fast=programmed is not None and not programmed <= speed,
    )
    compared = "not stated, so none is compared with the allowed one" if programmed is None else f"{programmed:g} m/s"
    basis = rests_on(force_map, zone.basis, campaign_map.limits.statements)
    basis["assumptions"] = [*basis["assumptions"], allowance.of_position, f"programmed speed: {compared}"]
    return TaskAnswer(points=points, point=stop, path=None, **basis)
