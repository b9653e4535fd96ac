"""A campaign's whole result: what is there, what is missing and why, and what does not fit together."""

from __future__ import annotations

import hashlib
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.stats

import forcemap as fm
from forcemap.assessment.folder import campaign_limit_table
from forcemap.assessment.missing import Missing
from forcemap.campaigns.memory import MEMORY_FILE
from forcemap.errors import CampaignFileError
from forcemap.findings import FindingKind
from forcemap.verdicts.recording_results import thinned
from forcemap.words import sentence, sentences
from pulses import TOML, collect, pulse, save, write_campaign

MASS = "[robot]\nmoving_mass_kg = 30.0\n"
_HEADER = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A campaign of 27 states with two repeats, collected."""
    folder = write_campaign(tmp_path_factory.mktemp("assessed") / "cell", repeats=2)
    collect(folder)
    return folder


@pytest.fixture
def copied(measured, tmp_path):
    return shutil.copytree(measured, tmp_path / "cell")


@pytest.fixture(scope="module")
def whole(measured):
    return fm.assess_campaign(measured, limits=[fm.force_limit("back_of_hand"), fm.force_limit("temple")])


def test_its_parts_are_those_of_the_library(whole, measured):
    campaign, dataset = fm.read_campaign(measured), fm.read_dataset(measured)
    force_map = fm.fit_force_map(dataset)
    kind = fm.FindingKind  # the paper's plan, and a force that grows with the speed as no exponential does
    said = [kind.FORM_DOUBTED, kind.FORM_UNSEEN_BETWEEN, kind.NOT_CONFIRMED]
    said += [kind.SLOW_IMPACTS_MISSING, kind.SLOWER_THAN_RAISED, kind.SPEED_ERROR_NOT_STATED]  # 0.1, 0.2, 0.3 m/s
    assert sorted(each.kind for each in whole.findings) == said
    assert whole.simulated is False
    np.testing.assert_array_equal(whole.force_map.coefficients, force_map.coefficients)
    assert whole.bound == fm.ToleranceBound(device_error=3.0)
    assert whole.accuracy == fm.map_accuracy(force_map, dataset)
    assert (whole.summary.recordings, whole.summary.used) == (len(campaign.entries), 54)
    assert whole.repeatability.mean_sd == fm.repeatability(dataset).mean_sd
    transient = next(each for each in whole.speeds if each.contact is fm.Contact.TRANSIENT)
    answer = transient.speeds.speeds
    limit = fm.force_limit("back_of_hand")
    for i, j in np.ndindex(answer.speed.shape):
        place = float(transient.speeds.distance[i]), float(transient.speeds.height[j])
        one = fm.safe_speed(force_map, *place, limit=limit, bound=whole.bound, contact=fm.Contact.TRANSIENT)
        assert one.outcome == answer.outcome[i, j]
        np.testing.assert_equal(one.speed, answer.speed[i, j])
    assert transient.confirmed + sum(len(each.places) for each in transient.open_places) <= answer.speed.size
    assert transient.slowest <= transient.fastest <= 0.3


def test_coefficients_stand_in_intervals_of_students_t(whole):
    """By brute force over the likely correlations, with the covariance s^2 AVA' of coefficients Ay."""
    fit, between = whole.force_map.fit, whole.force_map.fit.between_states
    x, effect, same = between.design, fit.place_effect, fit.states.place[:, None] == fit.states.place
    weight = np.linalg.inv(np.where(same, effect.correlation, 0) + (1 - effect.correlation) * np.eye(len(x)))
    a = np.linalg.solve(x.T @ weight @ x, x.T @ weight)
    errors = [
        between.residual_sd * np.sqrt(np.diag(a @ (np.where(same, rho, 0) + (1 - rho) * np.eye(len(x))) @ a.T))
        for rho in np.linspace(effect.least, effect.correlation, 9)
    ]
    assert effect.least < effect.correlation
    assert (errors[0] > errors[-1]).any()
    errors = np.max(errors, axis=0)
    np.testing.assert_allclose([each.standard_error for each in whole.coefficients], errors, rtol=1e-8)
    np.testing.assert_allclose([each.t_value for each in whole.coefficients], whole.force_map.coefficients / errors)
    low, high = scipy.stats.t.interval(0.95, between.degrees_of_freedom, whole.force_map.coefficients, errors)
    np.testing.assert_allclose([each.low for each in whole.coefficients], low)
    np.testing.assert_allclose([each.high for each in whole.coefficients], high)


