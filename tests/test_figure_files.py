"""Figures as files: nothing outside, nothing over another, in colour and grey; PNG, SVG and PDF; the bundle."""

from __future__ import annotations

import hashlib
import io
import itertools
import math
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pypdf
import pytest
import yaml
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from PIL import Image

import forcemap as fm
from forcemap import figures
from forcemap.cli.drawings import Choices, Kind, Source, draw
from forcemap.figures.names import label, labels
from pulses import TOML, pulse, save

HAND = {"area": "back_of_hand"}
AT_PLACES = {**HAND, "contact": fm.Contact.TRANSIENT}
KINDS = {
    Kind.GRID: {},
    Kind.REPEATABILITY: {},
    Kind.PROFILES: {},
    Kind.HEIGHTS: {},
    Kind.WORKSPACE: {},
    Kind.RESIDUALS: {},
    Kind.COMPARISON: HAND,
    Kind.SPEEDS: AT_PLACES,
    Kind.TO_MEASURE: AT_PLACES,
}
WIDTHS = (figures.COLUMN_WIDTH, figures.PAGE_WIDTH)
ALL_WIDTHS = (0.075, figures.COLUMN_WIDTH, 0.089, 0.12, 0.135, 0.14, figures.PAGE_WIDTH)


def random_campaign(seed, folder):
    """A folder whose places, speeds, device range, scatter, names and roles are random: on grids and scattered."""
    rng = np.random.default_rng(seed)
    reach, height = rng.uniform(0.2, 0.6), rng.uniform(0.05, 0.4)
    places = int(rng.integers(9, 20))
    d, h = rng.uniform(reach, reach + rng.uniform(0.3, 0.8), places), rng.uniform(height, height + 0.5, places)
    if seed % 3 == 0:  # on a grid
        d, h = (
            axis.ravel() for axis in np.meshgrid(np.linspace(d.min(), d.max(), 4), np.linspace(h.min(), h.max(), 3))
        )
    speeds = rng.uniform(0.05, 0.3) + np.arange(int(rng.integers(3, 6))) * rng.uniform(0.02, 0.1)
    index = np.repeat(np.arange(d.size * speeds.size), repeats := int(rng.integers(2, 4)))
    d, h, v = d[index // speeds.size], h[index // speeds.size], speeds[index % speeds.size]
    scale = rng.uniform(5.0, 7.0)
    force = np.exp(scale + 3 * v - 0.8 * d - 0.5 * h + np.repeat(rng.normal(0, 0.02, index.size // repeats), repeats))
    force *= rng.normal(1, 0.005, force.size)
    reached = float(np.quantile(force, rng.uniform(0.85, 1.0)))
    censored = force >= reached
    role = np.where(index % 4 == 3, "test", "train")
    robot = ["UR10e", "KUKA LBR iiwa 7 R800", "A robot of a name that is much too long for a column", ""][seed % 4]
    conditions = fm.Conditions(
        robot=robot, moving_mass=rng.uniform(8, 40), device=fm.Device(range=reached, error=3.0, stiffness=75e3)
    )
    states = {"distance": d, "height": h, "speed": v, "peak_force": np.minimum(force, reached)}
    dataset = fm.ImpactDataset.from_arrays(
        **states, state=[f"s{i}" for i in index], role=role, censored=censored, conditions=conditions
    )
    folder.mkdir(parents=True)
    fm.write_dataset(dataset, folder / "impacts.csv")
    stated = f'robot.moving_mass_kg = {conditions.moving_mass}\nrobot.model = "{robot}"\n' if robot else ""
    stated = stated or f"robot.moving_mass_kg = {conditions.moving_mass}\n"
    device = f"device.range_N = {reached}\ndevice.error_N = 3.0\ndevice.stiffness_N_per_m = 75000.0\n"
    (folder / "campaign.toml").write_text(f'schema = "forcemap-campaign/1"\n{stated}{device}')
    return folder


def shown_texts(figure):
    """Every text that is drawn, with the box it covers [pixels]."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer, hidden = canvas.get_renderer(), set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis, *([axes.zaxis] if axes.name == "3d" else [])):
            low, high = sorted(axis.get_view_interval())
            for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
                seen = low - 1e-9 <= tick.get_loc() <= high + 1e-9
                hidden |= {tick.label2} if seen and tick.label1.get_visible() else {tick.label1, tick.label2}
    texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
    return [(text, text.get_window_extent(renderer)) for text in texts if text not in hidden]


def check_layout(figure):
    """No text over another, none outside the figure, no marker outside its axes."""
    boxes, wide, tall = shown_texts(figure), *figure.bbox.size
    for text, box in boxes:
        assert min(box.x0, box.y0, wide - box.x1, tall - box.y1) > -1, f"cut: {text.get_text()!r}"
    for (one, first), (other, second) in itertools.combinations(boxes, 2):
        apart = min(first.x1, second.x1) - max(first.x0, second.x0), min(first.y1, second.y1) - max(first.y0, second.y0)
        assert min(apart) < 1, f"{one.get_text()!r} lies over {other.get_text()!r}"
    for axes in figure.axes:
        if axes.name == "3d":
            continue
        (left, right), (low, high) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
        for line in axes.get_lines():
            if line.get_marker() not in ("", "None", None) and line.get_transform() == axes.transData:
                x, y = (np.asarray(values, dtype=float) for values in line.get_data())
                known = np.isfinite(x) & np.isfinite(y)
                assert ((left <= x) & (x <= right) & (low <= y) & (y <= high))[known].all(), line.get_label()


def test_nothing_is_cut_lies_outside_or_over_another_on_random_campaigns(full_size, tmp_path):
    """With `full_size` all widths and twenty campaigns; grey changes colours alone."""
    for seed in range(20 if full_size else 2):
        source = Source(str(random_campaign(seed, tmp_path / f"campaign-{seed}")))
        widths = ALL_WIDTHS if full_size else ALL_WIDTHS[seed::5]
        for (kind, chosen), width in itertools.product(KINDS.items(), widths):
            try:
                figure = draw(kind, [source], Choices(**chosen), width=width)
            except (fm.BoundNotAvailable, fm.FitError, fm.InputError):  # too few states, or a limit above the range
                assert kind in (Kind.SPEEDS, Kind.TO_MEASURE, Kind.PROFILES)
                continue
            try:
                check_layout(figures.in_grey(figure) if seed % 2 else figure)
            except AssertionError as error:
                raise AssertionError(f"campaign {seed}, {kind}, {width} m: {error}") from None


@pytest.mark.parametrize("width", WIDTHS)
def test_figures_of_published_maps_and_the_planar_arm_are_laid_out(width):
    every = [Source(name) for name in fm.PUBLISHED_MAPS]
    drawn = {
        Kind.HEIGHTS: draw(Kind.HEIGHTS, every[::2], Choices(speeds=(0.2, 0.4)), width=width),
        Kind.COMPARISON: draw(Kind.COMPARISON, every, Choices(**HAND, height=0.14), width=width),
        Kind.PLANAR_POSTURES: draw(Kind.PLANAR_POSTURES, [], Choices(), width=width),
        Kind.PLANAR_MASS: draw(Kind.PLANAR_MASS, [], Choices(), width=width),
    }
    for kind, figure in drawn.items():
        if kind is not Kind.PLANAR_MASS:  # its contours break where their own figures stand
            check_layout(figure)


def line(axes, words):
    (found,) = [each for each in axes.get_lines() if each.get_label() == words]
    return np.array(found.get_data())


def test_heights_shows_the_map_at_every_height_and_speed():
    names = ("ur10e", "kuka-iiwa7-10nm")
    figure = draw(Kind.HEIGHTS, [Source(name) for name in names], Choices(speeds=(0.2, 0.4)), width=0.16)
    robots = ("Universal Robots UR10e", "KUKA LBR iiwa 7 R800, 10 Nm")
    panels = list(itertools.product((0.2, 0.4), zip(names, robots, strict=True)))
    for axes, (speed, (name, robot)) in zip(figure.axes, panels, strict=True):
        assert axes.get_title("left") == f"{robot}, {speed:.2f} m/s"
        for height in (0.14, 0.22, 0.30, 0.38, 0.46):
            x, force = line(axes, f"height {height:.2f} m")
            np.testing.assert_allclose(force, fm.published_map(name).predict(x, height, speed))


def test_every_marker_of_heights_has_an_entry_in_the_legend(tmp_path):
    """The highest of places at random is alone at its height: no line inside the measured range names it."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        place = rng.uniform((0.5, 0.1), (0.9, 0.5), (12, 2))
        d, h = np.repeat(place, 3, axis=0).T
        v = np.tile((0.2, 0.3, 0.4), 12)
        force = fm.published_map("ur10e").predict(d, h, v)
        table = tmp_path / f"places-{seed}.csv"
        fm.write_dataset(fm.ImpactDataset.from_arrays(distance=d, height=h, speed=v, peak_force=force), table)
        figure = draw(Kind.HEIGHTS, [Source(str(table))], Choices(), width=0.16)
        entries = {handle.get_marker() for each in figure.legends for handle in each.legend_handles}
        lines = [each for axes in figure.axes for each in axes.get_lines() if each.get_marker() not in ("", "None")]
        drawn = {each.get_marker() for each in lines if np.isfinite(each.get_ydata()).any()}
        assert len(drawn) > 3
        assert drawn <= entries, drawn - entries


def test_comparison_of_published_maps_is_the_papers_figure():
    """Its green, its red: 318 and 260 N of the standard at 0.3 m/s (section V-C)."""
    sources = [Source(name) for name in fm.PUBLISHED_MAPS]
    figure = draw(Kind.COMPARISON, sources, Choices(**HAND, height=0.14, speeds=(0.3,)), width=0.16)
    for i, (name, standard) in enumerate(zip(fm.PUBLISHED_MAPS, (318.2, 259.8, 259.8), strict=True)):
        x, force = line(figure.axes[i], "3D map")
        np.testing.assert_allclose(force, fm.published_map(name).predict(x, 0.14, 0.3))
        np.testing.assert_allclose(line(figure.axes[i], "standard's contact model")[1], standard, atol=0.05)
        x, force = line(figure.axes[i + 3], "3D map")
        np.testing.assert_allclose(force, fm.published_map(name).predict(0.71, x, 0.3), rtol=0.005)
        x, force = line(figure.axes[i], "2D map, fitted to the 3D map")
        two = np.log(force)
        assert np.abs(two - np.polynomial.Polynomial.fit(x, two, 2)(x)).max() < 1e-9


def test_a_map_beside_the_standard(ask):
    """With the map's forces in the place of measured ones: against its own equation, point by point."""
    code, found = ask("compare", "kuka-iiwa7-30nm", "--area", "back_of_hand")
    assert code == 0
    force_map = fm.published_map("kuka-iiwa7-30nm")
    states = force_map.measured_range.points
    force = force_map.predict(*states.T)
    inside = force < 500
    percent = 100 * (states[inside, 2] * math.sqrt(75e3 * 10) / force[inside] - 1)
    standard = found["models"][-1]
    assert standard["model"] == "contact model"
    assert standard["accuracy"]["states"] == inside.sum()
    assert standard["accuracy"]["max_underestimation_percent"] == pytest.approx(-percent.min())
    assert standard["accuracy"]["mean_overestimation_percent"] == pytest.approx(percent[percent > 0].mean())
    assert {each["model"] for each in found["allowed"]} == {"CFM_3D", "contact model"}
    assert not any(each["confirmed_places"] for each in found["allowed"] if each["contact"] == "transient")  # it clamps
    assert "the map's own forces stand for measured ones" in found["assumptions"][0]


def test_every_model_is_compared_on_all_states_too(ask, examples, example_folders):
    """The rows All of the paper's tables: of the map they are those of its accuracy."""
    _, found = ask("compare", example_folders["ur10e"], "--area", "back_of_hand")
    dataset = examples["ur10e"]
    force_map, model_2d = fm.fit_force_map(dataset), fm.fit_force_map(dataset, form=fm.CFM_2D)
    for model, expected in zip(found["models"], (force_map, model_2d), strict=False):
        accuracy = fm.force_map_accuracy(expected, dataset)
        assert model["accuracy_all"]["on"] == "all states"
        assert model["accuracy_all"]["states"] == accuracy.states
        assert model["accuracy_all"]["max_underestimation_percent"] == accuracy.max_underestimation_percent
    for model in found["models"]:
        assert model["accuracy_all"]["states"] >= model["accuracy"]["states"]


@pytest.mark.parametrize(
    ("robot", "settings", "words"),
    [
        ("KUKA LBR iiwa 7 R800", "external torque limit 30 Nm at any joint", "KUKA LBR iiwa 7 R800, 30 Nm"),
        ("Universal Robots UR10e with Airskin (1.8 kg, not used)", "200 W, 10 kg m/s", "Universal Robots UR10e"),
        ("", "", "my-campaign"),
    ],
)
def test_labels_are_those_a_reader_knows(robot, settings, words):
    conditions = fm.Conditions(robot=robot, safety_settings=settings)
    assert label(conditions, "my-campaign") == words
    assert labels([(conditions, "a"), (conditions, "b")])[1].endswith("b")


@pytest.mark.parametrize(
    ("width", "wide", "grey"),
    [("column", 80, ()), ("page", 160, ("--grey",)), ("slide", 240, ()), ("88.9mm", 88.9, ()), ("181 mm", 181, ())],
)
def test_files_are_what_their_names_say(ask, tmp_path, width, wide, grey):
    made = {}
    for ending in ("png", "svg", "pdf"):
        for again in (1, 2) if width == "column" else (1,):
            file = tmp_path / f"{again}.{ending}"
            code, found = ask("figure", "heights", "ur10e", "-o", file, "--width", width, *grey)
            assert code == 0
            assert found["width_mm"] == wide
            assert made.setdefault(ending, file.read_bytes()) == file.read_bytes(), "not the same twice"
    tall = found["height_mm"]
    picture = Image.open(io.BytesIO(made["png"]))
    assert picture.info["dpi"] == (pytest.approx(300, abs=0.5), pytest.approx(300, abs=0.5))
    assert [25.4 * side / 300 for side in picture.size] == [pytest.approx(wide, abs=0.5), pytest.approx(tall, abs=1)]
    colours = np.asarray(picture.convert("RGB")).astype(int)
    assert (np.ptp(colours, axis=2).max() == 0) == bool(grey)
    drawing = ElementTree.fromstring(made["svg"])
    assert drawing.tag == "{http://www.w3.org/2000/svg}svg"
    assert float(drawing.get("width").removesuffix("pt")) == pytest.approx(wide / 25.4 * 72, abs=1)
    shades = re.findall(r"#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})\b", made["svg"].decode())
    assert all(len(set(shade)) == 1 for shade in shades) == bool(grey)
    (page,) = pypdf.PdfReader(io.BytesIO(made["pdf"])).pages
    assert float(page.mediabox.width) == pytest.approx(wide / 25.4 * 72, abs=1)
    assert "Distance [m]" in page.extract_text()
    fonts = [font.get_object() for font in page["/Resources"]["/Font"].values()]
    assert {str(font["/Subtype"]) for font in fonts} == {"/Type0"}  # TrueType, embedded
    assert b"CreationDate" not in made["pdf"]


@pytest.fixture(scope="module")
def grey_space():
    """Surfaces in space with their greys, and the same in colour."""
    source = Source("ur10e")
    return [draw(Kind.WORKSPACE, [source], Choices(), width=0.08) for _ in range(2)]


def test_nothing_keeps_a_colour_in_grey(examples, example_folders):
    """SIMULATED in its box, hatches, markers, scales, surfaces in space."""
    source = Source(str(example_folders["ur10e"]))
    for kind in (Kind.SPEEDS, Kind.WORKSPACE, Kind.COMPARISON, Kind.TO_MEASURE):
        picture = Image.open(
            io.BytesIO(figures.png(figures.in_grey(draw(kind, [source], Choices(**KINDS[kind]), width=0.08)), 60))
        )
        assert np.ptp(np.asarray(picture.convert("RGB")).astype(int), axis=2).max() == 0, kind


def test_grey_keeps_the_order_of_what_it_shows(grey_space):
    """Brighter in colour is brighter in grey, pixel by pixel, on surfaces in space as well."""
    colour, grey = grey_space
    figures.in_grey(grey)
    bright = np.asarray(Image.open(io.BytesIO(figures.png(colour, 100))).convert("L")).astype(int)
    shown = np.asarray(Image.open(io.BytesIO(figures.png(grey, 100))).convert("L")).astype(int)
    assert np.abs(bright - shown).max() <= 3


REFUSED = {
    "no file": (["heights", "ur10e"], "output: expected -o FILE"),
    "another ending": (["heights", "ur10e", "-o", "a.gif"], "expected .png, .svg, .pdf"),
    "unknown kind": (["height", "ur10e", "-o", "a.png"], "heights"),
    "no source": (["heights", "-o", "a.png"], "found 0 sources, expected one to 3"),
    "too many": (["workspace", "ur10e", "ur10e", "-o", "a.png"], "found 2 sources, expected one"),
    "not taken": (["workspace", "ur10e", "--area", "chest", "-o", "a.png"], "area: workspace does not take it"),
    "no area": (
        ["comparison", "ur10e", "-o", "a.png"],
        "such as --area back_of_hand: none is assumed; regions are skull_forehead, face, neck,",
    ),
    "no width": (["heights", "ur10e", "-o", "a.png", "--width", "85"], "such as 85mm"),
    "too narrow": (["heights", "ur10e", "-o", "a.png", "--width", "40mm"], "found '40mm', expected column, page"),
    "no contact": (["speeds", "ur10e", "--area", "chest", "-o", "a.png"], "expected --contact"),
    "the head": (
        ["speeds", "ur10e", "--area", "face", "--contact", "transient", "-o", "a.png"],
        "contact with face is not permitted",
    ),
    "no impacts": (["residuals", "ur10e", "-o", "a.png"], "residuals shows impacts"),
    "speed not measured": (["heights", "ur10e", "--speeds-mps", "0.9", "-o", "a.png"], "expected 0.2 to 0.4 m/s"),
    "height not measured": (
        ["comparison", "ur10e", "--area", "chest", "--height", "2", "-o", "a.png"],
        "height: found 2 m, expected 0.14 to 0.46 m",
    ),
    "no states": (["grid", "ur10e", "-o", "a.png"], "grid shows impacts"),
    "no impact": (["evolution", "flat.csv", "-o", "a.png"], "found no impact"),
    "no such source": (["heights", "none.csv", "-o", "a.png"], "no such file"),
    "no path": (["path", "ur10e", "-o", "a.png"], "expected --path"),
    "another file": (["heights", "ur10e", "-o", "mine.png"], "this is another file"),
}


@pytest.mark.parametrize(("words", "said"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_drawn_says_so(forcemap, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    Path("mine.png").write_text("kept")
    Path("flat.csv").write_text("time_ms,force_N\n" + "".join(f"{i},0.1\n" for i in range(500)))
    code, out, err = forcemap("figure", *words)
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"mine.png", "flat.csv"}
    assert Path("mine.png").read_text() == "kept"


def test_the_evolution_is_of_the_recording_and_named_by_robot_place_and_speed(simulated):
    recordings = sorted((simulated / "recordings").glob("*.csv"))[:2]
    figure = draw(Kind.EVOLUTION, [Source(str(file)) for file in recordings], Choices(**HAND), width=0.08)
    entries = [text.get_text().replace("\n", " ") for text in figure.legends[0].get_texts()]
    assert any("d 0.52 m, h 0.14 m, 0.20 m/s" in words for words in entries)
    assert "transient limit 280 N" in entries
    check_layout(figure)
    whole = draw(Kind.EVOLUTION, [Source(str(simulated))], Choices(), width=0.16)
    forces = [
        np.max(line.get_ydata()) for line in whole.axes[0].get_lines() if "contact force" in str(line.get_label())
    ]
    dataset = fm.read_dataset(simulated)
    assert forces == [pytest.approx(dataset.peak_force[~dataset.censored].max(), rel=0.02)]


@pytest.fixture
def two_curves(tmp_path):
    """A file of two curves, of 150 and 250 N."""
    file = tmp_path / "theirs" / "recordings" / "all.csv"
    file.parent.mkdir(parents=True)
    (tmp_path / "theirs" / "campaign.toml").write_text(
        f'{TOML}[recordings]\ncurve = "run"\ntime = "time_s"\nforce = "force_N"\n'
    )
    rows = [
        f"{name},{t:.4f},{f:.2f}\n"
        for name, peak in (("soft", 150.0), ("hard#2", 250.0))
        for t, f in zip(*pulse(peak, held=0.4 * peak), strict=True)
    ]
    file.write_text("run,time_s,force_N\n" + "".join(rows))
    return file


def test_a_curve_of_several_is_drawn_by_its_name_and_none_without(two_curves, ask, forcemap):
    assert f"{two_curves}#hard#2:" in forcemap("inspect", two_curves)[1]
    figure = draw(Kind.EVOLUTION, [Source(f"{two_curves}#hard#2")], Choices(), width=0.16)
    entries = [text.get_text().replace("\n", " ") for text in figure.legends[0].get_texts()]
    assert "contact force, all.csv#hard#2" in entries
    assert any(words.startswith(("Phase I peak 25", "Phase I peak 24")) for words in entries)
    target = two_curves.parent / "a.png"
    for name, said in (("", f"found 2 curves, expected one: name it as {two_curves}#CURVE"), ("#none", "soft, hard#2")):
        code, found = ask("figure", "evolution", f"{two_curves}{name}", "-o", target)
        assert code == 2
        assert said in found["error"]["message"]
    assert not target.exists()
    (two_curves.parents[1] / "plan.csv").write_text(
        "state_id,repeat,role,distance_m,height_m,speed_mps\nsoft,1,train,0.5,0.2,0.1\n"
    )
    figure = draw(Kind.EVOLUTION, [Source(f"{two_curves}#soft")], Choices(), width=0.16)
    assert "contact force, robot not stated, soft" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_several_recordings_say_whose_scenario_peak_and_phase_are_drawn(two_curves, tmp_path):
    free = tmp_path / "free.csv"
    save(free, *pulse(200.0))
    sources = [Source(str(free)), Source(f"{two_curves}#soft")]
    scenarios = []
    for source in sources:
        alone = draw(Kind.EVOLUTION, [source], Choices(), width=0.16)
        scenarios.append(alone.axes[0].get_title("left"))
    assert scenarios[0] != scenarios[1]
    for width in ALL_WIDTHS:
        figure = draw(Kind.EVOLUTION, sources, Choices(**HAND), width=width)
        entries = [text.get_text().replace("\n", " ") for text in figure.legends[0].get_texts()]
        assert f"contact force, free.csv, {scenarios[0]}" in entries
        assert f"all.csv#soft, {scenarios[1]}" in entries
        assert "end of Phase I, free.csv" in entries
        assert any(words.startswith("Phase I peak") and words.endswith(", free.csv") for words in entries)
        assert scenarios[0] not in figure.axes[0].get_title("left")
        check_layout(figure)


def grid_of(distances, heights, speeds):
    points = np.array(list(itertools.product(distances, heights, speeds)))
    force = fm.published_map("ur10e").predict(*points.T)
    names = ("distance", "height", "speed", "peak_force")
    return fm.ImpactDataset.from_arrays(**dict(zip(names, (*points.T, force), strict=True)))


@pytest.fixture
def lab(tmp_path):
    """A table at other heights than the published maps, whose own default speed is 0.25 m/s."""
    fm.write_dataset(grid_of((0.5, 0.7, 0.9), (0.10, 0.25, 0.40), (0.2, 0.25, 0.3)), tmp_path / "lab.csv")
    return Source(str(tmp_path / "lab.csv"))


def test_maps_beside_each_other_are_cut_at_one_speed_and_place(lab, ask, tmp_path):
    sources = [lab, Source("ur10e"), Source("kuka-iiwa7-10nm")]
    alone = {draw(Kind.HEIGHTS, [each], Choices(), width=0.16).axes[0].get_title("left")[-8:] for each in sources}
    assert len(alone) > 1
    for kind, chosen in ((Kind.HEIGHTS, {}), (Kind.COMPARISON, {**HAND, "moving_mass": 30.0})):
        figure = draw(kind, sources, Choices(**chosen), width=0.16)
        titles = [" ".join(axes.get_title("left").split()) for axes in figure.axes]
        assert len({re.search(r"[\d.]+ m/s$", title)[0] for title in titles}) == 1, titles
        places = {re.search(r"(height|distance) [\d.]+ m,", title)[0] for title in titles if kind is Kind.COMPARISON}
        assert len(places) == 2 * (kind is Kind.COMPARISON), titles
    table = tmp_path / "fast.csv"
    fm.write_dataset(grid_of((0.5, 0.7, 0.9), (0.10, 0.25, 0.40), (0.5, 0.6, 0.7)), table)
    code, found = ask("figure", "heights", table, "ur10e", "-o", tmp_path / "a.png")
    assert code == 0
    (line,) = found["differs"]
    assert "panels are at different speeds" in line
    assert f"{table} 0.6 m/s, ur10e 0.3 m/s" in line
    assert "differs" not in ask("figure", "heights", lab.name, "ur10e", "-o", tmp_path / "a.png")[1]


def test_heights_are_drawn_where_states_lie(ask, example_folders, tmp_path):
    """At 0.30 m/s the example was measured at five heights of a grid, and once each at a few in between."""
    source = Source(str(example_folders["ur10e"]))
    figure = draw(Kind.HEIGHTS, [source], Choices(), width=0.16)
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {f"height {height:.2f} m" for height in (0.14, 0.22, 0.30, 0.38, 0.46)} <= words
    states = source.dataset.states
    at = np.abs(states.speed - 0.3) <= 0.01
    on_lines = np.any(np.abs(states.height[:, None] - [0.14, 0.22, 0.30, 0.38, 0.46]) <= 0.005, axis=1)
    code, found = ask("figure", "heights", source.name, "-o", tmp_path / "heights.svg")
    assert code == 0
    (note,) = found["notes"]
    assert f"{len(states) - int((at & on_lines).sum())} of {len(states)} measured states are not shown" in note
    assert "notes" not in ask("figure", "heights", "ur10e", "-o", tmp_path / "heights.svg")[1]


@pytest.mark.parametrize("width", ["column", "page"])
@pytest.mark.parametrize(
    ("kind", "chosen"),
    [("comparison", ("--area", "back_of_hand")), ("heights", ("--speeds-mps", "0.2,0.3")), ("heights", ())],
)
def test_a_figure_of_three_maps_is_no_higher_than_a_page(ask, tmp_path, kind, chosen, width):
    options = (*chosen, "--width", width, "-o", tmp_path / "figure.pdf")
    code, found = ask("figure", kind, *fm.PUBLISHED_MAPS, *options)
    assert code == 0
    assert found["height_mm"] <= 240
    assert "notes" not in found


def test_campaigns_beside_each_other_are_cut_where_each_alone_is(example_folders):
    """Most states of a plan for training are its corners: no place to cut at."""
    sources = [Source(str(example_folders[name])) for name in ("ur10e", "kuka-iiwa7-30nm", "kuka-iiwa7-10nm")]
    for speeds, cuts in ((None, {0.70, 0.71}), ((0.3,), {0.70, 0.71}), ((0.4,), {0.70, 0.71})):
        choices = Choices(**HAND, speeds=speeds)
        for some in ([sources[0]], sources[1:], sources):
            titles = [
                axes.get_title("left") or axes.get_title()
                for axes in draw(Kind.COMPARISON, some, choices, width=0.16).axes
            ]
            at = {float(cut) for title in titles for cut in re.findall(r"distance ([\d.]+) m", title)}
            assert at
            assert at <= cuts
            assert len(at) == 1
            assert {float(cut) for title in titles for cut in re.findall(r"height ([\d.]+) m", title)} == {0.30}


def test_a_figure_higher_than_a_page_says_so(ask, tmp_path):
    speeds = ",".join(f"{speed:.2f}" for speed in np.linspace(0.2, 0.4, 11))
    _, found = ask("figure", "heights", *fm.PUBLISHED_MAPS, "--speeds-mps", speeds, "-o", tmp_path / "figure.pdf")
    assert found["height_mm"] > 240
    assert any("higher than a page" in note for note in found["notes"])


def test_a_legend_shows_the_markers_and_no_title_parts_a_number_from_its_unit():
    figure = draw(Kind.COMPARISON, [Source(name) for name in fm.PUBLISHED_MAPS], Choices(**HAND), width=0.16)
    (legend,) = figure.legends
    markers = {
        text.get_text(): line.get_marker() for line, text in zip(legend.get_lines(), legend.get_texts(), strict=True)
    }
    assert markers["2D map of each height, fitted to the 3D map"] == "^"
    assert any("\n30 Nm\n" in axes.get_title("left") for axes in figure.axes)


def test_a_figure_counts_the_doubts_that_its_command_says_whole(ask, forcemap, example_folders, tmp_path):
    folder = example_folders["ur10e"]
    chosen = ("--area", "back_of_hand", "--contact", "transient")
    expected = ask("speed", folder, "--distance", 0.8, "--height", 0.4, *chosen)[1]["warnings"]
    assert expected
    code, found = ask("figure", "speeds", folder, *chosen, "-o", tmp_path / "speeds.svg")
    assert (code, found["warnings"]) == (0, expected)
    (above,) = [
        text.get_text() for text in draw(Kind.SPEEDS, [Source(str(folder))], Choices(**AT_PLACES), width=0.08).texts
    ]
    assert above.startswith("SIMULATED: not a measurement of any robot\n")
    many = "the doubt" if len(expected) == 1 else f"the {len(expected)} doubts"
    assert f"first read {many} about these speeds" in " ".join(above.split())
    assert "…" not in above
    path = tmp_path / "path.csv"
    path.write_text("x_m,y_m,z_m,segment\n0.8,0,0.44,down\n0.8,0,0.2,down\n")
    said = ask("figure", "path", folder, "--path", path, *chosen, "-o", tmp_path / "path.svg")[1]["warnings"]
    assert said == expected


def test_no_line_in_grey_means_two_things(lab):
    """Dashes, width and marker tell apart what has another name in the legend."""
    sources = [lab, Source("ur10e")]
    drawn = [
        draw(Kind.HEIGHTS, sources, Choices(), width=0.16),
        draw(Kind.COMPARISON, sources, Choices(**HAND, moving_mass=30.0), width=0.16),
    ]
    for figure in drawn:
        looks = {}
        for axes in figures.in_grey(figure).axes:
            for each in axes.get_lines():
                if each.get_linestyle() != "None" and not each.get_label().startswith("_"):
                    look = each._unscaled_dash_pattern, each.get_linewidth()
                    looks.setdefault(str(look), set()).add(each.get_label())
        assert len(looks) > 4
        assert all(len(names) == 1 for names in looks.values()), looks


@pytest.mark.parametrize("width", WIDTHS)
def test_safe_speeds_say_in_figures_only_where_there_are_some(example_folders, width):
    figure = draw(Kind.SPEEDS, [Source(str(example_folders["ur10e"]))], Choices(**AT_PLACES), width=width)
    title = figure.axes[0].get_title("left")
    words = title.replace("\n", " ")
    written = any(text.get_transform() == figure.axes[0].transData for text in figure.texts)
    assert written == (width == figures.PAGE_WIDTH)
    assert ("in figures: speed to program" in words) == written
    assert ("shade: speed at contact; to program 0.01 m/s less" in words) == (not written)
    lines = title.split("\n")
    for line_, after in itertools.pairwise(lines):  # a line is broken once: the next word would not have fitted
        if not re.match(r"bound:|shade:|in figures:|each speed", after):
            assert len(f"{line_} {after.split()[0]}") > 0.8 * max(map(len, lines)), title


def test_the_planar_arm_has_its_command(ask):
    reading = ["--link-mass", "uniform_rod", "--last-link", "down", "--wrist", "locked"]
    code, found = ask("planar-arm", *reading, "--base-height-m", "0.18")
    assert code == 0
    assert found["standard_effective_mass_kg"] == 10.5
    assert len(found["places"]) == 9
    from forcemap.dynamics.mass_map import planar_effective_mass_at
    from forcemap.dynamics.planar_arm import papers_arms

    arm = papers_arms()["last link down, wrist locked"]
    for place in found["places"]:
        value = planar_effective_mass_at(arm, place["distance_m"], place["height_m"]).value
        assert place["effective_mass_kg"] == pytest.approx(float(value))
    code, found = ask("planar-arm", *reading)
    assert code == 2
    assert "--base-height-m" in found["error"]["message"]
    reading[3] = "sideways"
    assert "sideways" in ask("planar-arm", *reading, "--base-height-m", "0.18")[1]["error"]["message"]


@pytest.fixture(scope="module")
def published(simulated, tmp_path_factory):
    from forcemap.cli.app import run

    folder = tmp_path_factory.mktemp("published") / "bundle"
    assert (
        run(["publication", str(simulated), "-o", str(folder), "--area", "back_of_hand", "--author", "A. Author"]) == 0
    )
    return folder


def test_a_publication_has_the_campaigns_own_limits_and_says_first_all_that_its_speeds_say(simulated, tmp_path, ask):
    folder = shutil.copytree(simulated, tmp_path / "own")
    columns = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor\n"
    row = "back_of_hand,hand,hand_fingers,190,100,1.5\n"
    (folder / "own.csv").write_text(f"# edition: own\n# source: own\n# version: 1\n{columns}{row}")
    stated = folder / "campaign.toml"
    stated.write_text(stated.read_text().replace("[standard]", '[standard]\nlimit_table = "own.csv"'))
    code, answer = ask("publication", folder, "-o", tmp_path / "bundle", "--area", "back_of_hand")
    assert code == 0
    readme = " ".join((tmp_path / "bundle" / "README.md").read_text().split())
    for contact, newtons in (("transient", 150), ("quasi-static", 100)):
        speeds = ask("speed-map", folder, "--area", "back_of_hand", "--contact", contact)[1]
        assert speeds["limit_N"] == newtons
        assert (
            f"{newtons} N, {contact} contact" in (tmp_path / "bundle" / "tables" / f"speeds-{contact}.csv").read_text()
        )
        assert speeds["warnings"]
        for warning in speeds["warnings"]:
            assert warning in answer["warnings"]
            assert warning in readme
    assert (tmp_path / "bundle" / "data" / "own.csv").read_bytes() == (folder / "own.csv").read_bytes()


def test_a_publication_is_whole_and_its_checksums_hold(published, simulated):
    sums = dict(reversed(line.split("  ")) for line in (published / "SHA256SUMS").read_text().splitlines())
    files = {path.relative_to(published).as_posix() for path in published.rglob("*") if path.is_file()}
    assert set(sums) == files - {"SHA256SUMS"}
    assert all(hashlib.sha256((published / name).read_bytes()).hexdigest() == digest for name, digest in sums.items())
    measured = [*simulated.rglob("recordings/*"), *(simulated / name for name in ("plan.csv", "impacts.csv"))]
    for file in measured:
        assert (published / "data" / file.relative_to(simulated)).read_bytes() == file.read_bytes()
    drawn = {name.partition("/")[2] for name in files if name.startswith("figures/")}
    kinds = {"grid", "heights", "profiles", "workspace", "residuals", "repeatability", "evolution", "comparison"}
    kinds |= {"speeds-transient", "speeds-quasi-static"}
    assert drawn == {f"{kind}.{ending}" for kind in kinds for ending in ("pdf", "png", "svg")}
    assert "SIMULATED" in (published / "README.md").read_text()


def test_a_publication_keeps_a_state_that_was_measured_again_in_both_roles(forcemap, example_folders, tmp_path):
    from forcemap.csv_table import read_table

    written = tmp_path / "bundle"
    assert forcemap("publication", example_folders["ur10e"], "-o", written)[0] == 0
    rows = read_table((written / "tables" / "states.csv").read_bytes(), "states", what="row").texts
    (counts,) = read_table((written / "tables" / "dataset.csv").read_bytes(), "dataset", what="row").texts
    train = {row["state_id"] for row in rows if row["role"] == "train"}
    test = {row["state_id"] for row in rows if row["role"] == "test"}
    published, fitted = fm.read_map(written / "map.json"), fm.fit_force_map(fm.read_dataset(written / "data"))
    assert len(published.fit.states) == len(fitted.fit.states) == len(train) == int(counts["training_states"]) == 27
    assert len(test) == int(counts["testing_states"]) == 110
    assert len(train & test) == 3
    of_both = [row for row in rows if row["role"] == "train" and row["state_id"] in test]
    names = fitted.fit.states.name
    assert [float(row["mean_peak_force_N"]) for row in of_both] == pytest.approx(
        [fitted.fit.states.force[names.index(row["state_id"])] for row in of_both]
    )
    assert (
        "3 are training states measured again, which `states.csv` has a row of" in (written / "README.md").read_text()
    )


def test_a_publication_says_which_states_lie_outside_the_measured_range(example_folders, tmp_path, forcemap):
    from forcemap.csv_table import read_table

    folder, written = tmp_path / "campaign", tmp_path / "bundle"
    shutil.copytree(example_folders["ur10e"], folder)
    with (folder / "impacts.csv").open("a") as table:
        table.write("far,1,test,1.30,0.38,0.4,300.0,false,unconstrained,simulated\n")
        table.write("near,1,test,0.893,0.46,0.2,140.0,false,unconstrained,simulated\n")
    assert forcemap("publication", folder, "-o", written)[0] == 0
    states, accuracies = (
        read_table((written / "tables" / f"{name}.csv").read_bytes(), name, what="row").texts
        for name in ("states", "accuracy")
    )
    assert [row["state_id"] for row in states if row["in_measured_range"] == "false"] == ["far"]
    assert next(row["states_outside_measured_range"] for row in accuracies if row["on"].startswith("test")) == "1"


def test_a_publications_tables_and_map_are_those_of_the_campaign(published, simulated):
    from forcemap.csv_table import read_table

    def rows(name):
        return read_table((published / "tables" / f"{name}.csv").read_bytes(), name, what="row").texts

    dataset = fm.read_dataset(simulated)
    force_map = fm.fit_force_map(dataset)
    np.testing.assert_array_equal(fm.read_map(published / "map.json").coefficients, force_map.coefficients)
    assert [float(row["value"]) for row in rows("coefficients")] == force_map.coefficients.tolist()
    (counts,) = rows("dataset")
    assert int(counts["training_states"]) == len(dataset.train.states)
    assert int(counts["training_impacts_used"]) == int((~dataset.train.censored).sum())
    expected = {each.on: each.rmse for each in fm.map_accuracy(force_map, dataset)}
    found = {row["on"]: float(row["rmse_N"]) for row in rows("accuracy") if row["model"] == "CFM_3D"}
    assert found == expected
    assert {row["model"] for row in rows("accuracy")} >= {"CFM_2D", "contact model"}
    for role, part in (("train", dataset.train), ("test", dataset.test)):
        mine = [row for row in rows("states") if row["role"] == role]
        assert len(mine) == int(counts[f"{role}ing_states"]) == len(part.states)
        forces = [float(row["mean_peak_force_N"] or "nan") for row in mine]
        np.testing.assert_allclose(forces, part.states.force, rtol=1e-12)
    assert {row["simulated"] for name in ("states", "accuracy", "dataset") for row in rows(name)} == {"true"}


def test_a_publication_of_another_form_is_of_that_form_throughout(example_folders, tmp_path, forcemap, ask):
    from forcemap.csv_table import read_table

    def rows(name):
        return read_table((written / "tables" / f"{name}.csv").read_bytes(), name, what="row").texts

    folder, written = example_folders["ur10e"], tmp_path / "log"
    assert forcemap("publication", folder, "-o", written, "--form", "LOG_SPEED", "--area", "back_of_hand")[0] == 0
    dataset = fm.read_dataset(folder)
    force_map = fm.fit_force_map(dataset, form=fm.LOG_SPEED)
    assert fm.read_map(written / "map.json").form == fm.LOG_SPEED
    assert [float(row["value"]) for row in rows("coefficients")] == force_map.coefficients.tolist()
    assert {row["model"] for row in rows("accuracy")} >= {"LOG_SPEED", "CFM_2D", "contact model"}
    assert "CFM_3D" not in {row["model"] for row in rows("accuracy")}
    readme = (written / "README.md").read_text()
    fits = fm.sentence(force_map.form_test.finding)
    assert (
        f"Form of the map: LOG_SPEED, which `forcemap evaluate data --forms` compares with others. N{fits[1:]}."
        in readme
    )
    assert "Form LOG_SPEED, chosen in place of CFM_3D" in readme
    (made,) = re.findall(r"`map.json` \| `forcemap (fit data.*?)`", readme)
    again = [str(written / word) if word in ("data", "map.json") else word for word in made.split()]
    again[-1] = str(tmp_path / "again.json")
    assert forcemap(*again)[0] == 0
    assert (tmp_path / "again.json").read_bytes() == (written / "map.json").read_bytes()
    for kind in ("residuals", "comparison"):
        drawn = ["figure", kind, folder, *["--area", "back_of_hand"] * (kind == "comparison")]
        files = [tmp_path / f"{kind}-{i}.svg" for i in range(2)]
        assert forcemap(*drawn, "-o", files[0])[0] == 0
        assert forcemap(*drawn, "--form", "LOG_SPEED", "-o", files[1])[0] == 0
        assert files[0].read_bytes() != files[1].read_bytes() == (written / "figures" / f"{kind}.svg").read_bytes()
    code, found = ask("figure", "grid", folder, "--form", "LOG_SPEED", "-o", tmp_path / "x.svg")
    assert (code, "form: grid does not take it" in found["error"]["message"]) == (2, True)
    code, found = ask("publication", written / "map.json", "-o", tmp_path / "new")
    assert (code, "folder or table of its impacts, and --form" in found["error"]["message"]) == (2, True)
    code, found = ask("figure", "residuals", written / "map.json", "-o", tmp_path / "x.svg")
    assert (code, "with --form the form of its map" in found["error"]["message"]) == (2, True)


def test_a_publication_without_an_area_names_no_table_that_it_lacks(example_folders, tmp_path, forcemap):
    assert forcemap("publication", example_folders["ur10e"], "-o", tmp_path / "bundle")[0] == 0
    readme = (tmp_path / "bundle" / "README.md").read_text()
    assert "Form of the map: CFM_3D" in readme
    assert "speed-map" not in readme
    assert "for that body area" not in readme


def test_a_publication_tells_stated_speeds_from_those_less_their_error(example_folders, tmp_path, forcemap, ask):
    from forcemap.csv_table import read_table

    folder = tmp_path / "campaign"
    shutil.copytree(example_folders["ur10e"], folder)
    stated = (folder / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(stated.replace("[robot]\n", "[robot]\nspeed_error = 0.01\n"))
    written = tmp_path / "bundle"
    assert forcemap("publication", folder, "-o", written, "--width", "page", "--grey")[0] == 0
    rows = read_table((written / "tables" / "states.csv").read_bytes(), "states", what="row").texts
    said, less = (np.array([float(row[f"speed_{name}_mps"]) for row in rows]) for name in ("stated", "less_error"))
    np.testing.assert_allclose(less, 0.99 * said, rtol=1e-8)
    assert set(np.round(said, 6)) == set(np.round(fm.read_dataset(folder).stated_speed, 6))
    readme = (written / "README.md").read_text()
    assert "Made with no --area, --width page, --grey" in readme
    assert "less its speed error (here 1 %)" in readme
    assert "the stated speeds less their error of 1 %" in " ".join(forcemap("fit", folder)[1].split())
    assert ask("fit", folder)[1]["speed_error"] == 0.01
    assert "speed_error" not in ask("fit", example_folders["ur10e"])[1]


def test_a_publications_citation_names_data_software_and_paper(published):
    cited = yaml.safe_load((published / "CITATION.cff").read_text())
    assert cited["cff-version"] == "1.2.0"
    assert cited["type"] == "dataset"
    assert cited["title"].startswith("SIMULATED")
    assert cited["authors"] == [{"name": "A. Author"}]
    assert [reference["type"] for reference in cited["references"]] == ["software", "conference-paper"]
    assert all(reference["title"] and reference["authors"] for reference in cited["references"])


def test_a_publication_takes_a_new_folder_and_says_what_it_leaves_out(forcemap, example_folders, tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "mine.txt").write_text("kept")
    code, _, err = forcemap("publication", example_folders["ur10e"], "-o", tmp_path / "there")
    assert code == 2
    assert "holds files already" in err
    assert [path.name for path in (tmp_path / "there").iterdir()] == ["mine.txt"]
    code, _, err = forcemap("publication", "ur10e", "-o", tmp_path / "new")
    assert code == 2
    assert not (tmp_path / "new").exists()


@pytest.fixture
def bare_table(example_folders, tmp_path):
    """The four required columns of the example's training impacts, in a folder of its own."""
    dataset = fm.read_dataset(example_folders["ur10e"]).train
    table = tmp_path / "own" / "mine.csv"
    table.parent.mkdir()
    fm.write_dataset(
        fm.ImpactDataset.from_arrays(
            **{name: getattr(dataset, name) for name in ("distance", "height", "speed", "peak_force")}
        ),
        table,
    )
    return table


def test_a_table_is_published_as_the_folder_that_holds_only_it(ask, bare_table, tmp_path):
    folder = tmp_path / "same" / "mine"
    folder.mkdir(parents=True)
    shutil.copy(bare_table, folder / "impacts.csv")
    code, found = ask("publication", bare_table, "-o", tmp_path / "of-table", "--area", "back_of_hand")
    assert code == 0, found
    code, of_folder = ask("publication", folder, "-o", tmp_path / "of-folder", "--area", "back_of_hand")
    assert code == 0
    assert found | {"folder": ""} == of_folder | {"folder": ""}
    assert (tmp_path / "of-table" / "SHA256SUMS").read_text() == (tmp_path / "of-folder" / "SHA256SUMS").read_text()
    assert [path.name for path in bare_table.parent.iterdir()] == ["mine.csv"]


def test_a_publication_says_which_tables_have_no_speed(ask, forcemap, bare_table, tmp_path):
    """Nothing says the device's spring of a table alone; a campaign.toml beside it does."""
    why = "No speed to program at any place: the spring of the measuring device is not stated"
    _, out, _ = forcemap("publication", bare_table, "-o", tmp_path / "none", "--area", "back_of_hand")
    readme = (tmp_path / "none" / "README.md").read_text()
    for contact, limit in (("transient", 280), ("quasi-static", 140)):
        for text in (" ".join(out.split()), readme.replace("`", "")):
            assert f"speeds-{contact}.csv: {limit} N, {contact} contact, back_of_hand in ISO" in text
            assert text.count(why) == 2
    (bare_table.parent / "campaign.toml").write_text(
        'schema = "forcemap-campaign/1"\n[device]\nstiffness_N_per_m = 75000\n'
    )
    code, found = ask("publication", bare_table, "-o", tmp_path / "some", "--area", "back_of_hand")
    assert code == 0
    assert "data/campaign.toml" in found["files"]
    assert not any("spring" in why for why in found["no_speed"].values())


def test_a_publication_names_as_without_speed_the_empty_tables_alone(published):
    from forcemap.csv_table import read_table

    readme = (published / "README.md").read_text()
    empty = {}
    for contact in fm.Contact:
        table = published / "tables" / f"speeds-{contact}.csv"
        rows = read_table(table.read_bytes(), table.name, what="row").texts
        empty[contact] = not any(row["speed_to_program_mps"] for row in rows)
        assert (f"- `tables/{table.name}`: " in readme) == empty[contact]
    assert set(empty.values()) == {True, False}


def test_a_table_that_is_part_of_a_campaign_is_not_published_alone(forcemap, simulated, bare_table, tmp_path):
    for table, broken in ((simulated / "impacts.csv", ""), (bare_table, "recordings.csv")):
        if broken:
            (table.parent / broken).write_text("")
        code, _, err = forcemap("publication", table, "-o", tmp_path / "new")
        assert code == 2
        assert "this is a file; name the folder of a campaign" in err
    (bare_table.parent / "recordings.csv").unlink()
    bare_table.write_text("distance_m,height_m\n0.5,0.1\n")
    code, _, err = forcemap("publication", bare_table, "-o", tmp_path / "new")
    assert code == 2
    assert err.startswith(f"error: {bare_table}")
    assert not (tmp_path / "new").exists()


def test_a_legend_of_heights_lists_the_roles_that_are_drawn(example_folders, bare_table):
    """At an example's own speed lie test states alone; a table alone has training states, a published map none."""
    sources = [*example_folders.values(), bare_table, *fm.PUBLISHED_MAPS]
    seen = set()
    for source, speeds in itertools.product(map(str, sources), (None, (0.2, 0.3))):
        figure = draw(Kind.HEIGHTS, [Source(source)], Choices(speeds=speeds), width=0.16)
        faces = [
            line.get_markerfacecolor()
            for axes in figure.axes
            for line in axes.get_lines()
            if line.get_marker() in _HEIGHT_MARKERS and len(line.get_xdata())
        ]
        drawn = {"test" if face == "#ffffff" else "training" for face in faces}
        words = [text.get_text() for text in figure.legends[0].get_texts()]
        assert {role for role in ("training", "test") if f"measured, {role} state" in words} == drawn
        seen.add(frozenset(drawn))
    assert {frozenset({"test"}), frozenset({"training"}), frozenset()} <= seen


_HEIGHT_MARKERS = ("o", "s", "^", "D", "v")


def test_a_comparison_says_what_its_ticks_are(example_folders):
    figure = draw(Kind.COMPARISON, [Source(str(example_folders["ur10e"]))], Choices(**HAND), width=0.16)
    entries = {
        text.get_text(): line
        for line, text in zip(figure.legends[0].get_lines(), figure.legends[0].get_texts(), strict=True)
    }
    assert entries["mean error (bar: largest)"].get_marker() == "|"


def test_a_path_is_drawn_from_its_file(ask, tmp_path):
    file = tmp_path / "path.csv"
    file.write_text("x_m,y_m,z_m,segment\n0.8,0,0.44,down\n0.8,0,0.2,down\n0.8,0,0.44,up\n")
    words = ["figure", "path", "ur10e", "--path", file, "--area", "back_of_hand", "--contact", "transient"]
    code, found = ask(*words, "-o", tmp_path / "path.pdf")
    assert code == 0, found
    (page,) = pypdf.PdfReader(tmp_path / "path.pdf").pages
    assert "Length along the path [m]" in page.extract_text()


DOCS = Path(__file__).parents[1] / "docs"


def test_every_kind_is_documented_and_the_papers_page_has_commands_that_are():
    table = re.findall(r"^\| (`[^|]*) \|", (DOCS / "drawing.md").read_text(), re.M)
    assert {name for cell in table for name in re.findall(r"`([\w-]+)`", cell)} == {*Kind}
    page = (DOCS / "paper.md").read_text()
    commands = [words.split() for words in re.findall(r"^    forcemap (.*)$", page, re.M)]
    assert len(commands) >= 15
    for words in commands:
        if words[0] == "figure":
            assert words[1] in {*Kind}
            assert (DOCS / "pictures" / words[words.index("-o") + 1]).exists()
    for number in (*range(3, 9), *("I", "II", "III")):
        assert re.search(rf"^## (Figure|Table) {number}\b", page, re.M), number
