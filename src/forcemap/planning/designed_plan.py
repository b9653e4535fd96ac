"""A plan together with what its design is expected to give."""

from __future__ import annotations

import math
from dataclasses import dataclass

from forcemap.campaigns.plan import MeasurementPlan
from forcemap.maps.forms import Form
from forcemap.planning.optimal_states import DesignedStates


@dataclass(frozen=True, eq=False)
class DesignedPlan(MeasurementPlan):
    """A plan, and for an I-optimal one what is expected of it; neither is in the file.

    Parameters
    ----------
    note : str
        From what the states were chosen and the bound to expect, in words; empty for other designs.
    bound_width : float
        Mean over the candidates of the tolerance bound above the prediction, as a share of it; NaN likewise.
    """

    note: str = ""
    bound_width: float = math.nan


def design_note(designed: DesignedStates, form: Form, *, possible: int, far: int, forceful: int) -> str:
    """What was chosen for a form from how many possible states, beside those too far away or too forceful."""
    out = [
        *([f"{far} beyond the reach"] if far else []),
        *([f"{forceful} expected above the device range less its error"] if forceful else []),
    ]
    beside = f" ({' and '.join(out)} were no candidates)" if out else ""
    bound = (
        "no bound can be had from so few"
        if math.isnan(designed.bound_width)
        else f"the bound is expected to lie {100 * designed.bound_width:.1f} % above the prediction on average "
        f"(if states scatter by {100 * designed.state_sd:g} %)"
    )
    return (
        f"{len(designed.index)} of {possible} states chosen for {form.name}{beside}, the slowest and the fastest at "
        f"the corners of the places among them; {bound}"
    )
