"""Draw docs/pictures/rooms.svg: the rooms of src/forcemap and what imports what, read from the source.

Run from the root of the project. An arrow leads from a room to one that imports it, the way the data go; one that
follows from others is not drawn (A to C where A goes to B, and B to C). With --edges every import is printed as text.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from forcemap.files import write_atomically

ROOT = Path("src/forcemap")
PICTURE = Path("docs/pictures/rooms.svg")
NAMES, WORDS = "public names", "words"
"""The boxes of `forcemap/__init__.pyi` and of the table of sentences."""

Edges = set[tuple[str, str]]
"""(imported, importing) rooms."""

Node = tuple[str, ...]

_WIDTH, _HEIGHT, _ROW = 116, 28, 64


def rooms() -> dict[str, list[Path]]:
    """The Python files of every room, and of the public names."""
    folders = sorted(path.parent for path in ROOT.glob("*/__init__.py"))
    found = {folder.name: sorted(folder.rglob("*.py")) for folder in folders}
    return found | {NAMES: [ROOT / "__init__.pyi"], WORDS: [ROOT / "words.py"]}


def edges() -> Edges:
    """Every pair of rooms of which one imports the other; imports inside functions count, too."""
    known = rooms()
    return {
        (target, room)
        for room, files in known.items()
        for file in files
        for module in imported(file)
        if (target := room_of(module)) in known and target != room
    }


def room_of(module: str) -> str:
    """The room of a module of ours."""
    inner = module.removeprefix("forcemap").removeprefix(".")
    return inner.split(".")[0] or NAMES


def imported(file: Path) -> Iterator[str]:
    """Modules of ours that a file imports."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            module = f"forcemap.{node.module}" if node.level else node.module  # relative in the stub of the names alone
            if module.split(".")[0] == "forcemap":
                yield module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "forcemap")


def needed(pairs: Edges) -> Edges:
    """The pairs that do not follow from others."""
    return {(a, b) for a, b in pairs if not any(a in before(middle, pairs) for middle, end in pairs if end == b)}


def before(room: str, pairs: Edges) -> set[str]:
    """All rooms that a room rests on."""
    direct = {a for a, b in pairs if b == room}
    return direct.union(*(before(each, pairs) for each in direct))


def rows(pairs: Edges) -> tuple[list[list[Node]], list[tuple[Node, Node]]]:
    """Nodes by rows from top to bottom, in an order with short arrows, and the steps of arrows from row to row.

    A node is a room, or a place where an arrow passes a row, named after its two rooms.
    """
    depth = {room: _longest_chain(room, pairs) for room in rooms()}
    for room in depth:  # what rests on nothing stands close to its first user
        users = [depth[b] for a, b in pairs if a == room]
        depth[room] = min(users) - 1 if users and not depth[room] else depth[room]
    found: list[list[Node]] = [[] for _ in range(max(depth.values()) + 1)]
    for room, row in depth.items():
        found[row].append((room,))
    steps: list[tuple[Node, Node]] = []
    for a, b in sorted(pairs):
        passed = range(depth[a] + 1, depth[b])
        for row in passed:
            found[row].append((a, b))
        chain: list[Node] = [(a,), *[(a, b) for _ in passed], (b,)]
        steps += pairwise(chain)
    for turn in range(24):
        for i in range(len(found)) if turn % 2 else reversed(range(len(found))):
            near = found[i - 1] if turn % 2 else found[(i + 1) % len(found)]
            found[i].sort(key=lambda node, near=near: (_middle(node, near, steps), node))  # type: ignore[misc]
    return found, steps


def _longest_chain(room: str, pairs: Edges) -> int:
    return max((1 + _longest_chain(a, pairs) for a, b in pairs if b == room), default=0)


def _middle(node: Node, row: list[Node], steps: list[tuple[Node, Node]]) -> float:
    """Where a node's neighbours in a row stand on average, from 0 to 1."""
    places = [i / len(row) for i, each in enumerate(row) if (each, node) in steps or (node, each) in steps]
    return sum(places) / len(places) if places else 0.5


def picture() -> str:
    """The picture as SVG."""
    pairs = needed(edges())
    found, _ = rows(pairs)
    widths = [sum(_space(node) for node in row) for row in found]
    width, height = max(widths) + 16, _ROW * (len(found) - 1) + _HEIGHT + 16
    places: dict[tuple[Node, int], float] = {}
    for i, (row, taken) in enumerate(zip(found, widths, strict=True)):
        x = (width - taken) / 2
        for node in row:
            places[node, i] = x + _space(node) / 2
            x += _space(node)
    at = {room: (x, i) for ((room, *passing), i), x in places.items() if not passing}
    head = f'viewBox="0 0 {width} {height}" width="{width}" font-family="sans-serif" role="img"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {head}>',
        "<title>Rooms of forcemap; an arrow leads from a room to one that imports it</title>",
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#506070"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for a, b in sorted(pairs):
        passed = [(places[(a, b), i], i) for i in range(at[a][1] + 1, at[b][1])]
        lines.append(_arrow(f"{a}-{b}", [at[a], *passed, at[b]]))
    lines += [_box(room, x, _ROW * i + 8) for room, (x, i) in at.items()]
    return "\n".join([*lines, "</svg>"]) + "\n"


def _space(node: Node) -> int:
    """What a node takes of its row."""
    return _WIDTH + 18 if len(node) == 1 else 22


def _arrow(name: str, points: list[tuple[float, int]]) -> str:
    x, row = points[0]
    path = f"M{x:.0f} {_ROW * row + 8 + _HEIGHT}"
    for (x, row), (end, below) in pairwise(points):
        top, bottom = _ROW * row + 8 + _HEIGHT, _ROW * below + 8
        bend = (top + bottom) / 2
        path += f"C{x:.0f} {bend:.0f} {end:.0f} {bend:.0f} {end:.0f} {bottom}"
        path += f"V{bottom + _HEIGHT}" if (end, below) != points[-1] else ""
    name = name.replace(" ", "-")
    return f'<path id="{name}" d="{path}" fill="none" stroke="#506070" stroke-width="1.2" marker-end="url(#head)"/>'


def _box(room: str, x: float, y: int) -> str:
    colour = "#fff3d6" if room == NAMES else "#e8f0f8"
    return (
        f'<rect x="{x - _WIDTH / 2:.0f}" y="{y}" width="{_WIDTH}" height="{_HEIGHT}" rx="5" fill="{colour}" '
        'stroke="#506070"/>'
        f'<text x="{x:.0f}" y="{y + 18}" font-size="13" font-weight="bold" text-anchor="middle">{room}</text>'
    )


def main() -> None:
    """Write the picture, or print what imports what."""
    if "--edges" in sys.argv:
        print("\n".join(f"{a} -> {b}" for a, b in sorted(edges())))
        return
    write_atomically(PICTURE, picture())
    print(PICTURE)


if __name__ == "__main__":
    main()
