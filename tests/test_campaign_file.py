"""Entries of a campaign.toml changed by the page: in the text, through the reader's checks, under the binding."""

from __future__ import annotations

import json
import shutil
import tomllib

import pytest
from hypothesis import given, settings, strategies as st

import forcemap as fm
from forcemap.campaigns.conditions import ENTRIES
from forcemap.campaigns.template import campaign_text
from forcemap.web.campaign_file import with_entries
from web_server import client_of, contents

TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), min_size=1, max_size=30)
VALUES = st.one_of(st.none(), TEXTS, st.floats(-1e6, 1e6), st.lists(st.integers(1, 40), min_size=1, max_size=3))
KEYS = [tuple(entry.rpartition(".")[::2]) for entry in ENTRIES] + [("recordings", "force"), ("protocol", "cell")]
WRITTEN = """# by hand
schema = "forcemap-campaign/1"
note = "a # in a text"  # a remark

[robot]   # ours
model = 'UR10e'   # 'quoted'
# firmware = ""  # version

[[devices]]
recordings = "*"
range_N = 500.0

[standard]
edition = "ISO/TS 15066:2016"
"""


@given(changes=st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=6))
@settings(max_examples=60, deadline=None)
@pytest.mark.parametrize("text", [campaign_text(fm.Conditions(robot="UR10e", payload=1.2)), WRITTEN])
def test_entries_are_changed_and_nothing_else(text, changes):
    expected = tomllib.loads(text)
    for (table, key), value in changes.items():
        inside = expected.setdefault(table, {}) if table else expected
        inside.pop(key, None)
        if value is not None:
            inside[key] = value
    changed = with_entries(text, changes)
    found = tomllib.loads(changed)
    assert {name: item for name, item in found.items() if item != {}} == {
        name: item for name, item in expected.items() if item != {}
    }
    for remark in ("# by hand", "# a remark", "# ours"):
        assert (remark in changed) == (remark in text)
    assert with_entries(changed, changes) == changed


def test_remarks_stay_and_hints_are_filled_in():
    changed = with_entries(WRITTEN, {("robot", "firmware"): "5.15", ("robot", "model"): "UR5e", ("", "note"): None})
    assert 'firmware = "5.15"  # version' in changed
    assert "model = \"UR5e\"  # 'quoted'" in changed
    assert '# note = ""  # a remark' in changed


@pytest.mark.parametrize(
    "text", ['[robot]\nmodel = """\n[tool]\nname = "x"\n"""\n', 'robot.model = "UR10e"\n', 'robot = { model = "x" }\n']
)
def test_what_cannot_be_changed_safely_is_refused(text):
    with pytest.raises(fm.InputError, match="change it in an editor"):
        with_entries(text, {("tool", "name"): "gripper", ("robot", "model"): "UR5e"})


@pytest.fixture(scope="module")
def served(simulated, tmp_path_factory):
    folder = tmp_path_factory.mktemp("served") / "lab"
    shutil.copytree(simulated, folder)
    with client_of(folder) as client:
        yield client, folder


def changed(client, looked_at=None, way="", **what):
    looked_at = looked_at or client.get("/api/campaigns/lab/conditions").json()["looked_at"]
    return client.post(f"/api/campaigns/lab/conditions{way}", json={"looked_at": looked_at} | what)


def test_an_entry_is_checked_by_the_reader_and_written(served):
    client, folder = served
    before = contents(folder)
    for entries, column in (
        *(({"device.range_N": text}, "device.range_N") for text in ("1_000", "\u0665\u0660", "nan", "inf", "1e400")),
        ({"date": "yesterday"}, "date"),
        ({"device.range_N": "many"}, "device.range_N"),
        ({"robot.speed_error": "7"}, "speed_error"),
        ({"contact.speed": "guessed"}, "contact.speed"),
        ({"simulated": "false"}, "simulated"),
        ({"robot.modell": "x"}, "robot.modell"),
        ({"operator": "x", "protocol.device_certificate_date": "soon"}, "protocol.device_certificate_date"),
    ):
        answer = changed(client, entries=entries)
        assert answer.status_code == 422
        error = answer.json()["error"]
        assert column in f"{error['column']} {error['message']}"
        assert ".forcemap" not in answer.text
    assert contents(folder) == before
    answer = changed(client, entries={"operator": "B. Jones", "robot.firmware": "5.15", "protocol.cell": "cell 7"})
    assert answer.json() | {"looked_at": ""} == {"written": True, "binding": "", "looked_at": ""}
    conditions = fm.read_conditions(folder / "campaign.toml")
    assert (conditions.operator, conditions.firmware) == ("B. Jones", "5.15")
    assert 'cell = "cell 7"' in (folder / "campaign.toml").read_text()
    changed(client, entries={"operator": "", "robot.firmware": "", "protocol.cell": ""})
    assert fm.read_conditions(folder / "campaign.toml").firmware == ""
    assert {path for path, content in contents(folder).items() if before.get(path) != content} == {
        path for path in before if path.name == "campaign.toml"
    }


