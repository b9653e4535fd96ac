"""Rooms import as CONTRIBUTING, "Rooms", allows: read from the source, nothing is run."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import forcemap

ROOT = Path(forcemap.__file__).parent
GROUND = {"errors", "files", "arrays", "csv_table", "findings", "_version"}
ROOMS: dict[str, set[str]] = {
    "recordings": set(),
    "limits": set(),
    "dynamics": set(),
    "impacts": {"recordings"},
    "campaigns": {"recordings", "impacts"},
    "maps": {"campaigns.dataset"},
    "speeds": {"maps", "limits", "campaigns.dataset"},
    "verdicts": {"recordings", "impacts", "campaigns", "limits"},
    "planning": {"campaigns", "maps", "limits", "speeds"},
    "comparisons": {"campaigns", "maps", "limits", "dynamics", "speeds"},
    "paths": {"campaigns", "maps", "limits", "dynamics", "speeds"},
    "lab": {"recordings", "campaigns", "dynamics"},  # never what it checks
    "exports": {"campaigns", "maps", "limits", "speeds", "paths", "words"},
}
ROOMS["assessment"] = set(ROOMS) - {"lab", "exports"}
FACES = {
    "words": {"impacts", "speeds"},  # no library room imports it: none makes a sentence
    "answers": set(ROOMS) - {"lab"} | {"words"},  # result types
    "figures": set(ROOMS) - {"lab", "exports", "assessment"} | {"words"},
    "report": {"words", "assessment", "figures", "campaigns", "limits", "speeds", "comparisons", "verdicts"},
    "web": set(ROOMS) - {"lab"} | {"", "words", "answers", "report", "figures"},
    "cli": set(ROOMS) | {"", "words", "answers", "report", "figures", "web"},
}
ALLOWED = ROOMS | FACES
FACE_PACKAGES = {"matplotlib", "jinja2", "fastapi", "uvicorn", "typer", "rich", "plotly", "starlette", "pydantic"}
LIBRARY_PACKAGES = {"numpy", "scipy", "pandas", "defusedxml", "nptdms"} | set(sys.stdlib_module_names)


def imports(path):
    """(module, line) of every import in a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.module is not None
            if path.suffix == ".pyi":  # names that load when they are used are told by relative imports
                yield f"forcemap.{node.module}", node.lineno
                continue
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            yield node.module, node.lineno
            for alias in node.names:  # from forcemap.maps import bounds
                if (ROOT / Path(*node.module.split(".")[1:]) / f"{alias.name}.py").exists():
                    yield f"{node.module}.{alias.name}", node.lineno


def room_of(path):
    return path.relative_to(ROOT).with_suffix("").parts[0]


SOURCES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")
NAMES = ROOT / "__init__.pyi"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_rooms_import_as_allowed(path):
    room = room_of(path)
    if room in GROUND:
        assert all(not name.startswith("forcemap.") or name == "forcemap.errors" for name, _ in imports(path))
        return
    assert room in ALLOWED, f"{room} is a room without a row in the table"
    for name, line in imports(path):
        package, _, inner = name.partition(".")
        if package != "forcemap":
            assert room in FACES or package in LIBRARY_PACKAGES, f"{path}:{line}: {name} in a library room"
            continue
        target = inner.split(".")[0]
        if target == room or target in GROUND:
            continue
        allowed = ALLOWED[room]
        assert target in allowed or inner in allowed, f"{path}:{line}: {room} imports {name}"


def test_no_circle_of_imports():
    """Imports inside functions and for types alone count, too."""
    names = {".".join(("forcemap", *path.relative_to(ROOT).with_suffix("").parts)): path for path in SOURCES}
    after = {name: {each for each, _ in imports(path) if each in names} for name, path in names.items()}
    while free := [name for name, needed in after.items() if not needed & after.keys()]:
        for name in free:
            del after[name]
    assert not after, f"circles among {sorted(after)}"


def test_each_type_of_array_is_defined_once():
    text = "".join(path.read_text() for path in SOURCES)
    assert text.count("\nFloatArray = ") == 1
    assert text.count("NDArray[np.float64]") == 1


def test_the_package_itself_does_not_import_the_lab():
    assert not any(name.startswith("forcemap.lab") for name, _ in imports(NAMES))


@pytest.mark.parametrize("path", sorted((ROOT / "cli").glob("*.py")), ids=lambda path: path.name)
def test_commands_import_the_lab_inside(path):
    """Only the commands that simulate load it."""
    assert not any(
        isinstance(node, ast.ImportFrom) and node.module.startswith("forcemap.lab")
        for node in ast.parse(path.read_text()).body
    )


def test_importing_forcemap_is_light():
    """Neither matplotlib, pandas nor scipy.stats, and nothing of the faces."""
    heavy = ["matplotlib", "pandas", "scipy.stats", *sorted(FACE_PACKAGES)]
    code = f"import sys, forcemap; print([name for name in {heavy!r} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_help_loads_nothing_heavy():
    """What lets `forcemap --help` answer within half a second."""
    heavy = ["matplotlib", "pandas", "scipy"]
    code = (
        "import sys\nfrom forcemap.cli.app import run\nrun(['--help'])\n"
        f"print([name for name in {heavy!r} if name in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip().endswith("[]")
    assert "speed-map" in found.stdout
