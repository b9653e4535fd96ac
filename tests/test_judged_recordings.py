"""A campaign in which every recording is in another state, beside limits: what each of them shows, and the whole."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import forcemap as fm
from forcemap.findings import FindingKind
from forcemap.verdicts.recording_results import (
    RecordingsCheck,
    check_campaign,
    check_file,
    gravest_judgement,
    judge_recordings,
    recording_doubt,
    thinned,
)
from forcemap.words import sentence
from pulses import TOML, collect, pulse, rows, save, truth, write_campaign

HEAD, HAND, BELLY = fm.force_limit("skull_forehead"), fm.force_limit("back_of_hand"), fm.force_limit("abdomen")
EXCEEDED = fm.VerdictOutcome.EXCEEDED
# Name, first peak [N], second one [N] of two impacts, duration of Phase I [s].
RECORDED = {
    "a_low": (60.0, 0.0), "b_high": (300.0, 0.0), "c_excluded": (300.0, 0.0), "d_changed": (60.0, 0.0),
    "e_changed": (70.0, 0.0), "f_still": (0.0, 0.0), "h_gone": (80.0, 0.0), "i_twice": (90.0, 128.0),
    "j_twice": (310.0, 70.0), "d500-h200-v200-r1": (65.0, 0.0),
}  # fmt: skip
DOUBTED = {
    "c_excluded": FindingKind.EXCLUDED_BY_PERSON, "d_changed": FindingKind.FILE_CHANGED,
    "e_changed": FindingKind.FILE_CHANGED, "f_still": FindingKind.WORDS, "g_words": FindingKind.WORDS,
    "h_gone": FindingKind.FILE_GONE,
}  # fmt: skip
NAMES = [*sorted([*RECORDED, "g_words"]), "k_new"]


def curve(first, second=0.0, rate=1000.0):
    time, force = pulse(first, rate=rate, after=2.4, seed=7)
    return time, force + second * np.sin(np.pi * np.clip((time - 1.5) / 0.03, 0, 1))


def edit(folder, name, column, cell):
    """Change a cell of recordings.csv, as a person does."""
    table = rows(folder / "recordings.csv")
    with open(folder / "recordings.csv", "w", newline="") as stream:
        writer = csv.DictWriter(stream, table[0])
        writer.writeheader()
        writer.writerows(row | ({column: cell} if row["file"] == name else {}) for row in table)


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    folder = write_campaign(tmp_path_factory.mktemp("states") / "cell", recorded=False)
    for name, peaks in RECORDED.items():
        save(folder / "recordings" / f"{name}.csv", *curve(*peaks))
    (folder / "recordings" / "g_words.csv").write_text("no numbers\n")
    collect(folder)
    edit(folder, "c_excluded.csv", "exclude", "by hand")
    save(folder / "recordings" / "d_changed.csv", *curve(75.0))
    save(folder / "recordings" / "e_changed.csv", *curve(305.0))
    (folder / "recordings" / "h_gone.csv").unlink()
    save(folder / "recordings" / "k_new.csv", *curve(100.0))
    return folder


def impacts_of(cell, name):
    """The impacts of a file as it is now, read by themselves; none where it cannot be read."""
    path = cell / "recordings" / f"{name}.csv"
    if not path.exists() or name == "g_words":
        return []
    [read] = fm.read_recordings(path, device=fm.read_campaign(cell).conditions.device)
    return fm.find_impacts(read)


def gravest_of(impacts, limit, only):
    """The judgement of the highest outcome and share, of those that count."""
    verdicts = [fm.check_impact(impact, limit) for impact in impacts]
    kept = [verdict.governing for verdict in verdicts if not only or verdict.outcome is EXCEEDED]
    order = list(fm.VerdictOutcome)
    return max(kept, key=lambda one: (order.index(one.outcome), one.force / one.limit), default=None)


@pytest.mark.parametrize("limits", [[HAND], [HEAD, HAND, BELLY], [BELLY, HAND], [HEAD], []])
def test_every_recording_shows_what_its_state_allows(cell, limits):
    """Excluded ones nothing; changed ones only that they exceed; those without an impact, unread or gone, why not."""
    steps = []
    found = judge_recordings(fm.read_campaign(cell), limits, progress=lambda done, every: steps.append((done, every)))
    assert steps == [(k, len(NAMES)) for k in range(1, len(NAMES) + 1)]
    assert [result.entry.file for result in found.results] == [f"{name}.csv" for name in NAMES]
    permitted = [limit for limit in limits if limit is not HEAD]
    for name, result in zip(NAMES, found.results, strict=True):
        impacts = impacts_of(cell, name) if name != "c_excluded" else []
        judged = [None if limit is HEAD else gravest_of(impacts, limit, name in DOUBTED) for limit in limits]
        assert list(result.judgements) == judged, name
        kind = DOUBTED.get(name) or (None if permitted else FindingKind.NO_CONTACT_PERMITTED)
        assert (result.not_judged.kind if result.not_judged else None) is kind, name
        assert not result.simulated
        seen = impacts and (name not in DOUBTED or any(judged))
        expected = thinned(*impacts[0].curve()) if seen else (np.empty(0), np.empty(0))
        np.testing.assert_array_equal((result.time, result.force), expected, err_msg=name)
    assert found.results[-1].entry.reason == "not registered yet"
    assert found.gravest_limit is (permitted[0] if permitted else None)
    if permitted:
        every = [
            fm.check_impact(impact, permitted[0])
            for name in NAMES
            for impact in impacts_of(cell, name)
            if name != "c_excluded"
        ]
        share = max(one.governing.force / one.governing.limit for one in every)
        assert found.gravest.governing.force / found.gravest.governing.limit == share
        assert found.gravest.impact.recording.name == "j_twice.csv"
    else:
        assert found.gravest is None


def test_the_check_of_a_campaign_says_the_same(cell):
    campaign, steps = fm.read_campaign(cell), []
    found = check_campaign(campaign, HAND, progress=lambda *step: steps.append(step))
    assert steps[-1] == (len(NAMES), len(NAMES))
    assert (found.source, found.limit, found.permitted, found.simulated) == ("cell", HAND, True, False)
    assert [each.name for each in found.recordings] == [f"{name}.csv" for name in NAMES]
    for name, each in zip(NAMES, found.recordings, strict=True):
        impacts = impacts_of(cell, name)
        judged = [fm.check_impact(impact, HAND) for impact in impacts if name != "c_excluded"]
        judged = [one for one in judged if name not in DOUBTED or one.outcome is EXCEEDED]
        assert [one.judgements for one in each.verdicts] == [one.judgements for one in judged], name
        kind = DOUBTED.get(name) if name != "c_excluded" else None
        assert (each.not_judged.kind if each.not_judged else None) is kind, name
        assert each.excluded == ("by hand" if name == "c_excluded" else "")
        assert (each.recorded is None) == (name in ("g_words", "h_gone"))
    assert found.verdicts == [one for each in found.recordings for one in each.verdicts]
    assert found.outcome is EXCEEDED
    named = check_campaign(campaign, HAND, interpretation=fm.Interpretation.BY_TIME, contact=fm.Contact.QUASI_STATIC)
    assert {one.governing.interpretation for one in named.verdicts} == {fm.Interpretation.BY_TIME}
    assert {one.governing.limit for one in named.verdicts} == {140.0}
    refused = check_campaign(campaign, HEAD)
    assert (refused.permitted, refused.outcome, refused.verdicts) == (False, None, [])
    assert check_campaign(campaign, fm.NewtonLimit(280.0, 140.0)).permitted


def test_the_outcome_of_recordings_is_the_gravest_and_no_permission_where_one_is_not_judged(cell):
    conditions = fm.read_campaign(cell).conditions
    low = check_file(cell / "recordings" / "a_low.csv", HAND, conditions=conditions)
    assert low.outcome is fm.VerdictOutcome.WITHIN
    assert (low.source, low.conditions, low.recordings[0].name) == ("a_low.csv", conditions, "a_low.csv")
    still = check_file(cell / "recordings" / "f_still.csv", HAND, conditions=conditions, name="still")
    assert (still.source, still.recordings[0].name) == ("still", "still")
    assert still.outcome is fm.VerdictOutcome.CANNOT_TELL
    both = RecordingsCheck("both", HAND, conditions, (*low.recordings, *still.recordings))
    assert both.outcome is fm.VerdictOutcome.CANNOT_TELL
    assert RecordingsCheck("none", HAND, conditions, ()).outcome is fm.VerdictOutcome.CANNOT_TELL
    alone = check_file(cell / "recordings" / "a_low.csv", HAND)
    assert alone.outcome is fm.VerdictOutcome.CANNOT_TELL  # no spring is stated
    simulated = RecordingsCheck("s", HAND, fm.Conditions(simulated=True), low.recordings)
    assert simulated.simulated


def test_a_doubt_about_a_file_leaves_only_what_exceeds(cell):
    conditions, doubt = fm.read_campaign(cell).conditions, fm.Finding.of(FindingKind.FILE_CHANGED)
    for name, outcomes in (("a_low", []), ("j_twice", [EXCEEDED]), ("f_still", [])):
        found = check_file(cell / "recordings" / f"{name}.csv", HAND, conditions=conditions, doubt=doubt)
        assert [one.outcome for one in found.verdicts] == outcomes
        kind = FindingKind.WORDS if name == "f_still" else FindingKind.FILE_CHANGED
        assert found.recordings[0].not_judged.kind is kind


def test_what_a_campaign_says_against_a_file_that_is_measured_in_it(cell, tmp_path):
    """Nothing before it is collected, nor of one that is as it was registered, or is not registered."""
    empty = write_campaign(tmp_path / "new", recorded=False)
    save(empty / "recordings" / "a.csv", *curve(60.0))
    assert recording_doubt(empty, empty / "recordings" / "a.csv") is None
    assert recording_doubt(cell) is None
    for name in NAMES:
        path = cell / "recordings" / f"{name}.csv"
        if path.exists():
            found = recording_doubt(cell, path)
            assert (found.kind if found else None) is (FindingKind.FILE_CHANGED if "changed" in name else None), name


def slipped(folder, factor):
    """A campaign of 27 states on a robot of 6.7 kg whose forces are read so many times too large."""
    write_campaign(folder, recorded=False, toml=f"{TOML}[robot]\nmoving_mass_kg = 13.4\n")
    plan = fm.read_campaign(folder).plan
    for i, name in enumerate(plan.recording.tolist()):
        peak = factor * truth(plan.distance[i], plan.height[i], plan.speed[i])
        save(folder / "recordings" / f"{name}.csv", *pulse(300.0 if i == 3 else peak, rate=1000.0, seed=i))
    save(folder / "recordings" / "still.csv", *pulse(0.0, rate=1000.0, seed=99))
    return folder


def test_a_mistaken_unit_leaves_only_what_exceeds_in_the_whole_campaign(tmp_path):
    right, slip = slipped(tmp_path / "right", 1.0), slipped(tmp_path / "slip", 0.2)
    fine = judge_recordings(fm.read_campaign(right), [HAND])
    assert {result.not_judged for result in fine.results if result.entry.file != "still.csv"} == {None}
    campaign = fm.read_campaign(slip)
    for results in (judge_recordings(campaign, [HAND]).results, check_campaign(campaign, HAND).recordings):
        kinds = [result.not_judged.kind for result in results]
        assert sorted(set(kinds)) == sorted({FindingKind.UNIT_SLIP, FindingKind.WORDS})
        assert kinds.count(FindingKind.WORDS) == 1
    judged = [one for result in judge_recordings(campaign, [HAND]).results for one in result.judgements if one]
    assert [one.outcome for one in judged] == [EXCEEDED]
    assert [one.outcome for one in check_campaign(campaign, HAND).verdicts] == [EXCEEDED]
    collect(slip)
    assert recording_doubt(slip).kind is FindingKind.UNIT_SLIP
    assert recording_doubt(slip, slip / "recordings" / "still.csv").kind is FindingKind.UNIT_SLIP


def test_no_recording_is_no_check(tmp_path):
    folder = write_campaign(tmp_path / "cell", recorded=False)
    with pytest.raises(fm.InputError, match="found no recording to check"):
        check_campaign(fm.read_campaign(folder), HAND)
    nothing = judge_recordings(fm.read_campaign(folder), [HAND])
    assert (nothing.results, nothing.gravest, nothing.gravest_limit) == ((), None, None)


def test_the_gravest_judgement_goes_by_outcome_and_then_by_share(cell):
    [low], [high] = impacts_of(cell, "a_low"), impacts_of(cell, "b_high")
    judgements = [one for impact in (low, high) for one in fm.check_impact(impact, HAND).judgements]
    assert gravest_judgement(judgements) == fm.check_impact(high, HAND).governing
    assert gravest_judgement([]) is None
    assert "300" in sentence(gravest_judgement(judgements).reason)


@pytest.mark.parametrize(
    ("header", "columns", "said"),
    [
        ("t,F", {"force_unit": "N"}, True),
        ("t,F [N]", {}, False),
        ("t,F_kN", {"force_unit": "kN"}, False),
        ("# Force unit: N\nt,F", {}, False),
    ],
)
def test_a_single_file_without_a_unit_of_force_says_so_first(header, columns, said, tmp_path):
    """In daN 340 N look like 34; of a single file nothing else tells."""
    time, force = pulse(100.0)
    rows = "\n".join(f"{t:.4f},{f:.2f}" for t, f in zip(time, force, strict=True))
    (tmp_path / "impact.csv").write_text(f"{header}\n{rows}\n")
    name = header.splitlines()[-1].split(",")[1]
    device = fm.Device(range=500e3, stiffness=75e3)
    found = check_file(
        tmp_path / "impact.csv", HAND, conditions=fm.Conditions(device=device),
        columns=fm.ColumnMap(time="t", force=name, **columns),
    )  # fmt: skip
    assert found.verdicts
    assert ([each.kind.value for each in found.warnings][:1] == ["unit_not_in_file"]) is said
