"""The JSON twin of every page, under /api, and the files that can be taken away."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Query, Request
from fastapi.responses import Response
from fastapi.security import HTTPBearer

from forcemap.answers.collect import CollectAnswer
from forcemap.answers.comparison import ComparisonAnswer
from forcemap.answers.error import ErrorAnswer
from forcemap.answers.evaluate import EvaluateAnswer
from forcemap.answers.map import FitAnswer
from forcemap.answers.path import PathAnswer
from forcemap.answers.speed import SpeedAnswer
from forcemap.answers.speed_map import SpeedMapAnswer
from forcemap.maps.map_file import map_text
from forcemap.web.campaign_answers import CampaignAnswer, campaign_answer
from forcemap.web.columns import ColumnsAnswer
from forcemap.web.conditions import (
    ChangeAnswer,
    ColumnsChange,
    ConditionsAnswer,
    ConditionsChange,
    change_columns,
    change_conditions,
    conditions_answer,
)
from forcemap.web.downloads import Export, export_text, report_text, scaling_text
from forcemap.web.fitted_campaign import fitted_campaign
from forcemap.web.grids import CubeAnswer, SlicesAnswer, SpeedGrid, cube_answer, slices_answer, speed_grid
from forcemap.web.headline import Headline, NextStep, headline, next_step
from forcemap.web.intake import Addition, Judged, Judgement, StoredAnswer, Upload
from forcemap.web.limits import limits_of
from forcemap.web.overview import Overview, overview
from forcemap.web.question import (
    Area,
    Bounded,
    ComparisonQuestion,
    PathQuestion,
    Place,
    Question,
    Resolution,
    State,
    Steps,
)
from forcemap.web.recording import RecordingAnswer, RecordingQuestion, recording_answer
from forcemap.web.site import Site
from forcemap.web.task_answers import TaskAnswer, task_answer
from forcemap.web.together import TogetherAnswer, WayQuestion, together, together_answer, way_answer

Name = Annotated[str, Path(description="Name of a campaign: that of its folder.", max_length=255)]

REFUSALS: dict[int | str, dict[str, Any]] = {
    401: {"model": ErrorAnswer, "description": "Without the token of this page."},
    403: {"model": ErrorAnswer, "description": "A request of another site."},
    404: {"model": ErrorAnswer, "description": "There is no such campaign or page."},
    409: {"model": ErrorAnswer, "description": "The campaign, as it is, cannot give the answer."},
    421: {"model": ErrorAnswer, "description": "Another host name than 127.0.0.1 or localhost."},
    422: {"model": ErrorAnswer, "description": "What was sent cannot be used."},
}
UPLOAD_REFUSALS: dict[int | str, dict[str, Any]] = {
    408: {"model": ErrorAnswer, "description": "The file did not arrive in time."},
    413: {"model": ErrorAnswer, "description": "The file is too large."},
    415: {
        "model": ErrorAnswer,
        "description": "Neither a recording nor a table by its name, or not sent as a plain body.",
    },
}
BEARER = HTTPBearer(auto_error=False, description="The token in the address that forcemap serve prints.")
"""For the schema alone: `SecurityMiddleware` requires the token."""

_FILE = {"schema": {"type": "string", "format": "binary", "minLength": 1}}
FILE_BODY = {"requestBody": {"required": True, "content": {"application/octet-stream": _FILE}}}


def api_router(site: Site) -> APIRouter:
    """The routes of the JSON answers and files of a site, by what they serve."""
    router = APIRouter(prefix="/api", responses=REFUSALS, dependencies=[Depends(BEARER)])
    for routes in (
        campaign_routes,
        condition_routes,
        recording_routes,
        map_routes,
        speed_routes,
        together_routes,
        drawing_routes,
        file_routes,
    ):
        router.include_router(routes(site))
    return router


def campaign_routes(site: Site) -> APIRouter:
    """The campaigns as their folders state them."""
    router = APIRouter(tags=["campaigns"])

    @router.get("/campaigns")
    async def campaigns(request: Request, question: Annotated[Area, Query()]) -> Overview:
        """All campaigns of the folder."""
        return await site.queue.run(request, lambda: overview(site.folder, site.table, question))

    @router.get("/campaigns/{name}")
    def campaign(name: Name) -> CampaignAnswer:
        """A campaign: conditions, states done and missing, recordings."""
        return campaign_answer(name, site.folder.campaign(name))

    @router.get("/campaigns/{name}/headline")
    async def of_campaign(request: Request, name: Name, question: Annotated[Area, Query()]) -> Headline:
        """What the campaign permits, for each body area and contact."""
        path = site.folder.campaign(name)
        limits = limits_of(path, site.table)
        limits.area(question.area)
        return await site.queue.run(request, lambda: headline(name, path, question, limits))

    @router.get("/campaigns/{name}/next")
    async def to_do(request: Request, name: Name, question: Annotated[Question, Query()]) -> NextStep:
        """What to measure next."""
        path = site.folder.campaign(name)
        return await site.queue.run(request, lambda: next_step(name, path, question, limits_of(path, site.table)))

    return router


def condition_routes(site: Site) -> APIRouter:
    """The entries of campaign.toml, read and changed."""
    router = APIRouter(prefix="/campaigns/{name}/conditions", tags=["conditions"])

    @router.get("")
    def conditions(name: Name) -> ConditionsAnswer:
        """The entries, and the hash of the file as it was looked at."""
        return conditions_answer(site.folder.campaign(name))

    @router.post("")
    def change(name: Name, wanted: ConditionsChange) -> ChangeAnswer:
        """Change entries; what no longer fits the recordings is written only if that was confirmed."""
        return change_conditions(site.folder.campaign(name), wanted)

    @router.post("/recordings")
    def change_reading(name: Name, wanted: ColumnsChange) -> ChangeAnswer:
        """Change how the device's files are read, likewise."""
        return change_columns(site.folder.campaign(name), wanted)

    return router


