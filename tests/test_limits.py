"""The standard's limits and contact model."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import math
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, strategies as st

import forcemap as fm
from forcemap.errors import TableError, UnknownName
from forcemap.limits.body_areas import body_regions
from forcemap.limits.device_spring import device_suitability
from forcemap.limits.pfl import pfl_energy, pfl_pressure_speed_limit

HEADER = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"


def test_the_table_is_whole():
    table = fm.standard_limit_table()
    assert len(table.areas) == 29
    assert len(table.regions) == 12
    assert table.edition == "ISO/TS 15066:2016, Annex A"
    assert "secondary sources" in table.source
    text = resources.files("forcemap.limits").joinpath("tables/body_areas.csv").read_text()
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    for row in rows:
        limit = fm.force_limit(row["area"])
        assert limit.tabulated_quasi_static == float(row["quasi_static_force_N"])
        assert limit.permitted == (float(row["transient_factor"]) > 0)


def test_the_standards_tables_are_read_once():
    assert fm.standard_limit_table() is fm.standard_limit_table()
    assert body_regions() is body_regions()


@pytest.mark.parametrize(
    ("name", "version", "start"),
    [("body_areas.csv", "1", "c5f33f652125d90d"), ("body_regions.csv", "1", "e87345200c321385")],
)
def test_another_figure_is_another_version(name, version, start):
    """Whoever changes a figure raises the version that every answer names, and states both here."""
    content = resources.files("forcemap.limits").joinpath("tables", name).read_bytes()
    assert f"# version: {version}\n" in content.decode()
    assert hashlib.sha256(content).hexdigest().startswith(start)


def test_figures_of_the_paper():
    """Sections II-A and V-D: 140 N quasi-static, 280 N transient for the back of the hand."""
    limit = fm.force_limit("back of hand")
    assert (limit.quasi_static, limit.transient) == (140.0, 280.0)
    assert (limit.quasi_static_pressure, limit.transient_pressure) == (1.9e6, 3.8e6)  # the weaker hand
    assert fm.body_region("back_of_hand").stiffness == 75e3
    assert fm.body_region("back_of_hand").mass == 0.6


def test_regions_and_areas_without_a_side_mean_the_lowest():
    chest, sternum = fm.force_limit("chest"), fm.force_limit("sternum")
    assert chest.areas == ("sternum", "pectoral_muscle")
    assert (chest.quasi_static, chest.quasi_static_pressure) == (140.0, sternum.quasi_static_pressure)
    assert fm.force_limit("forefinger_end_joint").quasi_static_pressure == 2.2e6
    assert len(fm.force_limit("hand_fingers").areas) == 9
    assert fm.force_limit("lower_leg").transient == 260.0


@pytest.mark.parametrize("name", ["temple", "middle_of_forehead", "masticatory_muscle", "skull_forehead", "face"])
def test_the_head_has_no_limit(name):
    limit = fm.force_limit(name)
    assert not limit.permitted
    assert limit.tabulated_quasi_static in (65.0, 130.0)
    for figure in ("transient", "quasi_static", "transient_pressure", "quasi_static_pressure"):
        with pytest.raises(fm.ContactNotPermitted, match=name):
            getattr(limit, figure)


def test_a_region_says_which_of_the_standards_areas_a_users_table_lacks(tmp_path):
    path = tmp_path / "ours.csv"
    path.write_text(f"{HEADER}\nsternum,Sternum,chest,120,100,2\npalm_dominant,Palm,hand_fingers,260,140,2\n")
    table = fm.read_limit_table(path)
    assert fm.force_limit("chest", table=table).lacking == ("pectoral_muscle",)
    assert fm.force_limit("sternum", table=table).lacking == ()
    assert fm.force_limit("chest").lacking == ()


def test_a_refusal_says_whether_a_users_table_could_permit_it(tmp_path):
    """The standard has no factor for the head; a table with one that names no reason is closed for being the head's."""
    path = tmp_path / "ours.csv"
    for factor, head in (("0", False), ("1.5", True)):
        path.write_text(f"{HEADER}\ntemple,Temple,skull_forehead,110,65,{factor}\n")
        assert fm.force_limit("temple", table=fm.read_limit_table(path)).refusal.figure("head") is head
        with pytest.raises(fm.ContactNotPermitted, match="area of the head" if head else "transient factor 0"):
            fm.force_limit("temple", table=fm.read_limit_table(path)).require_permitted()
    assert fm.force_limit("temple").refusal.figure("head") is False
    assert all("HEAD" not in str(fm.force_limit(name)) for name in fm.standard_limit_table().areas)
    opened = dataclasses.replace(fm.force_limit("chest"), head=True, head_contact="a helmet is worn")
    assert "HEAD, permitted by the table's own words: a helmet is worn" in str(opened)


