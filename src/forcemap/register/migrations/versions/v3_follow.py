"""A new row follows the newest, and an entry of the audit trail is of the account that enters it."""

from __future__ import annotations

from alembic import op

from forcemap.register.triggers import follow_rows

revision, down_revision = "v3", "v2"
branch_labels = depends_on = None


def upgrade() -> None:
    """Add what the second schema does not have."""
    tables = "audit cells campaigns facts recordings impacts uses maps contact_points releases withdrawals"
    follow_rows(op.get_bind(), *tables.split())
