"""Docs against code: docstrings, doctests, numbered examples, commands, sample files, tables, the demo's picture."""

from __future__ import annotations

import ast
import csv
import dataclasses
import doctest
import importlib
import inspect
import pkgutil
import re
import runpy
import shlex
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer

import forcemap
from forcemap.campaigns.conditions import read_campaign_file
from forcemap.campaigns.recordings_table import Use
from forcemap.cli import export
from forcemap.cli.app import app, run
from forcemap.comparisons.forms import COMPARED_FORMS
from forcemap.impacts.quality import DOUBTFUL, UNKNOWN_PEAK
from forcemap.maps.forms import FORMS
from forcemap.web import downloads

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "CONTRIBUTING.md"]
MODULES = sorted(module.name for module in pkgutil.walk_packages(forcemap.__path__, "forcemap."))


@pytest.mark.parametrize("name", MODULES)
def test_doctests(name):
    found = doctest.testmod(importlib.import_module(name), raise_on_error=False)
    assert found.failed == 0


PUBLIC = [getattr(forcemap, name) for name in forcemap.__all__ if not name.startswith("__")]
FUNCTIONS = [each for each in PUBLIC if inspect.isfunction(each)]


def test_public_names_exist_and_are_sorted_into_all():
    assert len(set(forcemap.__all__)) == len(forcemap.__all__) <= 125
    contract = """read_dataset ImpactDataset fit_force_map CFM_2D CFM_3D FULL_CUBIC LOG_SPEED published_map ForceMap
    read_map write_map force_map_accuracy FixedMargin ToleranceBound safe_speed SafeSpeed SpeedOutcome Contact
    pfl_speed_limit pfl_contact_force pfl_robot_mass force_limit ForceLimit compare_force_models Comparison
    read_recordings read_recording find_impacts find_impact classify_contact check_impact Verdict plan_measurements
    MeasurementPlan read_campaign build_dataset repeatability"""
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


def page(name):
    return (ROOT / name).read_text()


@pytest.fixture
def workplace(tmp_path, monkeypatch, demo):
    """A folder with what a person at the robot has: impacts, their campaign.toml, a recording, an atlas of one map.

    The example brings a path, a task and a table's path along; beside them lies what `forcemap demo` left.
    """
    monkeypatch.chdir(forcemap.copy_example("ur10e", tmp_path / "campaigns" / "work"))
    shutil.copytree(demo / "cell" / "forcemap-demo-2", "forcemap-demo")
    _, waypoints, log = re.findall(r"```csv\n(.*?)```", page("docs/robot_program.md"), re.S)
    Path("waypoints.csv").write_text(waypoints)
    Path("log.csv").write_text(log)
    Path("study.toml").write_text(re.findall(r"```toml\n(.*?)```", page("docs/sweeps.md"), re.S)[0])
    write_recording(Path("run7.csv"), 300.0, np.random.default_rng(7))
    forcemap.copy_example("ur10e", "cell-7/down")
    shutil.copytree(ROOT / "examples", "examples")


def perform(command):
    """Run a command; whoever plans impacts measures them, too, says in which direction, and collects further ones."""
    code = run(shlex.split(command))
    does, folder = command.split()[:2]
    if does == "plan" or (does in ("next", "confirm") and Path(folder, "recordings").is_dir()):
        stated = Path(folder, "campaign.toml")
        stated.write_text(stated.read_text().replace('# direction = ""', 'direction = "down"'))
        plan = forcemap.read_plan(folder)
        peaks = forcemap.published_map("ur10e").predict(plan.distance, plan.height, plan.speed)
        rng = np.random.default_rng(1)
        for name, peak in zip(plan.recording, peaks, strict=True):
            force = peak * (rng.normal(1, 0.01) if does == "plan" else 0.99)
            if not (recording := Path(folder, "recordings", f"{name}.csv")).exists():
                write_recording(recording, force, rng)
        assert does == "plan" or run(["collect", folder]) == 0
    return code


