"""Connections that are closed when the head of a request is late, or when too many wait for one."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_WITHIN = 5.0
"""How long the head of a request may take to arrive [s]; a choice: it comes from the same machine."""

MOST_WAITING = 500
"""The most connections that wait for a request; of more, the one that has waited longest is closed.

A choice: browsers hold about six to a host, and a process may usually open 1,024 files.
"""


class Connection(H11Protocol):
    """HTTP over a connection that half a request cannot keep open."""

    _since = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self._wait()
        waiting = [other for other in self.connections if isinstance(other, Connection) and other._waits]
        if len(waiting) > MOST_WAITING:
            min(waiting, key=lambda connection: connection._since).transport.abort()

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
