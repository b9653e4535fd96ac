"""Map files: JSON, schema "forcemap-map/1"."""

from __future__ import annotations

import json
import math
import reprlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import (
    Binding,
    BindingState,
    Conditions,
    ContactScenario,
    PhaseTwo,
    Quantity,
    States,
    in_stated_units,
)
from forcemap.errors import ForcemapError, MapFileError
from forcemap.files import read_bytes, sha256, write_atomically
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.maps.censored import CensoredRegression, censored_regression, state_data, weighted_regression
from forcemap.maps.fit import effect_of_places
from forcemap.maps.force_map import Fit, ForceMap
from forcemap.maps.forms import Form
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.places import PlaceEffect, place_regression
from forcemap.maps.published import PUBLISHED_MAPS, published_map
from forcemap.maps.regression import Regression
from forcemap.maps.transfer import Earlier, Transfer, joint_fit, range_of

SCHEMA = "forcemap-map/1"

_NOT_STATED = Binding(BindingState.UNBOUND, Finding.of(FindingKind.BINDING_NOT_STATED))

_SAME = 1e-6
"""How far ln F by the coefficients of a map file may lie from what its states give (docs/decisions.md)."""

_SAME_CENSORED = 1e-5
"""The same for a censored fit, whose maximum is searched iteratively (docs/decisions.md)."""

_SAME_SCATTER = 10 * _SAME_CENSORED
"""The same, as a share, for the scatter of a censored fit, which the search determines less precisely."""

_LARGEST = 1e9  # of any number in the file: a larger one cannot be meant
_LEAST = 5e-324  # the smallest positive number
_SLOWEST = "slowest_mps"  # missing in files of before, which have the mean of the repeats alone
_SPEEDS = dict.fromkeys(("speed_mps", _SLOWEST), (_LEAST, 10.0))
_PLACES = {"distance_m": (_LEAST, 10.0), "height_m": (-10.0, 10.0), **_SPEEDS}
_RANGES = {  # of a number in the file, or of every number in a list
    **_PLACES,
    **dict.fromkeys(("peak_force_N", "at_least_N", "highest_N"), (1.0, 1e5)),
    **dict.fromkeys(("impacts", "censored", "unrecorded", "above_peak", "excluded"), (0, _LARGEST)),
    **dict.fromkeys(("largest_force_N", "unused_force_N"), (0, _LARGEST)),
    **{scenario.value: (0, _LARGEST) for scenario in ContactScenario},
    "sinking": (0.0, 1.0),
    **dict.fromkeys(("state_weights", "repeat_variance_ln", "state_sd_ln", "degrees_of_freedom"), (0.0, _LARGEST)),
    "device_range_N": (_LEAST, _LARGEST),
}
"""Lowest and highest value of an entry of the file, for places, speeds and forces as in an impacts table; of any other
-1e9 and 1e9."""

_OF_PRESSURE = {  # entries of a map of forces -> those of a map of pressures
    "peak_force_N": "peak_pressure_N_per_cm2",
    "mean_ln_force": "mean_ln_pressure",
    "at_least_N": "at_least_N_per_cm2",
    "highest_N": "highest_N_per_cm2",
    "rmse_N": "rmse_N_per_cm2",
    "device_range_N": "film_range_N_per_cm2",
}
_SHARED = {"schema", "source", "simulated", "software", "phase_two", "binding", "campaign"}
"""Entries that maps of the quantities of one campaign share."""

_ROUNDING = 1e-9  # share by which means and logarithms in the file may contradict each other

_TEXTS = {"schema", "name", "source", "software", "form", "terms", "state_id", "states_found"}
_TEXTS |= {"disagreeing_repeats", "sinking_at", "impacts_table", "impacts_table_sha256", "map_sha256"}

_TABLES = {
    "phase_two",
    "scenarios",
    "measured_states",
    "states_left_out",
    "test_states",
    "slower_states",
    "impacts_at_points",
    "fit",
}
_LISTS = {"terms", "disagreeing_repeats", "sinking_at", "coefficients", "standard_errors", "state_weights"}

