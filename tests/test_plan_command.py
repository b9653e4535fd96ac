"""plan --design i-optimal, next and confirm as a program sees them."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
import typer
from oracle import printed_force

import forcemap as fm
from forcemap.campaigns.template import campaign_text
from forcemap.cli.app import app, run as run_command
from pulses import pulse, rows, save

RANGES = ("--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46")
CELL = (*RANGES, "--moving-mass-kg", 30, "--device-range-N", 500, "--device-spring-N-per-mm", 75)
HAND = ("--area", "back_of_hand", "--contact", "transient")


def flowing(out):
    """Commands in one line each, and lines of at most 100 characters but for paths."""
    assert all(len(line) <= 100 or "/" in line for line in out.splitlines())
    return " ".join(out.replace("\\\n", " ").split())


def measure(folder, ask, rng):
    """Record every planned run that is missing, and collect."""
    campaign = fm.read_campaign(folder)
    plan = campaign.plan
    effects = dict(zip(plan.states, rng.normal(0, 0.022, len(plan.states)), strict=True))
    for i, name in enumerate(plan.recording.tolist()):
        if name in campaign.missing:
            force = printed_force("ur10e", plan.distance[i], plan.height[i], plan.speed[i])
            save(folder / "recordings" / f"{name}.csv", *pulse(force * np.exp(effects[plan.state_id[i]]), rate=1000.0))
    assert ask("collect", folder)[0] == 0


def copied(folder, target):
    """A copy of a campaign."""
    return shutil.copytree(folder, target)


@pytest.fixture
def measured(ask, tmp_path):
    """A campaign from nothing to 14 states."""
    folder, rng = tmp_path / "cell", np.random.default_rng(5)
    options = ("--batch", 7, "--states", 14, "--repeats", 1)
    assert ask("next", folder, *CELL, *HAND, *options)[0] == 0
    measure(folder, ask, rng)
    assert ask("next", folder, *HAND, *options)[0] == 0
    measure(folder, ask, rng)
    return folder


def test_forces_expected_from_a_map_are_of_its_payload(ask, tmp_path):
    """Another one is stated: it is said first that the forces are not those with it."""
    plan = ("plan", tmp_path / "mine", *RANGES, "--speeds-mps", "0.2,0.4", "--map", "ur10e", "--device-range-N", 500)
    found = ask(*plan, "--payload-kg", 1.5)[1]
    assert found["warnings"][0].startswith(
        "PAYLOAD OF 1.5 kg NOT IN THE EXPECTED FORCES: they are those of map 'ur10e'"
    )
    forces = [run["expected_force_N"] for run in found["runs"]]
    for folder, payload in (("none", ()), ("zero", ("--payload-kg", 0)), ("heavy", ("--payload-kg", 10))):
        other = ask("plan", tmp_path / folder, *plan[2:], *payload)[1]
        assert [run["expected_force_N"] for run in other["runs"]] == forces
        assert any("PAYLOAD" in warning for warning in other["warnings"]) == (folder == "heavy")


def test_an_i_optimal_plan(ask, forcemap, tmp_path):
    code, found = ask("plan", tmp_path / "a", *RANGES, "--speeds-mps", "0.2,0.4", "--design", "i-optimal")
    assert (code, found["states"]) == (0, 18)
    assert all("in campaign.toml" in warning for warning in found["warnings"])  # what is not stated of the device
    assert found["expected_bound_width"] == pytest.approx(0.106, abs=0.002)
    assert found["design_note"].startswith("18 of 729 states chosen for CFM_3D, the slowest and the fastest")
    assert "the bound is expected to lie 10.6 % above the prediction" in found["design_note"]
    weak = ("--speeds-mps", "0.1,0.4", "--design", "i-optimal", "--map", "ur10e", "--device-range-N", 350)
    found = ask("plan", tmp_path / "weak", *RANGES, *weak)[1]
    assert found["left_out"] == []
    assert "; 165 expected above the device range less its error were no candidates" in found["design_note"]
    runs = [run for run in found["runs"] if run["repeat"] == 1]
    outside = sum(run["speed_mps"] < 0.2 for run in runs)
    assert f"; {outside} of 18 planned states lie outside its measured range" in found["expected_from"]
    options = ("--speeds-mps", "0.2,0.4", "--design", "i-optimal:log-speed", "--states", 14)
    code, found = ask("plan", tmp_path / "b", *RANGES, *options)
    assert (code, found["states"]) == (0, 14)
    assert "14 states to train, fewer than 18: the bound is expected to lie" in found["warnings"][0]
    assert "LOG_SPEED" in found["warnings"][0]
    code, out, _ = forcemap("plan", tmp_path / "c", *RANGES, *options)
    assert code == 0
    assert re.search(r"; first read the (\d doubts|doubt) below\n  ! 14 states to train", out.replace("\n    ", " "))
    assert "the device is put up " in out


@pytest.mark.parametrize(("form", "fewest"), [("i-optimal", 11), ("i-optimal:LOG_SPEED", 11)])
def test_too_few_i_optimal_states_are_refused_with_the_number_that_works(ask, tmp_path, form, fewest):
    options = (*RANGES, "--speeds-mps", "0.1,0.4", "--design", form)
    for states in (8, fewest - 1):
        code, found = ask("plan", tmp_path / "a", *options, "--states", states)
        assert code == 2
        assert found["error"]["message"].startswith(
            f"states: found {states}, expected at least {fewest}: the 8 corners"
        )
    assert ask("plan", tmp_path / "a", *options, "--states", fewest)[0] == 0
    narrow = (*RANGES, "--speeds-mps", "0.1,0.14", "--design", form, "--places", 17, "--states", 90)
    code, found = ask("plan", tmp_path / "b", *narrow)
    assert code == 2
    assert "states: found 90, expected fewer, or wider ranges: only" in found["error"]["message"]


@pytest.mark.parametrize(
    ("options", "by_place"),
    [
        (("--places", 27, "--states", 31), True),
        (("--design", "i-optimal", "--places", 12), True),
        (("--design", "paper"), False),
    ],
)
def test_sentence_sheet_and_time_say_the_order_of_the_plan(forcemap, tmp_path, options, by_place):
    code, out, _ = forcemap("plan", tmp_path / "a", *RANGES, "--speeds-mps", "0.1,0.4", *options)
    assert code == 0
    at = [(row["distance_m"], row["height_m"]) for row in rows(tmp_path / "a" / "plan.csv")]
    set_ups = sum(one != other for one, other in zip(at, [None, *at], strict=False))
    assert ("place by place, the corners first" in flowing(out)) == by_place
    assert ("all places at the lowest speed first" in flowing(out)) != by_place
    assert f"the device is put up {set_ups} times" in flowing(out)
    heads = [line for line in (tmp_path / "a" / "run_sheet.txt").read_text().splitlines() if line.startswith("d = ")]
    assert len(heads) == (set_ups if by_place else 0)


def test_one_state_measured_again_and_one_warning_of_the_spring(ask, forcemap, tmp_path):
    options = (*RANGES, "--speeds-mps", "0.1,0.4", "--moving-mass-kg", 30, "--again", 1)
    code, out, _ = forcemap("plan", tmp_path / "a", *options)
    assert (code, "; 1 state again at the end" in flowing(out)) == (0, True)
    assert "no speed for a body area will follow without device.stiffness_N_per_m" in flowing(out)
    warnings = ask("plan", tmp_path / "b", *options, *HAND)[1]["warnings"]
    (spring,) = [each for each in warnings if "spring" in each]
    assert "the 75 N/mm of back_of_hand need one about as stiff" in spring
    assert "Python" not in spring


def test_a_plan_says_which_payload_it_expects_and_how_to_plan_anew(ask, tmp_path):
    """Planned without one, 0 kg is assumed and said; deleting plan.csv and giving the payload is the printed way."""
    folder, options = tmp_path / "a", (*CELL, "--speeds-mps", "0.15,0.4", *HAND)
    first = ask("plan", folder, *options)[1]
    (doubt,) = [each for each in first["warnings"] if "the slowest planned speed may be too fast" in each]
    assert "no payload is stated (--payload-kg" in doubt
    assert "m_L = 0 kg, as no payload is stated), a coarse guess: forces may be 2 times these" in first["expected_from"]
    code, refused = ask("plan", folder, *options, "--payload-kg", 6)
    assert code == 2
    assert (
        "no recordings; to plan it anew, delete its plan.csv and give this command again" in refused["error"]["message"]
    )
    (folder / "plan.csv").unlink()
    code, found = ask("plan", folder, *CELL[:4], "--speeds-mps", "0.15,0.4", *HAND, "--payload-kg", 6)
    assert (code, fm.read_conditions(folder / "campaign.toml").payload) == (0, 6.0)
    assert "m_L = 6 kg)" in found["expected_from"]
    assert not any("no payload" in each for each in found["warnings"])
    for plan, payload in ((first, 0), (found, 6)):
        forces = [run["speed_mps"] * np.sqrt(75e3 * (30 / 2 + payload)) for run in plan["runs"]]  # F = v sqrt(k m_R)
        assert [run["expected_force_N"] for run in plan["runs"]] == pytest.approx(forces)
    (folder / "recordings" / "a.csv").write_text("time_s,force_N\n")
    code, refused = ask("plan", folder, *options)
    assert "has a plan and recordings; name a new folder" in refused["error"]["message"]


@pytest.mark.parametrize("options", [("--design", "paper", "--places", 9), ("--base-angles-deg", "0,90"),
                                     ("--design", "symmetry")])  # fmt: skip
def test_refusals_name_options_as_they_are_typed(ask, tmp_path, options):
    code, found = ask("plan", tmp_path / "a", *RANGES, "--speeds-mps", "0.1,0.4", *options)
    assert code == 2
    assert "Design." not in found["error"]["message"]


def test_few_states_are_refused_in_one_line_with_what_to_expect_of_them(ask, tmp_path):
    options = ("--speeds-mps", "0.2,0.4", "--map", "ur10e", "--device-range-N", 300, "--design", "paper")
    code, found = ask("plan", tmp_path / "a", *RANGES, *options)
    assert code == 2
    assert "expected at least 18: no tolerance bound can be had from fewer than 12 states" in found["error"]["message"]
    assert not (tmp_path / "a").exists()
    number = found["error"]["message"].split("found ")[1].split(" ")[0]
    assert ask("plan", tmp_path / "a", *RANGES, *options, "--states", number)[0] == 0


def test_from_nothing_to_confirmed_places(ask, forcemap, tmp_path):
    """The campaign's files after every step; old rows stay, the sheet has the new runs."""
    folder, rng = tmp_path / "cell", np.random.default_rng(3)
    options = (*HAND, "--repeats", 1, "--states", 15, "--batch", 6)
    code, first = ask("next", folder, *CELL, *options)
    assert (code, first["stop"], first["states"], len(first["runs"])) == (0, None, 6, 6)
    assert first["files"] == ["campaign.toml", "plan.csv", "run_sheet.txt"]
    assert first["expected_mean_speed_mps"] is None
    assert all(run["upper_force_N"] <= 497 for run in first["runs"])
    code, found = ask("next", folder, *options)
    assert code == 2
    assert "planned states without an impact: 6" in found["error"]["message"]
    measure(folder, ask, rng)
    code, second = ask("next", folder, *options)
    assert (code, second["files"]) == (0, ["plan.csv", "run_sheet.txt"])
    planned = [row["recording"] for row in rows(folder / "plan.csv")]
    assert planned == [run["recording"] for run in [*first["runs"], *second["runs"]]]
    sheet = (folder / "run_sheet.txt").read_text()
    assert all(run["recording"] in sheet for run in second["runs"])
    assert not any(run["recording"] in sheet for run in first["runs"])
    assert fm.read_campaign(folder).conditions.moving_mass == 30
    measure(folder, ask, rng)
    code, out, err = forcemap("next", folder, *options)
    assert (code, err) == (0, "")
    assert out.startswith("3 states to measure next, slow to fast")
    assert "the device is put up 3 times: 0 h 33 min, if a place takes 10 min and an impact 1 min (assumed)" in out
    expected = (
        r"after these about \d+ of 81 places spread evenly over the range to measure would have a speed at "
        r"contact \(now \d+\)"
    )
    assert re.search(expected, " ".join(out.split()))
    measure(folder, ask, rng)
    before = (folder / "plan.csv").read_bytes()
    code, last = ask("next", folder, *options)
    assert (code, last["stop"], last["runs"]) == (1, "budget", [])
    assert last["confirmed_places"] > 30
    code, out, _ = forcemap("next", folder, *options)
    assert code == 1
    assert out.startswith("Stop (budget): the campaign has the 15 states of its budget")
    assert (folder / "plan.csv").read_bytes() == before


