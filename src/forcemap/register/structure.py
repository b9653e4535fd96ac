"""What a database has beside what its version makes: tables, columns, indexes, and the triggers that keep its rows."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import Connection, bindparam, create_engine, text

from forcemap.register.schema import SCHEMA, migrate
from forcemap.register.tables import METADATA
from forcemap.register.triggers import functions, schema_name, triggers

_STATISTICS = ("sqlite_stat1", "sqlite_stat4")  # of the planner, by the administrator's `analyze`


def altered(connection: Connection) -> tuple[str, ...]:
    """What is missing, foreign or other than this version makes it, and what is damaged; empty if nothing is."""
    if connection.dialect.name == "postgresql":
        return (*map(_said, compare_metadata(MigrationContext.configure(connection), METADATA)), *_catalog(connection))
    damage = connection.execute(text("pragma integrity_check(3)")).scalars()
    found = [f"the file is damaged: {words}" for words in damage if words != "ok"]
    return (*found, *_differences(_made(), _parts(connection)))


def _differences(made: Mapping[str, Any], there: Mapping[str, Any]) -> list[str]:
    found = [f"{name} is missing" for name in made if name not in there]
    found += [f"{name} is none of the register's" for name in there if name not in made]
    return found + [f"{name} is not as it was made" for name in made if there.get(name, made[name]) != made[name]]


def _parts(connection: Connection) -> dict[str, tuple[str, str]]:
    """Tables, indexes, triggers and views of a file, with the statements that make them."""
    rows = connection.execute(text("select type, name, tbl_name, sql from sqlite_master"))
    return {
        f"{kind} {name}": (table, " ".join((sql or "").split()))
        for kind, name, table, sql in rows
        if not (kind == "table" and name in _STATISTICS)
    }


@cache
def _made() -> dict[str, tuple[str, str]]:
    """The parts of a file that this version makes."""
    engine = create_engine("sqlite://")
    with engine.begin() as connection:
        migrate(connection, SCHEMA)
        made = _parts(connection)
    engine.dispose()
    return made


def _said(difference: Any) -> str:
    """A difference that Alembic found, in words."""
    while isinstance(difference, list):
        difference = difference[0]
    kind, *of = difference
    doing, _, what = kind.partition("_")
    table = getattr(getattr(of[0], "table", None), "name", "") if len(of) == 1 else of[1]
    name = ".".join(filter(None, (table, str(getattr(of[-1] if len(of) < 4 else of[2], "name", of[-1])))))
    how = {"add": "is missing", "remove": "is none of the register's"}.get(doing, "is not as it was made")
    return f"{what} {name} {how}"


_TRIGGERS = """
select c.relname, t.tgname, p.proname, t.tgtype, t.tgenabled = 'O' and t.tgqual is null and t.tgnargs = 0
    and t.tgattr = '' and p.pronamespace = c.relnamespace and l.lanname = 'plpgsql' and not p.prosecdef,
    p.prosrc, coalesce(array_to_string(p.proconfig, ';'), '')
from pg_trigger t join pg_class c on c.oid = t.tgrelid join pg_proc p on p.oid = t.tgfoid
    join pg_language l on l.oid = p.prolang
where not t.tgisinternal and c.relnamespace = current_schema()::regnamespace and c.relname in :tables
"""
_FOREIGN = """
with own as (select * from pg_class where relnamespace = current_schema()::regnamespace and relname in :tables)
select 'a trigger of the foreign keys of ' || relname || ' is switched off'
    from own where exists (select from pg_trigger where tgrelid = own.oid and tgisinternal and tgenabled <> 'O')
union all select 'index ' || i.relname || ' leaves out rows'
    from own join pg_index on indrelid = own.oid join pg_class i on i.oid = indexrelid
    where indpred is not null or indexprs is not null or not (indisvalid and indisready and indislive)
union all select 'table ' || relname || ' has rules, row security or heirs, or no key, or is none'
    from own where relkind <> 'r' or relrowsecurity or exists (select from pg_rewrite where ev_class = own.oid)
    or exists (select from pg_inherits where own.oid in (inhparent, inhrelid))
    or not exists (select from pg_index where indrelid = own.oid and indisprimary)
"""


def _catalog(connection: Connection) -> list[str]:
    """What PostgreSQL's catalog shows of triggers, and of what else hides rows."""
    names, schema = list(METADATA.tables), schema_name(connection)

    def asked(statement: str) -> Any:
        return connection.execute(text(statement).bindparams(bindparam("tables", names, expanding=True)))

    bodies = functions(schema, *names)
    made = {
        f"trigger {name} of {table}": (function, kind, True, *bodies[function])
        for (table, name), (function, kind) in triggers(*names).items()
    }
    there = {f"trigger {name} of {table}": tuple(rest) for table, name, *rest in asked(_TRIGGERS)}
    return [*_differences(made, there), *(row[0] for row in asked(_FOREIGN))]