# column of the file -> field of States
_STATE_COLUMNS = {
    "state_id": "name",
    "distance_m": "distance",
    "height_m": "height",
    "speed_mps": "speed",
    "peak_force_N": "force",
    "mean_ln_force": "log_force",
    "impacts": "impacts",
    "censored": "censored",
    "at_least_N": "at_least",
    "highest_N": "highest",
    _SLOWEST: "slowest",
}


def write_map(force_map: ForceMap, path: str | Path) -> None:
    """Write a map as JSON; `read_map` gives back the same figures to the last bit.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    write_atomically(path, map_text(force_map))


def read_map(path: str | Path) -> ForceMap:
    """Read a map file.

    Raises
    ------
    MapFileError
        Not a map file of this schema, a file that was changed, or an entry that cannot be used.
    """
    file = str(path)
    try:
        content = json.loads(read_bytes(path).decode())
    except (ValueError, RecursionError) as error:
        raise MapFileError(f"not a JSON file: {error}; fit the map again", file=file) from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        schema = content.get("schema") if isinstance(content, dict) else type(content).__name__
        raise MapFileError(f"found {schema!r}, expected a map with schema {SCHEMA!r}", file=file, column="schema")
    stated = content.pop("content_sha256", None)
    try:
        if stated != sha256(_text(content)):
            raise MapFileError("the file was changed after it was written; fit the map again", column="content_sha256")
        others = content.pop("other_quantities", [])
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            force_map = _checked(content)
            return replace(force_map, others=tuple(_other_from_content(other, content) for other in others))
    except MapFileError as error:
        raise MapFileError(error.message, file=file, column=error.column) from None
    except KeyError as error:
        raise MapFileError("the entry is missing", file=file, column=str(error.args[0])) from None
    except (ForcemapError, TypeError, ValueError, AttributeError, IndexError, ArithmeticError) as error:
        raise MapFileError(f"an entry cannot be used: {error}", file=file) from None


def map_text(force_map: ForceMap) -> str:
    """The text of the map's file; its last entry is the SHA-256 of the others."""
    content = _to_content(force_map)
    return _text(content | {"content_sha256": sha256(_text(content))})


def map_sha256(force_map: ForceMap) -> str:
    """SHA-256 of the map's file."""
    return sha256(map_text(force_map))


def _text(content: dict[str, Any]) -> str:
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _checked(content: dict[str, Any]) -> ForceMap:
    _require_sound(content, content.keys() - {"binding", "campaign", "carried_over", "pressure_not_mapped"})
    return _from_content(content)


def _other_to_content(other: ForceMap) -> dict[str, Any]:
    """A map of another quantity, without what it shares with that of the force; its entries bear its own units."""
    own = {entry: value for entry, value in _to_content(other).items() if entry not in _SHARED}
    own = _renamed(own, _OF_PRESSURE) if other.quantity is Quantity.PRESSURE else own
    return {"quantity": other.quantity.value, "impacts_without": other.without, **own}


def _other_from_content(stated: dict[str, Any], of_force: dict[str, Any]) -> ForceMap:
    quantity, without = Quantity(stated.pop("quantity")), stated.pop("impacts_without")
    if quantity is Quantity.FORCE or not isinstance(without, int) or without < 0 or _SHARED & stated.keys():
        raise MapFileError("expected a map of another quantity", column="other_quantities")
    back = {theirs: ours for ours, theirs in _OF_PRESSURE.items()} if quantity is Quantity.PRESSURE else {}
    shared = {entry: of_force[entry] for entry in _SHARED}
    other = _checked(shared | _renamed(stated, back))
    return replace(other, quantity=quantity, without=without, binding=_binding(of_force))


def _renamed(content: dict[str, Any], names: dict[str, str]) -> dict[str, Any]:
    """The same with other names of entries, in its tables too."""
    return {
        names.get(name, name): _renamed(value, names) if isinstance(value, dict) else value
        for name, value in content.items()
    }


def _phase_two_to_content(phase_two: PhaseTwo) -> dict[str, Any]:
    unused = {} if math.isnan(phase_two.unused_force) else {"unused_force_N": phase_two.unused_force}
    sinks = {"sinking": phase_two.sinking, "sinking_at": list(phase_two.sinking_at)} if phase_two.sinking else {}
    return {
        "scenarios": {scenario.value: n for scenario, n in phase_two.scenarios.items()},
        "unrecorded": phase_two.unrecorded,
        "largest_force_N": _null(phase_two.largest_force),
        "above_peak": phase_two.above_peak,
        "excluded": phase_two.excluded,
        **unused,
        **sinks,
    }


