"""An impact against a force limit: force over time below the limit line, under every interpretation of the standard.

Which limit applies when is disputed (Kirschner et al. 2022); all interpretations are evaluated and the strictest
governs unless one is named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from forcemap.errors import InputError
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.impacts.scenario import ContactScenario
from forcemap.limits.force_limits import ForceLimit

FloatArray = NDArray[np.float64]


class Interpretation(StrEnum):
    """When the transient and when the quasi-static limit applies."""

    BY_TIME = "by-time"
    BY_SCENARIO = "by-scenario"
    BY_SHAPE = "by-shape"

    @property
    def words(self) -> str:
        """What it says, in a sentence."""
        return _WORDS[self]


_WORDS = {
    Interpretation.BY_TIME: "transient limit for the first 0.5 s of contact, quasi-static after it",
    Interpretation.BY_SCENARIO: "quasi-static limit throughout if the contact clamps or may clamp, else transient",
    Interpretation.BY_SHAPE: "quasi-static limit after Phase I if the force does not diminish, else transient",
}


class VerdictOutcome(StrEnum):
    """The answer; `cannot_tell` is no permission."""

    WITHIN = "within"
    CANNOT_TELL = "cannot_tell"
    EXCEEDED = "exceeded"


@dataclass(frozen=True)
class Judgement:
    """An impact under one interpretation, at the instant where the force takes the largest share of the limit.

    Parameters
    ----------
    interpretation : Interpretation
    outcome : VerdictOutcome
    force, limit, margin : float
        Force, limit, and limit less force there [N].
    margin_percent : float
        Margin as a share of the limit [%].
    instant : float
        Time after onset [s].
    reason : str
        Why, in words.
    """

    interpretation: Interpretation
    outcome: VerdictOutcome
    force: float
    limit: float
    margin: float
    margin_percent: float
    instant: float
    reason: str


@dataclass(frozen=True, eq=False)
class Verdict:
    """An impact under every interpretation.

    Parameters
    ----------
    impact : Impact
    judgements : tuple of Judgement
        One for each interpretation.
    governing : Judgement
        The strictest, or that of the interpretation named.
    device_error : float
        What is added to the force before it counts as within a limit [N].
    raw_force, corrected_force, filtered_force : float
        Phase I peak: largest sample, corrected for noise, and low-passed [N]; NaN if not low-passed.
    """

    impact: Impact
    judgements: tuple[Judgement, ...]
    governing: Judgement
    device_error: float
    raw_force: float
    corrected_force: float
    filtered_force: float

    @property
    def outcome(self) -> VerdictOutcome:
        """The outcome of the governing interpretation."""
        return self.governing.outcome


def check_impact(impact: Impact, limit: ForceLimit | float, *, interpretation: Interpretation | None = None) -> Verdict:
    """Check an impact against a limit.

    It is within the limit only if force + device error <= limit at every instant; it exceeds it if force - device
    error > limit at some instant; between the two, and where the recording does not show the force (saturated,
    unresolved, no baseline, ended too early), the answer is "cannot tell".

    Parameters
    ----------
    impact : Impact
    limit : ForceLimit or float
        Limits of a body area, or one limit for all of the contact [N].
    interpretation : Interpretation, optional
        The one that governs; the strictest if not given.

    Returns
    -------
    Verdict

    Raises
    ------
    ContactNotPermitted
        The standard permits no contact there.
    InputError
        A limit that is not positive and finite.
    """
    transient, quasi_static = _newtons(limit)
    error = impact.recording.device.error_or_default
    after, force, allowance = _force_over_time(impact)
    judgements = tuple(
        _judge(
            impact,
            each,
            after,
            force,
            allowance,
            limit_line(impact, each, after, transient, quasi_static),
            error,
            quasi_static,
        )
        for each in Interpretation
    )
    strictest = max(judgements, key=lambda j: (_SEVERITY[j.outcome], j.force / j.limit))
    named = [j for j in judgements if j.interpretation is interpretation]
    return Verdict(
        impact=impact,
        judgements=judgements,
        governing=named[0] if named else strictest,
        device_error=error,
        raw_force=impact.raw_peak_force,
        corrected_force=impact.peak_force,
        filtered_force=impact.filtered_peak_force,
    )


def limit_line(
    impact: Impact, interpretation: Interpretation, after: FloatArray, transient: float, quasi_static: float
) -> FloatArray:
    """The limit [N] at times after onset [s], shape (n,).

    Parameters
    ----------
    impact : Impact
    interpretation : Interpretation
    after : array (n,)
        Time after onset [s].
    transient, quasi_static : float
        The two limits [N].
    """
    diminishes = impact.scenario in (ContactScenario.UNCONSTRAINED, ContactScenario.WITHOUT_CLAMPING)
    if interpretation is Interpretation.BY_TIME:
        return np.where(after <= TRANSIENT_TIME, transient, quasi_static)
    if diminishes:
        return np.full(after.shape, transient)
    if interpretation is Interpretation.BY_SCENARIO:
        return np.full(after.shape, quasi_static)
    return np.where(after <= impact.phase1_end - impact.onset, transient, quasi_static)


_SEVERITY = {VerdictOutcome.WITHIN: 0, VerdictOutcome.CANNOT_TELL: 1, VerdictOutcome.EXCEEDED: 2}


def _newtons(limit: ForceLimit | float) -> tuple[float, float]:
    if isinstance(limit, ForceLimit):
        return limit.transient, limit.quasi_static
    newtons = float(limit)
    if not 0 < newtons < math.inf:
        raise InputError(f"limit: found {newtons:g} N, expected a positive finite number")
    return newtons, newtons


def _force_over_time(impact: Impact) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time after onset [s], force [N] with the larger of the peaks, and what drift may hide after Phase I [N]."""
    after, force = impact.curve()
    after, force = after.copy(), force.copy()
    peak = int(np.abs(after - (impact.peak_time - impact.onset)).argmin())
    force[peak] = max(force[peak], impact.verdict_peak_force)
    allowance = impact.contact.drift_allowance(after + impact.onset)
    return after, force, np.where(after > impact.phase1_end - impact.onset, allowance, 0.0)


