"""Speed at contact: the campaign's speed error, the overshoot, and which of them a shown speed contains."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given, strategies as st
from oracle import simulate

import forcemap as fm
from forcemap.campaigns.template import campaign_text
from forcemap.exports.zones import zones_csv, zones_result
from forcemap.maps.forms import FORMS
from forcemap.speeds.safe_speed import to_program
from forcemap.words import sentence

ERROR = 0.03
AREA = ("--area", "back_of_hand", "--contact", "quasi-static")
SEVERAL = {"limit": 230.0, "contact": fm.Contact.QUASI_STATIC, "bound": fm.ToleranceBound()}


def stating(dataset, **stated):
    """The same impacts, of a campaign that states something more."""
    return replace(dataset, conditions=replace(dataset.conditions, **stated))


@pytest.fixture(scope="module")
def dataset():
    found = simulate("ur10e", np.random.default_rng(202614), effect=0.022).dataset
    return stating(replace(found, role=np.full(len(found), "train")), direction="down", speed_kind="measured")


@pytest.fixture(scope="module")
def force_map(dataset):
    return fm.fit_force_map(dataset)


@pytest.fixture(scope="module")
def places(force_map):
    return np.meshgrid(np.linspace(0.5, 0.9, 41), np.linspace(0.1, 0.5, 41), indexing="ij")


@pytest.fixture
def folder(dataset, tmp_path):
    """A campaign's folder with a table that was typed in; 280 N of the back of the hand are confirmed in a part."""
    (tmp_path / "cell").mkdir()
    fm.write_dataset(dataset, tmp_path / "cell" / "impacts.csv")
    text = campaign_text(dataset.conditions)
    (tmp_path / "cell" / "campaign.toml").write_text(text)
    return tmp_path / "cell"


