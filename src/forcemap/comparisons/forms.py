"""Forms compared by leave-one-state-out on the same states, with a recommendation and its reason."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import ImpactDataset, States
from forcemap.errors import BoundNotAvailable, FitError, InputError
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.maps.accuracy import Accuracy, left_out_predictions
from forcemap.maps.bounds import Bound, ToleranceBound, margins
from forcemap.maps.fit import fit_force_map
from forcemap.maps.force_map import ForceMap
from forcemap.maps.form_test import MOST_SCATTER
from forcemap.maps.forms import CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED, Form
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.slower_impacts import slower_impacts

CLEARLY_LOWER = 0.90
"""A form is clearly better only if its left-out error is at most this share of the default's: a choice."""

SIGNIFICANCE = 0.01
"""And only if the paired comparison finds it better at this level over the number of forms compared: a choice."""

ABOVE = 1.5
"""The rise with speed is checked up to this multiple of the highest measured speed: a choice."""

_Errors = dict[str, FloatArray]  # of ln F at the uncensored states, by form
_LEAST_STATES = 3
"""Uncensored states that every form must be able to leave out: two differences hardly show a spread."""


@dataclass(frozen=True)
class EuclideanForm:
    """The map the paper considered and rejected: ln F = b0 + b1 v + b2 r + b3 r^2, r = sqrt(d^2 + h^2) (section II-B).

    Not a `Form`, since r is no product of powers of d and h: it is fitted as CFM_2D to impacts whose distance is r
    and whose height is 0, and serves for comparison alone.
    """

    name: str = "EUCLIDEAN_2D"


EUCLIDEAN_2D = EuclideanForm()
"""The rejected Euclidean-distance map."""

COMPARED_FORMS: tuple[Form | EuclideanForm, ...] = (CFM_2D, EUCLIDEAN_2D, CFM_3D, LOG_SPEED, FULL_CUBIC)
"""Forms compared if none are named."""


@dataclass(frozen=True)
class FormResult:
    """How one form does on states that it was not fitted to.

    Parameters
    ----------
    form : Form or EuclideanForm
        The form.
    accuracy : Accuracy
        Errors at each state when fitted to the others.
    error_percent, underestimation_percent : float
        Root mean square over the states of the left-out error of ln F, and of its dangerous side [%].
    place_error_percent : float
        As `error_percent`, with all states of a place left out together, what a new place gets; NaN where the others do
        not determine the form.
    censored_underestimation_percent : float
        Root mean square over the wholly censored states of how far ln F is predicted below the force they reached at
        least [%]; 0 without such states.
    mean_bound_percent, max_bound_percent : float
        How far the bound lies above the prediction at the measured states [%]; NaN if the form cannot carry it.
    rises_inside, rises_above : bool
        True if the prediction nowhere falls with speed in the box around the measured states, and in that box
        continued to 1.5 times its highest speed.
    p_better : float
        One-sided p value of the paired comparison with the reference: small if this form is better; NaN for the
        reference itself.
    p_better_at_places : float
        The same with all states of a place left out, whose squared errors count together: states of a place share an
        effect. It decides nothing. NaN where a form is not determined without a place.
    covered : bool
        False if a tolerance bound does not cover what the form is found to miss (`FormTest.covered`).
    notes : tuple of Finding
        Remarks on it.
    """

    form: Form | EuclideanForm
    accuracy: Accuracy
    error_percent: float
    underestimation_percent: float
    place_error_percent: float
    censored_underestimation_percent: float
    mean_bound_percent: float
    max_bound_percent: float
    rises_inside: bool
    rises_above: bool
    p_better: float
    p_better_at_places: float
    covered: bool
    notes: tuple[Finding, ...]


@dataclass(frozen=True)
class RefusedForm:
    """A form that these impacts cannot be compared on.

    Parameters
    ----------
    form : Form or EuclideanForm
        The form.
    reason : Finding
        Why.
    """

    form: Form | EuclideanForm
    reason: Finding


