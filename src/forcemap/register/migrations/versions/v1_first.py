"""The first schema: cells, facts, campaigns, recordings, impacts, maps, releases, withdrawals, audit trail."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

from forcemap.register.triggers import keep_rows

revision, down_revision = "v1", None
branch_labels = depends_on = None

_INTEGER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def _column(name: str, kind: str) -> sa.Column[Any]:
    """A column: `text`, `float`, `count` or the table that it refers to, with ? where it may be null."""
    maybe, kind = kind.endswith("?"), kind.removesuffix("?")
    types: dict[str, Any] = {"text": sa.Text(), "float": sa.Float(53), "count": sa.Integer(), "bytes": sa.BigInteger()}
    if kind in types:
        return sa.Column(name, types[kind], nullable=maybe)
    return sa.Column(name, _INTEGER, sa.ForeignKey(f"{kind}.id"), nullable=maybe)


def _table(name: str, columns: str, **unique: str) -> None:
    """A table of columns written as `name:kind`, and its unique columns by the name of the constraint."""
    op.create_table(
        name,
        sa.Column("id", _INTEGER, primary_key=True, autoincrement=False),
        *(_column(*each.split(":")) for each in columns.split()),
        *(sa.UniqueConstraint(*names.split(), name=constraint) for constraint, names in unique.items()),
    )


def upgrade() -> None:
    """Make the tables, their indexes, and the triggers that keep their rows."""
    _table(
        "audit",
        "at:text person:text login:text action:text subject:text content:text previous:text sha256:text",
        audit_previous="previous",
    )
    _table("cells", "site:text name:text entry:audit", cells_name="site name")
    _table(
        "campaigns",
        "cell_id:cells? sha256:text name:text folder:text binding:text conditions:text device:text measured_on:text? "
        "calibrated:text? calibrated_until:text? device_error_N:float? simulated:count recordings:count entry:audit",
        campaigns_content="sha256 cell_id",
    )
    _table("facts", "cell_id:cells campaign_id:campaigns? kind:text since:text value:text? entry:audit")
    _table("recordings", "sha256:text size_bytes:bytes entry:audit", recordings_content="sha256")
    _table(
        "impacts",
        "recording_id:recordings campaign_id:campaigns curve:text state_id:text use:text flags:text distance_m:float? "
        "height_m:float? speed_mps:float? peak_force_N:float? phase2_force_N:float? largest_N:float? repeat:count "
        "whole:count entry:audit",
    )
    _table("uses", "campaign_id:campaigns impact_id:impacts file:text entry:audit")
    _table("maps", "campaign_id:campaigns sha256:text file:text form:text entry:audit")
    _table(
        "releases",
        "cell_id:cells campaign_id:campaigns subject:text areas:text contact:text bound:text speeds:text "
        "report_sha256:text conditions:text person:text at:text map_sha256:text? valid_until:text? measured_on:text? "
        "calibrated:text? calibrated_until:text? limit_N:float? device_spring_N_per_m:float? "
        "area_spring_N_per_m:float? simulated:count replaces:releases? entry:audit",
        releases_replaces="replaces",
    )
    _table("withdrawals", "release_id:releases reason:text person:text at:text entry:audit")
    for name, columns in {
        "campaigns_cell": "campaigns cell_id",
        "facts_cell": "facts cell_id kind",
        "facts_value": "facts kind value",
        "impacts_recording": "impacts recording_id",
        "uses_campaign": "uses campaign_id",
        "uses_impact": "uses impact_id",
        "maps_sha256": "maps sha256",
        "releases_cell": "releases cell_id",
        "releases_map": "releases map_sha256",
        "withdrawals_release": "withdrawals release_id",
    }.items():
        table, *indexed = columns.split()
        op.create_index(name, table, indexed)
    kept = "audit cells campaigns facts recordings impacts uses maps releases withdrawals"
    keep_rows(op.get_bind(), *kept.split())
