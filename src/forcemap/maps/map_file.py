"""Map files: JSON, schema "forcemap-map/1"."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcemap.campaigns.dataset import Conditions, ContactScenario, PhaseTwo, States
from forcemap.errors import ForcemapError, InputError, MapFileError
from forcemap.files import read_bytes, sha256, write_atomically
from forcemap.maps.force_map import Fit, ForceMap
from forcemap.maps.forms import FORMS, Form
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.regression import Regression, least_squares

SCHEMA = "forcemap-map/1"

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
        Not a map file of this schema, an entry that cannot be used, or coefficients that do not follow from the
        measured states in the file.
    """
    file = Path(path).name
    try:
        content = json.loads(read_bytes(path).decode())
    except (ValueError, RecursionError) as error:
        raise MapFileError(f"not a JSON file: {error}", file=file) from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        found = content.get("schema") if isinstance(content, dict) else type(content).__name__
        raise MapFileError(f"found {found!r}, expected a map with schema {SCHEMA!r}", file=file, column="schema")
    try:
        return _from_content(content)
    except MapFileError as error:
        raise MapFileError(error.message, file=file, column=error.column) from None
    except KeyError as error:
        raise MapFileError("the entry is missing", file=file, column=str(error.args[0])) from None
    except (ForcemapError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise MapFileError(f"an entry cannot be used: {error}", file=file) from None


def map_text(force_map: ForceMap) -> str:
    """The text of the map's file."""
    return json.dumps(_to_content(force_map), indent=1, allow_nan=False) + "\n"


def map_sha256(force_map: ForceMap) -> str:
    """SHA-256 of the map's file."""
    return sha256(map_text(force_map))


def _to_content(force_map: ForceMap) -> dict[str, Any]:
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "name": force_map.name,
        "source": force_map.source,
        "simulated": force_map.simulated,
        "software": force_map.software,
        "form": force_map.form.name,
        "terms": force_map.form.term_names,
        "coefficients": force_map.coefficients.tolist(),
        "phase_two": {
            "scenarios": {scenario.value: n for scenario, n in force_map.phase_two.scenarios.items()},
            "unrecorded": force_map.phase_two.unrecorded,
            "largest_force_N": _null(force_map.phase_two.largest_force),
        },
        "device_range_N": _null(force_map.device_range),
        "campaign": force_map.conditions.to_tables(),
    }
    if force_map.fit is None:
        points = force_map.measured_range.points
        columns = ("distance_m", "height_m", "speed_mps")
        return content | {"measured_states": dict(zip(columns, points.T.tolist(), strict=True)), "fit": None}
    fit = force_map.fit
    return content | {
        "measured_states": _states_to_columns(fit.states),
        "states_left_out": _states_to_columns(fit.left_out),
        "fit": {
            "states": len(fit.states),
            "samples": fit.samples,
            "censored_samples": fit.censored_samples,
            "states_found": fit.states_found,
            "standard_errors": [_null(value) for value in fit.between_states.standard_errors.tolist()],
            "state_sd_ln": _null(fit.state_sd),
            "degrees_of_freedom": fit.between_states.degrees_of_freedom,
            "rmse_ln": fit.between_states.rmse,
            "rmse_N": fit.rmse_force,
            "r_squared": _null(fit.between_states.r_squared),
            "condition_number": fit.between_states.condition_number,
            "impacts_table": fit.table,
            "impacts_table_sha256": fit.table_sha256,
        },
    }


