"""Rooms import as docs/architecture.md, "Rooms", allows: read from the source, nothing is run."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import forcemap

ROOT = Path(forcemap.__file__).parent
GROUND = {"errors", "direction", "files", "arrays", "csv_table", "findings", "compiled", "_version"}
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
    "paths": {"recordings", "campaigns", "maps", "limits", "dynamics", "speeds"},
    "lab": {"recordings", "campaigns", "dynamics"},  # never what it checks
    "exports": {"campaigns", "maps", "limits", "speeds", "paths", "words"},
}
ROOMS["assessment"] = set(ROOMS) - {"lab", "exports"}
FACES = {
    "words": {"impacts", "speeds"},  # no library room imports it: none makes a sentence
    "answers": set(ROOMS) - {"lab"} | {"words"},  # result types
    "figures": set(ROOMS) - {"lab", "exports", "assessment"} | {"words"},
    "report": {
        *("words", "assessment", "figures"),
        *("campaigns", "impacts", "limits", "maps", "speeds", "comparisons", "verdicts", "paths"),  # result types
    },
    "sweeps": {"", "lab"},
    "register": {"", "words", "report", "assessment", "campaigns", "exports", "limits", "maps", "speeds"},
    "web": set(ROOMS) - {"lab"} | {"", "words", "answers", "report", "figures", "register"},
    "cli": set(ROOMS) | {"", "words", "answers", "report", "figures", "web", "sweeps", "register"},
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


BESIDE = {ROOT / "__init__.py", ROOT / "__main__.py"}
SOURCES = sorted(path for path in ROOT.rglob("*.py") if path not in BESIDE)
NAMES = ROOT / "__init__.pyi"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_rooms_import_as_allowed(path):
    room = room_of(path)
    if room in GROUND:
        rooms = {name.split(".")[1] for name, _ in imports(path) if name.startswith("forcemap.")}
        assert rooms <= {"errors", "arrays"}
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


def loaded_by(code):
    """Modules that a program loads."""
    program = f"{code}\nimport sys\nprint('loaded', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.rpartition("loaded")[2].split())


def rooms_among(modules):
    return {name.split(".")[1] for name in modules if name.startswith("forcemap.")} - GROUND


def test_importing_forcemap_loads_none_of_its_rooms():
    modules = loaded_by("import forcemap")
    assert "numpy" not in modules
    assert not rooms_among(modules)


def test_a_name_loads_what_it_needs_when_it_is_used():
    modules = loaded_by("import forcemap\nforcemap.fit_force_map")
    assert "forcemap.maps.fit" in modules
    assert not {"matplotlib", "pandas", "scipy", *FACE_PACKAGES} & modules


def test_the_list_of_commands_loads_none_of_them():
    modules = loaded_by("from forcemap.cli.app import run\nassert run(['--help']) == 0")
    assert {name for name in modules if name.startswith("forcemap.cli.")} == {"forcemap.cli.app"}
    assert rooms_among(modules) == {"cli"}
    assert not {"numpy", "scipy", "pydantic"} & modules


def test_a_table_of_81_states_is_read_and_fitted_without_spatial_trees():
    code = """
import numpy as np, forcemap as fm
d, h, v = (part.ravel() for part in np.meshgrid(np.linspace(0.4, 1, 9), [0.1, 0.3, 0.5], [0.2, 0.3, 0.4]))
data = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=np.exp(4 + v - d))
assert len(data.train.states) == 81
"""
    assert not {"scipy.spatial", "scipy.sparse"} & loaded_by(code)


def test_a_speed_from_a_map_file_loads_neither_optimiser_nor_other_answers(tmp_path):
    path = tmp_path / "map.json"
    folder = forcemap.copy_example("ur10e", tmp_path / "ur10e")
    forcemap.write_map(forcemap.fit_force_map(forcemap.read_dataset(folder / "impacts.csv")), path)
    line = ["speed", str(path), "--distance", "0.8", "--height", "0.4", "--area", "back_of_hand"]
    line += ["--contact", "transient"]
    modules = loaded_by(f"from forcemap.cli.app import run\nassert run({line!r}) == 0")
    assert not {"scipy.optimize", "scipy.stats", "scipy.spatial"} & modules
    assert not {"forcemap.answers.path", "forcemap.answers.map", "forcemap.answers.evaluate"} & modules
    others = {"paths", "planning", "comparisons", "dynamics", "exports", "figures"}
    assert rooms_among(modules) & others == set()