def _to_content(force_map: ForceMap) -> dict[str, Any]:
    reason = force_map.binding.reason
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "name": force_map.name,
        "source": force_map.source,
        "simulated": force_map.simulated,
        "software": force_map.software,
        "form": force_map.form.name,
        "terms": force_map.form.term_names,
        "coefficients": force_map.coefficients.tolist(),
        "phase_two": _phase_two_to_content(force_map.phase_two),
        "device_range_N": _null(force_map.device_range),
        "binding": {
            "state": force_map.binding.state.value,
            "reason": reason and {"kind": reason.kind.value, "figures": dict(reason.figures)},
        },
        "campaign": force_map.conditions.to_tables(),
    }
    if force_map.fit is None:
        points = force_map.measured_range.points
        columns = list(_STATE_COLUMNS)[1:4]
        return content | {"measured_states": dict(zip(columns, points.T.tolist(), strict=True)), "fit": None}
    if force_map.others:
        content["other_quantities"] = [_other_to_content(other) for other in force_map.others]
    if force_map.unmapped:
        content["pressure_not_mapped"] = dict(force_map.unmapped.figures)
    fit, between_states = force_map.fit, force_map.fit.between_states
    also = dict[str, Any]()
    if isinstance(between_states, CensoredRegression):
        also["state_weights"] = between_states.weights.tolist()
        also["repeat_variance_ln"] = between_states.repeat_variance
    if fit.disagreeing:
        also["disagreeing_repeats"] = list(fit.disagreeing)
    if fit.transfer:
        content["carried_over"] = _transfer_to_content(fit.transfer)
    if len(fit.at_points):
        content["impacts_at_points"] = _states_to_columns(fit.at_points)
    if len(fit.slower):
        content["slower_states"] = _states_to_columns(fit.slower)
    return content | {
        "measured_states": _states_to_columns(fit.states),
        "states_left_out": _states_to_columns(fit.left_out),
        "test_states": _states_to_columns(fit.test),
        "fit": {
            "states": len(fit.states),
            "samples": fit.samples,
            "censored_samples": fit.censored_samples,
            "states_found": fit.states_found,
            "standard_errors": [_null(value) for value in fit.standard_errors.tolist()],
            **{entry: _null(figure) for entry, figure in _scatter(fit).items()},
            "rmse_ln": between_states.rmse,
            "rmse_N": fit.rmse_force,
            "r_squared": _null(between_states.r_squared),
            "condition_number": between_states.condition_number,
            "impacts_table": fit.table,
            "impacts_table_sha256": fit.table_sha256,
            **also,
        },
    }


def _require_sound(content: dict[str, Any], names: Iterable[str]) -> None:
    """Refuse an entry that is not of its type, or a number outside its range."""
    for name in names:
        value = content[name]
        if isinstance(value, dict) and name in _TABLES:
            _require_sound(value, value)
            continue
        several = name in _LISTS or name in _STATE_COLUMNS
        if isinstance(value, list) != several:
            raise MapFileError(f"expected {'a list' if several else 'no list'}", column=name)
        cells = value if isinstance(value, list) else [value]
        texts = name in _TEXTS
        low, high = _RANGES.get(name, (-_LARGEST, _LARGEST))
        for cell in cells:
            number = isinstance(cell, int | float) and not isinstance(cell, bool) and low <= cell <= high
            unknown = cell is None and name not in _PLACES
            if not (isinstance(cell, str) if texts else number or unknown or name == "simulated"):
                expected = "a text" if texts else f"a number from {low:g} to {high:g}"
                raise MapFileError(f"found {reprlib.repr(cell)}, expected {expected}", column=name)


