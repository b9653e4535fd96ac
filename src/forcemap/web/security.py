"""Which requests are answered (Host, Origin, token, size), and the security headers of every answer."""

from __future__ import annotations

import re
import sys
from http import HTTPStatus

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from forcemap.answers.error import ErrorAnswer
from forcemap.errors import ForcemapError
from forcemap.web.admission import Admission, is_api, is_page
from forcemap.web.intake import LARGEST_UPLOAD, too_large
from forcemap.web.pages import locked_page
from forcemap.web.request_error import RequestError

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
"""The content security policy: scripts and connections of this server alone. the page without a
token, and figures, bring their style with them."""

_HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}


class SecurityMiddleware:
    """Refuses requests that no page of this server makes, and puts the same headers on every answer."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app, self.admission = app, Admission(token)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request or pass it on."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request, started = Request(scope), False

        async def guarded(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                headers.update(_HEADERS)
                headers.setdefault("cache-control", "no-store")
                if message["status"] == HTTPStatus.UNAUTHORIZED:
                    headers["www-authenticate"] = "Bearer"
            await send(message)

        try:
            _require_own(request)
            if opened := self.admission.opened(request):
                await opened(scope, receive, guarded)
                return
            self.admission.require(request)
            _require_size(request)
            await self.app(scope, receive, guarded)
        except RequestError as error:
            locked = error.status == HTTPStatus.UNAUTHORIZED and not is_api(request)
            answer = locked_page(request) if locked else _error_response(error, error.status)
            await answer(scope, receive, guarded)
        except Exception as error:  # one line for the person and one for the terminal, never a traceback
            what = " ".join(str(error).split())
            defect = ForcemapError(f"a defect of forcemap ({type(error).__name__}: {what}); please report it")
            print(f"error: {scope['path']!r}: {defect.message}", file=sys.stderr)
            if not started:
                await _error_response(defect, 500)(scope, receive, guarded)


def _require_own(request: Request) -> None:
    host = request.headers.get("host", "")
    if not _HOST.fullmatch(host):
        raise RequestError(
            421, "host", "found another host name, expected 127.0.0.1 or localhost; open the address printed"
        )
    for name in ("host", "origin", *_FETCH):
        if len(request.headers.getlist(name)) > 1:
            raise RequestError(403, "origin", f"found {name} more than once, expected it once; nothing was done")
    origin, (site, *visit) = request.headers.get("origin"), (request.headers.get(name, "") for name in _FETCH)
    own = site in ("", "same-origin", "none") and (origin is None or origin == f"http://{host}")
    link = visit == ["navigate", "document"] and is_page(request)
    if not (own or link):
        done = "" if request.method in ("GET", "HEAD") else "; nothing was done"
        raise RequestError(403, "origin", f"found a request of another site, expected one of this page{done}")


def _require_size(request: Request) -> None:
    size = request.headers.get("content-length", "0")
    if request.method not in ("GET", "HEAD") and size.isdecimal() and int(size) > LARGEST_UPLOAD:
        raise too_large()


def _error_response(error: ForcemapError, status: int) -> Response:
    return JSONResponse(ErrorAnswer.of_error(error, remote=True).model_dump(), status)
