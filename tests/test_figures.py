"""What every figure shows: its axes and units, its series, and that their values are those of the library."""

from __future__ import annotations

import io
import itertools
import math
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import forcemap as fm
from forcemap import figures
from forcemap.comparisons.force_models import maps_per_height
from forcemap.dynamics.mass_map import planar_mass_map
from forcemap.dynamics.planar_arm import INSPECTION_DISTANCES, INSPECTION_HEIGHTS, LINK_DOWN, LinkMass, PlanarArm, Wrist
from forcemap.figures.maps import profile_states_shown, workspace_states_shown
from forcemap.maps.transfer import SHIFT
from forcemap.words import warnings
from pulses import pulse, save

DISTANCE, HEIGHT, SPEED, FORCE = "Distance [m]", "Height [m]", "Speed [m/s]", "Force [N]"
PLACE, ORDER = "Place, by distance", "Order measured"  # numbers
SIMULATED = "SIMULATED: not a measurement of any robot"
TRAIN, TEST = "measured, training state", "measured, test state"
CENSORED = "censored: at least this force"
HAND = "back_of_hand"
ARM = PlanarArm(link_mass=LinkMass.UNIFORM_ROD, last_link=LINK_DOWN, wrist=Wrist.FREE, base_height=0.18)
NINE = INSPECTION_DISTANCES, INSPECTION_HEIGHTS
DENSE = np.linspace(0.52, 0.95, 9), np.linspace(0.14, 0.46, 7)
STANDARD = {"robot_mass": 15.0, "body_mass": math.inf, "stiffness": 75_000.0}


@pytest.fixture(scope="module")
def dataset(examples):
    return examples["ur10e"]


@pytest.fixture(scope="module")
def force_map(dataset):
    return fm.fit_force_map(dataset)


@pytest.fixture(scope="module")
def speeds(force_map):
    grid = fm.measured_grid(force_map, 0.05)
    return fm.speed_map(
        force_map, *grid, limit=fm.force_limit(HAND), bound=fm.ToleranceBound(), contact=fm.Contact.TRANSIENT
    )


@pytest.fixture(scope="module")
def along_path():
    """Down, up and beyond: permitted, not downward, and outside."""
    points = [[0.8, 0.0, 0.44], [0.8, 0.0, 0.36], [0.8, 0.0, 0.44], [0.8, 0.0, 0.40], [0.8, 0.0, 0.05]]
    path = fm.ToolPath(np.array(points), ("descend", "lift", "again", "too deep"))
    task = fm.Task(
        tuple(fm.TaskSegment(name, (HAND,), fm.Contact.TRANSIENT, speed=0.4) for name in dict.fromkeys(path.names))
    )
    return fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.1))


@pytest.fixture(scope="module")
def impact(tmp_path_factory):
    """A pulse of 300 N on a device of 320 N range."""
    file = tmp_path_factory.mktemp("pulse") / "run.csv"
    save(file, *pulse(300.0))
    recording = replace(fm.read_recording(file), device=fm.Device(range=320.0, error=3.0))
    return fm.find_impact(recording)


def series(axes, words):
    """Points of all lines of a name, shape (2, n)."""
    lines = [line for line in axes.get_lines() if line.get_label() == words]
    assert lines, f"{words!r} is not among {[line.get_label() for line in axes.get_lines()]}"
    return np.hstack([np.array(line.get_data(), dtype=float) for line in lines])


def legend(figure):
    return [text.get_text() for each in figure.legends for text in each.get_texts()]


def texts(figure):
    return [each.get_text() for each in figure.findobj(matplotlib.text.Text) if each.get_text()]