class TestSpeedError:
    @pytest.mark.parametrize("form", FORMS)
    def test_it_lowers_every_speed_by_its_share_and_changes_nothing_else(self, dataset, places, form):
        one, other = (
            fm.safe_speed(
                fm.fit_force_map(stating(dataset, speed_error=error), form=form), *places, **SEVERAL | {"limit": 300.0}
            )
            for error in (math.nan, ERROR)
        )
        np.testing.assert_array_equal(one.outcome, other.outcome)
        assert {*one.outcome.ravel()} >= {"unconfirmed", "outside"}
        assert not np.isnan(one.speed).all()
        for name in ("speed", "lowest_measured_speed", "highest_measured_speed"):
            np.testing.assert_allclose(getattr(other, name), (1 - ERROR) * getattr(one, name), atol=3e-6)
        np.testing.assert_allclose(other.bound_force, one.bound_force, rtol=3e-5)

    def test_the_table_keeps_what_is_stated(self, dataset, tmp_path):
        shifted = stating(dataset, speed_error=ERROR)
        np.testing.assert_array_equal(shifted.stated_speed, dataset.speed)
        np.testing.assert_allclose(shifted.speed, (1 - ERROR) * dataset.speed, rtol=1e-15)
        np.testing.assert_array_equal(shifted.as_stated.speed, dataset.speed)
        assert math.isnan(shifted.as_stated.conditions.speed_error)  # a map of these would be one without an error
        fm.write_dataset(shifted, tmp_path / "impacts.csv")
        (tmp_path / "campaign.toml").write_text(campaign_text(shifted.conditions))
        again = fm.read_dataset(tmp_path)
        np.testing.assert_array_equal(again.stated_speed, dataset.speed)
        np.testing.assert_array_equal(again.speed, shifted.speed)
        np.testing.assert_array_equal(shifted.to_frame()["speed_mps"], dataset.speed)
        np.testing.assert_array_equal(
            shifted.select(shifted.speed > 0.3).stated_speed, dataset.speed[shifted.speed > 0.3]
        )

    def test_a_map_file_carries_it(self, dataset, tmp_path):
        force_map = fm.fit_force_map(stating(dataset, speed_error=ERROR))
        fm.write_map(force_map, tmp_path / "map.json")
        again = fm.read_map(tmp_path / "map.json")
        assert fm.map_sha256(again) == fm.map_sha256(force_map)
        assert again.conditions.speed_error == ERROR
        found = fm.safe_speed(again, 0.8, 0.4, **SEVERAL)
        assert found.basis.speed_error == ERROR
        assert found.speed == fm.safe_speed(force_map, 0.8, 0.4, **SEVERAL).speed

    def test_a_map_file_that_does_not_state_it_reads_as_before(self, force_map, tmp_path):
        fm.write_map(force_map, tmp_path / "map.json")
        assert "speed_error" not in (tmp_path / "map.json").read_text()
        again = fm.read_map(tmp_path / "map.json")
        assert math.isnan(again.conditions.speed_error)
        np.testing.assert_array_equal(again.measured_range.points, force_map.measured_range.points)

    @pytest.mark.parametrize("slip", [3, -0.03, 0.5, 30.0])
    def test_a_percentage_is_no_share(self, tmp_path, slip):
        path = tmp_path / "campaign.toml"
        path.write_text(f'schema = "forcemap-campaign/1"\n[robot]\nspeed_error = {slip}\n')
        with pytest.raises(fm.InputError, match=r"robot.speed_error: found .*, expected a share .* 0.03 for 3 %"):
            fm.read_conditions(path)

    @pytest.mark.parametrize("kind", ["", "commanded", "measured"])
    @pytest.mark.parametrize("error", [math.nan, 0.0, ERROR])
    def test_what_is_not_known_is_said_first(self, dataset, kind, error):
        force_map = fm.fit_force_map(stating(dataset, speed_kind=kind, speed_error=error))
        basis = fm.safe_speed(force_map, 0.8, 0.4, **SEVERAL).basis
        first = [fm.sentence(each) for each in basis.warnings if each.kind is fm.FindingKind.SPEED_ERROR_NOT_STATED]
        (said,) = [fm.sentence(each) for each in basis.statements if each.kind is fm.FindingKind.SPEED_KIND]
        assert bool(first) == (kind != "measured" and math.isnan(error))
        assert all("3 % too high" in line and "speed_error" in line for line in first)
        stated = "not subtracted" if math.isnan(error) else f"{100 * error:g} % error of the campaign subtracted"
        assert stated in said
        assert (kind or "not stated") in said

    def test_a_changed_one_breaks_a_collected_table(self, forcemap, tmp_path):
        plan = ("--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--speeds-mps", "0.2,0.4", "--repeats", 1)
        limits = ("--device-range-N", 500, "--device-spring-N-per-mm", 75)
        assert forcemap("plan", tmp_path / "planned", *plan, *limits)[0] == 0
        simulated = ("simulate", tmp_path / "planned", "--preset", "ur10e-like", "-o", tmp_path / "cell")
        assert forcemap(*simulated)[0] == 0
        path = tmp_path / "cell" / "campaign.toml"
        for stated, broken in ((f"speed_error = {ERROR}", False), ("speed_error = 0.01", True), ("", True)):
            lines = [line for line in path.read_text().splitlines() if "speed_error" not in line]
            lines.insert(lines.index("[robot]") + 1, stated)
            path.write_text("\n".join(lines))
            if not broken:
                assert forcemap("collect", tmp_path / "cell")[0] == 0
            refusal = fm.read_dataset(tmp_path / "cell").binding.refusal
            assert (refusal is not None) == broken
            assert not broken or "robot.speed_error" in fm.sentence(refusal)

    def test_plans_are_in_the_speeds_that_the_campaign_states(self, dataset):
        limit = {"limit": 250.0, "distances": (0.52, 0.89), "heights": (0.14, 0.46)}
        one, other = (fm.next_measurements(stating(dataset, speed_error=e), **limit) for e in (math.nan, ERROR))
        assert one.plan is not None
        assert one.plan.recording.tolist() == other.plan.recording.tolist()
        np.testing.assert_array_equal(one.plan.speed, other.plan.speed)
        assert other.speed == pytest.approx((1 - ERROR) * one.speed)
        assert other.expected_speed == pytest.approx((1 - ERROR) * one.expected_speed, nan_ok=True)

    def test_impacts_at_the_stated_speeds_confirm_released_ones(self, dataset):
        plans = {}
        for error in (math.nan, ERROR):
            shifted = stating(dataset, speed_error=error)
            force_map = fm.fit_force_map(shifted)
            plan = plans[error] = fm.confirm_plan(force_map, **SEVERAL)
            said = "those to be measured, the released speeds at contact divided by 0.97: the robot may hit 3 % slower"
            assert (said in sentence(plan.rule)) == (error == ERROR)
            runs = plan.plan
            force = force_map.predict(runs.distance, runs.height, shifted.conditions.at_contact(runs.speed))
            confirming = fm.ImpactDataset.from_arrays(
                distance=runs.distance, height=runs.height, speed=runs.speed, peak_force=force, state=runs.state_id,
                role=runs.role, recording=runs.recording, conditions=shifted.conditions,
            )  # fmt: skip
            within = (True, fm.Finding.of(fm.FindingKind.WORDS, words="within"))
            result = plan.judged(confirming, dict.fromkeys(runs.recording.tolist(), within)).result
            assert result.outcome == "passes"
            assert not result.missing
            slower = plan.judged(stating(confirming, speed_error=0.2), dict.fromkeys(runs.recording.tolist(), within))
            assert slower.result.outcome != "passes"  # these may have been 20 % slower than released
            stated = fm.safe_speed(force_map, runs.distance, runs.height, **SEVERAL).speed / (1 - np.nan_to_num(error))
            assert np.all((runs.speed <= stated + 1e-9) & (runs.speed > stated - 0.0011))


