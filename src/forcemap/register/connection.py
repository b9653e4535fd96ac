"""A connection to a register: SQLite in a file of this machine, PostgreSQL by URL; who writes does so alone."""

from __future__ import annotations

import os
import re
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self
from urllib.parse import parse_qsl, urlsplit

from sqlalchemy import Connection, Engine, QueuePool, create_engine, event, exc, text

from forcemap.errors import InputError, MissingExtra, RegisterError, one_line

REGISTER_VARIABLE = "FORCEMAP_REGISTER"
FILE = "register.sqlite"
_ALONE = 0x666F7263656D6170  # "forcemap": the advisory lock that whoever writes holds
_PATIENCE = 60  # s to wait for whoever writes; a choice, some hundred times what one entry takes
_NETWORK = {
    *("nfs", "nfs4", "cifs", "smb", "smb3", "smbfs", "ncpfs", "9p", "afs", "ceph", "glusterfs", "lustre", "gpfs"),
    *("beegfs", "orangefs", "pvfs2", "ocfs2", "gfs2", "davfs", "coda", "vboxsf", "vmhgfs", "prl_fs", "drvfs", "acfs"),
}
_SCHEME = re.compile(r"postgres(ql)?(\+\w+)?://", re.IGNORECASE)
_TLS = ("require", "verify-ca", "verify-full")
_LOOPBACK = ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True, eq=False)
class Register:
    """An open register; with `with` its connections are closed in the end.

    Parameters
    ----------
    name : str
        The file, or the URL, which has no password.
    engine : Engine
    time : callable, optional
        A clock in place of the server's or the machine's, for simulations.
    """

    name: str
    engine: Engine
    time: Callable[[], datetime] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.engine.dispose()

    @property
    def postgresql(self) -> bool:
        """True for PostgreSQL, False for SQLite."""
        return self.engine.dialect.name == "postgresql"

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that only reads, and sees one state of the register.

        Raises
        ------
        RegisterError
            What the database says is wrong.
        """
        options: dict[str, Any] = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
        with self._spoken(), self.engine.connect() as connection:
            connection = connection.execution_options(**(options if self.postgresql else {}))
            with connection.begin():
                yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that no other writes beside; all of it is kept, on the disk, or nothing.

        Raises
        ------
        RegisterError
            What the database says is wrong; nothing of the transaction was kept, unless the connection was lost while
            it ended.
        """
        with self._spoken(), self.engine.connect() as connection:
            connection = connection.execution_options(alone=True)
            with connection.begin():
                if self.postgresql:
                    connection.execute(text(f"set local lock_timeout = '{_PATIENCE}s'"))
                    connection.execute(text(f"select pg_advisory_xact_lock({_ALONE})"))
                yield connection

    @contextmanager
    def _spoken(self) -> Iterator[None]:
        try:
            yield
        except exc.DBAPIError as error:
            raise RegisterError(_words(error, postgresql=self.postgresql), file=self.name) from None
        except exc.SQLAlchemyError as error:
            raise RegisterError(f"cannot be used ({one_line(str(error))})", file=self.name) from None

    def clock(self, connection: Connection) -> str:
        """The time now: the server's, else this machine's."""
        if self.time is not None:
            return time_text(self.time().astimezone(UTC))
        if self.postgresql:
            now: datetime = connection.execute(text("select clock_timestamp()")).scalar_one()
            return time_text(now.astimezone(UTC))
        return time_text(datetime.now(UTC))


def time_text(time: datetime) -> str:
    """A time in UTC as the register keeps it."""
    return time.strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def default_register() -> str:
    """Where the register is if none is named: FORCEMAP_REGISTER, else a file in the account's folder of data."""
    named = os.environ.get(REGISTER_VARIABLE)
    home = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return named or str(Path(home, "forcemap", FILE))


def connect(where: str | None = None, *, new: bool = False) -> Register:
    """Connect to a register, whatever schema it has.

    Parameters
    ----------
    where : str, optional
        File of SQLite, or URL of PostgreSQL without a password; `default_register()` if not given.
    new : bool
        True to make a file that is not there.

    Raises
    ------
    InputError
        A password in the URL, no TLS to another machine, a file that is not there or lies on a network file system.
    MissingExtra
        PostgreSQL's driver is not installed.
    """
    name = where or default_register()
    if _SCHEME.match(name):
        return _postgresql(name)
    if "://" in name:
        raise InputError("register: found another URL, expected a file or postgresql://HOST/DATABASE")
    path = Path(name)
    if (kind := file_system(path)) and is_network(kind):
        remedy = "keep the file on a disk of this machine, or use PostgreSQL: --register postgresql://HOST/DATABASE"
        raise InputError(f"lies on a network file system ({kind}), where SQLite loses data; {remedy}", file=name)
    if not new and not path.is_file():
        raise InputError("there is no such register; forcemap register init makes it", file=name)
    try:
        if new:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be made ({getattr(error, 'strerror', error)})", file=name) from None
    return Register(name, _sqlite(path, new=new))


def _sqlite(path: Path, *, new: bool) -> Engine:
    settings = ["foreign_keys = on", "synchronous = full", "recursive_triggers = on", "cache_size = -65536"]
    settings += ["journal_mode = wal"] if new else []

    def connected() -> sqlite3.Connection:
        connection = sqlite3.connect(path, timeout=_PATIENCE, isolation_level=None, check_same_thread=False)
        for setting in settings:
            connection.execute(f"pragma {setting}").fetchone()
        return connection

    engine = create_engine("sqlite://", creator=connected, poolclass=QueuePool, hide_parameters=True)

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:  # the driver's own would begin late, and never before a new table
        alone = connection.get_execution_options().get("alone", False)
        connection.exec_driver_sql("begin immediate" if alone else "begin")

    return engine


