"""Several maps together: what holds for which motion, contact site, tool and payload, and what is permitted by none."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import forcemap as fm
from forcemap.direction import DIRECTIONS, angle_between, direction_vector, direction_words, same_direction
from forcemap.exports.directed_tables import directed_csv, directed_result, directed_tables
from forcemap.exports.krl import krl_along_data, krl_along_source
from forcemap.exports.urscript import urscript_along
from forcemap.paths.atlas import Atlas, AtlasMap
from forcemap.paths.bent_path import bent_path
from forcemap.paths.gaps import map_gaps
from robot_programs import Frame, krl_along, urscript_along_function

BOUND = fm.FixedMargin(0.10)
HERE = (0.0, 0.0, 0.0)
HAND, TRANSIENT = ("back_of_hand",), fm.Contact.TRANSIENT
SIX = ("down", "up", "out", "in", "left", "right")


def a_map(direction="down", *, site="flange", tool="none", payload=0.0, weaker=1.0, name=None, **stated):
    """The published UR10e's map as that of a campaign under other conditions, its forces times a factor."""
    ur10e = fm.published_map("ur10e")
    conditions = replace(ur10e.conditions, direction=direction, contact_site=site, tool=tool, payload=payload, **stated)
    coefficients = ur10e.coefficients.copy()
    coefficients[0] += math.log(weaker)
    name = name or f"{direction} {site} {tool} {payload:g}"
    return AtlasMap(name, conditions, replace(ur10e, conditions=conditions, coefficients=coefficients, name=name))


def an_atlas(directions=SIX, *, weaker=1.0, **stated):
    """Maps of one contact site and tool, each with forces of its own."""
    return Atlas(tuple(a_map(each, weaker=weaker * (1 - 0.02 * i), **stated) for i, each in enumerate(directions)))


def a_task(*segments, **stated):
    return fm.Task(segments or (fm.TaskSegment("path", HAND, TRANSIENT, 0.2),), **stated)


def cylinder(points):
    """Unit vectors away from the base's z-axis, counterclockwise around it and up at points, shapes (n, 3)."""
    out = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1)[:, None]
    return out, np.stack([-out[:, 1], out[:, 0], 0 * out[:, 0]], axis=1), np.tile([0.0, 0.0, 1.0], (len(points), 1))


def brute_angle(start, end, direction, count=401, beside=0.0):
    """Largest angle between a straight motion and a direction of the cylinder on its way, or `beside` it [deg]."""
    share = np.linspace(0, 1, count)[:, None]
    way = start * (1 - share) + end * share
    shifts = [[0, 0, 0]]
    if beside:
        shifts += [[beside * math.cos(a), beside * math.sin(a), 0] for a in np.linspace(0, 2 * math.pi, 24)]
    unit = (end - start) / np.linalg.norm(end - start)
    largest = 0.0
    for shift in shifts:
        out, around, up = cylinder(way + shift)
        towards = direction[0] * out + direction[1] * around + direction[2] * up
        angles = np.degrees(np.arctan2(np.linalg.norm(np.cross(towards, unit), axis=1), towards @ unit))
        largest = max(largest, float(angles.max()))
    return largest


def random_moves(seed, count, *, length=(0.02, 0.3)):
    """Straight moves in the workspace; three of four nearly along a direction with a name."""
    rng = np.random.default_rng([9173, seed])
    for number in range(count):
        d, h, turn = rng.uniform(0.55, 0.86), rng.uniform(0.16, 0.44), rng.uniform(-np.pi, np.pi)
        start = np.array([[d * math.cos(turn), d * math.sin(turn), h]])
        out, around, up = (each[0] for each in cylinder(start))
        a, b, c = rng.normal(size=3)
        if number % 4:
            near = list(DIRECTIONS.values())[rng.integers(6)] + rng.normal(size=3) * math.radians(
                rng.choice([0.0, 2, 4])
            )
            a, b, c = near
        towards = a * out + b * around + c * up
        far = rng.uniform(*length) * (0.3 if number % 2 else 1)
        yield start[0], start[0] + far * towards / np.linalg.norm(towards)


# directions


def test_words_are_the_directions_of_the_cylinder():
    assert len(DIRECTIONS) == 26
    expected = {"down": (0, 0, -1), "up": (0, 0, 1), "out": (1, 0, 0), "in": (-1, 0, 0), "left": (0, 1, 0)}
    for words, vector in expected.items():
        np.testing.assert_array_equal(direction_vector(words, whose="a map"), vector)
    np.testing.assert_allclose(direction_vector("Out  and DOWN", whose="a map"), np.array([1, 0, -1]) / math.sqrt(2))
    np.testing.assert_allclose(direction_vector("down and in and left", whose="a map"), np.array([-1, 1, -1]) / 3**0.5)
    np.testing.assert_allclose(direction_vector("3, 0,-4", whose="a map"), [0.6, 0, -0.8])
    for words, vector in DIRECTIONS.items():
        assert direction_words(vector) == words
        assert np.linalg.norm(vector) == pytest.approx(1)
    assert direction_words(np.array([0.6, 0, -0.8])) == "0.6,0,-0.8"
    assert angle_between(DIRECTIONS["down"], DIRECTIONS["down and out"]) == pytest.approx(45)
    assert same_direction("straight down", "0,0,-2")
    assert same_direction("sideways", " Sideways")
    assert not same_direction("left", "right")
    assert not same_direction("sideways", "left")


