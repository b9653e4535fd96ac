"""Printing: one JSON object, or lines and tables of text; what answers have in common, in words."""

from __future__ import annotations

import itertools
import math
import os
import re
import sys
import textwrap
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from pydantic_core import to_json

from forcemap import FixedMargin, ToleranceBound, floor_speed
from forcemap.answers.answer import Answer
from forcemap.answers.basis import RestsOn
from forcemap.answers.error import ErrorAnswer
from forcemap.campaigns.state import PLACE_SIZE
from forcemap.errors import ForcemapError, InputError, one_line
from forcemap.files import MARKED_BY, read_bytes, write_atomically
from forcemap.findings import Finding, FindingKind
from forcemap.maps.forms import form_chosen
from forcemap.words import sentence, sentences

if TYPE_CHECKING:  # a command loads the answers it gives, and no others
    from forcemap.answers.accuracy import AccuracyAnswer, PlaceFigures
    from forcemap.answers.atlas import AtlasSpeedAnswer
    from forcemap.answers.evaluate import EvaluateAnswer
    from forcemap.answers.map import FitAnswer
    from forcemap.answers.path import AlongAnswer

SIMULATED = sentence(Finding.of(FindingKind.SIMULATED))
WIDEST = 100
"""Columns of a line of text; a choice: what a terminal and a page beside it show."""

_INDENT = 4
"""Columns by which what continues a line is indented, if the line is not; a choice."""

_LABELLED = re.compile(r"  (?=[a-z]+ )[a-z ]{8} (?=\S)")
"""A line with a label before its text, such as that of a bound; what continues it begins where the text does."""

_MARK = re.compile(r" *(?:[-!] |\d\. )?")
"""What stands before a line of a list: a dash, a number, an exclamation mark."""

_DOUBT = "  ! "
"""Before what must be read before the verdict is used."""

_GAP = "  "
"""Between the columns of a table."""

_MARKS = {"outside": ".", "unconfirmed": "?", "not_permitted": "x"}
"""What stands in a grid for an outcome without a speed."""

GRID_MARKS = "+ capped at the highest speed measured there; ? unconfirmed: no speed; . outside"
"""What they mean, for a reader."""

MOST_DISTANCES = 13
"""Columns of a grid of places that is printed; nine columns for the heights and seven for each fill a line."""

_SILENT, _SHOWN_EVERY = 1.0, 0.1
"""Work that is over sooner shows no progress, and how often progress is shown [s]; choices for a person's eye."""

_BAR = 30
"""Columns of the bar of progress; a choice."""

_PROGRESS_LINE = 78
"""Columns that are cleared when the work is done; a choice: a terminal of 80 columns does not wrap."""


def emit(answer: Answer | dict[str, Any], lines: Iterable[str], *, as_json: bool) -> None:
    """Print an answer as one JSON object, or as wrapped lines of text."""
    if as_json:
        print(answer.json_text() if isinstance(answer, Answer) else json_text(answer))
    elif _coloured(sys.stdout):
        shown = [one_line(line) for line in lines]
        _print_in_colour([(line, "bold" if number == 0 else _style(line)) for number, line in enumerate(shown)])
    else:
        print("\n".join(wrapped(map(one_line, lines))))


def verdict_first(verdict: str, doubts: Iterable[str] = (), *, simulated: bool = False) -> list[str]:
    """The verdict, whose line says itself what must be read before it is used, and directly below it that.

    That impacts are simulated is no doubt: the verdict says it in a word, and the line below it.
    """
    listed = list(doubts)
    many = "doubt" if len(listed) == 1 else f"{len(listed)} doubts"
    says = [verdict, *["SIMULATED"] * simulated, *[f"first read the {many} below"] * bool(listed)]
    return ["; ".join(says), *[f"  {SIMULATED}"] * simulated, *(f"{_DOUBT}{doubt}" for doubt in listed)]


