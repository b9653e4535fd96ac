"""An impact against a force limit: force over time below the limit line, under every interpretation of the standard.

Which limit applies when is disputed (Kirschner et al. 2022); all interpretations are evaluated and the strictest
governs unless one is named.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.quality import UNKNOWN_PEAK
from forcemap.impacts.scenario import BARRING, ContactScenario
from forcemap.limits.device_spring import DEVICE_ALONE, DeviceSuitability, device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit


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
    warnings : tuple of str
        What must be said before the outcome, a line each.
    """

    impact: Impact
    judgements: tuple[Judgement, ...]
    governing: Judgement
    device_error: float
    raw_force: float
    corrected_force: float
    filtered_force: float
    warnings: tuple[str, ...] = ()

    @property
    def outcome(self) -> VerdictOutcome:
        """The outcome of the governing interpretation."""
        return self.governing.outcome


def check_impact(
    impact: Impact,
    limit: ForceLimit | NewtonLimit | float,
    *,
    interpretation: Interpretation | None = None,
    contact: Contact | None = None,
    quasi_static_limit: float | None = None,
    spring_N_per_m: float | None = None,
) -> Verdict:
    """Check an impact against a limit.

    It is within the limit only if force + device error <= limit at every instant, with what its peak may have risen
    between two samples; it exceeds it if force - device error > limit at some instant; between the two, and where the
    recording does not show the force (saturated, unresolved, no baseline, ended too early), the answer is "cannot
    tell". So it is where the device's spring is softer than 0.9 of the body area's, or not stated; one from 0.9 to 1
    raises the force by the root of their ratio before it counts as within.

    Parameters
    ----------
    impact : Impact
    limit : ForceLimit, NewtonLimit or float
        Limits of a body area; or a limit in newtons [N], for all of the contact unless its quasi-static part is given.
    interpretation : Interpretation, optional
        The one that governs; the strictest if not given.
    contact : Contact, optional
        Quasi-static: that limit holds for all of the contact. Of a limit in newtons it tells which kind it is: an
        impact that clamps, or of undetermined scenario, is within it only if it is the quasi-static one, or that part
        is given.
    quasi_static_limit, spring_N_per_m : float, optional
        As in `safe_speed`, with a limit in newtons.

    Returns
    -------
    Verdict

    Raises
    ------
    ContactNotPermitted
        The standard permits no contact there.
    InputError
        A limit that is not positive and finite, or figures that go with one in newtons beside a body area.
    """
    found = _limits_of(impact, limit, contact, quasi_static_limit, spring_N_per_m)
    transient, quasi_static = found.transient, found.quasi_static
    error = impact.recording.device.error_or_default
    course = _Course.of(impact, found.device, error)
    judgements = tuple(
        _judge(
            impact,
            each,
            course,
            limit_line(impact, each, course.after, transient, quasi_static),
            found,
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
        warnings=found.warnings,
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


@dataclass(frozen=True)
class _Limits:
    """The limits of an impact [N], what the device's spring makes of forces, and why nothing can be within."""

    transient: float
    quasi_static: float
    device: DeviceSuitability
    unnamed: str = ""
    warnings: tuple[str, ...] = ()


def _limits_of(
    impact: Impact,
    limit: ForceLimit | NewtonLimit | float,
    contact: Contact | None,
    quasi_static: float | None,
    spring: float | None,
) -> _Limits:
    stiffness, kind = impact.recording.device.stiffness, None if contact is None else Contact.parse(contact)
    if isinstance(limit, ForceLimit):
        if quasi_static is not None or spring is not None:
            raise InputError("limit: quasi_static_limit and spring_N_per_m go with a limit in newtons")
        suits = device_suitability(limit.name, limit.stiffness, stiffness)
        warnings = (limit.head_statement,) if limit.head_statement else ()
        whole = kind is Contact.QUASI_STATIC
        return _Limits(limit.quasi_static if whole else limit.transient, limit.quasi_static, suits, warnings=warnings)
    stated = NewtonLimit.of(limit, quasi_static, spring)
    if np.ndim(stated.force):
        raise InputError("limit: expected one limit in newtons")
    suits, warnings = DeviceSuitability(1.0, "", ""), (DEVICE_ALONE,)
    if stated.spring_N_per_m is not None:
        suits, warnings = device_suitability("the limit", stated.spring_N_per_m, stiffness), ()
    held = stated.force if stated.quasi_static is None else stated.quasi_static
    unnamed = ""
    if stated.quasi_static is None and kind is not Contact.QUASI_STATIC and impact.scenario in BARRING:
        unnamed = (
            f"the contact is {impact.scenario.words}, and nothing tells whether {stated.force:g} N are its "
            "quasi-static limit; state that (--quasi-static-limit-N, quasi_static_limit=), or --contact quasi-static"
        )
    return _Limits(stated.force, held, suits, unnamed, warnings)


@dataclass(frozen=True)
class _Course:
    """Force over time after onset [s], [N], what it is at least and at most, and what lies between, arrays (n,)."""

    after: FloatArray
    force: FloatArray
    least: FloatArray
    most: FloatArray
    error: float
    drift: FloatArray
    unseen: FloatArray

    @classmethod
    def of(cls, impact: Impact, device: DeviceSuitability, error: float) -> _Course:
        """With the largest of its peaks, what drift may hide after Phase I, and what may lie between samples."""
        after, force = impact.curve()
        after, force = after.copy(), force.copy()
        peak = int(np.abs(after - (impact.peak_time - impact.onset)).argmin())
        force[peak] = max(force[peak], impact.verdict_peak_force)
        allowance = impact.contact.drift_allowance(after + impact.onset)
        drift, unseen = np.where(after > impact.phase1_end - impact.onset, allowance, 0.0), np.zeros_like(force)
        unseen[peak] = impact.unseen_force
        most = device.raised * (force + error + drift + unseen)
        return cls(after, force, force - error - drift, most, error, drift, unseen)

    def doubt(self, at: int) -> str:
        """What is added to the force at a sample before it counts as within."""
        what = [f"the device's error of {self.error:g} N"]
        what += [f"{self.drift[at]:.1f} N that drift may hide"] if self.drift[at] >= 0.05 else []
        what += [f"{self.unseen[at]:.1f} N that may lie between samples"] if self.unseen[at] >= 0.05 else []
        return ", ".join(what[:-1]) + " and " * (len(what) > 1) + what[-1]


def _judge(
    impact: Impact, interpretation: Interpretation, course: _Course, line: FloatArray, limits: _Limits
) -> Judgement:
    severity = np.where(course.least > line, 2, np.where(course.most <= line, 0, 1))
    gravest = severity == severity.max()
    nearest = int(np.where(gravest, course.force / line, -np.inf).argmax())  # by the share of the limit it takes
    worst, limit = float(course.force[nearest]), float(line[nearest])
    hidden = limits.device.refusal or _hidden(impact, limits.quasi_static / limits.device.raised - course.error)
    hidden = hidden or limits.unnamed
    at_least = "at least " if hidden and worst >= impact.raw_peak_force else ""
    if severity[nearest] == 2:
        outcome, reason = VerdictOutcome.EXCEEDED, f"{at_least}{worst:.1f} N exceed the limit of {limit:g} N"
    elif hidden:
        outcome, reason = VerdictOutcome.CANNOT_TELL, f"cannot tell: {hidden}"
    elif severity[nearest] == 1:
        what = course.doubt(nearest)
        what += f" ({limits.device.statement})" if limits.device.raised > 1 else ""
        outcome, reason = VerdictOutcome.CANNOT_TELL, f"cannot tell: {worst:.1f} N lie within {what} of {limit:g} N"
    else:
        outcome = VerdictOutcome.WITHIN
        reason = f"{worst:.1f} N and {course.doubt(nearest)} stay within {limit:g} N"
    margin = limit - worst
    return Judgement(
        interpretation, outcome, worst, limit, margin, 100 * margin / limit, float(course.after[nearest]), reason
    )


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