@pytest.mark.parametrize(
    "words",
    ["sideways", "out and in", "down and down", "forward", "1,2", "0,0,0", "nan,0,1", "inf,0,0", "1,0,0,0", "down,out"],
)
def test_other_words_are_refused(words):
    with pytest.raises(fm.InputError, match="expected one of down, up, out, in, left, right"):
        direction_vector(words, whose="a map")


def test_an_angle_is_the_largest_on_the_way_and_beside_it():
    rng, worst = np.random.default_rng(7), 0.0
    for number in range(150):
        start = rng.uniform(-0.9, 0.9, 3)
        end = start + rng.normal(0, 0.5 if number % 3 == 0 else 0.05, 3)
        vector = rng.normal(size=3) if number % 2 else list(DIRECTIONS.values())[number % 26]
        vector = vector / np.linalg.norm(vector)
        path = fm.ToolPath.through([start, end])
        found, expected = path.angles_from(vector)[0], brute_angle(start, end, vector, 4001)
        worst = max(worst, abs(found - expected))
        assert path.angles_from(vector, beside=0.01)[0] >= brute_angle(start, end, vector, 101, beside=0.01) - 1e-6
    assert worst < 1e-2
    through_the_axis = fm.ToolPath.through([[-0.3, 0, 0.3], [0.3, 0, 0.3]])
    assert through_the_axis.angles_from(DIRECTIONS["out"])[0] == pytest.approx(180)
    assert through_the_axis.angles_from(DIRECTIONS["down"])[0] == pytest.approx(90)


# what is permitted


def test_every_piece_is_allowed_what_the_map_of_its_direction_allows(full_size):
    """Against brute force: sampled angles choose the map, sampled places its lowest safe speed."""
    atlas, allowance = an_atlas(), fm.Allowance(0.01, 0.0)
    limit, seen, outside = fm.force_limit(HAND[0]), dict.fromkeys(SIX, 0), 0
    for start, end in random_moves(1, 600 if full_size else 80):
        found = fm.path_speeds(atlas, fm.ToolPath.through([start, end]), a_task(), bound=BOUND, allowance=allowance)
        for i, (a, b) in enumerate(zip(found.path.points[:-1], found.path.points[1:], strict=True)):
            angles = {each.name: brute_angle(a, b, each.direction, 21) for each in atlas.maps}
            held = [each for each in atlas.maps if angles[each.name] <= 5 + 1e-6]
            assert len(held) <= 1
            if not held:
                assert found.outcome[i] == "no_map"
                assert math.isnan(found.speed[i])
                continue
            if found.outcome[i] == "no_map":
                assert angles[held[0].name] > 5 - 1e-6
                continue
            share = np.linspace(0, 1, 21)[:, None]
            way = a * (1 - share) + b * share
            at = fm.safe_speed(
                held[0].force_map, np.hypot(*way.T[:2]), way[:, 2],
                limit=limit, bound=BOUND, contact=TRANSIENT, angle=min(angles[held[0].name], 5.0),
            )  # fmt: skip
            if found.refused[i]:
                outside += 1
                continue
            assert found.map_name[i] == held[0].name
            assert found.contact_speed[i] <= at.speed.min() + 1e-9
            assert found.contact_speed[i] > at.speed.min() - 0.02
            assert found.speed[i] == pytest.approx(found.contact_speed[i] - 0.01)
            seen[held[0].conditions.direction] += 1
    assert min(seen.values()) > (15 if full_size else 2)
    assert outside > 20


def test_one_map_is_the_atlas_of_itself():
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3], [0.8, 0, 0.4], [0.7, 0, 0.4]])
    alone = fm.path_speeds(fm.published_map("ur10e"), path, a_task(), bound=BOUND)
    several = fm.path_speeds(an_atlas(), path, a_task(), bound=BOUND)
    down = several.map_name == "down flange none 0"
    assert down.sum() == 7
    np.testing.assert_array_equal(alone.speed[down], several.speed[down])
    assert {*alone.outcome[~down]} == {"not_downward"}
    assert {*several.outcome} == {"admissible"}
    up = a_map("up").force_map
    assert fm.path_speeds(up, path, a_task(), bound=BOUND).refused.tolist() == [True] * 7 + [False] * 5 + [True] * 5


