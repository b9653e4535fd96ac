"""What maps and limits say of made-up campaigns, ranges, roots and tables: every figure, on both sides of what decides.

tests/map_figures.csv holds them. Whether they are right is asked elsewhere; that none of them moves unnoticed, here.
Whoever changes one on purpose writes the table anew (`python tests/map_figures.py`) and looks at what changed.
"""

from __future__ import annotations

import dataclasses
import math
import tempfile
from pathlib import Path

import numpy as np
from oracle import simulate, training_grid

import forcemap as fm
import recorded
import truths
from chain import figures
from forcemap.campaigns.dataset import States
from forcemap.limits.body_areas import BodyArea, body_regions, identifier
from forcemap.limits.covers import cover_estimate, payload_estimate
from forcemap.limits.device_spring import device_suitability
from forcemap.limits.pfl import pfl_energy, pfl_governing_speed_limit
from forcemap.maps.accuracy import Accuracy
from forcemap.maps.bounds import contradiction, margins, tolerance_nodes, weakness
from forcemap.maps.censored import StateData, _log_likelihood, censored_regression
from forcemap.maps.convex_hull import half_spaces
from forcemap.maps.form_test import form_test
from forcemap.maps.forms import SpeedProfile
from forcemap.maps.measured_range import MeasuredRange
from forcemap.maps.places import correlations, place_effect, place_regression, places_between, whitened
from forcemap.maps.regression import holm, least_squares
from refusals import files
from test_map_file import resealed

TABLE = Path(__file__).with_suffix(".csv")
SEED = 202692
BOX = truths.Box(np.array([0.52, 0.14, 0.10]), np.array([0.89, 0.46, 0.40]))
DEVICE = fm.Device(range=500.0, error=3.0, stiffness=75e3)


class Words(str):
    """What is said in words."""


def plans(rng):
    """States of plans of many kinds, shape (n, 3)."""
    wide, number = truths.spread(BOX), np.arange(32)
    yield "wide", wide
    yield "paper", truths.paper(BOX)
    yield "few", wide[:13]
    yield "alone", BOX.at(np.stack([number, number * 11 % 32, number * 7 % 32], axis=1) / 31)
    yield "near", np.vstack([wide, [[0.7, 0.3, 0.2], [0.721, 0.3, 0.3], [0.7, 0.3299, 0.3], [0.67, 0.33, 0.3]]])
    yield "one height", wide * [1, 0, 1] + [0, 0.3, 0]
    for places in (6, 9, 12, 16):
        at = rng.uniform(BOX.low, BOX.high, (40, 3))
        at[:, :2] = at[:places, :2][np.arange(40) % places]
        yield f"{places} places", at
    jittered = truths.paper(BOX)
    yield "jittered", jittered + rng.normal(0, [0.004, 0.004, 0.01], jittered.shape)


def form_tests():
    """Truths that depart upwards and downwards at a distance, a height, a speed, a place, or bend."""
    rng = np.random.default_rng(SEED)
    departures = {
        "none": lambda d, h, v: 0 * d,
        "hollow": lambda d, h, v: -0.2 * np.exp(-(((d - 0.7) / 0.05) ** 2)),
        "ridge": lambda d, h, v: 0.2 * np.exp(-(((h - 0.3) / 0.05) ** 2)),
        "slow": lambda d, h, v: -0.15 * (v < 0.14),
        "kink": lambda d, h, v: 2.0 * np.maximum(v - 0.3, 0),
        "place": lambda d, h, v: -0.3 * ((d == d[3]) & (h == h[3])),
    }
    for plan, at in plans(rng):
        for name, departure in departures.items():
            for form in (fm.CFM_3D, fm.CFM_2D, fm.LOG_SPEED) if plan in ("wide", "12 places") else (fm.CFM_3D,):
                level = np.log(fm.published_map("ur10e").predict(*at.T)) + departure(*at.T)
                level += rng.normal(0, 0.02, len(at))
                cut = rng.uniform(size=len(at)) < (0.1 if name == "none" else 0.0)
                names = np.array([f"s{i:02d}" for i in range(len(at))])
                sd = 0.02 if plan == "paper" else 0.061
                found = form_test(form, States.of(at, np.exp(level), names, cut), sd)
                yield from said_of_a_form(f"{plan} {name} {form.name}", found)


