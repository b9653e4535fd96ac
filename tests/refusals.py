"""What maps and limits refuse, with every sentence, and what is accepted just before: the edge of every figure.

tests/refusals.csv holds the sentences. Whoever changes one on purpose writes the table anew
(`python tests/refusals.py`) and looks at what changed.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import json
import math
import re
import tempfile
from pathlib import Path

import numpy as np
from oracle import full_grid, simulate

import forcemap as fm
from forcemap.direction import direction_vector, raised_off_axis
from forcemap.limits.covers import cover_estimate, payload_estimate
from forcemap.limits.pfl import pfl_energy, pfl_pressure_speed_limit
from forcemap.maps.forms import Term
from forcemap.maps.map_file import map_text
from test_map_file import resealed

TABLE = Path(__file__).with_suffix(".csv")
ACCEPTED = "accepted"
HEADER = "area,name,region,quasi_static_pressure_N_per_cm2,quasi_static_force_N,transient_factor"
NUMBERS = (-1.1e9, -1e9, -10.1, -10.0, -1e-9, 0, 5e-324, 0.99, 1.0, 10.0, 10.1, 1e5, 1.1e5, 1e9, 1.1e9)
PFL = {"robot_mass": 15.0, "body_mass": 0.6, "stiffness": 75e3}


def said(call):
    """What a call refuses, in its words; of what Python or numpy refuses only that it is refused."""
    try:
        call()
    except fm.ForcemapError as error:
        return f"{type(error).__name__}: {error}".partition("cannot be used: ")[0]
    return ACCEPTED


def edges(*figures):
    """The figures, and those beside them."""
    return [x for each in figures for x in (math.nextafter(each, -math.inf), each, math.nextafter(each, math.inf))]


def spellings():
    for name in ("1", "d", "d*h^2", "d^99", "d^100", "d^0", "d^1", "x", "d*d", "ln(v)", "d*ln(v)^2", "", "D", "d * h"):
        yield f"term {name!r}", lambda name=name: Term.parse(name)
    for exponent in (-1, 0, 1, 99, 100, True, 1.0):
        for field in ("distance", "log_speed"):
            yield f"exponent {exponent!r} of {field}", lambda of={field: exponent}: Term(**of)
    for terms in ([], ["1"], ["1", "1"], ["v^3"], ["v^4"], ["v", "ln(v)"], ["1", "ln(v)"], ["ln(v)^2"], ["d", "v^2*d"]):
        yield f"form {terms}", lambda terms=terms: fm.Form.of("own", terms)
    for name in ("cfm-2d", "CFM_3D", "log speed", "cfm"):
        yield f"form named {name}", lambda name=name: fm.form_named(name)
    for angle in edges(0.0, 5.0):
        yield f"angle {angle!r}", lambda angle=angle: raised_off_axis(angle)
    for words in ("down", "", "up", "0, 0, 1"):
        yield f"direction {words!r}", lambda words=words: direction_vector(words, whose="this map")


def promises():
    for margin in edges(0.0, 1.0):
        yield f"margin {margin!r}", lambda margin=margin: fm.FixedMargin(margin)
    for share in (*edges(0.5), *edges(1.0)[:2]):
        for name in ("confidence", "content"):
            yield f"{name} {share!r}", lambda of={name: share}: fm.ToleranceBound(**of)
    for error in (*edges(0.0), 1e9, math.inf, math.nan):
        yield f"device error {error!r}", lambda error=error: fm.ToleranceBound(device_error=error)
    ur10e = fm.published_map("ur10e")
    yield "bound of a published map", lambda: fm.ToleranceBound().require(ur10e)
    yield "states of a published map", lambda: fm.leave_one_state_out(ur10e)
    yield "leverage of a published map", lambda: ur10e.leverage(0.7, 0.3, 0.3)
    for force in (0.0, 5e-324, math.inf, math.nan):
        yield f"crossing of {force!r} N", lambda force=force: ur10e.crossing_speed(0.8, 0.4, force)


def campaign(points, seed=5, role="train", censored=False):
    points = np.array(points, dtype=float)
    force = np.exp(np.random.default_rng(seed).normal(5, 0.05, len(points)))
    d, h, v = points.T
    flags = np.broadcast_to(censored, len(points))
    given = {"distance": d, "height": h, "speed": v, "peak_force": force, "censored": flags}
    return fm.ImpactDataset.from_arrays(**given, role=[role] * len(points))


def fits():
    """States too few, in a plane, closer than repeats, without an uncensored impact."""
    rng = np.random.default_rng(1)
    drawn = rng.uniform([0.5, 0.1, 0.1], [0.9, 0.5, 0.4], (40, 3))
    for count in (3, 4, 6, 7, 8):
        few = campaign(drawn[:count])
        yield f"{count} states", lambda few=few: fm.fit_force_map(few, form=fm.CFM_2D)
        yield (
            f"bound of {count} states",
            lambda few=few: fm.ToleranceBound().require(fm.fit_force_map(few, form=fm.CFM_2D)),
        )
        yield (
            f"{count} states, one left out",
            lambda few=few: fm.leave_one_state_out(fm.fit_force_map(few, form=fm.CFM_2D)),
        )
        yield (
            f"{count} states, a place left out",
            lambda few=few: fm.leave_one_place_out(fm.fit_force_map(few, form=fm.CFM_2D)),
        )
    for places in (3, 4, 5, 6):
        at = np.column_stack([drawn[:places, :2].repeat(5, axis=0), np.tile(np.linspace(0.1, 0.5, 5), places)])
        few = campaign(at)
        yield (
            f"bound of {places} places",
            lambda few=few: fm.ToleranceBound().require(fm.fit_force_map(few, form=fm.CFM_2D)),
        )
    for axis, name in enumerate(("distance", "height", "speed")):
        for spread in (0.0, 0.004, 0.0049, 0.0051, 0.011):
            flat = drawn.copy()
            flat[:, axis] = 0.3 + spread * (np.arange(40) % 4) / 3
            flat[:, (axis + 1) % 3] += 0.02 * np.arange(40)
            flat = campaign(flat)
            yield f"{name} within {spread}", lambda flat=flat: fm.fit_force_map(flat)
    grid = [[d, h, 0.3] for d in (0.5, 0.7, 0.9) for h in (0.1, 0.3, 0.5)]
    yield "one speed", lambda: fm.fit_force_map(campaign(grid))
    yield "one speed, few terms", lambda: fm.fit_force_map(campaign(grid), form=fm.CFM_2D)
    yield "no impact to fit", lambda: fm.fit_force_map(campaign(drawn, role="test"))
    yield "all censored", lambda: fm.fit_force_map(campaign(drawn, censored=True))
    some = fm.fit_force_map(campaign(drawn), form=fm.CFM_2D)
    of = fm.force_map_accuracy
    yield "accuracy on what is censored", lambda: of(some, campaign(drawn, censored=True), on="ours")
    yield "accuracy on nothing", lambda: of(some, campaign(drawn).test)
    for known in (4, 5, 6):
        part = campaign(drawn, censored=np.arange(40) >= known)
        yield f"{known} uncensored states", lambda part=part: fm.fit_force_map(part, form=fm.CFM_2D)


def limit_tables():
    def read(*rows, header=HEADER, above=()):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "ours.csv"
            path.write_text("\n".join([*above, header, *rows]) + "\n")
            return fm.read_limit_table(path)

    good = "sternum,Sternum,chest,120,100,2"
    spring = f"{HEADER},spring_constant_N_per_mm"
    yield "good", lambda: read(good)
    for i, name in enumerate(HEADER.split(",")):
        cells = good.split(",")
        kept = ",".join(each for each in HEADER.split(",") if each != name)
        yield f"without {name}", lambda i=i, c=cells, k=kept: read(",".join(c[:i] + c[i + 1 :]), header=k)
        yield f"without {name}, below a remark", lambda k=kept: read("a,b,c,d,e", header=k, above=["# edition: x"])
        for cell in ("", "0", "-1", "1e2", "1,5", "2000", "2000.1", "0.5", ".5", "1", "0.999", "2.001", "٣", "many"):
            row = ",".join([*cells[:i], f'"{cell}"', *cells[i + 1 :]])
            yield f"{name} {cell!r}", lambda row=row: read(good.replace("sternum", "pectoral_muscle"), row)
    for column in ("spring", "STIFFNESS", "Federrate", "Steifigkeit", "remark"):
        yield f"column {column}", lambda column=column: read(f"{good},1", header=f"{HEADER},{column}")
    for cell in ("", "0", "24.9", "25", "2000", "2001", "x"):
        yield f"spring {cell!r}", lambda cell=cell: read(f"{good},{cell}", header=spring)
        own = "mine,Mine,belly,120,100,2"
        yield f"spring {cell!r} of no region", lambda cell=cell, own=own: read(f"{own},{cell}", header=spring)
    for cell in ("0.999", "1"):
        yield f"soft spring {cell}", lambda cell=cell: read(f"mine,Mine,belly,120,100,2,{cell}", header=spring)
    yield "twice", lambda: read(good, good, above=["", "# version: 3"])
    yield "in another region", lambda: read("sternum,Sternum,face,120,100,2")
    yield "a side in another region", lambda: read(good, "back_of_hand_dominant,Hand,chest,120,100,2")
    yield "no row", lambda: read()
    for words in ("yes", "permitted by", "permitted by x", "Permitted by us", "permitted by a helmet"):
        yield f"head contact {words!r}", lambda words=words: read(good, above=[f"# head_contact: {words}"])
    one_side = "back_of_hand_dominant,Hand,hand_fingers,120,100,2"
    for name in ("back_of_hand", "back_of_hand_dominant", "hand_fingers", "Back-of hand dominant", "palm", "chest"):
        for known, rows in (("one", [one_side]), ("both", [one_side, one_side.replace("_dom", "_nondom")])):
            table = read(*rows)
            yield f"{name} of {known}", lambda name=name, table=table: fm.force_limit(name, table=table)
    yield "region of an unknown name", lambda: fm.body_region("tail")


def limits_stated():
    chest = fm.force_limit("chest")
    for name, force in (("quasi_static", chest.tabulated_quasi_static), ("transient", 2 * 140.0)):
        for value in (0.0, 1e-9, *edges(140.0), *edges(force), math.inf, math.nan, -1.0):
            new = {f"tabulated_{name}": value}
            for permitted in (True, False):
                yield (
                    f"{name} {value!r} {permitted}",
                    lambda new=new, p=permitted: dataclasses.replace(chest, permitted=p, **new),
                )
    for value in (*edges(1000.0), math.inf, math.nan, 0.0):
        yield f"stiffness {value!r}", lambda value=value: dataclasses.replace(chest, stiffness=value)
        yield f"spring {value!r}", lambda value=value: fm.NewtonLimit(100.0, None, value)
    for force in (0.0, 5e-324, math.inf, math.nan, -3.0, [1.0, -2.0], np.ma.array([1.0, 2.0], mask=[0, 1])):
        yield f"newtons {force!r}", lambda force=force: fm.NewtonLimit(force)
    for force in (100.0, [100.0, 50.0]):
        for part in (0.0, 5e-324, 50.0, 50.001, 100.0, 100.001, math.nan):
            yield f"part {part!r} of {force!r}", lambda force=force, part=part: fm.NewtonLimit(force, part)
    for contact in ("transient", "quasi-static", "quasi_static", ""):
        yield f"contact {contact!r}", lambda contact=contact: fm.Contact.parse(contact)
    for beside in ((None, None), (1.0, None), (None, 1e4)):
        yield f"beside {beside}", lambda beside=beside: fm.NewtonLimit.of(fm.NewtonLimit(9.0), *beside)
    for area in ("temple", "chest"):
        limit = fm.force_limit(area)
        yield f"{area} permitted", limit.require_permitted
        yield f"{area} as a head", dataclasses.replace(limit, permitted=False, head=True).require_permitted
        for contact in fm.Contact:
            yield f"{area} {contact.value}", lambda limit=limit, contact=contact: limit.force(contact)


def contact_model():
    masked = np.ma.array([15.0, 15.0], mask=[0, 1])
    force = functools.partial(fm.pfl_speed_limit, 100.0)
    pressure = functools.partial(pfl_pressure_speed_limit, **PFL)
    cover = functools.partial(cover_estimate, 140.0, **PFL)
    calls = {
        "speed": (lambda x: fm.pfl_contact_force(x, **PFL), edges(0.0)),
        "force": (lambda x: fm.pfl_speed_limit(x, **PFL), (0.0, 5e-324, *edges(1e5))),
        "robot mass": (lambda x: force(**PFL | {"robot_mass": x}), edges(0.01)),
        "body mass": (lambda x: force(**PFL | {"body_mass": x}), edges(0.01)),
        "stiffness": (lambda x: force(**PFL | {"stiffness": x}), edges(1000.0)),
        "pressure": (lambda x: pressure(x, contact_area=1e-4), (0.0, 5e-324)),
        "area": (lambda x: pressure(1e6, contact_area=x), (0.0, 5e-324, *edges(0.05))),
        "moving mass": (lambda x: fm.pfl_robot_mass(x), (0.0, 5e-324)),
        "payload": (lambda x: fm.pfl_robot_mass(30.0, x), edges(0.0)),
        "energy": (lambda x: pfl_energy(x, stiffness=75e3), (0.0, 5e-300)),
        "energy's spring": (lambda x: pfl_energy(100.0, stiffness=x), edges(1000.0)),
        "cover's spring": (lambda x: cover(cover_stiffness=x, cover_thickness=0.01), edges(100.0)),
        "cover": (lambda x: cover(cover_stiffness=2e4, cover_thickness=x), edges(0.0, 0.2)),
        "new payload": (
            lambda x: payload_estimate(
                140.0, moving_mass=30.0, payload=1.0, new_payload=x, body_mass=0.6, stiffness=75e3
            ),
            edges(0.0),
        ),
    }
    for name, (call, values) in calls.items():
        for value in (*values, math.inf, math.nan, -1.0):
            yield f"{name} {value!r}", lambda call=call, value=value: call(value)
        if name in ("force", "robot mass", "stiffness", "area", "moving mass", "energy"):
            yield f"{name} masked", lambda call=call: call(masked)


@functools.cache
def files():
    """Contents of map files: fitted, with states left out and test states, censored, published."""

    points = full_grid("ur10e")[::6]
    train = np.arange(len(points)) % 4 > 0

    def of(device_range, impacts):
        rng = np.random.default_rng(3)
        drawn = simulate("ur10e", rng, effect=0.02, device_range=device_range, points=points, train=train)
        return fm.fit_force_map(drawn.dataset, form=fm.CFM_2D, impacts=impacts)

    maps = {
        "fitted": of(300.0, fm.CensoredImpacts.DISCARD),
        "censored": of(400.0, fm.CensoredImpacts.AT_LEAST),
        "published": fm.published_map("ur10e"),
    }
    return {name: json.loads(map_text(force_map)) for name, force_map in maps.items()}


def places_of(value, path=()):
    """The path of every entry of a map file; of a list its first."""
    inner = value.items() if isinstance(value, dict) else enumerate(value[:1]) if isinstance(value, list) else ()
    for key, each in inner:
        yield (*path, key), each
        yield from places_of(each, (*path, key))


def instead(value, *, ranges):
    """What stands in place of an entry: of other kinds, and numbers on both sides of every range."""
    if isinstance(value, dict | list):
        return (None, [], {}) if isinstance(value, list) else (None, [])
    return (None, 3.0, "", []) if isinstance(value, str) else (None, True, "3", *(NUMBERS if ranges else NUMBERS[2:4]))


def reading(changed):
    """Read a map file of a content changed."""
    with tempfile.TemporaryDirectory() as folder:
        fm.read_map(resealed(changed, Path(folder) / "map.json"))


def swept(kind, *tables):
    """Each entry of some tables of a map file taken out and changed; all numbers once for each name."""
    content, ranges = files()[kind], set()
    for place, value in places_of(content):
        if place[0] not in tables:
            continue

        def changed(value, *, place=place, out=False):
            copy = json.loads(json.dumps(content))
            at = functools.reduce(lambda holder, key: holder[key], place[:-1], copy)
            if out:
                del at[place[-1]]
            else:
                at[place[-1]] = value
            reading(copy)

        name = " ".join(map(str, (kind, *place)))
        yield f"{name} out", functools.partial(changed, None, out=True)
        entry = place[-1] if isinstance(place[-1], str) else place[-2]
        known = kind == "censored" and entry in files()["fitted"]["fit"]
        for other in instead(value, ranges=entry not in ranges and not known):
            yield f"{name} {other!r}", functools.partial(changed, other)
        ranges |= set() if isinstance(value, dict | list) else {entry}


def map_entries():
    content = files()["fitted"]
    others = ("content_sha256", "campaign", "binding", "measured_states", "states_left_out", "test_states", "fit")
    yield from swept("fitted", *(content.keys() - set(others)))


def map_states():
    yield from swept("fitted", "measured_states")


def map_states_not_fitted():
    yield from swept("fitted", "states_left_out", "test_states")


def map_fits():
    yield from swept("fitted", "fit")


def map_fits_censored():
    yield from swept("censored", "fit")


def map_files():
    fitted, published = files()["fitted"], files()["published"]
    for changed in (
        {"binding": {"state": "bound", "reason": None}},
        {"binding": {"state": "bound", "reason": "in words"}},
        {"binding": {"state": "loose", "reason": None}},
        {"binding": {}},
        {"schema": "forcemap-map/2"},
        {"simulated": True},
        {"fit": None},
    ):
        yield f"changed {changed}", functools.partial(reading, fitted | changed)
    for changed in ({"name": "mine"}, {"source": "mine"}, {"software": "x"}, {"device_range_N": 400.0}):
        yield f"published {changed}", functools.partial(reading, published | changed)
    for name in list(published):
        without = {key: each for key, each in published.items() if key != name}
        yield f"published without {name}", functools.partial(reading, without)
    for text in ("", "{", "[]", "null", "3", '"x"', "{}"):
        yield f"text {text!r}", lambda text=text: read_text(text)


def read_text(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.json"
        path.write_text(text)
        fm.read_map(path)


PARTS = (
    spellings,
    promises,
    fits,
    limit_tables,
    limits_stated,
    contact_model,
    map_entries,
    map_states,
    map_states_not_fitted,
    map_fits,
    map_fits_censored,
    map_files,
)


def rows(part):
    """Name and sentence of each call of a part."""
    with np.errstate(all="ignore"):
        found = [[f"{part.__name__} {name}", said(call)] for name, call in part()]
    return [[" ".join(name.split()), re.sub(r"\S*map\.json", "map.json", each)] for name, each in found]


if __name__ == "__main__":
    with TABLE.open("w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(row for part in PARTS for row in rows(part))