@pytest.mark.parametrize("missing", ["site", "tool", "payload", "direction"])
def test_what_has_no_map_has_no_permission(missing, tmp_path):
    """In paths, tables, programs and positions of a table."""
    there = {"site": "flange", "tool": "gripper", "payload": 1.0}
    other = {"site": "elbow", "tool": "welder", "payload": 2.0}
    atlas = Atlas((a_map("down", **there), a_map("out", **there)))
    named = there | ({} if missing == "direction" else {missing: other[missing]})
    segment = fm.TaskSegment("path", HAND, TRANSIENT, 0.2, (named["site"],), named["tool"], named["payload"])
    height = 0.42 if missing == "direction" else 0.30
    path = fm.ToolPath.through([[0.8, 0, 0.38], [0.8, 0, height]])
    found = fm.path_speeds(atlas, path, fm.Task((segment,)), bound=BOUND)
    assert {*found.outcome} == {"no_map"}
    assert np.isnan(found.speed).all()
    assert np.isnan(found.contact_speed).all()
    assert (found.commanded == 0).all()
    assert math.isnan(found.allowed.duration)
    kinds = {reason.kind.value for reason in found.reason}
    assert kinds == {"not_along_any" if missing == "direction" else "no_map_of"}
    places = fm.place_task(atlas, path.moved([-0.8, 0, -0.3]), fm.Task((segment,)), bound=BOUND, step=0.1)
    assert places.best is None
    assert (places.permitted == 0).all()
    (gap,) = map_gaps(found)
    stated = fm.path_speeds(atlas, path, fm.Task((segment,), conditions={"direction": "down"}), bound=BOUND)
    assert [str(each) for each in map_gaps(stated)] == ([] if missing == "direction" else [str(gap)])
    assert gap.direction == ("up" if missing == "direction" else "down")
    assert (gap.loaded.contact_site, gap.loaded.tool, gap.loaded.payload) == (
        named["site"],
        named["tool"],
        named["payload"],
    )
    assert gap.length == pytest.approx(abs(height - 0.38))
    assert gap.states == (9 if missing in ("tool", "payload") else 18)
    if missing != "direction":
        with pytest.raises(fm.InputError, match="no map of the atlas is of a contact site, tool and payload"):
            tables_of(atlas, fm.Task((segment,)))


def test_every_contact_site_that_can_hit_needs_a_map_and_the_strictest_counts():
    light, heavy = a_map("down", weaker=0.8), a_map("down", site="elbow", weaker=1.0)
    only_light = a_map("out", weaker=0.8)
    atlas = Atlas((light, heavy, only_light))
    path = fm.ToolPath.through([[0.7, 0, 0.44], [0.7, 0, 0.38], [0.8, 0, 0.38]])
    two = fm.TaskSegment("path", HAND, TRANSIENT, contact_sites=("Flange", " elbow "))
    both = a_task(two, site_offsets={"flange": HERE, "Elbow": HERE})
    found = fm.path_speeds(atlas, path, both, bound=BOUND)
    down = path.resampled(0.02).directions[:, 2] < -0.9
    assert {*found.outcome[down]} == {"admissible"}
    assert {*found.outcome[~down]} == {"no_map"}
    assert {*found.map_name[down]} == {heavy.name}
    alone = fm.path_speeds(heavy.force_map, path, a_task(), bound=BOUND)
    np.testing.assert_array_equal(found.speed[down], alone.speed[down])
    (gap,) = map_gaps(found)
    assert (gap.direction, gap.loaded.contact_site, gap.length) == ("out", "elbow", pytest.approx(0.1))
    flange = a_task(fm.TaskSegment("path", HAND, TRANSIENT, contact_sites=("flange",)))
    assert not fm.path_speeds(atlas, path, flange, bound=BOUND).refused.any()
    (note,) = [
        note for note in fm.path_speeds(atlas, path, flange, bound=BOUND).notes if note.kind == "sites_not_hitting"
    ]
    assert note.figure("sites") == ("elbow",)
    for stated in ({}, {"conditions": {"contact_site": "flange"}}):  # one that is named says nothing of the others
        with pytest.raises(fm.InputError, match=r"different contact_sites \(elbow, flange\).*all that can hit"):
            fm.path_speeds(atlas, path, a_task(**stated), bound=BOUND)
    for offsets in ({}, {"flange": HERE}, {"elbow": HERE}):
        with pytest.raises(fm.InputError, match="nothing says where"):
            fm.path_speeds(atlas, path, a_task(two, site_offsets=offsets), bound=BOUND)


