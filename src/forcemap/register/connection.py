"""A connection to a register: SQLite in a file of this machine, PostgreSQL by URL; who writes does so alone."""

from __future__ import annotations

import ipaddress
import os
import re
import socket
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import zip_longest
from pathlib import Path
from typing import Any, Self
from urllib.parse import urlsplit

from sqlalchemy import Connection, Engine, QueuePool, create_engine, event, exc, text

from forcemap.errors import InputError, MissingExtra, RegisterError, one_line

REGISTER_VARIABLE = "FORCEMAP_REGISTER"
FILE = "register.sqlite"
_ALONE = 0x666F7263656D6170  # "forcemap": the advisory lock that whoever writes holds
_PATIENCE = 60  # s to wait for whoever writes; a choice, some hundred times what one entry takes
_AGAIN = 0.05  # s until a setting is tried again; a choice
_NETWORK = {
    *("nfs", "nfs4", "cifs", "smb", "smb3", "smbfs", "ncpfs", "9p", "afs", "ceph", "glusterfs", "lustre", "gpfs"),
    *("beegfs", "orangefs", "pvfs2", "ocfs2", "gfs2", "davfs", "coda", "vboxsf", "vmhgfs", "prl_fs", "drvfs", "acfs"),
}
_SCHEME = re.compile(r"postgres(ql)?(\+\w+)?://", re.IGNORECASE)
_TLS = ("verify-ca", "verify-full")


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
        A password in the URL, no verified certificate of another machine, a file that is not there or lies on a network
        file system.
    MissingExtra
        PostgreSQL's driver is not installed.
    """
    name = default_register() if where is None else where
    if not name:
        raise InputError("register: found no name, expected a file or postgresql://HOST/DATABASE")
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


class _Opened(sqlite3.Connection):
    """A connection to a file, and which log (-wal) and index of it (-shm) it has open beside it."""

    files: tuple[tuple[Path, tuple[int, int] | None], ...] = ()


def _sqlite(path: Path, *, new: bool) -> Engine:
    settings = ["foreign_keys = on", "synchronous = full", "recursive_triggers = on", "cache_size = -65536"]
    settings += ["journal_mode = wal"] if new else []
    settings += ["schema_version"]  # reads, so that the log is open
    path = path.absolute()
    register, beside = _identity(path), [Path(f"{os.path.realpath(path)}-{each}") for each in ("wal", "shm")]

    def connected() -> sqlite3.Connection:
        uri = f"{path.as_uri()}?mode=rw"  # a file that is gone is not made
        connection = sqlite3.connect(
            uri, timeout=_PATIENCE, isolation_level=None, check_same_thread=False, factory=_Opened, uri=True
        )
        for setting in settings:
            _set(connection, setting)
        connection.files = tuple((each, _identity(each)) for each in beside)
        return connection

    engine = create_engine("sqlite://", creator=connected, poolclass=QueuePool, hide_parameters=True)

    def same(connection: Connection) -> None:
        opened = getattr(connection.connection.dbapi_connection, "files", ())
        if _identity(path) != register or any(each and each != _identity(of) for of, each in opened):
            raise RegisterError(_REPLACED, file=str(path))
        if not os.access(path, os.R_OK, effective_ids=os.access in os.supports_effective_ids):
            raise RegisterError("the file cannot be opened", file=str(path))

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:  # the driver's own would begin late, and never before a new table
        same(connection)
        connection.exec_driver_sql("pragma shrink_memory")  # what was read before may be overwritten since
        alone = connection.get_execution_options().get("alone", False)
        connection.exec_driver_sql("begin immediate" if alone else "begin")

    event.listen(engine, "commit", same)
    return engine


def _set(connection: sqlite3.Connection, setting: str) -> None:
    """Make a setting; SQLite itself does not wait where several turn the same new file to a log ahead (wal)."""
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            connection.execute(f"pragma {setting}").fetchone()
            return
        except sqlite3.OperationalError as error:
            if "locked" not in str(error) or time.monotonic() > end:
                raise
            time.sleep(_AGAIN)


_REPLACED = (
    "the file, or its -wal or -shm, was replaced or deleted while it was open, and nothing is read or entered; restore "
    "it (docs/register.md), and start again"
)


def _identity(path: Path) -> tuple[int, int] | None:
    """Which file it is; None if there is none, or it cannot be told."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


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
    stated = _stated(url)
    _secured(stated)
    engine = create_engine("postgresql+psycopg://", hide_parameters=True, pool_pre_ping=True)

    @event.listens_for(engine, "do_connect")
    def _connect(dialect: Any, _: Any, __: Any, settings: dict[str, Any]) -> Any:  # service file and names may change
        return dialect.connect(
            **settings | {"connect_timeout": "10", "application_name": "forcemap"} | _secured(stated)
        )

    return Register(url, engine)


