"""How figures look: one colour, marker and line for the same thing everywhere, told apart in grey as well.

Colours of categories are those of Okabe and Ito (2008), which colour-blind readers tell apart; quantities are drawn in
viridis, which rises evenly in grey. What else a figure takes of matplotlib's settings stands in `forcemap.mplstyle`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.markers import CARETDOWN
from matplotlib.patches import Patch
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
    """How one kind of thing is drawn, and its name in a legend.

    Parameters
    ----------
    words : str
        Its name in a legend.
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

    def plot(self, axes: Axes, x: Any, y: Any, words: str = "", **changes: Any) -> None:
        """Draw points or a line; `words`, if given, replace its name in the legend."""
        axes.plot(x, y, **(self.drawn | ({"label": words} if words else {}) | changes))

    @property
    def area(self) -> dict[str, Any]:
        """Arguments for an area that no legend names."""
        return {"facecolor": self.face, "edgecolor": "#505050", "linewidth": 0.0, "hatch": self.hatch}

    def patch(self) -> Patch:
        """The area as a legend's entry."""
        return Patch(**(self.area | {"linewidth": 0.6, "label": self.words}))


TRAIN = Look("measured, training state", BLUE, marker="s", face=BLUE, size=3.6)
SLOWER = Look("measured, slower than the map", GREY, marker="v", face="#ffffff", size=3.6)
TEST = Look("measured, test state", BLACK, marker="o", face="#ffffff")
CENSORED = Look("censored: at least this force", VERMILLION, marker=UP_ARROW, size=11.0)
PREDICTION = Look("3D map", GREEN, "-", 1.4)
BOUND = Look("upper bound", BLACK, (0, (4, 2)), 0.9)
MAP_2D = Look("2D map", SKY, (0, (6, 1.5, 1, 1.5)), 1.4)
MAP_2D_PER_HEIGHT = Look("2D map of each height", SKY, (0, (1, 1)), 1.4, "D", "#ffffff", 3.4)
MAP_2D_OF_MAP = Look("2D map, fitted to the 3D map", SKY, (0, (3, 3)), 1.4)
MAP_2D_PER_HEIGHT_OF_MAP = Look(
    "2D map of each height, fitted to the 3D map", SKY, (0, (1, 3)), 1.4, "^", "#ffffff", 3.4
)
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
ALLOWED = Look("speed to program", GREEN, "-", 1.6)
PROGRAMMED = Look("programmed speed", VERMILLION, (0, (4, 2)), 1.1)
COMMANDED = Look("speed to command, braking in time", BLACK, (0, (1, 1.5)), 1.1)
HAS_SPEED = Look("has a speed", GREEN, marker="s", face=GREEN, size=3.6)
NO_SPEED = Look("no permission yet", VERMILLION, marker="x", size=5.0)
MEASURE_NEXT = Look("measure next, at this speed [m/s]", BLACK, marker="D", face=YELLOW, size=6.0)
PROFILE = Look("motion within it", BLUE, (0, (1, 1)), 1.1)

VARIANTS = [
    Look("", colour, line, 1.5, marker, colour)
    for colour, marker, line in (
        (BLUE, "s", "-"),
        (VERMILLION, "o", (0, (4, 2))),
        (GREEN, "^", (0, (1, 1))),
        (BLACK, "D", (0, (6, 1.5, 1, 1.5))),
        (ORANGE, "v", "-"),
        (PURPLE, "P", (0, (4, 2))),
        (SKY, "X", (0, (1, 1))),
    )
]
"""Looks of variants that the user names."""

_CAPPED = Look("capped: no higher speed was measured", BLACK, hatch="\\\\\\")
OUTCOMES = {
    SpeedOutcome.ADMISSIBLE: Look("admissible", BLACK),
    SpeedOutcome.CAPPED: _CAPPED,
    SpeedOutcome.UNCONFIRMED: Look("unconfirmed: no speed", BLACK, face="#ffffff", hatch="xxxx"),
    SpeedOutcome.OUTSIDE: Look("outside what was measured: no speed", BLACK, face=PALE, hatch="...."),
    SpeedOutcome.NOT_PERMITTED: Look("contact not permitted", BLACK, face=PALE, hatch="++++"),
}
PIECES = {
    PieceOutcome.ADMISSIBLE: Look("admissible", BLACK),
    PieceOutcome.CAPPED: _CAPPED,
    PieceOutcome.UNCONFIRMED: Look("unconfirmed: no permission", BLACK, face="#ffffff", hatch="xxxx"),
    PieceOutcome.OUTSIDE: Look("outside what was measured: no permission", BLACK, face=PALE, hatch="...."),
    PieceOutcome.NOT_DOWNWARD: Look("not downward: no permission", BLACK, face="#ffffff", hatch="////"),
    PieceOutcome.NO_MAP: Look("no map: no permission", BLACK, face="#ffffff", hatch="\\\\\\\\"),
    PieceOutcome.NOT_PERMITTED: Look("contact not permitted", BLACK, face=PALE, hatch="++++"),
    PieceOutcome.NO_CONTACT: Look("contact excluded by other measures", BLACK, face=PALE),
}
MASSES = {
    MassOutcome.UNREACHABLE: Look("the robot does not reach", BLACK, face=PALE, hatch="...."),
    MassOutcome.SINGULAR: Look("singular posture: no value", BLACK, face="#ffffff", hatch="xxxx"),
    MassOutcome.NO_MOTION: Look("no joint moves in this direction", BLACK, face="#ffffff", hatch="////"),
}