def test_a_contact_site_is_looked_up_where_it_is():
    """The flange above the finger: the map of each at its own place, in the direction of the motion there."""
    finger, flange = a_map("out", site="finger", weaker=0.7), a_map("out", site="flange", weaker=0.7)
    offset = np.array([0.0, -0.1, 0.12])
    two = fm.TaskSegment("path", HAND, TRANSIENT, contact_sites=("finger", "flange"))
    task = a_task(two, site_offsets={"finger": HERE, "flange": tuple(offset)})
    path = fm.ToolPath.through([[0.70, 0, 0.30], [0.82, 0, 0.30]])
    found = fm.path_speeds(Atlas((finger, flange)), path, task, bound=BOUND)
    assert {*found.outcome} == {"no_map"}  # beside the radius the flange moves 8 degrees off it
    task = a_task(two, site_offsets={"finger": HERE, "flange": tuple(offset * [1, 0.4, 1])})
    found = fm.path_speeds(Atlas((finger, flange)), path, task, bound=BOUND)
    alone = [
        fm.path_speeds(each.force_map, way, a_task(), bound=BOUND).speed
        for each, way in ((finger, path), (flange, path.moved(offset * [1, 0.4, 1])))
    ]
    assert np.isfinite(alone).all()
    assert not np.allclose(*alone)
    np.testing.assert_array_equal(found.speed, np.minimum(*alone))
    turning = replace(path, turning=np.zeros(1))
    with pytest.raises(fm.InputError, match="on a path of joints the tool may turn"):
        fm.path_speeds(Atlas((finger, flange)), turning, task, bound=BOUND)
    both = programs(tables_of(Atlas((finger, flange)), task))
    code = tables_of(Atlas((finger, flange)), task).codes[0]
    given = [program([0.70, 0, 0.30], [0.82, 0, 0.30], code) for program in both]
    assert given[0] == given[1] > 0.05
    assert given[0] <= found.speed.min()
    assert program_of(both, [0.70, 0, 0.38], [0.82, 0, 0.38], code) == 0.0  # the flange above what was measured


def program_of(both, *given):
    """What both programs answer, which is the same."""
    (answer,) = {program(*given) for program in both}
    return answer


@pytest.mark.parametrize(
    ("offsets", "message"),
    [
        ({"flnage": (0.0, 0.0, 0.15)}, "nothing says where 'flange' lies"),  # a slip is no offset of zero
        ({"flange": (0.0, 0.0, 0.1), " Flange": (0.0, 0.0, 0.2)}, "found two for one contact site"),
        ({"flange": (0.1,)}, "expected three finite numbers"),
        ({"flange": (0.0, 0.0, math.nan)}, "expected three finite numbers"),
    ],
)
def test_an_offset_that_says_nothing_is_refused(offsets, message):
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.40]])
    with pytest.raises(fm.InputError, match=message):
        fm.path_speeds(a_map("down").force_map, path, a_task(site_offsets=offsets), bound=BOUND)


def test_what_points_off_for_the_robots_deviation_is_raised():
    """Radially, but up to 40 mm beside: 3.3 degrees off the direction."""
    path = fm.ToolPath.through([[0.7, 0, 0.3], [0.74, 0, 0.3]])
    wide, none = fm.Allowance(0.01, 0.02), fm.Allowance(0.01, 0.0)
    for allowance, raised in ((wide, True), (none, False)):
        found = fm.path_speeds(an_atlas(("out",), weaker=0.7), path, a_task(), bound=BOUND, allowance=allowance)
        (within,) = (note for note in found.notes if note.kind == "motion_within")
        assert (within.figure("angle_deg") is not None) == raised
        assert [basis.raised > 1 for basis in found.bases] == [raised]


def test_grasped_and_empty_are_two_tools_of_one_path():
    atlas = Atlas((a_map("down", payload=0.0), a_map("down", payload=2.0, weaker=1.2)))
    path = fm.ToolPath(np.array([[0.8, 0, 0.44], [0.8, 0, 0.40], [0.8, 0.1, 0.40], [0.8, 0.1, 0.36]]), ("a", "b", "c"))
    segments = (
        fm.TaskSegment("a", HAND, TRANSIENT, payload=0.0),
        fm.TaskSegment("b", (), None, 0.5),
        fm.TaskSegment("c", HAND, TRANSIENT, payload=2.0),
    )
    found = fm.path_speeds(atlas, path, fm.Task(segments), bound=BOUND)
    names = np.array(found.path.names)
    assert {*found.map_name[names == "a"]} == {"down flange none 0"}
    assert {*found.map_name[names == "c"]} == {"down flange none 2"}
    assert found.speed[names == "c"].max() < found.speed[names == "a"].min()
    swapped = fm.path_speeds(
        atlas, path, fm.Task((segments[0], segments[1], replace(segments[2], payload=0.0))), bound=BOUND
    )
    assert (swapped.speed[names == "c"] > found.speed[names == "c"]).all()
    with pytest.raises(
        fm.InputError, match=r"segment 'a': the atlas has campaigns of different payload_kg \(0\.0, 2\.0\)"
    ):
        fm.path_speeds(atlas, path, fm.Task((replace(segments[0], payload=math.nan), *segments[1:])), bound=BOUND)
    masses = [note for note in found.notes if note.kind == fm.FindingKind.STANDARD_MASSES]
    assert sorted(note.figure("payload_kg") for note in masses) == [0.0, 2.0]