def test_unknown_names_list_the_nearest():
    with pytest.raises(UnknownName) as caught:
        fm.force_limit("hand")
    assert "back_of_hand_dominant" in caught.value.nearest or "hand_fingers" in caught.value.nearest
    with pytest.raises(UnknownName) as caught:
        fm.force_limit("forehed")
    assert "middle_of_forehead" in caught.value.nearest
    with pytest.raises(UnknownName):
        fm.force_limit("")


def test_a_users_own_table(tmp_path):
    path = tmp_path / "ours.csv"
    path.write_text(f"# edition: ISO 10218-2:2025\n# source: our copy\n{HEADER}\nsternum,Sternum,chest,120,100,1.5\n")
    limit = fm.force_limit("chest", table=fm.read_limit_table(path))
    assert (limit.quasi_static, limit.transient, limit.edition) == (100.0, 150.0, "ISO 10218-2:2025")
    path.write_text(f"{HEADER}\nsternum,Sternum,chest,120,100,1.5\n")
    assert "ours.csv" in fm.force_limit("sternum", table=fm.read_limit_table(path)).edition


def test_of_a_users_areas_the_lowest_figures_and_the_hardest_spring_hold(tmp_path):
    """Whatever order they stand in, and each figure for itself."""
    rows = ["sternum,Sternum,chest,120,100,2,40", "pectoral_muscle,Pectoral,chest,90,130,1.2,30"]
    path = tmp_path / "ours.csv"
    for order in (rows, rows[::-1]):
        path.write_text("\n".join([f"{HEADER},spring_constant_N_per_mm", *order]) + "\n")
        limit = fm.force_limit("chest", table=fm.read_limit_table(path))
        assert (limit.quasi_static, limit.transient) == (100.0, 156.0)
        assert (limit.quasi_static_pressure, limit.transient_pressure) == (0.9e6, pytest.approx(1.08e6))
        assert limit.stiffness == 40e3


@pytest.mark.parametrize("spring", [999.0, 0.75, 0.0, -75e3, math.inf])
def test_a_spring_in_another_unit_is_refused(spring):
    limit = fm.force_limit("sternum")
    with pytest.raises(fm.InputError, match="spring"):
        dataclasses.replace(limit, stiffness=spring)
    with pytest.raises(fm.InputError, match="spring"):
        fm.NewtonLimit(140.0, spring_N_per_m=spring)
    assert dataclasses.replace(limit, stiffness=1000.0).stiffness == 1000.0
    assert fm.NewtonLimit(140.0, spring_N_per_m=1000.0).spring_N_per_m == 1000.0


def test_a_device_of_nine_tenths_of_the_spring_is_the_softest():
    """Its forces count as read by a spring as hard as the area's: F = v sqrt(k mu)."""
    for device in (67.5e3, 70e3, 74e3):
        suits = device_suitability("back_of_hand", 75e3, device)
        assert suits.raised == pytest.approx(math.sqrt(75e3 / device))
        assert suits.refusal is None
        assert suits.statement.figure("raised") == pytest.approx(suits.raised - 1)
    for device in (75e3, 75.1e3, 1e6):
        suits = device_suitability("back_of_hand", 75e3, device)
        assert (suits.raised, suits.refusal) == (1.0, None)
        assert (suits.statement.kind.value == "spring_stiffer") == (device > 75e3)
    for area, device in ((75e3, 67.4e3), (75e3, math.nan), (math.nan, 75e3)):
        suits = device_suitability("back_of_hand", area, device)
        assert suits.refusal is suits.statement is not None
        assert suits.raised == 1.0


