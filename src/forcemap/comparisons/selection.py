"""Which terms a form needs, as the paper selected its eight, and whether that outcome is stable: a diagnostic."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.errors import FitError, InputError, RankDeficient, TooFewStates
from forcemap.findings import Finding, FindingKind
from forcemap.maps.forms import CFM_3D, FULL_CUBIC, Form, Term
from forcemap.maps.regression import least_squares

PAPER_COUNTS = (19, 13, 8)
"""Terms without the intercept at the start, after stage one and at the end (paper, section II-D)."""

PAPER_SIGNIFICANCE, PAPER_THRESHOLD = 0.05, 0.5
"""Level of significance of stage one, and largest change by a removal in stage two [N] (paper, section II-D)."""

STABLE_SHARE = 0.80
"""A selection is stable if at least this share of the resamples returns exactly the same terms: a choice."""

MIN_RESAMPLES = 20
"""Resamples below which that share is too rough to judge by: at 20 a share of 0.8 is known to about +-0.2."""

_INTERCEPT = Term()


@dataclass(frozen=True)
class TermSignificance:
    """A term in stage one.

    Parameters
    ----------
    term : Term
        The term.
    p_values : tuple of float
        Two-sided p value over the samples of each dataset, all terms present.
    removed : bool
        True if it is above the level of significance in all datasets.
    """

    term: Term
    p_values: tuple[float, ...]
    removed: bool


@dataclass(frozen=True)
class SelectionStep:
    """A fit with fewer terms than the one before.

    Parameters
    ----------
    removed : tuple of Term
        Terms removed: none at the start, all of stage one at once, then one at a time.
    change : float
        Sum over the datasets of the rise of RMSE [N] and 100 times the fall of R^2, against the step before.
    terms : int
        Terms that remain, without the intercept.
    rmse : tuple of float
        Root mean square error over the samples of each dataset [N].
    r_squared : tuple of float
        Coefficient of determination of ln F over the samples of each dataset.
    """

    removed: tuple[Term, ...]
    change: float
    terms: int
    rmse: tuple[float, ...]
    r_squared: tuple[float, ...]


@dataclass(frozen=True)
class TermSelection:
    """The terms that a selection leaves, and how it came to them; nothing uses `form` unless a person passes it on.

    Parameters
    ----------
    form : Form
        The intercept and the terms selected, in the order of `start`.
    start : Form
        The form it started from.
    datasets : tuple of str
        Names of the datasets, in the order of all figures.
    stage_one : tuple of TermSignificance
        Every term of `start` but the intercept.
    steps : tuple of SelectionStep
        The start, stage one, and each removal of stage two.
    refused : SelectionStep or None
        The removal at which it stopped: its change is above the threshold. None if no term is left.
    significance : float
        Level of significance of stage one.
    threshold : float
        Largest change by a removal in stage two [N].
    statements : tuple of Finding
        What the selection depends on.
    """

    form: Form
    start: Form
    datasets: tuple[str, ...]
    stage_one: tuple[TermSignificance, ...]
    steps: tuple[SelectionStep, ...]
    refused: SelectionStep | None
    significance: float
    threshold: float
    statements: tuple[Finding, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms selected, without the intercept."""
        return tuple(term for term in self.form.terms if term != _INTERCEPT)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Terms at the start, after stage one and at the end; `PAPER_COUNTS` are the paper's."""
        return self.steps[0].terms, self.steps[1].terms, self.steps[-1].terms

    @property
    def only_here(self) -> tuple[Term, ...]:
        """Terms selected that are not among the paper's eight."""
        return tuple(term for term in self.terms if term not in CFM_3D.terms)

    @property
    def only_in_paper(self) -> tuple[Term, ...]:
        """Terms of the paper's eight that were not selected."""
        return tuple(term for term in CFM_3D.terms if term not in self.form.terms)


@dataclass(frozen=True)
class TermSurvival:
    """How often a term survives when states are resampled.

    Parameters
    ----------
    term : Term
        The term.
    selected : bool
        True if it is selected from the impacts as measured.
    share : float
        Share of the resamples in which it is.
    """

    term: Term
    selected: bool
    share: float


@dataclass(frozen=True)
class SelectionStability:
    """How far a selection depends on which states happened to be measured.

    Parameters
    ----------
    selection : TermSelection
        From the impacts as measured.
    survival : tuple of TermSurvival
        Every term of the start but the intercept.
    same_terms : float
        Share of the resamples that return exactly the terms of `selection`.
    resamples : int
        How often the states were resampled.
    undetermined : int
        Resamples whose states do not determine the start; they count as another outcome.
    seed : int
        Seed of the resampling.
    """

    selection: TermSelection
    survival: tuple[TermSurvival, ...]
    same_terms: float
    resamples: int
    undetermined: int
    seed: int

    @property
    def stable(self) -> bool:
        """True if at least `STABLE_SHARE` of the resamples return exactly the same terms."""
        return self.same_terms >= STABLE_SHARE

    @property
    def reason(self) -> Finding:
        """Why it is stable or not."""
        figures = {"same": self.same_terms, "resamples": self.resamples, "least": STABLE_SHARE}
        figures["undetermined"] = self.undetermined
        return Finding.of(FindingKind.SELECTION_STABLE, stable=self.stable, **figures)