@dataclass(frozen=True)
class FormComparison:
    """Forms compared on the same left-out states.

    Parameters
    ----------
    results : tuple of FormResult
        The forms that could be fitted, in the order given.
    refused : tuple of RefusedForm
        The others.
    recommended : Form or None
        The default unless it falls with speed or another is clearly better; None if no form carries the bound, so that
        no safe speed follows from any, or every form falls with speed.
    reasons : tuple of Finding
        Why.
    states : int
        Number of uncensored states compared on.
    bound : Bound
        The bound whose width is given.
    statements : tuple of Finding
        What the comparison depends on.
    """

    results: tuple[FormResult, ...]
    refused: tuple[RefusedForm, ...]
    recommended: Form | None
    reasons: tuple[Finding, ...]
    states: int
    bound: Bound
    statements: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A fitted form and the forces [N] it predicts by name at states left out, and left out with all of their place."""

    form: Form | EuclideanForm
    force_map: ForceMap
    left_out: dict[str, float]
    place_left_out: dict[str, float]

    def predicted(self, states: States, *, place_left_out: bool = False) -> FloatArray:
        return np.array([(self.place_left_out if place_left_out else self.left_out)[name] for name in states.name])


def compare_forms(
    dataset: ImpactDataset, *, forms: Sequence[Form | EuclideanForm] | None = None, bound: Bound | None = None
) -> FormComparison:
    """Compare forms by predicting each state with role train from the others, all forms on the same states.

    The default CFM_3D (the first of the forms where it is not among them or cannot be fitted) is recommended unless
    another form is clearly better: a root-mean-square left-out error of ln F at least 10 % lower, a lower one on the
    dangerous side too, wholly censored states not underestimated more, a one-sided paired t test over the states of
    the squared errors significant at 1 % divided by the number of other forms, and a bound where the default has one.
    A form that falls with speed inside the measured range is never recommended: in place of such a default stands the
    form with the lowest error among those that rise, with a bound if any has one. If no form rises, or none carries the
    bound, none is recommended. A form is not compared where half of its states or more cannot be left out.

    Parameters
    ----------
    dataset : ImpactDataset
        The impacts.
    forms : sequence of Form or EuclideanForm, optional
        Forms to compare; CFM_2D, EUCLIDEAN_2D, CFM_3D, LOG_SPEED and FULL_CUBIC if not given.
    bound : Bound, optional
        Bound whose width is compared; ToleranceBound() if not given.

    Returns
    -------
    FormComparison

    Raises
    ------
    InputError
        No form, a name twice, the Euclidean-distance map alone, or what is no bound.
    FitError
        No form can be fitted and compared.
    """
    forms = COMPARED_FORMS if forms is None else tuple(forms)
    bound = ToleranceBound() if bound is None else bound
    if isinstance(bound, type) or not isinstance(bound, Bound):
        raise InputError(f"bound: found {bound!r}, expected FixedMargin or ToleranceBound")
    names = [form.name for form in forms]
    if len(set(names)) < len(names) or not any(isinstance(form, Form) for form in forms):
        raise InputError(f"forms: found {', '.join(names) or 'none'}, expected at least one form and none twice")
    fitted, errors = [], {}
    for form in forms:
        try:
            fitted.append(_fit(form, dataset))
        except FitError as error:
            errors[form] = error.message
    usable = [candidate.form for candidate in fitted if isinstance(candidate.form, Form)]
    if not usable:
        causes = "; ".join(f"{form.name}: {message}" for form, message in errors.items())
        raise FitError(f"no form can be compared: {causes}", file=dataset.source or None)
    refused = tuple(RefusedForm(form, in_words(message)) for form, message in errors.items())
    reference = CFM_3D if CFM_3D in usable else usable[0]
    states = _common_states(dataset, fitted)
    below_range, measured = states.uncensored, len(states.uncensored)
    left_out = tuple(
        {
            each.form.name: np.log(each.predicted(below_range, place_left_out=which)) - below_range.log_force
            for each in fitted
        }
        for which in (False, True)
    )
    wholly_censored = int(np.sum(dataset.train.states.impacts == 0))
    results = tuple(_result(candidate, states, left_out, reference, bound) for candidate in fitted)
    recommended, reasons = _recommend(results, reference, refused)
    return FormComparison(
        results=results,
        refused=refused,
        recommended=recommended,
        reasons=reasons,
        states=measured,
        bound=bound,
        statements=(
            *fitted[0].force_map.conditions.findings,
            *filter(None, [slower_impacts(fitted[0].force_map)]),
            Finding.of(FindingKind.STATES_LEFT_OUT_IN_TURN, states=measured),
            *_few_shared(fitted),
            Finding.of(FindingKind.FLATTERED),
            Finding.of(FindingKind.WHOLLY_CENSORED, states=wholly_censored, compared=len(states) - measured),
            Finding.of(FindingKind.WIDTH_OF_BOUND, bound=bound),
        ),
    )


def _few_shared(fitted: Sequence[_Fitted]) -> Iterator[Finding]:
    """What p values of departures are worth where few places hold several states."""
    tests = [each.force_map.form_test for each in fitted if isinstance(each.form, Form)]
    if any(test and test.misses and test.few_shared for test in tests):
        yield Finding.of(FindingKind.FEW_SHARED)


def _fit(form: Form | EuclideanForm, dataset: ImpactDataset) -> _Fitted:
    place_of = dict(zip(dataset.train.states.name, dataset.train.states.place.tolist(), strict=True))
    if isinstance(form, EuclideanForm):
        radius = np.hypot(dataset.distance, dataset.height)
        dataset = replace(dataset, distance=radius, height=np.zeros_like(radius))
    force_map = fit_force_map(dataset, form=form if isinstance(form, Form) else CFM_2D)
    predicted = left_out_predictions(force_map)
    names = force_map.require_fit().states.name
    left_out = {name: force for name, force in zip(names, predicted.tolist(), strict=True) if 0 < force < math.inf}
    if 2 * len(left_out) <= len(names):
        raise FitError(
            f"found {len(left_out)} of {len(names)} states that can be left out, expected more than half",
            remedy="measure more states",
        )
    of_places = left_out_predictions(force_map, np.array([place_of[name] for name in names]))
    return _Fitted(form, force_map, left_out, dict(zip(names, of_places.tolist(), strict=True)))


def _common_states(dataset: ImpactDataset, fitted: Sequence[_Fitted]) -> States:
    """The states that every form predicts when they are left out, wholly censored ones too."""
    states = dataset.train.states
    common = states.select(np.array([all(name in candidate.left_out for candidate in fitted) for name in states.name]))
    if (measured := len(common.uncensored)) < _LEAST_STATES:
        raise FitError(
            f"found {measured} uncensored states that every form can leave out, expected at least {_LEAST_STATES}; "
            "measure more states or compare forms with fewer terms",
            file=dataset.source or None,
        )
    return common


def _result(fitted: _Fitted, states: States, errors: tuple[_Errors, ...], reference: Form, bound: Bound) -> FormResult:
    force_map, (error, of_place) = fitted.force_map, (each[fitted.form.name] for each in errors)
    predicted, wholly = fitted.predicted(states), states.impacts == 0
    below_reached = np.log(predicted[wholly] / states.at_least[wholly])
    below_range = states.uncensored
    state_gain, place_gain = (each[reference.name] ** 2 - each[fitted.form.name] ** 2 for each in errors)
    of_places = np.array([place_gain[below_range.place == each].sum() for each in np.unique(below_range.place)])
    skipped = len(force_map.require_fit().states.uncensored) - error.size
    notes = [] if isinstance(fitted.form, Form) else [Finding.of(FindingKind.EUCLIDEAN_FORM)]
    try:
        width = 100 * margins(bound, force_map)
        mean_bound, max_bound = float(width.mean()), float(width.max())
    except BoundNotAvailable as refusal:
        mean_bound = max_bound = math.nan
        notes.append(Finding.of(FindingKind.NO_BOUND, in_words(refusal.message)))
    tested = force_map.form_test if isinstance(fitted.form, Form) else None
    if tested:
        notes += [departure.finding for departure in tested.significant]
        figures = {"state_sd": tested.state_sd, "most": MOST_SCATTER}
        notes += [Finding.of(FindingKind.FORM_SCATTERS, **figures)] if tested.scatter else []
    points = force_map.measured_range.points
    further = MeasuredRange(np.vstack([points, points * (1.0, 1.0, ABOVE)]))
    return FormResult(
        form=fitted.form,
        accuracy=Accuracy.of(predicted, states, on="leave-one-state-out", skipped=skipped),
        error_percent=100 * _root_mean_square(error),
        underestimation_percent=100 * _root_mean_square(np.minimum(error, 0.0)),
        place_error_percent=100 * _root_mean_square(of_place),
        censored_underestimation_percent=100 * _root_mean_square(np.minimum(below_reached, 0.0)),
        mean_bound_percent=mean_bound,
        max_bound_percent=max_bound,
        rises_inside=force_map.rises_with_speed,
        rises_above=replace(force_map, measured_range=further).rises_with_speed,
        p_better=math.nan if fitted.form == reference else _p_better(state_gain),
        p_better_at_places=math.nan if fitted.form == reference else _p_better(of_places),
        covered=not (tested and tested.misses) or tested.covered,
        notes=tuple(notes),
    )


def _root_mean_square(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _p_better(gain: FloatArray) -> float:
    """One-sided p value of a paired t test that the squared errors are not smaller than the reference's, by `gain`."""
    from scipy.special import stdtr

    if gain.size < _LEAST_STATES or not np.isfinite(gain).all():
        return math.nan
    deviation = float(gain.std(ddof=1))
    if deviation == 0:
        return 0.0 if gain[0] > 0 else 1.0
    return float(stdtr(gain.size - 1, -gain.mean() / deviation * math.sqrt(gain.size)))