def _require_consistent(content: dict[str, Any], conditions: Conditions) -> None:
    """Raise MapFileError where the file contradicts itself on whether the impacts are simulated."""
    stated = content["simulated"]
    if not isinstance(stated, bool):
        raise MapFileError(f"found {stated!r}, expected true or false", column="simulated")
    says = "true" if conditions.simulated else "false or not stated"
    if stated is not conditions.simulated:
        raise MapFileError(
            f"the file states simulated = {str(stated).lower()}, its campaign {says}; fit the map again from its "
            "impacts table",
            column="simulated",
        )
    if not stated and conditions.note_says_simulated:
        raise MapFileError(
            "the file states simulated = false, but the note of its campaign says SIMULATED; state simulated = true in "
            "campaign.toml, or correct its note, and fit the map again",
            column="simulated",
        )


def _require_scatter(fit: Fit, statistics: dict[str, Any]) -> None:
    """Refuse a stated scatter that differs from that of the states."""
    for entry, figure in _scatter(fit).items() if "places" in statistics else ():
        stated = _nan(statistics.get(entry))
        if not (math.isnan(stated) and math.isnan(figure)):  # unknown with as many states as coefficients
            _require_given(entry, stated - figure, _SAME_CENSORED * max(abs(figure), 1.0))


def _from_content(content: dict[str, Any]) -> ForceMap:
    form = Form.of(str(content["form"]), content["terms"])
    coefficients = np.array(content["coefficients"], dtype=np.float64)
    columns, statistics, phase_two = content["measured_states"], content["fit"], content["phase_two"]
    conditions = Conditions.from_tables(content["campaign"])
    _require_consistent(content, conditions)
    fit = None
    if statistics is not None:
        states, nothing = _states_from_columns(columns), dict[str, list[Any]]((name, []) for name in _STATE_COLUMNS)
        transfer = _transfer_from_content(content, states, coefficients) if "carried_over" in content else None
        effect = transfer.joint.place_effect if transfer else effect_of_places(form, states)
        fit = Fit(
            states=states,
            left_out=_states_from_columns(content["states_left_out"]),
            test=_states_from_columns(content["test_states"]),
            at_points=_states_from_columns(content.get("impacts_at_points", nothing)),
            slower=_states_from_columns(content.get("slower_states", nothing)),
            between_states=replace(transfer.joint.regression, coefficients=coefficients)
            if transfer
            else _regression(form, states, coefficients, effect, statistics),
            place_effect=effect,
            states_found=str(statistics["states_found"]),
            table=str(statistics["impacts_table"]),
            table_sha256=str(statistics["impacts_table_sha256"]),
            transfer=transfer,
            disagreeing=tuple(statistics.get("disagreeing_repeats", ())),
        )
        _require_scatter(fit, statistics)
    force_map = ForceMap(
        name=str(content["name"]),
        form=form,
        coefficients=coefficients,
        measured_range=range_of(fit.states, fit.transfer.earlier)
        if fit and fit.transfer
        else MeasuredRange(np.column_stack([columns[name] for name in list(_STATE_COLUMNS)[1:4]])),
        fit=fit,
        phase_two=PhaseTwo(
            {ContactScenario(name): int(n) for name, n in phase_two["scenarios"].items()},
            int(phase_two["unrecorded"]),
            _nan(phase_two["largest_force_N"]),
            int(phase_two["above_peak"]),
            int(phase_two.get("excluded", 0)),
            _nan(phase_two.get("unused_force_N")),
            float(phase_two.get("sinking", 0.0)),
            tuple(phase_two.get("sinking_at", ())),
        ),
        conditions=conditions,
        device_range=_nan(content["device_range_N"]),
        binding=_binding(content),
        source=str(content["source"]),
        software=str(content["software"]),
        unmapped=Finding.of(FindingKind.PRESSURE_NOT_MAPPED, **content["pressure_not_mapped"])
        if "pressure_not_mapped" in content
        else None,
    )
    if fit is None:
        _require_published(force_map)
        return force_map
    binding = in_stated_units(force_map.binding, conditions, *fit.of_table)
    return replace(force_map, binding=binding)