def all_figures(dataset, force_map, speeds, along_path, impact):
    comparison = fm.compare_force_models(dataset, bound=fm.ToleranceBound(), limit=fm.force_limit(HAND), **STANDARD)
    return {
        "profiles": lambda **o: figures.force_profiles_figure(force_map, dataset, bound=fm.ToleranceBound(), **o),
        "grid": lambda **o: figures.measurement_grid_figure(dataset, **o),
        "inspection": lambda **o: figures.planar_inspection_figure({"down": planar_mass_map(ARM, *NINE)}, arm=ARM, **o),
        "mass": lambda **o: figures.planar_mass_figure(planar_mass_map(ARM, *DENSE), **o),
        "workspace": lambda **o: figures.workspace_figure(force_map, dataset, **o),
        "comparison": lambda **o: figures.model_comparison_figure(comparison, dataset, force_map, **STANDARD, **o),
        "evolution": lambda **o: figures.force_evolution_figure(impact.recording, impact, fm.force_limit(HAND), **o),
        "residuals": lambda **o: figures.residuals_figure(force_map, dataset, **o),
        "safe speeds": lambda **o: figures.safe_speed_figure(speeds, **o),
        "places": lambda **o: figures.places_to_measure_figure(speeds, **o),
        "path speeds": lambda **o: figures.path_speeds_figure(along_path, **o),
        "repeatability": lambda **o: figures.repeatability_figure(fm.repeatability(dataset), dataset, **o),
    }


@pytest.fixture(scope="module")
def made(dataset, force_map, speeds, along_path, impact):
    return all_figures(dataset, force_map, speeds, along_path, impact)


@pytest.fixture(scope="module")
def drawn(made):
    """Every figure as SVG, drawn alone."""
    return {name: figures.svg(make(), prefix="a") for name, make in made.items()}


NAMES = ["profiles", "grid", "inspection", "mass", "workspace", "comparison", "evolution", "residuals"]
NAMES += ["safe speeds", "places", "path speeds", "repeatability"]


