"""Maps carried over: the joint fit against other implementations, and every rule of when it may be used."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from oracle import printed_force
from scipy import optimize, stats

import forcemap as fm
from forcemap.answers.map import FitAnswer
from forcemap.assessment.missing import Missing
from forcemap.campaigns.template import campaign_text
from forcemap.cli.app import run
from forcemap.findings import FindingKind
from forcemap.maps.carry_over import EARLIER_MAP
from forcemap.maps.transfer import SHIFT, joint_fit
from forcemap.planning.transfer_plan import expected_transfer_width, plan_transfer
from forcemap.web.fitted_campaign import fitted_campaign
from truths import Box, spread

THIRTY, TEN = "kuka-iiwa7-30nm", "kuka-iiwa7-10nm"
BOX = Box.of(THIRTY)
OLD = spread(BOX)
NEW = BOX.at(
    np.array(
        [
            *(
                [0.9, 0.9, 0.0],
                [0.88, 0.05, 1.0],
                [0.1, 0.95, 1.0],
                [0.05, 0.1, 0.0],
                [0.5, 0.45, 0.5],
                [0.3, 0.7, 0.3],
            ),
            *([0.7, 0.3, 0.8], [0.95, 0.55, 0.6], [0.45, 0.98, 0.9], [0.6, 0.12, 0.1], [0.2, 0.38, 0.7]),
        ]
    )
)
CONDITIONS = fm.Conditions(robot="KUKA", safety_settings="30 Nm", device=fm.Device(range=2000.0, stiffness=75e3))
CHANGED = replace(CONDITIONS, safety_settings="10 Nm")
QUERY = BOX.grid(4, 4, 4)


def impacts(name, points, seed, sd=0.022, conditions=CONDITIONS, shape=lambda x: 1.0, cut=math.inf, **options):
    """Three repeats of states of a printed map with own effects; above `cut` [N] censored."""
    rng = np.random.default_rng(seed)
    force = printed_force(name, *points.T) * shape(points) * np.exp(rng.normal(0, sd, len(points)))
    force = force.repeat(3) * np.exp(rng.normal(0, 0.004, 3 * len(points)))
    d, h, v = points.repeat(3, axis=0).T
    return fm.ImpactDataset.from_arrays(
        distance=d,
        height=h,
        speed=v,
        peak_force=np.minimum(force, cut),
        censored=force >= cut,
        scenario=options.pop("scenario", ["unconstrained"] * d.size),
        phase2_force=options.pop("phase2_force", [10.0] * d.size),
        conditions=conditions,
        **options,
    )


@pytest.fixture(scope="module")
def old_map():
    return fm.fit_force_map(impacts(THIRTY, OLD, 1))


@pytest.fixture(scope="module")
def carried(old_map):
    return fm.transfer_map(old_map, impacts(TEN, NEW, 2, conditions=CHANGED))


def matrix(points):
    d, h, v = points.T
    return np.column_stack([np.ones_like(d), v, d, d**2, d * h, h**2, d**2 * v, d * v**2, d * h**2])


def shift_matrix(points):
    return np.column_stack([np.ones(len(points)), points])


def by_definition(old, new, rho, likely):
    """The new map's log force, standard deviation of its states, leverage at QUERY, and p value: dense matrices."""
    y = np.concatenate([old.log_force, new.log_force])
    m, k = len(old), len(new)
    x = np.zeros((m + k, 13))
    x[:m, :9], x[m:, :9], x[m:, 9:] = matrix(old.coordinates), matrix(new.coordinates), shift_matrix(new.coordinates)
    alike = old.place[:, None] == old.place

    def fitted(v, x, y):
        weight = np.linalg.inv(v)
        covariance = np.linalg.inv(x.T @ weight @ x)
        b = covariance @ x.T @ weight @ y
        e = y - x @ b
        return b, covariance, e @ weight @ e

    def of(ratio, extra):
        v = np.zeros((m + k, m + k))
        v[:m, :m] = np.eye(m) + ratio * alike
        v[m:, m:] = np.eye(k) * (1 + ratio + extra)
        return v

    def likelihood(extra):
        v = of(rho / (1 - rho), extra)
        _, covariance, squares = fitted(v, x, y)
        n, p = x.shape
        return 0.5 * ((n - p) * math.log(squares) + np.linalg.slogdet(v)[1] - np.linalg.slogdet(covariance)[1])

    tries = np.concatenate([[0.0], np.geomspace(1e-4, 100, 400)])
    start = tries[np.argmin([likelihood(extra) for extra in tries])]
    best = optimize.minimize_scalar(
        likelihood, bounds=(max(0.0, 0.8 * start - 1e-3), 1.2 * start + 1e-3), method="bounded"
    )
    extra = best.x if best.fun < likelihood(0.0) else 0.0
    b, covariance, squares = fitted(of(rho / (1 - rho), extra), x, y)
    own = squares / (m + k - 13)
    ratio = likely / (1 - likely)
    whole = fitted(of(ratio, 0.0), x, y)[2]
    before = fitted(of(ratio, 0.0)[:m, :m], x[:m, :9], y[:m])[2]
    quotient = (whole - before) / (k - 4) / (before / (m - 9))
    at = np.column_stack([matrix(QUERY), shift_matrix(QUERY)])
    total = 1 + rho / (1 - rho) + extra
    leverage = np.einsum("qi,ij,qj->q", at, covariance, at) / total
    return at @ b, math.sqrt(own * total), leverage, quotient


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_the_joint_fit_is_that_of_dense_matrices(seed):
    old_map = fm.fit_force_map(impacts(THIRTY, OLD, [seed, 0]))
    force_map = fm.transfer_map(old_map, impacts(TEN, NEW, [seed, 1]))
    effect = old_map.fit.place_effect
    log_force, deviation, leverage, quotient = by_definition(
        old_map.fit.states, force_map.fit.states, effect.correlation, effect.likely
    )
    np.testing.assert_allclose(np.log(force_map.predict(*QUERY.T)), log_force, atol=2e-4)
    assert force_map.fit.state_sd == pytest.approx(deviation, rel=0.02)  # the variance is searched on a grid
    np.testing.assert_allclose(force_map.leverage(*QUERY.T), leverage, rtol=0.02)
    assert force_map.fit.between_states.degrees_of_freedom == len(OLD) + len(NEW) - 13
    freedom = effect.between + (1 - effect.likely) * (len(OLD) - 9 - effect.between)
    assert force_map.fit.transfer.p_value == pytest.approx(stats.f.sf(quotient, len(NEW) - 4, freedom), rel=1e-6)
    upper = fm.ToleranceBound(device_error=0).upper(force_map, *QUERY.T)
    root = np.sqrt(force_map.leverage(*QUERY.T))
    t = stats.nct.ppf(0.95, force_map.fit.between_states.degrees_of_freedom, stats.norm.ppf(0.95) / root)
    np.testing.assert_allclose(
        np.log(upper / force_map.predict(*QUERY.T)), force_map.fit.state_sd * root * t, rtol=1e-4
    )