def test_states_carry_their_repeats_and_the_gravest_verdict(whole, measured):
    dataset, limit = fm.read_dataset(measured), fm.force_limit("back_of_hand")
    campaign = fm.read_campaign(measured)
    assert len(whole.states) == 27
    for state in whole.states[::9]:
        forces = dataset.peak_force[dataset.state == state.name]
        assert (state.impacts, state.censored) == (2, 0)
        assert state.mean == pytest.approx(forces.mean())
        assert state.sd == pytest.approx(forces.std(ddof=1))
        assert state.highest == forces.max()
        files = [campaign.recordings / each.entry.file for each in state.recordings]
        impacts = [fm.find_impact(fm.read_recording(file, device=campaign.conditions.device)) for file in files]
        forces = [fm.check_impact(impact, limit).governing.force for impact in impacts]
        assert state.judgements[0].force == pytest.approx(max(forces))
        assert state.judgements[1] is None  # no contact with the temple is permitted
    assert whole.recordings.gravest.impact.recording.name.startswith("d500-h400-v300")


def test_the_head_has_no_speed(whole):
    head = [each for each in whole.speeds if each.limit.name == "temple"]
    assert len(head) == 2
    for each in head:
        assert "NOT PERMITTED" in each.speeds.reason
        assert math.isnan(each.standard_speed)
        assert each.confirmed == 0


def test_every_input_stands_with_its_hash_and_nothing_is_written(copied):
    before = contents(copied)
    found = fm.assess_campaign(copied)
    assert contents(copied) == before
    before.pop(Path(MEMORY_FILE))  # it judges the recordings, whatever is remembered of them
    expected = {str(path): hashlib.sha256(data).hexdigest() for path, data in before.items()}
    assert {each.path: each.sha256 for each in found.inputs} == expected
    assert found.software == f"forcemap {fm.__version__}"


def change_a_recording(folder):
    path = folder / "recordings" / "d500-h200-v100-r1.csv"
    path.write_text(path.read_text().replace("0.0", "0.1", 1))
    return "RECORDINGS CHANGED since they were registered: d500-h200-v100-r1.csv"


def remove_a_recording(folder):
    (folder / "recordings" / "d500-h200-v100-r1.csv").unlink()
    return "RECORDINGS GONE since they were registered: d500-h200-v100-r1.csv"


def add_a_recording(folder):
    save(folder / "recordings" / "more.csv", *pulse(99.0))
    return "not registered yet: more.csv"


def lower_a_force(folder):
    path = folder / "impacts.csv"
    lines = path.read_text().splitlines(keepends=True)
    forces = [line.split(",")[6] for line in lines]
    lines[5] = lines[5].replace(forces[5], "61.00", 1)
    path.write_text("".join(lines))
    return "impacts.csv is NOT what its recordings give (first in row 6)"


def remove_impacts(folder):
    lines = (folder / "impacts.csv").read_text().splitlines(keepends=True)
    (folder / "impacts.csv").write_text("".join(lines[:-4]))
    return "impacts.csv is NOT what its recordings give (50 impacts, not 54)"


def remove_the_table(folder):
    (folder / "impacts.csv").unlink()
    return "there is no impacts.csv"


def remove_the_conditions(folder):
    (folder / "campaign.toml").unlink()
    return "there is no campaign.toml"


def put_a_recording_beside_a_point(folder):
    save(folder / "points" / "p1.csv", *pulse(99.0))
    return "RECORDINGS OF CONTACT POINTS not registered yet: points/p1.csv"


@pytest.mark.parametrize("change", [change_a_recording, put_a_recording_beside_a_point])
def test_speeds_of_other_files_than_were_collected_are_withheld(copied, change):
    """The table is as it was: `fm.safe_speed` of it knows nothing of the files."""
    assert any(each.confirmed for each in fm.assess_campaign(copied).speeds)
    problem = change(copied)
    found = fm.assess_campaign(copied)
    assert [each.confirmed for each in found.speeds] == [0] * len(found.speeds)
    assert all(problem in sentence(each.speeds.speeds.basis.refusal) for each in found.speeds)
    assert sum(problem in sentence(each) for each in found.findings) == 1


def let_calibration_expire(folder):
    toml = TOML.replace("[device]", "date = 2026-06-30\n[device]\ncalibrated = 2025-01-31")
    (folder / "campaign.toml").write_text(toml)
    return "one year, as no last day is stated): expired when it measured, on 2026-06-30"


def forget_the_range(folder):
    (folder / "campaign.toml").write_text(TOML.replace("range_N = 500.0\n", ""))
    return "the device range is not stated"


