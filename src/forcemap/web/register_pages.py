"""The pages of the team's register, which only read it, with their JSON twins."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from forcemap.answers.register import CellAnswer, DueAnswer, DueEntry, HeadAnswer, SiteAnswer
from forcemap.register.audit import head
from forcemap.register.connection import Register
from forcemap.register.due import DUE_WITHIN, what_is_due
from forcemap.register.schema import open_register
from forcemap.register.states import cell_state, cell_states
from forcemap.web.api import REFUSALS
from forcemap.web.pages import html_page

Cell = Annotated[str, Query(description="A cell, SITE/NAME.", max_length=500)]


def register_router(where: str) -> APIRouter:
    """The routes of a register, by what they show.

    Raises
    ------
    RegisterError
        It cannot be opened.
    """
    register, router = open_register(where), APIRouter()

    @router.get("/register", include_in_schema=False)
    def site_page(request: Request) -> Response:
        return html_page(request, "register.html", answer=site_answer(register))

    @router.get("/register/cell", include_in_schema=False)
    def cell_page(request: Request, cell: Cell) -> Response:
        return html_page(request, "register_cell.html", answer=cell_answer(register, cell))

    @router.get("/api/register", responses=REFUSALS)
    def site_twin() -> SiteAnswer:
        """All cells with their releases, and what is due."""
        return site_answer(register)

    @router.get("/api/register/cell", responses=REFUSALS)
    def cell_twin(cell: Cell) -> CellAnswer:
        """A cell with its history."""
        return cell_answer(register, cell)

    return router


def site_answer(register: Register) -> SiteAnswer:
    """All cells, and what is due."""
    found = what_is_due(register)
    with register.reading() as connection:
        newest = head(connection)
    return SiteAnswer(
        where=register.name,
        cells=[CellAnswer.of(state) for state in cell_states(register)],
        due=DueAnswer(within_days=DUE_WITHIN, due=[DueEntry.from_result(each) for each in found]),
        head=HeadAnswer(number=newest.number, sha256=newest.sha256, at=newest.at, noted=str(newest)),
    )


def cell_answer(register: Register, cell: str) -> CellAnswer:
    """A cell with its history."""
    return CellAnswer.of(*cell_state(register, cell))
