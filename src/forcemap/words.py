"""What every finding says in English: the one table of sentences is `words.toml`.

No other code makes words of findings, none reads any.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Container, Iterable, Mapping
from importlib import resources
from typing import Any

from forcemap.errors import few
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.scenario import ContactScenario
from forcemap.speeds.basis import Basis

_WORDS: dict[str, Any] = tomllib.loads(resources.files(__package__).joinpath("words.toml").read_text("utf-8"))
SHORT: dict[str, str] = _WORDS.pop("short")
"""What some say in a few words, the gravest first."""

SENTENCES: dict[str, str] = _WORDS
"""What findings say, by the value of their kind; words.toml says how."""

_GRAVITY = {kind: place for place, kind in enumerate(SHORT)}

NAMED_FROM = 0.05
"""A force is named from this on [N]: it is not 0.0 N when rounded to a tenth."""
_LISTED = 6  # names in a sentence; the others are counted
_WHERE_STATED = re.compile(r"\[(\w+)\?([^|\]]*)\|?([^\]]*)\]")


class _Figures(dict[str, Any]):
    """Figures by name, with some as a sentence has them: `x_N_per_mm` of `x_N_per_m`, `x_mm` of `x_m`,
    `x_percent` of `x`, lists."""

    def __missing__(self, name: str) -> Any:
        if name.endswith("_N_per_mm"):
            return self[name[:-1]] / 1000
        if name.endswith("_mm"):
            return 1000 * self[name[:-1]]
        if name.endswith("_percent"):
            return 100 * self[name.removesuffix("_percent")]
        if name.endswith(("_listed", "_and")):
            name, _, how = name.rpartition("_")
            return {"listed": ", ", "and": " and "}[how].join(self[name])
        if name.endswith("_six"):
            return few(self[name[:-4]], _LISTED)
        return getattr(self, f"_{name}")()

    def states(self, name: str) -> bool:
        """True unless a figure is not finite, none, empty or a count of 0."""
        value = self[name]
        return math.isfinite(value) if isinstance(value, float) else bool(value)

    def _unit(self) -> str:
        return "N"  # of another quantity than the force the finding states it

    def _register(self) -> str:
        return "recordings.csv"  # of files in points/ the finding states theirs

    def _names(self) -> str:
        first, *more = self["all"]
        return f"{first or 'a row without recording'}{f' and {len(more)} more' if more else ''}"

    def _scenarios(self) -> str:
        counts = [
            f"{self[scenario.name]} impacts {scenario.words}" for scenario in ContactScenario if self.get(scenario.name)
        ]
        return ", ".join(counts) or "scenario not stated"

    def _who(self) -> str:
        impacts, states = self["impacts"], self["states"]
        return f"{states} states" if impacts == states else f"{impacts} impacts of {states} states"

    def _added(self) -> str:
        """What is added to a force before it counts as within a limit."""
        what = [f"the device's error of {self['error_N']:g} N"]
        what += [f"{self['drift_N']:.1f} N that drift may hide"] if self["drift_N"] >= NAMED_FROM else []
        what += (
            [f"{self['unseen_N']:.1f} N that its flanks leave open above the largest sample, as of a top cut off"]
            if self["unseen_N"] >= NAMED_FROM
            else []
        )
        return ", ".join(what[:-1]) + " and " * (len(what) > 1) + what[-1]

    def _together(self) -> float:
        """A force with all that is added to it [N]."""
        return float(sum(self[f"{name}_N"] for name in ("force", "error", "drift", "unseen")))

    def _reference_posture(self) -> str:
        return posture_words(dict(self["reference"]))

    def _tool(self) -> str:
        return tool_words(self["tool_axis"], self["towards"], self["contact_offset_m"])

    def _conditions(self) -> str:
        """Conditions that campaign.toml now states otherwise than when the recordings were registered."""
        return "; ".join(
            f"{entry} was {was!r} when {count} of the recordings were registered"
            + "".join(f" (measured on {day})" for day in days if day)
            + ", campaign.toml "
            + ("does not state it" if now is None else f"says {now!r}")
            for entry, was, now, count, *days in self["changes"]
        )

    def _changed(self) -> str:
        """Conditions that the campaigns of a map that was carried over state differently."""
        return "; ".join(
            f"{entry} was {was or 'not stated'}, now {now or 'not stated'}" for entry, was, now in self["changes"]
        )

    def _changes_of_states(self) -> str:
        return ", ".join(f"{name} by {100 * share:+.0f} %" for name, share in self["apart"])

    def _columns(self) -> str:
        return ", ".join(dict.fromkeys(entry for entry, *_ in self["changes"]))


def posture_words(posture: Mapping[str, float]) -> str:
    """A posture in a line: positions by joint, the unit behind the name."""
    named = {name.rpartition("_"): figure for name, figure in posture.items()}
    return ", ".join(f"{joint} {round(figure, 3) + 0.0:g} {unit}" for (joint, _, unit), figure in named.items())


def tool_words(axis: Iterable[float], towards: Iterable[float], offset: Iterable[float]) -> str:
    """Where a tool's axis, given in the frame of the flange, points, and its contact point [m]."""
    of_flange, of_base, point = (
        ", ".join(f"{round(x, 4) + 0.0:g}" for x in vector) for vector in (axis, towards, offset)
    )
    return f"tool axis ({of_flange}) of the flange pointing to ({of_base}), contact point at ({point}) m in its frame"