def test_with_a_shift_of_all_terms_nothing_but_the_scatter_is_carried_over():
    """Coefficients are then those of the new states alone."""
    points = np.vstack([NEW, BOX.at([[0.33, 0.2, 0.45], [0.81, 0.77, 0.2], [0.15, 0.62, 0.05], [0.52, 0.05, 0.95]])])
    new = impacts(TEN, points, 7)
    states = new.states
    joint = joint_fit(fm.CFM_3D, [impacts(THIRTY, OLD, 6).states, states], [replace(fm.CFM_3D, name="SHIFT")], 0.0)
    alone = np.linalg.lstsq(matrix(states.coordinates), states.log_force, rcond=None)[0]
    assert joint.form == fm.CFM_3D
    np.testing.assert_allclose(matrix(QUERY) @ joint.regression.coefficients, matrix(QUERY) @ alone, atol=1e-6)


def test_censored_states_say_at_least(old_map):
    """A censored fit lies above one to forces cut at the range, and is the plain fit where nothing is cut."""
    plain = fm.transfer_map(old_map, impacts(TEN, NEW, 2, conditions=CHANGED))
    cut = fm.transfer_map(old_map, impacts(TEN, NEW, 2, conditions=CHANGED, cut=260.0))
    states = cut.fit.states
    above = states.censored > 0
    assert above.sum() >= 2
    assert cut.fit.censored_fit
    assert not plain.fit.censored_fit
    assert np.all(cut.predict(*states.coordinates[above].T) > 0.95 * 260)
    near = np.log(cut.predict(*QUERY.T) / plain.predict(*QUERY.T))
    assert np.abs(near).max() < 0.25
    assert np.abs(near).mean() < 0.06
    assert cut.device_range == 260.0


def test_a_map_file_keeps_a_map_carried_over_to_the_last_bit_and_notices_changes(carried, tmp_path):
    path = tmp_path / "map.json"
    fm.write_map(carried, path)
    again = fm.read_map(path)
    bound = fm.ToleranceBound()
    np.testing.assert_array_equal(bound.upper(again, *QUERY.T), bound.upper(carried, *QUERY.T))
    assert fm.map_sha256(again) == fm.map_sha256(carried)
    assert again.fit.transfer.p_value == carried.fit.transfer.p_value
    assert again.fit.transfer.earlier[0].different == (("robot.safety_settings", "30 Nm", "10 Nm"),)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            lambda part: part["campaigns"][0]["measured_states"]["mean_ln_force"].__setitem__(3, 5.0),
            "do not belong together",
        ),
        (lambda part: part["campaigns"][0].__setitem__("shift", ["1", "d", "h"]), "column coefficients|column terms"),
        (lambda part: part.__setitem__("misfit_p", 0.9), "column misfit_p"),
        (lambda part: part.__setitem__("states_at_old_places", 4), "column states_at_old_places"),
        (lambda part: part["campaigns"].clear(), "cannot be used|column"),
        (lambda part: part.pop("terms"), "column terms: the entry is missing"),
        (lambda part: part.__setitem__("repeat_variance_ln", -1.0), "column repeat_variance_ln"),
    ],
)
def test_a_file_whose_earlier_states_were_changed_is_refused(carried, tmp_path, change, match):
    from forcemap.files import sha256

    path = tmp_path / "map.json"
    fm.write_map(carried, path)
    content = json.loads(path.read_text())
    content.pop("content_sha256")
    change(content["carried_over"])
    content["content_sha256"] = sha256(json.dumps(content, indent=1) + "\n")
    path.write_text(json.dumps(content, indent=1) + "\n")
    with pytest.raises(fm.InputError, match=match):
        fm.read_map(path)


def test_a_map_is_carried_over_again(carried, tmp_path):
    rng = np.random.default_rng(9)
    more = BOX.at(rng.permutation([[i / 9, (3 * i % 10) / 9, (7 * i % 10) / 9] for i in range(10)]) * 0.8 + 0.1)
    inside = more[carried.measured_range.contains(*more.T)]
    further = NEW[:5] + [0.03, 0.03, 0.0] * np.sign(BOX.at(0.5) - NEW[:5])
    twice = fm.transfer_map(carried, impacts(TEN, np.vstack([inside, further]), 4, conditions=CHANGED))
    assert [len(campaign.states) for campaign in twice.fit.transfer.earlier] == [len(OLD), len(NEW)]
    assert twice.fit.transfer.earlier[1].map_sha256 == fm.map_sha256(carried)
    assert twice.fit.between_states.degrees_of_freedom == len(OLD) + len(NEW) + len(inside) + 5 - 17
    path = tmp_path / "map.json"
    fm.write_map(twice, path)
    assert fm.map_sha256(fm.read_map(path)) == fm.map_sha256(twice)