class TestToProgram:
    @given(speed=st.floats(0.001, 10.0), lowest=st.floats(0.0, 5.0), overshoot=st.floats(0.0, 1.0), none=st.booleans())
    def test_with_the_overshoot_it_never_exceeds_the_speed_at_contact(self, speed, lowest, overshoot, none):
        at_contact = np.array([math.nan if none else speed])
        outcome, reason = np.array([fm.SpeedOutcome.ADMISSIBLE, None], dtype=object)[:, None]
        allowance = fm.Allowance(speed=overshoot)
        found, known, why = to_program(at_contact, outcome, reason, np.array([lowest]), allowance)
        if math.isnan(found[0]):
            assert none or speed - overshoot < lowest + 1e-12
            assert none or (known[0], why[0].kind) == ("unconfirmed", fm.FindingKind.BELOW_MEASURED)
        else:
            assert lowest <= found[0]
            assert found[0] + overshoot <= speed
            assert speed - overshoot - found[0] <= 1e-12
            assert known[0] is outcome[0]
            assert why[0] is reason[0]

    @pytest.mark.parametrize("overshoot", [0.0, 0.01, 0.05])
    @pytest.mark.parametrize("kind", ["grid", "measured"])
    def test_a_zone_is_permitted_only_where_every_place_in_it_is(self, dataset, overshoot, kind):
        rng = np.random.default_rng(7)
        if kind == "measured":  # speeds as a device reads them: the lower edge of what was measured is no plane
            dataset = replace(dataset, stated_speed=dataset.stated_speed * np.exp(rng.normal(0, 0.01, 125)).repeat(3))
        force_map, case = fm.fit_force_map(dataset), SEVERAL | {"allowance": fm.Allowance(speed=overshoot)}
        low, size = rng.uniform((0.52, 0.14), (0.84, 0.41), (60, 2)), rng.uniform(0.001, 0.05, (60, 2))
        zones = fm.Zones(low[:, 0], low[:, 0] + size[:, 0], low[:, 1], low[:, 1] + size[:, 1])
        found = fm.zone_speeds(force_map, zones, **case)
        has = ~np.isnan(found.speed_to_program)
        assert has.any()
        assert (found.to_program_outcome[~has] != "admissible").all()
        assert (found.speed_to_program + overshoot <= found.speed)[has].all()
        at = (low + size * rng.uniform(0, 1, (200, 1, 2)))[:, has]
        there = fm.safe_speed(force_map, at[..., 0], at[..., 1], **case)
        assert (found.speed_to_program[has] <= there.speed_to_program).all()  # none of these is NaN
        assert (found.speed_to_program[has] >= there.lowest_measured_speed).all()

    def test_what_is_said_of_a_place(self, force_map, places):
        found = fm.safe_speed(force_map, *places, **SEVERAL)
        has = ~np.isnan(found.speed_to_program)
        assert (found.speed_to_program + 0.01 <= found.speed)[has].all()
        assert (found.speed_to_program >= found.lowest_measured_speed)[has].all()
        np.testing.assert_array_equal(found.to_program_outcome[has], found.outcome[has])
        spent = ~has & ~np.isnan(found.speed)
        assert spent.any()
        assert {*found.to_program_outcome[spent]} == {"unconfirmed"}
        assert (found.speed[spent] - 0.01 < found.lowest_measured_speed[spent]).all()
        (why,) = {*found.to_program_reason[spent]}
        assert "lies below the lowest one measured there" in fm.sentence(why)
        refused = np.isnan(found.speed)
        np.testing.assert_array_equal(found.to_program_outcome[refused], found.outcome[refused])
        np.testing.assert_array_equal(found.to_program_reason[refused], found.reason[refused])
        assert found.basis.allowance == fm.Allowance()


