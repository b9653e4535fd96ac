"""Map files: bit for bit, and nothing that was changed by hand passes."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from oracle import simulate

import forcemap as fm
from forcemap.errors import MapFileError
from forcemap.maps.forms import FORMS
from forcemap.maps.map_file import _require_means, map_text

QUASI_STATIC = fm.Contact.QUASI_STATIC


@pytest.fixture
def fitted():
    return fm.fit_force_map(simulate("ur10e", np.random.default_rng(40), effect=0.022).dataset)


@pytest.mark.parametrize("form", FORMS)
def test_fitted_maps_round_trip_bit_for_bit(tmp_path, form):
    dataset = simulate("kuka-iiwa7-30nm", np.random.default_rng(41), effect=0.033).dataset
    everything = fm.ImpactDataset.from_frame(dataset.to_frame().assign(role="train"), conditions=dataset.conditions)
    force_map = fm.fit_force_map(everything, form=form)
    fm.write_map(force_map, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    fm.write_map(again, tmp_path / "again.json")
    assert (tmp_path / "map.json").read_bytes() == (tmp_path / "again.json").read_bytes()
    assert fm.map_sha256(again) == fm.map_sha256(force_map)
    np.testing.assert_array_equal(again.coefficients, force_map.coefficients)
    assert again.conditions == force_map.conditions
    assert again.device_range == force_map.device_range
    assert again.phase_two == force_map.phase_two
    d, h = np.linspace(0.56, 0.86, 7), 0.3
    bound = fm.ToleranceBound()
    np.testing.assert_array_equal(bound.upper(again, d, h, 0.3), bound.upper(force_map, d, h, 0.3))
    one, other = (fm.safe_speed(m, d, h, limit=250.0, contact=QUASI_STATIC, bound=bound) for m in (again, force_map))
    np.testing.assert_array_equal(one.speed, other.speed)
    assert fm.leave_one_state_out(again) == fm.leave_one_state_out(force_map)


@pytest.mark.parametrize(
    ("name", "seed", "effect", "repeats", "device_range", "form"),
    [
        ("kuka-iiwa7-30nm", 376, 0.02, 3, 250.0, fm.LOG_SPEED),
        ("kuka-iiwa7-30nm", 1376, 0.01, 3, 250.0, fm.LOG_SPEED),
        ("ur10e", 922, 0.1, 1, 250.0, fm.CFM_3D),
    ],
)
def test_a_censored_fit_with_a_rough_likelihood_is_read_again(
    tmp_path, name, seed, effect, repeats, device_range, form
):
    """With a correlation of places near 1, rounding alone moves the maximum of the likelihood."""
    rng = np.random.default_rng(seed)
    dataset = simulate(name, rng, effect=effect, repeats=repeats, device_range=device_range).dataset
    force_map = fm.fit_force_map(dataset, form=form)
    assert force_map.require_fit().censored_samples
    assert force_map.require_fit().place_effect.correlation > 0.99
    fm.write_map(force_map, tmp_path / "map.json")
    assert fm.map_sha256(fm.read_map(tmp_path / "map.json")) == fm.map_sha256(force_map)


@pytest.mark.parametrize("name", fm.PUBLISHED_MAPS)
def test_published_maps_round_trip(tmp_path, name):
    force_map = fm.published_map(name)
    fm.write_map(force_map, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    assert fm.map_sha256(again) == fm.map_sha256(force_map)
    assert again.fit is None
    options = {"limit": fm.force_limit("back_of_hand"), "contact": fm.Contact.TRANSIENT, "bound": fm.FixedMargin()}
    one, other = (fm.safe_speed(m, 0.8, 0.4, **options) for m in (again, force_map))
    assert (one.outcome, one.reason) == (other.outcome, other.reason)


def test_a_form_of_ones_own(tmp_path):
    dataset = simulate("ur10e", np.random.default_rng(42), effect=0.02).dataset
    form = fm.Form.of("own", ["1", "d", "h", "ln(v)"])
    fm.write_map(fm.fit_force_map(dataset, form=form), tmp_path / "map.json")
    assert fm.read_map(tmp_path / "map.json").form == form


SPOILED = {
    "coefficient changed": (("coefficients", 1), 2.0),
    "coefficient text": (("coefficients", 1), "3.4"),
    "coefficient null": (("coefficients", 1), None),
    "coefficient too many": (("coefficients",), [1.0] * 10),
    "state force changed": (("measured_states", "mean_ln_force", 0), 3.0),
    "state coordinate changed": (("measured_states", "distance_m", 0), 0.1),
    "no states": (("measured_states", "distance_m"), []),
    "state missing": (("measured_states", "speed_mps"), [0.2]),
    "spread changed": (("fit", "state_sd_ln"), 1e-4),
    "other terms": (("terms", 1), "v^2"),
    "unknown term": (("terms", 1), "x"),
    "other schema": (("schema",), "forcemap-map/9"),
    "simulated hidden": (("simulated",), True),
    "bad scenario": (("phase_two", "scenarios"), {"fine": 3}),
    "negative device range": (("campaign", "device", "range_N"), -500.0),
    "unknown campaign entry": (("campaign", "device", "rnage_N"), 500.0),
    "negative count": (("measured_states", "impacts", 0), -1),
}


@pytest.mark.parametrize("kind", SPOILED)
def test_changed_files_are_refused(tmp_path, fitted, kind):
    path = tmp_path / "map.json"
    fm.write_map(fitted, path)
    content = json.loads(path.read_text())
    keys, value = SPOILED[kind]
    at = content
    for key in keys[:-1]:
        at = at[key]
    at[keys[-1]] = value
    path.write_text(json.dumps(content))
    with pytest.raises(MapFileError, match=re.escape("map.json")):
        fm.read_map(path)


def test_entries_of_another_version_are_named(tmp_path, fitted):
    """A file that is whole but does not hold what this version needs."""
    path = tmp_path / "map.json"
    fm.write_map(fitted, path)
    content = json.loads(path.read_text())
    for key in ("coefficients", "content_sha256"):
        del content[key]
    text = json.dumps(content, indent=1) + "\n"
    content["content_sha256"] = hashlib.sha256(text.encode()).hexdigest()
    path.write_text(json.dumps(content, indent=1) + "\n")
    with pytest.raises(MapFileError, match="coefficients"):
        fm.read_map(path)


CONTRADICTIONS = {
    "simulated, not in the campaign": ((True, {"simulated": False}), "simulated = true, its campaign false"),
    "in the campaign only": ((False, {"simulated": True}), "simulated = false, its campaign true"),
    "in the note only": ((False, {"simulated": False, "note": "SIMULATED by the lab"}), "note of its campaign"),
    "no answer": ((None, {}), "expected true or false"),
}


@pytest.mark.parametrize("kind", CONTRADICTIONS)
def test_a_file_that_contradicts_itself_on_being_simulated_is_refused(tmp_path, fitted, kind):
    """Even if its hash is right: simulated impacts must not pass for measured ones."""
    (stated, campaign), words = CONTRADICTIONS[kind]
    path = tmp_path / "map.json"
    fm.write_map(fitted, path)
    content = json.loads(path.read_text())
    content["simulated"] = stated
    content["campaign"] |= campaign
    del content["content_sha256"]
    text = json.dumps(content, indent=1) + "\n"
    content["content_sha256"] = hashlib.sha256(text.encode()).hexdigest()
    path.write_text(json.dumps(content, indent=1) + "\n")
    with pytest.raises(MapFileError, match=words) as error:
        fm.read_map(path)
    assert "\n" not in str(error.value)
    assert error.value.column == "simulated"


def test_a_published_map_cannot_be_sharpened_by_hand(tmp_path):
    path = tmp_path / "map.json"
    fm.write_map(fm.published_map("ur10e"), path)
    path.write_text(path.read_text().replace("6.299", "5.299"))
    with pytest.raises(MapFileError, match="changed"):
        fm.read_map(path)
    fm.write_map(fm.published_map("kuka-iiwa7-30nm"), path)
    path.write_text(path.read_text().replace('"constrained_with_clamping": 369', '"unconstrained": 369'))
    with pytest.raises(MapFileError, match="changed"):
        fm.read_map(path)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", "3", "\x00", "{}", '{"schema": "forcemap-map/1"}', "[" * 100000]
)
def test_files_that_are_no_map(tmp_path, text):
    path = tmp_path / "map.json"
    path.write_text(text)
    with pytest.raises(MapFileError):
        fm.read_map(path)


def test_a_write_that_fails_leaves_the_old_file(tmp_path, fitted):
    with pytest.raises(fm.InputError, match="cannot be written"):
        fm.write_map(fitted, tmp_path / "no such folder" / "map.json")
    path = tmp_path / "map.json"
    path.write_text("old")
    fm.write_map(fitted, path)
    assert json.loads(path.read_text())["schema"] == "forcemap-map/1"
    assert [p.name for p in tmp_path.iterdir()] == ["map.json"]


def sealed(content):
    """The text of a map file with the hash of what it holds now: nothing but its entries speaks against it."""
    text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    digest = hashlib.sha256(text.encode()).hexdigest()
    return json.dumps(content | {"content_sha256": digest}, indent=1) + "\n"


def entries(value, path=()):
    """The path of every entry of a map file, of a list the first, the middle and the last."""
    inner = value.items() if isinstance(value, dict) else ()
    if isinstance(value, list):
        inner = ((i, value[i]) for i in sorted({0, len(value) // 2, len(value) - 1} & {*range(len(value))}))
    for key, each in inner:
        yield (*path, key)
        yield from entries(each, (*path, key))


SWAPPED = (
    None, True, False, -1, 0, 1.5, -5, 1e308, -1e308, 1e-320, 10**400, 2**63, "x", "", "d^99999", "NaN", [], {}, [1],
    [[1]], [None], {"a": 1}, [1e308] * 27, ["x"] * 27, float("nan"), float("inf"),
)  # fmt: skip


def damaged(content, rng, paths):
    """The content with one entry taken out, halved, doubled or swapped for a value of another kind."""
    content = json.loads(json.dumps(content))
    *above, last = paths[rng.integers(len(paths))]
    holder = content
    for key in above:
        holder = holder[key]
    how = rng.integers(len(SWAPPED) + 3)
    if how < len(SWAPPED):
        holder[last] = SWAPPED[how]
    elif how == len(SWAPPED):
        del holder[last]
    elif isinstance(holder[last], list | str):
        half = len(holder[last]) // 2
        holder[last] = holder[last][:half] if how == len(SWAPPED) + 1 else 2 * holder[last]
    return content


@pytest.mark.parametrize("kind", ["least squares", "censored", "log speed", "published"])
def test_damaged_entries_end_in_our_errors(tmp_path, kind, full_size):
    """Entries of another kind, huge, NaN or missing, under a hash that holds: refused, or a map that answers."""
    rng = np.random.default_rng([14, len(kind)])
    dataset = simulate("ur10e", rng, effect=0.022, device_range=500.0 if kind == "least squares" else 330.0).dataset
    form = fm.LOG_SPEED if kind == "log speed" else fm.CFM_3D
    force_map = fm.published_map("ur10e") if kind == "published" else fm.fit_force_map(dataset, form=form)
    path = tmp_path / "map.json"
    fm.write_map(force_map, path)
    content = json.loads(path.read_text())
    content.pop("content_sha256")
    paths, bound = [*entries(content)], fm.FixedMargin()
    for _ in range(5000 if full_size else 40):
        try:
            path.write_text(sealed(damaged(content, rng, paths)))
        except ValueError:  # NaN and infinity, which no hash of ours is made of
            path.write_text(json.dumps(damaged(content, rng, paths)))
        try:
            again = fm.read_map(path)
            fm.safe_speed(again, 0.7, 0.3, limit=fm.force_limit("chest"), contact="quasi-static", bound=bound)
            fm.write_map(again, tmp_path / "again.json")
        except fm.ForcemapError:
            pass


@pytest.mark.parametrize("kind", ["cut", "flipped", "a piece lost", "a piece twice"])
def test_damaged_bytes_end_in_our_errors(tmp_path, fitted, kind, full_size):
    fm.write_map(fitted, tmp_path / "map.json")
    whole, rng = (tmp_path / "map.json").read_bytes(), np.random.default_rng([15, len(kind)])
    refused = 0
    for _ in range(2000 if full_size else 30):
        one, other = np.sort(rng.integers(0, len(whole), 2)).tolist()
        changed = bytearray(whole)
        changed[one] ^= 1 << int(rng.integers(8))
        pieces = {"cut": whole[:one], "flipped": bytes(changed), "a piece lost": whole[:one] + whole[other + 1 :]}
        (tmp_path / "map.json").write_bytes(pieces.get(kind, whole[:other] + whole[one:]))
        try:  # a blank more, or an entry twice, is the same map
            assert fm.map_sha256(fm.read_map(tmp_path / "map.json")) == fm.map_sha256(fitted)
        except MapFileError:
            refused += 1
    assert refused > 10


@pytest.mark.parametrize(
    ("change", "sound"),
    [
        ({"log_force": 1e-6}, False),  # a mean of logarithms above the logarithm of the mean
        ({"log_force": -1e-6}, True),
        ({"log_force": -5.0}, False),  # as low as no repeats below the highest can make it
        ({"highest": -1.0}, False),  # the highest below the mean
        ({"highest": 1.0}, True),
        ({"impacts": -9, "censored": 9}, False),
        ({"impacts": -3}, False),  # no impact at all
    ],
)
def test_means_are_those_of_impacts_that_can_be(fitted, change, sound):
    states = fitted.fit.states
    assert (states.impacts[4], states.censored[4]) == (3, 0)
    other = replace(states, log_force=np.log(states.force), highest=states.force + 1.0)
    one = np.arange(len(states)) == 4
    other = replace(other, **{name: getattr(other, name) + one * value for name, value in change.items()})
    if "highest" in change:
        other = replace(other, highest=np.where(one, states.force + change["highest"], other.highest))
    if sound:
        _require_means(other)
    else:
        with pytest.raises(MapFileError):
            _require_means(other)


@pytest.fixture(scope="module")
def censored():
    """A map with censored states and one without, as the files' content."""
    contents = {}
    for known, device_range in (("censored", 400.0), ("whole", 1e4)):
        dataset = simulate(
            "ur10e", np.random.default_rng(43), effect=0.022, repeats=3, device_range=device_range
        ).dataset
        contents[known] = fm.fit_force_map(dataset.train)
    assert contents["censored"].require_fit().censored_samples
    return {known: json.loads(map_text(force_map)) for known, force_map in contents.items()}


