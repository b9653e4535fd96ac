"""Effective mass: the paper's planar arm, and real robots from their descriptions."""