class TestEveryFigure:
    @pytest.mark.parametrize("name", NAMES)
    def test_axes_have_units_and_nothing_is_cut_off_or_overlaps_at_column_width(self, made, name):
        for width in (figures.COLUMN_WIDTH, figures.PAGE_WIDTH):
            figure = made[name](width=width)
            assert isinstance(figure, Figure)
            labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel()) if label]
            assert labels
            with_unit = [label for label in labels if label not in (PLACE, ORDER)]
            assert all(re.search(r"\[(m|m/s|N|s|kg|% of measured)\]$", label) for label in with_unit), labels
            picture = Image.open(io.BytesIO(figures.png(figure, dpi=72)))
            assert picture.width == pytest.approx(width / 0.0254 * 72, abs=1)
            pixels = np.asarray(picture.convert("L"))
            edge = np.concatenate([pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]])
            assert edge.min() == 255, "something is cut off"
            renderer = FigureCanvasAgg(figure).get_renderer()
            words = [label for axes in figure.axes for label in (axes.xaxis.label, axes.yaxis.label, axes.title)]
            boxes = [label.get_window_extent(renderer) for label in words if label.get_text()]
            assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2)), (name, width)
            for axes in figure.axes:
                if axes.name == "3d":
                    continue
                low, high = axes.get_xlim()
                ticks = [tick for tick in axes.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
                boxes = [tick.label1.get_window_extent(renderer) for tick in ticks if tick.label1.get_text()]
                for left, right in itertools.pairwise(sorted(boxes, key=lambda box: box.x0)):
                    assert left.x1 + 2 < right.x0, (name, width)

    @pytest.mark.parametrize("name", NAMES)
    def test_svg_is_self_contained_and_the_same_to_the_byte(self, made, drawn, name):
        first, again = drawn[name], figures.svg(made[name](), prefix="a")
        assert first == again
        assert ElementTree.fromstring(first).tag.endswith("svg")
        ids = re.findall(r'\bid="([^"]*)"', first)
        assert all(each.startswith("a-") for each in ids)
        assert len(ids) == len(set(ids))
        assert set(re.findall(r"(?:href=\"#|url\(#)([^\")]*)", first)) <= set(ids)
        assert "<style" not in first
        assert "<script" not in first
        assert not re.search(r'(href|src)="(?!#|data:image/png;base64,)', first)

    def test_threads_and_settings_of_the_user_change_nothing(self, made, drawn):
        with matplotlib.rc_context({"lines.linewidth": 9, "font.size": 30, "axes.facecolor": "red"}):
            with ThreadPoolExecutor(4) as pool:
                pictures = pool.map(lambda name: figures.svg(made[name](), prefix="a"), made)
                together = dict(zip(made, pictures, strict=True))
            assert matplotlib.rcParams["lines.linewidth"] == 9
        assert together == drawn

    @pytest.mark.parametrize("name", ["profiles", "grid", "workspace", "comparison", "residuals", "repeatability"])
    def test_simulated_impacts_say_so(self, made, name):
        assert SIMULATED in texts(made[name]())

    def test_measured_ones_do_not(self, dataset):
        measured = replace(
            dataset,
            conditions=replace(dataset.conditions, simulated=False, note=""),
            flags=np.full(len(dataset), ""),
        )
        assert SIMULATED not in texts(figures.measurement_grid_figure(measured))

    @pytest.mark.parametrize("prefix", ["", "1a", 'a"b', "a b", "ä"])
    def test_a_prefix_that_makes_no_id_is_refused(self, made, prefix):
        with pytest.raises(fm.InputError, match="prefix"):
            figures.svg(made["mass"](), prefix=prefix)


def test_force_profiles(made, dataset, force_map):
    figure = made["profiles"]()
    distance, height, _ = figure.axes
    assert [axes.get_xlabel() for axes in figure.axes] == [DISTANCE, HEIGHT, SPEED]
    assert distance.get_ylabel() == FORCE
    assert {"3D map", "upper bound", TRAIN, TEST} <= set(legend(figure))
    assert distance.get_title("left") == "height 0.46 m\nlines: speed"
    bound = fm.ToleranceBound()
    for axes, at in ((distance, lambda x: (x, 0.46, 0.2)), (height, lambda x: (0.89, x, 0.2))):
        x, force = series(axes, "3D map")
        np.testing.assert_allclose(force[:81], force_map.predict(*at(x[:81])))
        x, upper = series(axes, "upper bound")
        np.testing.assert_allclose(upper[:81], bound.upper(force_map, *at(x[:81])))
        assert (upper > force).all()
    states = dataset.train.states
    here = (states.height == 0.46) & np.isin(states.speed, [0.2, 0.3, 0.4]) & (states.impacts > 0)
    x, force = series(distance, TRAIN)
    assert sorted(zip(x, force, strict=True)) == sorted(zip(states.distance[here], states.force[here], strict=True))
    with pytest.raises(fm.BoundNotAvailable):
        figures.force_profiles_figure(fm.published_map("ur10e"), bound=bound)


def test_measurement_grid(made, dataset):
    figure = made["grid"]()
    states = dataset.train.states
    shown = sum(series(axes, TRAIN).shape[1] for axes in figure.axes if TRAIN in _labels(axes))
    assert shown == len(states)
    titles = [axes.get_title("left") for axes in figure.axes]
    assert titles == ["0.2 to 0.25 m/s", "0.265 to 0.335 m/s", "0.35 to 0.4 m/s"]
    censored = dataset.states.select(dataset.states.censored > 0)
    marked = np.hstack([series(axes, CENSORED) for axes in figure.axes if CENSORED in _labels(axes)])
    assert sorted(map(tuple, marked.T)) == sorted(zip(censored.distance, censored.height, strict=True))
    markers = {line.get_label(): str(line.get_marker()) for axes in figure.axes for line in axes.get_lines()}
    assert len(set(markers.values())) == len(markers) == 3


@pytest.mark.parametrize("width", [figures.COLUMN_WIDTH, figures.PAGE_WIDTH])
@pytest.mark.parametrize(
    ("distances", "heights"),
    [((0.5, 0.7, 0.9), (0.15, 0.3, 0.45)), ((0.5, 0.9), (0.3,)), ((0.7,), (0.1, 0.9)), ((0.3, 1.3), (0.2, 0.25))],
)
def test_no_state_lies_outside_the_picture_of_places(distances, heights, width):
    """A plan of 0.5-0.9 x 0.15-0.45 m once hid 18 of its 27 states."""
    d, h, v = (a.ravel() for a in np.meshgrid(distances, heights, (0.1, 0.2, 0.3)))
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=100 + 500 * v)
    figure = figures.measurement_grid_figure(dataset, width=width)
    FigureCanvasAgg(figure).draw()
    shown = 0
    for axes in figure.axes:
        x, y = series(axes, TRAIN)
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        shown += int(np.sum((left < x) & (x < right) & (low < y) & (y < high)))
    assert shown == d.size


