"""How figures look: one colour, marker and line for the same thing everywhere, told apart in grey as well.

Colours of categories are those of Okabe and Ito (2008), which colour-blind readers tell apart; quantities are drawn in
viridis, which rises evenly in grey.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from matplotlib.markers import CARETDOWN
from matplotlib.path import Path

from forcemap.dynamics.effective_mass import MassOutcome
from forcemap.paths.path_speeds import PieceOutcome
from forcemap.speeds.safe_speed import SpeedOutcome

COLUMN_WIDTH = 0.08
"""Width of a figure in a column [m]: panels stand below each other."""
PAGE_WIDTH = 0.16
"""Width of a figure across a page [m]."""

BLACK, GREY, PALE = "#000000", "#808080", "#e4e4e4"
ORANGE, SKY, GREEN, YELLOW = "#E69F00", "#56B4E9", "#009E73", "#F0E442"
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
QUANTITY = "viridis"

DISTANCE, HEIGHT, SPEED = "Distance [m]", "Height [m]", "Speed [m/s]"
FORCE, TIME, MASS = "Force [N]", "Time after onset [s]", "Effective mass [kg]"

UP_ARROW = Path([(0, 0), (0, 2), (-0.6, 1.2), (0, 2), (0.6, 1.2)], [1, 2, 1, 2, 2])
"""An arrow from its place upwards: at least this much."""


@dataclass(frozen=True)
class Look:
    """How one thing is drawn, and what it is called in a legend.

    Parameters
    ----------
    words : str
        What it is called.
    colour : str
        Its colour.
    line : str or tuple
        Its line style.
    width : float
        Width of its line [pt].
    marker : str or Path
        Its marker.
    face : str
        Fill of the marker.
    size : float
        Size of the marker [pt].
    hatch : str
        Pattern of its area.
    """

    words: str
    colour: str
    line: Any = "none"
    width: float = 1.2
    marker: Any = ""
    face: str = "none"
    size: float = 4.0
    hatch: str = ""

    @property
    def drawn(self) -> dict[str, Any]:
        """Arguments for `Axes.plot`."""
        return {
            "color": self.colour,
            "linestyle": self.line,
            "linewidth": self.width,
            "marker": self.marker,
            "markersize": self.size,
            "markerfacecolor": self.face,
            "markeredgewidth": 1.2 if self.marker is UP_ARROW else 0.9,
            "label": self.words,
        }

    @property
    def filled(self) -> dict[str, Any]:
        """Arguments for a patch."""
        return {
            "facecolor": self.face,
            "edgecolor": "#505050",
            "linewidth": 0.0,
            "hatch": self.hatch,
            "label": self.words,
        }


TRAIN = Look("measured, training state", BLUE, marker="s", face=BLUE, size=3.6)
TEST = Look("measured, test state", BLACK, marker="o", face="#ffffff")
CENSORED = Look("censored: at least this force", VERMILLION, marker=UP_ARROW, size=11.0)
PREDICTION = Look("3D map", GREEN, "-", 1.4)
BOUND = Look("upper bound", BLACK, (0, (4, 2)), 0.9)
MAP_2D = Look("2D map", SKY, (0, (6, 1.5, 1, 1.5)), 1.4)
MAP_2D_PER_HEIGHT = Look("2D map of each height", SKY, (0, (1, 1)), 1.4, "D", "#ffffff", 3.4)
STANDARD = Look("standard's contact model", ORANGE, (0, (1, 1.2)), 2.2)
TRANSIENT = Look("transient limit", VERMILLION, (0, (8, 2)), 1.4)
QUASI_STATIC = Look("quasi-static limit", PURPLE, (0, (8, 2, 1, 2)), 1.4)
LIMIT = Look("force limit", VERMILLION, (0, (8, 2)), 1.4)
RECORDED = Look("as recorded", GREY, "-", 0.8)
CONTACT_FORCE = Look("contact force", BLUE, "-", 1.1)
BESIDE = Look("another impact", BLACK, (0, (3, 1.5)), 0.9)
PEAK = Look("Phase I peak", BLACK, marker=CARETDOWN, face=YELLOW, size=7.0)
PHASE_BOUNDARY = Look("end of Phase I", BLACK, (0, (1, 1.5)), 1.0)
DEVICE_RANGE = Look("device range", BLACK, (0, (8, 1.5, 1, 1.5, 1, 1.5)), 0.9)
DEVICE_ERROR = Look("device error", BLACK, (0, (8, 1.5, 1, 1.5, 1, 1.5)), 0.9)
REPEATED = Look("repeated state", BLUE, marker="s", face=BLUE, size=3.4)
POOLED = Look("all states pooled", GREEN, "-", 1.4)
OUTLIER = Look("outlier", VERMILLION, marker="o", size=8.0)
ALLOWED = Look("allowed speed", GREEN, "-", 1.6)
PROGRAMMED = Look("programmed speed", VERMILLION, (0, (4, 2)), 1.1)
COMMANDED = Look("speed to command, braking in time", BLACK, (0, (1, 1.5)), 1.1)
PROFILE = Look("motion within it", BLUE, (0, (1, 1)), 1.1)

_CAPPED = Look("capped: no higher speed was measured", BLACK, hatch="\\\\\\")
OUTCOMES = {
    SpeedOutcome.ADMISSIBLE: Look("admissible", BLACK),
    SpeedOutcome.CAPPED: _CAPPED,
    SpeedOutcome.UNCONFIRMED: Look("unconfirmed: no speed", BLACK, face="#ffffff", hatch="xxxx"),
    SpeedOutcome.OUTSIDE: Look("outside what was measured: no speed", BLACK, face=PALE, hatch="...."),
}
PIECES = {
    PieceOutcome.ADMISSIBLE: Look("admissible", BLACK),
    PieceOutcome.CAPPED: _CAPPED,
    PieceOutcome.UNCONFIRMED: Look("unconfirmed: no permission", BLACK, face="#ffffff", hatch="xxxx"),
    PieceOutcome.OUTSIDE: Look("outside what was measured: no permission", BLACK, face=PALE, hatch="...."),
    PieceOutcome.NOT_DOWNWARD: Look("not downward: no permission", BLACK, face="#ffffff", hatch="////"),
    PieceOutcome.NOT_PERMITTED: Look("contact not permitted", BLACK, face=PALE, hatch="++++"),
    PieceOutcome.NO_CONTACT: Look("contact excluded by other measures", BLACK, face=PALE),
}
MASSES = {
    MassOutcome.UNREACHABLE: Look("the robot does not reach", BLACK, face=PALE, hatch="...."),
    MassOutcome.SINGULAR: Look("singular posture: no value", BLACK, face="#ffffff", hatch="xxxx"),
    MassOutcome.NO_MOTION: Look("no joint moves in this direction", BLACK, face="#ffffff", hatch="////"),
}

RC: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#404040",
    "axes.grid": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 8,
    "figure.constrained_layout.h_pad": 0.05,
    "figure.constrained_layout.w_pad": 0.05,
    "figure.constrained_layout.use": True,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 7.5,
    "grid.color": "#e0e0e0",
    "grid.linewidth": 0.5,
    "hatch.color": "#505050",
    "hatch.linewidth": 0.6,
    "image.cmap": QUANTITY,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "svg.fonttype": "none",
    "svg.hashsalt": "forcemap",
    "text.parse_math": False,  # a dollar sign in a name is one
    "xtick.labelsize": 7,
    "xtick.major.width": 0.7,
    "ytick.labelsize": 7,
    "ytick.major.width": 0.7,
}
"""What a figure takes of matplotlib's settings; all others are its defaults, not the user's."""