def _recommend(
    results: Sequence[FormResult], reference: Form, refused: Sequence[RefusedForm]
) -> tuple[Form | None, tuple[Finding, ...]]:
    """The reference unless another form is clearly better; of several, the one with the lowest error."""
    kind, name = FindingKind, reference.name
    (standard,) = [result for result in results if result.form == reference]
    others = [result for result in results if result.form != reference and isinstance(result.form, Form)]
    reasons = [
        Finding.of(kind.FORM_NOT_FITTED, form_refused.reason, form=form_refused.form.name)
        for form_refused in refused
        if form_refused.form == CFM_3D
    ]
    if not any(_bounded(result) for result in (standard, *others)):
        tried = tuple(result.form.name for result in (standard, *others))
        why = Finding.of(kind.NOTE_OF_FORM, *standard.notes, form=name)
        return None, (*reasons, Finding.of(kind.NO_FORM_CARRIES_BOUND, forms=tried), why)
    rising = [result for result in (standard, *others) if result.rises_inside]
    if not rising:
        fall = tuple(result.form.name for result in (standard, *others))
        return None, (*reasons, Finding.of(kind.FORMS_FALL, forms=fall))
    level = SIGNIFICANCE / max(1, len(others))
    better = [result for result in others if _clearly_better(result, standard, level)]
    if better or standard not in rising:
        best = min(better or rising, key=lambda result: (not _bounded(result), result.error_percent))
        assert isinstance(best.form, Form)
        errors = {"error_percent": best.error_percent, "against_percent": standard.error_percent}
        figures = {"form": best.form.name, "than": name, **errors}
        better_by = Finding.of(kind.FORM_CLEARLY_BETTER, **figures, p=best.p_better)
        reasons.append(better_by if better else Finding.of(kind.FORM_RISES, **figures))
        return best.form, (*reasons, *_doubts(best))
    is_default = reference == CFM_3D
    clear = {"others": len(others), "level": level, "shared": SIGNIFICANCE, "lower": 1 - CLEARLY_LOWER}
    kept = {"form": name, "default": is_default, "error_percent": standard.error_percent}
    reasons.append(Finding.of(kind.FORM_KEPT, **kept, **clear))
    reasons += _doubts(standard)
    for result in others:
        compared = {
            "lower": result.error_percent < standard.error_percent,
            "falls": not result.rises_inside,
            "censored_worse": not _censored_no_worse(result, standard),
            "unbounded": _bounded(result) < _bounded(standard),
        }
        p_places = None if math.isnan(result.p_better_at_places) else result.p_better_at_places
        figures = {"form": result.form.name, "error_percent": result.error_percent, "p": result.p_better}
        of_place = {"place_percent": result.place_error_percent, "against_percent": standard.place_error_percent}
        reasons.append(Finding.of(kind.FORM_COMPARED, **figures, **of_place, p_places=p_places, **compared))
    if not standard.rises_above:
        reasons.append(Finding.of(kind.FORM_FALLS_ABOVE, form=name))
    return reference, tuple(reasons)


