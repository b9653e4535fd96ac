"""The report of several maps of one robot: what each of them confirms, in one table."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping
from typing import Any

from markupsafe import Markup

from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.folder import inputs_sha256
from forcemap.assessment.missing import Missing
from forcemap.files import stated_date
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import map_sha256
from forcemap.paths.atlas import Atlas, AtlasMap
from forcemap.report.atlas_verification import campaigns_meta, report_digest
from forcemap.report.document import environment
from forcemap.report.permission import headline, point_permission
from forcemap.report.seal import MadeFor, seal, seal_tag
from forcemap.words import of_maps, sentences


def atlas_html(
    atlas: Atlas,
    assessments: Mapping[str, CampaignAssessment],
    reports: Mapping[str, str],
    *,
    software: str,
    date: str | None = None,
) -> str:
    """The report of an atlas as one HTML page: no script, nothing fetched.

    Parameters
    ----------
    atlas : Atlas
        The maps.
    assessments : mapping of str to CampaignAssessment
        Of its campaigns, by their names; a map file has none.
    reports : mapping of str to str
        Addresses of their reports, by the same names.
    software : str
        Software that made it.
    date : str, optional
        Date of the report, YYYY-MM-DD; today if not given.

    Raises
    ------
    InputError
        The date is no valid one.
    """
    rows, assessed = [], list(assessments.items())
    for campaign in atlas.campaigns:
        assessment = assessments.get(campaign.name)
        why = campaign.error.message if campaign.error else "a map file: see the report of its campaign"
        speeds = [] if assessment is None or campaign.force_map is None else assessment.speeds
        lines = [headline(results) for results in speeds]
        rows.append({"campaign": campaign, "headlines": lines, "why": why, "report": reports.get(campaign.name, "")})
    return seal(
        environment()
        .get_template("atlas.html")
        .render(
            seal_tag=Markup(seal_tag()),
            campaigns=campaigns_meta({each.name: _rests_on(each, assessments) for each in atlas.campaigns}),
            atlas=atlas,
            c=atlas.conditions,
            rows=rows,
            points=_points(assessed, reports),
            without_points=[name for name, each in assessed if isinstance(each.points, Missing)],
            warnings=[
                *sentences(atlas.warnings),
                *of_maps((name, sentences(each.findings)) for name, each in assessed),
            ],
            bounds=of_maps((name, [str(each.bound)]) for name, each in assessed if not isinstance(each.bound, Missing)),
            pressure_assessed=all(each.pressure_assessed for _, each in assessed),
            any_pressure=any(each.pressure_assessed for _, each in assessed),
            software=software,
            date=(datetime.date.today() if date is None else stated_date("date", date)).isoformat(),
            ranges=[_range_words(force_map) for force_map in atlas.force_maps],
            hashes=[map_sha256(force_map) for force_map in atlas.force_maps],
        )
    )


def _rests_on(campaign: AtlasMap, assessments: Mapping[str, CampaignAssessment]) -> str:
    """The digest of a campaign's report, or of a map file the map's; empty without a map."""
    if assessment := assessments.get(campaign.name):
        return report_digest(inputs_sha256(assessment.inputs), MadeFor.of(assessment))
    return map_sha256(campaign.force_map) if campaign.force_map else ""


def _points(assessed: Iterable[tuple[str, CampaignAssessment]], reports: Mapping[str, str]) -> list[dict[str, Any]]:
    """Every contact point of every campaign, with the sentence that permits it and its campaign's report."""
    return [
        {
            "result": result,
            "campaign": name,
            "permission": point_permission(result, each.conditions, each.protocol),
            "report": reports.get(name, ""),
        }
        for name, each in assessed
        if not isinstance(each.points, Missing)
        for result in each.points
    ]


def _range_words(force_map: ForceMap) -> str:
    low, high = force_map.measured_range.lowest.tolist(), force_map.measured_range.highest.tolist()
    d, h, v = (f"{a:.3f} to {b:.3f}" for a, b in zip(low, high, strict=True))
    return f"distance {d} m, height {h} m, {v} m/s"