def wrapped(lines: Iterable[str]) -> list[str]:
    """Lines of at most 100 columns, broken between words; continued lines are indented."""
    parts = []
    for line in lines:
        label = _LABELLED.match(line)
        indent = len((label or _MARK.match(line) or [""])[0]) or _INDENT
        parts += (
            textwrap.wrap(line, WIDEST, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)
            if len(line) > WIDEST
            else [line]
        )
    return parts


def _coloured(stream: TextIO) -> bool:
    """True on a terminal, unless a person wants no colour (no-color.org) or the terminal has none."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def _style(line: str) -> str:
    """How a line is set; no colour says that anything is permitted."""
    return "yellow" if line.startswith((_DOUBT, f"  {SIMULATED}")) else ""


def _print_in_colour(styled: Iterable[tuple[str, str]], *, stderr: bool = False) -> None:
    from rich.console import Console  # on a terminal only: it takes a while to load
    from rich.text import Text

    console = Console(stderr=stderr, highlight=False)
    for line, style in styled:
        for part in wrapped([line]):
            console.print(Text(part, style), soft_wrap=True)


def emit_error(error: ForcemapError, *, as_json: bool) -> None:
    """Print an error on stderr, as one line for programs, wrapped on a terminal, and as JSON if asked for."""
    text = f"error: {error}"
    if _coloured(sys.stderr):
        _print_in_colour([(text, "red")], stderr=True)
    else:
        print("\n".join(wrapped([text])) if sys.stderr.isatty() else text, file=sys.stderr)
    if as_json:
        print(ErrorAnswer.of_error(error).model_dump_json())


def write_result(path: str, text: str, *, mark: str) -> None:
    """Write a result file; an existing file is replaced only if it holds `mark`, as an earlier result does.

    Raises
    ------
    InputError
        The file is another one, or cannot be written.
    """
    if Path(path).exists() and mark not in read_bytes(path)[:MARKED_BY].decode(errors="replace"):
        raise InputError(
            "this is another file, not an earlier result; it is not overwritten, choose another name", file=path
        )
    write_atomically(path, text)


class Progress:
    """Counts on stderr, for work that takes over a second; shown on a terminal only."""

    def __init__(self, what: str, total: int) -> None:
        self._what, self._total = what, total
        self._start = self._last = time.monotonic()

    def __enter__(self) -> Progress:
        return self

    def show(self, done: int, total: int | None = None) -> None:
        """Show how many are done, of how many if that was not known at first."""
        self._total = self._total if total is None else total
        now = time.monotonic()
        if now - self._start > _SILENT and now - self._last > _SHOWN_EVERY and sys.stderr.isatty():
            self._last = now
            filled = _BAR * done // max(self._total, 1)
            bar = "#" * filled + "." * (_BAR - filled)
            print(f"\r[{bar}] {done} of {self._total} {self._what}", end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self._last > self._start:
            print("\r" + " " * _PROGRESS_LINE + "\r", end="", file=sys.stderr, flush=True)


def json_text(value: Any) -> str:
    """JSON with null for NaN and infinities."""
    return to_json(value, indent=1, inf_nan_mode="null").decode()


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a text table of at most 100 columns, the first column left-aligned, the others right-aligned.

    Where it would be wider its heading, then its cells, are broken between words over several lines; no word is broken,
    so that names can be copied.
    """
    cells = [list(row) for row in rows]
    columns = list(zip(header, *cells, strict=True))
    widths = [max(map(len, column)) for column in columns]
    heads = [max(map(len, _parts(column[0]))) for column in columns]
    words = [max((len(word) for cell in column[1:] for word in cell.split()), default=0) for column in columns]
    for least in (
        [max(head, *map(len, column[1:]), 0) for head, column in zip(heads, columns, strict=True)],
        list(map(max, heads, words)),
    ):
        while sum(widths) + len(_GAP) * (len(widths) - 1) > WIDEST and widths != least:
            spare = [width - narrowest for width, narrowest in zip(widths, least, strict=True)]
            widths[spare.index(max(spare))] -= 1
    return [line for row in (header, *cells) for line in _row_lines(row, widths, hyphens=row is header)]


