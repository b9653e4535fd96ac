"""What can be taken away: the map, tables for robot programs, the report."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

from pydantic import Field

from forcemap import (
    Allowance,
    FixedMargin,
    RobotTable,
    ToleranceBound,
    assess_campaign,
    compare_force_models,
    krl_data,
    krl_source,
    read_conditions,
    robot_table,
    safety_proposal,
    scaling_csv,
    urscript,
    zones_csv,
    zones_result,
)
from forcemap.web.comparison_answers import ComparisonQuestion, contact_model
from forcemap.web.held import Fitted
from forcemap.web.limits import Limits
from forcemap.web.path_answers import speeds_along
from forcemap.web.question import Bounded, BoundKind, PathQuestion, ZoneSize


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
        return _FILES[self]


_FILES = {
    Format.CSV: "speeds.csv",
    Format.JSON: "speeds.json",
    Format.URSCRIPT: "speeds.script",
    Format.KRL_DATA: "FORCEMAP.DAT",
    Format.KRL_SOURCE: "FORCEMAP.SRC",
    Format.SAFETY: "safety.md",
}


def _json(table: RobotTable) -> str:
    return json.dumps({"made": "made by forcemap"} | zones_result(table), indent=1, ensure_ascii=False) + "\n"


_WRITERS: dict[Format, Callable[[RobotTable], str]] = {
    Format.CSV: zones_csv,
    Format.JSON: _json,
    Format.URSCRIPT: urscript,
    Format.KRL_DATA: krl_data,
    Format.KRL_SOURCE: krl_source,
    Format.SAFETY: safety_proposal,
}


class Export(ZoneSize):
    """Allowed speeds to take away, in one of their forms."""

    format: Format = Field(Format.CSV, description="Form of the file.")


def export_text(found: Fitted, question: Export, limits: Limits) -> str:
    """The allowed speeds as a file of that form.

    Raises
    ------
    ContactNotPermitted
        The standard permits no contact with the body area.
    """
    return _WRITERS[question.format](_zones(found, question, limits))


def scaling_text(found: Fitted, question: PathQuestion, limits: Limits) -> str:
    """Speed-scaling factors along a path with a programmed speed, as CSV."""
    speeds = speeds_along(found, question, limits)
    zones = _zones(found, ZoneSize(**question.model_dump(include=set(ZoneSize.model_fields))), limits)
    return scaling_csv(speeds, zones.provenance.with_statements((*limits.statements, *speeds.statements)))


def report_text(campaign: Path, question: Bounded, limits: Limits) -> str:
    """The validation report of a campaign for one body area.

    Raises
    ------
    MissingExtra
        What draws its figures is not installed.
    """
    from forcemap.report import report_html

    stated = campaign / "campaign.toml"
    error = read_conditions(stated).device.error_or_default if stated.exists() else 3.0
    tolerance = ToleranceBound(question.confidence, question.content, error)
    bound = FixedMargin(question.margin) if question.bound is BoundKind.MARGIN else tolerance
    found = assess_campaign(campaign, limits=[limits.of(question.area)], bound=bound)
    return report_html(replace(found, findings=tuple(dict.fromkeys((*limits.statements, *found.findings)))))


def comparison_svg(found: Fitted, question: ComparisonQuestion) -> str:
    """The comparison of force models as a figure."""
    from forcemap.figures import model_comparison_figure, svg

    model = contact_model(found, question)
    comparison = compare_force_models(found.dataset, **model)
    return svg(model_comparison_figure(comparison, found.dataset, found.force_map, **model))


def _zones(found: Fitted, question: ZoneSize, limits: Limits) -> RobotTable:
    table = robot_table(
        found.force_map,
        limits=[(limits.of(question.area), question.contact)],
        bound=question.bound_of(found.force_map),
        size=question.zone_m,
        allowance=Allowance(speed=question.overshoot_mps, position=question.position_tolerance_m),
    )
    statements = (*limits.statements, *table.provenance.statements)
    return replace(table, provenance=replace(table.provenance, statements=statements))