def test_a_campaign_without_a_map_still_says_what_can_hit():
    """Its contact site cannot be forgotten because its map failed."""
    error = fm.InputError("there are no impacts")
    failed = replace(a_map("down", site="elbow"), force_map=None, error=error)
    atlas = Atlas((a_map("down"), failed))
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.40]])
    with pytest.raises(fm.InputError, match=r"different contact_sites \(elbow, flange\)"):
        fm.path_speeds(atlas, path, a_task(), bound=BOUND)
    segment = fm.TaskSegment("path", HAND, TRANSIENT, contact_sites=("flange", "elbow"))
    both = a_task(segment, site_offsets={"flange": HERE, "elbow": HERE})
    found = fm.path_speeds(atlas, path, both, bound=BOUND)
    assert {*found.outcome} == {"no_map"}
    (warning,) = found.atlas.warnings
    assert (warning.figure("name"), warning.figure("why")) == (failed.name, "there are no impacts")


def test_a_map_that_cannot_carry_the_bound_counts_as_none(examples):
    fitted = fm.fit_force_map(examples["ur10e"])
    weak = a_map("out")
    conditions = replace(fitted.conditions, direction="out")
    assert weak.force_map is not None
    published = replace(weak, conditions=conditions, force_map=replace(weak.force_map, conditions=conditions))
    down = AtlasMap("down", fitted.conditions, fitted)
    atlas, bound = Atlas((down, published)), fm.ToleranceBound(device_error=3.0)
    found = fm.path_speeds(atlas, fm.ToolPath.through([[0.7, 0, 0.3], [0.75, 0, 0.3]]), a_task(), bound=bound)
    assert found.refused.all()
    assert [warning.figure("name") for warning in found.atlas.warnings] == [published.name]
    with pytest.raises(fm.BoundNotAvailable):
        fm.path_speeds(Atlas((published,)), fm.ToolPath.through([[0.7, 0, 0.3], [0.75, 0, 0.3]]), a_task(), bound=bound)


@pytest.mark.parametrize(
    ("maps", "message"),
    [
        ([a_map("down"), a_map("straight down")], "their directions differ by 0 degrees"),
        ([a_map("down"), a_map("0.1,0,-1")], r"differ by 5\.71 degrees, expected more than 10"),
        ([a_map("down"), a_map("out", robot="another")], "robot.model: down flange none 0 states"),
        ([a_map("down"), a_map("out", firmware="5.9")], "robot.firmware: down flange none 0 states nothing"),
        ([a_map("down"), a_map("out", safety_settings="x")], "robot.safety_settings"),
        ([a_map("down"), a_map("out", moving_mass=9.0)], "robot.moving_mass_kg"),
        ([a_map("down"), a_map("out", covers="foam")], "tool.covers"),
        ([a_map("down"), a_map("out", simulated=True)], "simulated"),
        ([a_map("down"), a_map("sideways")], "sideways flange none 0: direction: the campaign states 'sideways'"),
        ([a_map("down"), a_map("")], "does not state it"),
        ([replace(a_map("down"), force_map=None, error=fm.InputError("nothing yet"))], r"no campaign.*nothing yet"),
        ([], "no campaign of the atlas has a map"),
    ],
)  # fmt: skip
def test_maps_that_do_not_belong_together_are_refused(maps, message):
    with pytest.raises(fm.InputError, match=message):
        Atlas(tuple(maps))


def test_a_task_of_an_atlas_states_its_direction_or_lets_its_motions_say_it():
    path = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.40], [0.75, 0, 0.40]])
    free = fm.path_speeds(an_atlas(), path, a_task(), bound=BOUND)
    assert not free.refused.any()
    down = fm.path_speeds(an_atlas(), path, a_task(conditions={"direction": "down"}), bound=BOUND)
    assert down.refused.tolist() == [False] * 2 + [True] * 3
    assert {reason.kind for reason in down.reason[2:]} == {fm.FindingKind.NOT_AS_STATED}
    assert map_gaps(down) == ()
    with pytest.raises(fm.InputError, match="the task states 'down and out', the atlas has maps for down, up"):
        fm.path_speeds(an_atlas(), path, a_task(conditions={"direction": "down and out"}), bound=BOUND)
    with pytest.raises(fm.InputError, match="safety settings: the task states"):
        fm.path_speeds(an_atlas(), path, a_task(conditions={"safety_settings": "other"}), bound=BOUND)


