"""The JSON twin of every page, under /api, and the files that can be taken away."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Query, Request
from fastapi.responses import Response
from fastapi.security import HTTPBearer

from forcemap import LimitTable
from forcemap.answers.accuracy import EvaluateAnswer
from forcemap.answers.check import CheckAnswer
from forcemap.answers.collect import CollectAnswer
from forcemap.answers.comparison import ComparisonAnswer
from forcemap.answers.error import ErrorAnswer
from forcemap.answers.map import FitAnswer
from forcemap.answers.path import PathAnswer
from forcemap.answers.speed import SpeedAnswer
from forcemap.answers.speed_map import SpeedMapAnswer
from forcemap.maps.map_file import map_text
from forcemap.web.campaign_answers import CampaignAnswer, Overview, campaign_answer, overview
from forcemap.web.downloads import Export, export_text, report_text, scaling_text
from forcemap.web.folder import Folder
from forcemap.web.grids import CubeAnswer, SlicesAnswer, SpeedGrid, cube_answer, slices_answer, speed_grid
from forcemap.web.held import fitted
from forcemap.web.intake import Addition, Intake, Judged, StoredAnswer
from forcemap.web.judgements import TableAnswer
from forcemap.web.limits import limits_of
from forcemap.web.map_answers import Asked
from forcemap.web.question import Bounded, ComparisonQuestion, PathQuestion, Place, Resolution, State, Steps
from forcemap.web.task_answers import TaskAnswer, task_answer
from forcemap.web.turns import Turns

Name = Annotated[str, Path(description="Name of a campaign: that of its folder.", max_length=255)]

REFUSALS: dict[int | str, dict[str, Any]] = {
    401: {"model": ErrorAnswer, "description": "Without the token of this page."},
    403: {"model": ErrorAnswer, "description": "A request of another site."},
    404: {"model": ErrorAnswer, "description": "There is no such campaign or page."},
    409: {"model": ErrorAnswer, "description": "The campaign, as it is, cannot give the answer."},
    421: {"model": ErrorAnswer, "description": "Another host name than 127.0.0.1 or localhost."},
    422: {"model": ErrorAnswer, "description": "What was sent cannot be used."},
}
_UPLOAD_REFUSALS: dict[int | str, dict[str, Any]] = {
    408: {"model": ErrorAnswer, "description": "The file did not arrive in time."},
    413: {"model": ErrorAnswer, "description": "The file is too large."},
    415: {
        "model": ErrorAnswer,
        "description": "Neither a recording nor a table by its name, or not sent as a plain body.",
    },
}
_BEARER = HTTPBearer(auto_error=False, description="The token in the address that forcemap serve prints.")  # see Guard
_FILE = {"schema": {"type": "string", "format": "binary", "minLength": 1}}
_BODY = {"requestBody": {"required": True, "content": {"application/octet-stream": _FILE}}}


def api_router(folder: Folder, intake: Intake, turns: Turns, table: LimitTable | None) -> APIRouter:
    """The routes of the JSON answers for the campaigns of a folder."""
    router = APIRouter(prefix="/api", responses=REFUSALS, dependencies=[Depends(_BEARER)])

    def asked(name: str) -> Asked:
        path = folder.campaign(name)
        return Asked(fitted(path), limits_of(path, table))

    @router.get("/campaigns", tags=["campaigns"])
    def campaigns() -> Overview:
        """All campaigns of the folder."""
        return overview(folder)

    @router.get("/campaigns/{name}", tags=["campaigns"])
    def campaign(name: Name) -> CampaignAnswer:
        """A campaign: conditions, states done and missing, recordings."""
        return campaign_answer(name, folder.campaign(name))

    @router.post("/campaigns/{name}/judge", tags=["recordings"], responses=_UPLOAD_REFUSALS, openapi_extra=_BODY)
    async def judge(request: Request, name: Name, upload: Annotated[Judged, Query()]) -> CheckAnswer | TableAnswer:
        """Judge a recording, as forcemap check does, or an impacts table; nothing is stored."""
        return await intake.judge(request, name, upload, drawn=upload.curves)

    @router.post("/campaigns/{name}/recordings", tags=["recordings"], responses=_UPLOAD_REFUSALS, openapi_extra=_BODY)
    async def add(request: Request, name: Name, addition: Annotated[Addition, Query()]) -> StoredAnswer:
        """Judge a recording, store it under the name of its run and collect the campaign."""
        return await intake.add(request, name, addition)

    @router.post("/campaigns/{name}/collect", tags=["recordings"])
    async def collect(name: Name) -> CollectAnswer:
        """Read and judge all recordings of a campaign, and write its impacts table."""
        return await intake.collect(name)

    @router.get("/campaigns/{name}/map", tags=["map"])
    def force_map(name: Name) -> FitAnswer:
        """The collision-force map: coefficients, accuracy, measured states; as `forcemap fit --json`."""
        return asked(name).fit()

    @router.get("/campaigns/{name}/evaluate", tags=["map"])
    def evaluate(name: Name) -> EvaluateAnswer:
        """How far its predictions are from measured forces; as `forcemap evaluate --json`."""
        return asked(name).evaluate()

    @router.get("/campaigns/{name}/compare", tags=["map"], response_model=ComparisonAnswer)
    async def compare(request: Request, name: Name, question: Annotated[ComparisonQuestion, Query()]) -> Response:
        """The map beside the 2D map and the standard's contact model; as `forcemap compare --json`."""
        return await turns.json(request, lambda: asked(name).compare(question))

    @router.get("/campaigns/{name}/speed", tags=["speeds"])
    def speed(name: Name, question: Annotated[Place, Query()]) -> SpeedAnswer:
        """The safe speed at a place; as `forcemap speed --json`."""
        return asked(name).speed(question)

    @router.get("/campaigns/{name}/speed-map", tags=["speeds"], response_model=SpeedMapAnswer)
    async def speed_map(request: Request, name: Name, question: Annotated[Steps, Query()]) -> Response:
        """Safe speeds on a grid of places; as `forcemap speed-map --json`."""
        return await turns.json(request, lambda: asked(name).speed_map(question))

    @router.get("/campaigns/{name}/path", tags=["speeds"], response_model=PathAnswer)
    async def path(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """Allowed speeds along a path of two or more points; as `forcemap path --json`."""
        return await turns.json(request, lambda: asked(name).path(question))

    @router.get("/campaigns/{name}/slices", tags=["drawn"])
    def slices(name: Name, question: Annotated[State, Query()]) -> SlicesAnswer:
        """Slices of the map through a state, and the safe speed at its place."""
        return slices_answer(asked(name), question)

    @router.get("/campaigns/{name}/workspace", tags=["drawn"], response_model=CubeAnswer)
    async def workspace(request: Request, name: Name, question: Annotated[Resolution, Query()]) -> Response:
        """Predicted forces over distance, height and speed."""
        return await turns.json(request, lambda: cube_answer(asked(name), question))

    @router.get("/campaigns/{name}/speeds", tags=["drawn"], response_model=SpeedGrid)
    async def speeds(request: Request, name: Name, question: Annotated[Resolution, Query()]) -> Response:
        """Safe speeds of many places, as they are drawn."""
        return await turns.json(request, lambda: speed_grid(asked(name), question))

    @router.get("/campaigns/{name}/task", tags=["drawn"], response_model=TaskAnswer)
    async def task(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """A task of one point, or of a path: its points, allowed speeds along it and cycle times."""
        return await turns.json(request, lambda: task_answer(asked(name), question))

    @router.get("/campaigns/{name}/files/map.json", tags=["files"], response_class=Response, responses=_file("json"))
    def map_file(name: Name) -> Response:
        """The map as a file that forcemap reads."""
        return _download(map_text(fitted(folder.campaign(name)).force_map), "map.json")

    @router.get("/campaigns/{name}/files/report.html", tags=["files"], response_class=Response, responses=_file("html"))
    async def report(request: Request, name: Name, question: Annotated[Bounded, Query()]) -> Response:
        """The validation report for one body area."""
        text = await turns.take(request, lambda: report_text(folder.campaign(name), question, table))
        return _download(text, "report.html")

    @router.get("/campaigns/{name}/files/scaling.csv", tags=["files"], response_class=Response, responses=_file("csv"))
    async def scaling(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """Speed-scaling factors along a path with a programmed speed."""
        return _download(await turns.take(request, lambda: scaling_text(asked(name), question)), "scaling.csv")

    @router.get("/campaigns/{name}/files/speeds", tags=["files"], response_class=Response, responses=_file("any"))
    async def export(request: Request, name: Name, question: Annotated[Export, Query()]) -> Response:
        """Allowed speeds by zone, as a table or a robot program."""
        return _download(await turns.take(request, lambda: export_text(asked(name), question)), question.format.file)

    return router


_TYPES = {
    "json": "application/json",
    "html": "text/html; charset=utf-8",
    "csv": "text/csv; charset=utf-8",
    "md": "text/markdown; charset=utf-8",
}
_PLAIN = "text/plain; charset=utf-8"


def _file(kind: str) -> dict[int | str, dict[str, Any]]:
    kinds = {*_TYPES.values(), _PLAIN} if kind == "any" else {_TYPES[kind]}
    schemas = {each: {"schema": {"type": "object" if each == _TYPES["json"] else "string"}} for each in sorted(kinds)}
    return {200: {"content": schemas, "description": "A file."}}


def _download(text: str, file: str) -> Response:
    kind = _TYPES.get(file.rpartition(".")[2], _PLAIN)
    return Response(text, media_type=kind, headers={"content-disposition": f'attachment; filename="{file}"'})
