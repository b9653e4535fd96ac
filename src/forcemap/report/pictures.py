"""The figures of a report, as they stand in the page."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import TypeVar

from markupsafe import Markup, escape
from matplotlib.figure import Figure

from forcemap.assessment.campaign_assessment import CampaignAssessment
from forcemap.assessment.contact_model import ContactModel
from forcemap.assessment.missing import Missing
from forcemap.assessment.place_speeds import PlaceSpeeds
from forcemap.comparisons.force_models import Comparison
from forcemap.errors import ForcemapError
from forcemap.figures import (
    force_evolution_figure,
    force_profiles_figure,
    measurement_grid_figure,
    model_comparison_figure,
    png,
    repeatability_figure,
    residuals_figure,
    safe_speed_figure,
    svg,
    workspace_figure,
)

_LARGEST_SVG = 250_000  # characters; above, a PNG picture is smaller
_DPI = 150

Part = TypeVar("Part")


class Pictures:
    """Draws the figures of an assessment; one that cannot be drawn is a line that says why."""

    def __init__(self, assessment: CampaignAssessment) -> None:
        self._assessment = assessment
        self._drawn = 0

    def grid(self) -> Markup:
        """Places and states."""
        a = self._assessment
        return self._picture("measured places and states", lambda: measurement_grid_figure(_there(a.dataset)))

    def scatter(self) -> Markup:
        """Repeatability."""
        a = self._assessment
        return self._picture(
            "repeatability of every state", lambda: repeatability_figure(_there(a.repeatability), _there(a.dataset))
        )

    def profiles(self) -> Markup:
        """The map along distance, height and speed."""
        a = self._assessment
        bound = None if isinstance(a.bound, Missing) else a.bound
        return self._picture(
            "force against distance, height and speed",
            lambda: force_profiles_figure(_there(a.force_map), _there(a.dataset), bound=bound),
        )

    def workspace(self) -> Markup:
        """The map in the workspace."""
        a = self._assessment
        return self._picture(
            "predicted force over the workspace", lambda: workspace_figure(_there(a.force_map), _there(a.dataset))
        )

    def residuals(self) -> Markup:
        """What the map misses."""
        a = self._assessment
        return self._picture("residuals of the map", lambda: residuals_figure(_there(a.force_map), _there(a.dataset)))

    def gravest(self) -> Markup:
        """The impact that takes the largest share of its limit."""
        a = self._assessment
        judged = _there(a.recordings)
        if judged.gravest is None:
            return Markup("")
        impact = judged.gravest.impact
        return self._picture(
            "force over time of the gravest impact",
            lambda: force_evolution_figure(impact.recording, impact, judged.gravest_limit, conditions=a.conditions),
        )

    def speeds(self, found: PlaceSpeeds) -> Markup:
        """A speed map."""
        return self._picture(
            f"safe speeds for {found.limit.name}, {found.contact} contact",
            lambda: safe_speed_figure(_there(found.speeds)),
        )

    def comparison(self, found: Comparison, model: ContactModel) -> Markup:
        """The map beside the 2D map and the standard."""
        a = self._assessment
        maps_2d = () if isinstance(a.map_2d, Missing) else (a.map_2d,)
        return self._picture(
            "the map beside the 2D map and the standard's contact model",
            lambda: model_comparison_figure(
                found,
                _there(a.dataset),
                _there(a.force_map),
                maps_2d=maps_2d,
                robot_mass=model.robot_mass,
                body_mass=model.body_mass,
                stiffness=model.stiffness,
            ),
        )

    def _picture(self, what: str, draw: Callable[[], Figure]) -> Markup:
        self._drawn += 1
        try:
            figure = draw()
            drawing = svg(figure, f"figure-{self._drawn}")
            if len(drawing) > _LARGEST_SVG:
                picture = base64.b64encode(png(figure, _DPI)).decode()
                if len(picture) < len(drawing):
                    drawing = f'<img alt="{escape(what)}" src="data:image/png;base64,{picture}">'
        except ForcemapError as error:
            return Markup('<p class="missing">No picture of {}: {}</p>').format(what, error.message)
        return Markup('<figure class="picture">{}<figcaption>{}</figcaption></figure>').format(
            Markup(drawing), f"Figure {self._drawn}: {what}"
        )


def _there(part: Part | Missing) -> Part:
    """The part, which the template has found to be there."""
    assert not isinstance(part, Missing)
    return part