def test_a_batch_that_gains_nothing_by_itself_says_why_it_is_measured(ask, tmp_path):
    """Slow corners widen the measured range downwards, where the bound is wide, before the rest of a batch pays."""
    folder, work = tmp_path / "plan", tmp_path / "work"
    assert ask("plan", folder, *RANGES, "--speeds-mps", "0.1,0.4", "--repeats", 1)[0] == 0
    assert ask("simulate", folder, "--preset", "ur10e-like", "-o", work)[0] == 0
    assert ask("collect", work)[0] == 0
    code, found = ask("next", work, *HAND, "--speeds-mps", "0.05,0.4")
    assert code == 0
    assert found["expected_mean_speed_mps"] < found["mean_speed_mps"]
    assert "by -" not in found["reason"]
    assert "slower than any measured before, because" in found["reason"]


REACH = 0.8
WIDE = ("--distances-m", "0.4,0.9", "--heights-m", "0.1,0.6", "--device-range-N", 500, "--device-spring-N-per-mm", 75)


@pytest.fixture(scope="module")
def reached(tmp_path_factory):
    """A simulated campaign of which plan was told the reach and the speeds."""
    folder, work = (tmp_path_factory.mktemp("reached") / name for name in ("plan", "work"))
    options = ("--reach-m", REACH, "--speeds-mps", "0.1,0.3", "--moving-mass-kg", 30, "--repeats", 1)
    for command in (("plan", folder, *WIDE, *options), ("simulate", folder, "--preset", "ur10e-like", "-o", work)):
        assert run_command([str(part) for part in command]) == 0
    assert run_command(["collect", str(work)]) == 0
    return work


