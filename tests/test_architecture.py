"""docs/architecture.md says what the source is: the table of imports, the picture, the files to change."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from test_import_directions import FACES, GROUND, NAMES, ROOMS, ROOT, SOURCES, imports, room_of

PROJECT = Path(__file__).parents[1]
PAGE = (PROJECT / "docs" / "architecture.md").read_text()


def section(heading):
    (text,) = re.findall(rf"^## {heading}\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S)
    return text


def allowed(words):
    """The rooms that a cell of the table names; public names are the empty one."""
    listed, every, others = words.partition("every library room but ")
    words = [name for name in listed.split(", ") if name and name != "nothing"]
    named = {"" if name == "public names" else name for name in words}
    return named | (set(ROOMS) - set(others.split(", ")) if every else set())


def test_the_table_is_the_one_that_is_enforced():
    rows = dict(re.findall(r"^\| `(\w+)` \|.*\| (.*) \|$", section("Rooms"), re.M))
    assert set(rows) == {path.parent.name for path in ROOT.glob("*/__init__.py")} | {"words"}
    for room, words in rows.items():
        assert allowed(words) - {room} == (ROOMS | FACES)[room] - {room}, room
    ground = re.findall(r"`(\w+)`\s\(", section("Rooms").split("| room |")[0])
    assert set(ground) == {name for name in GROUND if not name.startswith("_")}


def edges_of_the_code():
    """(imported, importing) rooms, the package itself among them."""
    found = set()
    for path in (*SOURCES, NAMES):
        room = "public-names" if path.suffix == ".pyi" else room_of(path)
        for module, _ in imports(path):
            package, _, inner = module.partition(".")
            target = inner.split(".")[0] or "public-names"
            if package == "forcemap" and not {target, room} & GROUND and target != room:
                found.add((target, room))
    return found


def test_the_picture_shows_what_imports_what():
    """Every arrow is an import, and every import is an arrow or a chain of them."""
    drawn = set(re.findall(r'<path id="(.*?)"', (PROJECT / "docs" / "pictures" / "rooms.svg").read_text()))
    edges = edges_of_the_code()
    rooms = {room for edge in edges for room in edge}
    arrows = {(a, b) for a in rooms for b in rooms if f"{a}-{b}" in drawn}
    assert len(arrows) == len(drawn)
    assert arrows <= edges
    after = {room: {b for a, b in arrows if a == room} for room in rooms}

    def leads(a, b):
        return b in after[a] or any(leads(each, b) for each in after[a])

    assert [edge for edge in edges if not leads(*edge)] == []


def test_the_files_to_change_exist():
    for name in re.findall(r"`([\w./]+/[\w.]*)`", section("Where to change what")):
        home = PROJECT if name.startswith(("tests/", "scripts/", "src/")) else ROOT
        assert (home / name).exists(), name


def lengths(path):
    """(name, lines, lines of the docstring) of every function of a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0]
            docstring = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) else 0
            yield node.name, node.end_lineno - node.lineno + 1, docstring


def test_functions_fit_on_a_screen():
    """No more than 60 lines of code; those that are longer with their docstring are named in CONTRIBUTING."""
    files = [path for folder in ("src", "scripts", "benchmarks") for path in (PROJECT / folder).rglob("*.py")]
    long = [
        f"{path.relative_to(PROJECT)}:{name}: {lines - docstring} lines without its docstring, at most 60"
        for path in files
        for name, lines, docstring in lengths(path)
        if lines - docstring > 60
    ]
    assert not long, "\n".join(long)
    text = (PROJECT / "CONTRIBUTING.md").read_text().split("## How long a function may be")[1].split("\n## ")[0]
    named = set(re.findall(r"`([\w/]+\.py:\w+)`", text))
    longer = {f"{path.relative_to(ROOT)}:{name}" for path in SOURCES for name, n, _ in lengths(path) if n > 60}
    assert named == longer, (
        'split what is longer than 60 lines, or name it in CONTRIBUTING, "How long a function may be"'
    )
