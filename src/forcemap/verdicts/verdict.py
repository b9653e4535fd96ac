"""An impact against a force limit: force over time below the limit line, under every interpretation of the standard.

Which limit applies when is disputed (Kirschner et al. 2022); all interpretations are evaluated and the strictest
governs unless one is named.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.impact import TRANSIENT_TIME, Impact
from forcemap.impacts.quality import DOUBTFUL
from forcemap.impacts.scenario import BARRING, ContactScenario
from forcemap.limits.device_spring import DeviceSuitability, device_suitability
from forcemap.limits.force_limits import Contact, ForceLimit, NewtonLimit


class Interpretation(StrEnum):
    """When the transient and when the quasi-static limit applies."""

    BY_TIME = "by-time"
    BY_SCENARIO = "by-scenario"
    BY_SHAPE = "by-shape"

    @property
    def words(self) -> str:
        """Which limit applies when, as a phrase."""
        return _WORDS[self]


_WORDS = {
    Interpretation.BY_TIME: "transient limit for the first 0.5 s of contact, quasi-static after it",
    Interpretation.BY_SCENARIO: "quasi-static limit throughout if the contact clamps or may clamp, else transient",
    Interpretation.BY_SHAPE: "quasi-static limit after Phase I if the force does not diminish, else transient",
}


class VerdictOutcome(StrEnum):
    """The answer, in order of severity; `cannot_tell` is no permission."""

    WITHIN = "within"
    CANNOT_TELL = "cannot_tell"
    EXCEEDED = "exceeded"

    @property
    def severity(self) -> int:
        """0 for within, 1 for cannot tell, 2 for exceeded."""
        return list(VerdictOutcome).index(self)

    @classmethod
    def worst(cls, outcomes: Iterable[VerdictOutcome]) -> VerdictOutcome:
        """The gravest; cannot tell if there is none."""
        return max(outcomes, key=lambda outcome: outcome.severity, default=cls.CANNOT_TELL)


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
    reason : Finding
        Why.
    """

    interpretation: Interpretation
    outcome: VerdictOutcome
    force: float
    limit: float
    margin: float
    margin_percent: float
    instant: float
    reason: Finding

    @property
    def gravity(self) -> tuple[int, float]:
        """The order of judgements, the gravest last: by outcome, then by the share of the limit that is taken."""
        return self.outcome.severity, self.force / self.limit


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
    warnings : tuple of Finding
        What must be said before the outcome, a line each.
    """

    impact: Impact
    judgements: tuple[Judgement, ...]
    governing: Judgement
    device_error: float
    warnings: tuple[Finding, ...] = ()

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
    tell". The same if the device's spring is softer than 0.9 of the body area's, or not stated; one from 0.9 to 1
    raises the force by the root of their ratio before it counts as within.

    Parameters
    ----------
    impact : Impact
    limit : ForceLimit, NewtonLimit or float
        Limits of a body area; or a limit in newtons [N], for all of the contact unless its quasi-static part is given.
    interpretation : Interpretation, optional
        The one that governs; the strictest if not given.
    contact : Contact, optional
        Quasi-static: that limit holds for all of the contact. It also says which kind a limit in newtons is: an impact
        that clamps, or of undetermined scenario, is within it only if it is the quasi-static one, or that part is
        given.
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
    limits = _limits_of(impact, limit, contact, quasi_static_limit, spring_N_per_m)
    transient, quasi_static = limits.transient, limits.quasi_static
    error = impact.recording.device.error_or_default
    course = _Course.of(impact, limits.device, error)
    judgements = tuple(
        _judge(impact, rule, course, limit_line(impact, rule, course.after, transient, quasi_static), limits)
        for rule in Interpretation
    )
    strictest = max(judgements, key=lambda judgement: judgement.gravity)
    governing = next((judgement for judgement in judgements if judgement.interpretation is interpretation), strictest)
    return Verdict(impact, judgements, governing, error, limits.warnings)


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


@dataclass(frozen=True)
class _Limits:
    """The limits of an impact [N], the effect of the device's spring on forces, and why nothing can be within."""

    transient: float
    quasi_static: float
    device: DeviceSuitability
    unnamed: Finding | None = None
    warnings: tuple[Finding, ...] = ()


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
        whole = kind is Contact.QUASI_STATIC
        return _Limits(
            limit.quasi_static if whole else limit.transient, limit.quasi_static, suits, warnings=limit.doubts
        )
    stated = NewtonLimit.of(limit, quasi_static, spring)
    if np.ndim(stated.force):
        raise InputError("limit: expected one limit in newtons")
    suits = DeviceSuitability()
    warnings: tuple[Finding, ...] = (Finding.of(FindingKind.DEVICE_ALONE),)
    if stated.spring_N_per_m is not None:
        suits, warnings = device_suitability("the limit", stated.spring_N_per_m, stiffness), ()
    lasting = stated.force if stated.quasi_static is None else stated.quasi_static
    unnamed = None
    if stated.quasi_static is None and kind is not Contact.QUASI_STATIC and impact.scenario in BARRING:
        unnamed = Finding.of(FindingKind.LIMIT_UNNAMED, scenario=impact.scenario, limit_N=stated.force)
    return _Limits(stated.force, lasting, suits, unnamed, warnings)


