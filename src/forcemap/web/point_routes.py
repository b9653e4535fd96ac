"""The contact points under /api: the list, what is changed in it, and the files that belong to a point."""

from __future__ import annotations

import asyncio
from pathlib import PurePosixPath
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request
from fastapi.responses import Response
from pydantic import BaseModel, Field

from forcemap.web.api import BEARER, FILE_BODY, REFUSALS, UPLOAD_REFUSALS, Name
from forcemap.web.contact_points import (
    FilmAnswer,
    PictureAnswer,
    PointChange,
    PointRecordingAnswer,
    PointsAnswer,
    change_point,
    points_answer,
    remove_point,
    store_film,
    store_photograph,
    store_recording,
)
from forcemap.web.downloads import report_zip
from forcemap.web.question import Bounded
from forcemap.web.site import Site


class PointOfList(BaseModel):
    """A point of a list that was looked at."""

    point: str = Field(description="Name of the point.", max_length=36)
    list_sha256: str = Field(description="SHA-256 of the list as it was looked at.", max_length=64)


class PointFile(PointOfList):
    """A file that belongs to a point."""

    file: str = Field(description="Name of the file, by which errors call it.", max_length=255)


class FilmFile(BaseModel):
    """A film or matrix of pressures."""

    file: str = Field(description="Name of the file: that of its run or recording.", max_length=255)


def point_router(site: Site) -> APIRouter:
    """The routes of the contact points of a site."""
    router = APIRouter(
        prefix="/api/campaigns/{name}", responses=REFUSALS, dependencies=[Depends(BEARER)], tags=["points"]
    )

    async def answered(request: Request, name: str) -> PointsAnswer:
        path = site.folder.campaign(name)
        return await site.queue.run(request, lambda: points_answer(name, path, site.table))

    @router.get("/points")
    async def points(request: Request, name: Name) -> PointsAnswer:
        """The contact points with their verdicts, what they rest on and lack."""
        return await answered(request, name)

    @router.post("/points")
    async def change(request: Request, name: Name, wanted: PointChange) -> PointsAnswer:
        """Add a point, or put it in the place of another; then as the list."""
        await asyncio.to_thread(change_point, site.folder.campaign(name), wanted, site.table)
        return await answered(request, name)

    @router.delete("/points")
    async def remove(request: Request, name: Name, of: Annotated[PointOfList, Query()]) -> PointsAnswer:
        """Take a point out of the list; its files stay."""
        await asyncio.to_thread(remove_point, site.folder.campaign(name), of.point, of.list_sha256, site.table)
        return await answered(request, name)

    @router.post("/photographs", responses=UPLOAD_REFUSALS, openapi_extra=FILE_BODY)
    async def add_photograph(request: Request, name: Name, of: Annotated[PointFile, Query()]) -> PictureAnswer:
        """Store a photograph of a point, encoded anew, and name it in the list."""
        async with site.intake.staged(request, name, ".part") as (path, staged):
            stored = (path, of.point, of.list_sha256, staged.read_bytes(), of.file)
            return await asyncio.to_thread(store_photograph, *stored)

    @router.post("/point-recordings", responses=UPLOAD_REFUSALS, openapi_extra=FILE_BODY)
    async def add_recording(request: Request, name: Name, of: Annotated[PointFile, Query()]) -> PointRecordingAnswer:
        """Store a recording that was made at a point alone, and collect the campaign."""
        async with site.intake.staged(request, name, ".part") as (path, staged):
            stored = await asyncio.to_thread(store_recording, path, of.point, of.list_sha256, staged, of.file)
        return stored.model_copy(update={"problem": await site.intake.collected(path)})

    @router.post("/pressures", responses=UPLOAD_REFUSALS, openapi_extra=FILE_BODY)
    async def add_film(request: Request, name: Name, of: Annotated[FilmFile, Query()]) -> FilmAnswer:
        """Store a film or matrix of pressures under the name of its recording, and collect the campaign."""
        async with site.intake.staged(request, name, PurePosixPath(of.file).suffix.lower()) as (path, staged):
            stored = await asyncio.to_thread(store_film, path, staged, of.file)
        return stored.model_copy(update={"problem": await site.intake.collected(path)})

    @router.get("/files/report.zip", response_class=Response, responses=_ZIP)
    async def report(request: Request, name: Name, question: Annotated[Bounded, Query()]) -> Response:
        """The validation report for one body area, with the list of its inputs beside it."""
        path = site.folder.campaign(name)
        packed = await site.queue.run(request, lambda: report_zip(path, question, site.table))
        headers = {"content-disposition": 'attachment; filename="report.zip"'}
        return Response(packed, media_type="application/zip", headers=headers)

    return router


_ZIP: dict[int | str, dict[str, object]] = {
    200: {"content": {"application/zip": {"schema": {"type": "string"}}}, "description": "A file."}
}
