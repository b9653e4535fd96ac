"""A short help for the words of the page that are no everyday English."""

from __future__ import annotations

HELP = {
    "CFM_3D": (
        "CFM_3D, the map",
        "A collision-force map: a formula for the force of an impact over distance, height and speed, fitted to the "
        "impacts that were measured. CFM_3D is the paper's form with nine coefficients; CFM_2D leaves the height out.",
    ),
    "contact": (
        "Transient and quasi-static contact",
        "Transient: the body part is hit and can move away, so the force is over within half a second. Quasi-static: "
        "it is clamped, and the force stays. The standard's limit is lower for the second. Where it could be clamped, "
        "choose quasi-static.",
    ),
    "bound": (
        "The bound: tolerance or margin",
        "The map predicts the force; the bound is what the force is not expected to exceed, and a speed is permitted "
        "only if the bound keeps the limit. Tolerance: with 95 % confidence, 95 % of states lie below it, by how far "
        "the measurements scatter. Margin: the prediction and a fixed share more, which knows nothing of scatter.",
    ),
    "overshoot": (
        "Speed overshoot",
        "How much faster than programmed the robot may be at contact. It is subtracted: the speed to program is the "
        "speed at contact less the overshoot.",
    ),
    "position": (
        "Position tolerance",
        "How far beside its program the robot may be. The speed holds everywhere within it.",
    ),
    "outcome": (
        "Outcomes of a speed",
        "Admissible: the bound reaches the limit at this speed. Capped: even the highest speed measured there is "
        "admissible, no higher one is. Unconfirmed: the bound exceeds the limit already at the lowest speed measured "
        "there, or something else forbids a speed; measure. Outside: nothing was measured there. Not permitted: the "
        "standard permits no contact. Only the first two have a speed.",
    ),
}
"""Title and words of each help."""
