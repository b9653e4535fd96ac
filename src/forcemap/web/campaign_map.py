"""A campaign's map and its answers: the same objects as the commands print with --json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import forcemap as fm
from forcemap.answers.comparison import Body, ComparisonAnswer
from forcemap.answers.evaluate import EvaluateAnswer
from forcemap.answers.map import FitAnswer
from forcemap.answers.path import PathAnswer
from forcemap.answers.speed import SpeedAnswer
from forcemap.answers.speed_map import SpeedMapAnswer
from forcemap.comparisons.contact_model import ContactModel, contact_model
from forcemap.web.fitted_campaign import FittedCampaign
from forcemap.web.limits import Limits
from forcemap.web.question import ComparisonQuestion, PathQuestion, Place, Question, Steps

LONGEST_PATH = 20.0
"""The longest path that is taken [m]; a choice: no task in the reach of one robot needs more (docs/decisions.md)."""


@dataclass(frozen=True)
class CampaignMap:
    """A campaign's map and limits, which answer questions.

    Parameters
    ----------
    fitted : FittedCampaign
    limits : Limits
    """

    fitted: FittedCampaign
    limits: Limits

    def fit(self) -> FitAnswer:
        """The map, as `forcemap fit --json`."""
        return FitAnswer.of_fit(self.fitted.dataset, self.fitted.force_map, self.fitted.accuracy)

    def evaluate(self) -> EvaluateAnswer:
        """Its accuracy, as `forcemap evaluate --json`."""
        return EvaluateAnswer.of_map(self.fitted.force_map, self.fitted.dataset, self.fitted.accuracy)

    def speed(self, question: Place) -> SpeedAnswer:
        """The safe speed at the place of a question, as `forcemap speed --json`."""
        return self.speed_at(question, (question.distance_m, question.height_m))

    def speed_at(self, question: Question, place: tuple[float, float]) -> SpeedAnswer:
        """The safe speed at a place: distance and height [m]."""
        fitted, notes = self.fitted, self.limits.statements
        return SpeedAnswer.of_place(fitted.force_map, place, fitted.accuracy[0], notes, **self.case(question))

    def speed_map(self, question: Steps) -> SpeedMapAnswer:
        """Safe speeds on a grid, as `forcemap speed-map --json`."""
        force_map = self.fitted.force_map
        speeds = fm.speed_map(force_map, *fm.measured_grid(force_map, question.step_m), **self.case(question))
        return SpeedMapAnswer.of_speeds(force_map, speeds, self.fitted.accuracy[0], self.limits.statements)

    def case(self, question: Question) -> dict[str, Any]:
        """The limit, contact, bound and allowance that are asked for, by the names of the library."""
        bound, limit = question.bound_of(self.fitted.force_map), self.limits.of(question.area)
        return {"limit": limit, "contact": question.contact, "bound": bound, "allowance": question.allowance}

    def compare(self, question: ComparisonQuestion) -> ComparisonAnswer:
        """The map beside the 2D map and the standard's contact model, as `forcemap compare --json`."""
        limit, dataset = self.limits.of(question.area), self.fitted.dataset
        usable = limit if limit.permitted else None
        comparison = fm.compare_force_models(
            dataset, **self.contact_model(question).figures, limit=usable, force_map=self.fitted.force_map
        )
        notes = self.limits.statements
        return ComparisonAnswer.of_comparison(comparison, limit, simulated=dataset.simulated, notes=notes)

    def contact_model(self, question: ComparisonQuestion) -> ContactModel:
        """Masses and spring constant of the standard's contact model.

        Raises
        ------
        InputError
            The moving mass is neither given nor stated by the campaign.
        """
        return contact_model(
            self.fitted.dataset.conditions,
            self.limits.area(question.area),
            moving_mass=question.moving_mass_kg,
            payload=question.payload_kg,
            constrained=question.body is Body.CONSTRAINED,
        )

    def path(self, question: PathQuestion) -> PathAnswer:
        """Allowed speeds along a path, as `forcemap path --json`."""
        bound = question.bound_of(self.fitted.force_map)
        return PathAnswer.of_path(self.speeds_along(question), bound, self.limits.statements)

    def speeds_along(self, question: PathQuestion) -> fm.PathSpeeds:
        """The library's answer for a path that runs straight out from the base.

        Raises
        ------
        InputError
            The path is longer than any task needs, or has no length.
        """
        path = fm.ToolPath.through([(d, 0.0, h) for d, h in question.places])
        length = float(path.lengths.sum())
        if length > LONGEST_PATH:
            expected = f"expected at most {LONGEST_PATH:g} m; ask in parts"
            raise fm.InputError(f"points: found a path of {length:.1f} m, {expected}")
        segment = fm.TaskSegment("path", (self.limits.area(question.area),), question.contact, question.programmed)
        return fm.path_speeds(
            self.fitted.force_map,
            path,
            fm.Task((segment,), question.acceleration_mps2),
            bound=question.bound_of(self.fitted.force_map),
            allowance=question.allowance,
            table=self.limits.table,
        )
