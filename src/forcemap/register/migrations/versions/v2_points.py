"""Contact points of campaigns; indexes for the largest forces and for devices."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from forcemap.register.triggers import keep_rows

revision, down_revision = "v2", "v1"
branch_labels = depends_on = None


def upgrade() -> None:
    """Add what the first schema does not have."""
    integer = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        "contact_points",
        sa.Column("id", integer, primary_key=True, autoincrement=False),
        sa.Column("campaign_id", integer, sa.ForeignKey("campaigns.id"), nullable=False),
        *(sa.Column(name, sa.Text(), nullable=False) for name in ("name", "area", "contact", "rests_on")),
        sa.Column("programmed_mps", sa.Float(53), nullable=True),
        sa.Column("entry", integer, sa.ForeignKey("audit.id"), nullable=False),
    )
    op.create_index("contact_points_campaign", "contact_points", ["campaign_id"])
    op.create_index("impacts_largest", "impacts", ["largest_N", "campaign_id", "whole"])
    op.create_index("impacts_whole", "impacts", ["whole", "campaign_id", "largest_N"])
    op.create_index("campaigns_device", "campaigns", ["device"])
    keep_rows(op.get_bind(), "contact_points")
