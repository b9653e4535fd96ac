"""The pages: what the JSON answers say, in HTML; they work without script, which draws and keeps them up to date."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from decimal import ROUND_CEILING, Decimal
from pathlib import Path
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
from forcemap.paths.atlas import Atlas
from forcemap.recordings.units import ForceUnit, TimeUnit
from forcemap.web.admission import TOKEN, WHERE, is_page
from forcemap.web.campaign_answers import campaign_answer, problem_words
from forcemap.web.campaign_map import CampaignMap
from forcemap.web.conditions import conditions_answer
from forcemap.web.contact_points import FILM_TYPES, PICTURE_TYPES, POINT_FIELDS, photograph, points_answer
from forcemap.web.downloads import Export, Format, comparison_svg
from forcemap.web.grids import slices_answer
from forcemap.web.headline import headline
from forcemap.web.help import HELP
from forcemap.web.intake import LARGEST_UPLOAD, TYPES, Addition, Judged
from forcemap.web.limits import Limits, limits_of
from forcemap.web.overview import overview
from forcemap.web.question import Area, BoundKind, ComparisonQuestion, PathQuestion, Place, Question, State
from forcemap.web.recording import RecordingQuestion, recording_answer
from forcemap.web.request_error import RequestError, status_of
from forcemap.web.route import views
from forcemap.web.site import Site
from forcemap.web.task_answers import task_answer
from forcemap.web.together import WayQuestion, by_map, together, together_answer, way_answer

_Question = TypeVar("_Question", bound=Area)

_SLIDERS = {"distance_m": (0.005, 0.0), "height_m": (0.005, -math.inf), "speed_mps": (0.001, 0.001)}
"""Step and lowest value of each slider [m, m/s]; choices: a place within repeats of a state, a speed as it is shown."""

_BEYOND = 0.1
"""How far the sliders go beyond the measured range, as a share of it; a choice, so that its end can be seen."""

_PATH_ROOM = 0.1
"""Share of the heights left free at both ends of the path that is shown first; a choice, for the position tolerance."""

_TAKEN = {"types": ",".join(TYPES), "largest": LARGEST_UPLOAD}
"""Which files are taken, and how large."""

_MADE_OF = "made_of"
"""The parameter that carries the hashes of the map and limits that a page was made of."""

_QUESTIONS: tuple[type[Area], ...] = (State, PathQuestion, WayQuestion, ComparisonQuestion, Export)
_MODELS: tuple[type[Area], ...] = (*_QUESTIONS, Addition, Judged, RecordingQuestion)
_KNOWN = {_MADE_OF, *(name for model in _MODELS for name in model.model_fields)}

OUTCOMES = {
    "admissible": "the bound meets the limit at this speed",
    "capped": "even the highest speed measured here is admissible; no higher speed is",
    "unconfirmed": "no speed: the bound exceeds the limit at the lowest speed measured here, or Phase II forbids it",
    "outside": "no speed: nothing was measured here",
    "not_permitted": "no speed: the standard permits no contact",
    "no_map": "no speed: no map of this direction, contact site, tool and payload",
    "not_downward": "no speed: the motion is not in the direction that was measured",
}
"""What outcomes mean, in words."""


_STATES = {
    "permitted": "permitted everywhere",
    "partly": "permitted at places",
    "nowhere": "permitted nowhere",
    "not_permitted": "not permitted",
    "contradicted": "map contradicted",
    "ready": "map ready",
    "measuring": "being measured",
    "empty": "not measured",
    "refused": "no speeds",
}
"""What states of a case and of a campaign are called."""


def page_router(site: Site) -> APIRouter:
    """The routes of the pages of a site, by what they show."""
    router = APIRouter(include_in_schema=False)
    for routes in (campaign_pages, condition_pages, point_pages, intake_pages, map_pages, together_pages):
        router.include_router(routes(site))
    return router


def campaign_pages(site: Site) -> APIRouter:
    """The overview, a campaign, and what can be taken away from it."""
    router = APIRouter()

    @router.get("/")
    async def overview_page(request: Request) -> Response:
        question = _stated(request, Area)
        if site.folder.single:
            (name,) = site.folder.campaigns()
            return RedirectResponse(f"{_address(name)}?{question.query}".rstrip("?"))

        def page() -> Response:
            found, areas = overview(site.folder, site.table, question), _areas(site.table or fm.standard_limit_table())
            shown: dict[str, Any] = {
                "answer": found,
                "question": question,
                "areas": areas,
                "root": site.folder.root.name,
            }
            return html_page(request, "overview.html", **shown)

        return await site.queue.run(request, page)

    @router.get("/campaigns/{name}")
    async def campaign_page(request: Request, name: str) -> Response:
        return await site.queue.run(request, lambda: _campaign_page(request, name))

    def _campaign_page(request: Request, name: str) -> Response:
        path = site.folder.campaign(name)
        answer, limits = campaign_answer(name, path), Limits(site.table)
        with suppress(fm.ForcemapError):  # without a map, judging says it
            limits = limits_of(path, site.table)
        question = _stated(request, Question, limits.otherwise)
        shown = {"answer": answer, "headline": headline(name, path, question, limits), "taken": _TAKEN}
        shown["conditions"], shown["to_state"] = _conditions_of(path), 0
        with suppress(fm.ForcemapError):  # an entry that cannot be read is said where it is changed
            shown["to_state"] = sum(map(len, conditions_answer(path).not_stated.values()))
        return _campaign_html(site, request, "campaign.html", name, question, limits, **shown)

    @router.get("/campaigns/{name}/recording")
    async def recording_page(request: Request, name: str) -> Response:
        def page() -> Response:
            path = site.folder.campaign(name)
            limits = limits_of(path, site.table)
            question = _stated(request, RecordingQuestion, limits.otherwise)
            answer = recording_answer(path, question, limits)
            return _campaign_html(site, request, "recording.html", name, question, limits, answer=answer)

        return await site.queue.run(request, page)

    @router.get("/campaigns/{name}/downloads")
    def downloads_page(request: Request, name: str) -> Response:
        path = site.folder.campaign(name)
        limits = limits_of(path, site.table)
        question = _stated(request, Export, limits.otherwise)
        shown = {"formats": list(Format), "simulated": campaign_answer(name, path).simulated}
        return _campaign_html(site, request, "downloads.html", name, question, limits, **shown)

    return router


def condition_pages(site: Site) -> APIRouter:
    """The pages on which campaign.toml is changed."""
    router = APIRouter()

    def shown(request: Request, name: str, template: str) -> Response:
        path, limits = site.folder.campaign(name), Limits(site.table)
        with suppress(fm.ForcemapError):  # a table of limits that cannot be used is changed here, too
            limits = limits_of(path, site.table)
        question = _stated(request, Question, limits.otherwise)
        answer = conditions_answer(path)
        units = {"time_units": list(TimeUnit), "force_units": list(ForceUnit)}
        return _campaign_html(site, request, template, name, question, limits, answer=answer, taken=_TAKEN, **units)

    @router.get("/campaigns/{name}/conditions")
    def conditions_page(request: Request, name: str) -> Response:
        return shown(request, name, "conditions.html")

    @router.get("/campaigns/{name}/columns")
    def columns_page(request: Request, name: str) -> Response:
        return shown(request, name, "columns.html")

    return router


def point_pages(site: Site) -> APIRouter:
    """The contact points of a campaign, and their photographs."""
    router = APIRouter()

    @router.get("/campaigns/{name}/points")
    async def points_page(request: Request, name: str) -> Response:
        path = site.folder.campaign(name)
        limits = limits_of(path, site.table)
        question = _stated(request, Area, limits.otherwise)
        answer = await site.queue.run(request, lambda: points_answer(name, path, site.table))
        shown = {"answer": answer, "pictures": ",".join(PICTURE_TYPES), "films": ",".join(FILM_TYPES)}
        shown |= {"types": ",".join(TYPES), "largest": LARGEST_UPLOAD, "columns": POINT_FIELDS}
        return _campaign_html(site, request, "points.html", name, question, limits, **shown)

    @router.get("/campaigns/{name}/photographs/{file}")
    def photograph_file(name: str, file: str) -> Response:
        kind, content = photograph(site.folder.campaign(name), file)
        return Response(content, media_type=kind)

    return router


def intake_pages(site: Site) -> APIRouter:
    """The parts of a campaign's page that answer to a dropped file."""
    router = APIRouter()

    @router.post("/campaigns/{name}/judge")
    async def judge(request: Request, name: str) -> Response:
        answer = await site.intake.judge(request, name, _stated(request, Judged), drawn=True)
        return html_page(request, "judged.html", answer=answer)

    @router.post("/campaigns/{name}/recordings")
    async def add(request: Request, name: str) -> Response:
        answer = await site.intake.add(request, name, _stated(request, Addition))
        return html_page(request, "added.html", answer=answer)

    return router