def said_of_a_form(key, found):
    """Each departure in a row; what is said first by its kind."""
    for each in found.departures:
        yield f"{key} {each.along}", [each.tested, each.p_value]
        if not key.startswith("paper"):  # of three levels, every departure along them is the same one
            yield f"{key} {each.along} at", [each.distance, each.height, each.speed, each.effect]
            yield f"{key} {each.along} said", each.finding
    counts = [found.states, found.left_out, found.near, found.slow_places, found.slowest, found.p_value]
    yield key, [*counts, len(found.significant), found.state_sd]
    said = [" ".join(each) for each in (found.gaps, found.not_tested, [each.kind.value for each in found.warnings])]
    yield f"{key} unseen", Words(" | ".join(said))
    if not key.startswith("paper"):
        yield f"{key} finding", found.finding


def ranges():
    rng = np.random.default_rng([SEED, 1])
    grid = training_grid("ur10e")
    needle = [[d, h, v] for d, v in ((0.9, 0.3), (0.899, 0.4), (0.899, 0.28)) for h in (0.1, 0.3, 0.5)]
    kinds = {"grid": grid, "needle": np.array(needle), "height": grid[grid[:, 1] == 0.30], "state": grid[:1]}
    kinds |= {"speed": grid[grid[:, 2] == 0.30], "two": grid[[0, -1]], "line": grid[:3], "random": grid}
    for step in (0.9e-5, 1.1e-5, 1e-3):
        kinds[f"thin {step}"] = grid[grid[:, 1] == 0.30] + [0, 1, 0] * rng.choice([0, step], (9, 1))
    for count in (4, 7, 20, 60):
        kinds[f"{count}"] = rng.uniform([0.4, 0.0, 0.1], [0.9, 0.5, 0.5], (count, 3))
    for name, points in kinds.items():
        found = MeasuredRange(points)
        yield f"{name} ends", [*found.lowest, *found.highest]
        facets = np.unique(np.round(found.facets, 6) + 0.0, axis=0)  # a face of many points is cut in one way or other
        if np.linalg.matrix_rank(points - points[0]) != 1:  # around a line they may stand turned in any way
            yield f"{name} facets", list(np.sort(facets, axis=0).T)
        places = np.vstack([points[:4, :2], points.mean(axis=0)[:2], rng.uniform([0.4, 0.0], [0.9, 0.5], (7, 2))])
        off = np.concatenate([np.add(places, by) for by in ((0, 0), (8e-10, 0), (0, -8e-10), (3e-9, 0), (0, 3e-9))])
        for number, part in enumerate(np.array_split(off, 5)):
            low, high = found.speeds(*part.T)
            yield f"{name} speeds {number}", [low, high]
            inside = [found.contains(*part.T, each + step) for each in (low, high) for step in (-3e-9, -8e-10, 8e-10)]
            yield f"{name} inside {number}", inside


def hulls():
    """How many planes, and their figures sorted: points just off a face, few and many, thin and thick."""
    rng = np.random.default_rng([SEED, 2])
    cube = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, -1).T
    kinds = {f"off by {off}": np.vstack([cube, [0.4, 0.3, 1 + off]]) for off in (-1e-9, 0.5e-10, 2e-10, 1e-3)}
    kinds |= {f"of {count}": rng.uniform(3, 4, (count, 3)) for count in (4, 5, 12, 150, 151)}
    kinds |= {f"thin {step}": cube * [1, 1, step] for step in (0.9e-6, 1.1e-6, 1e-4)}
    for name, points in kinds.items():
        found = half_spaces(points)
        yield name, [len(found), *np.abs(found).sum(axis=0)]
        yield f"{name} sorted", list(np.sort(found, axis=0).T)