def _transfer_to_content(transfer: Transfer) -> dict[str, Any]:
    """What a map was carried over from: the first form, and of each campaign its states and the shift to the next."""
    return {
        "form": transfer.form.name,
        "terms": transfer.form.term_names,
        "campaigns": [
            {
                "name": earlier.name,
                "map_sha256": earlier.map_sha256,
                "different": [list(difference) for difference in earlier.different],
                "shift": shift.term_names,
                "measured_states": _states_to_columns(earlier.states),
            }
            for earlier, shift in zip(transfer.earlier, transfer.shifts, strict=True)
        ],
        "states_at_old_places": transfer.near,
        "repeat_variance_ln": transfer.joint.data.repeat_variance,
        "misfit_p": transfer.p_value,
        "extra_variance": transfer.joint.extra,
    }


def _transfer_from_content(content: dict[str, Any], states: States, coefficients: FloatArray) -> Transfer:
    """The fit to the states of all campaigns made again; refused is a file that differs from it."""
    stated, earlier, shifts = content["carried_over"], [], []
    _require_sound(stated, stated.keys() - {"campaigns"})
    for part in stated["campaigns"]:
        _require_sound(part, part.keys() - {"different", "shift"})
        different = tuple((str(entry), str(then), str(now)) for entry, then, now in part["different"])
        names = str(part["name"]), str(part["map_sha256"])
        earlier.append(Earlier(*names, _states_from_columns(part["measured_states"]), different))
        shifts.append(Form.of("SHIFT", part["shift"]))
    form = Form.of(str(stated["form"]), stated["terms"])
    groups = [*(campaign.states for campaign in earlier), states]
    joint = joint_fit(form, groups, shifts, float(stated["repeat_variance_ln"]))
    if joint.form.term_names != content["terms"]:
        raise MapFileError("not the terms of the earlier map and its shifts; fit the map again", column="terms")
    again = joint.regression
    _require_given("coefficients", again.design @ (again.coefficients - coefficients), _SAME_CENSORED)
    _require_given("misfit_p", joint.p_value - float(stated["misfit_p"]), _SAME_SCATTER)
    near = np.any([states.at_places_of(campaign.states) for campaign in earlier], axis=0)
    _require_given("states_at_old_places", int(near.sum()) - int(stated["states_at_old_places"]), 0)
    return Transfer(form, tuple(earlier), tuple(shifts), joint, int(near.sum()))


def _require_published(force_map: ForceMap) -> None:
    """Refuse a map without measured states that is not one of the paper's: its origin would be unknown."""
    bare: dict[str, Any] = {"source": "", "software": "", "binding": Binding()}
    known = published_map(force_map.name) if force_map.name in PUBLISHED_MAPS else None
    if known is None or _to_content(replace(force_map, **bare)) != _to_content(replace(known, **bare)):
        raise MapFileError(
            "a map without measured states, and not as it was published; fit it to its impacts table", column="fit"
        )


def _binding(content: dict[str, Any]) -> Binding:
    """The state of the binding; files of earlier versions lack it."""
    if "binding" not in content:
        return _NOT_STATED
    state, reason = BindingState(content["binding"]["state"]), content["binding"]["reason"]
    if isinstance(reason, str):  # of an earlier version: in words
        return Binding(state, in_words(reason) if reason else None)
    if reason is None:
        return Binding(state)
    figures = {name: _hashable(value) for name, value in reason["figures"].items()}
    return Binding(state, Finding.of(FindingKind(reason["kind"]), **figures))


def _hashable(value: Any) -> Any:
    return tuple(map(_hashable, value)) if isinstance(value, list) else value


def _regression(
    form: Form, states: States, coefficients: Any, effect: PlaceEffect, statistics: dict[str, Any]
) -> Regression:
    """The fit made again: R^-1 from the states, the coefficients exactly as they were written.

    Refused is a file that differs from a fit to its own states: for least squares in the coefficients, for a censored
    fit also in everything that widens the bound.
    """
    design = form.design(*states.coordinates.T)
    if "state_weights" not in statistics:
        data = state_data(design, states, 0.0, effect.correlation)
        fitted = place_regression(data.design, data.mean, data.place, data.correlation)
        _require_given("coefficients", data.design @ (fitted.coefficients - coefficients), _SAME)
        return replace(fitted, coefficients=coefficients)
    if float(statistics["degrees_of_freedom"]) > len(states) - coefficients.size:
        raise MapFileError("more degrees of freedom than states less coefficients", column="degrees_of_freedom")
    stated = weighted_regression(
        state_data(design, states, float(statistics["repeat_variance_ln"]), effect.correlation),
        coefficients=coefficients,
        weights=np.array(statistics["state_weights"], dtype=np.float64),
        deviation=float(statistics["state_sd_ln"]),
        freedom=float(statistics["degrees_of_freedom"]),
    )
    data = state_data(design, states, stated.repeat_variance, effect.correlation)
    try:
        _require_fitted(stated, censored_regression(data, stated.deviation))
    except MapFileError:  # where rounding leaves the likelihood rough, only the same search gives the same fit
        _require_fitted(stated, censored_regression(data))
    return stated