def map_pages(site: Site) -> APIRouter:
    """The pages of a campaign's map: slices, safe speeds, comparison of models, task."""
    router = APIRouter()

    @router.get("/campaigns/{name}/map")
    def map_page(request: Request, name: str) -> Response:
        return _answer_page(site, request, name, State, slices_answer, _middle)

    @router.get("/campaigns/{name}/speeds")
    def speeds_page(request: Request, name: str) -> Response:
        return _answer_page(site, request, name, Place, CampaignMap.speed, _middle)

    @router.get("/campaigns/{name}/compare")
    async def compare_page(request: Request, name: str) -> Response:
        compare = CampaignMap.compare
        return await site.queue.run(request, lambda: _answer_page(site, request, name, ComparisonQuestion, compare))

    @router.get("/campaigns/{name}/task")
    async def task_page(request: Request, name: str) -> Response:
        def page() -> Response:
            return _answer_page(site, request, name, PathQuestion, task_answer, _downwards)

        return await site.queue.run(request, page)

    @router.get("/campaigns/{name}/compare.svg")
    async def compare_figure(request: Request, name: str) -> Response:
        def figure() -> Response:
            campaign_map, made_of = _map_with_hashes(site, name)
            if request.query_params.get(_MADE_OF, made_of) != made_of:
                message = "the campaign's files have changed; open the page of the figure again"
                raise RequestError(409, "changed", message)
            question = _stated(request, ComparisonQuestion, campaign_map.limits.otherwise)
            return Response(comparison_svg(campaign_map, question), media_type="image/svg+xml")

        return await site.queue.run(request, figure)

    return router