def _judge(
    impact: Impact,
    interpretation: Interpretation,
    after: FloatArray,
    force: FloatArray,
    allowance: FloatArray,
    line: FloatArray,
    error: float,
    quasi_static: float,
) -> Judgement:
    doubts = error + allowance
    severity = np.where(force - doubts > line, 2, np.where(force + doubts > line, 1, 0))
    gravest = severity == severity.max()
    nearest = int(np.where(gravest, force / line, -np.inf).argmax())  # by the share of the limit it takes
    worst, limit = float(force[nearest]), float(line[nearest])
    hidden = _hidden(impact, quasi_static - error)
    at_least = "at least " if hidden and worst >= impact.raw_peak_force else ""
    if severity[nearest] == 2:
        outcome, reason = VerdictOutcome.EXCEEDED, f"{at_least}{worst:.1f} N exceed the limit of {limit:g} N"
    elif hidden:
        outcome, reason = VerdictOutcome.CANNOT_TELL, f"cannot tell: {hidden}"
    elif severity[nearest] == 1:
        what = f"the device's error of {error:g} N"
        what += f" and {allowance[nearest]:.1f} N that drift may hide" if allowance[nearest] >= 0.05 else ""
        outcome, reason = VerdictOutcome.CANNOT_TELL, f"cannot tell: {worst:.1f} N lie within {what} of {limit:g} N"
    else:
        outcome = VerdictOutcome.WITHIN
        reason = f"{worst:.1f} N and the device's error of {error:g} N stay within {limit:g} N"
    margin = limit - worst
    return Judgement(interpretation, outcome, worst, limit, margin, 100 * margin / limit, float(after[nearest]), reason)


def _hidden(impact: Impact, before: float) -> str:
    """Why the recording does not show how large the force was; empty if it does.

    A force before the impact must stay within `before` [N]: nobody has judged it.
    """
    if impact.force_before > before:
        return f"{impact.force_before:.1f} N act before the impact"
    if impact.verdict_peak_force < impact.contact.floor:
        return f"a peak of {impact.verdict_peak_force:.1f} N is none"
    for flag in impact.flags:
        if flag.name in UNKNOWN_PEAK or (impact.saturated and flag.name == "saturated"):
            return str(flag)
    if impact.scenario is ContactScenario.UNDETERMINED and impact.recorded_time < TRANSIENT_TIME:
        return f"the recording ends {impact.recorded_time:.3f} s after onset while {impact.end_force:.1f} N act"
    return ""