def name_another_edition(folder):
    (folder / "campaign.toml").write_text(TOML + '[standard]\nedition = "ISO 10218-2:2025"\n')
    return "campaign.toml states the edition ISO 10218-2:2025"


def simulate_a_recording(folder):
    path = folder / "recordings" / "d500-h200-v100-r1.csv"
    path.write_text("SIMULATED by hand\n" + path.read_text())
    shutil.rmtree(folder / "maps", ignore_errors=True)
    (folder / "recordings.csv").unlink()
    collect(folder)
    return "SIMULATED recordings or impacts, in a campaign whose campaign.toml does not say so"


@pytest.mark.parametrize(
    "damage",
    [
        change_a_recording, remove_a_recording, add_a_recording, lower_a_force, remove_impacts, remove_the_table,
        remove_the_conditions, let_calibration_expire, forget_the_range, name_another_edition, simulate_a_recording,
    ],
    ids=lambda damage: damage.__name__,
)  # fmt: skip
def test_what_does_not_fit_is_said(copied, damage):
    said = damage(copied)
    before = contents(copied)
    found = fm.assess_campaign(copied, step=0.2)
    assert any(said in line for line in sentences(found.findings)), found.findings
    assert contents(copied) == before
    assert found.simulated == ("SIMULATED" in said)


def test_a_changed_recording_is_not_judged(copied):
    change_a_recording(copied)
    results = {each.entry.file: each for each in fm.assess_campaign(copied).recordings.results}
    changed = results["d500-h200-v100-r1.csv"]
    assert changed.judgements == (None,)
    assert changed.not_judged.kind is FindingKind.FILE_CHANGED
    assert changed.force.size == 0


def test_where_everything_is_saturated_there_is_no_map(tmp_path):
    folder = write_campaign(tmp_path / "cell", recorded=False)
    for seed, name in enumerate(fm.read_plan(folder).recording.tolist()):
        time, force = pulse(900.0, rate=1000.0, seed=seed)
        save(folder / "recordings" / f"{name}.csv", time, np.minimum(force, 500.0))
    collect(folder)
    found = fm.assess_campaign(folder)
    assert isinstance(found.force_map, Missing)
    assert all(isinstance(part, Missing) for part in (found.coefficients, found.accuracy, found.bound))
    assert all(each.confirmed == 0 and isinstance(each.speeds, Missing) for each in found.speeds)
    assert len(found.states) == 27
    assert {(state.impacts, state.censored) for state in found.states} == {(0, 1)}
    assert all(state.at_least == pytest.approx(500, abs=3) for state in found.states)
    assert all(state.judgements[0].outcome is fm.VerdictOutcome.EXCEEDED for state in found.states)


def test_too_few_states_for_a_bound(copied):
    table = fm.read_dataset(copied).to_frame()
    few = table[table["state_id"].isin(sorted(set(table["state_id"]))[:9])]
    folder = copied.parent / "few"
    folder.mkdir()
    few.to_csv(folder / "impacts.csv", index=False)
    found = fm.assess_campaign(folder)
    assert isinstance(found.recordings, Missing)
    assert isinstance(found.bound, Missing)
    assert found.bound.reason
    assert all(isinstance(each.speeds, Missing) for each in found.speeds)


def test_a_plan_alone_is_assessed_as_far_as_it_goes(tmp_path):
    found = fm.assess_campaign(write_campaign(tmp_path / "cell", recorded=False, toml=TOML + MASS))
    assert isinstance(found.dataset, Missing)
    assert len(found.campaign.missing) == 27
    for each in found.speeds:
        assert isinstance(each.speeds, Missing)
        assert each.measure_next.plan is not None


def test_the_table_that_campaign_toml_names(copied):
    lines = ("# edition: of our own", "# version: 3", "# source: a test", _HEADER, "palm,Palm,hand_fingers,100,120,2")
    (copied / "mine.csv").write_text("\n".join(lines) + "\n")
    (copied / "campaign.toml").write_text(TOML + '[standard]\nlimit_table = "mine.csv"\n')
    found = fm.assess_campaign(copied)
    assert [(each.quasi_static, each.transient, each.edition) for each in found.limits] == [(120, 240, "of our own")]
    assert "mine.csv" in [each.path for each in found.inputs]
    standard = fm.assess_campaign(copied, limits=[fm.force_limit("hand_fingers")])
    assert any(
        "names the limit table mine.csv, limits used are of ISO/TS 15066" in each
        for each in sentences(standard.findings)
    )
    (other,) = [each for each in standard.findings if each.kind is fm.FindingKind.OTHER_LIMITS]
    assert other.figure("table") == "mine.csv"
    assert other.figure("editions").startswith("ISO/TS 15066")
    assert "mine.csv" in [each.path for each in standard.inputs]
    own = campaign_limit_table(copied, fm.read_conditions(copied / "campaign.toml"))
    assert (own.file, own.table.edition) == ("mine.csv", "of our own")
    assert any(
        "limit table that the campaign names: mine.csv" in line
        for line in sentences(found.force_map.conditions.findings)
    )