class TestFaces:
    """The same place at every face: what may be programmed, and the speed at contact beside it."""

    @pytest.fixture
    def at(self, folder):
        found = fm.safe_speed(
            fm.fit_force_map(fm.read_dataset(folder)), 0.8, 0.4, limit=fm.force_limit("back_of_hand"),
            contact=fm.Contact.TRANSIENT, bound=fm.ToleranceBound(),
        )  # fmt: skip
        assert found.outcome == "unconfirmed"  # Phase II was not recorded, so no transient limit
        return found

    def test_speed(self, folder, ask, forcemap):
        place = ("speed", folder, "--distance", 0.85, "--height", 0.45, "--limit-N", 280, "--contact", "quasi-static")
        place += ("--limit-spring-N-per-mm", 75)
        code, found = ask(*place)
        assert code == 0
        assert found["outcome"] == found["to_program_outcome"] == "admissible"
        assert found["speed_to_program_mps"] == pytest.approx(found["speed_mps"] - 0.01)
        assert found["speed_to_program_mps"] + 0.01 <= found["speed_mps"]
        assert (found["speed_kind"], found["speed_error"], found["speed_overshoot_mps"]) == ("measured", None, 0.01)
        _, text, _ = forcemap(*place)
        program = fm.floor_speed(found["speed_to_program_mps"])
        assert text.startswith(f"Program at most {program} m/s at d = 0.85 m, h = 0.45 m: admissible; first read the ")
        assert f"contact  {fm.floor_speed(found['speed_mps'])} m/s with 0.01 m/s overshoot" in text
        assert max(map(len, text.splitlines())) <= 100
        code, spent = ask(*place, "--overshoot-mps", 0.5)
        assert code == 1
        assert spent["speed_mps"] == found["speed_mps"]
        assert spent["outcome"] == "admissible"
        assert (spent["speed_to_program_mps"], spent["to_program_outcome"]) == (None, "unconfirmed")
        _, text, _ = forcemap(*place, "--overshoot-mps", 0.5)
        assert text.startswith("No speed to program at d = 0.85 m, h = 0.45 m: unconfirmed")

    def test_speed_map(self, folder, ask, forcemap, tmp_path):
        command = ("speed-map", folder, "--limit-N", 230, "--contact", "quasi-static", "--step-m", 0.1)
        command += ("--limit-spring-N-per-mm", 75)
        code, found = ask(*command)
        assert code == 0
        both = [(p["speed_mps"], p["speed_to_program_mps"]) for p in found["places"] if p["speed_to_program_mps"]]
        assert both
        assert all(program + 0.01 <= contact for contact, program in both)
        assert found["fastest_to_program"]["speed_to_program_mps"] == max(program for _, program in both)
        assert found["fastest"]["speed_mps"] == max(p["speed_mps"] or 0 for p in found["places"])
        _, text, _ = forcemap(*command, "-o", tmp_path / "speeds.csv")
        slowest = min(program for _, program in both)
        assert text.startswith(f"{len(both)} of {len(found['places'])} places (")
        assert f"one speed for all of them: {fm.floor_speed(slowest)} m/s" in " ".join(text.split())
        assert "speed to program in m/s, 0.01 m/s overshoot subtracted" in text
        assert "\nspeed at contact in m/s\n" in text
        assert max(map(len, text.splitlines())) <= 100
        rows = list(csv.DictReader((tmp_path / "speeds.csv").read_text().splitlines()))
        for row, place in zip(rows, found["places"], strict=True):
            assert row["to_program_outcome"] == place["to_program_outcome"]
            assert row["speed_to_program_mps"] == fm.floor_speed(place["speed_to_program_mps"] or math.nan).strip("-")
            if row["speed_to_program_mps"]:
                assert Decimal(row["speed_to_program_mps"]) + Decimal("0.01") <= Decimal(row["speed_mps"])

    def test_path_and_exports(self, folder, ask, tmp_path):
        path = tmp_path / "path.csv"
        path.write_text("x_m,y_m,z_m\n0.85,0,0.45\n0.85,0,0.2\n")
        _, found = ask(
            "path", folder, path, *AREA[:2], "--contact", "quasi-static", "--margin", 0.1, "--bound", "margin"
        )
        assert found["speed_overshoot_mps"] == 0.01
        assert found["speed_kind"] == "measured"
        some = [piece for piece in found["pieces"] if piece["speed_mps"] is not None]
        assert all(piece["speed_mps"] + 0.01 <= piece["contact_speed_mps"] for piece in some)

        table = fm.robot_table(
            fm.fit_force_map(fm.read_dataset(folder)), bound=fm.ToleranceBound(),
            limits=[(fm.NewtonLimit.of(280.0, None, 75e3), fm.Contact.QUASI_STATIC)],
        )  # fmt: skip
        result = zones_result(table)
        zones = [zone for zone in result["zones"] if zone["speed_mps"]]
        assert zones
        assert all(zone["speed_mps"] + 0.01 <= zone["lower_bound_mps"] for zone in zones)
        assert (result["speed_kind"], result["speed_error"], result["speed_overshoot_mps"]) == ("measured", None, 0.01)
        head = "\n".join(zones_csv(table).splitlines()[:30])
        assert "speed at contact: measured, its error not stated and not subtracted" in head
        assert head.count("speed to program: speed at contact less 0.01 m/s, the overshoot assumed of the robot") == 1
        json.dumps(result, allow_nan=False)
