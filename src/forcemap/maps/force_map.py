"""The collision-force map F(d, h, v)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap._version import __version__
from forcemap.arrays import FloatArray, Mask
from forcemap.campaigns.dataset import Binding, Conditions, Drift, PhaseTwo, Quantity, States, measured_again
from forcemap.errors import InputError
from forcemap.findings import Finding
from forcemap.maps import kernels
from forcemap.maps.censored import CensoredRegression, StateData, state_data
from forcemap.maps.form_test import FormTest, form_test, gaps_of
from forcemap.maps.forms import Form
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.places import PlaceEffect, error_growth
from forcemap.maps.regression import Regression
from forcemap.maps.transfer import Transfer, TransferRegression

NO_STATES = States.single((), np.empty((0, 3)), np.empty(0))

_GRID = 25
"""Points along each axis at which it is checked whether the prediction falls with speed. A choice: what is missed
between them costs no more than a note, for a bound is searched everywhere."""


def of_earlier(name: str) -> str:
    """What the names of slower states end with that are of an earlier map, by its name."""
    return f" of {name}"


@dataclass(frozen=True, eq=False)
class Fit:
    """What a map was fitted to, and how well it fits.

    Parameters
    ----------
    states : States
        The states the map was fitted to; wholly censored ones too, unless censored impacts were discarded.
    left_out : States
        States that were left out because all of their impacts are censored and those were discarded; of a map that was
        carried over, those outside the earlier map's range.
    test : States
        States with role test: not fitted, but what they measured may contradict a speed.
    slower : States
        States with role train that are slower than the map is to hold for: not fitted either, but they count.
    at_points : States
        Impacts at contact points alone, along the map's direction: not fitted either, each a state of its own.
    between_states : Regression
        Fit of the state means of ln F, with the correlation that the bound uses.
    place_effect : PlaceEffect
        How strongly the states of a place are correlated; the fit takes this into account.
    over_samples : Regression or None
        Fit of ln F of all uncensored impacts as if independent: the paper's reading, for its term selection.
        None for a map read from a file.
    states_found : str
        How states were found.
    table, table_sha256 : str
        Name and SHA-256 of the impacts table.
    transfer : Transfer or None
        What the map was carried over from; None for a map that rests on its own states alone.
    disagreeing : tuple of str
        States of the impacts table whose repeats lie far apart (`ImpactDataset.disagreeing_repeats`).
    other_sites : tuple of (str, int, float)
        As `ImpactDataset.other_sites`; a map file does not keep them.
    """

    states: States
    left_out: States
    test: States
    between_states: Regression
    place_effect: PlaceEffect
    over_samples: Regression | None = None
    states_found: str = ""
    table: str = ""
    table_sha256: str = ""
    transfer: Transfer | None = None
    at_points: States = NO_STATES
    slower: States = NO_STATES
    disagreeing: tuple[str, ...] = ()
    other_sites: tuple[tuple[str, int, float], ...] = ()

    @property
    def measured(self) -> tuple[States, ...]:
        """All that may contradict a speed, as `of_table`, and states at contact points."""
        return (*self.of_table, self.at_points)

    @property
    def of_table(self) -> tuple[States, ...]:
        """All states of the impacts table; one that was measured again with role test is there twice, by one name."""
        return (self.states, self.left_out, self.test, self.slower)

    @property
    def samples(self) -> int:
        """Number of uncensored impacts in the fit."""
        return int(self.states.impacts.sum())

    @property
    def censored_samples(self) -> int:
        """Number of censored impacts, in states of the fit and in those left out."""
        return int(self.states.censored.sum() + self.left_out.censored.sum())

    @property
    def repeats(self) -> tuple[int, int]:
        """Fewest and most impacts of a state, censored ones counted."""
        counts = np.concatenate([group.impacts + group.censored for group in (self.states, self.left_out)])
        return int(counts.min()), int(counts.max())

    @property
    def state_sd(self) -> float:
        """Standard deviation s of the state means of ln F about the map, nearly a share of the force; NaN if unknown.

        It holds for a state at a place that was not measured: s^2 = place_sd^2 + own_sd^2.
        """
        return self.between_states.residual_sd

    @property
    def place_sd(self) -> float:
        """Standard deviation of the effect that the states of a place share."""
        return self.state_sd * math.sqrt(self.place_effect.correlation)

    @property
    def places_shared(self) -> int:
        """Number of places with several fitted states, which tell what the states of a place share."""
        return int(np.sum(np.bincount(self.states.place) > 1))

    @property
    def own_sd(self) -> float:
        """Standard deviation of the effect that is a state's own."""
        return self.state_sd * math.sqrt(1 - self.place_effect.correlation)

    @cached_property
    def standard_errors(self) -> FloatArray:
        """Of coefficients, shape (p,), NaN if n = p: the larger of those at both ends of the likely correlations."""
        between = self.between_states
        if self.transfer is not None:  # fitted with the states of other campaigns, whose correlations are their own
            return between.standard_errors
        known = self.states.impacts > 0  # a state that is known as "at least" tells next to nothing of the scatter
        growth = error_growth(between.design[known], self.states.select(known).place, self.place_effect)
        return between.standard_errors * growth

    @cached_property
    def drift(self) -> Drift | None:
        """How far the force has changed in states measured again with role test; None if none was measured again."""
        return measured_again(self.states.and_(self.slower), self.test)

    @cached_property
    def rmse_force(self) -> float:
        """Root mean square of predicted minus measured force over the states [N]."""
        predicted = np.exp(self.states.log_force - self.between_states.residuals)
        return float(np.sqrt(np.nanmean((predicted - self.states.force) ** 2)))

    @property
    def censored_fit(self) -> bool:
        """True if censored impacts entered the likelihood as "at least this much"."""
        return isinstance(self.whole(), CensoredRegression)

    def whole(self) -> Regression:
        """The regression that gave the coefficients: of a map that was carried over, to the states of all campaigns."""
        between = self.between_states
        return between.whole if isinstance(between, TransferRegression) else between

    def repeat_variance(self) -> float:
        """Variance of ln F between repeats of a state, as far as the fit made use of it; 0 if it did not."""
        whole = self.whole()
        return whole.repeat_variance if isinstance(whole, CensoredRegression) else 0.0

    def data(self) -> StateData:
        """What the map was fitted to, the map's own states last."""
        if self.transfer:
            return self.transfer.joint.data
        design = self.between_states.design
        return state_data(design, self.states, self.repeat_variance(), self.place_effect.correlation)