def places():
    rng = np.random.default_rng([SEED, 3])
    for count, of in ((12, 4), (27, 9), (27, 27), (40, 12), (40, 40), (60, 5), (9, 9), (9, 3)):
        for share in (0.0, 0.5, 0.98):
            at = rng.uniform(BOX.low, BOX.high, (count, 3))
            place = np.arange(count) % of
            at[:, :2] = at[:of, :2][place]
            noise = math.sqrt(share) * rng.normal(size=of)[place] + math.sqrt(1 - share) * rng.normal(size=count)
            for form in (fm.CFM_2D, fm.CFM_3D):
                design = form.design(*at.T)
                found = place_effect(design, 5 + 0.03 * noise, place)
                key = f"{count} of {of} {share} {form.name}"
                yield key, found
                yield f"{key} between", [places_between(design, place)]
                rows = whitened(design, place, found.correlation)
                yield f"{key} white", list(rows.T)
                if np.linalg.matrix_rank(design) == design.shape[1]:
                    yield f"{key} fit", place_regression(design, 5 + 0.03 * noise, place, found.correlation)
    yield "alike", correlations(np.array([0, 1, 0, 2]), 0.3)


def regressions():
    rng = np.random.default_rng([SEED, 4])
    for n, p in ((3, 3), (4, 3), (30, 5), (12, 9)):
        design, response = rng.normal(size=(n, p)) * 10 ** rng.uniform(-3, 3, p), rng.normal(size=n)
        for name, y in (("", response), (" known in part", np.where(np.arange(n) == 1, np.nan, response))):
            found = least_squares(design, response)
            found = dataclasses.replace(found, response=y)
            yield f"{n} {p}{name}", found
    yield "constant", [dataclasses.replace(found, response=np.ones(n)).r_squared]
    for m in (0, 1, 2, 6):
        yield f"holm {m}", holm(rng.uniform(0, 0.4, m) ** 2)
    yield "holm of equal ones", holm(np.array([0.2, 0.01, 0.2, 0.01, 0.7]))