def test_places_to_measure(speeds):
    plan = fm.plan_measurements(
        (0.55, 0.7, 0.85), (0.2, 0.3, 0.4), (0.123, 0.2, 0.3), design=fm.Design.PAPER, repeats=1
    )
    figure = figures.places_to_measure_figure(speeds, plan)
    (axes,) = figure.axes
    outcome = speeds.speeds.to_program_outcome
    has = int(np.sum(~np.isnan(speeds.speeds.speed_to_program)))
    assert series(axes, f"has a speed ({has} places)").shape[1] == has
    open_ = int(np.sum(outcome == fm.SpeedOutcome.UNCONFIRMED))
    assert series(axes, f"no permission yet ({open_} places)").shape[1] == open_
    assert series(axes, "measure next, at this speed [m/s]").shape[1] == len(plan.states)
    assert texts(figure).count("0.123") == len(plan.states) / 3


def _labels(axes):
    return {line.get_label() for line in axes.get_lines()}


def test_planar_arm(made):
    figure = made["inspection"]()
    masses = planar_mass_map(ARM, *NINE)
    postures, values = figure.axes
    assert values.get_ylabel() == "Effective mass [kg]"
    np.testing.assert_allclose(series(values, "down")[1], masses.mass.value.T.ravel())
    assert f"{masses.mass.value[0, 0]:.1f} kg" in texts(figure)
    assert postures.get_xlabel() == DISTANCE
    with pytest.raises(fm.InputError, match="0 variants"):
        figures.planar_inspection_figure({})

    dense = made["mass"]()
    cells = dense.axes[0].collections[0].get_array()
    arm = planar_mass_map(ARM, *DENSE)
    np.testing.assert_allclose(np.ma.filled(cells, np.nan), arm.mass.value.T)
    assert ("the robot does not reach" in legend(dense)) == bool(np.isnan(arm.mass.value).any())


def test_workspace(made, dataset, force_map):
    (cube, bar) = made["workspace"]().axes
    assert (cube.get_xlabel(), cube.get_ylabel(), cube.get_zlabel()) == (DISTANCE, HEIGHT, SPEED)
    assert bar.get_ylabel() == "Predicted force [N]"
    shown = [line.get_data_3d() for line in cube.get_lines() if line.get_label() == TRAIN]
    states = dataset.train.states
    points = {tuple(point) for line in shown for point in np.array(line).T}
    on_slices = states.select(np.isin(states.speed, [0.2, 0.3, 0.4]))
    assert points == set(zip(*on_slices.coordinates.T, strict=True))
    low, high = bar.get_ylim()
    corners = force_map.predict(np.array([0.89, 0.52]), np.array([0.46, 0.14]), np.array([0.2, 0.4]))
    assert corners[0] * 0.98 < low < corners[0] * 1.05
    assert corners[1] * 0.93 < high < corners[1] * 1.02


@pytest.mark.parametrize(
    ("at_top", "said"), [([[0.5, 0.1], [0.5, 0.5]], True), ([[0.5, 0.1], [0.9, 0.5], [0.9, 0.1]], False)]
)
def test_a_slice_of_the_workspace_without_area_is_named(at_top, said):
    below = np.array([[d, h, v] for v in (0.1, 0.2) for d in (0.5, 0.7, 0.9) for h in (0.1, 0.3, 0.5)])
    d, h, v = np.vstack([below, [[*place, 0.3] for place in at_top]]).T
    force = np.exp(5 - d + 2 * v + 0.1 * np.sin(9 * h))
    few = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    figure = figures.workspace_figure(fm.fit_force_map(few, form=SHIFT), few)
    words = " ".join(text.get_text() for text in figure.texts).replace("\n", " ")
    assert ("No slice at 0.30 m/s" in words) == said