def test_next_keeps_to_the_reach_and_the_speeds_that_plan_was_told(ask, forcemap, reached, tmp_path):
    """The virtual lab's campaign states them, too; they are no conditions, so nothing is unconfirmed by them."""
    code, found = ask("next", copied(reached, tmp_path / "a"), *HAND, "--batch", 12)
    assert code == 0
    speeds = [run["speed_mps"] for run in found["runs"]]
    assert max(speeds) <= 0.3
    said = flowing(forcemap("next", copied(reached, tmp_path / "c"), *HAND)[1])
    assert "you may stop here, if that is not worth the time: leave these states out of plan.csv" in said
    assert f"forcemap speed-map {tmp_path / 'c'} --area back_of_hand --contact transient" in said
    assert max(np.hypot(run["distance_m"], run["height_m"]) for run in found["runs"]) <= REACH
    assert [words.partition(", as")[0] for words in found["planned_within"]] == [
        "speeds up to 0.3 m/s",
        "places within 0.8 m of the base's origin",
    ]
    folder = copied(reached, tmp_path / "b")
    said = flowing(forcemap("next", folder, *HAND)[1])
    assert "(plan.fastest_mps); --speeds-mps allows others places within 0.8 m" in said


def test_other_speeds_are_asked_for_and_another_reach_is_stated(ask, reached, tmp_path):
    folder = copied(reached, tmp_path / "a")
    toml = (folder / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(toml.replace("reach_m = 0.8", "reach_m = 1.05"))
    assert fm.read_dataset(folder).binding.refusal is None
    found = ask("next", folder, *HAND, "--batch", 12, "--speeds-mps", "0.05,0.4", *WIDE[:4])[1]
    assert min(run["speed_mps"] for run in found["runs"]) < 0.1
    assert REACH < max(np.hypot(run["distance_m"], run["height_m"]) for run in found["runs"]) <= 1.05
    assert [words[:21] for words in found["planned_within"]] == ["places within 1.05 m "]
    assert "--speeds-mps 0.05,0.4" in found["next_command"]


def test_a_map_is_made_of_what_was_measured_not_of_what_was_planned(reached, tmp_path):
    fm.write_map(fm.fit_force_map(fm.read_dataset(reached)), tmp_path / "map.json")
    assert "reach" not in (tmp_path / "map.json").read_text()


def test_a_new_plan_states_its_own_reach_and_keeps_one_that_is_stated(ask, tmp_path):
    folder = tmp_path / "cell"
    assert ask("plan", folder, *WIDE, "--speeds-mps", "0.1,0.3", "--reach-m", 0.9)[0] == 0
    for options, reach in (((), 0.9), (("--reach-m", 0.75), 0.75)):
        (folder / "plan.csv").unlink()
        code, found = ask("plan", folder, *WIDE, "--speeds-mps", "0.2,0.4", *options)
        assert code == 0
        assert max(np.hypot(run["distance_m"], run["height_m"]) for run in found["runs"]) <= reach
        stated = fm.read_conditions(folder / "campaign.toml")
        assert (stated.reach, stated.fastest) == (reach, 0.4)


def test_states_that_carry_a_map_over_stay_within_a_stated_reach(ask, simulated, tmp_path):
    assert ask("fit", simulated, "-o", tmp_path / "old.json")[0] == 0
    (tmp_path / "cell").mkdir()
    cell = fm.Conditions(reach=0.7, device=fm.Device(range=500.0, stiffness=75e3))
    (tmp_path / "cell" / "campaign.toml").write_text(campaign_text(cell))
    code, found = ask("plan", tmp_path / "cell", "--transfer", tmp_path / "old.json")
    assert (code, found["error"]["kind"]) == (2, "input")
    assert found["error"]["message"].startswith("plan.reach_m: campaign.toml states 0.7 m, and d")
    assert not (tmp_path / "cell" / "plan.csv").exists()


def test_the_confirmation_of_a_campaign_is_added_to_its_plan_as_test_runs(ask, forcemap, measured):
    before = rows(measured / "plan.csv")
    code, found = ask("confirm", measured, *HAND, "--impacts", 4)
    assert (code, found["files"], len(found["runs"])) == (0, ["plan.csv", "run_sheet.txt"], 4)
    after = rows(measured / "plan.csv")
    assert after[: len(before)] == before
    assert [row["role"] for row in after[len(before) :]] == ["test"] * 4
    assert 0 < found["above_bound_probability"] <= found["not_passed_probability"] < 0.5
    assert all(run["upper_force_N"] <= found["limit_N"] for run in found["runs"])
    assert "the map is confirmed if each of the 4 impacts" in " ".join((measured / "run_sheet.txt").read_text().split())
    sheet = (measured / "run_sheet.txt").read_text()
    assert "at most [N]" in sheet
    for run in found["runs"]:
        (line,) = [line for line in sheet.splitlines() if run["recording"] in line]
        assert f" {int(min(run['upper_force_N'], 280 - 3))}  ___" in line


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("command", ["next", "confirm"])
def test_who_only_asks_is_told_the_same_and_nothing_is_written(command, ask, forcemap, measured):
    before = bytes_of(measured)
    code, told = ask(command, measured, *HAND, "--dry-run")
    said = flowing(forcemap(command, measured, *HAND, "--dry-run")[1])
    assert bytes_of(measured) == before
    assert f"Nothing written (--dry-run); to put this into the plan: forcemap {command} {measured} --area" in said
    assert "print" not in said
    assert told["files"] == []
    code_then, written = ask(command, measured, *HAND)
    assert written["files"] == ["plan.csv", "run_sheet.txt"]
    assert bytes_of(measured) != before
    assert (code, told | {"files": written["files"]}) == (code_then, written)


def test_the_confirmation_is_shown_again_until_it_is_measured_and_then_judged(ask, forcemap, measured):
    """As often as asked; with next nothing that was printed is lost. A report that is older than the plan is known."""
    number, older = ("--impacts", 4), "The report in this folder rests on the plan before: write it again"
    assert forcemap("report", measured, *HAND[:2])[0] == 0
    assert older in flowing(forcemap("confirm", measured, *HAND, *number)[1])
    assert forcemap("report", measured, *HAND[:2])[0] == 0
    assert older not in flowing(forcemap("confirm", measured, *HAND, *number)[1])
    assert forcemap("report", "--verify", measured / "report.html", measured)[0] == 0
    first = ask("confirm", measured, *HAND, "--impacts", 4)[1]
    assert (first["outcome"], first["missing"]) == (None, [run["recording"] for run in first["runs"]])
    before, sheet = rows(measured / "plan.csv"), (measured / "run_sheet.txt").read_bytes()
    code, again = ask("confirm", measured, *HAND, *number)
    assert (code, again["outcome"], again["runs"]) == (0, None, first["runs"])
    assert rows(measured / "plan.csv") == before
    code, out, _ = forcemap("next", measured, *HAND, "--dry-run")
    taken = "No longer planned: slow impacts come first, and may take speeds away"
    assert (code, taken in flowing(out)) == (0, True)
    assert (measured / "run_sheet.txt").read_bytes() == sheet

    plan, names = fm.read_plan(measured), [run["recording"] for run in first["runs"]]
    place = {name: i for i, name in enumerate(plan.recording.tolist())}

    def record(name, share):
        i = place[name]
        upper = next(run["upper_force_N"] for run in first["runs"] if run["recording"] == name)
        force = printed_force("ur10e", plan.distance[i], plan.height[i], plan.speed[i])
        save(measured / "recordings" / f"{name}.csv", *pulse(min(share * force, upper - 4), rate=1000.0, seed=i))

    def said():
        """What a speed and a speed map of the folder say of the confirmation."""
        place = ("--distance", 0.8, "--height", 0.4)
        answers = [ask("speed", measured, *place, *HAND)[1], ask("speed-map", measured, *HAND)[1]]
        texts = [answer["warnings"] + answer["assumptions"] for answer in answers]
        lines = {line for text in texts for line in text if "onfirm" in line or "CONFIRM" in line}
        return {line for line in lines if not line.startswith("SLOW IMPACTS ARE MISSING")}

    of = "NOT CONFIRMED YET for 280 N (transient) by impacts at the speeds that the map permits"
    assert said() == {f"{of}: planned runs without an impact: 4 of 6; release nothing yet (forcemap confirm)"}
    for name in names[:3]:
        record(name, 0.97)
    _, out, _ = forcemap("collect", measured)
    assert f"Next: forcemap confirm {measured}, with the same area and contact" in flowing(out)
    code, partly = ask("confirm", measured, *HAND, *number)
    assert (code, partly["outcome"], partly["missing"]) == (2, "cannot_tell", names[3:])
    lines = said()
    missing = "planned runs without an impact: 3 of 6; release nothing yet"
    assert lines == {f"{of}: {missing} (forcemap confirm)"}
    record(names[3], 0.97)
    assert ask("collect", measured)[0] == 0
    code, found = ask("confirm", measured, *HAND, *number)
    assert (code, found["outcome"], found["missing"], found["files"]) == (0, "passes", [], [])
    assert [each["outcome"] for each in found["impacts"]] == ["passes"] * 4
    code, out, _ = forcemap("confirm", measured, *HAND, *number)
    assert code == 0
    assert out.startswith("PASSES: each of the 4 impacts is within 280 N and below the bound")
    assert "count a map as confirmed from 6 impacts on" in flowing(out)
    assert all("without an impact: 2 of 6" in line for line in said())
    whole = ask("confirm", measured, *HAND)[1]
    first["runs"], place = whole["runs"], {name: i for i, name in enumerate(fm.read_plan(measured).recording.tolist())}
    plan = fm.read_plan(measured)
    for name in whole["missing"]:
        record(name, 0.97)
    assert all("collect" in line or "without an impact" in line for line in said())
    assert ask("collect", measured)[0] == 0
    whole = ask("confirm", measured, *HAND)[1]
    assert whole["outcome"] == "passes"
    assert (
        flowing(forcemap("confirm", measured, *HAND)[1])
        .strip()
        .endswith("Else: forcemap report and forcemap export, which say now that the map is confirmed")
    )
    missed = 100 * (1 - whole["found_probability_bump"])
    found = f"which would have missed {missed:.0f} of 100 spots 80 mm wide with 25 % more force"
    assert said() == {f"confirmed for 280 N (transient) by 6 impacts at the speeds that the map permits, {found}"}
    assert "is 25 % higher at a bump 80 mm wide" in flowing(forcemap("confirm", measured, *HAND)[1])
    doubts = {
        row["slowest_mps"]: row["warnings"] for row in ask("evaluate", measured, "--slowest", *HAND)[1]["from_speeds"]
    }
    told = {speed: any(line.upper().startswith("NOT CONFIRMED") for line in each) for speed, each in doubts.items()}
    assert told == {speed: speed > min(doubts) for speed in doubts}  # the first is this map, of all states
    other = ask("speed", measured, "--distance", 0.8, "--height", 0.4, "--area", "middle_of_shin", *HAND[2:])[1]
    assert any(line.lower().startswith("not confirmed") for line in other["assumptions"])  # they had another limit
    assert not any(line.startswith("confirmed for") for line in other["assumptions"])
    code, more = ask("next", measured, *HAND)
    assert code == 0
    assert more["warnings"][0].startswith("THE MAP IS NOW confirmed for 280 N (transient) by 6 impacts")


def test_slow_impacts_take_the_place_of_a_confirmation_of_which_nothing_is_measured(ask, forcemap, measured):
    """They may take speeds away, and the map is another one then: what `confirm` says comes first is not refused."""
    trains = fm.read_plan(measured).recording.tolist()
    said = flowing(forcemap("confirm", measured, *HAND)[1])
    names = [run["recording"] for run in ask("confirm", measured, *HAND)[1]["runs"]]
    assert "Next, before anything is released: slow impacts; they may take speeds away" in said
    assert f"forcemap next {measured} --area back_of_hand" in said
    save(measured / "recordings" / f"{names[0]}.csv", *pulse(100.0, rate=1000.0))
    code, answer = ask("next", measured, *HAND)  # measured, and not collected: its run stays in the plan
    assert (code, names[0] in fm.read_plan(measured).recording.tolist()) == (2, True)
    assert "without an impact: 6" in answer["error"]["message"]
    assert ask("collect", measured)[0] == 0
    code, answer = ask("next", measured, *HAND)
    assert (code, "states to confirm the map without an impact: 5" in answer["error"]["message"]) == (2, True)
    (measured / "recordings" / f"{names[0]}.csv").unlink()
    (measured / "recordings.csv").unlink()
    assert ask("collect", measured)[0] == 0
    assert ask("next", measured, *HAND)[0] == 0
    plan = fm.read_plan(measured).recording.tolist()
    assert plan[: len(trains)] == trains
    assert not any(name in plan for name in names)
    assert len(plan) > len(trains)


def flat_top(largest, seed):
    """A curve that rises straight, stays nearly level for 30 ms and falls: its flanks point above its top."""
    time, up, level, down, hump = np.arange(900) / 1000, 0.03, 0.03, 0.04, 5.0
    since, low = time - 0.1005, largest - hump
    parts = [low * since / up, largest - hump * ((since - up - level / 2) / (level / 2)) ** 2,
             low * (1 - (since - up - level) / down)]  # fmt: skip
    stages = [(since >= 0) & (since < up), (since >= up) & (since < up + level), since >= up + level]
    force = np.maximum(np.select(stages, parts), 0.0) + np.random.default_rng(seed).normal(0, 0.4, time.size)
    return time, force


def test_an_impact_whose_repeats_cannot_tell_either_is_not_asked_for_again_and_again(ask, forcemap, measured):
    upper = {run["recording"]: run["upper_force_N"] for run in ask("confirm", measured, *HAND)[1]["runs"]}
    first, *others = sorted(upper, key=upper.__getitem__, reverse=True)
    assert upper[first] > 270
    for i, name in enumerate(others):
        save(measured / "recordings" / f"{name}.csv", *pulse(min(upper[name] - 8, 255.0), rate=1000.0, seed=i))
    state = first.removesuffix("-r1")
    for repeat, asks in ((1, True), (2, True), (3, False)):
        save(measured / "recordings" / f"{state}-r{repeat}.csv", *flat_top(269.0 + repeat / 7, repeat))
        assert forcemap("collect", measured)[0] == 0
        code, out, _ = forcemap("confirm", measured, *HAND)
        said = flowing(out)
        assert (code, f"cannot tell: {repeat} of {repeat + 5}" in said) == (2, True)
        assert "that its flanks leave open above the largest sample, as of a top cut off: up to" in said
        assert ("measure it again as a further repeat" in said) is asks
        assert (f"3 impacts of {state} cannot tell, and more are not expected to" in said) is not asks


def test_a_map_that_shifts_a_little_leaves_a_plan_that_can_be_read(ask, measured):
    """What was measured stays and counts; of what was not, nothing stands as close beside it as repeats may be."""
    names = [run["recording"] for run in ask("confirm", measured, *HAND)[1]["runs"]]
    save(measured / "recordings" / f"{names[0]}.csv", *pulse(100.0, rate=1000.0))
    save(measured / "recordings" / f"{names[3]}.csv", *pulse(101.0, rate=1000.0))
    assert ask("collect", measured)[0] == 0
    campaign, dataset = fm.read_campaign(measured), fm.read_dataset(str(measured))
    trained = dataset.train.states
    for state, force in zip(trained.name[:8], trained.force, strict=False):
        save(measured / "recordings" / f"{state}-r2.csv", *pulse(0.96 * force, rate=1000.0))
    assert ask("collect", measured)[0] == 0
    save(measured / "recordings" / f"{names[4]}.csv", *pulse(102.0, rate=1000.0))  # not collected yet
    force_map = fm.fit_force_map(fm.read_dataset(str(measured)))
    shift = force_map.predict(0.7, 0.3, 0.2) / fm.fit_force_map(dataset).predict(0.7, 0.3, 0.2) - 1
    assert 0 < abs(shift) < 0.03
    code, found = ask("confirm", measured, *HAND)
    assert (code, found["outcome"], len(found["runs"])) == (2, "cannot_tell", 6)
    after = fm.read_campaign(measured).plan  # refused where two states are as close as repeats
    assert set(found["replaced"]) == set(names) - set(after.recording.tolist())
    assert set(found["replaced"]) <= {names[1], names[2], names[5]}
    assert {*names[:1], *names[3:5]} <= set(after.recording.tolist())
    trains = campaign.plan.role == "train"
    assert after.recording[after.role == "train"].tolist() == campaign.plan.recording[trains].tolist()
    asked = {run["recording"]: run["speed_mps"] for run in found["runs"]}
    speeds = fm.safe_speed(
        force_map, *np.array([[run["distance_m"], run["height_m"]] for run in found["runs"]]).T,
        limit=280.0, bound=fm.ToleranceBound(),
    ).speed  # fmt: skip
    off = np.array(list(asked.values())) - speeds
    assert np.all(np.abs(off) <= 0.0101)
    new = ~np.isin(list(asked), names)
    assert np.all((off[new] <= 0) & (off[new] > -0.001))
    assert ask("collect", measured)[0] == 0
    assert ask("confirm", measured, *HAND)[1]["runs"] == found["runs"]
    assert "states to confirm the map without an impact" in ask("next", measured, *HAND)[1]["error"]["message"]


def test_the_next_step_follows_from_what_forbids_every_speed(ask, forcemap, measured):
    """More impacts help where the bound exceeds the limit; not where something has to be put right first."""
    toml = measured / "campaign.toml"
    table, stated = measured / "impacts.csv", toml.read_text()
    toml.write_text("\n".join(line for line in stated.splitlines() if "stiffness_N_per_m" not in line))
    code, out, _ = forcemap("confirm", measured, *HAND)
    assert code == 1
    assert "the spring of the measuring device is not stated" in flowing(out)
    assert f"put it right, or ask for another limit, then forcemap confirm {measured} --area" in flowing(out)
    assert "forcemap next" not in out
    toml.write_text(stated)
    lines = table.read_text().splitlines()
    table.write_text("\n".join([*lines[:-1], lines[-1].replace(",1", ",2", 1), ""]))
    code, out, _ = forcemap("confirm", measured, *HAND)
    assert code == 1
    assert "is not what forcemap collect wrote" in flowing(out)
    assert "forcemap next" not in out


def test_a_confirming_impact_that_is_too_strong_does_not_pass(ask, forcemap, measured):
    first = ask("confirm", measured, *HAND, "--impacts", 2)[1]
    for run, force in zip(first["runs"], (100.0, 290.0), strict=True):
        save(measured / "recordings" / f"{run['recording']}.csv", *pulse(force, rate=1000.0))
    assert ask("collect", measured)[0] == 0
    code, found = ask("confirm", measured, *HAND)
    assert (code, found["outcome"]) == (1, "does_not_pass")
    assert [each["outcome"] for each in found["impacts"]] == ["passes", "does_not_pass"]
    assert "exceed the limit of 280 N" in found["impacts"][1]["reason"]
    before = (measured / "plan.csv").read_bytes()
    code, out, _ = forcemap("confirm", measured, *HAND, "--impacts", 6)
    assert code == 1
    assert "DOES NOT PASS: impacts that do not pass: 1 of 2; release nothing" in out
    assert f"forcemap next {measured} --area back_of_hand --contact transient" in flowing(out)
    assert (measured / "plan.csv").read_bytes() == before


def test_a_confirming_impact_that_clamps_does_not_pass(ask, measured):
    """Phase II then forbids the limit, and no speed is released any more: no reason to say that there is no answer."""
    first = ask("confirm", measured, *HAND, "--impacts", 2)[1]
    for run in first["runs"]:
        save(measured / "recordings" / f"{run['recording']}.csv", *pulse(150.0, held=145.0, rate=1000.0))
    assert ask("collect", measured)[0] == 0
    code, found = ask("confirm", measured, *HAND)
    assert (code, found["outcome"]) == (1, "does_not_pass")


def test_a_confirming_recording_under_another_name_or_changed_cannot_tell(ask, measured):
    first = ask("confirm", measured, *HAND, "--impacts", 2)[1]
    for run in first["runs"]:
        save(measured / "recordings" / f"{run['recording']}.csv", *pulse(100.0, rate=1000.0))
    assert ask("collect", measured)[0] == 0
    path = measured / "recordings" / f"{first['runs'][0]['recording']}.csv"
    path.rename(path.with_name("other.csv"))
    code, found = ask("confirm", measured, *HAND)
    assert (code, found["outcome"]) == (2, "cannot_tell")
    path.with_name("other.csv").rename(path)
    save(path, *pulse(90.0, rate=1000.0))
    code, found = ask("confirm", measured, *HAND)
    assert (code, found["outcome"]) == (1, None)
    assert "RECORDINGS CHANGED since they were registered" in found["reason"]


def test_a_limit_without_any_speed_leads_to_more_measurements(ask, forcemap, measured):
    code, found = ask("confirm", measured, "--limit-N", 60, "--contact", "quasi-static")
    assert (code, found["files"], found["runs"]) == (1, [], [])
    assert "no place has a speed for 60 N" in found["reason"]
    code, out, _ = forcemap("confirm", measured, "--limit-N", 60, "--contact", "quasi-static")
    assert code == 1
    assert f"forcemap next {measured} --limit-N 60 --contact quasi-static" in flowing(out)


def test_the_next_step_is_the_whole_command(ask, forcemap, measured, tmp_path):
    code, found = ask("next", measured, *HAND, "--largest-force-N", 320.5, "--batch", 2)
    assert code == 0
    step = "--area back_of_hand --contact transient --batch 2 --largest-force-N 320.5"
    assert found["next_command"] == f"forcemap next {measured} {step}"
    assert "95 % confidence" in found["upper_force_is"]
    assert "at most: tolerance bound" in (measured / "run_sheet.txt").read_text()
    assert "slower impacts" not in found["upper_force_is"]  # there are none
    folder = tmp_path / "table"
    folder.mkdir()
    (folder / "impacts.csv").write_bytes((measured / "impacts.csv").read_bytes())
    code, out, _ = forcemap("next", folder, "--limit-N", 250, "--device-range-N", 500)
    assert code == 0
    assert "Nothing written: there is no plan.csv" in out
    assert f"add a row for each impact to {folder / 'impacts.csv'}" in flowing(out)


def test_the_confirmation_of_a_map_is_shown_and_written_nowhere(ask, forcemap, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, found = ask("confirm", "ur10e", "--limit-N", 280)
    assert (code, found["files"], found["not_passed_probability"]) == (0, [], None)
    assert found["bound"]["kind"] == "margin"
    code, out, _ = forcemap("confirm", "ur10e", "--limit-N", 280)
    assert code == 0
    assert "Rule: the map is confirmed if" in out
    assert "Nothing written" in out
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "arguments", "message"),
    [
        ("plan", (), "expected --distances-m, --heights-m and --speeds-mps"),
        ("next", CELL, "limit: expected one of --area or --limit-N"),
        ("next", (*CELL, "--area", "back_of_hand", "--limit-N", 140), "limit: expected one of"),
        ("next", (*CELL, "--area", "chest", "--area", "skull"), "found --area chest and skull, expected one"),
        ("next", (*CELL, "--limit-N", 140, "--limit-table", "t.csv"), "--limit-table goes with --area, not"),
        ("next", (*CELL, "--area", "back_of_hand"), "expected --contact"),
        ("next", (*RANGES, "--limit-N", 140, "--device-range-N", 500), "state the robot's moving mass"),
        ("next", (*RANGES, "--limit-N", 140, "--moving-mass-kg", 30), "device range: not stated"),
        ("next", ("--moving-mass-kg", 30, "--device-range-N", 500, "--limit-N", 140), "distances: found none"),
        ("next", (*RANGES, "--limit-N", 140, "--moving-mass-kg", 30), "(--largest-force-N)"),
        ("next", ("--moving-mass-kg", 30, "--device-range-N", 500, "--limit-N", 140), "--distances-m LOWEST,HIGHEST"),
        ("next", (*CELL, "--area", "face", "--contact", "transient"), "contact with face is not permitted"),
        (
            "next",
            (*CELL, "--limit-N", 140, "--map", "ur10e", "--map", "ur10e"),
            "found several, expected one",
        ),
        (
            "plan",
            (*RANGES, "--speeds-mps", "0.2,0.4", "--states", 18, "--design", "paper"),
            "any number of states can be had of --design spread or i-optimal",
        ),
        (
            "plan",
            (*RANGES, "--speeds-mps", "0.2,0.3,0.4"),
            "found 3 values, give the lowest and highest, or --design paper",
        ),
        (
            "plan",
            (*RANGES, "--speeds-mps", "0.2,0.4", "--places", 8),
            "places: found 8, expected at least 9: ",
        ),
        ("plan", (*RANGES, "--speeds-mps", "0.2,0.4", "--minutes-per-place", "-1"), "minutes per place: found -1"),
        ("plan", (*RANGES, "--speeds-mps", "0.2,0.4", "--design", "paper:CFM_3D"), "expected spread, paper, full-grid"),
        ("confirm", ("--limit-N", 140), "no such file, folder or published map"),
    ],
)
def test_what_cannot_be_answered_is_refused_in_one_line(ask, tmp_path, command, arguments, message):
    code, found = ask(command, tmp_path / "cell", *arguments)
    assert code == 2
    assert message in found["error"]["message"]
    assert not (tmp_path / "cell").exists()


