"""The application: pages, their JSON twins, what they are made with, and what becomes of errors."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse, Response
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

from forcemap import ForcemapError, LimitTable, __version__
from forcemap.answers.error import ErrorAnswer
from forcemap.web.admission import is_api
from forcemap.web.api import api_router
from forcemap.web.folder import Folder
from forcemap.web.guard import Guard
from forcemap.web.intake import Intake
from forcemap.web.pages import page_router, problem_page
from forcemap.web.refusal import Refusal, status_of
from forcemap.web.turns import Turns

_DESCRIPTION = (
    "Every page of the local web page as JSON. A speed never comes alone: its outcome, limit, bound and assumptions "
    "come with it, and null is no permission."
)


def create_app(folder: str | Path, *, token: str, limit_table: LimitTable | None = None) -> FastAPI:
    """The web application for a campaign's folder, or a folder of such folders.

    Parameters
    ----------
    folder : str or Path
        What is shown; nothing outside it is read or written.
    token : str
        What every request must carry.
    limit_table : LimitTable, optional
        Table of limits; that which a campaign names, else that of ISO/TS 15066:2016, if not given.

    Raises
    ------
    InputError
        There is no such folder.
    """
    served = Folder(folder)
    intake, turns = Intake(served, limit_table), Turns()
    app = FastAPI(
        title="forcemap",
        version=__version__,
        description=_DESCRIPTION,
        openapi_url="/api/openapi.json",
        docs_url=None,  # they load their script from elsewhere
        redoc_url=None,
    )
    app.include_router(api_router(served, intake, turns, limit_table))
    app.include_router(page_router(served, intake, turns, limit_table))
    app.mount("/static", StaticFiles(packages=[("forcemap.web", "static")]))

    @app.get("/plotly.min.js", include_in_schema=False)
    def plotly() -> FileResponse:
        """The script of the installed plotly package."""
        script = files("plotly").joinpath("package_data", "plotly.min.js")
        return FileResponse(str(script), media_type="text/javascript", headers={"cache-control": "max-age=86400"})

    for kind in (ForcemapError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, _told)
    app.add_middleware(Guard, token=token)
    return app


def _told(request: Request, error: Exception) -> Response:
    """An error as JSON, or as a page where a page was asked for."""
    found = _as_ours(error)
    if is_api(request):
        return JSONResponse(ErrorAnswer.of_error(found, remote=True).model_dump(), status_of(found))
    return problem_page(request, found)


def _as_ours(error: Exception) -> ForcemapError:
    if isinstance(error, ForcemapError):
        return error
    if isinstance(error, RequestValidationError):
        first = error.errors()[0]
        shown = repr(first["input"]) if "input" in first else ""
        shown = shown if len(shown) < 80 else f"{shown[:76]}..."
        return Refusal(422, "input", f"{first['loc'][-1]}: found {shown}; {first['msg'].removeprefix('Value error, ')}")
    assert isinstance(error, HTTPException)
    message = {404: "there is no such page; the overview is at /", 405: "this address does not take that method"}
    return Refusal(error.status_code, "not_found", message.get(error.status_code, str(error.detail)))
