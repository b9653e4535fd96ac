"""One shape for every answer: what a command prints with --json is what the page answers to the same question."""

from __future__ import annotations

import importlib
import json
import math
import pkgutil

import pytest

import forcemap as fm
from forcemap import answers
from forcemap.answers.answer import Answer
from web_server import client_of

for module in pkgutil.iter_modules(answers.__path__, "forcemap.answers."):
    importlib.import_module(module.name)


def answers_of(kind):
    return [each for part in kind.__subclasses__() for each in (part, *answers_of(part))]


MODELS = sorted({each for each in answers_of(Answer) if each.__module__.startswith("forcemap.answers.")}, key=str)
AREA = ("--area", "back_of_hand", "--contact")


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served")
    for name in ("ur10e", "kuka-iiwa7-30nm"):
        fm.copy_example(name, folder / name)
    (folder / "path.csv").write_text("x_m,y_m,z_m,segment\n0.8,0,0.44,path\n0.8,0,0.2,path\n")
    return folder


@pytest.fixture(scope="module")
def client(campaigns):
    with client_of(campaigns) as found:
        yield found


def test_every_figure_of_a_place_stands_under_its_key(campaigns, ask):
    """Beside the same places asked for one by one."""
    folder = campaigns / "ur10e"
    code, answer = ask("speed-map", folder, "--step-m", "0.1", *AREA, "transient")
    assert code == 0
    force_map = fm.fit_force_map(fm.read_dataset(folder))
    bound = fm.ToleranceBound(device_error=force_map.conditions.device.error_or_default)
    keys = {"speed_mps": "speed", "speed_to_program_mps": "speed_to_program", "predicted_force_N": "predicted_force"}
    keys |= {"bound_force_N": "bound_force", "extrapolated_speed_mps": "extrapolated_speed"}
    keys |= {f"{end}_measured_speed_mps": f"{end}_measured_speed" for end in ("lowest", "highest")}
    found = set()
    for place in answer["places"]:
        where, limit = (place["distance_m"], place["height_m"]), fm.force_limit("back_of_hand")
        speed = fm.safe_speed(
            force_map, *where, limit=limit, bound=bound, contact=fm.Contact.TRANSIENT, allowance=fm.Allowance()
        )
        found.add(place["outcome"])
        for key, name in keys.items():
            expected = float(getattr(speed, name))
            assert place[key] == (None if math.isnan(expected) else pytest.approx(expected, rel=1e-9)), (where, key)
    assert len(found) > 1


QUESTIONS = {
    "fit": (("fit", "{folder}"), "map", {}),
    "evaluate": (("evaluate", "{folder}"), "evaluate", {}),
    "compare": (("compare", "{folder}", "--area", "hand_fingers"), "compare", {"area": "hand_fingers"}),
    "compare, a free chest": (
        ("compare", "{folder}", "--region", "chest", "--body", "free", "--moving-mass-kg", "25", "--payload-kg", "2"),
        "compare",
        {"area": "chest", "body": "free", "moving_mass_kg": 25, "payload_kg": 2},
    ),
    "compare, the head": (("compare", "{folder}", "--region", "face"), "compare", {"area": "face"}),
    "speed": (
        ("speed", "{folder}", "--distance", "0.8", "--height", "0.4", *AREA, "transient"),
        "speed",
        {"distance_m": 0.8, "height_m": 0.4, "contact": "transient"},
    ),
    "speed, unconfirmed": (
        ("speed", "{folder}", "--distance", "0.8", "--height", "0.4", *AREA, "quasi-static"),
        "speed",
        {"distance_m": 0.8, "height_m": 0.4, "contact": "quasi-static"},
    ),
    "speed, outside, with a margin": (
        ("speed", "{folder}", "--distance", "2", "--height", "0.4", *AREA, "transient", "--bound", "margin"),
        "speed",
        {"distance_m": 2, "height_m": 0.4, "contact": "transient", "bound": "margin"},
    ),
    "speed, the head": (
        ("speed", "{folder}", "--distance", "0.8", "--height", "0.4", "--area", "face", "--contact", "transient"),
        "speed",
        {"area": "face", "distance_m": 0.8, "height_m": 0.4, "contact": "transient"},
    ),
    "speed map": (
        ("speed-map", "{folder}", *AREA, "transient", "--step-m", "0.1", "--bound", "tolerance:0.9/0.99"),
        "speed-map",
        {"contact": "transient", "step_m": 0.1, "confidence": 0.9, "content": 0.99},
    ),
    "speed map, the head": (
        ("speed-map", "{folder}", "--area", "face", "--contact", "transient", "--step-m", "0.1"),
        "speed-map",
        {"area": "face", "contact": "transient", "step_m": 0.1},
    ),
    "path": (
        ("path", "{folder}", "{path}", *AREA, "transient", "--overshoot-mps", "0.02", "--acceleration-mps2", "2"),
        "path",
        {"points": "0.8,0.44;0.8,0.2", "contact": "transient", "overshoot_mps": 0.02, "acceleration_mps2": 2},
    ),
}