def test_model_comparison(made, dataset, force_map):
    figure = made["comparison"]()
    distance, height, errors = figure.axes
    x, force = series(distance, "3D map")
    np.testing.assert_allclose(force, force_map.predict(x, 0.3, 0.3))
    standard = fm.pfl_contact_force(0.3, **STANDARD)
    assert set(series(distance, "standard's contact model")[1]) == {float(standard)}
    assert (series(height, "upper bound")[1] > series(height, "3D map")[1]).all()
    comparison = fm.compare_force_models(dataset, bound=fm.ToleranceBound(), limit=fm.force_limit(HAND), **STANDARD)
    widths = [bar.get_width() for bar in errors.patches]
    expected = []
    for model in comparison.models:
        expected += [-model.accuracy.max_overestimation_percent, model.accuracy.max_underestimation_percent]
    np.testing.assert_allclose(widths, expected)
    hatched = [bool(bar.get_hatch()) for bar in errors.patches]
    assert hatched == [False, True] * len(comparison.models)
    assert "Measured − predicted" in errors.get_xlabel()


def test_the_models_are_compared_where_the_map_is():
    """However many test states lie at one place elsewhere; a panel of a cut beside the measured range says so."""
    rng = np.random.default_rng(3)
    d, h, v = (rng.uniform(low, high, 60) for low, high in ((0.5, 0.9), (0.1, 0.5), (0.1, 0.4)))
    d, h, v = (
        np.r_[d, np.full(41, 1.2)],
        np.r_[h, np.full(41, 0.8)],
        np.r_[v, np.tile(np.linspace(0.1, 0.4, 3), 14)[:41]],
    )
    force, role = np.exp(4 + 4 * v - d + rng.normal(0, 0.02, 101)), np.where(d < 1, "train", "test")
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force, role=role)
    force_map = fm.fit_force_map(dataset)
    comparison = fm.compare_force_models(dataset, bound=fm.ToleranceBound(), **STANDARD)
    for cut, drawn in (({}, True), ({"distance": 1.2, "height": 0.8}, False)):
        panels = figures.model_comparison_figure(comparison, dataset, force_map, **STANDARD, **cut).axes[:2]
        for axes in panels:
            lines = [line.get_ydata() for line in axes.get_lines() if line.get_label() == "3D map"]
            assert any(np.isfinite(line).sum() > 2 for line in lines) == drawn
            assert any("outside the\nmeasured range" in text.get_text() for text in axes.texts) == (not drawn)


def test_2d_maps_of_single_heights_are_drawn_as_far_as_they_were_measured():
    """Places at random have heights that few states share: their own maps are no map of all heights."""
    rng = np.random.default_rng(3)
    d, h, v = (rng.uniform(low, high, 60) for low, high in ((0.5, 0.9), (0.1, 0.5), (0.1, 0.4)))
    force = np.exp(4 + 4 * v - d + rng.normal(0, 0.02, 60))
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force)
    force_map, flat = fm.fit_force_map(dataset), fm.fit_force_map(dataset, form=fm.CFM_2D)
    single = list(maps_per_height(dataset).values())
    assert single
    comparison = fm.compare_force_models(dataset, bound=fm.ToleranceBound(), limit=fm.force_limit(HAND), **STANDARD)
    figure = figures.model_comparison_figure(comparison, dataset, force_map, maps_2d=[flat, *single], **STANDARD)
    distance, height, errors = figure.axes
    for axes in (distance, height):
        drawn = [line for line in axes.get_lines() if line.get_label() == "2D map"]
        assert len(drawn) == 1
    counts = [model.accuracy.states for model in comparison.models]
    labels = [label.get_text() for label in errors.get_yticklabels()]
    assert [f"({count} of 60 states)" in label for count, label in zip(counts, labels, strict=True)] == [
        count < 60 for count in counts
    ]


