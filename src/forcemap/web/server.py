"""The server of the page, on loopback alone."""

from __future__ import annotations

import errno
import socket
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import uvicorn
from fastapi import FastAPI

from forcemap import InputError, force_limit
from forcemap.web.admission import TOKEN, new_token
from forcemap.web.app import create_app
from forcemap.web.connection import Connection
from forcemap.web.folder import Folder
from forcemap.web.limits import given_table
from forcemap.web.overview import overview
from forcemap.web.question import Area

LOOPBACK = "127.0.0.1"

_BACKLOG = 128
"""Connections that wait to be accepted; the usual size, a browser opens about six."""

_SHUTDOWN = 5
"""How long answers under way may go on after Ctrl-C [s]; a choice."""


def serve(
    folder: str | Path,
    *,
    port: int,
    host: str,
    area: str | None = None,
    limit_table: str = "",
    register: str | None = None,
    ready: Callable[[str], None] = lambda address: None,
) -> None:
    """Serve the page of a folder until it is interrupted.

    Parameters
    ----------
    folder : str or Path
        A campaign's folder or a folder of campaigns.
    port : int
        Port; 0 takes a free one.
    host : str
        127.0.0.1 or localhost; no other machine may reach the page.
    area : str, optional
        Body area or region with which the page opens; if not given, that of the first contact point, or it asks.
    limit_table : str, optional
        File of a table of limits; if not given, the one that a campaign names, else that of ISO/TS 15066:2016.
    register : str, optional
        The team's register, to be shown as well.
    ready : callable, optional
        Called with the address of the page, which carries its token.

    Raises
    ------
    InputError
        Another address, a port that is taken, no such folder, body area, table or register.
    """
    table = given_table(limit_table)
    opened = {} if area is None else {"area": force_limit(area, table=table).name}
    if host not in (LOOPBACK, "localhost"):
        raise InputError(f"host: found {host!r}, expected {LOOPBACK}; the page stays on this machine")
    token = new_token()
    app = create_app(folder, token=token, limit_table=limit_table, register=register)
    served = Folder(folder)
    warmed = partial(overview, served, table, Area.model_validate(opened))
    threading.Thread(target=warmed, daemon=True).start()  # the first page waits for less
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((LOOPBACK, port))
        except OSError as error:
            taken = error.errno == errno.EADDRINUSE
            message = "it is taken; choose another with --port" if taken else f"cannot be used ({error.strerror})"
            raise InputError(f"port {port}: {message}") from error
        listening.listen(_BACKLOG)
        ready(f"http://{LOOPBACK}:{listening.getsockname()[1]}/?{urlencode({TOKEN: token} | opened)}")
        server_of(app).run(sockets=[listening])


def server_of(app: FastAPI) -> uvicorn.Server:
    """The server of an application: HTTP alone; it logs errors of its own only."""
    quiet: dict[str, Any] = {"log_level": "error", "access_log": False, "server_header": False}
    return uvicorn.Server(uvicorn.Config(app, http=Connection, ws="none", timeout_graceful_shutdown=_SHUTDOWN, **quiet))