def write_recording(path, peak, rng):
    """A half-sine of 30 ms, as a device with a range of 500 N writes it."""
    time = np.arange(900) / 1000
    force = peak * np.sin(np.pi * np.clip((time - 0.1005) / 0.03, 0, 1)) + rng.normal(0, 0.4, time.size)
    rows = zip(1000 * time, np.minimum(force, 500), strict=True)
    path.write_text("time_ms,force_N\n" + "".join(f"{t:.1f},{f:.1f}\n" for t, f in rows))


DOCUMENTED = (("README.md", "docs/commands.md"), ("docs/robot_program.md",), ("docs/your_device_files.md",))
"""Pages whose commands run in one workplace, one after the other; what two of them show runs once."""


def commands_of(name):
    """The commands that a page shows, but for demo and serve, which other tests run."""
    return re.findall(r"^    forcemap ((?!demo\b|serve\b).*)$", page(name), re.M)


@pytest.mark.parametrize("names", DOCUMENTED, ids=" ".join)
def test_the_documented_commands_run_and_print_what_is_shown(names, workplace, capsys):
    done, printed = set(), ""
    for name in names:
        commands = commands_of(name)
        assert len(commands) >= 6
        for command in dict.fromkeys(commands):
            if command not in done:
                assert perform(command) in (0, 1), (command, capsys.readouterr().err)
        done |= {*commands}
        printed += capsys.readouterr().out
        for shown in re.findall(r"```text\n(.*?)```", page(name), re.S):
            assert shown in printed


def test_the_documented_python_runs(monkeypatch, capsys, example_folders):
    monkeypatch.chdir(example_folders["ur10e"])
    (code,) = re.findall(r"```python\n(.*?)```", page("docs/commands.md"), re.S)
    exec(code, {})
    assert "admissible" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["universal_robots", "kuka"])
def test_the_commands_for_a_controller_run_in_the_folder_that_they_name(name, monkeypatch, demo, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(demo / "cell" / "forcemap-demo-2", "my-campaign")
    commands = re.findall(r"^ +forcemap (.*)$", page(f"docs/{name}.md"), re.M)
    assert len(commands) >= 2
    for command in commands:
        assert run(shlex.split(command)) in (0, 1), (command, capsys.readouterr().err)
        written = Path(command.rpartition(" -o ")[2])
        assert written.exists(), command
    numbers = {"kuka": r"CP = ([\d.]+)\s+LIN \{X ([\d.]+), Y ([\d.]+), Z ([\d.]+)\}(?: C_DIS|$)", "universal_robots":
               r"movel\(p\[([\d.]+), ([\d.]+), ([\d.]+), .*v = ([\d.]+)(?:, r|\)$)"}  # fmt: skip
    shown = [[float(each) for each in found] for found in re.findall(numbers[name], page(f"docs/{name}.md"), re.M)]
    shown = [[*(each / 1000 for each in where), v] for v, *where in shown] if name == "kuka" else shown
    path = ["my-campaign/path.csv", "--task", "my-campaign/task.toml", "--format", "scaling", "-o", "rows.csv"]
    assert run(["export-path", "my-campaign", *path]) == 0
    rows = csv.DictReader(line for line in Path("rows.csv").read_text().splitlines() if not line.startswith("#"))
    columns = ("to_x_m", "to_y_m", "to_z_m", "commanded_speed_mps")
    assert shown == [[float(row[key]) for key in columns] for row in rows if row["segment"] == "place"]


def test_the_documented_figures_are_all_there_are_and_are_drawn(monkeypatch, demo, tmp_path):
    from forcemap import figures
    from forcemap.cli.drawings import Kind

    monkeypatch.chdir(tmp_path)
    shutil.copytree(demo / "cell" / "forcemap-demo-2", "forcemap-demo")
    (code,) = re.findall(r"```python\n(.*?)```", page("docs/drawing.md"), re.S)
    exec(code, {})
    assert {path.stem for path in Path().glob("*.pdf")} == {*map(str, Kind), "comparison-of-maps"}
    assert {name for name in figures.__all__ if name.endswith("_figure") and name not in code} == set()


def test_the_python_of_the_papers_page_makes_its_folders_and_prints_the_published_coefficients(
    monkeypatch, tmp_path, capsys
):
    monkeypatch.chdir(tmp_path)
    folders, coefficients = re.findall(r"```python\n(.*?)```", page("docs/paper.md"), re.S)
    exec(folders, {})
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}-impacts" for name in forcemap.EXAMPLE_CAMPAIGNS}
    exec(coefficients, {})
    printed = capsys.readouterr().out
    for name in forcemap.PUBLISHED_MAPS:
        (line,) = re.findall(rf"^{name} (.*)$", printed, re.M)
        assert list(ast.literal_eval(line).values()) == forcemap.published_map(name).coefficients.tolist()