# gaps and bent paths


def test_gaps_cover_what_has_no_map():
    atlas = an_atlas(("down",))
    points = np.array(
        [[0.8, 0, 0.4], [0.8, 0, 0.3], [0.8, 0, 0.4], [0.6, 0, 0.4], [0.6 * math.cos(0.2), 0.6 * math.sin(0.2), 0.4]]
    )
    arc = [[0.6 * math.cos(a), 0.6 * math.sin(a), 0.4] for a in np.linspace(0, 0.5, 30)]
    path = fm.ToolPath.through(np.vstack([points[:4], arc[1:]]))
    found = fm.path_speeds(atlas, path, a_task(), bound=BOUND)
    gaps = {gap.direction: gap for gap in map_gaps(found)}
    assert {*gaps} == {"left", "in", "up"}
    assert gaps["in"].length == pytest.approx(0.2)
    assert gaps["up"].length == pytest.approx(0.1)
    assert gaps["left"].length == pytest.approx(0.3, abs=1e-3)
    down = ~found.refused
    pace = np.sum(found.path.lengths[down] / found.speed[down]) / found.path.lengths[down].sum()
    assert gaps["in"].gain == pytest.approx(0.2 * (1 / found.standard.speed - pace))
    beside = fm.ToolPath.through([[0.8, 0, 0.4], [0.8 - 0.1 * math.sin(math.radians(7)), 0, 0.3]])
    assert map_gaps(fm.path_speeds(atlas, beside, a_task(), bound=BOUND)) == ()  # too close to a map that is there
    with_them = fm.path_speeds(an_atlas(("down", *gaps)), path, a_task(), bound=BOUND)
    assert not np.any(with_them.outcome == "no_map")
    assert map_gaps(with_them) == ()


def random_task(rng):
    """A pick and a place with a straight carry between them, well inside the measured places."""
    d, turn = rng.uniform(0.6, 0.82, 2), rng.uniform(-0.5, 0.5, 2)
    low, high = rng.uniform(0.2, 0.26, 2), rng.uniform(0.34, 0.4)
    first, second = (np.array([d[i] * math.cos(turn[i]), d[i] * math.sin(turn[i])]) for i in (0, 1))
    return np.array(
        [[*first, high], [*first, low[0]], [*first, high], [*second, high], [*second, low[1]], [*second, high]]
    )


def test_a_bent_path_does_the_same_task_by_measured_directions(full_size):
    rng, atlas, bends = np.random.default_rng(12), an_atlas(weaker=0.6), 0
    for _ in range(60 if full_size else 6):
        points = random_task(rng)
        path = fm.ToolPath.through(points)
        before = fm.path_speeds(atlas, path, a_task(), bound=BOUND)
        bent = bent_path(atlas, path, a_task(), bound=BOUND)
        assert bent.bent == before.refused.any()
        assert not bent.speeds.refused.any()
        if not bent.bent:
            continue
        bends += 1
        for point in points:
            assert np.linalg.norm(bent.path.points - point, axis=1).min() < 1e-9
        middle = (bent.path.points[1:] + bent.path.points[:-1]) / 2
        out, around, up = cylinder(middle)
        parts = [np.abs(np.einsum("ij,ij->i", bent.path.directions, each)) for each in (out, around, up)]
        assert (np.max(parts, axis=0) > math.cos(math.radians(2.0))).all()
        again = fm.path_speeds(atlas, bent.path, a_task(), bound=BOUND)
        np.testing.assert_array_equal(again.speed, bent.speeds.speed)
    assert bends > (10 if full_size else 3)


def test_a_descent_a_little_off_says_so_where_that_costs_it_its_speed_and_is_bent_straight():
    """Where straight down is permitted and a hair beside it not, the reason names the angle; its bound has the 14 %."""
    atlas, task, seen = an_atlas(), a_task(), 0
    for top, aside in itertools.product((0.30, 0.38, 0.44), (0.0005, 0.002, 0.01)):
        straight, off = (
            fm.path_speeds(atlas, fm.ToolPath.through([[d, 0, top], [0.6, 0, 0.15]]), task, bound=BOUND)
            for d in (0.6, 0.6 + aside)
        )
        kinds = [reason.kind for reason in off.reason]
        unconfirmed = off.outcome == "unconfirmed"
        assert [kind is fm.FindingKind.OFF_DIRECTION for kind in kinds] == unconfirmed.tolist()
        for reason in off.reason[unconfirmed]:
            angle = math.degrees(math.atan2(aside, top - 0.15))
            assert reason.figure("off_deg") == pytest.approx(angle, rel=0.05)
        bent = bent_path(atlas, off.path, task, bound=BOUND)
        if straight.refused.sum() < off.refused.sum():
            seen += 1
            permitted = [float(each.path.lengths[~each.refused].sum()) for each in (bent.speeds, off)]
            assert (bent.bent > 0, permitted[0] > permitted[1]) == (True, True)
    assert seen


