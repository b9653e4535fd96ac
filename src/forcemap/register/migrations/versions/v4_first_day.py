"""The first day of the measurements of campaigns and releases."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision, down_revision = "v4", "v3"
branch_labels = depends_on = None


def upgrade() -> None:
    """Add what the third schema does not have; null of what is there."""
    for table in ("campaigns", "releases"):
        op.add_column(table, sa.Column("measured_from", sa.Text(), nullable=True))
