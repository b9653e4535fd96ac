"""Heavy answers take turns, in threads of their own, so that light ones never wait behind them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from fastapi import Request
from fastapi.responses import Response
from pydantic import BaseModel

from forcemap.web.refusal import Refusal

Made = TypeVar("Made")

AT_ONCE = 2
"""The most heavy answers that are made at a time."""


class Turns:
    """Turns at making something heavy, in the order of asking."""

    def __init__(self) -> None:
        self._free = asyncio.Semaphore(AT_ONCE)

    async def take(self, request: Request, make: Callable[[], Made]) -> Made:
        """What is made, once it is its turn; nothing for who no longer waits."""
        async with self._free:
            if await request.is_disconnected():
                raise Refusal(408, "gone", "nobody waits for the answer any more")
            return await asyncio.to_thread(make)

    async def json(self, request: Request, make: Callable[[], BaseModel]) -> Response:
        """An answer as JSON, written out in the same turn."""
        text = await self.take(request, lambda: make().model_dump_json())
        return Response(text, media_type="application/json")
