"""The pages: what the JSON answers say, in HTML; they work without script, which draws and keeps them up to date."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from decimal import ROUND_CEILING, Decimal
from types import MappingProxyType
from typing import Any, TypeVar
from urllib.parse import quote, urlencode

from fastapi import APIRouter, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from jinja2 import Environment, PackageLoader, StrictUndefined
from pydantic import ValidationError

from forcemap import (
    Contact,
    ForcemapError,
    LimitTable,
    __version__,
    floor_speed,
    map_sha256,
    standard_limit_table,
)
from forcemap.web.campaign_answers import campaign_answer, overview, problem_words
from forcemap.web.comparison_answers import Body, ComparisonQuestion, comparison_answer
from forcemap.web.downloads import Export, Format, comparison_svg
from forcemap.web.folder import Folder
from forcemap.web.held import Fitted, fitted
from forcemap.web.intake import LARGEST_UPLOAD, TYPES, Addition, Intake, Upload
from forcemap.web.limits import Limits, limits_of
from forcemap.web.map_answers import map_answer, slices_answer
from forcemap.web.path_answers import task_answer
from forcemap.web.question import Area, BoundKind, PathQuestion, Place, Question, State
from forcemap.web.refusal import Refusal, status_of
from forcemap.web.speed_answers import speed_answer
from forcemap.web.turns import Turns

_Asked = TypeVar("_Asked", bound=Area)

_MADE_OF = "made_of"
_MODELS: tuple[type[Area], ...] = (State, PathQuestion, ComparisonQuestion, Export, Addition)
_KNOWN = {_MADE_OF, *(name for model in _MODELS for name in model.model_fields)}

OUTCOMES = {
    "admissible": "the bound meets the limit at this speed",
    "capped": "even the highest speed measured here is admissible; no higher speed is",
    "unconfirmed": "no speed: the bound exceeds the limit at the lowest speed measured here, or Phase II forbids it",
    "outside": "no speed: nothing was measured here",
    "not_permitted": "no speed: the standard permits no contact",
    "not_downward": "no speed: the motion is not in the direction that was measured",
}
"""What outcomes mean, in words."""


def page_router(folder: Folder, intake: Intake, turns: Turns, table: LimitTable | None) -> APIRouter:
    """The routes of the pages for the campaigns of a folder."""
    router = APIRouter(include_in_schema=False)

    def page(request: Request, template: str, name: str, question: Area, limits: Limits, **shown: Any) -> Response:
        path = f"/campaigns/{quote(name, safe='')}"
        areas = _areas(limits.table or standard_limit_table())
        shown |= {"name": name, "base": path, "question": question, "areas": areas, "single": folder.single}
        return _html(request, template, **shown)

    def ready(name: str) -> tuple[Fitted, Limits, dict[str, Any]]:
        """Map and limits of a campaign, and what its pages show of them."""
        path = folder.campaign(name)
        found, limits = fitted(path), limits_of(path, table)
        made_of = f"{map_sha256(found.force_map)} {(limits.table or standard_limit_table()).sha256}"
        return found, limits, {"axes": _axes(found), "made_of": made_of}

    @router.get("/")
    def overview_page(request: Request) -> Response:
        if folder.single:
            (name,) = folder.campaigns()
            return RedirectResponse(f"/campaigns/{quote(name, safe='')}")
        return _html(request, "overview.html", answer=overview(folder), root=folder.root.name)

    @router.get("/campaigns/{name}")
    def campaign_page(request: Request, name: str) -> Response:
        path = folder.campaign(name)
        answer, limits = campaign_answer(name, path), Limits(table)
        with suppress(ForcemapError):  # without a map, judging says it
            limits = limits_of(path, table)
        taken = {"types": ",".join(TYPES), "largest": LARGEST_UPLOAD}
        question = _stated(request, Question, limits.otherwise)
        return page(request, "campaign.html", name, question, limits, answer=answer, taken=taken)

    @router.post("/campaigns/{name}/judge")
    async def judge(request: Request, name: str) -> Response:
        upload = _stated(request, Upload)
        answer = await intake.judge(request, name, upload.file, upload)
        return _html(request, "judged.html", answer=answer)

    @router.post("/campaigns/{name}/recordings")
    async def add(request: Request, name: str) -> Response:
        addition = _stated(request, Addition)
        answer = await intake.add(request, name, addition.file, addition.run, addition)
        return _html(request, "added.html", answer=answer)

    @router.get("/campaigns/{name}/map")
    def map_page(request: Request, name: str) -> Response:
        found, limits, shown = ready(name)
        question = _stated(request, State, limits.otherwise | _middle(found))
        slices = slices_answer(found, question, limits)
        return page(request, "map.html", name, question, limits, answer=slices, map=map_answer(found), **shown)

    @router.get("/campaigns/{name}/speeds")
    def speeds_page(request: Request, name: str) -> Response:
        found, limits, shown = ready(name)
        question = _stated(request, Place, limits.otherwise | _middle(found))
        answer = speed_answer(found, question, limits)
        return page(request, "speeds.html", name, question, limits, answer=answer, **shown)

    @router.get("/campaigns/{name}/compare")
    async def compare_page(request: Request, name: str) -> Response:
        def made() -> Response:
            found, limits, shown = ready(name)
            question = _stated(request, ComparisonQuestion, limits.otherwise)
            answer = comparison_answer(found, question, limits)
            return page(request, "compare.html", name, question, limits, answer=answer, **shown)

        return await turns.take(request, made)

    @router.get("/campaigns/{name}/compare.svg")
    async def compare_figure(request: Request, name: str) -> Response:
        def made() -> Response:
            found, limits, shown = ready(name)
            if request.query_params.get(_MADE_OF, shown[_MADE_OF]) != shown[_MADE_OF]:
                raise Refusal(409, "changed", "the campaign's files have changed; open the page of the figure again")
            question = _stated(request, ComparisonQuestion, limits.otherwise)
            return Response(comparison_svg(found, question), media_type="image/svg+xml")

        return await turns.take(request, made)

    @router.get("/campaigns/{name}/task")
    async def task_page(request: Request, name: str) -> Response:
        def made() -> Response:
            found, limits, shown = ready(name)
            question = _stated(request, PathQuestion, limits.otherwise | {"points": _downwards(found)})
            answer = task_answer(found, question, limits)
            return page(request, "task.html", name, question, limits, answer=answer, **shown)

        return await turns.take(request, made)

    @router.get("/campaigns/{name}/downloads")
    def downloads_page(request: Request, name: str) -> Response:
        path = folder.campaign(name)
        limits = limits_of(path, table)
        question = _stated(request, Export, limits.otherwise)
        shown = {"formats": list(Format), "simulated": campaign_answer(name, path).simulated}
        return page(request, "downloads.html", name, question, limits, **shown)

    return router


def problem_page(request: Request, error: ForcemapError) -> Response:
    """A page that says what is wrong and what to do."""
    name = request.path_params.get("name")
    base = f"/campaigns/{quote(name, safe='')}" if isinstance(name, str) else ""
    shown = {"name": name, "base": base, "message": problem_words(error), "kind": error.kind}
    return _html(request, "problem.html", status_of(error), **shown)


def _html(request: Request, template: str, status: int = 200, **shown: Any) -> HTMLResponse:
    return HTMLResponse(_TEMPLATES.get_template(template).render(path=request.url.path, **shown), status)


def _stated(request: Request, model: type[_Asked], otherwise: Mapping[str, Any] = MappingProxyType({})) -> _Asked:
    """The question of an address; what belongs to another page, or was left empty, is as if not stated."""
    for key, value in request.query_params.items():
        if key not in _KNOWN:
            unknown = {"type": "extra_forbidden", "loc": ("query", key), "msg": "no page has it", "input": value}
            raise RequestValidationError([unknown])
    stated = dict(otherwise) | {key: value for key, value in request.query_params.items() if value != ""}
    try:
        return model.model_validate({key: value for key, value in stated.items() if key in model.model_fields})
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from None


def _areas(table: LimitTable) -> list[tuple[str, list[tuple[str, str]]]]:
    """Regions in words, each with the names that can be asked for: its lowest area, areas of both sides, areas."""
    regions = []
    for region in table.regions:
        areas = [area for area in table.areas.values() if area.region == region]
        sides = [area for area in areas if area.area.endswith("_dominant")]
        named = [
            (area.area.removesuffix("_dominant"), f"{_words(area.area.removesuffix('_dominant'))}, either side")
            for area in sides
        ]
        title = _words(region) + ("" if any(area.transient_factor for area in areas) else " (no contact permitted)")
        lowest = (region, f"{_words(region)}: lowest of its areas")
        regions.append((title, [lowest, *named, *((area.area, area.name) for area in areas)]))
    return regions


def _words(name: str) -> str:
    return name.replace("_", " ")


def _axes(found: Fitted) -> dict[str, tuple[float, float, float]]:
    """Lowest, highest and step of the sliders: somewhat more than was measured."""
    box = found.force_map.measured_range
    axes = {}
    for i, (name, step) in enumerate((("distance_m", 0.005), ("height_m", 0.005), ("speed_mps", 0.001))):
        low, high = float(box.lowest[i]), float(box.highest[i])
        more = max(0.1 * (high - low), step)
        lowest = max(low - more, {"distance_m": 0.0, "speed_mps": step}.get(name, -math.inf))
        axes[name] = (math.floor(lowest / step) * step, math.ceil((high + more) / step) * step, step)
    return {name: (round(low, 3), round(high, 3), step) for name, (low, high, step) in axes.items()}


def _middle(found: Fitted) -> dict[str, float]:
    box = found.force_map.measured_range
    middle = ((box.lowest + box.highest) / 2).tolist()
    return {name: round(value, 3) for name, value in zip(("distance_m", "height_m", "speed_mps"), middle, strict=True)}


def _downwards(found: Fitted) -> str:
    """A path down in the middle of the measured range, with room for the position tolerance."""
    low, high = found.force_map.measured_range.lowest, found.force_map.measured_range.highest
    d = (low[0] + high[0]) / 2
    top, bottom = high[1] - 0.1 * (high[1] - low[1]), low[1] + 0.1 * (high[1] - low[1])
    return f"{d:.3f},{top:.3f};{d:.3f},{bottom:.3f}" if high[1] > low[1] else f"{d:.3f},{low[1]:.3f}"


def _figure(value: float | None, digits: int = 1) -> str:
    """A figure with its decimals; a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


def _raised(force: float | None) -> str:
    """A bound on a force, never rounded down; a dash where there is none."""
    return "-" if force is None else str(Decimal(repr(force)).quantize(Decimal("0.1"), rounding=ROUND_CEILING))


_TEMPLATES = Environment(
    loader=PackageLoader("forcemap.web"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_TEMPLATES.filters |= {
    "figure": _figure,
    "raised": _raised,
    "speed": lambda value: floor_speed(math.nan if value is None else value),
    "words": _words,
    "query": lambda parameters: urlencode(parameters),
}
_TEMPLATES.globals |= {
    "version": __version__,
    "contacts": list(Contact),
    "bounds": list(BoundKind),
    "bodies": list(Body),
    "outcomes": OUTCOMES,
}
