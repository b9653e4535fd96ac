"""docs/published_data.md: somebody else's curves, as they are, become a campaign by its column map."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

import forcemap as fm
from pulses import TOML, pulse, save

PAGE = (Path(__file__).parents[1] / "docs" / "published_data.md").read_text()


def block(kind):
    return re.search(rf"```{kind}\n(.*?)```", PAGE, re.S)[1]


@pytest.fixture(scope="module")
def states():
    grid = np.meshgrid([0.56, 0.71, 0.86], [0.14, 0.30, 0.46], [0.2, 0.25, 0.3], indexing="ij")
    return np.column_stack([axis.ravel() for axis in grid])


def test_the_page_leads_from_their_files_to_their_map(ask, tmp_path, states):
    folder = tmp_path / "their-campaign"
    (folder / "recordings").mkdir(parents=True)
    (folder / "campaign.toml").write_text(block("toml"))
    header = block("text").splitlines()[0]
    sample = block("csv").splitlines()
    rows, theirs = [header], {}
    for i, (d, h, v) in enumerate(states):
        role = "test" if v == 0.25 else "train"
        rows.append(f"p{i},1,{role},{d},{h},{v}")
        time, force = pulse(float(fm.published_map("kuka-iiwa7-30nm").predict(d, h, v)))[:2]
        lines = [f"{1000 * t:.2f};{f:.2f}".replace(".", ",") for t, f in zip(time, force, strict=True)]
        name = f"p{i}-r1.csv" if i % 9 else f"measurement_{i + 1:03d}.csv"
        theirs |= {name: i} if not i % 9 else {}
        (folder / "recordings" / name).write_text("\n".join([sample[0], *lines]) + "\n")
    (folder / "plan.csv").write_text("\n".join(rows) + "\n")
    code, found = ask("collect", folder)
    assert code == 0, found
    register = list(csv.DictReader((folder / "recordings.csv").read_text().splitlines()))
    assert {row["file"] for row in register if row["use"] == "unassigned"} == set(theirs)
    for row in register:
        if row["file"] in theirs:
            row |= {"state_id": f"p{theirs[row['file']]}", "repeat": "1"}
    with (folder / "recordings.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(register[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(register)
    assert ask("collect", folder)[0] == 0
    dataset = fm.read_dataset(folder)
    assert len(dataset.states) == len(states)
    expected = fm.published_map("kuka-iiwa7-30nm").predict(*dataset.states.coordinates.T)
    np.testing.assert_allclose(dataset.states.force, expected, rtol=0.02)
    commands = re.findall(r"^    forcemap (\w.*)$", PAGE.partition("## 4.")[2], re.M)
    assert len(commands) == 6
    for command in commands:
        words = [
            word.replace("their-campaign", str(folder)).replace("heights.pdf", str(tmp_path / "h.pdf"))
            for word in command.split()
        ]
        code, found = ask(*words)
        if words[0] == "select":  # 18 states: it says that it needs a full grid
            assert "full grid" in found["error"]["message"]
        else:
            assert code == 0, (command, found)
    assert found["kind"] == "heights"


@pytest.mark.parametrize(("before", "shown"), [(0.002, True), (0.0, False)])
def test_curves_that_begin_too_late_name_the_way_by_published_peaks(ask, tmp_path, before, shown):
    """2 ms before contact show no zero; a file that cannot be read is another matter."""
    folder = tmp_path / "theirs"
    (folder / "recordings").mkdir(parents=True)
    (folder / "campaign.toml").write_text(TOML)
    (folder / "plan.csv").write_text(block("text"))
    if shown:
        save(folder / "recordings" / "p1-r1.csv", *pulse(before=before))
    else:
        (folder / "recordings" / "p1-r1.csv").write_text("nothing")
    code, found = ask("collect", folder)
    assert code == 2
    assert "gave an impact that can be used" in found["error"]["message"]
    assert ("take the published peaks into the impacts.csv" in found["error"]["message"]) == shown
    assert ("(docs/published_data.md, Only peaks were published)" in found["error"]["message"]) == shown
    assert "## Only peaks were published" in PAGE


def test_a_published_map_where_impacts_are_expected_names_what_takes_it(ask, example_folders):
    folder = example_folders["ur10e"]
    for words in (["fit", "ur10e"], ["evaluate", "ur10e"], ["evaluate", "ur10e", "--forms"], ["select", "ur10e"]):
        code, found = ask(*words)
        assert code == 2
        assert "ur10e is a published map, already fitted" in found["error"]["message"]
    code, found = ask("evaluate", folder, "--against", "ur10e")
    assert code == 2
    for command in ("evaluate NEW --map ur10e", "compare NEW ur10e"):
        assert f"forcemap {command}" in found["error"]["message"]
        assert ask(*command.replace("NEW", str(folder)).split())[0] == 0
    assert fm.map_accuracy(fm.published_map("ur10e"), fm.read_dataset(folder))[0].on == "test states"