def test_the_papers_page_shows_what_its_commands_print(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    exec(re.findall(r"```python\n(.*?)```", page("docs/paper.md"), re.S)[0], {})
    shown = re.findall(r"^    forcemap ([^\n]+)\n\n```text\n(.*?)\n```$", page("docs/paper.md"), re.M | re.S)
    assert len(shown) >= 7
    for command, text in shown:
        assert run(shlex.split(command)) in (0, 1)
        assert re.sub(r"^\.\.\.\n|\n\.\.\.$", "", text) in capsys.readouterr().out, command


def test_the_documented_demo_is_what_the_demo_prints(demo):
    printed = (demo / "printed.txt").read_text()
    (shown,) = re.findall(r"<!-- demo:start -->\n\n(.*?)\n\n<!-- demo:end -->", page("docs/commands.md"), re.S)
    shown = re.sub(r"^    ", "", shown, flags=re.M)
    assert shown in printed
    assert "the standard's contact model: 0.263 m/s everywhere" in printed


def test_what_the_readme_says_of_the_benefit_follows_from_what_it_shows():
    """Forces and speeds in its sentences are those of the commands beside them, which run above."""
    text = " ".join(page("README.md").split())
    standard, highest = (float(figure) for figure in re.findall(r"(0\.\d+) m/s (?:everywhere|at contact)", text))
    assert highest / standard == pytest.approx(4 / 3, abs=0.01)
    assert "a third faster" in text
    low, most = re.search(r"the map predicts (\d+) to (\d+) N at it", text).groups()
    assert int(low) < 280 < int(most)
    assert f"Up to {most} N where 280 N are allowed" in text
    here, there = (float(figure) for figure in re.findall(r"(?:best:|speeds,) (\d\.\d+) s at", text))
    assert f"takes {100 * (1 - here / there):.0f} % less time" in text


def test_every_command_is_documented_and_every_example_in_a_help_text_runs(workplace, capsys):
    """Those that a page shows word for word run with their page, above; but what others need runs here, too.

    The page of commands names every command: the README is one page long, and names the few to begin with.
    """
    shown = {command for names in DOCUMENTED for name in names for command in commands_of(name)}
    shown -= {"collect my-campaign"}
    commands = typer.main.get_command(app).commands
    assert len(commands) > 20
    for command in commands.values():
        assert f"forcemap {command.name}" in page("docs/commands.md")
        (example,) = re.findall(r"Example: forcemap (.*?)(?:\n\n|\Z)", inspect.cleandoc(command.help), re.S)
        if example in shown:
            continue
        if command.name == "serve":  # until it is interrupted: test_web.py
            continue
        if re.fullmatch(r"demo [\w-]+", example):  # with a folder, too: test_cli.py
            continue
        assert perform(example) in (0, 1), (example, capsys.readouterr().err)
    capsys.readouterr()


@pytest.mark.parametrize("path", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#]+)\)", path.read_text()):
        assert (path.parent / target).exists(), target


def first_cells(name, heading):
    """The names in the first column of the tables below a heading."""
    (section,) = re.findall(rf"^#+ {re.escape(heading)}\n(.*?)(?=^#+ |\Z)", page(name), re.M | re.S)
    cells = re.findall(r"^\| (`[^|]*?) \|", section, re.M)
    return [found for cell in cells for found in re.findall(r"`([\w.]+)`", cell)]


def test_the_documented_columns_are_those_that_are_read_and_written(workplace, capsys):
    from forcemap.campaigns.columns import COLUMNS

    perform("plan my-campaign --distances-m 0.5,0.9 --heights-m 0.1,0.5 --speeds-mps 0.1,0.3 --device-range-N 500")
    perform("collect my-campaign")
    capsys.readouterr()
    files = ("plan.csv", "recordings.csv", "impacts.csv")
    headers = {name: Path("my-campaign", name).read_text().splitlines()[0].split(",") for name in files}
    headers["recordings.csv"].remove("contact.direction")  # as campaign.toml calls it
    for name in ("plan.csv", "recordings.csv"):
        assert sorted(first_cells("docs/campaign_file.md", name)) == sorted(headers[name])
    documented = first_cells("docs/impacts_table.md", "impacts.csv")
    assert set(documented) == {*COLUMNS, *headers["impacts.csv"]}


def test_the_documented_flags_uses_and_interpretations_are_those_of_the_code():
    flags = [flag.value for flag in forcemap.Quality]
    assert sorted(first_cells("docs/your_device_files.md", "Quality flags")) == sorted(flags)
    for use in Use:
        assert f"`{use}`" in page("docs/campaign_file.md")
    for each in [*forcemap.Interpretation, *forcemap.ContactScenario, *forcemap.VerdictOutcome]:
        name = each.value if isinstance(each, forcemap.Interpretation) else each.value.replace("_", " ")
        assert re.search(rf"^\| `?{name}`? \|", page("docs/your_device_files.md"), re.M), name


def test_the_flags_said_not_to_be_used_are_those_of_an_unknown_peak():
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\| ([^|]*) \|", page("docs/your_device_files.md"), re.M)
    becomes = {name: words for name, words in rows if name in {*forcemap.Quality}}
    assert {name for name, words in becomes.items() if words == "not used"} == {*UNKNOWN_PEAK}
    closed = {name for name, words in becomes.items() if "never within a limit" in words}
    assert closed == {*DOUBTFUL} - {*UNKNOWN_PEAK, forcemap.Quality.SATURATED}


def test_every_form_of_a_map_is_named_where_forms_are_chosen(capsys):
    assert run(["fit", "--help"]) == 0
    offered, documented = capsys.readouterr().out, first_cells("docs/forms.md", "Forms")
    for form in FORMS:
        assert form.name in offered
        assert form.name in documented
        assert getattr(forcemap, form.name) is form
        assert form in COMPARED_FORMS


def test_command_page_and_documentation_offer_the_same_files_for_robots():
    commands = {form.value for form in export.Format}
    assert {form.partition("-")[0] for form in downloads.Format} == commands
    (section,) = re.findall(r"^## What the robot takes\n(.*?)^## ", page("docs/robot_program.md"), re.M | re.S)
    rows = ", ".join(re.findall(r"^\| ([a-z, ]+) \|", section, re.M)).split(", ")
    assert commands | {form.value for form in export.PathFormat} == {*rows} - {"format"}


def toml_blocks(path):
    return [
        text
        for text in re.findall(r"```toml\n(.*?)```", path.read_text(), re.S)
        if not re.search("forcemap-(task|study)", text)
    ]


BLOCKS = [pytest.param(text, id=f"{path.name}-{i}") for path in PAGES for i, text in enumerate(toml_blocks(path), 1)]


@pytest.mark.parametrize("text", BLOCKS)
def test_every_documented_campaign_file_is_read(text, tmp_path):
    schema = "" if "schema" in text else 'schema = "forcemap-campaign/1"\n'
    (tmp_path / "campaign.toml").write_text(schema + text)
    _, columns = read_campaign_file(tmp_path / "campaign.toml")
    assert columns is not None


def test_every_entry_of_task_toml_is_documented(tmp_path):
    from forcemap.paths.task import _KEYS, _SEGMENT_KEYS

    assert set(first_cells("docs/robot_program.md", "task.toml")) == {*_KEYS, *_SEGMENT_KEYS}
    (text,) = re.findall(r"```toml\n(.*?)```", page("docs/robot_program.md"), re.S)
    (tmp_path / "task.toml").write_text(text)
    assert len(forcemap.read_task(tmp_path / "task.toml").segments) == 4


def test_the_path_and_the_task_of_the_examples_are_those_that_are_shown(demo):
    program, made = page("docs/robot_program.md"), demo / "cell" / "forcemap-demo-2"
    for kind, name in (("csv", "path.csv"), ("toml", "task.toml")):
        assert (made / name).read_text() == re.search(rf"```{kind}\n(.*?)```", program, re.S)[1]


def test_every_entry_of_a_logs_column_map_is_documented():
    from forcemap.paths.pose_log import LOG_ENTRIES

    assert set(first_cells("docs/robot_program.md", "A controller's log")) == {*LOG_ENTRIES} - {"sampling_rate_Hz"}


def test_every_entry_of_campaign_toml_is_documented():
    from forcemap.campaigns.conditions import ENTRIES
    from forcemap.recordings.column_map import KEYS

    fields = {field.name for field in dataclasses.fields(forcemap.Conditions)}
    assert {name.partition(".")[0] for name, _ in ENTRIES.values()} == fields - {"devices"}  # tables of their own
    known = {"schema", *ENTRIES}
    assert set(first_cells("docs/campaign_file.md", "campaign.toml")) == known | {f"recordings.{key}" for key in KEYS}
    (text,) = toml_blocks(ROOT / "docs" / "campaign_file.md")
    shown = tomllib.loads(text)
    for entry in ENTRIES:
        section, _, key = entry.rpartition(".")
        assert key in (shown[section] if section else shown), key


SAMPLES = re.findall(r"```csv\n(.*?)```.*?```toml\n(.*?)```", page("docs/your_device_files.md"), re.S)


@pytest.mark.parametrize(("sample", "description"), SAMPLES, ids=range(len(SAMPLES)))
def test_every_documented_sample_is_read_as_described(sample, description, tmp_path):
    """Every sample ends with a force of about 35 N, after 1 or 2 ms, whatever its units."""
    (tmp_path / "run.csv").write_text(sample)
    for recording in forcemap.read_recordings(tmp_path / "run.csv", columns=tomllib.loads(description)["recordings"]):
        force = recording.force if recording.direction is None else recording.force @ np.array(recording.direction)
        assert 34 < force[-1] < 36
        assert recording.time[-1] == pytest.approx(0.001 * (recording.samples - 1))


def test_a_documented_sample_needs_no_description(tmp_path):
    (tmp_path / "run.csv").write_text(SAMPLES[0][0])
    assert forcemap.read_recording(tmp_path / "run.csv").force[-1] == 35.1


def test_every_column_of_contact_points_and_entry_of_the_protocol_is_documented(tmp_path):
    from forcemap.assessment.contact_points import COLUMNS, REQUIRED, read_contact_points
    from forcemap.campaigns.protocol import PROTOCOL_ENTRIES

    text = page("docs/contact_points.md")
    assert set(first_cells("docs/contact_points.md", "contact_points.csv")) == set(COLUMNS)
    assert set(re.findall(r"`(\w+)`(?:, `\w+`)* \| yes", text)) == set(REQUIRED)
    assert set(re.findall(r"`protocol\.(\w+)`", text)) == set(PROTOCOL_ENTRIES)
    (shown,) = re.findall(r"```text\n(point_id.*?)```", text, re.S)
    (tmp_path / "contact_points.csv").write_text(shown)
    assert [point.name for point in read_contact_points(tmp_path / "contact_points.csv")] == ["P1", "P2"]