@pytest.mark.parametrize("speeds", [None, (0.2, 0.3)])
def test_states_that_lie_on_no_line_or_slice_are_counted(speeds):
    rng = np.random.default_rng(4)
    place = rng.uniform((0.5, 0.1), (0.9, 0.5), (20, 2))
    d, h = np.repeat(place, 2, axis=0).T
    v = np.where(np.arange(40) % 2, 0.2, np.repeat(rng.choice([0.3, 0.4], 20), 2))
    dataset = fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=np.exp(4 + 4 * v - d))
    force_map = fm.fit_force_map(dataset)
    cube, _ = figures.workspace_figure(force_map, dataset, speeds=speeds).axes
    shown = sum(len(line.get_data_3d()[0]) for line in cube.get_lines() if line.get_label() == TRAIN)
    assert workspace_states_shown(force_map, dataset, speeds) == (shown, len(dataset.states))
    profiles = figures.force_profiles_figure(force_map, dataset, speeds=speeds)
    points = {
        (axes.get_xlabel(), *point)
        for axes in profiles.axes
        for line in axes.get_lines()
        if line.get_label() == TRAIN
        for point in zip(*line.get_data(), strict=True)
    }
    seen, most = profile_states_shown(force_map, dataset, speeds)
    assert most == len(dataset.states)
    assert len({force for *_, force in points}) == seen


def test_force_evolution(made, impact):
    figure = made["evolution"]()
    whole, phase1 = figure.axes
    time, force = series(whole, "contact force")
    assert force.max() == pytest.approx(impact.contact.force.max())
    assert time[force.argmax()] == pytest.approx(impact.peak_time - impact.onset, abs=2e-3)
    np.testing.assert_allclose(series(phase1, "end of Phase I")[0], impact.phase1_end - impact.onset)
    assert set(series(whole, "transient limit 280 N")[1]) == {280.0}
    assert series(whole, "transient limit 280 N")[0].max() == 0.5
    assert set(series(whole, "quasi-static limit 140 N")[1]) == {140.0}
    assert set(series(whole, "device range 320 N")[1]) == {320.0}
    assert any(words.startswith(f"Phase I peak {impact.peak_force:.1f} N") for words in legend(figure))
    assert whole.get_title("left") == impact.scenario.value.replace("_", " ")
    head = figures.force_evolution_figure(impact.recording, impact, fm.force_limit("temple"))
    assert any("not permitted" in words for words in texts(head))
    assert not any("limit 1" in words for words in legend(head))
    alone = figures.force_evolution_figure(impact.recording)
    np.testing.assert_array_equal(series(alone.axes[0], "as recorded")[1], impact.recording.force)


def test_a_saturated_peak_is_drawn_as_at_least(impact):
    recording = replace(
        impact.recording, force=np.minimum(impact.recording.force, 200.0), device=fm.Device(range=200.0, error=3.0)
    )
    figure = figures.force_evolution_figure(recording, fm.find_impact(recording))
    assert any("Phase I peak at least 200" in words for words in legend(figure))


def test_residuals(made, dataset, force_map):
    figure = made["residuals"]()
    assert [axes.get_xlabel() for axes in figure.axes] == ["Predicted force [N]", DISTANCE, HEIGHT, SPEED, PLACE, ORDER]
    states = dataset.train.states.select(dataset.train.states.impacts > 0)
    predicted = force_map.predict(states.distance, states.height, states.speed)
    names = list(dict.fromkeys(zip(dataset.role.tolist(), dataset.state.tolist(), strict=True)))
    turn = np.array([names.index(("train", name)) + 1 for name in states.name])
    at = [f"{d:.3f} {h:.3f}" for d, h in zip(dataset.states.distance, dataset.states.height, strict=True)]
    at = np.searchsorted(np.unique(at), [f"{d:.3f} {h:.3f}" for d, h in states.coordinates[:, :2]]) + 1
    for axes, x in zip(figure.axes, (predicted, *states.coordinates.T, at, turn), strict=True):
        found = series(axes, TRAIN)
        np.testing.assert_allclose(found, [x, 100 * (states.force - predicted) / states.force])
        assert {"underestimated", "overestimated"} <= {text.get_text() for text in axes.texts}
        assert CENSORED in _labels(axes)