@dataclass(frozen=True)
class _Course:
    """Force over time after onset [s], [N], its lower and upper bounds, and what makes them differ, arrays (n,)."""

    after: FloatArray
    force: FloatArray
    least: FloatArray
    most: FloatArray
    error: float
    drift: FloatArray
    unseen: FloatArray

    @classmethod
    def of(cls, impact: Impact, device: DeviceSuitability, error: float) -> _Course:
        """The course of an impact: the largest of its peaks, drift after Phase I, what may lie between samples."""
        after, force = impact.curve()
        after, force = after.copy(), force.copy()
        peak = int(np.abs(after - (impact.peak_time - impact.onset)).argmin())
        force[peak] = max(force[peak], impact.verdict_peak_force)
        allowance = impact.contact.drift_allowance(after + impact.onset)
        drift, unseen = np.where(after > impact.phase1_end - impact.onset, allowance, 0.0), np.zeros_like(force)
        unseen[peak] = impact.unseen_force
        most = device.raised * (force + error + drift + unseen)
        return cls(after, force, force - error - drift, most, error, drift, unseen)

    def doubt(self, sample: int) -> dict[str, float]:
        """What is added to the force at a sample before it counts as within [N]."""
        return {"error_N": self.error, "drift_N": float(self.drift[sample]), "unseen_N": float(self.unseen[sample])}


def _judge(
    impact: Impact, interpretation: Interpretation, course: _Course, line: FloatArray, limits: _Limits
) -> Judgement:
    severity = np.where(course.least > line, 2, np.where(course.most <= line, 0, 1))  # as VerdictOutcome.severity
    gravest = severity == severity.max()
    nearest = int(np.where(gravest, course.force / line, -np.inf).argmax())  # by the share of the limit it takes
    shown = list(VerdictOutcome)[severity[nearest]]
    worst, limit = float(course.force[nearest]), float(line[nearest])
    hidden = limits.device.refusal or _hidden(impact, limits.quasi_static / limits.device.raised - course.error)
    hidden = hidden or limits.unnamed
    at_least = hidden is not None and worst >= impact.raw_peak_force
    outcome = VerdictOutcome.CANNOT_TELL if hidden and shown is VerdictOutcome.WITHIN else shown
    figures = {"force_N": worst, "limit_N": limit}
    if outcome is VerdictOutcome.EXCEEDED:
        reason = Finding.of(FindingKind.FORCE_EXCEEDS, **figures, at_least=at_least)
    elif hidden:
        reason = Finding.of(FindingKind.CANNOT_TELL, hidden)
    elif outcome is VerdictOutcome.CANNOT_TELL:
        raised = [limits.device.statement] if limits.device.statement and limits.device.raised > 1 else []
        doubt = Finding.of(FindingKind.FORCE_NEAR_LIMIT, **figures, **course.doubt(nearest))
        reason = Finding.of(FindingKind.CANNOT_TELL, doubt, *raised)
    else:
        reason = Finding.of(FindingKind.FORCE_WITHIN, **figures, **course.doubt(nearest))
    margin, instant = limit - worst, float(course.after[nearest])
    return Judgement(interpretation, outcome, worst, limit, margin, 100 * margin / limit, instant, reason)


def _hidden(impact: Impact, before: float) -> Finding | None:
    """Why the recording does not show how large the force was; None if it does.

    A force before the impact must stay within `before` [N]: nobody has judged it.
    """
    if impact.force_before > before:
        return Finding.of(FindingKind.FORCE_BEFORE_IMPACT, force_N=impact.force_before)
    if impact.verdict_peak_force < impact.contact.floor:
        return Finding.of(FindingKind.NO_PEAK, force_N=impact.verdict_peak_force)
    for flag in impact.flags:
        if flag.name in DOUBTFUL:
            return Finding.of(FindingKind.FLAGGED, flag=flag.name, figure=flag.figure)
    if impact.scenario is ContactScenario.UNDETERMINED and impact.recorded_time < TRANSIENT_TIME:
        return Finding.of(FindingKind.ENDS_EARLY, after_s=impact.recorded_time, force_N=impact.end_force)
    return None
