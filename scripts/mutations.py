"""What can be mutated: the mutations of cosmic-ray, and names swapped (min for max), in the files of a room.

One mutation is drawn for each place drawn, so that an operator with eleven replacements does not outweigh a number with
two. Left out are mutations that cannot change what runs (annotations, text that compiles to the same), that any test
would notice (no Python, a bitwise operator between floats), and `is` for `==` and back, which is style.
"""

from __future__ import annotations

import ast
import difflib
import functools
import random
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names
from parso.python.tree import Name

ROOMS = ("maps", "speeds", "limits", "verdicts", "impacts", "paths", "exports")
_STYLE = ("_Eq_Is", "_Is_Eq", "_NotEq_IsNot", "_IsNot_NotEq")
_BITWISE = {"BitOr", "BitAnd", "BitXor", "RShift", "LShift"}
_PAIRS = (
    *(("min", "max"), ("minimum", "maximum"), ("nanmin", "nanmax"), ("argmin", "argmax"), ("any", "all")),
    *(("floor", "ceil"), ("ROUND_FLOOR", "ROUND_CEILING"), ("floor_speed", "str"), ("lower", "upper")),
    *(("first", "last"), ("nanargmin", "nanargmax"), ("start", "stop"), ("isfinite", "isnan")),
)
_SWAPS = dict(_PAIRS) | {b: a for a, b in _PAIRS if b != "str"}


class SwapNames:
    """A name of one end for that of the other."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[Any, Any]]:
        """Uses of a name that has an opposite; what binds or imports it is left."""
        if isinstance(node, Name) and node.value in _SWAPS and not node.is_definition():
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """The name of the other end."""
        node.value = _SWAPS[node.value]
        return node


@dataclass(frozen=True)
class Mutant:
    """A file changed at one place; `named` says what the change is if the project names it."""

    path: str  # from the root of the project
    line: int
    text: str
    named: str = ""

    def difference(self, root: Path) -> tuple[str, str]:
        """The lines that change: as they are, as they become."""
        lines = list(difflib.ndiff((root / self.path).read_text().splitlines(), self.text.splitlines()))
        before, after = (" ".join(line[2:].strip() for line in lines if line[:2] == f"{sign} ") for sign in "-+")
        return before, after


@functools.cache
def _operators() -> dict[str, Any]:
    named = {name: get_operator(name) for name in operator_names()}
    return {name: each() for name, each in named.items() if not each.arguments()} | {"SwapNames": SwapNames()}


def _places(path: Path) -> dict[tuple[Any, ...], list[tuple[str, int]]]:
    """Operators and their occurrences at each place of a file that runs."""
    tree = get_ast(path.read_text())
    silent = _annotations(path.read_text())
    found: dict[tuple[Any, ...], list[tuple[str, int]]] = {}
    nodes = list(ast_nodes(tree))
    for name, operator in _operators().items():
        spans = ((node, *span) for node in nodes for span in operator.mutation_positions(node))
        for occurrence, (node, start, end) in enumerate(spans):
            if not _empty(name, node) and not any(a <= start and end <= b for a, b in silent):
                found.setdefault((start, end, name.partition("_")[0]), []).append((name, occurrence))
    return found


def _empty(name: str, node: Any) -> bool:
    """Whether an operator's mutation of a node tells nothing: a bare star among parameters is none, for one."""
    star = "BinaryOperator" in name and node.parent.type in ("parameters", "typedargslist", "dictorsetmaker")
    mixed = "BinaryOperator" in name and len(_BITWISE & set(name.split("_")[1:])) == 1
    return star or mixed or name.endswith((*_STYLE, "NoOp"))


def _annotations(text: str) -> list[tuple[Any, Any]]:
    """Where annotations stand: (line, column) of start and end; none of them is evaluated."""
    spans = []
    for node in ast.walk(ast.parse(text)):
        for name in ("annotation", "returns"):
            if (each := getattr(node, name, None)) is not None:
                spans.append(((each.lineno, each.col_offset), (each.end_lineno, each.end_col_offset)))
    return spans


def _compiles_to(text: str) -> str | None:
    """What a text means to Python, without places; None if nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            compile(text, "mutant", "exec")
        except (SyntaxError, SyntaxWarning, ValueError):
            return None
    return ast.dump(ast.parse(text))


def drawn(root: Path, rooms: tuple[str, ...], seed: int, count: int) -> list[Mutant]:
    """As many mutants as wanted, the same ones for the same source and seed."""
    dice = random.Random(seed)
    files = [path for room in rooms for path in sorted((root / "src" / "forcemap" / room).rglob("*.py"))]
    places = [(path, place, each) for path in files for place, each in sorted(_places(path).items())]
    dice.shuffle(places)
    mutants: list[Mutant] = []
    for path, place, occurrences in places:
        name, occurrence = dice.choice(occurrences)
        source = path.read_text()
        text = mutate_code(source, _operators()[name], occurrence)
        if text is not None and _compiles_to(text) not in (None, _compiles_to(source)):
            mutants.append(Mutant(str(path.relative_to(root)), place[0][0], text))
        if len(mutants) == count:
            break
    return mutants


def named(root: Path, table: list[dict[str, str]]) -> list[Mutant]:
    """The mutants that the project names: a text that stands once in its file, and another in its place."""
    mutants = []
    for entry in table:
        source = (root / entry["file"]).read_text()
        if source.count(entry["old"]) != 1:
            raise SystemExit(f"scripts/mutants.toml: {entry['file']} does not hold once: {entry['old']!r}")
        line = 1 + source.partition(entry["old"])[0].count("\n")
        mutants.append(Mutant(entry["file"], line, source.replace(entry["old"], entry["new"]), entry["what"]))
    return mutants