def test_a_path_that_needs_no_bending_or_gains_nothing_stays_as_it_is():
    down = fm.ToolPath.through([[0.8, 0, 0.44], [0.8, 0, 0.3]])
    kept = bent_path(an_atlas(), down, a_task(), bound=BOUND)
    assert kept.bent == 0
    np.testing.assert_array_equal(kept.path.points, down.points)
    aside = fm.ToolPath.through([[0.8, 0, 0.44], [0.7, 0.3, 0.44]])
    assert bent_path(an_atlas(("up",)), aside, a_task(), bound=BOUND).bent == 0
    excluded = fm.Task((fm.TaskSegment("path", (), None, 0.5),))
    assert bent_path(an_atlas(), aside, excluded, bound=BOUND).bent == 0
    through = fm.ToolPath.through([[0.01, 0, 0.44], [0.7, 0.3, 0.44]])
    with pytest.raises(fm.InputError, match="comes to the base's z-axis"):
        bent_path(an_atlas(), through, a_task(), bound=BOUND)


# programs that choose by the motion


def tables_of(atlas, task=None, **case):
    limits = [(fm.force_limit(HAND[0]), TRANSIENT)]
    return directed_tables(atlas, limits=limits, bound=BOUND, task=task, date="2026-11-23", **case)


def programs(tables):
    """The exported functions of both controllers: start, target [m], number of the tool -> m/s."""
    of_ur = urscript_along_function(urscript_along(tables))
    of_kuka = krl_along(krl_along_source(tables), krl_along_data(tables))

    def kuka(start, target, tool):
        return of_kuka(*(Frame(zip("XYZ", [1000 * float(x) for x in at], strict=True)) for at in (start, target)), tool)

    return lambda start, target, tool: of_ur([*start, 0.0, 3.1, 0.0], [*target, 0.0, 3.1, 0.0], tool), kuka


def test_programs_choose_the_table_by_the_motion_and_are_never_above_the_library(full_size):
    light = an_atlas(payload=0.0, weaker=0.8).campaigns
    heavy = an_atlas(("down", "out", "left"), payload=2.0, weaker=0.7).campaigns
    elbow = (a_map("down", site="elbow", payload=2.0, weaker=0.8), a_map("left", site="elbow", payload=2.0, weaker=0.7))
    atlas = Atlas((*light, *heavy, *elbow))
    sites = {0.0: ("flange",), 2.0: ("flange", "elbow")}
    segments = {
        load: fm.TaskSegment("path", HAND, TRANSIENT, payload=load, contact_sites=each) for load, each in sites.items()
    }
    offsets = {"flange": HERE, "elbow": (0.02, -0.01, 0.03)}
    task = fm.Task((replace(segments[0.0], name="empty"), replace(segments[2.0], name="loaded")), site_offsets=offsets)
    tables = tables_of(atlas, task)
    assert [[site.contact_site for site in each] for each in tables.tools] == [["flange"], ["flange", "elbow"]]
    both, allowance, given = programs(tables), fm.Allowance(0.01, 0.005), {0.0: 0, 2.0: 0}
    lost = 0
    for start, end in random_moves(2, 1000 if full_size else 70):
        for code, load in zip(tables.codes, sites, strict=True):
            case = {"bound": BOUND, "allowance": allowance}
            library = fm.path_speeds(
                atlas, fm.ToolPath.through([start, end]), fm.Task((segments[load],), site_offsets=offsets), **case
            )
            most = 0.0 if library.refused.any() else float(library.speed.min())
            answers = [program(start, end, code) for program in both]
            assert answers[0] == answers[1]
            assert answers[0] <= most + 1e-12
            given[load] += answers[0] > 0
            lost += answers[0] == 0 < most
    assert given[0.0] > (50 if full_size else 15)
    assert given[2.0] > (10 if full_size else 2)
    assert lost < 0.5 * (given[0.0] + given[2.0])  # zones are larger than pieces
    code = tables.codes[0]
    for start, end, tool in (
        ([0.8, 0, 0.4], [0.8, 0, 0.4], code), ([0.8, 0, 0.4], [0.8, 0, 0.3], 0), ([0.8, 0, 0.4], [0.8, 0, 0.3], 1),
        ([0.8, 0, 0.4], [0.8, 0, math.nan], code), ([math.nan, 0, 0.4], [0.8, 0, 0.3], code),
        ([0.8, 0, math.inf], [0.8, 0, 0.3], code),
        ([0.8, 0, 0.4], [-math.inf, 0, 0.4], code), ([0.001, 0, 0.4], [0.8, 0, 0.4], code),
        ([0.8, 0, 0.4], [2.8, 0, 0.4], code),
    ):  # fmt: skip
        assert [program(start, end, tool) for program in both] == [0.0, 0.0]
    assert min(program([0.8, 0, 0.4], [0.8, 0, 0.36], code) for program in both) > 0.1


