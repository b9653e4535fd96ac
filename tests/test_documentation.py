"""Docs against code: docstrings, doctests, numbered examples, the README's commands and its picture of the demo."""

from __future__ import annotations

import dataclasses
import doctest
import importlib
import inspect
import pkgutil
import re
import runpy
import shlex
from pathlib import Path

import pytest

import forcemap
from forcemap.cli.app import app, run

ROOT = Path(__file__).parents[1]
MODULES = sorted(module.name for module in pkgutil.walk_packages(forcemap.__path__, "forcemap."))


@pytest.mark.parametrize("name", MODULES)
def test_doctests(name):
    found = doctest.testmod(importlib.import_module(name), raise_on_error=False)
    assert found.failed == 0


PUBLIC = [getattr(forcemap, name) for name in forcemap.__all__ if not name.startswith("__")]
FUNCTIONS = [each for each in PUBLIC if inspect.isfunction(each)]


def test_public_names_exist_and_are_sorted_into_all():
    assert len(set(forcemap.__all__)) == len(forcemap.__all__)
    contract = """read_dataset ImpactDataset fit_force_map CFM_2D CFM_3D FULL_CUBIC LOG_SPEED published_map ForceMap
    read_map write_map force_map_accuracy FixedMargin ToleranceBound safe_speed SafeSpeed SpeedOutcome Contact
    pfl_speed_limit pfl_contact_force pfl_robot_mass force_limit ForceLimit compare_force_models Comparison"""
    assert set(contract.split()) <= set(forcemap.__all__)


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_public_docstrings_parse(function):
    """One sentence first; every parameter named, if there is a section of parameters; an error class that exists."""
    text = inspect.getdoc(function)
    assert text
    first = text.split("\n\n")[0]
    assert first.endswith((".", "*")), first
    parameters = set(inspect.signature(function).parameters)
    section = re.search(r"Parameters\n-+\n(.*?)(\n\n[A-Z][a-z]+\n-+|\Z)", text, re.S)
    if section:
        named = {name.strip() for line in re.findall(r"^(\w[\w, ]*) : ", section[1], re.M) for name in line.split(",")}
        assert named == parameters
    else:
        assert len(parameters) <= 3 or "arguments" in text
    raises = re.search(r"Raises\n-+\n(.*?)(\n\n[A-Z][a-z]+\n-+|\Z)", text, re.S)
    if raises:
        errors = importlib.import_module("forcemap.errors")
        for name in re.findall(r"^(\w+)$", raises[1], re.M):
            assert hasattr(errors, name)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.name)
def test_numbered_examples_run(path, capsys):
    assert re.match(r"\d{3}_", path.name)
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out


def readme():
    return (ROOT / "README.md").read_text()


def test_the_readmes_commands_run(tmp_path, monkeypatch, capsys, example_folders):
    monkeypatch.chdir(example_folders["ur10e"])
    before = set(Path().iterdir())
    commands = re.findall(r"^    \.venv/bin/forcemap (.*)$", readme(), re.M)
    assert len(commands) >= 6
    try:
        for command in commands:
            assert run(shlex.split(command)) in (0, 1), command
    finally:
        for path in set(Path().iterdir()) - before:
            path.unlink()
    capsys.readouterr()


def test_the_readmes_python_runs(monkeypatch, capsys, example_folders):
    monkeypatch.chdir(example_folders["ur10e"])
    (code,) = re.findall(r"```python\n(.*?)```", readme(), re.S)
    exec(code, {})
    assert "admissible" in capsys.readouterr().out


def test_the_readmes_demo_is_what_the_demo_prints(tmp_path, capsys):
    assert run(["demo", str(tmp_path / "demo")]) == 0
    printed = capsys.readouterr().out
    (shown,) = re.findall(r"<!-- demo:start -->\n\n(.*?)\n\n<!-- demo:end -->", readme(), re.S)
    shown = re.sub(r"^    ", "", shown, flags=re.M)
    assert shown in printed
    assert "the standard's contact model: 0.263 m/s everywhere" in printed


def test_every_command_is_in_the_readme_and_every_example_in_a_help_text_runs(monkeypatch, capsys, example_folders):
    monkeypatch.chdir(example_folders["ur10e"])
    before = set(Path().iterdir())
    for command in app.registered_commands:
        assert f"forcemap {command.name}" in readme() or command.name == "demo"
        (example,) = re.findall(r"Example: forcemap (.*)", inspect.getdoc(command.callback))
        code = run(shlex.split(example))
        assert code in (0, 1), (example, capsys.readouterr().err)
    for path in set(Path().iterdir()) - before:
        import shutil

        shutil.rmtree(path) if path.is_dir() else path.unlink()


@pytest.mark.parametrize("path", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "CONTRIBUTING.md"])
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#]+)\)", path.read_text()):
        assert (path.parent / target).exists(), target


def test_the_documented_columns_are_those_that_are_read():
    from forcemap.campaigns.columns import COLUMNS

    documented = re.findall(r"`(\w+)`", "\n".join(
        line for line in (ROOT / "docs" / "impacts_table.md").read_text().splitlines() if line.startswith("| `")
    ))  # fmt: skip
    assert set(COLUMNS) <= set(documented)


def test_the_documented_campaign_file_is_read(tmp_path):
    from forcemap.campaigns.conditions import _ENTRIES, read_conditions

    (text,) = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "impacts_table.md").read_text(), re.S)
    (tmp_path / "campaign.toml").write_text(text)
    assert read_conditions(tmp_path / "campaign.toml").device.range == 500
    fields = {field.name for field in dataclasses.fields(forcemap.Conditions)}
    assert {name.partition(".")[0] for name in _ENTRIES.values()} == fields
    for _, key in _ENTRIES:
        assert re.search(rf"^{key} = ", text, re.M), key