def recording_routes(site: Site) -> APIRouter:
    """The intake: recordings judged, added and collected."""
    router = APIRouter(tags=["recordings"])

    @router.post("/campaigns/{name}/judge", responses=UPLOAD_REFUSALS, openapi_extra=FILE_BODY)
    async def judge(request: Request, name: Name, upload: Annotated[Judged, Query()]) -> Judgement:
        """Judge a recording, as forcemap check does, or an impacts table; nothing is stored."""
        return await site.intake.judge(request, name, upload, drawn=upload.curves)

    @router.get("/campaigns/{name}/recording")
    async def recording(
        request: Request, name: Name, question: Annotated[RecordingQuestion, Query()]
    ) -> RecordingAnswer:
        """A registered recording, judged again, with its curve."""
        path = site.folder.campaign(name)
        return await site.queue.run(request, lambda: recording_answer(path, question, limits_of(path, site.table)))

    @router.post("/campaigns/{name}/columns", responses=UPLOAD_REFUSALS, openapi_extra=FILE_BODY)
    async def columns(request: Request, name: Name, upload: Annotated[Upload, Query()]) -> ColumnsAnswer:
        """The first lines of a file, cut into columns; nothing is stored."""
        return await site.intake.columns(request, name, upload)

    @router.post("/campaigns/{name}/recordings", responses=UPLOAD_REFUSALS, openapi_extra=FILE_BODY)
    async def add(request: Request, name: Name, addition: Annotated[Addition, Query()]) -> StoredAnswer:
        """Judge a recording, store it under the name of its run and collect the campaign."""
        return await site.intake.add(request, name, addition)

    @router.post("/campaigns/{name}/collect")
    async def collect(name: Name) -> CollectAnswer:
        """Read and judge all recordings of a campaign, and write its impacts table."""
        return await site.intake.collect(name)

    return router


def map_routes(site: Site) -> APIRouter:
    """The map of a campaign: what it is, how accurate, and beside other models."""
    router = APIRouter(tags=["map"])

    @router.get("/campaigns/{name}/map")
    def force_map(name: Name) -> FitAnswer:
        """The collision-force map: coefficients, accuracy, measured states; as `forcemap fit --json`."""
        return site.campaign_map(name).fit()

    @router.get("/campaigns/{name}/evaluate")
    def evaluate(name: Name) -> EvaluateAnswer:
        """How far its predictions are from measured forces; as `forcemap evaluate --json`."""
        return site.campaign_map(name).evaluate()

    @router.get("/campaigns/{name}/compare", response_model=ComparisonAnswer)
    async def compare(request: Request, name: Name, question: Annotated[ComparisonQuestion, Query()]) -> Response:
        """The map beside the 2D map and the standard's contact model; as `forcemap compare --json`."""
        return await site.queue.json(request, lambda: site.campaign_map(name).compare(question))

    return router


