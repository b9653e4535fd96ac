"""The web page for tests: as a person starts it in a process of its own, or in a thread; each on a free port."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from contextlib import contextmanager

import httpx
import uvicorn

from forcemap.web.app import create_app

PATIENCE = 300.0  # s; ends what hangs, and nothing that is slow


@contextmanager
def serving(folder):
    """Process and address of a server, killed afterwards."""
    command = [sys.executable, "-c", "from forcemap.cli import main; main()", "serve", str(folder), "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        said = process.stderr.readline()
        assert said.startswith("Open http://127.0.0.1:"), said
        yield process, said.split()[1].rstrip("/")
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


@contextmanager
def client_of(folder):
    """A client of the page of a folder, served in a thread."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(64)
        server = uvicorn.Server(uvicorn.Config(create_app(folder), log_level="error"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        address = f"http://127.0.0.1:{listening.getsockname()[1]}"
        try:
            with httpx.Client(base_url=address, timeout=PATIENCE, follow_redirects=True, trust_env=False) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join()


def contents(folder):
    """Every file below a folder, with its bytes."""
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