def together_pages(site: Site) -> APIRouter:
    """The page of all campaigns of the folder together."""
    router = APIRouter()

    @router.get("/together")
    async def together_page(request: Request) -> Response:
        def page() -> Response:
            atlas, limits = together(site)
            question = _stated(request, WayQuestion, limits.otherwise | _first_way(atlas))
            answer, problem = None, ""
            try:
                answer = way_answer(atlas, limits, question) if question.area else None
            except fm.ForcemapError as error:  # what the task leaves open is said beside the form that asks for it
                problem = problem_words(error)
            shown: dict[str, Any] = {
                "maps": together_answer(atlas),
                "robot": atlas.conditions.robot,
                "areas": _areas(limits.used),
            }
            shown |= {"answer": answer, "problem": problem, _MADE_OF: f"{atlas.sha256} {limits.used.sha256}"}
            if answer:
                corners = [[float(x) for x in point.split(",")] for point in question.points.split(";")]
                shown |= {"views": views(answer, corners), "groups": by_map(atlas, limits, question, answer)}
            return html_page(request, "together.html", question=question, **shown)

        return await site.queue.run(request, page)

    return router


def _first_way(atlas: Atlas) -> dict[str, str]:
    """A way down in the middle of the first map's range, in front of the base."""
    pairs = _downwards(atlas.force_maps[0])["points"].split(";")
    return {"points": ";".join(pair.replace(",", ",0,") for pair in pairs)} if len(pairs) > 1 else {}


def _answer_page(
    site: Site,
    request: Request,
    name: str,
    model: type[_Question],
    answer: Callable[[CampaignMap, _Question], Any],
    otherwise: Callable[[fm.ForceMap], dict[str, Any]] = lambda _: {},
) -> Response:
    """The page of the request's address: the answer of a campaign's map to the question in it.

    `otherwise` gives the parameters of a question that the address does not state.
    """
    campaign_map, made_of = _map_with_hashes(site, name)
    force_map, limits = campaign_map.fitted.force_map, campaign_map.limits
    question = _stated(request, model, limits.otherwise | otherwise(force_map))
    shown: dict[str, Any] = {"axes": _axes(force_map), _MADE_OF: made_of}
    shown["answer"] = answer(campaign_map, question) if question.area else None
    shown["conditions"] = force_map.conditions
    template = f"{request.url.path.rpartition('/')[2]}.html"
    return _campaign_html(site, request, template, name, question, limits, campaign_map=campaign_map, **shown)


def _conditions_of(campaign: Path) -> fm.Conditions:
    """What campaign.toml states; nothing where it cannot be used, which is said elsewhere."""
    stated = campaign / "campaign.toml"
    try:
        return fm.read_conditions(stated) if stated.exists() else fm.Conditions()
    except fm.ForcemapError:
        return fm.Conditions()


