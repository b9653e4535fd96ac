"""The application: pages, their JSON twins, static files, and the answers to errors."""

from __future__ import annotations

from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

from forcemap import ForcemapError, __version__
from forcemap.answers.error import ErrorAnswer
from forcemap.web.admission import is_api
from forcemap.web.api import api_router
from forcemap.web.folder import Folder
from forcemap.web.intake import Intake
from forcemap.web.pages import page_router, problem_page
from forcemap.web.point_routes import point_router
from forcemap.web.request_error import RequestError, status_of
from forcemap.web.security import SecurityMiddleware
from forcemap.web.site import Site
from forcemap.web.work_queue import WorkQueue

_DESCRIPTION = (
    "Every page of the local web page as JSON. A speed never comes alone: its outcome, limit, bound and assumptions "
    "come with it, and null is no permission."
)

_LONGEST_SHOWN = 80
"""Characters of a wrong input that an error repeats; a choice: the error stays one line."""


def create_app(folder: str | Path, *, token: str, limit_table: str = "", register: str | None = None) -> FastAPI:
    """The web application for a campaign's folder, or a folder of such folders.

    Parameters
    ----------
    folder : str or Path
        What is shown; nothing outside it is read or written.
    token : str
        What every request must carry.
    limit_table : str, optional
        File of a table of limits; if not given, the one that a campaign names, else that of ISO/TS 15066:2016.
    register : str, optional
        The team's register, whose pages are then there, too.

    Raises
    ------
    InputError
        There is no such folder, or no such register.
    """
    served = Folder(folder)
    site = Site(served, Intake(served, limit_table), WorkQueue(), limit_table)
    app = FastAPI(
        title="forcemap",
        version=__version__,
        description=_DESCRIPTION,
        openapi_url="/api/openapi.json",
        docs_url=None,  # they load their script from elsewhere
        redoc_url=None,
    )
    app.include_router(api_router(site))
    app.include_router(point_router(site))
    app.include_router(page_router(site))
    if register is not None:
        from forcemap.web.register_pages import register_router  # needs an extra of its own

        app.include_router(register_router(register))
    app.mount("/static", StaticFiles(packages=[("forcemap.web", "static")]))

    for kind in (ForcemapError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, _error_response)
    app.add_middleware(SecurityMiddleware, token=token)
    return app


def _error_response(request: Request, error: Exception) -> Response:
    """An error as JSON, or as a page where a page was asked for."""
    problem = _forcemap_error(error)
    if is_api(request):
        return JSONResponse(ErrorAnswer.of_error(problem, remote=True).model_dump(), status_of(problem))
    return problem_page(request, problem)


def _forcemap_error(error: Exception) -> ForcemapError:
    if isinstance(error, ForcemapError):
        return error
    if isinstance(error, RequestValidationError):
        first = error.errors()[0]
        shown = repr(first["input"]) if "input" in first else ""
        shown = shown if len(shown) < _LONGEST_SHOWN else f"{shown[: _LONGEST_SHOWN - 4]}..."
        return RequestError(
            422, "input", f"{first['loc'][-1]}: found {shown}; {first['msg'].removeprefix('Value error, ')}"
        )
    assert isinstance(error, HTTPException)
    message = {404: "there is no such page; the overview is at /", 405: "this address does not take that method"}
    return RequestError(error.status_code, "not_found", message.get(error.status_code, str(error.detail)))
