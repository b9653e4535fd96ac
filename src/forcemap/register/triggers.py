"""The triggers of a register: what refuses to change a row, and to add one that does not follow the newest."""

from __future__ import annotations

from sqlalchemy import Connection, text

FIRST = "0" * 64
"""What stands in place of the entry before the first."""

_MADE_UP = "a row of the register is never changed or deleted; enter what is new"
_FOLLOWS = (
    "a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it"
)
_UNIQUE = {"audit": "id", "recordings": "sha256", "releases": "id", "impacts": "id", "withdrawals": "id"}


def keep_rows(connection: Connection, *tables: str) -> None:
    """Make the triggers that refuse a change of rows of these tables; for migrations."""
    if connection.dialect.name == "postgresql":
        connection.execute(
            text(
                "create or replace function forcemap_keep() returns trigger language plpgsql as "
                f"$$ begin raise exception '{_MADE_UP}'; end $$"
            )
        )
        for name in tables:
            for event, each in (("update or delete", "row"), ("truncate", "statement")):
                trigger = f"{name}_kept_{each}"
                connection.execute(
                    text(
                        f"create trigger {trigger} before {event} on {name} for each {each} "
                        "execute function forcemap_keep()"
                    )
                )
        return
    for name in tables:
        for event in ("update", "delete"):
            refuse = f"begin select raise(abort, '{_MADE_UP}'); end"
            connection.execute(text(f"create trigger {name}_kept_{event} before {event} on {name} {refuse}"))
        if key := _UNIQUE.get(name):  # insert or replace would delete, unseen by the trigger
            there = f"exists (select 1 from {name} where {key} = new.{key})"
            refuse = f"when {there} begin select raise(abort, '{_MADE_UP}'); end"
            connection.execute(text(f"create trigger {name}_kept_insert before insert on {name} {refuse}"))


def follow_rows(connection: Connection, *tables: str) -> None:
    """Make the triggers that refuse a new row of these tables that does not follow the newest; for migrations."""
    if connection.dialect.name == "postgresql":
        schema = schema_name(connection)
        for name in tables:
            function = f"forcemap_follow_{name}()"
            connection.execute(
                text(
                    f"create function {function} returns trigger language plpgsql "
                    f"set search_path = pg_catalog, pg_temp as $${_following(schema, name)}$$"
                )
            )
            connection.execute(
                text(f"create trigger {name}_follow before insert on {name} for each row execute function {function}")
            )
        return
    for name in tables:
        wrong = f"new.id is not {_next_number(name)} or {_unlinked(name, 'is not')}"
        refuse = f"when {wrong} begin select raise(abort, '{_FOLLOWS}'); end"
        connection.execute(text(f"create trigger {name}_follow before insert on {name} {refuse}"))


def schema_name(connection: Connection) -> str:
    """PostgreSQL's schema that the tables are in, quoted."""
    return str(connection.execute(text("select quote_ident(current_schema())")).scalar())


def functions(schema: str, *tables: str) -> dict[str, tuple[str, str]]:
    """On PostgreSQL, body and settings of every trigger's function."""
    kept = {"forcemap_keep": (f" begin raise exception '{_MADE_UP}'; end ", "")}
    return kept | {
        f"forcemap_follow_{name}": (_following(schema, name), "search_path=pg_catalog, pg_temp") for name in tables
    }


def triggers(*tables: str) -> dict[tuple[str, str], tuple[str, int]]:
    """On PostgreSQL, function and kind (pg_trigger.tgtype) of every trigger, by table and name."""
    found = {(name, f"{name}_kept_row"): ("forcemap_keep", 1 + 2 + 8 + 16) for name in tables}
    found |= {(name, f"{name}_kept_statement"): ("forcemap_keep", 2 + 32) for name in tables}
    return found | {(name, f"{name}_follow"): (f"forcemap_follow_{name}", 1 + 2 + 4) for name in tables}


def _following(schema: str, name: str) -> str:
    """The body of a function: names are whole, so that no table of whoever enters stands in for the register's."""
    audit, differs = f"{schema}.audit", "is distinct from"
    wrong = f"new.id {differs} {_next_number(f'{schema}.{name}')} or {_unlinked(name, differs, audit)}"
    wrong += f" or session_user::text {differs} "
    wrong += "new.login" if name == "audit" else f"(select login from {audit} where id = new.entry)"
    return f" begin if {wrong} then raise exception '{_FOLLOWS}'; end if; return new; end "


def _next_number(table: str) -> str:
    return f"(select coalesce(max(id), 0) + 1 from {table})"


def _unlinked(name: str, differs: str, audit: str = "audit") -> str:
    """True of an entry that is not chained to the newest one, and of another row that is not of the newest entry."""
    if name != "audit":
        return f"new.entry {differs} (select max(id) from {audit})"
    return f"new.previous {differs} coalesce((select sha256 from {audit} order by id desc limit 1), '{FIRST}')"
