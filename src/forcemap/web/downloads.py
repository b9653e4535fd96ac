"""What can be taken away: the map, tables for robot programs, the report."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

from pydantic import Field

import forcemap as fm
from forcemap.exports.krl import krl_data, krl_source
from forcemap.exports.robot_table import Provenance, RobotTable
from forcemap.exports.safety_proposal import safety_proposal
from forcemap.exports.scaling import scaling_csv
from forcemap.exports.urscript import urscript
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.findings import in_words
from forcemap.web.campaign_map import CampaignMap
from forcemap.web.limits import Limits, limits_of
from forcemap.web.question import Bounded, ComparisonQuestion, PathQuestion, ZoneSize
from forcemap.words import sentence


class Format(StrEnum):
    """The forms in which allowed speeds are taken away."""

    CSV = "csv"
    JSON = "json"
    URSCRIPT = "urscript"
    KRL_DATA = "krl-data"
    KRL_SOURCE = "krl-source"
    SAFETY = "safety"

    @property
    def file(self) -> str:
        """The name of its file."""
        return _FILES[self][0]


def _json(table: RobotTable) -> str:
    return json.dumps({"made": "made by forcemap"} | zones_result(table), indent=1, ensure_ascii=False) + "\n"


_FILES: dict[Format, tuple[str, Callable[[RobotTable], str]]] = {
    Format.CSV: ("speeds.csv", zones_csv),
    Format.JSON: ("speeds.json", _json),
    Format.URSCRIPT: ("speeds.script", urscript),
    Format.KRL_DATA: ("FORCEMAP.DAT", krl_data),
    Format.KRL_SOURCE: ("FORCEMAP.SRC", krl_source),
    Format.SAFETY: ("safety.md", safety_proposal),
}


class Export(ZoneSize):
    """Allowed speeds to take away, in one of their forms."""

    format: Format = Field(Format.CSV, description="Form of the file.")


def export_text(campaign_map: CampaignMap, question: Export) -> str:
    """The allowed speeds as a file of that form.

    Raises
    ------
    ContactNotPermitted
        The standard permits no contact with the body area.
    """
    return _FILES[question.format][1](_zones(campaign_map, question))


def scaling_text(campaign_map: CampaignMap, question: PathQuestion) -> str:
    """Speeds to command along a path, with factors where a speed is programmed, as CSV."""
    speeds = campaign_map.speeds_along(question)
    zones = _zones(campaign_map, ZoneSize(**question.model_dump(include=set(ZoneSize.model_fields))))
    return scaling_csv(speeds, _with_statements(zones.provenance.of_path(speeds), campaign_map.limits))


def report_text(campaign: Path, question: Bounded, table: fm.LimitTable | None) -> str:
    """The validation report of a campaign for one body area.

    Raises
    ------
    MissingExtra
        What draws its figures is not installed.
    """
    from forcemap.report import report_html

    return report_html(_assessment(campaign, question, table))


def _assessment(campaign: Path, question: Bounded, table: fm.LimitTable | None) -> fm.CampaignAssessment:
    limits, stated = limits_of(campaign, table), campaign / "campaign.toml"
    conditions = fm.read_conditions(stated) if stated.exists() else fm.Conditions()
    assessment = fm.assess_campaign(
        campaign,
        limits=[limits.of(question.area)],
        bound=question.stated_bound(conditions.device.error_or_default),
        allowance=question.allowance,
    )
    return replace(assessment, findings=(*map(in_words, limits.statements), *assessment.findings))


def report_zip(campaign: Path, question: Bounded, table: fm.LimitTable | None) -> bytes:
    """The same report and the list of its inputs, report.html and report.sha256, as a zip; errors as `report_text`."""
    assessment, packed = _assessment(campaign, question, table), io.BytesIO()
    from forcemap.report import LIST_ENDING, inputs_list, report_html

    parts = {"report.html": report_html(assessment), f"report{LIST_ENDING}": inputs_list(assessment.inputs)}
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def comparison_svg(campaign_map: CampaignMap, question: ComparisonQuestion) -> str:
    """The comparison of force models as a figure."""
    from forcemap.figures import model_comparison_figure, svg

    fitted, model = campaign_map.fitted, campaign_map.contact_model(question).figures
    comparison = fm.compare_force_models(fitted.dataset, **model)
    return svg(model_comparison_figure(comparison, fitted.dataset, fitted.force_map, **model))


def _zones(campaign_map: CampaignMap, question: ZoneSize) -> RobotTable:
    limit, force_map = campaign_map.limits.of(question.area), campaign_map.fitted.force_map
    limit.require_permitted()
    limits, bound = [(limit, question.contact)], question.bound_of(force_map)
    table = fm.robot_table(force_map, limits=limits, bound=bound, size=question.zone_m, allowance=question.allowance)
    if table.refusal:  # a program of zeros would only cover an earlier one
        raise fm.NotReleasable(f"nothing is exported: {sentence(table.refusal)}")
    return replace(table, provenance=_with_statements(table.provenance, campaign_map.limits))


def _with_statements(provenance: Provenance, limits: Limits) -> Provenance:
    return replace(provenance, notes=(*map(in_words, limits.statements), *provenance.notes))