POSTGRES = "install it from the project's folder: pip install '.[register,postgres]'"


def _stated(url: str) -> dict[str, str]:
    """What a URL states, by libpq's names."""
    wrong = InputError("register: not a URL, expected postgresql://USER@HOST/DATABASE or postgresql:///?service=NAME")
    try:
        parts = urlsplit(url)
        secret = parts.password is not None
    except ValueError:
        raise wrong from None
    if "@" in parts.path or "/" in parts.path.strip("/"):
        raise wrong
    try:
        from psycopg import OperationalError, pq
    except ModuleNotFoundError as error:
        raise MissingExtra(f"this needs the package {error.name}; {POSTGRES}") from None
    try:
        found = [each for each in pq.Conninfo.parse(_SCHEME.sub("postgresql://", url, count=1).encode()) if each.val]
    except (OperationalError, UnicodeError):
        raise wrong from None
    if secret or any(
        each.dispchar == b"*" or each.keyword.startswith(b"scram_") for each in found
    ):  # it would stand in the shell's history
        remedy = "put it into a password file (~/.pgpass), a service file (?service=NAME) or PGPASSWORD"
        raise InputError(f"register: found a password in the URL; {remedy}")
    stated = {each.keyword.decode(): each.val.decode() for each in found if each.val}
    if "@" in stated.get("host", "")[1:]:
        raise wrong
    return stated


def _secured(stated: dict[str, str]) -> dict[str, str]:
    """What to connect with, as libpq reads URL, service file and environment: a verified certificate if not local.

    Raises
    ------
    InputError
        No such service, or a weaker sslmode is stated for another machine.
    """
    from psycopg import pq
    from psycopg.conninfo import make_conninfo

    stop = {"target_session_attrs": "none"}  # which there is not: libpq reads all settings, and connects to nothing
    asked = pq.PGconn.connect_start(make_conninfo(**stated | stop).encode())
    found = {each.keyword.decode(): each.val.decode() for each in asked.info if each.val is not None}
    said = asked.error_message.decode(errors="replace")
    asked.finish()
    if found.get("target_session_attrs") != "none":
        raise InputError(f"register: {one_line(said).strip()}")
    settings = stated | {name: found[name] for name in ("host", "hostaddr", "port") if found.get(name)}
    places = zip_longest(*(found.get(name, "").split(",") for name in ("hostaddr", "host")), fillvalue="")
    if all(is_local(address or host) for address, host in places):
        return settings
    mode = stated.get("sslmode", found["sslmode"])
    if mode in _TLS:
        return settings | {"gssencmode": "disable"}
    if "sslmode" in stated or mode != "prefer":  # which is libpq's own if none is stated
        remedy = "sslrootcert=FILE names the authority of its certificate"
        raise InputError(
            f"register: found sslmode={mode}, expected one of {', '.join(_TLS)} to another machine; {remedy}"
        )
    return settings | {
        "gssencmode": "disable",
        "sslmode": "verify-full",
        "sslrootcert": found.get("sslrootcert", "system"),
    }


def is_local(host: str) -> bool:
    """True for a socket of this machine, or its loopback; a name is one only if it is localhost."""
    if not host or host.startswith(("/", "@")):
        return True
    try:
        addresses = {str(each[4][0]) for each in socket.getaddrinfo(host, None)} if host == "localhost" else {host}
        return all(ipaddress.ip_address(each.partition("%")[0]).is_loopback for each in addresses)
    except (OSError, ValueError):
        return False


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