@pytest.mark.parametrize(
    ("rows", "row", "part"),
    [
        (["sternum,Sternum,chest,120,-100,2"], 2, "positive"),
        (["sternum,Sternum,chest,120,inf,2"], 2, "positive"),
        (["sternum,Sternum,chest,120,nan,2"], 2, "positive"),
        (["sternum,Sternum,chest,120,much,2"], 2, "number"),
        (["sternum,Sternum,chest,120,100,20"], 2, "factor from 1 to 2"),
        (["sternum,Sternum,chest,120,100,0.5"], 2, "factor from 1 to 2"),
        (["sternum,Sternum,chest,120,100"], 2, "5 cells"),
        (["a,A,chest,120,100,2", "a,A,chest,120,100,2"], 3, "once"),
        ([], None, "no body area"),
    ],
)
def test_tables_that_are_refused(tmp_path, rows, row, part):
    path = tmp_path / "ours.csv"
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    with pytest.raises(TableError, match=part) as caught:
        fm.read_limit_table(path)
    assert caught.value.row == row


def test_another_separator_is_refused(tmp_path):
    path = tmp_path / "ours.csv"
    path.write_text("area;region\n1;2\n")
    with pytest.raises(TableError):
        fm.read_limit_table(path)


masses = st.floats(0.1, 500)
stiffnesses = st.floats(1e3, 5e5)


@given(st.floats(1, 1000), masses, masses | st.just(math.inf), stiffnesses)
def test_property_the_two_directions_are_inverse(force, robot, body, stiffness):
    model = {"robot_mass": robot, "body_mass": body, "stiffness": stiffness}
    speed = fm.pfl_speed_limit(force, **model)
    assert fm.pfl_contact_force(speed, **model) == pytest.approx(force, rel=1e-12)
    # ISO/TS 15066 eq. A.6 as the paper prints it (eq. 1)
    assert speed == pytest.approx(force / math.sqrt(stiffness) * math.sqrt(1 / robot + 1 / body), rel=1e-12)
    # energy: kinetic energy of the reduced mass is that of the spring
    reduced = 1 / (1 / robot + 1 / body)
    assert pfl_energy(force, stiffness=stiffness) == pytest.approx(reduced * speed**2 / 2, rel=1e-12)


def test_pressure_form_and_what_governs():
    model = {"robot_mass": 15.0, "body_mass": math.inf, "stiffness": 75e3}
    by_force = fm.pfl_speed_limit(140.0, **model)
    by_pressure = pfl_pressure_speed_limit(1.9e6, contact_area=0.5e-4, **model)  # 190 N/cm^2 on 0.5 cm^2: 95 N
    assert by_pressure == pytest.approx(by_force * 95 / 140, rel=1e-12)
    assert fm.pfl_governing_speed_limit(140.0, 1.9e6, contact_area=0.5e-4, **model) == by_pressure
    assert fm.pfl_governing_speed_limit(140.0, 1.9e6, contact_area=1e-4, **model) == by_force


def test_payload_and_arrays():
    assert fm.pfl_robot_mass(30.0, 2.5) == 17.5
    found = fm.pfl_speed_limit(
        np.array([140, 280]), robot_mass=fm.pfl_robot_mass(30), body_mass=math.inf, stiffness=75e3
    )
    assert isinstance(found, np.ndarray)
    assert isinstance(fm.pfl_robot_mass(30), float)


@pytest.mark.parametrize(
    "change",
    [{"robot_mass": 0.0}, {"robot_mass": math.inf}, {"body_mass": 0.0}, {"body_mass": math.nan}, {"stiffness": -1.0},
     {"stiffness": math.inf}, {"max_force": math.nan}, {"max_force": 0.0}],
)  # fmt: skip
def test_contact_model_refuses_what_it_cannot_use(change):
    arguments = {"max_force": 140.0, "robot_mass": 15.0, "body_mass": 0.6, "stiffness": 75e3} | change
    with pytest.raises(fm.InputError):
        fm.pfl_speed_limit(arguments.pop("max_force"), **arguments)


def test_contact_model_refuses_negative_payload_and_speed():
    with pytest.raises(fm.InputError):
        fm.pfl_robot_mass(30.0, -1.0)
    with pytest.raises(fm.InputError):
        fm.pfl_contact_force(-0.1, robot_mass=15.0, body_mass=math.inf, stiffness=75e3)


PFL = {"robot_mass": 15.0, "body_mass": 0.6, "stiffness": 75e3}