def _require_fitted(stated: CensoredRegression, again: CensoredRegression) -> None:
    """Refuse a stated censored fit that differs from one made again."""
    _require_given("coefficients", stated.design @ (again.coefficients - stated.coefficients), _SAME_CENSORED)
    _require_given("state_sd_ln", stated.deviation / again.deviation - 1, _SAME_SCATTER)
    _require_given("degrees_of_freedom", stated.freedom / again.freedom - 1, _SAME_SCATTER)
    _require_given("state_weights", stated.weights - again.weights, _SAME_SCATTER)


def _scatter(fit: Fit) -> dict[str, float]:
    """Scatter of the states about a map, and the share of their places in it, by entry of the file."""
    return {
        "state_sd_ln": fit.state_sd,
        "place_sd_ln": fit.place_sd,
        "own_sd_ln": fit.own_sd,
        "places": fit.place_effect.places,
        "place_correlation": fit.place_effect.correlation,
        "likely_place_correlation": fit.place_effect.likely,
        "degrees_of_freedom": fit.between_states.degrees_of_freedom,
    }


def _require_given(entry: str, difference: Any, most: float) -> None:
    """Refuse an entry that differs by more than `most` from what the states give."""
    if not np.all(np.abs(difference) <= most):
        raise MapFileError("not what the measured states of the file give; fit the map again", column=entry)


def _states_to_columns(states: States) -> dict[str, list[Any]]:
    columns = {column: np.asarray(getattr(states, field)) for column, field in _STATE_COLUMNS.items()}
    return {column: [_null(value) for value in values.tolist()] for column, values in columns.items()}


def _states_from_columns(columns: dict[str, list[Any]]) -> States:
    fields: dict[str, Any] = {}
    for column, field in _STATE_COLUMNS.items():
        kind = np.int64 if column in ("impacts", "censored") else np.float64
        cells = columns["speed_mps" if column == _SLOWEST and column not in columns else column]
        fields[field] = tuple(cells) if field == "name" else np.array([_nan(value) for value in cells], dtype=kind)
    if len({len(values) for values in fields.values()}) != 1:
        raise MapFileError("found columns of different lengths, expected a cell for every state", column="states")
    states = States(**fields)
    _require_means(states)
    return states


def _require_means(states: States) -> None:
    """Refuse states whose mean ln F cannot be that of impacts with this mean and this highest force.

    A mean of logarithms is no larger than the logarithm of the mean, and below it by less than n ln(highest / mean)
    (unless one of n repeats is a hundred times below the others).
    """
    if np.any((states.impacts < 0) | (states.censored < 0) | (states.impacts + states.censored < 1)):
        raise MapFileError("expected at least one impact in every state", column="impacts")
    if np.any(states.slowest > states.speed * (1 + _ROUNDING)):
        raise MapFileError("found one above the mean speed of its state, expected none", column=_SLOWEST)
    read = states.impacts > 0
    force, highest = states.force[read], states.highest[read]
    below = np.log(force) - states.log_force[read]
    possible = (highest >= force * (1 - _ROUNDING)) & (below >= -_ROUNDING)
    possible &= below <= states.impacts[read] * np.log(np.maximum(highest / force, 1.0)) + _ROUNDING
    if not possible.all():
        name = states.name[int(np.flatnonzero(read)[~possible][0])]
        raise MapFileError(f"state {name}: found forces that do not belong together", column="mean_ln_force")


def _null(value: Any) -> Any:
    """None for NaN, which JSON does not have."""
    return None if value != value else value


def _nan(value: float | None) -> float:
    """NaN for null."""
    return math.nan if value is None else value