STATED = [  # kind of fit, entry, what may be wrong with it: as a share of it or as it stands, and the largest error
    ("whole", "coefficients", "add", 1e-6),
    ("censored", "coefficients", "add", 1e-5),
    ("censored", "state_sd_ln", "times", 1e-4),
    ("censored", "degrees_of_freedom", "times", 1e-4),
    ("censored", "state_weights", "add", 1e-4),
]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("share", "accepted"), [(0.95, True), (1.05, False)])
@pytest.mark.parametrize(("kind", "entry", "how", "most"), STATED)
def test_a_figure_of_the_fit_may_differ_from_what_the_states_give_by_so_much(
    tmp_path, censored, kind, entry, how, most, share, accepted, sign
):
    content = json.loads(json.dumps(censored[kind]))
    table, error = (content if entry == "coefficients" else content["fit"]), sign * share * most
    if isinstance(table[entry], list):
        table[entry][0] += error
    else:
        table[entry] *= 1 + error
    path = resealed(content, tmp_path / "map.json")
    if accepted:
        assert fm.read_map(path).fit
    else:
        with pytest.raises(MapFileError, match="not what the measured states of the file give") as refusal:
            fm.read_map(path)
        assert refusal.value.column == entry


def resealed(content, path):
    """The file of a content changed by hand, its hash being right."""
    text = json.dumps({key: value for key, value in content.items() if key != "content_sha256"}, indent=1) + "\n"
    content["content_sha256"] = hashlib.sha256(text.encode()).hexdigest()
    path.write_text(json.dumps(content, indent=1) + "\n")
    return path


def test_a_map_without_residuals_is_read_back_with_its_scatter_unknown(tmp_path):
    """As many states as coefficients."""
    points = np.array([[0.5, 0.2, 0.1], [0.6, 0.3, 0.2], [0.7, 0.1, 0.4], [0.9, 0.4, 0.3]])
    force = np.array([150.0, 200.0, 310.0, 240.0])
    d, h, v = points.T
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    force_map = fm.fit_force_map(dataset, form=fm.CFM_2D)
    fm.write_map(force_map, tmp_path / "map.json")
    again = fm.read_map(tmp_path / "map.json")
    assert np.isnan(again.fit.state_sd)
    np.testing.assert_array_equal(again.coefficients, force_map.coefficients)
