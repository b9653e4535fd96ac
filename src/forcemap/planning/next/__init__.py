"""What to measure next, slow to fast, for a limit."""