def sentence(finding: Finding | str | None) -> str:
    """The sentence of a finding; a text is its own sentence, None is empty."""
    if finding is None or isinstance(finding, str):
        return finding or ""
    words, also = SENTENCES[finding.kind], "; ".join(map(sentence, finding.also))
    text = _filled(words, _Figures(finding.figures, also=also))
    return text if "{also}" in words or not also else f"{text}; {also}"


def _filled(words: str, figures: _Figures) -> str:
    return _WHERE_STATED.sub(lambda part: part[2] if figures.states(part[1]) else part[3], words).format_map(figures)


def short_reason(findings: Iterable[Finding]) -> str:
    """The gravest of findings and of what they consist of, in a few words; of several forces the highest."""
    every = list(findings)
    for finding in every:
        every += finding.also  # looked at in its turn
    known = [(finding, dict(finding.figures)) for finding in every if finding.kind in SHORT]
    if not known:
        return "no speed"
    kind, figures = min(
        ((finding.kind, figures) for finding, figures in known),
        key=lambda each: (_GRAVITY[each[0]], -each[1].get("force_N", 0.0)),
    )
    return _filled(SHORT[kind], _Figures(figures))


def sentences(findings: Iterable[Finding | str]) -> list[str]:
    """The sentences of findings, every one once, in their order."""
    return list(dict.fromkeys(sentence(finding) for finding in findings))


def assumptions(
    bases: Iterable[Basis], notes: Iterable[Finding] = (), *, but: Container[FindingKind] = ()
) -> list[str]:
    """What speeds rest on, one line for every finding, without those of the kinds in `but`, which stand elsewhere."""
    findings = [*(statement for basis in bases for statement in basis.statements), *notes]
    return sentences(statement for statement in findings if statement.kind not in but)


def warnings(bases: Iterable[Basis]) -> list[str]:
    """What must be said before speeds that rest on these, one line for every finding."""
    return sentences(warning for basis in bases for warning in basis.warnings)


def of_maps(said: Iterable[tuple[str, Iterable[str]]]) -> list[str]:
    """What several maps, by name, say: every line once, behind the names of those that say it if others do not."""
    return [f"{of}: {line}" if of else line for line, of in _speakers(said).items()]


def by_map(said: Iterable[tuple[str, Iterable[str]]]) -> dict[str, list[str]]:
    """What several maps, by name, say: lines by the names of those that say them, first what all say, by no name."""
    grouped: dict[str, list[str]] = {"": []}
    for line, of in _speakers(said).items():
        grouped.setdefault(of, []).append(line)
    return {of: lines for of, lines in grouped.items() if lines}


def _speakers(said: Iterable[tuple[str, Iterable[str]]]) -> dict[str, str]:
    """Every line with the names of those that say it, none where all do."""
    names: dict[str, dict[str, None]] = {}
    pairs = [(name, list(lines)) for name, lines in said]
    for name, lines in pairs:
        for line in lines:
            names.setdefault(line, {})[name] = None
    every = len({name for name, _ in pairs})
    return {line: "" if len(of) == every else ", ".join(of) for line, of in names.items()}


def limit_words(basis: Basis) -> str:
    """The limit that speeds are compared with."""
    return sentence(basis.limit_finding)


def simulated_line(simulated: bool) -> list[str]:
    """The first line of a result that rests on simulated impacts; none for others."""
    return [sentence(Finding.of(FindingKind.SIMULATED))] if simulated else []