def _bounded(result: FormResult) -> bool:
    return math.isfinite(result.mean_bound_percent)


def _doubts(result: FormResult) -> list[Finding]:
    """What is to be known of a form that is recommended: it carries no bound, or the states do not quite fit it."""
    kind, name = FindingKind, result.form.name
    off = [note for note in result.notes if note.kind in (kind.FORM_DEPARTURE, kind.FORM_SCATTERS)]
    unbounded = [] if _bounded(result) else [Finding.of(kind.FORM_UNBOUNDED, form=name)]
    departs = any(note.kind is kind.FORM_DEPARTURE for note in off)
    then = {"departs": departs, "covered": departs and result.covered, "uncovered": not result.covered}
    return [*unbounded, *([Finding.of(kind.FORM_OFF, *off, form=name, **then)] if off else [])]


def _censored_no_worse(result: FormResult, standard: FormResult) -> bool:
    """True if no more wholly censored states are predicted below the force they reached at least, and none farther."""
    return (
        result.accuracy.censored_underestimated <= standard.accuracy.censored_underestimated
        and result.censored_underestimation_percent <= standard.censored_underestimation_percent
    )


def _clearly_better(result: FormResult, standard: FormResult, level: float) -> bool:
    return (
        result.error_percent <= CLEARLY_LOWER * standard.error_percent
        and result.underestimation_percent < standard.underestimation_percent
        and _censored_no_worse(result, standard)
        and result.p_better < level
        and result.rises_inside
        and _bounded(result) >= _bounded(standard)
    )
