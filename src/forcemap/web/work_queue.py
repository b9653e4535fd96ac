"""Slow answers wait in a queue and run in threads of their own, so that quick ones never wait behind them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from fastapi import Request
from fastapi.responses import Response
from pydantic import BaseModel

from forcemap.web.request_error import RequestError

_Result = TypeVar("_Result")

PARALLEL_ANSWERS = 2
"""Slow answers computed at the same time; a choice, for a page that serves one person (docs/decisions.md)."""


class WorkQueue:
    """Computes slow answers a few at a time, in the order in which they are asked for."""

    def __init__(self) -> None:
        self._free = asyncio.Semaphore(PARALLEL_ANSWERS)

    async def run(self, request: Request, compute: Callable[[], _Result]) -> _Result:
        """Compute an answer when its turn has come.

        Raises
        ------
        RequestError
            The request was given up while it waited.
        """
        async with self._free:
            if await request.is_disconnected():
                raise RequestError(408, "gone", "nobody waits for the answer any more")
            return await asyncio.to_thread(compute)

    async def json(self, request: Request, compute: Callable[[], BaseModel]) -> Response:
        """An answer as JSON, serialised in the same turn."""
        text = await self.run(request, lambda: compute().model_dump_json())
        return Response(text, media_type="application/json")
