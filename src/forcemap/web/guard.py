"""Who may ask, and what every answer forbids: Host, Origin, size, and the headers of a page that trusts nobody."""

from __future__ import annotations

import re
import sys

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from forcemap.answers.error import ErrorAnswer
from forcemap.errors import ForcemapError
from forcemap.web.intake import LARGEST_UPLOAD, too_large
from forcemap.web.refusal import Refusal

_HOST = re.compile(r"(127\.0\.0\.1|localhost)(:\d{1,5})?")

_FETCH = ("sec-fetch-site", "sec-fetch-mode", "sec-fetch-dest")

POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "form-action 'self'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
    )
)
"""The content security policy: scripts and connections of this server alone; plotly writes style sheets of its own."""

_HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}


class Guard:
    """Refuses requests that no page of this server makes, and puts the same headers on every answer."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request or pass it on."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started = False

        async def guarded(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                headers.update(_HEADERS)
                headers.setdefault("cache-control", "no-store")
            await send(message)

        try:
            _require_own(Request(scope))
            await self.app(scope, receive, guarded)
        except Refusal as error:
            await _refused(error, error.status)(scope, receive, guarded)
        except Exception as error:  # one line for the person and one for the terminal, never a traceback
            what = " ".join(str(error).split())
            defect = ForcemapError(f"a defect of forcemap ({type(error).__name__}: {what}); please report it")
            print(f"error: {scope['path']!r}: {defect.message}", file=sys.stderr)
            if not started:
                await _refused(defect, 500)(scope, receive, guarded)


def _require_own(request: Request) -> None:
    host = request.headers.get("host", "")
    if not _HOST.fullmatch(host):
        raise Refusal(421, "host", "found another host name, expected 127.0.0.1 or localhost; open the address printed")
    for name in ("host", "origin", *_FETCH):
        if len(request.headers.getlist(name)) > 1:
            raise Refusal(403, "origin", f"found {name} more than once, expected it once; nothing was done")
    origin, (site, *visit) = request.headers.get("origin"), (request.headers.get(name, "") for name in _FETCH)
    own = site in ("", "same-origin", "none") and (origin is None or origin == f"http://{host}")
    reads, path = request.method in ("GET", "HEAD"), request.url.path
    link = reads and visit == ["navigate", "document"] and (path == "/" or path.startswith("/campaigns/"))
    if not (own or link):
        done = "" if reads else "; nothing was done"
        raise Refusal(403, "origin", f"found a request of another site, expected one of this page{done}")
    size = request.headers.get("content-length", "0")
    if not reads and size.isdecimal() and int(size) > LARGEST_UPLOAD:
        raise too_large()


def _refused(error: ForcemapError, status: int) -> Response:
    return JSONResponse(ErrorAnswer.of_error(error, remote=True).model_dump(), status)