def test_what_the_new_states_contradict_is_refused(old_map):
    reversed_trend = impacts(
        TEN, NEW, 3, shape=lambda x: np.exp(3 * (x[:, 0] - 0.7)) * np.exp(2 * (x[:, 0] - 0.7) ** 2 * 9)
    )
    with pytest.raises(fm.TransferRefused, match=r"contradict the earlier map.*measure 7 more states") as refused:
        fm.transfer_map(old_map, reversed_trend)
    assert refused.value.p_value < 0.05


def test_p_values_of_a_shape_that_is_kept_are_not_small():
    """A shift by the very terms: 5 % of campaigns are refused, but for chance."""
    rng, refused = np.random.default_rng(11), 0
    old, new = impacts(THIRTY, OLD, 0, sd=0).states, impacts(THIRTY, NEW, 0, sd=0).states
    shift = 0.1 - 0.3 * new.distance + 0.2 * new.height + 0.5 * new.speed
    for _ in range(200):
        drawn = [
            replace(states, log_force=states.log_force + by + rng.normal(0, 0.022, len(states)))
            for states, by in ((old, 0.0), (new, shift))
        ]
        refused += joint_fit(fm.CFM_3D, drawn, [SHIFT], 0.0).p_value < 0.05
    assert refused <= stats.binom.ppf(0.999, 200, 0.08)


def test_permission_is_that_of_the_new_hull_within_the_earlier_range(old_map):
    """New states that are slower, or lie elsewhere, are left out, and still speak against a speed."""
    slower = np.vstack([NEW, [[0.7, 0.3, 0.05], [0.95, 0.3, 0.2]]])
    force_map = fm.transfer_map(old_map, impacts(TEN, slower, 2, conditions=CHANGED))
    assert len(force_map.fit.left_out) == 2
    assert len(force_map.fit.states) == len(NEW)
    low, _ = force_map.measured_range.speeds(np.array([0.7]), np.array([0.3]))
    assert low[0] >= 0.1
    corners = np.array([[0.56, 0.14], [0.86, 0.46]])  # of the earlier map, not of the new states
    speeds = fm.safe_speed(
        force_map, *corners.T, limit=280.0, contact=fm.Contact.QUASI_STATIC, bound=fm.ToleranceBound()
    )
    assert list(speeds.outcome) == [fm.SpeedOutcome.OUTSIDE] * 2


def test_the_weakest_of_both_campaigns_counts(old_map):
    softer = replace(CHANGED, device=replace(CHANGED.device, stiffness=70e3, range=1500.0, pad="SH 30"))
    clamps = ["clamping", *["unconstrained"] * (3 * len(NEW) - 1)]
    force_map = fm.transfer_map(old_map, impacts(TEN, NEW, 2, conditions=softer, scenario=clamps))
    assert force_map.conditions.device.stiffness == 70e3
    assert force_map.device_range == 1500.0
    limit, contact = fm.force_limit("back_of_hand"), fm.Contact.TRANSIENT
    speed = fm.safe_speed(force_map, 0.7, 0.3, limit=limit, contact=contact, bound=fm.ToleranceBound())
    assert speed.outcome is fm.SpeedOutcome.UNCONFIRMED
    assert "clamp" in fm.sentence(speed.reason)
    first, *_ = [warning for warning in speed.basis.warnings if warning.kind is FindingKind.CARRIED_DIFFERENT]
    assert next(entry for entry, *_ in first.figure("changes")).startswith("device.")
    other = fm.transfer_map(
        fm.fit_force_map(impacts(THIRTY, OLD, 1, scenario=["clamping", *["unconstrained"] * (3 * len(OLD) - 1)])),
        impacts(TEN, NEW, 2, conditions=CHANGED),
    )
    speed = fm.safe_speed(other, 0.7, 0.3, limit=limit, contact=contact, bound=fm.ToleranceBound())
    assert speed.outcome is fm.SpeedOutcome.UNCONFIRMED
    unknown = impacts(TEN, NEW, 2, conditions=CHANGED, scenario=None, phase2_force=None)
    mixed = fm.transfer_map(old_map, unknown).phase_two
    assert mixed.unrecorded == 3 * len(NEW)
    assert not mixed.complete


def test_repeats_far_apart_before_are_said_after(old_map, tmp_path):
    torn = impacts(THIRTY, OLD, 1)
    force = torn.peak_force.copy()
    force[0] *= 1.2
    with pytest.raises(fm.FitError, match="impacts measured more than its bound"):  # higher than any scatter
        fm.transfer_map(fm.fit_force_map(replace(torn, peak_force=force)), impacts(TEN, NEW, 2, conditions=CHANGED))
    force[0] *= 0.8 / 1.2
    torn = replace(torn, peak_force=force)
    (state,) = torn.disagreeing_repeats
    once = fm.transfer_map(fm.fit_force_map(torn), impacts(TEN, NEW, 2, conditions=CHANGED))
    fm.write_map(once, tmp_path / "once.json")
    twice = fm.transfer_map(fm.read_map(tmp_path / "once.json"), impacts(THIRTY, spread(BOX) * 0.99 + 0.004, 5))
    for force_map in (once, twice):
        basis = fm.safe_speed(force_map, 0.7, 0.3, limit=280.0, bound=fm.ToleranceBound()).basis
        (apart,) = [finding for finding in basis.warnings if finding.kind is FindingKind.REPEATS_DISAGREE]
        assert apart.figure("names") == (f"{state} (of the earlier map)",)