@pytest.mark.parametrize(
    ("option", "where"),
    [
        (("--next",), "is a command: forcemap next FOLDER"),
        (("--confirm", "--limit-N", 140), "is a command: forcemap confirm FOLDER"),
        (("--batch=3",), "goes with forcemap next"),
        (("--form", "CFM_3D"), "--design i-optimal:LOG_SPEED"),
    ],
)
def test_an_option_that_moved_is_refused_with_its_new_place(ask, tmp_path, option, where):
    code, found = ask("plan", tmp_path / "cell", *option)
    assert code == 2
    assert where in found["error"]["message"]


@pytest.mark.parametrize("name", ["plan", "next", "confirm"])
def test_a_command_has_one_example_and_not_too_many_options(forcemap, name):
    code, out, _ = forcemap(name, "--help")
    assert code == 0
    assert out.count("Example: forcemap " + name) == 1
    assert len(typer.main.get_command(app).commands[name].params) <= (20 if name == "plan" else 16)


@pytest.mark.parametrize("source", ["ur10e", "map.json"])
def test_a_map_is_no_campaign_to_go_on_with(ask, source, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, found = ask("next", source, *CELL, "--limit-N", 140)
    assert code == 2
    assert "found a map, expected a campaign folder or an impacts table" in found["error"]["message"]
    assert list(tmp_path.iterdir()) == []


def test_a_simulated_campaign_says_so(ask, tmp_path):
    folder = fm.copy_example("ur10e", tmp_path / "work")
    code, found = ask("confirm", folder, "--limit-N", 280)
    assert (code, found["simulated"], found["files"]) == (0, True, [])
    before = sorted(path.name for path in folder.iterdir())
    for source in (folder, folder / "impacts.csv"):
        code, found = ask("next", source, "--limit-N", 140, "--states", 40)
        assert (code, found["simulated"], found["files"], found["states"]) == (0, True, [], 4)
    assert sorted(path.name for path in folder.iterdir()) == before


def test_the_sheet_is_written_again_with_what_the_campaign_states_now(ask, forcemap, tmp_path):
    """In its head alone: a sheet made of the same conditions from the start is the same, and a person's notes stay."""
    options, sheet, toml = (*RANGES, "--speeds-mps", "0.1,0.4"), "run_sheet.txt", "campaign.toml"
    last = "expected forces: "
    code, out, _ = forcemap("plan", tmp_path / "a", *options, *HAND)
    assert (code, f"2. forcemap plan {tmp_path / 'a'}, which writes" in flowing(out)) == (0, True)
    before = (tmp_path / "a" / sheet).read_text()
    assert before.count("WARNING: forcemap collect will need device.range_N") == 1
    assert ask("plan", tmp_path / "a") == (0, {"folder": str(tmp_path / "a"), "files": [sheet]})
    assert (tmp_path / "a" / sheet).read_text() == before
    plan = (tmp_path / "a" / "plan.csv").read_text()  # rows that a person adds come below, once
    columns = plan.splitlines()[0].split(",")
    cells = {"state_id": "mine", "repeat": "1", "role": "train", "distance_m": "0.7", "height_m": "0.3",
             "speed_mps": "0.2", "recording": "mine-r1"}  # fmt: skip
    (tmp_path / "a" / "plan.csv").write_text(f"{plan}{','.join(cells.get(name, '') for name in columns)}\n")
    assert "and 1 run that plan.csv has besides" in flowing(forcemap("plan", tmp_path / "a")[1])
    added = (tmp_path / "a" / sheet).read_text()
    assert added.startswith(before)
    assert added.count("mine-r1") == added.count("Added to plan.csv") == 1
    assert "besides" not in forcemap("plan", tmp_path / "a")[1]
    (tmp_path / "a" / "plan.csv").write_text(plan)
    (tmp_path / "a" / sheet).write_text(before)
    conditions = fm.Conditions(
        robot="R7", direction="down", contact_site="flange", device=fm.Device(range=500.0, stiffness=75e3)
    )
    (tmp_path / "b").mkdir()
    for name in "ab":
        (tmp_path / name / toml).write_text(campaign_text(conditions))
    assert ask("plan", tmp_path / "b", *options, *HAND)[0] == 0
    (tmp_path / "a" / sheet).write_text(before + "door open\n")
    code, out, _ = forcemap("plan", tmp_path / "a")
    after = (tmp_path / "a" / sheet).read_text()
    (head, *_), rest = (tmp_path / "b" / sheet).read_text().partition(last), before[before.index(last) :]
    assert (code, out.count(sheet), after) == (0, 1, f"{head}{rest}door open\n")
    assert "will need" not in after

    for wrong in (("--repeats", 2), RANGES, options):
        assert ask("plan", tmp_path / "a", *wrong)[0] == 2
    (tmp_path / "a" / sheet).write_text("a note\n")
    code, found = ask("plan", tmp_path / "a")
    assert (code, "no run sheet to write again" in found["error"]["message"]) == (2, True)
    assert (tmp_path / "a" / sheet).read_text() == "a note\n"


def test_a_sheet_of_a_confirmation_keeps_its_rule_and_its_bounds(ask, measured):
    assert ask("confirm", measured, *HAND)[0] == 0
    before, toml = (measured / "run_sheet.txt").read_text(), measured / "campaign.toml"
    assert "Rule: " in before
    stated = fm.read_conditions(toml)
    toml.write_text(toml.read_text().replace('# operator = ""', 'operator = "B. Jones"'))
    assert fm.read_conditions(toml) != stated
    assert ask("plan", measured)[0] == 0
    after = (measured / "run_sheet.txt").read_text()
    assert after == before.replace("operator: not stated", "operator: B. Jones")
