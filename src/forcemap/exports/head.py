"""The head of every exported file: what its speeds rest on, and who must confirm them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from typing import Any

from forcemap.exports.robot_table import Provenance
from forcemap.findings import FindingKind
from forcemap.words import assumptions, limit_words, sentence

NOT_SAFETY_RATED = (
    "NOT SAFETY-RATED: an estimate from measurements, looked up by an ordinary program; the robot's own safety "
    "functions must hold without it"
)
SIMULATED = "SIMULATED: made from simulated impacts, not a measurement of any robot; not for use on one"
_ELSEWHERE = (FindingKind.LIMIT, FindingKind.BOUND, FindingKind.OVERSHOOT)  # lines of their own in the head
_LEAST_SPACING, _MOST_SPACING = 0.001, 0.005  # [m]; choices: whole millimetres, and what docs/universal_robots.md says
WHO_CONFIRMS = (
    "to be accepted before use: by the person responsible for the risk assessment, with measurements at the speeds "
    "used, and by whoever changes the safety configuration"
)


def head_lines(provenance: Provenance) -> list[str]:
    """The head as lines of text; a text of a campaign cannot add a line."""
    allowance = provenance.allowance
    lines = [
        *([SIMULATED] if provenance.simulated else []),
        *provenance.warnings,
        "allowed speeds of the contact point, made by forcemap",
        NOT_SAFETY_RATED,
        WHO_CONFIRMS,
        f"map: {_map_words(provenance)}, SHA-256 {provenance.map_sha256}",
        *_file("map file", provenance.map_file, provenance.map_file_sha256),
        *_file("impacts table", provenance.impacts_table, provenance.impacts_table_sha256),
        f"date: {provenance.date}",
        *(f"limit: {limit}" for limit in _limits(provenance)),
        f"bound: {provenance.bound}",
        f"allowance: {'; '.join(map(sentence, (allowance.of_speed, allowance.of_position)))}",
        *(f"assumes: {line}" for line in assumptions(provenance.bases, provenance.notes, but=_ELSEWHERE)),
    ]
    return [one_line(line) for line in lines]


def way_spacing(provenance: Provenance) -> float:
    """How far apart a program may ask for places of a way [m]: a zone's speed holds that far beside it."""
    return min(max(provenance.allowance.position, _LEAST_SPACING), _MOST_SPACING)


def _limits(provenance: Provenance) -> list[str]:
    return list(dict.fromkeys(limit_words(basis) for basis in provenance.bases))


def one_line(text: str) -> str:
    """A text without line breaks and control characters: after one of them a comment would become program."""
    return "".join(letter for letter in " ".join(text.split()) if letter.isprintable())


def cell(text: str) -> str:
    """A text for a cell of a CSV file: one line, and none that a spreadsheet takes for a formula."""
    line = one_line(text)
    return f"'{line}" if line.startswith(("=", "+", "-", "@")) else line


def csv_text(columns: Iterable[str], rows: Iterable[Iterable[Any]], head: Iterable[str] = ()) -> str:
    """The text of a CSV file below a head in comments (#)."""
    stream = io.StringIO()
    stream.writelines(f"# {line}\n" for line in head)
    csv.writer(stream, lineterminator="\n").writerows([columns, *rows])
    return stream.getvalue()


def _map_words(provenance: Provenance) -> str:
    """A map's name; that of the table that it was fitted to names the table below, too, with another hash."""
    fitted = provenance.map_name == provenance.impacts_table
    return f"fitted to {provenance.map_name}" if fitted else provenance.map_name


def _file(what: str, name: str, digest: str) -> list[str]:
    return [f"{what}: {name}, SHA-256 {digest}"] if digest else []


def head_result(provenance: Provenance) -> dict[str, Any]:
    """The head for JSON, units in the keys."""
    return {
        "safety_rated": False,
        "notice": NOT_SAFETY_RATED,
        "to_confirm": WHO_CONFIRMS,
        "map": one_line(provenance.map_name),
        "map_sha256": provenance.map_sha256,
        "map_file": one_line(provenance.map_file) or None,
        "map_file_sha256": provenance.map_file_sha256 or None,
        "impacts_table": one_line(provenance.impacts_table) or None,
        "impacts_table_sha256": provenance.impacts_table_sha256 or None,
        "date": provenance.date,
        "limits": [one_line(line) for line in _limits(provenance)],
        "limits_N": list(provenance.limits_N),
        "bound": str(provenance.bound),
        "speed_kind": provenance.bases[0].conditions.speed_kind or None,
        "speed_error": None if math.isnan(error := provenance.bases[0].speed_error) else error,
        "speed_overshoot_mps": provenance.allowance.speed,
        "position_tolerance_m": provenance.allowance.position,
        "warnings": [one_line(line) for line in provenance.warnings],
        "assumptions": [one_line(e) for e in assumptions(provenance.bases, provenance.notes, but=_ELSEWHERE)],
    }


def head_comment(provenance: Provenance, mark: str) -> list[str]:
    """The head as comment lines of a program."""
    return comment_lines(head_lines(provenance), mark)


def comment_lines(lines: Iterable[str], mark: str) -> list[str]:
    """Lines as comments of a program, in ASCII, which every controller reads."""
    return [f"{mark} {line}".encode("ascii", "replace").decode() for line in lines]
