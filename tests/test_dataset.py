"""The impacts table: what is read, what is refused and how."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from oracle import DEVICE, full_grid, simulate

import forcemap as fm
from forcemap.errors import CampaignFileError, TableError

HEADER = "distance_m,height_m,speed_mps,peak_force_N"


def write(tmp_path, text, name="impacts.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def read(tmp_path, *rows, header=HEADER):
    return fm.read_dataset(write(tmp_path, "\n".join([header, *rows]) + "\n"))


def test_minimal_table(tmp_path):
    dataset = read(tmp_path, "0.5,0.2,0.25,200", "0.5,-0.1,0.25,220.5")
    assert dataset.role.tolist() == ["train", "train"]
    assert dataset.height.tolist() == [0.2, -0.1]
    assert len(dataset.states) == 2
    assert dataset.states_found == "by coordinates, repeats within 5 mm and 10 mm/s"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_european_tables(tmp_path, encoding, newline):
    rows = [HEADER.replace(",", ";") + ";Bemerkung", "0,52;0,14;0,2;389,7;erster; Stoß"]
    rows[1] = "0,52;0,14;0,2;389,7;Stoß"
    dataset = fm.read_dataset(write(tmp_path, newline.join(rows) + newline, encoding=encoding))
    assert (dataset.distance[0], dataset.speed[0], dataset.peak_force[0]) == (0.52, 0.2, 389.7)
    assert dataset.extra == {"Bemerkung": ("Stoß",)}


def test_semicolons_with_decimal_points(tmp_path):
    assert fm.read_dataset(write(tmp_path, HEADER.replace(",", ";") + "\n0.5;0.2;0.25;200\n")).peak_force[0] == 200


REFUSED = [
    # header, rows, row of the error, column of the error, part of the message
    (HEADER.replace("speed_mps", "speed"), ["0.5,0.2,0.25,200"], 1, "speed_mps", "missing"),
    (HEADER, ["0.5,0.2,0.25,200", "0.5,abc,0.25,200"], 3, "height_m", "'abc'"),
    (HEADER, ["0.5,0.2,0.25,nan"], 2, "peak_force_N", "'nan'"),
    (HEADER, ["0.5,0.2,0.25,inf"], 2, "peak_force_N", "'inf'"),
    (HEADER, ["0.5,0.2,0.25,1e999"], 2, "peak_force_N", "inf"),
    (HEADER, ["0.5,0.2,0.25,"], 2, "peak_force_N", "''"),
    (HEADER, ["0.5,0.2,0.25,1_000"], 2, "peak_force_N", "1_000"),
    (HEADER, ["0,0.2,0.25,200"], 2, "distance_m", "found 0"),
    (HEADER, ["-0.5,0.2,0.25,200"], 2, "distance_m", "-0.5"),
    (HEADER, ["0.5,0.2,0,200"], 2, "speed_mps", "found 0"),
    (HEADER, ["0.5,0.2,0.25,-200"], 2, "peak_force_N", "-200"),
    (HEADER, ["520,0.2,0.25,200"], 2, "distance_m", "up to 10; is it in mm?"),
    (HEADER, ["0.5,0.2,250,200"], 2, "speed_mps", "up to 10; is it in mm/s"),
    (HEADER, ["0.5,-25,0.25,200"], 2, "height_m", "metres from -10 to 10; is it in mm or cm?"),
    (HEADER, ["0.5,0.2,0.25,0.2"], 2, "peak_force_N", "newtons"),
    (HEADER, ["0.5,0.2,0.25"], 2, None, "3 cells"),
    (HEADER, ["0.5,0.2,0.25,200,7"], 2, None, "5 cells"),
    (HEADER + ",censored", ["0.5,0.2,0.25,200,maybe"], 2, "censored", "'maybe'"),
    (HEADER + ",role", ["0.5,0.2,0.25,200,validate"], 2, "role", "'validate'"),
    (HEADER + ",scenario", ["0.5,0.2,0.25,200,bounced"], 2, "scenario", "'bounced'"),
    (HEADER + ",repeat", ["0.5,0.2,0.25,200,1.5"], 2, "repeat", "'1.5'"),
    (HEADER + ",phase2_force_N", ["0.5,0.2,0.25,200,-5"], 2, "phase2_force_N", "-5"),
    (HEADER + ",state_id", ["0.5,0.2,0.25,200,a", "0.6,0.2,0.25,200,"], 3, "state_id", "''"),
    (HEADER + ",state_id,repeat", ["0.5,0.2,0.25,200,a,1", "0.5,0.2,0.25,201,a,1"], 3, "repeat", "again"),
    (HEADER + ",state_id", ["0.5,0.2,0.25,200,a", "0.5052,0.2,0.25,200,a"], 3, "distance_m", "0.0052"),
    (HEADER + ",state_id", ["0.5,0.2,0.25,200,a", "0.5,0.2,0.2602,200,a"], 3, "speed_mps", "0.0102"),
    (
        HEADER + ",state_id",
        ["0.5,0.2,0.25,200,a", "0.504,0.2,0.25,200,b", "0.508,0.2,0.25,200,c"],
        4,
        "distance_m",
        "form a chain: lower the tolerance",
    ),
    (HEADER, ["0.5,0.2,0.250,200", "0.5,0.2,0.258,200", "0.5,0.2,0.266,200"], 4, "speed_mps", "chain"),
    (HEADER + ",speed_mps", ["0.5,0.2,0.25,200,0.3"], 1, "speed_mps", "twice"),
    (HEADER, ['0.5,0.2,"0.25,200'], 2, None, "not a CSV"),
    ("d,h,v,F,role", ["0.5,0.2,0.25,200,train"], 1, "distance_m", "found d, h, v, F: rename those that hold them"),
]


@pytest.mark.parametrize(("header", "rows", "row", "column", "part"), REFUSED)
def test_refusals_name_file_row_and_column(tmp_path, header, rows, row, column, part):
    with pytest.raises(TableError) as caught:
        read(tmp_path, *rows, header=header)
    assert (caught.value.row, caught.value.column) == (row, column)
    assert caught.value.file == str(tmp_path / "impacts.csv")
    assert part in caught.value.message
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"", "empty"),
        (b"\n \n", "empty"),
        (b"\xef\xbb\xbf", "empty"),
        (HEADER.encode() + b"\n", "no impact"),
        (b"\xff\xfe" + HEADER.encode("utf-16-le"), "UTF-8"),
        (HEADER.encode() + b"\n0.5,0.2,0.25,2\x0000\n", "binary"),
    ],
)
def test_files_that_are_no_table(tmp_path, content, part):
    path = tmp_path / "impacts.csv"
    path.write_bytes(content)
    with pytest.raises(TableError, match=part):
        fm.read_dataset(path)


def test_mixed_decimal_signs_are_ambiguous(tmp_path):
    with pytest.raises(TableError, match="decimal commas"):
        fm.read_dataset(write(tmp_path, HEADER.replace(",", ";") + "\n0,5;0,2;0,25;1.234\n"))


def test_missing_file(tmp_path):
    with pytest.raises(fm.InputError, match="no such file"):
        fm.read_dataset(tmp_path / "nothing.csv")


def test_saturated_readings_must_be_marked(tmp_path):
    (tmp_path / "campaign.toml").write_text('schema = "forcemap-campaign/1"\n[device]\nrange_N = 500\n')
    with pytest.raises(TableError, match="censored"):
        read(tmp_path, "0.5,0.2,0.25,500")
    dataset = read(tmp_path, "0.5,0.2,0.25,500,true", "0.6,0.2,0.25,480,false", header=HEADER + ",censored")
    assert dataset.states.impacts.tolist() == [0, 1]
    assert dataset.device_range == 500


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("schema = 'other/1'", "schema"),
        ("schema = 'forcemap-campaign/1'\n[device]\nrange = 500", "device.range_N"),
        ("schema = 'forcemap-campaign/1'\n[device]\nrange_N = '500'", "number"),
        ("schema = 'forcemap-campaign/1'\n[device]\nrange_N = -500.0", "positive"),
        ("schema = 'forcemap-campaign/1'\n[contact]\nspeed = 'guessed'", "measured"),
        ("schema = ", "TOML"),
    ],
)
def test_campaign_files_that_are_refused(tmp_path, text, part):
    (tmp_path / "campaign.toml").write_text(text)
    with pytest.raises(CampaignFileError, match=part) as caught:
        read(tmp_path, "0.5,0.2,0.25,200")
    assert caught.value.file.endswith("campaign.toml")


def test_censored_rows_are_kept_counted_and_not_averaged(tmp_path):
    rows = ["0.5,0.2,0.25,480,false", "0.5,0.2,0.25,500,true", "0.5,0.2,0.25,484,false", "0.7,0.2,0.25,500,true"]
    states = read(tmp_path, *rows, header=HEADER + ",censored").states
    assert states.impacts.tolist() == [2, 0]
    assert states.censored.tolist() == [1, 1]
    assert states.force[0] == 482
    assert states.log_force[0] == pytest.approx((np.log(480) + np.log(484)) / 2, rel=1e-15)
    assert np.isnan(states.force[1])
    assert states.at_least.tolist() == [500, 500]


def test_state_coordinates_are_means(tmp_path):
    dataset = read(tmp_path, "0.500,0.2,0.250,200", "0.504,0.2,0.256,204")
    assert len(dataset.states) == 1
    assert dataset.states.distance[0] == pytest.approx(0.502)
    assert dataset.states.speed[0] == pytest.approx(0.253)


def test_equal_coordinates_stay_exact():
    dataset = fm.ImpactDataset.from_arrays(
        distance=[0.1] * 3, height=[0.3] * 3, speed=[0.1] * 3, peak_force=[100, 101, 102]
    )
    assert (dataset.states.distance[0], dataset.states.height[0], dataset.states.speed[0]) == (0.1, 0.3, 0.1)


@pytest.mark.parametrize("apart", [(0, 0, 0), (0.004, 0, 0), (0, -0.005, 0), (0.003, 0.003, 0.01)])
def test_repeats_named_as_states_of_their_own_are_one_state(apart):
    d, h, v = np.array([[0.5, 0.2, 0.25], [0.5, 0.2, 0.25], [0.7, 0.2, 0.25]]).T
    d, h, v = (np.append(each, each[0] + more) for each, more in zip((d, h, v), apart, strict=True))
    dataset = fm.ImpactDataset.from_arrays(
        distance=d,
        height=h,
        speed=v,
        peak_force=[200, 201, 150, 202],
        state=["b", "b", "far", "a"],
        repeat=[1, 2, 7, 1],
    )
    assert dataset.state.tolist() == ["b", "b", "far", "b"]
    assert dataset.repeat.tolist() == [1, 2, 7, 3]
    assert len(dataset.states) == 2
    near = fm.ImpactDataset.from_arrays(
        distance=d, height=h, speed=v, peak_force=[200, 201, 150, 202], state=["b", "b", "far", "a"],
        role=["train"] * 3 + ["test"],
    )  # fmt: skip
    assert near.test.state.tolist() == ["a"]
    assert near.again.test.state.tolist() == ["b"]  # by its name a drift is told
    assert len(near.independent_test) == 0  # it shares the error of the training state


def test_tolerance_is_adjustable():
    arrays = {"distance": [0.5, 0.508], "height": [0.2, 0.2], "speed": [0.25, 0.25], "peak_force": [200, 201]}
    assert len(fm.ImpactDataset.from_arrays(**arrays).states) == 2
    assert len(fm.ImpactDataset.from_arrays(**arrays, tolerance=fm.StateTolerance(place=0.01)).states) == 1


def test_states_do_not_depend_on_the_order_of_rows():
    rng = np.random.default_rng(5)
    dataset = simulate("ur10e", rng, effect=0.02).dataset
    order = rng.permutation(len(dataset))
    columns = {"distance": dataset.distance, "height": dataset.height, "speed": dataset.speed}
    columns |= {"peak_force": dataset.peak_force, "censored": dataset.censored}
    one = fm.ImpactDataset.from_arrays(**columns).states
    other = fm.ImpactDataset.from_arrays(**{name: values[order] for name, values in columns.items()}).states
    for name in ("distance", "height", "speed", "log_force", "impacts", "censored"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_many_identical_rows_are_one_state():
    n = 20_000
    dataset = fm.ImpactDataset.from_arrays(
        distance=np.full(n, 0.5), height=np.full(n, 0.2), speed=np.full(n, 0.25), peak_force=np.full(n, 200.0)
    )
    assert len(dataset.states) == 1


def test_written_tables_read_back_bit_for_bit(tmp_path, examples):
    for dataset in examples.values():
        fm.write_dataset(dataset, tmp_path / "again.csv")
        again = fm.read_dataset(tmp_path / "again.csv", conditions=dataset.conditions)
        for name in ("distance", "height", "speed", "peak_force", "state", "repeat", "role", "censored", "flags"):
            np.testing.assert_array_equal(getattr(again, name), getattr(dataset, name))
        assert list(again.scenario) == list(dataset.scenario)


def test_frames(examples):
    dataset = examples["ur10e"]
    again = fm.ImpactDataset.from_frame(dataset.to_frame(), conditions=dataset.conditions)
    np.testing.assert_array_equal(again.peak_force, dataset.peak_force)
    assert list(again.scenario) == list(dataset.scenario)
    with pytest.raises(TableError, match="speed_mps"):
        fm.ImpactDataset.from_frame(dataset.to_frame().drop(columns="speed_mps"))


def test_unequal_arrays_are_refused():
    with pytest.raises(TableError, match="shape"):
        fm.ImpactDataset.from_arrays(distance=[0.5, 0.6], height=[0.1], speed=[0.2, 0.2], peak_force=[100, 100])


def test_phase_two_counts_every_impact():
    dataset = fm.ImpactDataset.from_arrays(
        distance=[0.5, 0.6, 0.7],
        height=[0.1] * 3,
        speed=[0.2] * 3,
        peak_force=[100, 100, 100],
        role=["train", "test", "train"],
        scenario=["unconstrained", "Constrained with clamping", None],
        phase2_force=[np.nan, 80.0, np.nan],
    )
    phase_two = dataset.phase_two
    assert phase_two.scenarios == {fm.ContactScenario.UNCONSTRAINED: 1, fm.ContactScenario.WITH_CLAMPING: 1}
    assert (phase_two.unrecorded, phase_two.largest_force) == (1, 80.0)


numbers = st.floats(0.05, 5.0)
rows = st.lists(
    st.tuples(numbers, st.floats(-2, 2), st.floats(0.02, 2.0), st.floats(5.0, 900.0)), min_size=1, max_size=20
)


@given(rows)
def test_property_what_is_accepted_reads_back(tmp_path_factory, table):
    columns = dict(zip(("distance", "height", "speed", "peak_force"), np.array(table).T, strict=True))
    try:
        dataset = fm.ImpactDataset.from_arrays(**columns)
    except fm.ForcemapError:
        return
    path = tmp_path_factory.mktemp("table") / "impacts.csv"
    fm.write_dataset(dataset, path)
    try:
        again = fm.read_dataset(path)
    except TableError as error:  # only a file says in which order impacts were made, and so that there are two set-ups
        if "expected one set-up" in str(error):
            return
        raise
    for name in ("distance", "height", "speed", "peak_force", "state", "repeat"):
        np.testing.assert_array_equal(getattr(again, name), getattr(dataset, name))


def test_device_of_the_paper_and_grid_are_consistent():
    assert DEVICE.highest_limit == 497
    assert len(full_grid("ur10e")) == 125