@dataclass(frozen=True)
class _Samples:
    """Uncensored impacts of a dataset; repeats have the coordinates of their state, so they add no rank."""

    name: str
    design: FloatArray
    force: FloatArray
    state: Indices
    censored: int

    def resampled(self, rng: np.random.Generator) -> _Samples:
        """As many states, drawn with replacement, each with all its repeats."""
        states = int(self.state.max()) + 1
        times = np.bincount(rng.integers(states, size=states), minlength=states)
        rows = np.repeat(np.arange(self.state.size), times[self.state])
        return replace(self, design=self.design[rows], force=self.force[rows], state=self.state[rows])


def select_terms(
    datasets: Sequence[ImpactDataset],
    *,
    start: Form = FULL_CUBIC,
    significance: float = PAPER_SIGNIFICANCE,
    threshold: float = PAPER_THRESHOLD,
) -> TermSelection:
    """Select the terms of a form for several datasets at once in two stages (paper, section II-D).

    Stage one removes at once every term whose p value is above `significance` in all datasets. Stage two removes,
    one at a time, the term whose removal changes least, sum over datasets of (rise of RMSE [N] + 100 fall of R^2 of
    ln F), as long as that change is at most `threshold`. As in the paper repeats count as samples, though they
    share the error of their state. The intercept always stays.

    Parameters
    ----------
    datasets : sequence of ImpactDataset
        Impacts, best on full grids; of every role, because the training states of a grid alone do not determine the
        full cubic, and those of a spread plan barely.
        Censored ones are not used.
    start : Form
        Terms to start from, with the intercept.
    significance : float
        Level of significance of stage one, above 0 and below 1.
    threshold : float
        Largest change by a removal in stage two [N], at least 0.

    Returns
    -------
    TermSelection

    Raises
    ------
    InputError
        No dataset, a start without intercept, or a figure outside its range.
    FitError
        A dataset without uncensored impacts, or whose forces are all the same.
    TooFewStates
        No more states than terms to start from.
    RankDeficient
        The states do not tell the terms to start from apart.
    """
    return _select(_samples(datasets, start), start, significance, threshold)


def selection_stability(
    datasets: Sequence[ImpactDataset],
    *,
    resamples: int = 100,
    seed: int = 0,
    start: Form = FULL_CUBIC,
    significance: float = PAPER_SIGNIFICANCE,
    threshold: float = PAPER_THRESHOLD,
) -> SelectionStability:
    """Repeat a selection of terms on resampled states and count how often each term survives.

    States are drawn with replacement within each dataset, repeats stay together (bootstrap of states, Efron and
    Tibshirani 1993). It is stable if at least 80 % of the resamples return exactly the same terms.

    Parameters
    ----------
    datasets : sequence of ImpactDataset
        As for `select_terms`.
    resamples : int
        How often the states are resampled, at least 20.
    seed : int
        Seed of the resampling.
    start : Form
        Terms to start from, with the intercept.
    significance : float
        Level of significance of stage one, above 0 and below 1.
    threshold : float
        Largest change by a removal in stage two [N], at least 0.

    Returns
    -------
    SelectionStability

    Raises
    ------
    InputError
        As `select_terms`, or too few resamples.
    FitError
        As `select_terms`.
    """
    if resamples < MIN_RESAMPLES:
        raise InputError(f"resamples: found {resamples}, expected at least {MIN_RESAMPLES} to judge stability by")
    samples = _samples(datasets, start)
    selection = _select(samples, start, significance, threshold)
    rng = np.random.default_rng(seed)
    outcomes = []
    for _ in range(resamples):
        with contextlib.suppress(FitError):
            outcomes.append(
                _select([sample.resampled(rng) for sample in samples], start, significance, threshold).terms
            )
    survived = [(tested.term, sum(tested.term in terms for terms in outcomes)) for tested in selection.stage_one]
    return SelectionStability(
        selection=selection,
        survival=tuple(TermSurvival(term, term in selection.terms, times / resamples) for term, times in survived),
        same_terms=outcomes.count(selection.terms) / resamples,
        resamples=resamples,
        undetermined=resamples - len(outcomes),
        seed=seed,
    )