@pytest.mark.parametrize(
    ("call", "least", "most", "words"),
    [
        (lambda x: fm.pfl_speed_limit(x, **PFL), 0.0, 1e5, "force limit: expected newtons, above 0 and at most"),
        (
            lambda x: fm.pfl_speed_limit(100.0, **PFL | {"robot_mass": x}),
            0.01,
            None,
            "kilograms, at least .* and finite",
        ),
        (lambda x: fm.pfl_speed_limit(100.0, **PFL | {"stiffness": x}), 1000.0, None, "stiffness: .* 1000 and finite"),
        (lambda x: fm.pfl_robot_mass(x), 0.0, None, "moving mass: expected kilograms, above 0 and finite"),
        (lambda x: pfl_energy(x, stiffness=75e3), 0.0, None, "force: expected newtons, above 0 and finite"),
        (lambda x: pfl_energy(100.0, stiffness=x), 1000.0, None, "stiffness: expected N/m, at least 1000 and finite"),
    ],
)
def test_a_figure_of_the_standards_model_is_refused_with_its_range(call, least, most, words):
    assert call(least or 1e-3) > 0
    below = 0.0 if least == 0 else least * (1 - 1e-9)
    for wrong in (below, -1.0, math.nan, math.inf, *([] if most is None else [most * (1 + 1e-9)])):
        with pytest.raises(fm.InputError, match=words):
            call(wrong)
    assert most is None or call(most) > 0


@pytest.mark.parametrize("force", [1e-3, 0.5, 1.0, 5000.0])
def test_any_positive_force_in_newtons_is_a_limit_and_up_to_it_its_quasi_static_part(force):
    for part in (None, force, force / 2, 1e-6):
        limit = fm.NewtonLimit(force, part)
        assert (limit.force, limit.quasi_static) == (force, part)
    for wrong in (0.0, -force, 1.0001 * force, math.nan):
        with pytest.raises(fm.InputError, match="quasi-static limit"):
            fm.NewtonLimit(force, wrong)
    for wrong in (0.0, -force, math.inf, math.nan, [force, 0.0]):
        with pytest.raises(fm.InputError, match="expected a positive finite number"):
            fm.NewtonLimit(wrong)


@pytest.mark.parametrize("beside", [(50.0, None), (None, 75e3), (50.0, 75e3)])
def test_no_figure_beside_a_newton_limit_is_silently_left_out(beside):
    with pytest.raises(fm.InputError, match="beside a NewtonLimit"):
        fm.NewtonLimit.of(fm.NewtonLimit(100.0), *beside)


@pytest.mark.parametrize("body_mass", [[4.0, 0.0], [0.0, 4.0], [4.0, -1.0], np.ma.masked_less([4.0, 1.0], 2.0)])
def test_one_impossible_body_mass_among_several_is_refused(body_mass):
    with pytest.raises(fm.InputError, match="body mass: expected kilograms"):
        fm.pfl_speed_limit(140.0, robot_mass=15.0, body_mass=body_mass, stiffness=75e3)


@pytest.mark.parametrize(
    ("row", "times"),
    [
        ("back_of_hand,Back of hand,hand_fingers,200,220,2", 220 / 140),  # the thigh's force
        ("abdominal_muscle,Abdomen,abdomen,110,220,1", 2.0),  # its transient force as quasi-static
        ("back_of_hand,Back of hand,hand_fingers,2000,140,2", 2000 / 190),  # kPa
        ("back_of_hand,Back of hand,hand_fingers,190,140,2", None),
        ("sternum_ours,Ours,chest,120,500,2", None),  # of no area of the standard
    ],
)
def test_a_limit_above_the_standards_is_said_first(tmp_path, forcemap, row, times):
    path = tmp_path / "ours.csv"
    path.write_text(f"{HEADER}\n{row}\n")
    area = row.split(",")[0]
    limit = fm.force_limit(area, table=fm.read_limit_table(path))
    assert [each.kind.value for each in limit.doubts] == ["limit_above_standard"] * (times is not None)
    if times is not None:
        assert limit.doubts[0].figure("times") == pytest.approx(times, rel=0.03)
    case = ("--distance", 0.8, "--height", 0.4, "--contact", "transient")
    out = forcemap("speed", "ur10e", *case, "--area", area, "--limit-table", path)[1]
    assert ("! LIMIT ABOVE THE STANDARD" in out) is (times is not None)
    assert forcemap("limits", area, "--limit-table", path)[1].startswith("! LIMIT ABOVE") is (times is not None)
