"""Which impacts confirm released speeds, and what they said."""