@dataclass(frozen=True, eq=False, repr=False)
class ForceMap:
    """A collision-force map, ln F = sum of coefficient x term (paper, eq. 4).

    Made by `fit_force_map`, `published_map` or `read_map`.

    Parameters
    ----------
    name : str
        A short name: of the published map, or of the table it was fitted to.
    form : Form
        Its terms.
    coefficients : array
        One for each term, shape (terms,), for F in N, d and h in m, v in m/s.
    measured_range : MeasuredRange
        Convex hull of the measured states.
    fit : Fit or None
        Statistics of a fitted map; None for a published one.
    phase_two : PhaseTwo
        What is known of Phase II.
    conditions : Conditions
        The conditions under which the impacts were measured.
    device_range : float
        Range of the force measuring device [N]; NaN if unknown.
    binding : Binding
        Whether the impacts table was what its recordings gave when the map was fitted.
    source : str
        Where the coefficients come from.
    software : str
        Name and version of the software that fitted the map.
    quantity : Quantity
        What it is a map of; its figures are in the unit of that.
    without : int
        Impacts that were left out because they do not have that quantity.
    others : tuple of ForceMap
        Of a map of the force: maps of the other quantities of the same impacts, which count in every speed.
    unmapped : Finding or None
        Why pressures were measured, but bear no map: then no speed is given for limits that have one.
    confirmed : callable or None
        Of a limit, a contact and a bound: what the impacts that were to confirm the map show; None without such
        impacts. None for a map whose recordings are not at hand, as one of a file.
    """

    name: str
    form: Form
    coefficients: FloatArray
    measured_range: MeasuredRange
    fit: Fit | None = None
    phase_two: PhaseTwo = field(default_factory=PhaseTwo)
    conditions: Conditions = field(default_factory=Conditions)
    device_range: float = math.nan
    binding: Binding = field(default_factory=Binding)
    source: str = ""
    software: str = f"forcemap {__version__}"
    quantity: Quantity = Quantity.FORCE
    without: int = 0
    others: tuple[ForceMap, ...] = ()
    unmapped: Finding | None = None
    confirmed: Callable[[Any, Any, Any], Finding | None] | None = None

    def __repr__(self) -> str:
        states = f"{len(self.fit.states)} states" if self.fit else "no states"
        ends = zip("dhv", self.measured_range.lowest, self.measured_range.highest, ("m", "m", "m/s"), strict=True)
        measured = ", ".join(f"{axis} {low:.3f} to {high:.3f} {unit}" for axis, low, high, unit in ends)
        marked = "SIMULATED, " if self.simulated else ""
        return f"<ForceMap {self.name}: {marked}{self.form.name}, {states}, measured {measured}>"

    def predict(self, distance: ArrayLike, height: ArrayLike, speed: ArrayLike) -> Any:
        """Predicted peak force.

        F = exp(sum of coefficient x term), paper eq. 4. Algebra, also outside the measured range.

        Parameters
        ----------
        distance, height : float or array
            Place [m].
        speed : float or array
            Speed at contact [m/s]; the three broadcast.

        Returns
        -------
        float or array
            Force [N].

        Examples
        --------
        >>> from forcemap import published_map
        >>> round(published_map("ur10e").predict(0.8, 0.4, 0.3), 1)
        238.8
        """
        return kernels.force(self.form, self.coefficients, self._force, distance, height, speed)

    def crossing_speed(self, distance: ArrayLike, height: ArrayLike, force: ArrayLike) -> Any:
        """Smallest speed v >= 0 at which the predicted force rises to a given force.

        The inverse of the paper's eq. 4 in v, in closed form. Algebra, no permission: see `safe_speed`.

        Parameters
        ----------
        distance, height : float or array
            Place [m].
        force : float or array
            Force [N]; the three broadcast.

        Returns
        -------
        float or array
            Speed [m/s]; 0.0 where the force is reached at rest, NaN where it never is.

        Raises
        ------
        InputError
            A force that is not positive and finite.

        Examples
        --------
        >>> from forcemap import published_map
        >>> round(published_map("ur10e").crossing_speed(0.8, 0.4, 140.0), 4)
        0.159
        """
        wanted = np.asarray(force, dtype=np.float64)
        if not np.all((wanted > 0) & (wanted < np.inf)):
            raise InputError("force: found a value that is not positive and finite, expected newtons above 0")
        return kernels.crossing_speed(self.form, self.coefficients, self._crossing_speed, distance, height, wanted)

    def leverage(self, distance: ArrayLike, height: ArrayLike, speed: ArrayLike) -> Any:
        """Leverage l = x'(X'V^-1 X)^-1 x of states with respect to the fitted ones; arguments as `predict`.

        V is the correlation of the fitted states (`PlaceRegression`).

        Raises
        ------
        InputError
            The map was not fitted here.
        """
        return kernels.leverage(self.form, self._leverage_rows(), self._leverage, distance, height, speed)

    def require_fit(self) -> Fit:
        """The statistics of a fitted map.

        Raises
        ------
        InputError
            The map was not fitted here: it has no measured states.
        """
        if self.fit is None:
            raise InputError(f"map {self.name!r} was not fitted here, so its measured states are not known")
        return self.fit

    def other(self, quantity: Quantity) -> ForceMap | None:
        """The map of another quantity of the same impacts; None if there is none."""
        return next((each for each in self.others if each.quantity is quantity), None)

    @cached_property
    def slower(self) -> States:
        """Measured states slower than the map is to hold for (map.slowest_mps in campaign.toml), of both roles."""
        return NO_STATES if self.fit is None else self.fit.slower.and_(self._test.select(self._is_slower))

    @property
    def own_slower(self) -> States:
        """Those of the campaign itself, without those of maps carried over, which are named for these."""
        transfer = self.fit.transfer if self.fit else None
        earlier = tuple(of_earlier(each.name) for each in (transfer.earlier if transfer else ()))
        return self.slower.select(np.array([not name.endswith(earlier) for name in self.slower.name], dtype=np.bool_))

    @cached_property
    def tested(self) -> States:
        """States with role test that the map is to hold for."""
        return self._test.select(~self._is_slower)

    @property
    def _test(self) -> States:
        return NO_STATES if self.fit is None else self.fit.test

    @property
    def _is_slower(self) -> Mask:
        return self.conditions.slower_than_map(self.conditions.as_stated(self._test.speed))

    @property
    def simulated(self) -> bool:
        """True if the map rests on simulated impacts."""
        return self.conditions.simulated

    @property
    def highest_force(self) -> float:
        """Range of the device [N]; if none is stated, the largest measured force, NaN if no force was measured."""
        if not math.isnan(self.device_range) or self.fit is None:
            return self.device_range
        highest = (group.highest for group in self.fit.of_table)
        return float(np.fmax.reduce(np.concatenate([[math.nan], *highest])))

    @cached_property
    def form_test(self) -> FormTest | None:
        """Whether the states of the map contradict its form; None for a map that was not fitted.

        Of a map that was carried over those of the first campaign; the new ones test the shift (`Transfer.p_value`).
        Gaps are those of both: between new states that lie far apart another shape passes unseen, too.
        """
        if self.fit is None:
            return None
        if (transfer := self.fit.transfer) is None:
            return form_test(self.form, self.fit.states, self.fit.state_sd, self.fit.between_states.residuals)
        first = form_test(transfer.form, transfer.earlier[0].states, self.fit.state_sd)
        gaps = gaps_of(self.fit.states) | dict(zip(first.gaps, first.between, strict=True))
        return replace(first, gaps=tuple(gaps), between=tuple(gaps.values()))

    @cached_property
    def rises_with_speed(self) -> bool:
        """True if the prediction nowhere falls with speed inside the box around the measured range.

        Checked at `_GRID` points along each axis; exact for a form that is linear in ln v and bilinear in place.
        """
        return math.isnan(self.steepest_fall[0])

    @cached_property
    def steepest_fall(self) -> tuple[float, float, float]:
        """Distance [m], height [m] and speed [m/s] at which ln F falls most with speed in that box; NaN if nowhere."""
        box = zip(self.measured_range.lowest, self.measured_range.highest, strict=True)
        axes = [np.linspace(low, high, _GRID) for low, high in box]
        distance, height, speed = np.meshgrid(*axes, indexing="ij", sparse=True)
        (profile,) = self.form.speed_profiles(self.coefficients[None], distance, height)
        slope = np.asarray(profile.slope(speed))
        lowest = np.unravel_index(int(np.argmin(slope)), slope.shape)
        if slope[lowest] >= 0:
            return math.nan, math.nan, math.nan
        first, second, third = (float(values[i]) for values, i in zip(axes, lowest, strict=True))
        return first, second, third

    @cached_property
    def largest_fall(self) -> float:
        """By how much ln F falls at most from one speed to a faster one, at any place of that box; 0 if nowhere."""
        box = zip(self.measured_range.lowest, self.measured_range.highest, strict=True)
        grid = np.meshgrid(*(np.linspace(low, high, _GRID) for low, high in box), indexing="ij")
        log_force = np.log(self.predict(*grid))
        return float(np.max(np.maximum.accumulate(log_force, axis=2) - log_force))

    def _force(self, distance: FloatArray, height: FloatArray, speed: FloatArray) -> FloatArray:
        (profile,) = self.form.speed_profiles(self.coefficients[None], distance, height)
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(np.exp(profile(speed)))

    def _crossing_speed(self, distance: FloatArray, height: FloatArray, force: FloatArray) -> FloatArray:
        (profile,) = self.form.speed_profiles(self.coefficients[None], distance, height)
        return profile.first_rise(np.log(force))

    def _leverage_rows(self) -> FloatArray:
        return self.require_fit().between_states.inverse_triangle.T  # x'(X'X)^-1 x = |R^-T x|^2

    def _leverage(self, distance: FloatArray, height: FloatArray, speed: FloatArray) -> FloatArray:
        rows = self._leverage_rows()
        leverage = np.zeros(np.broadcast_shapes(distance.shape, height.shape, speed.shape))
        with np.errstate(over="ignore", invalid="ignore"):
            for profile in self.form.speed_profiles(rows, distance, height):
                leverage += np.square(profile(speed))
        return leverage