def _parts(heading: str) -> list[str]:
    """What a heading may be broken into: its words, and their parts at hyphens."""
    return heading.replace("-", "- ").split() or [""]


def _row_lines(row: Sequence[str], widths: Sequence[int], *, hyphens: bool) -> list[str]:
    """A row of a table as lines, one unless a cell is wider than its column."""
    parts = [
        [cell]
        if len(cell) <= width
        else textwrap.wrap(cell, max(width, 1), break_long_words=False, break_on_hyphens=hyphens)
        for cell, width in zip(row, widths, strict=True)
    ]
    return [
        _GAP.join([first.ljust(widths[0]), *map(str.rjust, others, widths[1:])]).rstrip()
        for first, *others in itertools.zip_longest(*parts, fillvalue="")
    ]


def grid(cells: Mapping[tuple[float, float], str]) -> list[str]:
    """A text table of places by distance and height [m], heights downwards; one line if it is too wide."""
    distances, heights = (sorted({place[axis] for place in cells}) for axis in (0, 1))
    rows = [[f"{h:.3f}", *(cells.get((d, h), "") for d in distances)] for h in reversed(heights)]
    lines = table([r"h \ d [m]", *(f"{d:.3f}" for d in distances)], rows)
    too_many = f"{len(cells)} places, too many to show: see --json (or -o), or a larger step"
    return lines if len(distances) <= MOST_DISTANCES else [too_many]


def speed_cell(outcome: str, speed: float | None) -> str:
    """A speed [m/s] in a grid of places, or the mark of an outcome that has none."""
    return _MARKS.get(outcome) or f"{shown(speed)}{'+' if outcome == 'capped' else ''}"


def listing(title: str, lines: Iterable[str]) -> list[str]:
    """A title and a dash before each line."""
    return [title, *(f"  - {line}" for line in lines)]


def counted(count: int, noun: str) -> str:
    """A number of things in words: 1 state, 2 states."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def change(ratio: float | None) -> str:
    """A ratio as a change in percent."""
    # + 0.0: what rounds to 0 has no sign
    return "-" if ratio is None else f"{round(100 * (ratio - 1), 1) + 0.0:+.1f} %"


def speed_first(verdict: str, answer: RestsOn | AlongAnswer | AtlasSpeedAnswer) -> list[str]:
    """The verdict about speeds, and directly below it what must be read before it is used."""
    if isinstance(answer, RestsOn) and answer.measure_more_first:
        verdict += "; NOT TO BE USED YET, measure more"
    return verdict_first(verdict, answer.warnings, simulated=answer.simulated)


def assumes(answer: RestsOn | AlongAnswer | AtlasSpeedAnswer) -> list[str]:
    """What an answer assumes, in a list after it, without what already stands above; of several maps one each."""
    above = {SIMULATED, f"bound: {bound_words(answer.bound)}"}
    above |= {f"limit: {answer.limit}"} if isinstance(answer, RestsOn) else set()
    above |= {*answer.warnings}
    grouped = {"": answer.assumptions} if isinstance(answer, RestsOn) else answer.assumptions_by_map
    lines = []
    for name, assumed in grouped.items():
        said = [line for line in assumed if line not in above]
        lines += listing(f"Assumes{f', of {name} alone' * bool(name)}", said) if said else []
    return ["", *lines]


def accuracy_words(accuracy: AccuracyAnswer) -> str:
    """An accuracy in a line."""
    return (
        f"accuracy on {counted(accuracy.states, 'state')} ({accuracy.on}){outside_words(accuracy)}: "
        f"underestimated by at most {accuracy.max_underestimation_percent:.1f} %, overestimated by at most "
        f"{accuracy.max_overestimation_percent:.1f} %"
    )


def accuracy_lines(accuracies: Sequence[tuple[str, AccuracyAnswer]]) -> list[str]:
    """A table of accuracies, the dangerous side first."""
    header = ["% of measured", "states", "underest. max", "mean", "overest. max", "mean", "RMSE"]
    rows = []
    for name, a in accuracies:
        pairs = [
            (a.max_underestimation_percent, a.max_underestimation_N),
            (a.mean_underestimation_percent, a.mean_underestimation_N),
            (a.max_overestimation_percent, a.max_overestimation_N),
            (a.mean_overestimation_percent, a.mean_overestimation_N),
        ]
        rows.append([name, str(a.states), *(f"{p:.2f} % {n:.1f} N" for p, n in pairs), f"{a.rmse_N:.1f} N"])
    lines = table(header, rows)
    above, model = [], ""
    for name, a in accuracies:
        model = name if name == name.strip() else model  # below it, indented, what it was compared with, too
        if a.censored_states:
            of = name if name == model else f"{model}, {name.strip()}"
            above.append(f"{of} {a.censored_underestimated} of {a.censored_states}")
    head = "not compared: states above the device range; predicted below what they reached, the dangerous side"
    return [*lines, *([f"{head}: {'; '.join(above)}"] if above else [])]


def outside_words(accuracy: AccuracyAnswer) -> str:
    """How many of the states that an accuracy is of lie outside the map's measured range; empty if none does."""
    outside = accuracy.outside_states
    return f" ({outside} of {accuracy.states} outside the measured range)" if outside else ""


