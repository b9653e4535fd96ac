"""Impact x limit -> verdict."""