def test_safe_speeds(made, speeds):
    figure = made["safe speeds"]()
    axes, bar = figure.axes
    cells = axes.collections[0].get_array()
    program = np.asarray(speeds.speeds.speed_to_program)
    shown = np.where(np.isnan(program), np.nan, speeds.speeds.speed)  # no colour where there is none to program
    assert np.isnan(shown).sum() > np.isnan(speeds.speeds.speed).sum()
    np.testing.assert_array_equal(np.ma.filled(cells, np.nan), shown.T)
    assert bar.get_ylabel() == "Safe speed at contact [m/s]"
    refused = int((speeds.speeds.to_program_outcome == fm.SpeedOutcome.UNCONFIRMED).sum())
    assert refused
    assert f"unconfirmed: no speed ({refused} places)" in legend(figure)
    assert any(patch.get_hatch() == "xxxx" for patch in axes.patches)
    words = [text.get_text() for text in figure.texts if text.get_transform() == axes.transData]
    both = np.array([program, speeds.speeds.speed])[:, np.isfinite(program)]
    assert sorted(words) == sorted(f"{fm.floor_speed(program)}\n({fm.floor_speed(at)})" for program, at in both.T)
    assert "280 N" in axes.get_title("left")
    assert "95 % confidence" in axes.get_title("left").replace("\n", " ")


def test_safe_speeds_where_none_is_confirmed(force_map):
    grid = fm.measured_grid(force_map, 0.1)
    none = fm.speed_map(force_map, *grid, limit=20.0, bound=fm.ToleranceBound())
    figure = figures.safe_speed_figure(none)
    assert len(figure.axes) == 1
    assert not figure.axes[0].collections
    assert [words for words in legend(figure) if words.startswith("unconfirmed")]


def test_path_speeds(made, along_path):
    figure = made["path speeds"]()
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Length along the path [m]", SPEED)
    for outcome, text in (("not_downward", "not downward"), ("outside", "outside what")):
        assert outcome in set(along_path.outcome)
        assert any(entry.startswith(text) and "no permission" in entry for entry in legend(figure))
    x, speed = series(axes, "speed to program, no cycle time")
    np.testing.assert_array_equal(speed, np.repeat(along_path.speed, 2))
    assert x[-1] == pytest.approx(along_path.path.lengths.sum())
    assert {patch.get_hatch() for patch in axes.patches} >= {"////", "...."}
    names = [text for text in texts(figure) if text in along_path.path.names]
    assert list(dict.fromkeys(names)) == list(dict.fromkeys(along_path.path.names))


def test_repeatability(made, dataset):
    found = fm.repeatability(dataset)
    axes = made["repeatability"]().axes[0]
    repeated = np.isfinite(found.sd)
    np.testing.assert_array_equal(series(axes, "repeated state"), [found.mean[repeated], found.sd[repeated]])
    pooled = series(axes, f"all states pooled: {found.within_state_sd:.2f} N")
    assert set(pooled[1]) == {found.within_state_sd}
    assert axes.get_ylabel() == "SD of repeats [N]"


@pytest.mark.parametrize("width", [0.17, 0.085])
def test_what_must_be_said_first_stands_above_the_speeds(paper_grids, width):
    force_map = fm.fit_force_map(paper_grids["ur10e"])
    case = {"limit": fm.force_limit(HAND), "contact": fm.Contact.TRANSIENT, "bound": fm.FixedMargin(0.0)}
    weak = fm.speed_map(force_map, *fm.measured_grid(force_map, 0.1), **case)
    said_first = warnings([weak.speeds.basis])
    assert len(said_first) == 6
    said = figures.safe_speed_figure(weak, width=width).get_suptitle()
    counted = "first read the 6 doubts about these speeds: in the report, or by forcemap speed or path"
    assert said.replace("\n", " ") == f"{SIMULATED} {counted}"


def test_a_figure_is_laid_out_as_it_is_saved(examples):
    """Placed once before it is saved as SVG, it is the figure that matplotlib saves; and it can be saved again."""
    from forcemap.figures import canvas, formats

    dataset = examples["ur10e"]

    def figure():
        return figures.force_profiles_figure(fm.fit_force_map(dataset), dataset)

    stream, by_matplotlib, ours = io.StringIO(), figure(), figure()
    with canvas.settings():
        by_matplotlib.savefig(stream, format="svg", metadata=formats._NO_METADATA)
    path = re.compile(r' d="([^"]*)"')
    assert path.findall(figures.svg(ours)) == path.findall(stream.getvalue())
    assert figures.png(ours) == figures.png(by_matplotlib)
