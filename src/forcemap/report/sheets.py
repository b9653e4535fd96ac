"""The sheets of contact points: photograph, curves, margins and what permits contact, one for each point."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.contact_points import PHOTOGRAPHS_FOLDER
from forcemap.assessment.missing import Missing
from forcemap.assessment.point_results import PointResult
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.report.curves import Curve, force_curves, highest_force
from forcemap.report.permission import point_permission
from forcemap.report.photographs import shown_photograph


@dataclass(frozen=True)
class Sheet:
    """What a page shows of a contact point.

    Parameters
    ----------
    result : PointResult
    permission : str
        The sentence that permits it; empty if it is not permitted.
    photograph : Markup
        Its picture; empty without one.
    picture_missing : Finding or None
        Why there is none.
    curves : Markup
        The curves of its recordings; empty without any.
    """

    result: PointResult
    permission: str
    photograph: Markup
    picture_missing: Finding | None
    curves: Markup


def sheets(assessment: CampaignAssessment) -> list[Sheet]:
    """The sheets of all contact points, in the order of the list; a photograph is encoded once for all its points."""
    if isinstance(assessment.points, Missing):
        return []
    digests = {file.path: file.sha256 for file in assessment.inputs}
    shown: dict[str, tuple[Markup, Finding | None]] = {}
    made = []
    for result in assessment.points:
        name = result.point.photograph
        if name not in shown:
            shown[name] = _photograph(result, digests.get(f"{PHOTOGRAPHS_FOLDER}/{name}", ""))
        permission = point_permission(result, assessment.conditions, assessment.protocol)
        made.append(Sheet(result, permission, *shown[name], _curves(result)))
    return made


def _photograph(result: PointResult, digest: str) -> tuple[Markup, Finding | None]:
    if result.photograph is None:
        return Markup(""), Finding.of(FindingKind.POINT_PICTURE_MISSING)
    file = result.photograph.name
    try:
        return shown_photograph(result.photograph, digest, f"photograph or sketch {file}"), None
    except InputError as error:
        return Markup(""), Finding.of(FindingKind.POINT_PICTURE_UNUSABLE, file=file, words=error.message)


def _curves(result: PointResult) -> Markup:
    curves = [Curve(i.recording, i.time, i.force, not i.excluded) for i in result.impacts]
    contact, limit = result.point.contact, result.point.limit if result.point.limit.permitted else None
    return force_curves(curves, limit, highest_force(curves, limit, contact), contact)