def _samples(datasets: Sequence[ImpactDataset], start: Form) -> list[_Samples]:
    if isinstance(datasets, ImpactDataset) or not len(datasets):
        raise InputError("term selection: expected a list of at least one dataset")
    if _INTERCEPT not in start.terms:
        raise InputError(f"term selection: form {start.name} has no intercept, expected the term 1 among its terms")
    samples = []
    for number, dataset in enumerate(datasets, start=1):
        states, file = dataset.states.uncensored, dataset.source or None
        if not len(states):
            raise FitError("term selection: found no uncensored impact, expected some", file=file)
        if len(states) <= len(start.terms):
            raise TooFewStates(
                f"term selection: found {len(states)} measured states, expected more than the {len(start.terms)} "
                f"coefficients of {start.name} that it starts from; measure the full grid",
                file=file,
            )
        measured = ~dataset.censored
        state = np.array([states.name.index(name) for name in dataset.state[measured].tolist()])
        design = start.design(*states.coordinates.T)
        try:
            least_squares(design, states.log_force)
        except RankDeficient as error:
            raise RankDeficient(
                f"term selection starts from {start.name}: {error.problem}; training states alone are too few",
                file=file,
            ) from None
        if np.ptp(states.log_force) == 0:
            raise FitError("term selection: found the same force at all states", file=file)
        name, force = dataset.source or f"dataset {number}", dataset.peak_force[measured]
        samples.append(_Samples(name, design[state], force, state, int(dataset.censored.sum())))
    return samples


def _select(samples: Sequence[_Samples], start: Form, significance: float, threshold: float) -> TermSelection:
    if not 0 < significance < 1:
        raise InputError(f"significance: found {significance:g}, expected a probability above 0 and below 1")
    if not 0 <= threshold < np.inf:
        raise InputError(f"threshold: found {threshold:g}, expected a finite number of at least 0")
    p_values = np.array([least_squares(sample.design, np.log(sample.force)).p_values for sample in samples])
    intercept, everything = start.terms.index(_INTERCEPT), list(range(len(start.terms)))
    candidates = [j for j in everything if j != intercept]
    insignificant = [j for j in candidates if (p_values[:, j] > significance).all()]
    remaining = [j for j in everything if j not in insignificant]

    def step(removed: Sequence[int], before: FloatArray, after: FloatArray, terms: int) -> SelectionStep:
        rmse, r_squared = after.tolist()
        names = tuple(start.terms[j] for j in removed)
        return SelectionStep(names, float(_change(before, after)), terms, tuple(rmse), tuple(r_squared))

    at_start, now = _qualities(samples, everything)[..., 0], _qualities(samples, remaining)
    steps = [
        step((), at_start, at_start, len(candidates)),
        step(insignificant, at_start, now[..., 0], len(remaining) - 1),
    ]
    refused = None
    while len(remaining) > 1 and refused is None:
        change = np.where(np.equal(remaining, intercept), np.inf, _change(now[..., 0], now[..., 1:]))
        least = int(np.argmin(change))
        following = step([remaining[least]], now[..., 0], now[..., 1 + least], len(remaining) - 2)
        if change[least] > threshold:
            refused = following
        else:
            steps.append(following)
            del remaining[least]
            now = _qualities(samples, remaining)
    return TermSelection(
        form=Form("SELECTED", tuple(start.terms[j] for j in remaining)),
        start=start,
        datasets=tuple(sample.name for sample in samples),
        stage_one=tuple(
            TermSignificance(start.terms[j], tuple(p_values[:, j].tolist()), j in insignificant) for j in candidates
        ),
        steps=tuple(steps),
        refused=refused,
        significance=significance,
        threshold=threshold,
        statements=(
            Finding.of(FindingKind.SELECTED_ON_ALL_ROLES),
            Finding.of(FindingKind.CENSORED_NOT_USED, impacts=sum(sample.censored for sample in samples)),
            Finding.of(FindingKind.P_VALUES_OVER_SAMPLES),
        ),
    )


def _change(before: FloatArray, after: FloatArray) -> FloatArray:
    """Sum over datasets of the rise of RMSE [N] and 100 times the fall of R^2, from shape (2, datasets)."""
    rise, fall = after[0].T - before[0], before[1] - after[1].T
    return np.asarray((rise + 100 * fall).sum(axis=-1))


def _qualities(samples: Sequence[_Samples], terms: list[int]) -> FloatArray:
    """RMSE [N] and R^2 of ln F with these terms, and without each of them, shape (2, datasets, 1 + terms).

    Without term j the coefficients are b - A_j b_j / A_jj with A = (X'X)^-1: the least-squares fit with b_j = 0.
    """
    quality = np.empty((2, len(samples), 1 + len(terms)))
    for row, sample in enumerate(samples):
        log_force = np.log(sample.force)
        fit = least_squares(sample.design[:, terms], log_force)
        inverse = fit.inverse_triangle @ fit.inverse_triangle.T
        without = fit.coefficients[:, None] - inverse * (fit.coefficients / np.diag(inverse))
        predicted = fit.design @ np.column_stack([fit.coefficients, without])
        quality[0, row] = np.sqrt(np.mean((np.exp(predicted) - sample.force[:, None]) ** 2, axis=0))
        residual_squares = np.sum((predicted - log_force[:, None]) ** 2, axis=0)
        quality[1, row] = 1 - residual_squares / np.sum((log_force - log_force.mean()) ** 2)
    return quality
