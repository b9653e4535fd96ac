"""The tables of the register, the same on SQLite and PostgreSQL: rows are added, and never changed or deleted.

Every row carries `entry`, the number of the entry in the audit trail that added it. Times are UTC in ISO 8601 with
microseconds and dates YYYY-MM-DD, as text, so that their order is that of the text. A value that is not known is null.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import BigInteger, Column, Float, ForeignKey, Index, Integer, MetaData, Table, Text, UniqueConstraint

METADATA = MetaData()


def _id() -> Column[int]:
    return Column("id", BigInteger().with_variant(Integer(), "sqlite"), primary_key=True, autoincrement=False)


def _of(table: str, *, known: bool = True) -> Column[int]:
    """A reference to a row of another table: `cell_id` of `cells`."""
    kind = BigInteger().with_variant(Integer(), "sqlite")
    return Column(f"{table[:-1]}_id", kind, ForeignKey(f"{table}.id"), nullable=not known)


def _entry() -> Column[int]:
    kind = BigInteger().with_variant(Integer(), "sqlite")
    return Column("entry", kind, ForeignKey("audit.id"), nullable=False)


def _text(*names: str) -> list[Column[Any]]:
    return [Column(name, Text, nullable=False) for name in names]


def _maybe(*names: str) -> list[Column[Any]]:
    return [Column(name, Text, nullable=True) for name in names]


def _figures(*names: str) -> list[Column[Any]]:
    return [Column(name, Float(53), nullable=True) for name in names]


def _counts(*names: str) -> list[Column[Any]]:
    return [Column(name, Integer, nullable=False) for name in names]


AUDIT = Table(
    "audit",
    METADATA,
    _id(),
    *_text("at", "person", "login", "action", "subject", "content", "previous", "sha256"),
    UniqueConstraint("previous", name="audit_previous"),
)
"""One entry for each action; `content` has the hash of the rows that it added, `sha256` is of the entry and of the one
before it."""

CELLS = Table(
    "cells",
    METADATA,
    _id(),
    *_text("site", "name"),
    _entry(),
    UniqueConstraint("site", "name", name="cells_name"),
)

CAMPAIGNS = Table(
    "campaigns",
    METADATA,
    _id(),
    _of("cells", known=False),
    *_text("sha256", "name", "folder", "binding", "conditions", "device"),
    *_maybe("measured_on", "calibrated", "calibrated_until"),
    *_figures("device_error_N"),
    *_counts("simulated", "recordings"),
    _entry(),
    *_maybe("measured_from"),
    UniqueConstraint("sha256", "cell_id", name="campaigns_content"),
    Index("campaigns_cell", "cell_id"),
    Index("campaigns_device", "device"),
)
"""A campaign's folder as it was: `sha256` is of all files that its result rests on. It was measured from the day
`measured_from`, null of what was entered before the register kept it, to `measured_on`."""

FACTS = Table(
    "facts",
    METADATA,
    _id(),
    _of("cells"),
    _of("campaigns", known=False),
    *_text("kind", "since"),
    *_maybe("value"),
    _entry(),
    Index("facts_cell", "cell_id", "kind"),
    Index("facts_value", "kind", "value"),
)
"""What holds of a cell since when; a value that is null is not known from then on."""

RECORDINGS = Table(
    "recordings",
    METADATA,
    _id(),
    *_text("sha256"),
    Column("size_bytes", BigInteger, nullable=False),
    _entry(),
    UniqueConstraint("sha256", name="recordings_content"),
)

IMPACTS = Table(
    "impacts",
    METADATA,
    _id(),
    _of("recordings"),
    _of("campaigns"),
    *_text("curve", "state_id", "use", "flags"),
    *_figures("distance_m", "height_m", "speed_mps", "peak_force_N", "phase2_force_N", "largest_N"),
    *_counts("repeat", "whole"),
    _entry(),
    Index("impacts_recording", "recording_id"),
    Index("impacts_largest", "largest_N", "campaign_id", "whole"),
    Index("impacts_whole", "whole", "campaign_id", "largest_N"),
)
"""What was found in a recording; `largest_N` of both phases, null if nothing was, and `whole` is 0 where it may have
been more. The campaign is the first of its cell that has it."""

USES = Table(
    "uses",
    METADATA,
    _id(),
    _of("campaigns"),
    _of("impacts"),
    *_text("file"),
    _entry(),
    Index("uses_campaign", "campaign_id"),
    Index("uses_impact", "impact_id"),
)
"""Which campaign has which impact, and in which file below its folder of recordings, or in points/ with that folder."""

MAPS = Table(
    "maps",
    METADATA,
    _id(),
    _of("campaigns"),
    *_text("sha256", "file", "form"),
    _entry(),
    Index("maps_sha256", "sha256"),
)

CONTACT_POINTS = Table(
    "contact_points",
    METADATA,
    _id(),
    _of("campaigns"),
    *_text("name", "area", "contact", "rests_on"),
    *_figures("programmed_mps"),
    _entry(),
    Index("contact_points_campaign", "campaign_id"),
)

RELEASES = Table(
    "releases",
    METADATA,
    _id(),
    _of("cells"),
    _of("campaigns"),
    *_text("subject", "areas", "contact", "bound", "speeds", "report_sha256", "conditions", "person", "at"),
    *_maybe("map_sha256", "valid_until", "measured_on", "calibrated", "calibrated_until"),
    *_figures("limit_N", "device_spring_N_per_m", "area_spring_N_per_m"),
    *_counts("simulated"),
    Column("replaces", BigInteger().with_variant(Integer(), "sqlite"), ForeignKey("releases.id"), nullable=True),
    _entry(),
    *_maybe("measured_from"),
    UniqueConstraint("replaces", name="releases_replaces"),
    Index("releases_cell", "cell_id"),
    Index("releases_map", "map_sha256"),
)

WITHDRAWALS = Table(
    "withdrawals",
    METADATA,
    _id(),
    _of("releases"),
    *_text("reason", "person", "at"),
    _entry(),
    Index("withdrawals_release", "release_id"),
)

ROWS = tuple(table for table in METADATA.sorted_tables if table is not AUDIT)
"""The tables whose rows the audit trail vouches for, each after those that it refers to."""
