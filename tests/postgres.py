"""A PostgreSQL server of the machine's own package, for a run of tests: a socket in a folder that is deleted after."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import tempfile
from pathlib import Path

PROGRAMS = next(iter(sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)), None) or (
    Path(found).resolve().parent if (found := shutil.which("postgres")) else None
)
REASON = "no PostgreSQL server is installed (Debian's package postgresql)"
_QUICK = "-c fsync=off -c max_connections=200 -c listen_addresses='' -c shared_buffers=64MB -c autovacuum=off"


class Server:
    """A running server; its superuser is the one that owns the register."""

    def __init__(self, options=_QUICK):
        self.home = Path(tempfile.mkdtemp(prefix="forcemap-pg-"))
        self.options = f"{options} -k {self.home}"
        self._as = ()
        if os.getuid() == 0:  # the server refuses to run as root
            account = next(name for name in ("postgres", "nobody") if _known(name))
            shutil.chown(self.home, account)
            self._as = ("setpriv", f"--reuid={account}", f"--regid={pwd.getpwnam(account).pw_gid}", "--clear-groups")
        self.home.chmod(0o755)
        self._run(
            "initdb", "-U", "owner", "-A", "trust", "-E", "UTF8", "--locale=C.UTF-8", "--no-sync", "-D", self.data
        )
        self.start()

    @property
    def data(self):
        return self.home / "data"

    def _run(self, program, *arguments):
        command = [*self._as, PROGRAMS / program, *arguments]
        subprocess.run([str(each) for each in command], check=True, cwd=self.home, stdout=subprocess.DEVNULL)

    def start(self):
        self._run("pg_ctl", "-D", self.data, "-o", self.options, "-w", "-l", self.home / "log", "start")

    def stop(self, mode="immediate"):
        self._run("pg_ctl", "-D", self.data, "-m", mode, "-w", "stop")

    def url(self, database, user="owner"):
        return f"postgresql://{user}@/{database}?host={self.home}"

    def new(self, database):
        self._run("createdb", "-h", self.home, "-U", "owner", database)
        return self.url(database)

    def close(self):
        self.stop()
        shutil.rmtree(self.home, ignore_errors=True)


def _known(name):
    try:
        return bool(pwd.getpwnam(name))
    except KeyError:
        return False