def speed_routes(site: Site) -> APIRouter:
    """Safe speeds, as the commands print them."""
    router = APIRouter(tags=["speeds"])

    @router.get("/campaigns/{name}/speed")
    def speed(name: Name, question: Annotated[Place, Query()]) -> SpeedAnswer:
        """The safe speed at a place; as `forcemap speed --json`."""
        return site.campaign_map(name).speed(question)

    @router.get("/campaigns/{name}/speed-map", response_model=SpeedMapAnswer)
    async def speed_map(request: Request, name: Name, question: Annotated[Steps, Query()]) -> Response:
        """Safe speeds on a grid of places; as `forcemap speed-map --json`."""
        return await site.queue.json(request, lambda: site.campaign_map(name).speed_map(question))

    @router.get("/campaigns/{name}/path", response_model=PathAnswer)
    async def path(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """Allowed speeds along a path of two or more points; as `forcemap path --json`."""
        return await site.queue.json(request, lambda: site.campaign_map(name).path(question))

    return router


def together_routes(site: Site) -> APIRouter:
    """The campaigns of the folder together, if they are of one robot."""
    router = APIRouter(prefix="/together", tags=["together"])

    @router.get("")
    async def maps(request: Request) -> TogetherAnswer:
        """The maps that stand together."""
        return await site.queue.run(request, lambda: together_answer(together(site)[0]))

    @router.get("/path", response_model=PathAnswer)
    async def path(request: Request, question: Annotated[WayQuestion, Query()]) -> Response:
        """Allowed speeds along a path through space; as `forcemap path --json` of the folder."""
        return await site.queue.json(request, lambda: way_answer(*together(site), question))

    return router


def drawing_routes(site: Site) -> APIRouter:
    """What only the page draws."""
    router = APIRouter(tags=["drawn"])

    @router.get("/campaigns/{name}/slices")
    def slices(name: Name, question: Annotated[State, Query()]) -> SlicesAnswer:
        """Slices of the map through a state, and the safe speed at its place."""
        return slices_answer(site.campaign_map(name), question)

    @router.get("/campaigns/{name}/workspace", response_model=CubeAnswer)
    async def workspace(request: Request, name: Name, question: Annotated[Resolution, Query()]) -> Response:
        """Predicted forces over distance, height and speed."""
        return await site.queue.json(request, lambda: cube_answer(site.campaign_map(name), question))

    @router.get("/campaigns/{name}/speeds", response_model=SpeedGrid)
    async def speeds(request: Request, name: Name, question: Annotated[Resolution, Query()]) -> Response:
        """Safe speeds of many places, as they are drawn."""
        return await site.queue.json(request, lambda: speed_grid(site.campaign_map(name), question))

    @router.get("/campaigns/{name}/task", response_model=TaskAnswer)
    async def task(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """A task of one point, or of a path: its points, allowed speeds along it and cycle times."""
        return await site.queue.json(request, lambda: task_answer(site.campaign_map(name), question))

    return router


def file_routes(site: Site) -> APIRouter:
    """Files that can be taken away."""
    router = APIRouter(prefix="/campaigns/{name}/files", tags=["files"], default_response_class=Response)

    @router.get("/map.json", responses=_file("json"))
    def map_file(name: Name) -> Response:
        """The map as a file that forcemap reads."""
        return _download(map_text(fitted_campaign(site.folder.campaign(name)).force_map), "map.json")

    @router.get("/report.html", responses=_file("html"))
    async def report(request: Request, name: Name, question: Annotated[Bounded, Query()]) -> Response:
        """The validation report for one body area."""
        text = await site.queue.run(request, lambda: report_text(site.folder.campaign(name), question, site.table))
        return _download(text, "report.html")

    @router.get("/scaling.csv", responses=_file("csv"))
    async def scaling(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """Speeds to command along a path, and the factors that they are of its programmed speed, if it has one."""
        text = await site.queue.run(request, lambda: scaling_text(site.campaign_map(name), question))
        return _download(text, "scaling.csv")

    @router.get("/speeds", responses=_file("any"))
    async def export(request: Request, name: Name, question: Annotated[Export, Query()]) -> Response:
        """Allowed speeds by zone, as a table or a robot program."""
        text = await site.queue.run(request, lambda: export_text(site.campaign_map(name), question))
        return _download(text, question.format.file)

    return router


_TYPES = {
    "json": "application/json",
    "html": "text/html; charset=utf-8",
    "csv": "text/csv; charset=utf-8",
    "md": "text/markdown; charset=utf-8",
}
_PLAIN = "text/plain; charset=utf-8"


def _file(suffix: str) -> dict[int | str, dict[str, Any]]:
    kinds = {*_TYPES.values(), _PLAIN} if suffix == "any" else {_TYPES[suffix]}
    schemas = {kind: {"schema": {"type": "object" if kind == _TYPES["json"] else "string"}} for kind in sorted(kinds)}
    return {200: {"content": schemas, "description": "A file."}}


def _download(text: str, file: str) -> Response:
    kind = _TYPES.get(file.rpartition(".")[2], _PLAIN)
    return Response(text, media_type=kind, headers={"content-disposition": f'attachment; filename="{file}"'})