def fit_notes(answer: FitAnswer | EvaluateAnswer) -> list[str]:
    """States beyond the map, and whether the form fits and forces have not drifted where nothing speaks against it."""
    notes = [test.finding for test in (answer.form_test, answer.drift) if test]
    notes += sentences(form_chosen(answer.form)) if answer.form_test else []
    return [*outside_lines(answer.accuracies), *(note for note in notes if note not in answer.doubts)]


def outside_lines(accuracies: Iterable[AccuracyAnswer]) -> list[str]:
    """That errors are of states where the map is continued, of all accuracies together; nothing if none is."""
    beyond = dict.fromkeys(
        f"{each.outside_states} of {each.states} ({each.on})" for each in accuracies if each.outside_states
    )
    if not beyond:
        return []
    where = f"states outside the map's measured range by more than repeats differ: {', '.join(beyond)}"
    return [f"{where}; their errors are those of the map continued"]


_TELLING = 4
"""Places with several states from which on their scatter is told without a doubt added; a choice."""


def place_lines(answer: PlaceFigures) -> list[str]:
    """What the states of a place share, beside what is a state's own; nothing for a map that was not fitted."""
    if answer.places is None or answer.place_sd_percent is None:
        return []
    places = f"{answer.places} places (those within {1000 * PLACE_SIZE:g} mm count as one):"
    if not answer.place_correlation:
        return [
            f"{places} too few have several states to tell what the states of a place share; a "
            f"tolerance bound has it within the {answer.own_sd_percent:.2f} % by which states scatter"
        ]
    likeliest = f"{answer.likely_place_correlation:.2f}"
    found = "no scatter shared by the states of a place found; " if likeliest == "0.00" else ""
    shared = f"{answer.place_sd_percent:.2f} %{' of scatter shared by the states of a place' * (not found)}"
    hardly = ""
    if (shared_places := answer.places_shared or 0) < _TELLING:
        hardly = f"only {shared_places} with several states, which hardly tells what these share: "
    return [
        f"{places} {hardly}{found}coefficients and bound reckon with {shared}, the most that is likely (correlation "
        f"{answer.place_correlation:.2f}, likeliest {likeliest}), and {answer.own_sd_percent:.2f} % of a state's own; "
        "standard errors and p values with that or the least that is likely, whichever makes them larger"
    ]


def shown(speed: float | None) -> str:
    """A speed for text: rounded down to 0.001 m/s, a dash if there is none."""
    return floor_speed(math.nan if speed is None else speed)


def bound_words(bound: dict[str, str | float]) -> str:
    """A bound in words."""
    figures = [float(figure) for name, figure in bound.items() if name != "kind"]
    return str(FixedMargin(*figures) if bound["kind"] == "margin" else ToleranceBound(*figures))