@pytest.mark.parametrize("name", ["ur10e", "kuka-iiwa7-30nm"])
@pytest.mark.parametrize(("command", "page", "query"), QUESTIONS.values(), ids=QUESTIONS)
def test_a_command_and_the_page_answer_alike(forcemap, client, campaigns, name, command, page, query):
    words = [word.format(folder=campaigns / name, path=campaigns / "path.csv") for word in command]
    code, out, _ = forcemap(*words, "--json")
    assert code in (0, 1)
    served = client.get(f"/api/campaigns/{name}/{page}", params={"area": "back_of_hand"} | query)
    assert served.status_code == 200, served.text
    assert served.json() == json.loads(out)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_every_answer_has_a_schema_with_units_in_its_keys(model):
    schema = model.model_json_schema(mode="serialization")
    for part in (schema, *schema.get("$defs", {}).values()):
        assert part["description"], part["title"]
    parts = (schema, *schema.get("$defs", {}).values())
    figures = [part.get("properties", {}).items() for part in parts]
    keys = {key for part in figures for key, said in part if '"number"' in json.dumps(said)}
    for quantity in ("speed", "distance", "height", "force", "limit", "length", "margin"):
        assert quantity not in keys - {"limit"}


def test_errors_are_alike(forcemap, client, campaigns):
    words = ("speed", campaigns / "ur10e", "--distance", "0.8", "--height", "0.4", "--area", "hnad")
    _, out, _ = forcemap(*words, "--contact", "transient", "--json")
    query = {"distance_m": 0.8, "height_m": 0.4, "area": "hnad"}
    assert client.get("/api/campaigns/ur10e/speed", params=query).json() == json.loads(out)


COMMANDS = (
    ("fit", "{folder}"),
    ("select", "{folder}"),
    ("evaluate", "{folder}"),
    ("evaluate", "{folder}", "--forms"),
    ("compare", "{folder}", "--area", "chest"),
    ("compare", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm"),
    ("limits", "--moving-mass-kg", "30"),
    ("estimate", "{folder}", "--distance", "0.8", "--height", "0.4", "--speed-mps", "0.25", "--area", "chest"),
    ("speed", "{folder}", "--distance", "0.8", "--height", "0.4", *AREA, "transient"),
    ("speed-map", "{folder}", *AREA, "transient"),
    ("path", "{folder}", "{path}", *AREA, "transient"),
    ("place", "ur10e", "{path}", *AREA, "transient", "--step-m", "0.2"),
)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command[:1] + command[2:3]))
def test_no_line_is_wider_than_100_columns(forcemap, campaigns, command):
    words = [word.format(folder=campaigns / "ur10e", path=campaigns / "path.csv") for word in command]
    out = forcemap(*words)[1]
    assert max(map(len, out.splitlines())) <= 100


def test_no_command_of_these_has_more_than_15_options():
    import typer

    from forcemap.cli.app import app

    commands = typer.main.get_command(app).commands
    for name in (
        "fit",
        "evaluate",
        "compare",
        "limits",
        "speed",
        "speed-map",
        "path",
        "place",
        "export",
        "export-path",
        "estimate",
    ):
        assert len([each for each in commands[name].params if each.name != "help"]) <= 15, name


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("--area", "140", "--contact", "transient"), "newtons are --limit-N"),
        (("--limit-N", "palm"), "found palm, expected newtons"),
        (
            ("--area", "palm", "--region", "chest", "--contact", "transient"),
            "found --area palm and chest",
        ),
        (("--area", "palm", "--limit-N", "140", "--contact", "transient"), "expected one of --area or --limit-N"),
        (("--limit-table", "palm", "--contact", "transient"), "expected .csv"),
        (("--limit-N", "200", "--bound", "tolerance:0.9"), "expected two figures"),
        (("--limit-N", "200", "--bound", "median"), "expected tolerance"),
    ],
)
def test_a_limit_is_named_once_and_as_it_is_spelled(forcemap, arguments, part):
    code, _, err = forcemap("speed", "ur10e", "--distance", "0.8", "--height", "0.4", *arguments)
    assert code == 2
    assert part in err
