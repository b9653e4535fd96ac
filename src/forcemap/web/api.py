"""The JSON twin of every page, under /api, and the files that can be taken away."""

from __future__ import annotations

import pathlib
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Path, Query, Request
from fastapi.responses import Response

from forcemap import LimitTable, map_text
from forcemap.web.campaign_answers import CampaignAnswer, Overview, campaign_answer, overview
from forcemap.web.comparison_answers import ComparisonAnswer, ComparisonQuestion, comparison_answer
from forcemap.web.downloads import Export, export_text, report_text, scaling_text
from forcemap.web.folder import Folder
from forcemap.web.held import Fitted, fitted
from forcemap.web.intake import Addition, CollectAnswer, Intake, StoredAnswer, Upload
from forcemap.web.judgements import FileAnswer, TableAnswer
from forcemap.web.limits import Limits, limits_of
from forcemap.web.map_answers import CubeAnswer, MapAnswer, SlicesAnswer, cube_answer, map_answer, slices_answer
from forcemap.web.path_answers import TaskAnswer, task_answer
from forcemap.web.question import Area, Bounded, PathQuestion, Place, Resolution, State
from forcemap.web.refusal import Refused
from forcemap.web.speed_answers import SpeedAnswer, SpeedMapAnswer, speed_answer, speed_map_answer
from forcemap.web.turns import Turns

Asked = TypeVar("Asked", bound=Area)
Name = Annotated[str, Path(description="Name of a campaign: that of its folder.", max_length=255)]

REFUSALS: dict[int | str, dict[str, Any]] = {
    403: {"model": Refused, "description": "A request of another site."},
    404: {"model": Refused, "description": "There is no such campaign or page."},
    409: {"model": Refused, "description": "The campaign, as it is, cannot give the answer."},
    421: {"model": Refused, "description": "Another host name than 127.0.0.1 or localhost."},
    422: {"model": Refused, "description": "What was sent cannot be used."},
}
_UPLOAD_REFUSALS: dict[int | str, dict[str, Any]] = {
    408: {"model": Refused, "description": "The file did not arrive in time."},
    413: {"model": Refused, "description": "The file is too large."},
    415: {"model": Refused, "description": "Neither a recording nor a table by its name, or not sent as a plain body."},
}
_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary", "minLength": 1}}},
    }
}


