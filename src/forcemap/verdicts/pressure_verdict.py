"""The pressure of one impact against the limit of pressure of a body area."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from forcemap.campaigns.pressures import MeasuredPressure
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.impact import Impact
from forcemap.impacts.scenario import BARRING
from forcemap.limits.body_areas import PASCALS
from forcemap.limits.force_limits import PHASE_TWO_SHARE, Contact, ForceLimit
from forcemap.recordings.film import Film
from forcemap.verdicts.verdict import VerdictOutcome


@dataclass(frozen=True)
class PressureVerdict:
    """A pressure beside its limit.

    Parameters
    ----------
    outcome : VerdictOutcome
        Within only if the pressure and the film's error lie within the limit, its range is stated and no cell reached
        it, and the film shows the force that went through it; exceeded only if the pressure less the error does.
    pressure, limit, margin : float
        Pressure, limit, and what is left of the limit above the pressure and the film's error [N/cm^2].
    contact : Contact
        The limit that was used.
    reason : Finding
        Why.
    """

    outcome: VerdictOutcome
    pressure: float
    limit: float
    margin: float
    contact: Contact
    reason: Finding


def check_pressure(
    measured: MeasuredPressure,
    limit: ForceLimit,
    *,
    film: Film,
    impacts: Iterable[Impact] = (),
    contact: Contact | None = None,
) -> PressureVerdict:
    """Check the largest pressure of a recording against the limit of a body area where contact is permitted.

    A film does not tell when it was pressed. So all of it is held against the quasi-static limit, unless its impacts
    show that nothing went on: none clamps or may, and later than 0.5 s no force above an eighth of the peak was
    recorded.

    Parameters
    ----------
    measured : MeasuredPressure
    limit : ForceLimit
    film : Film
        Its error counts on both sides.
    impacts : iterable of Impact
        Those of the recording.
    contact : Contact, optional
        Quasi-static: that limit holds, whatever the impacts show.
    """
    known = list(impacts)
    goes_on = not known or any(
        impact.scenario in BARRING or not impact.phase2_force <= PHASE_TWO_SHARE * impact.peak_force for impact in known
    )
    used = Contact.QUASI_STATIC if goes_on or contact is Contact.QUASI_STATIC else Contact.TRANSIENT
    allowed, error = limit.pressure(used) / PASCALS, film.error_or_default
    least, most = measured.pressure / (1 + error), measured.pressure * (1 + error)
    saturated = measured.above_range or not measured.pressure < film.range  # a range that is not stated tells nothing
    force = max((impact.peak_force for impact in known), default=0.0)
    too_little = measured.too_little_for(force, film)
    if least > allowed:
        outcome = VerdictOutcome.EXCEEDED
    else:
        outcome = (
            VerdictOutcome.WITHIN if most <= allowed and not (saturated or too_little) else VerdictOutcome.CANNOT_TELL
        )
    figures = {"pressure": measured.pressure, "limit": allowed, "contact": str(used), "error": error}
    doubts: dict[str, float] = {
        "at_least": measured.above_range,
        "no_range": math.isnan(film.range),
        "too_little": too_little,
    }
    doubts |= {"most_N": measured.most_force, "force_N": force} if too_little else {}
    reason = Finding.of(FindingKind.PRESSURE_CHECKED, **figures, **doubts, file=measured.file)
    return PressureVerdict(outcome, measured.pressure, allowed, allowed - most, used, reason)
