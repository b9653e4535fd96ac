"""Who is let in: a person by the token in the address that is printed, then by a cookie; a program by a header."""

from __future__ import annotations

import secrets
from urllib.parse import unquote, urlencode

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from forcemap.web.request_error import RequestError

TOKEN = "token"
"""The parameter of an address that carries the token."""

WHERE = "open the address that forcemap serve printed where it was started; it carries the token of this page"


def new_token() -> str:
    """A token that nobody can guess, for one run of the server."""
    return secrets.token_urlsafe(32)


def is_page(request: Request) -> bool:
    """Whether a request is a visit to a page, as a link makes it."""
    path = request.url.path
    return request.method in ("GET", "HEAD") and (path == "/" or path.startswith("/campaigns/"))


def is_api(request: Request) -> bool:
    """Whether a request is answered to a program rather than a person."""
    path = request.url.path
    return path.startswith(("/api/", "/static/")) or path == "/api"


class Admission:
    """The token of a server, and the cookie that browsers get for it: another secret, so no answer holds the token.

    Parameters
    ----------
    token : str
    """

    def __init__(self, token: str) -> None:
        self._token, self._cookie = token, new_token()

    def opened(self, request: Request) -> Response | None:
        """A redirect to the same page without the token that sets the cookie; None if the address carries no token.

        An outdated token in the address of a browser that has the cookie is removed too.
        """
        stated = request.query_params.get(TOKEN)
        if stated is None or not is_page(request) or not (_same(stated, self._token) or self._has_cookie(request)):
            return None
        others = urlencode([(key, value) for key, value in request.query_params.multi_items() if key != TOKEN])
        path = request.scope["raw_path"].decode("ascii")
        opened = RedirectResponse(f"{path}?{others}" if others else path, 303)
        opened.set_cookie(_cookie_name(request), self._cookie, httponly=True, samesite="strict")
        return opened

    def require(self, request: Request) -> None:
        """Refuse a request without cookie and header, or with the token in its address, which an error would repeat.

        Raises
        ------
        RequestError
        """
        scheme, _, stated = request.headers.get("authorization", "").partition(" ")
        by_header = scheme.lower() == "bearer" and _same(stated, self._token)
        if not (by_header or self._has_cookie(request)) or self._token in unquote(str(request.url)):
            program = "a program sends it as the header 'Authorization: Bearer TOKEN'"
            raise RequestError(
                401, "token", f"found no token of this page, or that of an earlier start; {WHERE}; {program}"
            )

    def _has_cookie(self, request: Request) -> bool:
        return _same(request.cookies.get(_cookie_name(request), ""), self._cookie)


def _cookie_name(request: Request) -> str:
    """The name holds the port, because browsers share cookies between the ports of a host."""
    return f"forcemap-{request.scope['server'][1]}"


def _same(stated: str, secret: str) -> bool:
    return secrets.compare_digest(stated.encode(), secret.encode())