@pytest.mark.parametrize(
    ("then", "now", "anew", "said"),
    [
        ("2025-03-01", "2026-03-01", "2025-12-01", None),
        ("2025-08-01", "2026-03-01", "2025-12-01", "2025-08-01"),
        ("2025-08-01", "", "2025-12-01", "2025-08-01"),
        ("", "2026-03-01", "2025-12-01", "2026-03-01"),  # whether it held is not known: as if it had been used now
        ("2025-03-01", "2026-03-01", "", "2026-03-01"),  # whether it was calibrated since is not known
        ("2025-03-01", "2026-03-01", "2024-01-01", "2026-03-01"),  # the new campaign's own is over
    ],
)
def test_a_calibration_that_had_expired_then_is_said_one_that_expired_since_is_not(then, now, anew, said):
    calibrated = replace(CONDITIONS.device, calibrated="2024-06-01")
    before = replace(CONDITIONS, date=then, device=calibrated)
    after = replace(CHANGED, date=now, device=replace(calibrated, calibrated=anew))
    old_map = fm.fit_force_map(impacts(THIRTY, OLD, 1, conditions=before))
    force_map = fm.transfer_map(old_map, impacts(TEN, NEW, 2, conditions=after))
    basis = fm.safe_speed(force_map, 0.7, 0.3, limit=280.0, bound=fm.ToleranceBound()).basis
    expired = [finding for finding in basis.warnings if finding.kind is FindingKind.CALIBRATION_EXPIRED]
    assert [finding.figure("date") for finding in expired] == ([said] if said else [])


def test_simulated_or_unbound_before_is_so_after(old_map):
    simulated = fm.fit_force_map(impacts(THIRTY, OLD, 1, conditions=replace(CONDITIONS, simulated=True)))
    assert fm.transfer_map(simulated, impacts(TEN, NEW, 2)).simulated
    half = impacts(THIRTY, OLD, 1, recording=[f"r{i}" for i in range(3 * len(OLD))])
    unbound = fm.transfer_map(fm.fit_force_map(half), impacts(TEN, NEW, 2))
    assert unbound.binding.state == "unbound"


def test_what_cannot_be_carried_over_is_said(old_map):
    with pytest.raises(fm.InputError, match="was not fitted here"):
        fm.transfer_map(fm.published_map(THIRTY), impacts(TEN, NEW, 2))
    with pytest.raises(
        fm.TooFewStates, match="found 5 new states, expected at least 6, 2 more than the shift has terms"
    ):
        fm.transfer_map(old_map, impacts(TEN, NEW[:5], 2))
    with pytest.raises(fm.FitError, match="no impact with role train"):
        fm.transfer_map(old_map, impacts(TEN, NEW, 2, role=["test"] * 3 * len(NEW)))
    with pytest.raises(fm.FitError, match="no new state within the measured range of the earlier map"):
        fm.transfer_map(old_map, impacts(TEN, NEW + np.array([1.0, 0.0, 0.0]), 2))
    low = impacts(THIRTY, OLD, 1)
    further = impacts(THIRTY, NEW, 4, shape=lambda x: 1.5, role=["test"] * 3 * len(NEW))
    parts = {
        "distance": "distance",
        "height": "height",
        "speed": "stated_speed",
        "peak_force": "peak_force",
        "role": "role",
    }
    both = {name: np.concatenate([getattr(low, field), getattr(further, field)]) for name, field in parts.items()}
    refuted = fm.fit_force_map(fm.ImpactDataset.from_arrays(**both))
    with pytest.raises(fm.FitError, match="11 of 11 of its test states lie above its bound"):
        fm.transfer_map(refuted, impacts(TEN, NEW, 2))


def test_states_at_old_places_and_a_doubtful_fit_are_said_first(old_map):
    again = OLD[np.unique(OLD[:, :2], axis=0, return_index=True)[1]][:11]
    force_map = fm.transfer_map(old_map, impacts(TEN, again, 6, conditions=CHANGED))
    kinds = [warning.kind for warning in force_map.fit.transfer.warnings]
    assert FindingKind.CARRIED_AT_OLD_PLACES in kinds
    assert (FindingKind.CARRIED_DOUBTFUL in kinds) == (force_map.fit.transfer.p_value < 0.5)


def test_accuracy_leaves_a_new_state_out_of_the_joint_fit(carried):
    """Against a joint fit to the others, its variances as in the whole fit."""
    accuracy = fm.leave_one_state_out(carried)
    assert accuracy.states == len(NEW)
    old, new, data = carried.fit.transfer.earlier[0].states, carried.fit.states, carried.fit.data()
    ratio = data.correlation / (1 - data.correlation)
    v = np.eye(len(ratio)) + np.where(data.place[:, None] == data.place, np.sqrt(np.outer(ratio, ratio)), 0.0)
    for i in (0, 6):
        left = np.arange(len(ratio)) != len(old) + i
        weight, x = np.linalg.inv(v[np.ix_(left, left)]), data.design
        b = np.linalg.solve(x[left].T @ weight @ x[left], x[left].T @ weight @ data.mean[left])
        from forcemap.maps.accuracy import left_out_predictions

        assert left_out_predictions(carried)[i] == pytest.approx(np.exp(x[len(old) + i] @ b), rel=1e-6)
    assert new.name


def test_a_plan_avoids_old_places_and_what_the_device_cannot_measure(old_map):
    plan = plan_transfer(old_map, states=9, device=fm.Device(range=400.0), repeats=2)
    states = np.column_stack([plan.distance, plan.height, plan.speed])[::2]
    assert len(states) == 9
    assert len(plan) == 18
    assert set(plan.role) == {"train"}
    away = np.abs(states[:, None, :2] - OLD[:, :2]).max(axis=2).min(axis=1)
    assert away.min() > 0.03
    assert old_map.measured_range.contains(*states.T).all()
    assert np.all(1.1 * old_map.predict(*states.T) <= 397.0)
    assert np.all(np.diff(plan.expected_force) >= 0)
    assert plan.left_out[0].figure("states") > 0
    assert plan.bound_width == pytest.approx(expected_transfer_width(old_map, states), rel=0.05)
    narrow = plan_transfer(old_map, width=plan.bound_width * 1.02)
    assert len(narrow.states) <= 9
    with pytest.raises(fm.InputError, match=r"width: found 1 %, but 15 new states are expected to give"):
        plan_transfer(old_map, width=0.01)
    with pytest.raises(fm.InputError, match="says nothing of others"):
        plan_transfer(old_map, speeds=(0.05, 0.3))


