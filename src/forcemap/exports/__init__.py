"""Results -> tables that other programs read; speeds are shown floored, nothing is computed."""