def api_router(folder: Folder, intake: Intake, turns: Turns, table: LimitTable | None) -> APIRouter:
    """The routes of the JSON answers for the campaigns of a folder."""
    router = APIRouter(prefix="/api", responses=REFUSALS)

    def home(name: str) -> tuple[pathlib.Path, Limits]:
        path = folder.campaign(name)
        return path, limits_of(path, table)

    def ready(name: str) -> tuple[Fitted, Limits]:
        path, limits = home(name)
        return fitted(path), limits

    def asked(name: str, question: Asked) -> tuple[Fitted, Asked, Limits]:
        found, limits = ready(name)
        return found, question, limits

    @router.get("/campaigns", tags=["campaigns"])
    def campaigns() -> Overview:
        """All campaigns of the folder."""
        return overview(folder)

    @router.get("/campaigns/{name}", tags=["campaigns"])
    def campaign(name: Name) -> CampaignAnswer:
        """A campaign: conditions, states done and missing, recordings."""
        return campaign_answer(name, folder.campaign(name))

    @router.post("/campaigns/{name}/judge", tags=["recordings"], responses=_UPLOAD_REFUSALS, openapi_extra=_BODY)
    async def judge(request: Request, name: Name, upload: Annotated[Upload, Query()]) -> FileAnswer | TableAnswer:
        """Judge a recording or an impacts table; nothing is stored."""
        return await intake.judge(request, name, upload.file, upload)

    @router.post("/campaigns/{name}/recordings", tags=["recordings"], responses=_UPLOAD_REFUSALS, openapi_extra=_BODY)
    async def add(request: Request, name: Name, addition: Annotated[Addition, Query()]) -> StoredAnswer:
        """Judge a recording, store it under the name of its run and collect the campaign."""
        return await intake.add(request, name, addition.file, addition.run, addition)

    @router.post("/campaigns/{name}/collect", tags=["recordings"])
    async def collect(name: Name) -> CollectAnswer:
        """Read and judge all recordings of a campaign, and write its impacts table."""
        return await intake.collect(name)

    @router.get("/campaigns/{name}/map", tags=["map"])
    def force_map(name: Name) -> MapAnswer:
        """The collision-force map: coefficients, accuracy, measured states."""
        return map_answer(fitted(folder.campaign(name)))

    @router.get("/campaigns/{name}/slices", tags=["map"])
    def slices(name: Name, question: Annotated[State, Query()]) -> SlicesAnswer:
        """Slices of the map through a state, and the safe speed at its place."""
        found, limits = ready(name)
        return slices_answer(found, question, limits)

    @router.get("/campaigns/{name}/workspace", tags=["map"], response_model=CubeAnswer)
    async def workspace(request: Request, name: Name, question: Annotated[Resolution, Query()]) -> Response:
        """Predicted forces over distance, height and speed."""
        return await turns.json(request, lambda: cube_answer(*asked(name, question)))

    @router.get("/campaigns/{name}/speed", tags=["speeds"])
    def speed(name: Name, question: Annotated[Place, Query()]) -> SpeedAnswer:
        """The safe speed at a place."""
        found, limits = ready(name)
        return speed_answer(found, question, limits)

    @router.get("/campaigns/{name}/speeds", tags=["speeds"], response_model=SpeedMapAnswer)
    async def speeds(request: Request, name: Name, question: Annotated[Resolution, Query()]) -> Response:
        """Safe speeds over the measured range."""
        return await turns.json(request, lambda: speed_map_answer(*asked(name, question)))

    @router.get("/campaigns/{name}/compare", tags=["map"], response_model=ComparisonAnswer)
    async def compare(request: Request, name: Name, question: Annotated[ComparisonQuestion, Query()]) -> Response:
        """The map beside the 2D map and the standard's contact model."""
        return await turns.json(request, lambda: comparison_answer(*asked(name, question)))

    @router.get("/campaigns/{name}/task", tags=["speeds"], response_model=TaskAnswer)
    async def task(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """A task of one point, or of a path: allowed speeds along it and cycle times."""
        return await turns.json(request, lambda: task_answer(*asked(name, question)))

    @router.get("/campaigns/{name}/files/map.json", tags=["files"], response_class=Response, responses=_file("json"))
    def map_file(name: Name) -> Response:
        """The map as a file that forcemap reads."""
        return _download(map_text(fitted(folder.campaign(name)).force_map), "map.json")

    @router.get("/campaigns/{name}/files/report.html", tags=["files"], response_class=Response, responses=_file("html"))
    async def report(request: Request, name: Name, question: Annotated[Bounded, Query()]) -> Response:
        """The validation report for one body area."""

        def made() -> str:
            path, limits = home(name)
            return report_text(path, question, limits)

        return _download(await turns.take(request, made), "report.html")

    @router.get("/campaigns/{name}/files/scaling.csv", tags=["files"], response_class=Response, responses=_file("csv"))
    async def scaling(request: Request, name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """Speed-scaling factors along a path with a programmed speed."""
        return _download(await turns.take(request, lambda: scaling_text(*asked(name, question))), "scaling.csv")

    @router.get("/campaigns/{name}/files/speeds", tags=["files"], response_class=Response, responses=_file("any"))
    async def export(request: Request, name: Name, question: Annotated[Export, Query()]) -> Response:
        """Allowed speeds by zone, as a table or a robot program."""
        return _download(await turns.take(request, lambda: export_text(*asked(name, question))), question.format.file)

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