def file_system(path: Path, mounts: str | None = None) -> str:
    """The type of the file system that a file is or would be on; empty where the machine does not tell.

    Parameters
    ----------
    path : Path
    mounts : str, optional
        What is mounted, as in /proc/self/mounts, which is read if it is not given.
    """
    if mounts is None:
        try:
            mounts = Path("/proc/self/mounts").read_text(errors="surrogateescape")
        except OSError:
            return ""
    wanted, longest, kind = Path(os.path.realpath(path)), -1, ""
    for line in mounts.splitlines():
        fields = line.split(" ")
        if len(fields) > 2:
            place = Path(re.sub(r"\\(\d{3})", lambda code: chr(int(code[1], 8)), fields[1]))
            if wanted.is_relative_to(place) and len(place.parts) >= longest:  # the last one covers those before it
                longest, kind = len(place.parts), fields[2]
    return kind


def is_network(kind: str) -> bool:
    """True for a type of file systems that other machines share, or that may be one."""
    return kind in _NETWORK or (kind.startswith("fuse.") and kind != "fuse.portal")


def _postgresql(url: str) -> Register:
    try:
        parts = urlsplit(url)
        query = dict(parse_qsl(parts.query, keep_blank_values=True))
        host, secret = parts.hostname or "", parts.password
        _ = parts.port
    except ValueError:
        raise InputError("register: not a URL, expected postgresql://HOST/DATABASE") from None
    if secret is not None or {"password", "sslpassword"} & query.keys():  # it would stand in the shell's history
        remedy = "put it into a password file (~/.pgpass), a service file (?service=NAME) or PGPASSWORD"
        raise InputError(f"register: found a password in the URL; {remedy}")
    if "@" in parts.path or "/" in parts.path.strip("/"):
        raise InputError("register: not a URL, expected postgresql://USER@HOST/DATABASE")
    named = f"{query.get('host') or host or os.environ.get('PGHOST', '')},{query.get('hostaddr', '')}".split(",")
    remote = any(each and not is_local(each) for each in named)
    mode = query.get("sslmode")
    if remote and mode is not None and mode not in _TLS:
        raise InputError(f"register: found sslmode={mode}, expected one of {', '.join(_TLS)} to another machine")
    if remote and mode is None:
        query["sslmode"] = "verify-full"
        query.setdefault("sslrootcert", os.environ.get("PGSSLROOTCERT", "system"))
    try:
        engine = create_engine(
            _SCHEME.sub("postgresql+psycopg://", parts._replace(query="").geturl(), count=1),
            connect_args={"connect_timeout": "10", "application_name": "forcemap"} | query,
            hide_parameters=True,
            pool_pre_ping=True,
        )
    except ModuleNotFoundError as error:
        raise MissingExtra(
            f"this needs the package {error.name}; install it from the project's folder: {POSTGRES}"
        ) from None
    except exc.SQLAlchemyError:
        raise InputError("register: not a URL, expected postgresql://USER@HOST/DATABASE") from None
    event.listen(engine, "connect", _require_tls)
    return Register(url, engine)


POSTGRES = "install it from the project's folder: pip install '.[register,postgres]'"


def is_local(host: str) -> bool:
    """True for a socket of this machine, or its loopback."""
    return host.startswith(("/", "@")) or host in _LOOPBACK


def _require_tls(connection: Any, _: Any) -> None:
    """Refuse a connection without TLS to another machine, wherever its host came from."""
    info = connection.info
    if not (connection.pgconn.ssl_in_use or is_local(info.hostaddr or info.host)):
        connection.close()
        raise InputError("register: the connection to another machine has no TLS; state sslmode=verify-full")


_SAID = {  # of what PostgreSQL (SQLSTATE) or SQLite (part of its message) says
    "42501": "this account may not do that; docs/register.md says which role may",
    "53100": "the disk is full; nothing was entered",
    "database or disk is full": "the disk is full; nothing was entered",
    "disk I/O error": "the disk cannot be read or written, or is full; nothing was entered",
    "55P03": f"another process has been writing for {_PATIENCE} s; try again",
    "database is locked": f"another process has been writing for {_PATIENCE} s; try again",
    "not a database": "this is another file, not a register",
    "malformed": "the file is damaged; restore a backup (docs/register.md)",
    "readonly": "the file may only be read",
    "unable to open": "the file cannot be opened",
    "42P01": "this is no register; forcemap register init makes one",
    "no such table": "this is no register; forcemap register init makes one",
    "28P01": "the server refuses this account or its password",
    "28000": "the server refuses this account",
}


def _words(error: exc.DBAPIError, *, postgresql: bool) -> str:
    """What went wrong in words, without the statement and its values."""
    said = one_line(str(error.orig or error)).strip()
    code = getattr(error.orig, "sqlstate", None)
    for sign, words in _SAID.items():
        if sign == code or (not postgresql and sign in said):
            return words
    if postgresql and (error.connection_invalidated or code is None or str(code).startswith(("08", "57P"))):
        return f"no connection to the server, or it was lost; try again ({_first(said)})"
    return f"the database refuses this ({_first(said)})"


def _first(said: str) -> str:
    return said.partition("CONTEXT:")[0].partition("Is the server running")[0].strip()[:300]
