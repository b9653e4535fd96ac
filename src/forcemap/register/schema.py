"""The schema of a register: made and migrated by Alembic, with the roles of PostgreSQL."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import Connection, inspect, text

from forcemap.errors import RegisterError
from forcemap.register.connection import Register, connect
from forcemap.register.tables import METADATA

SCHEMA = "v4"
"""The schema of this version: the last of migrations/versions."""

ROLES = {
    "forcemap_reader": (),
    "forcemap_operator": (
        *("audit", "cells", "facts", "campaigns", "recordings", "impacts", "uses", "maps", "contact_points"),
    ),
    "forcemap_releaser": ("audit", "releases", "withdrawals"),
}
"""Roles on PostgreSQL, and the tables that each may add rows to; all of them may read."""


def make_register(where: str | None = None, *, schema: str = SCHEMA) -> tuple[Register, str, bool]:
    """Make a register, or bring one to the schema of this version; who asks again changes nothing.

    Returns the register, the schema it had before (empty if it is new), and whether the roles on PostgreSQL are there.

    Raises
    ------
    RegisterError
        The database refuses it, is another one, or has a schema of a later version.
    """
    register = connect(where, new=True)
    try:
        with register.writing() as connection:
            before = schema_of(connection)
            if not before and inspect(connection).get_table_names():
                raise RegisterError("this is another database, not a register", file=register.name)
            if _number(before) > _number(SCHEMA):
                raise _later(register, before)
            migrate(connection, schema)
        return register, before, register.postgresql and schema == SCHEMA and _with_roles(register)
    except BaseException:
        register.engine.dispose()
        raise


def open_register(where: str | None = None) -> Register:
    """Open a register that has the schema of this version.

    Raises
    ------
    RegisterError
        It has another schema, or the database cannot be used.
    """
    register = connect(where)
    try:
        with register.reading() as connection:
            found = schema_of(connection)
        if not found:
            raise RegisterError("this is no register; forcemap register init makes one", file=register.name)
        if _number(found) > _number(SCHEMA):
            raise _later(register, found)
        if found != SCHEMA:
            remedy = "make a backup (docs/register.md), then: forcemap register init"
            raise RegisterError(f"the register has the schema {found}, expected {SCHEMA}; {remedy}", file=register.name)
    except BaseException:
        register.engine.dispose()
        raise
    return register


def schema_of(connection: Connection) -> str:
    """The schema that a database has; empty if it is no register."""
    if not inspect(connection).has_table("alembic_version"):
        return ""
    return str(connection.execute(text("select version_num from alembic_version")).scalar() or "")


def _number(schema: str) -> int:
    return int(schema.removeprefix("v") or 0)


def migrate(connection: Connection, schema: str) -> None:
    """Bring a database from the schema it has to this one."""
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).with_name("migrations")).replace("%", "%%"))
    config.attributes["connection"] = connection
    command.upgrade(config, schema)


def _later(register: Register, found: str) -> RegisterError:
    remedy = "use a newer forcemap"
    return RegisterError(
        f"the register has the schema {found}, this version knows {SCHEMA}; {remedy}", file=register.name
    )


def _with_roles(register: Register) -> bool:
    """Make the roles and give them their rights; False if this account may make none and they are not there."""
    with register.reading() as connection:
        there = set(connection.execute(text("select rolname from pg_roles where rolname like 'forcemap%'")).scalars())
    missing = [role for role in ROLES if role not in there]
    if missing:
        try:
            with register.writing() as connection:
                for role in missing:
                    connection.execute(text(f"create role {role} nologin"))
        except RegisterError:
            return False
    with register.writing() as connection:
        for name in METADATA.tables:
            connection.execute(text(f"revoke all on {name} from public, {', '.join(ROLES)}"))
        for role, tables in ROLES.items():
            connection.execute(text(f"grant select on {', '.join(METADATA.tables)}, alembic_version to {role}"))
            if tables:
                connection.execute(text(f"grant insert on {', '.join(tables)} to {role}"))
    return True
