"""forcemap transfer: a map carried over to a changed robot."""

from __future__ import annotations

import contextlib
from typing import Annotated

from typer import Argument, Option

import forcemap as fm
from forcemap.answers.transfer import TransferAnswer
from forcemap.cli.options import DeviceSpring, Json, Table, force_map_from, impacts_of
from forcemap.cli.output import accuracy_words, counted, emit, table, verdict_first, write_result
from forcemap.maps.map_file import map_text
from forcemap.maps.transfer import MORE_BELOW, REFUSED_BELOW


def transfer(
    old_map: Annotated[str, Argument(help="The earlier map: a file written by forcemap fit or transfer.")],
    new: Table,
    shift: Annotated[
        str | None,
        Option("--shift", help="Terms of the shift, as 1,d,h,v,d^2; default 1,d,h,v, of LOG_SPEED 1,d,h,ln(v)."),
    ] = None,
    device_spring: DeviceSpring = None,
    output: Annotated[str | None, Option("-o", "--output", help="Write the map to this JSON file.")] = None,
    as_json: Json = False,
) -> int:
    """Carry a map over to a changed robot: new tool, firmware or safety setting, or a sister robot.

    All coefficients are fitted together to the states of the earlier map and to a few new ones at other places
    (forcemap plan FOLDER --transfer MAP plans them).

    Exit code: 0 carried over, 1 refused: the new states contradict the earlier map.

    Example: forcemap transfer map.json changed-robot -o changed.json
    """
    dataset = impacts_of(new, device_spring)
    terms = fm.Form.of("SHIFT", [term.strip() for term in shift.split(",")]) if shift is not None else None
    try:
        force_map = fm.transfer_map(force_map_from(old_map, None)[0], dataset, shift=terms)
    except fm.TransferRefused as refusal:
        answer = TransferAnswer.of_refusal(refusal)
        emit(answer, [f"NOT CARRIED OVER: {answer.reason}", "", "no file written"], as_json=as_json)
        return 1
    accuracy = None
    with contextlib.suppress(fm.InputError):  # no state can be left out
        accuracy = fm.leave_one_state_out(force_map)
    if output:
        write_result(output, map_text(force_map), mark='"schema": "forcemap-map/')
    written = f"map written to {output}" if output else "no file written; -o MAP.json writes the map"
    answer = TransferAnswer.of_map(force_map, accuracy)
    emit(answer, [*transfer_lines(answer), "", written], as_json=as_json)
    return 0


def transfer_lines(answer: TransferAnswer) -> list[str]:
    """A map that was carried over: how well the shift fits, what the bound is, from where to where."""
    carried = answer.map
    assert carried is not None
    d, h, v = zip(carried.lowest_measured, carried.highest_measured, strict=True)
    span = carried.bound_margin_percent
    binding = [carried.binding.reason] if carried.binding.reason else []
    doubts = list(dict.fromkeys([*binding, *answer.warnings]))
    fits = "fits" if answer.misfit_p >= MORE_BELOW else "does not quite fit"
    rows = zip(
        carried.terms,
        [f"{b:.4f}" for b in carried.coefficients],
        [f"{e:.4f}" for e in carried.standard_errors],
        strict=True,
    )
    width = f"; the tolerance bound lies {span.lowest:.1f} to {span.highest:.1f} % above the prediction" if span else ""
    verdict = (
        f"CARRIED OVER: the shift {fits} (p = {answer.misfit_p:.2g}; below {REFUSED_BELOW:g} it is refused){width}"
    )
    lines = [
        *verdict_first(verdict, doubts, simulated=carried.simulated),
        *(
            f"  from {earlier.name}, {counted(earlier.states, 'state')}, shifted by {', '.join(earlier.shift)}"
            for earlier in answer.earlier
        ),
        f"  by {counted(carried.states, 'new state')}; measured: d {d[0]:.3f} to {d[1]:.3f} m, "
        f"h {h[0]:.3f} to {h[1]:.3f} m, v {fm.floor_speed(v[0] or 0.0)} to {fm.floor_speed(v[1] or 0.0)} m/s "
        "(their convex hull)",
    ]
    if carried.states_left_out:
        lines.append(f"  left out, outside the earlier map's range: {', '.join(carried.states_left_out)}")
    return [
        *lines,
        "",
        "ln F = sum of coefficient x term; F in N, d and h in m, v in m/s",
        *table(["term", "coefficient", "standard error"], rows),
        f"state-to-state SD {carried.state_sd_percent:.2f} % ({carried.degrees_of_freedom:.1f} degrees of freedom)",
        *([accuracy_words(carried.accuracy)] if carried.accuracy else []),
    ]
