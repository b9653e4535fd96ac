"""How far a map's predictions are from measured forces; underestimation is the dangerous side."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.campaigns.dataset import CONFIRMING, ImpactDataset, States
from forcemap.errors import FitError, InputError
from forcemap.maps.censored import CensoredRegression, coefficients_at
from forcemap.maps.force_map import ForceMap
from forcemap.maps.places import place_regression

FEWEST_TESTS = 6
"""Test states that tell an error, a choice: of fewer the largest says next to nothing; states left out in turn do."""


@dataclass(frozen=True)
class Accuracy:
    """Errors of predictions over states (paper, Table II); percent of the measured force.

    The newtons beside a maximum belong to the state with the largest percentage. Means are over the states that are
    under- or overestimated; figures are 0 if there is none. Wholly censored states have no error and are only counted.

    Parameters
    ----------
    on : str
        What the map was compared with.
    states, underestimated, overestimated : int
        Number of states compared, and of those predicted below and above the measurement.
    max_underestimation_percent, max_underestimation, mean_underestimation_percent, mean_underestimation : float
        Measured above predicted [%], [N].
    max_overestimation_percent, max_overestimation, mean_overestimation_percent, mean_overestimation : float
        Measured below predicted [%], [N].
    rmse : float
        Root mean square error [N].
    worst_state : str
        Name of the most underestimated state, empty if none is.
    censored_states : int
        States without an uncensored impact, not compared.
    censored_underestimated : int
        Of those, how many are predicted below the force they reached at least.
    skipped_states : int
        States that could not be left out because the others do not determine the map.
    outside_states : int or None
        Of the states compared, how many lie outside the map's measured range, where it is continued, by more than
        repeats of a state may differ; None where states are left out in turn.
    """

    on: str
    states: int
    underestimated: int
    max_underestimation_percent: float
    max_underestimation: float
    mean_underestimation_percent: float
    mean_underestimation: float
    overestimated: int
    max_overestimation_percent: float
    max_overestimation: float
    mean_overestimation_percent: float
    mean_overestimation: float
    rmse: float
    worst_state: str
    censored_states: int = 0
    censored_underestimated: int = 0
    skipped_states: int = 0
    outside_states: int | None = None

    @classmethod
    def of(cls, predicted: FloatArray, states: States, *, on: str, skipped: int = 0) -> Accuracy:
        """Compare predicted forces [N] with those of states, both of shape (m,).

        Raises
        ------
        InputError
            No state has an uncensored impact.
        """
        measured = states.impacts > 0
        if not measured.any():
            raise InputError(f"found no uncensored state to compare the map with ({on}), expected at least one")
        names = [states.name[i] for i in np.flatnonzero(measured)]
        return replace(
            cls.of_forces(predicted[measured], states.force[measured], names, on=on),
            censored_states=int(np.sum(~measured)),
            censored_underestimated=int(np.sum(predicted[~measured] < states.at_least[~measured])),
            skipped_states=skipped,
        )

    @classmethod
    def of_forces(cls, predicted: FloatArray, force: FloatArray, names: Sequence[str], *, on: str) -> Accuracy:
        """Compare predicted forces [N] with measured ones, both of shape (m,), of named states."""
        error = predicted - force
        percent = 100 * error / force
        with np.errstate(over="ignore"):
            rmse = float(np.sqrt(np.mean(error**2)))
        worst = names[int(np.argmin(percent))] if (error < 0).any() else ""
        sides = *_one_side(-percent, -error), *_one_side(percent, error)
        return cls(on, force.size, *sides, rmse=rmse, worst_state=worst)


def _one_side(percent: FloatArray, error: FloatArray) -> tuple[int, float, float, float, float]:
    """Number of states with a positive error; the largest [%], [N] and the mean one [%], [N] of these, 0 if none."""
    here = error > 0
    if not here.any():
        return 0, 0.0, 0.0, 0.0, 0.0
    largest = int(np.argmax(percent))
    means = float(percent[here].mean()), float(error[here].mean())
    return int(here.sum()), float(percent[largest]), float(error[largest]), *means


ON_TEST = "test states"
"""What an accuracy is on if it is of states of their own, as results and tables name it."""


INSIDE = "test states inside"
"""The same of those inside the measured range alone."""


def map_accuracy(force_map: ForceMap, dataset: ImpactDataset) -> tuple[Accuracy, ...]:
    """Accuracies of a map fitted to a dataset, the most trustworthy one first.

    On the test states (those that repeat no training state) if there are any, first if they are 6 or more, and if some
    of them lie outside the measured range, on those inside it alone; on the
    fitted states, and on their places, each left out in turn where that is possible; on the impacts that were to
    confirm a map, which were made only where it permitted speeds; and on all states (paper, Table II, rows Ts and All).
    """
    test = dataset.independent_test
    confirms = np.char.startswith(test.state, CONFIRMING)
    accuracies = _of_test(force_map, test.select(~confirms), ON_TEST)
    if accuracies and accuracies[0].outside_states:
        inside = force_map.measured_range.near(test.states.coordinates, dataset.tolerance.scale)
        names = np.array(test.states.name)[inside]
        accuracies += _of_test(force_map, test.select(~confirms & np.isin(test.state, names)), INSIDE)
    for left_out in (leave_one_state_out, leave_one_place_out):
        with contextlib.suppress(InputError):  # as many states as coefficients: none can be left out
            accuracies.append(left_out(force_map))
    if accuracies and accuracies[0].states < FEWEST_TESTS:
        accuracies.sort(key=lambda each: each.states < FEWEST_TESTS)
    accuracies += _of_test(force_map, test.select(confirms), "confirming impacts")
    accuracies.append(force_map_accuracy(force_map, dataset.select(~dataset.slower), on="all states"))
    return tuple(accuracies)


def _of_test(force_map: ForceMap, test: ImpactDataset, on: str) -> list[Accuracy]:
    """The accuracy on test states; none without an uncensored impact."""
    return [force_map_accuracy(force_map, test, on=on)] if (test.states.impacts > 0).any() else []


def force_map_accuracy(force_map: ForceMap, dataset: ImpactDataset, *, on: str = "all states") -> Accuracy:
    """Accuracy of a map on the states of a dataset: pass `dataset.test`, or all of it.

    Parameters
    ----------
    force_map : ForceMap
        The map.
    dataset : ImpactDataset
        The impacts.
    on : str
        What the states are called in the result.

    Raises
    ------
    InputError
        The dataset has no uncensored state.
    """
    if not len(dataset):
        raise InputError(
            "found no impact to compare the map with, expected at least one; without impacts of role test see "
            "map_accuracy and leave_one_state_out"
        )
    states = dataset.states
    compared = Accuracy.of(force_map.predict(states.distance, states.height, states.speed), states, on=on)
    inside = force_map.measured_range.near(states.uncensored.coordinates, dataset.tolerance.scale)
    return replace(compared, outside_states=int(np.sum(~inside)))


def leave_one_state_out(force_map: ForceMap) -> Accuracy:
    """Accuracy of a fitted map on each of its states when fitted to the others.

    Raises
    ------
    InputError
        The map was not fitted here, or no state can be left out.
    """
    return _left_out_accuracy(force_map, np.arange(len(force_map.require_fit().states)), "state")


def _left_out_accuracy(force_map: ForceMap, group: Indices, what: str) -> Accuracy:
    """Accuracy on groups of states, each left out in turn."""
    fit = force_map.require_fit()
    predicted = left_out_predictions(force_map, group)
    possible = ~np.isnan(predicted)
    if not possible.any():
        raise InputError(
            f"found {len(fit.states)} states at {fit.place_effect.places} places for {force_map.coefficients.size} "
            f"coefficients: no {what} can be left out, expected more"
        )
    states, skipped = fit.states.select(possible), int(np.sum(~possible))
    return Accuracy.of(predicted[possible], states, on=f"leave-one-{what}-out", skipped=skipped)


def leave_one_place_out(force_map: ForceMap) -> Accuracy:
    """Accuracy of a fitted map at each of its places when fitted to the states of the others.

    Raises
    ------
    InputError
        The map was not fitted here, or no place can be left out.
    """
    fit = force_map.require_fit()
    return _left_out_accuracy(force_map, fit.states.place, "place")


def left_out_predictions(force_map: ForceMap, group: Indices | None = None) -> FloatArray:
    """Force [N] of each fitted state as predicted by the others, shape (m,); NaN where they do not determine the map.

    The map is fitted again without each state, or each group of states; its standard deviations are those of the whole
    fit.

    Parameters
    ----------
    force_map : ForceMap
    group : array of int, shape (m,), optional
        States with the same number are left out together.

    Raises
    ------
    InputError
        The map was not fitted here.
    """
    fit = force_map.require_fit()
    whole, data, m = fit.whole(), fit.data(), len(fit.states)
    levels, own = np.full(m, np.nan), data.design[-m:]
    for number in np.unique(group := np.arange(m) if group is None else group):
        out = group == number
        rest = data.select(np.concatenate([np.full(data.mean.size - m, True), ~out]))
        with contextlib.suppress(FitError):  # too few, rank deficient or without a maximum when it is left out
            if isinstance(whole, CensoredRegression):
                coefficients = coefficients_at(rest, whole.deviation)
            else:
                coefficients = place_regression(rest.design, rest.mean, rest.place, rest.correlation).coefficients
            levels[out] = own[out] @ coefficients
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(levels))