def _from_content(content: dict[str, Any]) -> ForceMap:
    form = _form(content["form"], content["terms"])
    coefficients = _floats("coefficients", content["coefficients"], len(form.terms))
    columns, statistics, phase_two = content["measured_states"], content["fit"], content["phase_two"]
    n = len(columns["distance_m"])
    if n == 0:
        raise MapFileError("found no state, expected at least one", column="measured_states")
    points = np.column_stack([_floats(name, columns[name], n) for name in ("distance_m", "height_m", "speed_mps")])
    fit = None
    if statistics is not None:
        states = _states_from_columns(columns)
        fit = Fit(
            states=states,
            left_out=_states_from_columns(content["states_left_out"]),
            between_states=_regression(form, coefficients, states, statistics),
            states_found=str(statistics["states_found"]),
            table=str(statistics["impacts_table"]),
            table_sha256=str(statistics["impacts_table_sha256"]),
        )
    tables = dict(content["campaign"])
    if bool(tables.get("simulated", False)) is not content["simulated"]:
        raise MapFileError("found two statements that differ, expected one", column="simulated")
    return ForceMap(
        name=str(content["name"]),
        form=form,
        coefficients=coefficients,
        measured_range=MeasuredRange(points),
        fit=fit,
        phase_two=PhaseTwo(
            {ContactScenario(name): _count(name, n) for name, n in phase_two["scenarios"].items()},
            _count("unrecorded", phase_two["unrecorded"]),
            _nan(phase_two["largest_force_N"]),
        ),
        conditions=Conditions.from_tables(tables),
        device_range=_nan(content["device_range_N"]),
        source=str(content["source"]),
        software=str(content["software"]),
    )


def _form(name: str, terms: list[str]) -> Form:
    form = Form.of(str(name), terms)
    if any(known.name == form.name and known != form for known in FORMS):
        raise MapFileError(f"found other terms than form {name} has, expected its own name", column="terms")
    return form


def _regression(
    form: Form, coefficients: NDArray[np.float64], states: States, statistics: dict[str, Any]
) -> Regression:
    """The fit of the states in the file, with the file's own coefficients once they are found to follow from it."""
    design = form.design(states.distance, states.height, states.speed)
    again = least_squares(design, states.log_force)
    close = np.abs(design @ (again.coefficients - coefficients)).max() <= 1e-6
    regression = replace(again, coefficients=coefficients)
    stated, found = _nan(statistics["state_sd_ln"]), regression.residual_sd
    if not close or not (math.isclose(stated, found, rel_tol=1e-6, abs_tol=1e-12) or math.isnan(found)):
        raise MapFileError(
            "found figures that do not follow from the measured states in the file, expected an unchanged file; "
            "fit the map again",
            column="coefficients",
        )
    return regression


def _states_to_columns(states: States) -> dict[str, list[Any]]:
    columns = {column: list(getattr(states, field)) for column, field in _STATE_COLUMNS.items()}
    return {
        column: [_null(value.item()) if isinstance(value, np.generic) else value for value in values]
        for column, values in columns.items()
    }


def _states_from_columns(columns: dict[str, list[Any]]) -> States:
    names = tuple(str(name) for name in columns["state_id"])
    fields: dict[str, Any] = {}
    for column, field in _STATE_COLUMNS.items():
        if column == "state_id":
            continue
        if column in ("impacts", "censored"):
            fields[field] = np.array([_count(column, value) for value in columns[column]], dtype=np.int64)
        else:
            fields[field] = np.array([_nan(value) for value in columns[column]], dtype=np.float64)
        if len(fields[field]) != len(names):
            raise MapFileError(f"found {len(fields[field])} entries, expected {len(names)}", column=column)
    return States(names, **fields)


def _floats(name: str, values: list[Any], n: int) -> NDArray[np.float64]:
    numbers = np.array([_nan(value) for value in values], dtype=np.float64)
    if numbers.shape != (n,) or not np.isfinite(numbers).all():
        raise MapFileError(f"expected {n} finite numbers", column=name)
    return numbers


def _count(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise MapFileError(f"found {value!r}, expected a whole number", column=name)
    return value


def _null(value: Any) -> Any:
    """None for NaN, which JSON does not have."""
    return None if isinstance(value, float) and math.isnan(value) else value


def _nan(value: Any) -> float:
    """NaN for null; a finite number otherwise."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"found {value!r}, expected a finite number")
    return float(value)
