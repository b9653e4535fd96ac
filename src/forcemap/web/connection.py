"""A connection that waits for the head of a request only so long, and of which only so many wait."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_WITHIN = 5.0
"""How long the head of a request may take to arrive [s]."""

MOST_WAITING = 500
"""The most connections that wait for one; of more, that which waits longest is closed."""


class Connection(H11Protocol):
    """HTTP over a connection that nobody keeps open with half a request."""

    _since = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self._wait()
        waiting = [each for each in self.connections if isinstance(each, Connection) and each._waits]
        if len(waiting) > MOST_WAITING:
            min(waiting, key=lambda each: each._since).transport.abort()

    def on_response_complete(self) -> None:
        """Wait for the next one."""
        self._wait()
        super().on_response_complete()

    @property
    def _waits(self) -> bool:
        return self.cycle is None or self.cycle.response_complete

    def _wait(self) -> None:
        self._since = since = self.loop.time()

        def end() -> None:
            if self._waits and self._since == since:
                self.transport.close()

        self.loop.call_later(HEAD_WITHIN, end)
