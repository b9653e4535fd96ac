"""The web page for tests: as a person starts it in a process of its own, or in a thread; each on a free port."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from contextlib import contextmanager

import httpx

from forcemap.web.app import create_app
from forcemap.web.server import server_of

TOKEN = "the-token-of-the-tests"
PATIENCE = 300.0  # s; ends what hangs, and nothing that is slow


def bearer(token):
    """The header by which a program is let in."""
    return {"Authorization": f"Bearer {token}"}


@contextmanager
def serving(folder, *options):
    """Process, address and token of a server, killed afterwards."""
    command = [
        sys.executable,
        "-c",
        "from forcemap.cli import main; main()",
        "serve",
        str(folder),
        "--port",
        "0",
        *options,
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        said = process.stderr.readline()
        assert said.startswith("Open http://127.0.0.1:"), said
        address, token = said.split()[1].split("/?token=")
        yield process, address, token
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


@contextmanager
def client_of(folder, register=None, limit_table=""):
    """A client of the page of a folder, served in a thread."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(64)
        server = server_of(create_app(folder, token=TOKEN, register=register, limit_table=limit_table))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        address = f"http://127.0.0.1:{listening.getsockname()[1]}"
        try:
            options = {"timeout": PATIENCE, "follow_redirects": True, "trust_env": False}
            with httpx.Client(base_url=address, headers=bearer(TOKEN), **options) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join()


def contents(folder):
    """Every file below a folder, with its bytes."""
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