def _map_with_hashes(site: Site, name: str) -> tuple[CampaignMap, str]:
    """Map and limits of a campaign, and the hashes of both."""
    campaign_map = site.campaign_map(name)
    return campaign_map, f"{fm.map_sha256(campaign_map.fitted.force_map)} {campaign_map.limits.used.sha256}"


def _campaign_html(
    site: Site, request: Request, template: str, name: str, question: Area, limits: Limits, **shown: Any
) -> Response:
    """A page of a campaign, with the choice of body areas that all of them offer; its links keep what was chosen."""
    areas, kept = _areas(limits.used), question.query
    if not request.query_params.get("area"):  # that of a contact point is nobody's choice for other campaigns
        kept = question.model_copy(update={"area": ""}).query
    shown |= {"name": name, "base": _address(name), "question": question, "areas": areas, "single": site.folder.single}
    return html_page(request, template, kept=kept, **shown)


def locked_page(request: Request) -> Response:
    """The page without the token: nothing of a campaign, and where to find it."""
    printed = f"http://{request.headers['host']}/?{TOKEN}=..."
    return html_page(request, "locked.html", 401, where=WHERE, printed=printed, page=is_page(request))


def problem_page(request: Request, error: fm.ForcemapError) -> Response:
    """A page that says what is wrong and what to do."""
    name = request.path_params.get("name")
    base = _address(name) if isinstance(name, str) else ""
    shown = {"name": name, "base": base, "message": problem_words(error), "kind": error.kind}
    area = request.query_params.get("area", "") if status_of(error) == 409 else ""  # else it may be what is wrong
    shown |= {"chosen": area, "kept": urlencode({"area": area}) if area else ""}
    return html_page(request, "problem.html", status_of(error), **shown)


def _address(name: str) -> str:
    return f"/campaigns/{quote(name, safe='')}"


def html_page(request: Request, template: str, status: int = 200, **shown: Any) -> HTMLResponse:
    """A page from its template."""
    shown = {"path": request.url.path, "chosen": request.query_params.get("area", "")} | shown
    return HTMLResponse(_TEMPLATES.get_template(template).render(**shown), status)


def _stated(request: Request, model: type[_Question], otherwise: Mapping[str, Any] = MappingProxyType({})) -> _Question:
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
    """Regions in words, with the names that can be asked for: the lowest area, areas of both sides, single areas."""
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


def _axes(force_map: fm.ForceMap) -> dict[str, tuple[float, float, float]]:
    """Lowest value, highest value and step of each slider: somewhat more than the measured range."""
    box, axes = force_map.measured_range, {}
    for (name, (step, floor)), low, high in zip(_SLIDERS.items(), box.lowest, box.highest, strict=True):
        more = max(_BEYOND * (high - low), step)
        lowest, highest = math.floor(max(low - more, floor) / step) * step, math.ceil((high + more) / step) * step
        axes[name] = (round(lowest, 3), round(highest, 3), step)
    return axes


def _middle(force_map: fm.ForceMap) -> dict[str, float]:
    """The state in the middle of the measured range."""
    middle = (force_map.measured_range.lowest + force_map.measured_range.highest) / 2
    return {name: round(value, 3) for name, value in zip(_SLIDERS, middle.tolist(), strict=True)}


def _downwards(force_map: fm.ForceMap) -> dict[str, str]:
    """A path down in the middle of the measured range, with room for the position tolerance."""
    low, high = force_map.measured_range.lowest, force_map.measured_range.highest
    d, room = (low[0] + high[0]) / 2, _PATH_ROOM * (high[1] - low[1])
    heights = (high[1] - room, low[1] + room) if room > 0 else (low[1],)
    return {"points": ";".join(f"{d:.3f},{h:.3f}" for h in heights)}


def _figure(value: float | None, digits: int = 1) -> str:
    """A figure with its decimals; a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


def _rounded_up(force: float | None) -> str:
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
    "raised": _rounded_up,
    "speed": lambda value: fm.floor_speed(math.nan if value is None else value),
    "words": _words,
    "query": lambda stated: urlencode({name: value for name, value in stated.items() if value not in ("", None)}),
    "with_blanks": lambda cells, columns: dict.fromkeys(columns, "") | cells,
}
_TEMPLATES.globals |= {
    "version": fm.__version__,
    "contacts": list(fm.Contact),
    "bounds": list(BoundKind),
    "bodies": list(Body),
    "outcomes": OUTCOMES,
    "state_words": _STATES,
    "help": HELP,
}