def test_what_binds_recordings_is_not_changed_in_passing(served):
    client, folder = served
    file, kept = folder / "campaign.toml", (folder / "campaign.toml").read_text()
    lines = {
        line["entry"]: line
        for table in client.get("/api/campaigns/lab/conditions").json()["tables"].values()
        for line in table
    }
    assert (lines["robot.model"]["binds"], lines["operator"]["binds"]) == (90, 0)
    spring, mass = lines["device.stiffness_N_per_m"], lines["robot.moving_mass_kg"]
    assert [(each["words"], each["unit"]) for each in (spring, mass)] == [("stiffness", "N/m"), ("moving mass", "kg")]
    answer = changed(client, entries={"robot.model": "another robot"}).json()
    assert not answer["written"]
    assert "robot.model was 'virtual ur10e-like' when 90 of the recordings" in answer["binding"]
    assert file.read_text() == kept
    answer = changed(client, entries={"robot.model": "another robot"}, confirmed=True).json()
    assert answer["written"]
    assert "another robot" in answer["binding"]
    speed = client.get("/api/campaigns/lab/speed?area=back_of_hand&distance_m=0.8&height_m=0.4").json()
    assert (speed["outcome"], speed["speed_mps"]) == ("unconfirmed", None)
    assert changed(client, entries={"operator": "C"}).json()["written"]  # what no longer fits was said, and stays
    answer = changed(client, entries={"robot.model": "virtual ur10e-like"}).json()
    assert (answer["written"], answer["binding"]) == (True, "")
    speed = client.get("/api/campaigns/lab/speed?area=back_of_hand&distance_m=0.8&height_m=0.4").json()
    assert speed["outcome"] == "admissible"
    file.write_text(kept)


def test_a_file_that_was_changed_meanwhile_is_left_alone(served):
    client, folder = served
    kept = (folder / "campaign.toml").read_text()
    looked_at = client.get("/api/campaigns/lab/conditions").json()["looked_at"]
    (folder / "campaign.toml").write_text(f"{kept}# somebody else\n")
    answer = changed(client, looked_at, entries={"operator": "D"})
    assert (answer.status_code, answer.json()["error"]["kind"]) == (409, "changed")
    assert (folder / "campaign.toml").read_text() == f"{kept}# somebody else\n"
    (folder / "campaign.toml").write_text(kept)


def test_no_other_site_changes_an_entry(served):
    client, folder = served
    kept = (folder / "campaign.toml").read_text()
    for headers in ({"origin": "http://evil.example"}, {"sec-fetch-site": "cross-site"}):
        for way in ("", "/recordings"):
            answer = client.post(f"/api/campaigns/lab/conditions{way}", json={}, headers=headers)
            assert (answer.status_code, answer.json()["error"]["kind"]) == (403, "origin")
    assert (folder / "campaign.toml").read_text() == kept


def test_columns_are_seen_tried_and_written(served):
    client, folder = served
    kept = (folder / "campaign.toml").read_text()
    recording = next(path for path in sorted((folder / "recordings").iterdir()) if "v200" in path.name)
    rows = [line.split(",") for line in recording.read_text().splitlines() if line[:1].isdigit()]
    numbers = "\n".join(f"{time};21.5;{force}" for time, force in rows)
    content = f"Device 7;;\nZeit [ms];Temp;Kraft [N]\n{numbers}\n"
    plain = {"content-type": "application/octet-stream"}
    seen = client.post("/api/campaigns/lab/columns?file=run.csv", content=content, headers=plain).json()
    assert (seen["names"], seen["units"]) == (["Zeit [ms]", "Temp", "Kraft [N]"], ["ms", "", "N"])
    assert seen["delimiter"] == "semicolon"
    assert next(line["cells"] for line in seen["lines"] if line["numbers"]) == [rows[0][0], "21.5", rows[0][1]]
    tried = {"time": "Zeit [ms]", "time_unit": "ms", "force": "Kraft [N]"}
    asked = {"file": "run.csv", "columns": json.dumps(tried)}
    judged = client.post("/api/campaigns/lab/judge", params=asked, content=content, headers=plain).json()
    (impact,) = fm.find_impacts(fm.read_recording(recording))
    assert judged["impacts"][0]["peak_force_N"] == pytest.approx(impact.peak_force)
    for wrong in ("[1]", "{", '{"time": 1}', '{"tim": 1}', '{"force": 9, "time": 1}'):
        answer = client.post(
            "/api/campaigns/lab/judge", params=asked | {"columns": wrong}, content=content, headers=plain
        )
        assert answer.status_code == 422
        assert answer.json()["error"]["message"]
    answer = changed(client, way="/recordings", columns=tried).json()
    assert not answer["written"]
    assert "90 recordings were read with other entries" in answer["binding"]
    assert (folder / "campaign.toml").read_text() == kept
    assert changed(client, way="/recordings", columns=tried, confirmed=True).json()["written"]
    assert fm.read_campaign(folder).columns.to_table() == tried
    (folder / "campaign.toml").write_text(kept)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[recording]\ntime = "t"\n', "the nearest known ones are recordings.time"),
        ('[protocols]\ncell = "7"\n', "protocol.cell"),
        ("[device]\nrange_N = 500,0  # of the device\n", "numbers have a decimal point: range_N = 500.0"),
        ('note = "a\n', "a text is not closed by its quotation mark"),
        ("[robot]\nmodel = UR10e\n", "a text stands in quotation marks"),
    ],
)
def test_a_slip_is_answered_with_what_was_meant(tmp_path, text, words):
    (tmp_path / "campaign.toml").write_text(f'schema = "forcemap-campaign/1"\n{text}')
    with pytest.raises(fm.ForcemapError) as refused:
        fm.read_conditions(tmp_path / "campaign.toml")
    assert words in str(refused.value)
