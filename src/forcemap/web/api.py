"""The JSON twin of every page, under /api, and the files that can be taken away."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request
from fastapi.responses import Response

from forcemap import LimitTable, map_text
from forcemap.web.campaign_answers import CampaignAnswer, Overview, campaign_answer, overview
from forcemap.web.comparison_answers import ComparisonAnswer, ComparisonQuestion, comparison_answer
from forcemap.web.downloads import Export, export_text, report_text, scaling_text
from forcemap.web.folder import Folder
from forcemap.web.held import fitted
from forcemap.web.intake import Addition, CollectAnswer, Intake, StoredAnswer, Upload
from forcemap.web.judgements import FileAnswer, TableAnswer
from forcemap.web.map_answers import CubeAnswer, MapAnswer, SlicesAnswer, cube_answer, map_answer, slices_answer
from forcemap.web.path_answers import TaskAnswer, task_answer
from forcemap.web.question import Bounded, PathQuestion, Place, Resolution, State
from forcemap.web.refusal import Refused
from forcemap.web.speed_answers import SpeedAnswer, SpeedMapAnswer, speed_answer, speed_map_answer

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


def api_router(folder: Folder, intake: Intake, table: LimitTable | None) -> APIRouter:
    """The routes of the JSON answers for the campaigns of a folder."""
    router = APIRouter(prefix="/api", responses=REFUSALS)

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
        return slices_answer(fitted(folder.campaign(name)), question, table)

    @router.get("/campaigns/{name}/workspace", tags=["map"])
    def workspace(name: Name, question: Annotated[Resolution, Query()]) -> CubeAnswer:
        """Predicted forces over distance, height and speed."""
        return cube_answer(fitted(folder.campaign(name)), question, table)

    @router.get("/campaigns/{name}/speed", tags=["speeds"])
    def speed(name: Name, question: Annotated[Place, Query()]) -> SpeedAnswer:
        """The safe speed at a place."""
        return speed_answer(fitted(folder.campaign(name)), question, table)

    @router.get("/campaigns/{name}/speeds", tags=["speeds"])
    def speeds(name: Name, question: Annotated[Resolution, Query()]) -> SpeedMapAnswer:
        """Safe speeds over the measured range."""
        return speed_map_answer(fitted(folder.campaign(name)), question, table)

    @router.get("/campaigns/{name}/compare", tags=["map"])
    def compare(name: Name, question: Annotated[ComparisonQuestion, Query()]) -> ComparisonAnswer:
        """The map beside the 2D map and the standard's contact model."""
        return comparison_answer(fitted(folder.campaign(name)), question, table)

    @router.get("/campaigns/{name}/task", tags=["speeds"])
    def task(name: Name, question: Annotated[PathQuestion, Query()]) -> TaskAnswer:
        """A task of one point, or of a path: allowed speeds along it and cycle times."""
        return task_answer(fitted(folder.campaign(name)), question, table)

    @router.get("/campaigns/{name}/files/map.json", tags=["files"], response_class=Response, responses=_file("json"))
    def map_file(name: Name) -> Response:
        """The map as a file that forcemap reads."""
        return _download(map_text(fitted(folder.campaign(name)).force_map), "map.json")

    @router.get("/campaigns/{name}/files/report.html", tags=["files"], response_class=Response, responses=_file("html"))
    def report(name: Name, question: Annotated[Bounded, Query()]) -> Response:
        """The validation report for one body area."""
        return _download(report_text(folder.campaign(name), question, table), "report.html")

    @router.get("/campaigns/{name}/files/scaling.csv", tags=["files"], response_class=Response, responses=_file("csv"))
    def scaling(name: Name, question: Annotated[PathQuestion, Query()]) -> Response:
        """Speed-scaling factors along a path with a programmed speed."""
        return _download(scaling_text(fitted(folder.campaign(name)), question, table), "scaling.csv")

    @router.get("/campaigns/{name}/files/speeds", tags=["files"], response_class=Response, responses=_file("any"))
    def export(name: Name, question: Annotated[Export, Query()]) -> Response:
        """Allowed speeds by zone, as a table or a robot program."""
        return _download(export_text(fitted(folder.campaign(name)), question, table), question.format.file)

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
    return {
        200: {"content": {each: {"schema": {"type": "string"}} for each in sorted(kinds)}, "description": "A file."}
    }


def _download(text: str, file: str) -> Response:
    kind = _TYPES.get(file.rpartition(".")[2], _PLAIN)
    return Response(text, media_type=kind, headers={"content-disposition": f'attachment; filename="{file}"'})