def test_a_report_of_named_areas_uses_the_campaigns_own_table(copied, ask):
    lines = ("# edition: of our own", "# version: 3", "# source: a test", _HEADER, "palm,Palm,hand_fingers,100,120,2")
    (copied / "mine.csv").write_text("\n".join(lines) + "\n")
    (copied / "campaign.toml").write_text(TOML + '[standard]\nlimit_table = "mine.csv"\n')
    code, _ = ask("report", copied, "--area", "palm")
    assert code == 0
    text = (copied / "report.html").read_text()
    assert "of our own" in text
    assert "limits used are of" not in text


@pytest.mark.parametrize("step", [0.0, -0.1, math.nan, math.inf])
def test_a_step_that_is_none(measured, step):
    with pytest.raises(fm.InputError, match="step"):
        fm.assess_campaign(measured, step=step)


def test_a_folder_that_is_none(tmp_path):
    with pytest.raises(fm.InputError, match="no such folder"):
        fm.assess_campaign(tmp_path / "nothing")
    with pytest.raises(fm.InputError, match=r"neither campaign\.toml"):
        fm.assess_campaign(tmp_path)


def test_thinned_curves_keep_their_extremes():
    rng = np.random.default_rng(4)
    time = np.arange(20_000) / 10_000
    force = rng.normal(0, 1, time.size)
    force[rng.integers(time.size, size=2)] = 300.0, -40.0
    few_time, few = thinned(time, force)
    assert few.size < 250
    assert (few.max(), few.min()) == (300.0, -40.0)
    assert (few_time[0], few_time[-1]) == (time[0], time[-1])
    assert np.all(np.diff(few_time) > 0)
    np.testing.assert_array_equal(few, force[np.searchsorted(time, few_time)])


@pytest.mark.parametrize("name", ["a\0b.csv", "a" * 300 + ".csv", "../x.csv", "/etc/x.csv", "recordings/.csv"])
def test_a_limit_table_that_is_no_file_of_the_folder_is_refused(copied, name):
    with pytest.raises(CampaignFileError, match=r"limit_table: found .* which is no file of this folder"):
        campaign_limit_table(copied, fm.Conditions(limit_table=name))


def test_speeds_by_the_standards_limits_say_first_that_the_campaign_names_its_own(copied, forcemap):
    """Those of a map that was taken out of the folder; in the folder its own limits count."""
    lines = ("# edition: of our own", "# version: 3", "# source: a test", _HEADER, "chest,Chest,chest,100,120,2")
    (copied / "mine.csv").write_text("\n".join(lines) + "\n")
    stated = copied / "campaign.toml"
    stated.write_text(stated.read_text() + '\n[standard]\nlimit_table = "mine.csv"\n')
    asked = ("speed", copied, "--distance", 0.7, "--height", 0.3, "--area", "chest", "--contact", "transient")
    words = "names the limit table mine.csv, limits used are of ISO/TS 15066"
    forcemap("fit", copied, "-o", copied / "map.json")
    assert words in " ".join(forcemap("speed", copied / "map.json", *asked[2:])[1].partition("Assumes")[0].split())
    assert words not in " ".join(forcemap(*asked)[1].split())
    assert "240 N, transient contact, chest in of our own (table version 3)" in " ".join(forcemap(*asked)[1].split())
    assert words not in " ".join(forcemap(*asked, "--limit-table", copied / "mine.csv")[1].split())


def test_limits_that_cannot_be_used_are_not_replaced_by_the_standards(copied, tmp_path):
    stated = copied / "campaign.toml"
    stated.write_text(stated.read_text() + '\n[standard]\nlimit_table = "own.csv"\n')
    area = fm.force_limit("chest")
    for content in (None, "area,name\nx,y\n"):
        if content:
            (copied / "own.csv").write_text(content)
        with pytest.raises(CampaignFileError, match=r"standard\.limit_table"):
            fm.assess_campaign(copied, limits=[area])
    assert fm.assess_campaign(copied, limits=[area], limit_table=fm.standard_limit_table()).limits == (area,)