def test_the_commands_plan_and_carry_over(tmp_path, capsys, old_map):
    source, target, folder = tmp_path / "old.json", tmp_path / "new.json", tmp_path / "campaign"
    fm.write_map(old_map, source)
    assert run(["plan", str(folder), "--transfer", str(source), "--device-range-N", "1000"]) == 0
    plan, planned = fm.read_plan(folder), capsys.readouterr().out
    assert len(plan.states) == 9
    assert "the shift (1, d, h, v) is known best" in " ".join(planned.split())
    assert "in the order of the force that the earlier map expects, smallest first" in planned
    assert f"forcemap transfer {source} {folder} -o" in " ".join(planned.split())
    points = np.unique(np.column_stack([plan.distance, plan.height, plan.speed]), axis=0)
    table = tmp_path / "new.csv"
    fm.write_dataset(impacts(TEN, points, 24), table)
    arguments = ["transfer", str(source), str(table), "--device-spring-N-per-mm", "75"]
    assert run([*arguments, "-o", str(target)]) == 0
    said = capsys.readouterr().out
    assert "CARRIED OVER: the shift" in said
    assert "9 new states" in said
    assert f"map written to {target}" in said
    assert run([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["outcome"] == "carried_over"
    assert answer["map"]["map_sha256"] == fm.map_sha256(fm.read_map(target))
    assert answer["earlier"][0]["map_sha256"] == fm.map_sha256(old_map)
    assert (
        run(
            [
                "speed",
                str(target),
                "--distance",
                "0.7",
                "--height",
                "0.3",
                "--limit-N",
                "300",
                "--contact",
                "quasi-static",
            ]
        )
        == 0
    )
    assert "carried over" in capsys.readouterr().out
    fm.write_dataset(impacts(TEN, points, 5, shape=lambda x: np.exp(25 * (x[:, 0] - 0.7) ** 2)), table)
    assert run([*arguments, "-o", str(tmp_path / "none.json")]) == 1
    assert capsys.readouterr().out.startswith("NOT CARRIED OVER")
    assert not (tmp_path / "none.json").exists()
    assert run([*arguments, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["outcome"] == "refused"


def test_states_of_an_earlier_campaign_are_no_new_ones(old_map, carried):
    """Counted twice, they would make the bound too low."""
    with pytest.raises(fm.FitError, match="found 27 states of an earlier campaign among the new ones"):
        fm.transfer_map(old_map, impacts(THIRTY, OLD, 1))
    with pytest.raises(fm.FitError, match="found 11 states of an earlier campaign"):
        fm.transfer_map(carried, impacts(TEN, NEW, 2, conditions=CHANGED))
    assert fm.transfer_map(old_map, impacts(THIRTY, OLD, 12)).fit.transfer.near == len(OLD)


@pytest.mark.parametrize("count", [3, 4])
def test_a_few_places_do_not_tell_whether_the_shift_fits(old_map, count):
    """Whatever the force does between three places, a shift with d and h follows it."""
    at = BOX.at([[0.1, 0.1, 0], [0.9, 0.2, 0], [0.4, 0.9, 0], [0.9, 0.9, 0], [0.1, 0.9, 0]])
    points = np.vstack([at[:count] + np.array([0, 0, v]) for v in (0.02, 0.1, 0.2, 0.28)])
    with pytest.raises(fm.TooFewStates, match=f"found new states at {count} places, expected at least 5"):
        fm.transfer_map(old_map, impacts(THIRTY, points, 2))
    joined = np.vstack([points, at + np.array([0, 0, 0.15])])
    assert fm.transfer_map(old_map, impacts(THIRTY, joined, 2)).fit.place_effect.places == 5


def test_an_earlier_map_without_a_bound_of_its_own_is_not_carried_over():
    few = fm.fit_force_map(impacts(THIRTY, OLD[np.round(np.linspace(0, 26, 10)).astype(int)], 1))
    with pytest.raises(fm.BoundNotAvailable, match="earlier map cannot be carried over: found 1 residual degrees"):
        fm.transfer_map(few, impacts(TEN, NEW, 2))
    with pytest.raises(fm.BoundNotAvailable, match="earlier map cannot be carried over"):
        plan_transfer(few)


def test_discarded_impacts_are_not_forgotten():
    discarded = fm.fit_force_map(impacts(THIRTY, OLD, 1, cut=300.0), impacts=fm.CensoredImpacts.DISCARD)
    with pytest.raises(fm.FitError, match=r"15 impacts above the device range were discarded.*fit it again with them"):
        fm.transfer_map(discarded, impacts(TEN, NEW, 2))


def test_a_wide_tolerance_of_repeats_does_not_widen_the_earlier_range(old_map):
    slower = NEW - [0.0, 0.0, 0.2] * (NEW[:, 2:] > 0.2)
    slower[:, 2] = np.maximum(slower[:, 2], 0.03)
    data = impacts(THIRTY, np.vstack([NEW + 0.001, slower]), 2, conditions=replace(CONDITIONS, speed_tolerance=0.15))
    force_map = fm.transfer_map(old_map, data)
    assert force_map.fit.states.speed.min() >= 0.09


def test_the_lowest_speed_does_not_creep_down(old_map, tmp_path):
    """New states may be slower by as much as repeats are; the range keeps the lowest speed of all earlier campaigns."""
    slower = NEW - np.array([0.0, 0.0, 0.008]) * (NEW[:, 2:] < 0.11)
    once = fm.transfer_map(old_map, impacts(THIRTY, slower, 2))
    assert once.fit.states.speed.min() == pytest.approx(0.092)
    path = tmp_path / "map.json"
    fm.write_map(once, path)
    for force_map in (once, fm.read_map(path)):
        assert force_map.measured_range.lowest[2] == 0.1
        assert force_map.measured_range.points[:, 2].min() == 0.1


def test_states_left_out_are_not_called_censored_or_without_impacts(old_map):
    points = np.vstack([NEW, [[0.7, 0.3, 0.5], [0.97, 0.3, 0.2]]])
    force_map = fm.transfer_map(old_map, impacts(TEN, points, 2, conditions=CHANGED, cut=330.0))
    assert force_map.fit.repeats == (3, 3)
    out = force_map.fit.left_out
    assert len(out) == 2
    speed = fm.safe_speed(force_map, 0.7, 0.3, limit=250.0, contact=fm.Contact.QUASI_STATIC, bound=fm.ToleranceBound())
    notes = [note for note in speed.basis.notes if note.kind is FindingKind.CENSORED_NOT_IN_FIT]
    assert [note.figure("left_out") for note in notes] == [out.name[int(np.argmax(out.censored))]]


@pytest.mark.parametrize("seed", [0, 4])
def test_partly_censored_states_do_not_disturb_the_test_of_the_shift(old_map, seed):
    """It rests on the uncensored repeats of a state, as the earlier map's plain fit does."""
    share = np.column_stack([np.random.default_rng([seed, k]).permutation(20) for k in range(3)]) / 19
    data = impacts(TEN, BOX.at(0.02 + 0.96 * share), seed, conditions=CHANGED)
    force, state = data.peak_force, data.states
    reached = float(np.sort(force[data.state == state.name[int(np.argsort(state.force)[-4])]])[1])
    columns = {"distance": data.distance, "height": data.height, "speed": data.speed, "conditions": CHANGED}
    cut = fm.ImpactDataset.from_arrays(
        peak_force=np.minimum(force, reached), censored=force >= reached, state=data.state, **columns
    )
    assert np.any((cut.states.censored > 0) & (cut.states.impacts > 0))
    joint = joint_fit(fm.CFM_3D, [old_map.fit.states, cut.states], [SHIFT], 1.6e-5)
    known = cut.states.uncensored
    plain = replace(known, censored=np.zeros(len(known), dtype=np.int64))
    again = joint_fit(fm.CFM_3D, [old_map.fit.states, plain], [SHIFT], 1.6e-5)
    assert joint.p_value == pytest.approx(again.p_value, rel=1e-9)


def test_a_map_linear_in_ln_v_is_shifted_by_ln_v(tmp_path):
    old = fm.fit_force_map(impacts(THIRTY, OLD, 1), form=fm.LOG_SPEED)
    plan = plan_transfer(old, repeats=1)
    assert "ln(v)" in str(plan.note.figure("terms"))
    points = np.column_stack([plan.distance, plan.height, plan.speed])
    force_map = fm.transfer_map(old, impacts(THIRTY, points, 5))
    assert force_map.form == fm.LOG_SPEED
    path = tmp_path / "map.json"
    fm.write_map(force_map, path)
    assert fm.map_sha256(fm.read_map(path)) == fm.map_sha256(force_map)


def test_a_map_is_not_checked_with_the_states_that_it_was_carried_over_from(carried):
    with pytest.raises(fm.InputError, match="found impacts that the map was fitted to"):
        fm.check_map(carried, impacts(THIRTY, OLD, 1))


@pytest.fixture
def campaign_with_an_earlier_map(tmp_path, old_map):
    folder = tmp_path / "changed-robot"
    (folder / "maps").mkdir(parents=True)
    fm.write_map(old_map, folder / EARLIER_MAP)
    table = impacts(TEN, NEW, 2, conditions=CHANGED)
    fm.write_dataset(table, folder / "impacts.csv")
    (folder / "campaign.toml").write_text(campaign_text(CHANGED))
    return folder


def test_a_campaign_that_holds_an_earlier_map_carries_it_over_everywhere(campaign_with_an_earlier_map, capsys, carried):
    folder = campaign_with_an_earlier_map
    assessed = fm.assess_campaign(folder, limits=[fm.force_limit("back_of_hand")])
    assert assessed.force_map.fit.transfer.p_value == pytest.approx(carried.fit.transfer.p_value)
    assert FindingKind.CARRIED_OVER in [finding.kind for finding in assessed.findings]
    assert EARLIER_MAP in [file.path for file in assessed.inputs]
    assert fitted_campaign(folder).force_map.fit.transfer is not None
    assert run(["fit", str(folder)]) == 2
    assert "which its few states carry over: forcemap transfer" in capsys.readouterr().err
    place = ["--distance", "0.7", "--height", "0.3", "--limit-N", "300", "--contact", "quasi-static", "--json"]
    assert run(["speed", str(folder), *place]) == 0
    by_folder = json.loads(capsys.readouterr().out)
    assert run(["transfer", str(folder / EARLIER_MAP), str(folder), "-o", str(folder / "maps" / "new.json")]) == 0
    capsys.readouterr()
    assert run(["speed", str(folder / "maps" / "new.json"), *place]) == 0
    assert json.loads(capsys.readouterr().out)["speed_mps"] == by_folder["speed_mps"]
    assert run(["report", str(folder), "--area", "back_of_hand", "-o", str(folder / "report.html")]) == 0
    assert "carried over from" in (folder / "report.html").read_text()
    assert run(["evaluate", str(folder)]) == 0


@pytest.mark.parametrize("option", [["--form", "LOG_SPEED"], ["--discard-censored"]])
def test_a_map_carried_over_has_its_own_form_and_every_impact(campaign_with_an_earlier_map, capsys, option):
    assert run(["fit", str(campaign_with_an_earlier_map), *option]) == 2
    assert "this campaign carries this map over, with its form and every impact" in capsys.readouterr().err


def test_without_the_earlier_map_the_few_states_are_refused(campaign_with_an_earlier_map, capsys):
    (campaign_with_an_earlier_map / EARLIER_MAP).write_text("{}")
    assert run(["fit", str(campaign_with_an_earlier_map)]) == 2
    assert "maps/earlier.json" in capsys.readouterr().err
    (campaign_with_an_earlier_map / EARLIER_MAP).unlink()
    point = ["--distance", "0.7", "--height", "0.3", "--limit-N", "300", "--contact", "quasi-static"]
    assert run(["speed", str(campaign_with_an_earlier_map), *point]) == 2


def test_what_passes_unseen_between_the_new_states_is_said_first(old_map, tmp_path, capsys):
    """At two speeds no test of the shift sees what the changed robot does between them."""
    ends = NEW.copy()
    ends[:, 2] = np.where(np.arange(len(NEW)) % 2, 0.1, 0.4)
    data = impacts(THIRTY, ends, 6, shape=lambda x: np.exp(0.2 * 4 * (x[:, 2] - 0.1) * (0.4 - x[:, 2]) / 0.09))
    force_map = fm.transfer_map(old_map, data)
    speed = fm.safe_speed(force_map, 0.7, 0.3, limit=250.0, contact=fm.Contact.QUASI_STATIC, bound=fm.ToleranceBound())
    unseen = [warning for warning in speed.basis.warnings if warning.kind is FindingKind.FORM_UNSEEN_BETWEEN]
    assert [[gap.figure("along") for gap in warning.also].count("speed") for warning in unseen] == [1]
    source, table = tmp_path / "old.json", tmp_path / "new.csv"
    fm.write_map(old_map, source)
    fm.write_dataset(data, table)
    assert run(["transfer", str(source), str(table), "--device-spring-N-per-mm", "75"]) == 0
    verdict, *doubts = capsys.readouterr().out.partition("\n  from ")[0].split("\n  ! ")
    assert verdict.startswith("CARRIED OVER: the shift")
    assert any(doubt.startswith("LITTLE WAS MEASURED BETWEEN") for doubt in doubts)


def test_six_more_states_are_added_to_the_plan(tmp_path, capsys, old_map):
    source, folder = tmp_path / "old.json", tmp_path / "campaign"
    fm.write_map(old_map, source)
    arguments = ["plan", str(folder), "--transfer", str(source), "--device-range-N", "1000"]
    assert run(arguments) == 0
    first = fm.read_plan(folder)
    assert run(arguments[:4]) == 0
    assert "6 new states beside the 9 planned before" in " ".join(capsys.readouterr().out.split())
    whole = fm.read_plan(folder)
    assert whole.states[:9] == first.states
    assert len(whole.states) == 15
    places = np.unique(np.column_stack([whole.distance, whole.height]), axis=0)
    apart = np.abs(places[:, None] - places).max(axis=2) + np.eye(len(places))
    assert apart.min() > 0.02
    assert run([*arguments[:4], "--states", "15"]) == 2
    assert "expected more than the 15 that are planned already" in capsys.readouterr().err
    fm.write_map(fm.fit_force_map(impacts(THIRTY, OLD, 8)), source)
    assert run(arguments[:4]) == 2
    assert (
        "has a plan or an earlier map already, and not one for this map (maps/earlier.json)" in capsys.readouterr().err
    )


@pytest.mark.parametrize("states", [9, 12])
def test_a_plan_lies_at_speeds_and_places_between_the_ends(old_map, states):
    plan = plan_transfer(old_map, states=states, repeats=1)
    assert np.unique(plan.speed).size >= 3
    assert plan.places == states
    inside = (plan.distance > 0.58) & (plan.distance < 0.84) & (plan.height > 0.16) & (plan.height < 0.44)
    assert inside.any()


def test_a_map_is_not_carried_over_to_another_direction(old_map):
    """There a shift misses up to 12 % of the force."""
    down = fm.fit_force_map(impacts(THIRTY, OLD, 1, conditions=replace(CONDITIONS, direction="down")))
    with pytest.raises(fm.FitError, match=r"directions differ.*'down'.*'outward'.*measure that one by itself"):
        fm.transfer_map(down, impacts(TEN, NEW, 2, conditions=replace(CHANGED, direction="outward")))
    with pytest.raises(fm.FitError, match=r"holds for 'down'.*not stated; .*state contact.direction"):
        fm.transfer_map(down, impacts(TEN, NEW, 2, conditions=replace(CHANGED, direction=" ")))
    unstated = fm.fit_force_map(impacts(THIRTY, OLD, 1, conditions=replace(CONDITIONS, direction="")))
    with pytest.raises(fm.FitError, match=r"not stated, the new .*'down'; .*state .* of the earlier campaign"):
        fm.transfer_map(unstated, impacts(TEN, NEW, 2, conditions=replace(CHANGED, direction="down")))
    same = fm.transfer_map(down, impacts(TEN, NEW, 2, conditions=replace(CHANGED, direction="Vertically  down")))
    assert same.conditions.direction == "Vertically  down"
    kinds = [warning.kind for warning in same.fit.transfer.warnings]
    assert FindingKind.CARRIED_DIFFERENT in kinds


def test_a_map_whose_forces_drifted_is_not_carried_over():
    first, again = impacts(THIRTY, OLD, 1), impacts(THIRTY, OLD[::5], 1, shape=lambda x: 1.0)
    parts = {"distance": "distance", "height": "height", "speed": "stated_speed", "peak_force": "peak_force"}
    both = {name: np.concatenate([getattr(first, field), getattr(again, field)]) for name, field in parts.items()}
    both["role"] = np.array(["train"] * len(first) + ["test"] * len(again))
    rows = slice(len(first), None)
    states = {tuple(x): f for x, f in zip(first.states.coordinates.round(6).tolist(), first.states.force, strict=True)}
    places = np.column_stack([again.distance, again.height, again.speed]).round(6).tolist()
    both["peak_force"][rows] = [1.2 * states[tuple(place)] for place in places]
    drifted = fm.fit_force_map(fm.ImpactDataset.from_arrays(**both))
    assert drifted.fit.drift.significant
    with pytest.raises(fm.FitError, match="forces drifted while it was measured"):
        fm.transfer_map(drifted, impacts(TEN, NEW, 2))


def test_the_impacts_of_the_earlier_campaign_are_no_new_ones_though_a_repeat_of_each_is_missing(old_map):
    """Another mean for each state, at the same places: the highest of the repeats tells two thirds of them."""
    repeated = impacts(THIRTY, np.repeat(spread(BOX), 3, axis=0), 1)
    names = [f"s{i // 3}" for i in range(len(repeated))]
    given = {name: getattr(repeated, name) for name in ("distance", "height", "speed", "scenario", "phase2_force")}
    force = repeated.peak_force * np.exp(np.random.default_rng(3).normal(0, 0.004, len(repeated)))
    earlier = fm.ImpactDataset.from_arrays(**given, peak_force=force, state=names, conditions=CONDITIONS)
    without = np.arange(len(force)) % 3 != 2
    again = fm.ImpactDataset.from_arrays(
        **{name: column[without] for name, column in given.items()},
        peak_force=force[without],
        state=np.array(names)[without],
        conditions=CHANGED,
    )
    with pytest.raises(fm.FitError, match="states of an earlier campaign among the new ones"):
        fm.transfer_map(fm.fit_force_map(earlier), again)


@pytest.mark.parametrize(("factor", "name"), [(1.0, "c-0"), (1.5, "c-0"), (1.5, "t-0")])
def test_a_map_that_an_impact_contradicts_is_not_carried_over(factor, name):
    """One of six is no chance: it ends every speed of the map, and those of a map carried over from it."""
    points = np.vstack([BOX.at(share) for share in (0.2, 0.35, 0.5, 0.6, 0.75, 0.8)])
    made = impacts(THIRTY, OLD, 1)
    force = printed_force(THIRTY, *points.T) * np.array([factor, 1, 1, 1, 1, 1])
    both = fm.ImpactDataset.from_arrays(
        distance=np.append(made.distance, points[:, 0]),
        height=np.append(made.height, points[:, 1]),
        speed=np.append(made.speed, points[:, 2]),
        peak_force=np.append(made.peak_force, force),
        state=[*made.state, *(f"{name[:-1]}{k}" for k in range(6))],
        role=["train"] * len(made) + ["test"] * 6,
        scenario=["unconstrained"] * (len(made) + 6),
        phase2_force=[10.0] * (len(made) + 6),
        conditions=CONDITIONS,
    )
    old, new = fm.fit_force_map(both), impacts(TEN, NEW, 2, conditions=CHANGED)
    if factor == 1.0:
        assert fm.transfer_map(old, new).fit.transfer
        return
    with pytest.raises(fm.FitError, match=f"impacts measured more than its bound: {name}"):
        fm.transfer_map(old, new)


def test_carried_over_again_a_map_does_not_creep_outwards(old_map):
    """New states lie within the range of every earlier campaign, not of the last alone."""
    points = NEW.copy()
    points[:, 0] += BOX.high[0] + 0.0045 - points[:, 0].max()
    first = fm.transfer_map(old_map, impacts(TEN, points, 30, sd=0.005))
    assert not first.fit.left_out.name
    further = points + np.array([0.0045, 0.005, 0.0])
    second = fm.transfer_map(first, impacts(TEN, further, 31, sd=0.005))
    assert len(second.fit.left_out) >= 1
    assert second.measured_range.highest[0] <= BOX.high[0] + 0.005 + 1e-9


def test_a_plan_replaces_no_earlier_map_of_the_folder(tmp_path, capsys, old_map):
    source, folder = tmp_path / "old.json", tmp_path / "campaign"
    (folder / "maps").mkdir(parents=True)
    (folder / EARLIER_MAP).write_text("another")
    fm.write_map(old_map, source)
    assert run(["plan", str(folder), "--transfer", str(source), "--device-range-N", "1000"]) == 2
    assert "has a plan or an earlier map already" in capsys.readouterr().err
    assert (folder / EARLIER_MAP).read_text() == "another"
    assert run(["plan", str(tmp_path / "new"), "--transfer", "map"]) == 2
    ranges = ["--distances-m", "0.5,0.8", "--heights-m", "0.1,0.4", "--speeds-mps", "0.1,0.4"]
    assert run(["plan", str(tmp_path / "new"), "--transfer", "map", *ranges]) == 2
    assert "to carry a map over, its file, as --transfer map.json" in capsys.readouterr().err


def test_the_page_shows_a_map_carried_over_with_censored_impacts(campaign_with_an_earlier_map):
    table = impacts(TEN, NEW, 2, conditions=CHANGED, cut=260.0)
    fm.write_dataset(table, campaign_with_an_earlier_map / "impacts.csv")
    fitted = fitted_campaign(campaign_with_an_earlier_map)
    assert fitted.force_map.fit.censored_fit
    assert FitAnswer.of_fit(fitted.dataset, fitted.force_map, fitted.accuracy).form.startswith("CFM_3D")
    assert not isinstance(fm.assess_campaign(campaign_with_an_earlier_map).force_map, Missing)