def likelihoods():
    """Of states with repeats known and at least so much, near the bound and far from it, with and without noise."""
    rng = np.random.default_rng([SEED, 10])
    for number, (noise, effect) in enumerate(((0.0, 1e-3), (1e-4, 1e-3), (1e-3, 1e-3), (1e-2, 1e-5), (1e-4, 1e-8))):
        m, sd = 24, math.sqrt(noise + effect)
        impacts, censored = np.arange(m) % 4, (np.arange(m) // 4) % 3
        censored[impacts + censored == 0] = 1
        level = np.linspace(4.9, 5.1, m)
        mean = np.where(impacts > 0, level + rng.normal(0, sd, m), np.nan)
        threshold = np.where(censored > 0, level + rng.choice([-30, -1, 0, 2, 9], m) * sd, np.nan)
        columns = np.column_stack([np.ones(m), rng.normal(size=m)])
        data = StateData(
            columns, mean, impacts, censored, threshold, noise, np.arange(m) // 3, np.full(m, 0.3 * (number > 1))
        )
        for part, each in enumerate(_log_likelihood(data, np.array([5.0, 0.01]), sd**2, effect)):
            for half in (0, 1):
                yield f"{number} {part} {half}", sd**part * each[half::2]
        yield f"{number} noise", [data.noise_of_means]
        whole = data.with_places
        yield f"{number} places", [*np.abs(whole.design).sum(axis=0), whole.impacts.sum(), np.isnan(whole.mean).sum()]
        if 0 < number < 4:  # with the others the top of the likelihood is rough
            yield f"{number} fit", censored_regression(dataclasses.replace(data, repeat_variance=noise or 1e-4))


def roots():
    rng = np.random.default_rng([SEED, 5])
    for degree in range(4):
        coefficients = np.round(rng.normal(0, 4, (degree + 1, 60)), 1)
        coefficients[:, ::7] = np.round(coefficients[:, ::7] / 4)
        profile = SpeedProfile(tuple(coefficients))
        rise = profile.first_rise(np.where(np.arange(60) % 5, 1.0, coefficients[0]))
        for part in range(0, 60, 12):
            yield f"{degree} {part}", rise[part : part + 12]
        speed = np.round(rng.uniform(0, 2, 60), 2)
        yield f"{degree} value", [profile(speed)[::5], profile.slope(speed)[::5]]
    log = SpeedProfile((np.array([4.0, 5.0, 6.0, 5.0, 5.0]),), np.array([1.0, 0.0, 0.0, -1.0, 1e-3]))
    yield "log", [log.first_rise(np.full(5, 5.0)), log(np.full(5, 0.2)), log.slope(np.full(5, 0.2)), log(np.zeros(5))]
    yield "log, far", log.first_rise(np.full(5, 800.0))
    for far in (0.9, 1.1, 0.0):  # beyond a million metres per second counts as none
        slow = SpeedProfile((np.array([-1.0]), np.array([0.0]), np.array([0.0]), np.array([(1e-6 * far) ** 3])))
        yield f"far {far}", slow.first_rise(np.zeros(1))


def of_a_campaign(seed, **options):
    rng = np.random.default_rng([SEED, seed])
    return simulate("ur10e", rng, effect=0.02, train=np.arange(125) % 3 == 0, **options).dataset


def bounds():
    """Bounds beside test states that lie above them, one by one; margins the impacts speak against."""
    force_map = fm.fit_force_map(of_a_campaign(6), form=fm.CFM_2D)
    rng = np.random.default_rng([SEED, 7])
    bounds = [fm.ToleranceBound(), fm.ToleranceBound(0.9, 0.8), fm.FixedMargin(0.1), fm.FixedMargin(0.3)]
    for count in (1, 2, 5, 12, 30):
        at = rng.uniform([0.53, 0.15, 0.11], [0.88, 0.45, 0.39], (count, 3))
        for beyond in {0, 1, 2, 3, 5, 8, count} & {*range(count + 1)}:
            upper = fm.ToleranceBound().upper(force_map, *at.T)
            force = upper * np.where(np.arange(count) < beyond, 1.001, 0.999)
            names = np.array([f"t{i:02d}" for i in range(count)])
            for kind, cut in (("seen", np.zeros(count, bool)), ("at least", np.ones(count, bool))):
                test = States.of(at, force, names, cut)
                tested = dataclasses.replace(force_map, fit=dataclasses.replace(force_map.fit, test=test))
                for bound in bounds if kind == "seen" else bounds[:1]:
                    yield f"{beyond} of {count} {kind} {bound}", [contradiction(tested, bound) is not None]
                    yield f"{beyond} of {count} {kind} {bound} weak", weakness(bound, tested)
    again = dataclasses.replace(
        force_map.fit.states, force=9 * force_map.fit.states.force, highest=9 * force_map.fit.states.highest
    )
    again = dataclasses.replace(force_map, fit=dataclasses.replace(force_map.fit, test=again))
    yield "measured again", [contradiction(again, fm.ToleranceBound()) is not None]
    published = fm.published_map("ur10e")
    offered = (fm.FixedMargin(0.0999), fm.FixedMargin(0.1), fm.FixedMargin(0.11), fm.ToleranceBound(0.949))
    offered = (*offered, fm.ToleranceBound(content=0.949), fm.ToleranceBound(0.96, 0.96), fm.ToleranceBound())
    for stated in (math.nan, 2.0, 5.0):
        device = dataclasses.replace(force_map.conditions, device=dataclasses.replace(DEVICE, error=stated))
        for name, each in (("published", published), ("fitted", force_map)):
            with_error = dataclasses.replace(each, conditions=device)
            for bound in (*offered, fm.ToleranceBound(device_error=2.99), fm.ToleranceBound(device_error=7.0)):
                yield f"{name} {stated} {bound} {bound.describe()}", weakness(bound, with_error)
                if name == "fitted":
                    yield f"{stated} {bound} {bound.describe()} margins", margins(bound, with_error)
    yield "nodes", list(tolerance_nodes(fm.ToleranceBound(0.9, 0.99), force_map))


def accuracies():
    dataset = of_a_campaign(8, device_range=330.0)
    states = dataset.states
    for name, share in (("above", 1.1), ("below", 0.9), ("equal", 1.0), ("mixed", np.linspace(0.8, 1.3, len(states)))):
        predicted = share * np.nan_to_num(states.force, nan=300.0)
        yield name, Accuracy.of(predicted, states, on="ours", skipped=3)
        yield f"{name} worst", Words(Accuracy.of(predicted, states, on="ours").worst_state or "none")
    for impacts in fm.CensoredImpacts:
        force_map = fm.fit_force_map(dataset, form=fm.CFM_2D, impacts=impacts)
        for each in fm.map_accuracy(force_map, dataset):
            yield f"{impacts.value} {each.on}", each
        yield f"{impacts.value} fit", force_map.fit
        for device_range in (math.nan, 400.0):
            other = dataclasses.replace(force_map, device_range=device_range)
            yield f"{impacts.value} {device_range} highest", [other.highest_force]
        yield f"{impacts.value} leverage", [force_map.leverage([0.5, 0.9], 0.3, 0.3), force_map.rises_with_speed]
    for slope in (-1e-9, 0.0, 1e-9):
        flat = dataclasses.replace(
            fm.published_map("ur10e"), form=fm.CFM_2D, coefficients=np.array([5.0, slope, 1.0, 1.0])
        )
        yield f"slope {slope}", [flat.rises_with_speed, flat.crossing_speed(0.7, 0.3, 500.0)]


def map_files():
    """What a map file says, and what is read of one that an earlier version wrote."""
    for name, content in files().items():
        for entry, value in content.items():
            if isinstance(value, str) and entry not in ("software", "content_sha256"):
                yield f"{name} {entry}", Words(value)
            elif entry != "standard_errors":
                yield f"{name} {entry}", [] if value is None else value
        yield f"{name} entries", Words(" ".join([*content, *(content["fit"] or ()), *content["measured_states"]]))
    fitted = files()["fitted"]
    older = {key: each for key, each in fitted.items() if key != "binding"}
    phase_two = fitted["phase_two"] | {"scenarios": {"unconstrained": 7}, "largest_force_N": 31.5, "above_peak": 2}
    changes = {"as it was": fitted, "no binding": older, "other phase two": fitted | {"phase_two": phase_two}}
    for reason in (None, "", "in words", {"kind": "binding_not_stated", "figures": {"axes": [["a"], ["b"]]}}):
        changes[f"reason {reason}"] = fitted | {"binding": {"state": "bound", "reason": reason}}
    less = {key: each for key, each in fitted["phase_two"].items() if key != "excluded"}
    changes["nothing of what was excluded"] = fitted | {"phase_two": less}
    with tempfile.TemporaryDirectory() as folder:
        for name, content in changes.items():
            read = fm.read_map(resealed(dict(content), Path(folder) / "map.json"))
            yield f"read {name}", {"phase_two": read.phase_two, "range": read.device_range}
            yield f"read {name}, bound", [read.binding.state, read.binding.reason is None]
            reason = read.binding.reason and (read.binding.reason.kind.value, read.binding.reason.figures)
            yield f"read {name}, reason", Words(f"{reason} {read.name} {read.source}")


def published():
    for name in fm.PUBLISHED_MAPS:
        found = fm.published_map(name)
        yield name, [*found.coefficients, found.device_range, found.highest_force, len(found.measured_range.points)]
        yield f"{name} phase two", found.phase_two
        yield f"{name} points", list(found.measured_range.points.T)
        yield f"{name} said", Words(f"{found.name} {found.form.name} {found.source} {found.conditions.robot}")


HEADS = """head crown nose Ear earlobe forearm shoulder heart jaw lower_jaw Kopf Kopfhaut Nasenbein hinterkopf brow lip
hip chin shin eye thigh face interface surface temple contemplate skull neck scalp back cheek Oberkiefer Mund"""


def of_a_limit(limit):
    """Its figures, also where contact is not permitted."""
    kinds = "quasi_static", "transient", "quasi_static_pressure", "transient_pressure"
    tabulated = [getattr(limit, f"tabulated_{kind}") for kind in kinds]
    given = [getattr(limit, kind) for kind in kinds] if limit.permitted else []
    forces = [limit.force(contact) for contact in fm.Contact] if limit.permitted else []
    return [limit.permitted, limit.head, limit.stiffness, *tabulated, *given, *forces]


def limit_tables():
    standard = fm.standard_limit_table()
    for name in (*standard.areas, *standard.regions, "back_of_hand", "Lower leg", "palm"):
        limit = fm.force_limit(name)
        yield name, of_a_limit(limit)
        yield f"{name} said", Words(f"{limit} | {' '.join(limit.areas)}")
    for name, region in body_regions().items():
        yield f"region {name}", region
        yield f"region of {name}", fm.body_region(name)
    for word in (*HEADS.split(), "zero\u200bhe\u200bad", "ＨＥＡＤ", "SCHÄDEL", "stirn2"):
        area = BodyArea("a", word, "r", 1.0, 1.0, 1.0)
        yield f"head {word!a}", [area.head, BodyArea(word, "b", "r", 1.0, 1.0, 1.0).head]
    for name in ("Back-of  hand", "a_-b", "  X  "):
        yield f"identifier of {name}", Words(identifier(name))
    header = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor,"
    rows = ["sternum,S,chest,120,100,2,30", "temple,T,skull_forehead,90,60,1.5,", "mine,M,own,100,90,1,12.5"]
    rows += ["palm_dominant,P,hand_fingers,260,140,2,", "yours,Y,own,90,100,1.2,", "bare,B,bones,10,10,0,40"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ours.csv"
        for head in (
            "",
            "# head_contact: permitted by a helmet\n# Edition : of ours\n# source: me: you\n#version: 7\n",
        ):
            path.write_text("\n".join([f"{head}{header}spring_constant_N_per_mm", *rows]) + "\n")
            table = fm.read_limit_table(path)
            facts = table.edition, table.source, table.version, table.sha256[:8], table.head_contact
            yield f"facts {bool(head)}", Words(" | ".join((*facts, *table.regions)))
            for name in (*table.areas, *table.regions):
                limit = fm.force_limit(name, table=table)
                key = f"ours {bool(head)} {name}"
                yield key, of_a_limit(limit)
                yield f"{key} said", Words(f"{limit} | {' '.join(limit.areas)} | {' '.join(limit.lacking)}")
                yield f"{key} findings", [limit.refusal, limit.head_finding, limit.head]


def springs_and_covers():
    rng = np.random.default_rng([SEED, 9])
    for area in (75e3, math.nan):
        for share in (0.5, 0.8999, 0.9, 0.95, 1.0, 1.0001, 3.0, math.nan):
            yield f"{area} {share}", device_suitability("palm", area, share * 75e3)
    for number in range(12):
        force, mass, body, k = rng.uniform([60, 3, 0.5, 1e4], [300, 30, 40, 1e5])
        model = {"robot_mass": mass, "body_mass": body, "stiffness": k}
        cover = {"cover_stiffness": rng.uniform(2e3, 1e5), "cover_thickness": rng.uniform(0, 0.05)}
        yield f"cover {number}", cover_estimate(force, **model, **cover)
        loads = {"moving_mass": mass, "payload": rng.uniform(0, 5), "new_payload": rng.uniform(0, 9)}
        yield f"payload {number}", payload_estimate(force, **loads, body_mass=body, stiffness=k)
        pressure = rng.uniform(1e6, 4e6)
        yield (
            f"model {number}",
            [
                pfl_governing_speed_limit(force, pressure, contact_area=1e-4, **model),
                pfl_energy(force, stiffness=k),
                fm.pfl_robot_mass(mass, 1.5),
            ],
        )
    exact = {"robot_mass": 15.0, "body_mass": math.inf, "stiffness": 75e3, "cover_stiffness": 1e4}
    for thickness in (0.01399, 0.014, 0.0141, 0.2):  # 140 N compress it by 14 mm
        yield f"thickness {thickness}", cover_estimate(140.0, cover_thickness=thickness, **exact)


PARTS = (
    form_tests,
    ranges,
    hulls,
    places,
    regressions,
    likelihoods,
    roots,
    bounds,
    accuracies,
    map_files,
    published,
    limit_tables,
    springs_and_covers,
)


def rows(part):
    """Name and value of each figure that a part says."""
    found = []
    with np.errstate(all="ignore"):
        for name, result in part():
            said = [("", [result])] if isinstance(result, Words) else figures(result)
            said = [(key, each) for key, each in said if not key.endswith((".design", ".response"))]
            found += [[f"{part.__name__} {name}{key}", " ".join(each)] for key, each in said]
    return found


if __name__ == "__main__":
    recorded.write(TABLE, [row for part in PARTS for row in rows(part)])
