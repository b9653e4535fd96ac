"""The figures of a report, as its page shows them."""

from __future__ import annotations

import base64
from collections.abc import Callable

from markupsafe import Markup, escape
from matplotlib.figure import Figure

import forcemap.figures as figures
from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.missing import Missing, present
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.comparisons.contact_model import ContactModel
from forcemap.comparisons.force_models import Comparison
from forcemap.errors import ForcemapError
from forcemap.figures.canvas import settings

_LARGEST_SVG = 250_000  # characters; above, a PNG picture is taken if it is smaller: a choice


class Pictures:
    """Draws the figures of an assessment; one that cannot be drawn is a line that says why."""

    def __init__(self, assessment: CampaignAssessment) -> None:
        self._assessment = assessment
        self._drawn = 0

    def grid(self) -> Markup:
        """Places and states."""
        what = "measured places and states"
        return self._picture(what, lambda a: figures.measurement_grid_figure(present(a.dataset)))

    def scatter(self) -> Markup:
        """Repeatability."""
        what = "repeatability of every state"
        return self._picture(what, lambda a: figures.repeatability_figure(present(a.repeatability), present(a.dataset)))

    def profiles(self) -> Markup:
        """The map along distance, height and speed."""
        bound = None if isinstance(self._assessment.bound, Missing) else self._assessment.bound
        return self._picture(
            "force against distance, height and speed",
            lambda a: figures.force_profiles_figure(present(a.force_map), present(a.dataset), bound=bound),
        )

    def workspace(self) -> Markup:
        """The map in the workspace."""
        what = "predicted force over the workspace"
        return self._picture(what, lambda a: figures.workspace_figure(present(a.force_map), present(a.dataset)))

    def residuals(self) -> Markup:
        """Residuals of the map."""
        what = "residuals of the map"
        plan = None if isinstance(self._assessment.campaign, Missing) else self._assessment.campaign.plan
        return self._picture(
            what, lambda a: figures.residuals_figure(present(a.force_map), present(a.dataset), plan=plan)
        )

    def gravest(self) -> Markup:
        """The impact that takes the largest share of its limit."""
        judged = present(self._assessment.recordings)
        if judged.gravest is None:
            return Markup("")
        shown = judged.gravest.impact.recording, judged.gravest.impact, judged.gravest_limit
        return self._picture(
            "force over time of the gravest impact",
            lambda a: figures.force_evolution_figure(*shown, conditions=a.conditions),
        )

    def speeds(self, results: PlaceSpeeds) -> Markup:
        """A speed map."""
        what = f"safe speeds for {results.limit.name}, {results.contact} contact"
        return self._picture(
            what, lambda _: figures.safe_speed_figure(present(results.speeds), standard=results.standard_speed)
        )

    def to_measure(self, results: PlaceSpeeds) -> Markup:
        """Places without permission, and what to measure next."""
        following = None if isinstance(results.measure_next, Missing) else results.measure_next.plan
        what = f"places to measure for {results.limit.name}, {results.contact} contact"
        return self._picture(what, lambda _: figures.places_to_measure_figure(present(results.speeds), following))

    def comparison(self, comparison: Comparison, model: ContactModel) -> Markup:
        """The map beside the 2D map and the standard."""
        return self._picture(
            "the map beside the 2D map and the standard's contact model",
            lambda a: figures.model_comparison_figure(
                comparison,
                present(a.dataset),
                present(a.force_map),
                maps_2d=() if isinstance(a.map_2d, Missing) else (a.map_2d,),
                **model.figures,
            ),
        )

    def _drawing(self, what: str, figure: Figure) -> str:
        drawing = figures.svg(figure, f"figure-{self._drawn}")
        if len(drawing) > _LARGEST_SVG:
            picture = base64.b64encode(figures.png(figure)).decode()
            if len(picture) < len(drawing):
                return f'<img alt="{escape(what)}" src="data:image/png;base64,{picture}">'
        return drawing

    def _picture(self, what: str, draw: Callable[[CampaignAssessment], Figure]) -> Markup:
        self._drawn += 1
        try:
            with settings():
                drawing = self._drawing(what, draw(self._assessment))
        except ForcemapError as error:
            return Markup('<p class="missing">No picture of {}: {}</p>').format(what, error.message)
        return Markup('<figure class="picture">{}<figcaption>{}</figcaption></figure>').format(
            Markup(drawing), f"Figure {self._drawn}: {what}"
        )
