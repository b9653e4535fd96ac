"""Designs: which states of a range are measured."""

from __future__ import annotations

from enum import StrEnum


class Design(StrEnum):
    """Which states are measured (paper, section IV-C)."""

    TRAINING = "training"
    FULL_GRID = "full-grid"
    SYMMETRY = "symmetry"
    I_OPTIMAL = "i-optimal"


# Values a range (lowest, highest) is divided into, and the fewest values that tell the map's squares.
DIVISIONS = {Design.TRAINING: 3, Design.FULL_GRID: 5, Design.SYMMETRY: 0, Design.I_OPTIMAL: 5}
FEWEST = {Design.TRAINING: 3, Design.FULL_GRID: 4, Design.SYMMETRY: 1, Design.I_OPTIMAL: 3}
