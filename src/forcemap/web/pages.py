"""The pages: what the JSON answers say, in HTML; they work without script, which draws and keeps them up to date."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
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

import forcemap as fm
from forcemap.answers.comparison import Body
from forcemap.web.admission import TOKEN, WHERE, is_page
from forcemap.web.campaign_answers import campaign_answer, overview, problem_words
from forcemap.web.downloads import Export, Format, comparison_svg
from forcemap.web.folder import Folder
from forcemap.web.grids import slices_answer
from forcemap.web.held import Fitted, fitted
from forcemap.web.intake import LARGEST_UPLOAD, TYPES, Addition, Intake, Upload
from forcemap.web.limits import Limits, limits_of
from forcemap.web.map_answers import Asked
from forcemap.web.question import Area, BoundKind, ComparisonQuestion, PathQuestion, Place, Question, State
from forcemap.web.refusal import Refusal, status_of
from forcemap.web.task_answers import task_answer
from forcemap.web.turns import Turns

_Asked = TypeVar("_Asked", bound=Area)

_AXES = ("distance_m", "height_m", "speed_mps")
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


def page_router(folder: Folder, intake: Intake, turns: Turns, table: fm.LimitTable | None) -> APIRouter:
    """The routes of the pages for the campaigns of a folder."""
    router = APIRouter(include_in_schema=False)

    def page(request: Request, template: str, name: str, question: Area, limits: Limits, **shown: Any) -> Response:
        areas = _areas(limits.table or fm.standard_limit_table())
        shown |= {"name": name, "base": _address(name), "question": question, "areas": areas, "single": folder.single}
        return _html(request, template, **shown)

    def ready(name: str) -> tuple[Asked, str]:
        """Map and limits of a campaign, and the hashes of both."""
        path = folder.campaign(name)
        asked = Asked(fitted(path), limits_of(path, table))
        used = asked.limits.table or fm.standard_limit_table()
        return asked, f"{fm.map_sha256(asked.fitted.force_map)} {used.sha256}"

    def asked_page(
        request: Request,
        name: str,
        model: type[_Asked],
        answer: Callable[[Asked, _Asked], Any],
        otherwise: Callable[[Fitted], dict[str, Any]] = lambda _: {},
    ) -> Response:
        """The page of its address: what the map of a campaign answers to a question."""
        asked, made_of = ready(name)
        question = _stated(request, model, asked.limits.otherwise | otherwise(asked.fitted))
        shown = {"asked": asked, "axes": _axes(asked.fitted), _MADE_OF: made_of, "answer": answer(asked, question)}
        template = f"{request.url.path.rpartition('/')[2]}.html"
        return page(request, template, name, question, asked.limits, **shown)

    @router.get("/")
    def overview_page(request: Request) -> Response:
        if folder.single:
            (name,) = folder.campaigns()
            return RedirectResponse(_address(name))
        return _html(request, "overview.html", answer=overview(folder), root=folder.root.name)

    @router.get("/campaigns/{name}")
    def campaign_page(request: Request, name: str) -> Response:
        path = folder.campaign(name)
        answer, limits = campaign_answer(name, path), Limits(table)
        with suppress(fm.ForcemapError):  # without a map, judging says it
            limits = limits_of(path, table)
        taken = {"types": ",".join(TYPES), "largest": LARGEST_UPLOAD}
        question = _stated(request, Question, limits.otherwise)
        return page(request, "campaign.html", name, question, limits, answer=answer, taken=taken)

    @router.post("/campaigns/{name}/judge")
    async def judge(request: Request, name: str) -> Response:
        answer = await intake.judge(request, name, _stated(request, Upload), drawn=True)
        return _html(request, "judged.html", answer=answer)

    @router.post("/campaigns/{name}/recordings")
    async def add(request: Request, name: str) -> Response:
        answer = await intake.add(request, name, _stated(request, Addition))
        return _html(request, "added.html", answer=answer)

    @router.get("/campaigns/{name}/map")
    def map_page(request: Request, name: str) -> Response:
        return asked_page(request, name, State, slices_answer, _middle)

    @router.get("/campaigns/{name}/speeds")
    def speeds_page(request: Request, name: str) -> Response:
        return asked_page(request, name, Place, Asked.speed, _middle)

    @router.get("/campaigns/{name}/compare")
    async def compare_page(request: Request, name: str) -> Response:
        return await turns.take(request, lambda: asked_page(request, name, ComparisonQuestion, Asked.compare))

    @router.get("/campaigns/{name}/task")
    async def task_page(request: Request, name: str) -> Response:
        return await turns.take(request, lambda: asked_page(request, name, PathQuestion, task_answer, _downwards))

    @router.get("/campaigns/{name}/compare.svg")
    async def compare_figure(request: Request, name: str) -> Response:
        def made() -> Response:
            asked, made_of = ready(name)
            if request.query_params.get(_MADE_OF, made_of) != made_of:
                raise Refusal(409, "changed", "the campaign's files have changed; open the page of the figure again")
            question = _stated(request, ComparisonQuestion, asked.limits.otherwise)
            return Response(comparison_svg(asked, question), media_type="image/svg+xml")

        return await turns.take(request, made)

    @router.get("/campaigns/{name}/downloads")
    def downloads_page(request: Request, name: str) -> Response:
        path = folder.campaign(name)
        limits = limits_of(path, table)
        question = _stated(request, Export, limits.otherwise)
        shown = {"formats": list(Format), "simulated": campaign_answer(name, path).simulated}
        return page(request, "downloads.html", name, question, limits, **shown)

    return router


def locked_page(request: Request) -> Response:
    """The page without the token: nothing of a campaign, and where to find it."""
    printed = f"http://{request.headers['host']}/?{TOKEN}=..."
    return _html(request, "locked.html", 401, where=WHERE, printed=printed, page=is_page(request))


def problem_page(request: Request, error: fm.ForcemapError) -> Response:
    """A page that says what is wrong and what to do."""
    name = request.path_params.get("name")
    base = _address(name) if isinstance(name, str) else ""
    shown = {"name": name, "base": base, "message": problem_words(error), "kind": error.kind}
    return _html(request, "problem.html", status_of(error), **shown)


def _address(name: str) -> str:
    return f"/campaigns/{quote(name, safe='')}"


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


def _areas(table: fm.LimitTable) -> list[tuple[str, list[tuple[str, str]]]]:
    """Regions in words, each with the names that can be asked for: its lowest area, areas of both sides, areas."""
    regions = []
    for region in table.regions:
        areas = [area for area in table.areas.values() if area.region == region]
        sides = [area.area.removesuffix("_dominant") for area in areas if area.area.endswith("_dominant")]
        named = [(side, f"{_words(side)}, either side") for side in sides]
        title = _words(region) + ("" if any(area.transient_factor for area in areas) else " (no contact permitted)")
        lowest = (region, f"{_words(region)}: lowest of its areas")
        regions.append((title, [lowest, *named, *((area.area, area.name) for area in areas)]))
    return regions


def _words(name: str) -> str:
    return name.replace("_", " ")


def _axes(found: Fitted) -> dict[str, tuple[float, float, float]]:
    """Lowest, highest and step of the sliders: somewhat more than was measured."""
    box, axes = found.force_map.measured_range, {}
    least = (0.0, -math.inf, 0.001)
    for name, step, low, high, floor in zip(_AXES, (0.005, 0.005, 0.001), box.lowest, box.highest, least, strict=True):
        more = max(0.1 * (high - low), step)
        lowest, highest = math.floor(max(low - more, floor) / step) * step, math.ceil((high + more) / step) * step
        axes[name] = (round(lowest, 3), round(highest, 3), step)
    return axes


def _middle(found: Fitted) -> dict[str, float]:
    box = found.force_map.measured_range
    return {name: round(value, 3) for name, value in zip(_AXES, ((box.lowest + box.highest) / 2).tolist(), strict=True)}


def _downwards(found: Fitted) -> dict[str, str]:
    """A path down in the middle of the measured range, with room for the position tolerance."""
    low, high = found.force_map.measured_range.lowest, found.force_map.measured_range.highest
    d, room = (low[0] + high[0]) / 2, 0.1 * (high[1] - low[1])
    heights = (high[1] - room, low[1] + room) if room > 0 else (low[1],)
    return {"points": ";".join(f"{d:.3f},{h:.3f}" for h in heights)}


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
    "speed": lambda value: fm.floor_speed(math.nan if value is None else value),
    "words": _words,
    "query": urlencode,
}
_TEMPLATES.globals |= {
    "version": fm.__version__,
    "contacts": list(fm.Contact),
    "bounds": list(BoundKind),
    "bodies": list(Body),
    "outcomes": OUTCOMES,
}