def test_a_program_gives_the_lowest_zone_of_its_table():
    tables = tables_of(an_atlas(weaker=0.8))
    both, code = programs(tables), tables.codes[0]
    down = next(each.table for each in tables.tables if each.campaign.conditions.direction == "down")
    rng, seen = np.random.default_rng(5), 0
    for _ in range(60):
        d, turn = rng.uniform(0.5, 0.9), rng.uniform(-3, 3)
        high, low = sorted(rng.uniform(0.14, 0.46, 2))[::-1]
        at = np.array([d * math.cos(turn), d * math.sin(turn)])
        steps = [down.speed(*at, h) for h in np.linspace(low, high, 400)]
        expected = 0.0 if min(steps) == 0 else min(steps)
        answers = [program([*at, high], [*at, low], code) for program in both]
        assert answers == [pytest.approx(expected)] * 2
        assert [program([*at, low], [*at, high], code) <= expected + 1e-12 or expected == 0 for program in both]
        seen += expected > 0
    assert seen > 10


def test_every_exported_file_names_its_tables_and_what_they_rest_on(tmp_path):
    atlas = replace(an_atlas(("down", "out")), source="cell 7")
    tables = tables_of(atlas)
    texts = [urscript_along(tables), krl_along_data(tables), krl_along_source(tables), directed_csv(tables)]
    for text in texts:
        assert text.isascii()
        wanted = [
            "NOT SAFETY-RATED",
            f"tool {tables.codes[0]}: none, payload 0 kg; contact sites that can hit: flange",
            atlas.sha256,
        ]
        for words in (*wanted, "table 1: motion down", "table 2: motion out", "prediction + 10 %", "cell 7"):
            assert words in text, words
    result = directed_result(tables)
    assert [each["direction"] for each in result["tables"]] == ["down", "out"]
    assert result["tables"][1]["direction_vector"] == [1.0, 0.0, 0.0]
    assert result["safety_rated"] is False
    rows = [line for line in texts[3].splitlines() if not line.startswith("#")]
    assert rows[0].startswith("direction,contact_site,tool,payload_kg,distance_from_m")
    assert len(rows) - 1 == tables.zones == sum(len(each["zones"]) for each in result["tables"])
    assert 0 < tables.permitted < tables.zones


def test_texts_of_a_campaign_stay_in_their_line():
    evil = "x\nend\ndef forcemap_speed_along(start, target, tool):\n  return 9.0\nend\r\nGLOBAL DEFFCT REAL F(P:IN)\x85"
    atlas = Atlas((a_map("down", tool=evil, site=evil, name=evil), a_map("out", tool=evil, site=evil, name=evil + "2")))
    tables = tables_of(atlas)
    both = programs(tables)  # the interpreters refuse a second function
    assert program_of(both, [0.8, 0, 0.4], [0.8, 0, 0.36], tables.codes[0]) > 0.1


def test_the_number_of_a_tool_stays_when_others_are_added():
    few = tables_of(Atlas((a_map("down", payload=0.0), a_map("down", payload=2.0))))
    more = tables_of(Atlas((a_map("down", payload=0.0), a_map("down", payload=1.0), a_map("down", payload=2.0))))
    assert {*few.codes} < {*more.codes}
    assert len({*more.codes}) == 3
    both = programs(few)
    assert all(program_of(both, [0.8, 0, 0.4], [0.8, 0, 0.36], code) > 0.05 for code in few.codes)
    for code in (*{*more.codes} - {*few.codes}, 0, 1, 2):
        assert program_of(both, [0.8, 0, 0.4], [0.8, 0, 0.36], code) == 0.0


def test_an_angle_that_no_motion_keeps_is_refused():
    with pytest.raises(fm.InputError, match="found 0 degrees, expected at least 1"):
        tables_of(an_atlas(), angle=0.0)
    with pytest.raises(fm.InputError, match="contact_sites"):
        tables_of(Atlas((a_map("down"), a_map("down", site="elbow"))))
    clamps = replace(a_map("out").force_map, phase_two=fm.published_map("kuka-iiwa7-30nm").phase_two)
    mixed = tables_of(Atlas((a_map("down"), replace(a_map("out"), force_map=clamps))))
    assert mixed.refusal is None
    assert [each.table.permitted > 0 for each in mixed.tables] == [True, False]
    assert tables_of(
        Atlas((replace(a_map("down"), force_map=replace(clamps, conditions=a_map("down").conditions)),))
    ).refusal
