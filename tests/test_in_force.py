"""A release is in force only where an independent model says so, whatever the history and the clock."""

from __future__ import annotations

import dataclasses
import datetime
import random

import pytest

from forcemap.findings import FindingKind
from forcemap.register.in_force import DEVICE, KINDS, Fact, Released, Withdrawal, failed
from sizes import FULL_SIZE

CONDITIONS = tuple(kind for kind in KINDS if kind != DEVICE)
CASES = 200_000 if FULL_SIZE else 4_000


def time(tick):
    """A time of the register; ticks are hours."""
    return f"2026-03-{1 + tick // 24:02d}T{tick % 24:02d}:00:00.000000Z"


GOOD = Released(
    entry=20,
    at=time(240),
    valid_until="2026-03-20",
    conditions=dict.fromkeys(KINDS, "a"),
    areas="chest",
    campaign=1,
    measured_from="2026-03-01",
    measured_on="2026-03-01",
    calibrated="2026-01-01",
    calibrated_until="2026-12-31",
    device_spring=75e3,
    area_spring=25e3,
)
KNOWN = [Fact(kind, "a", time(24), 1) for kind in KINDS]


def kinds_of(release=GOOD, facts=KNOWN, withdrawals=(), now="2026-03-13T12:00:00.000000Z", **also):
    return {finding.kind for finding in failed(release, facts, withdrawals, now=now, **{"replaced_by": None} | also)}


def test_it_is_in_force_where_nothing_speaks_against_it():
    assert kinds_of() == set()
    assert kinds_of(now="2026-03-20T23:59:59.999999Z") == set()
    assert kinds_of(facts=[*KNOWN, Fact(DEVICE, "another", time(260), 21)]) == set()
    history = Fact("tool", "b", "2026-02-28T12:00:00.000000Z", 22)  # entered later, of a day before it was measured
    assert kinds_of(facts=[*KNOWN, history]) == set()
    days = dataclasses.replace(GOOD, measured_on=time(8 * 24)[:10])
    others, shown = [fact for fact in KNOWN if fact.kind != "tool"], tool("a", 0, 2, GOOD.campaign)
    for facts in (
        [tool("b", -4, 1), shown],
        [tool("b", -4, 1), shown, tool("a", 3, 3, 2), tool("a", 5, 4)],  # another campaign showed it before
        [tool("b", -4, 1), shown, tool("a", 3, 3, 2), tool("a", 5, 21)],
        [shown, tool("b", 4, 3), tool("a", 4, 4)],  # put right before the release
        [tool("b", -4, 1), shown, tool("a", 3, 3), tool("a", 0, 4)],  # stated of a later day, then of the first
    ):
        assert kinds_of(days, facts=[*others, *facts]) == set()


def tool(value, day, entry, campaign=None):
    """A fact of the tool, so many days after the first one of the measurements."""
    since = datetime.date(2026, 3, 1) + datetime.timedelta(days=day)
    return Fact("tool", value, f"{since}T12:00:00.000000Z", entry, campaign)


K = FindingKind
NINE_DAYS = {"measured_on": time(8 * 24)[:10]}
ALONE = {
    "changed and back between the days": (
        K.RELEASE_CHANGED_WHILE_MEASURED,
        NINE_DAYS | {"more": [tool("b", 3, 2), tool("a", 5, 3)]},
    ),
    "the same, and only now told": (
        K.RELEASE_CONDITION_CHANGED,
        NINE_DAYS | {"more": [tool("b", 3, 21), tool("a", 5, 22)]},
    ),
    "changed between the days, whatever the campaign shows of its first": (
        K.RELEASE_CHANGED_WHILE_MEASURED,
        NINE_DAYS | {"more": [tool("b", -4, 1), tool("a", 0, 2, GOOD.campaign), tool("a", 5, 3)]},
    ),
    "the same, told after the release": (
        K.RELEASE_CHANGED_WHILE_MEASURED,
        NINE_DAYS | {"more": [tool("b", -4, 1), tool("a", 0, 2, GOOD.campaign), tool("a", 5, 21)]},
    ),
    "another campaign shows another between the days": (
        K.RELEASE_CHANGED_WHILE_MEASURED,
        NINE_DAYS | {"more": [tool("b", 3, 2, 7), tool("a", 8, 3, GOOD.campaign)]},
    ),
    "not known between the days": (
        K.RELEASE_CONDITION_UNKNOWN,
        NINE_DAYS | {"more": [tool(None, 3, 2), tool("a", 5, 3)]},
    ),
    "the first day not known": (
        K.RELEASE_CHANGED_WHILE_MEASURED,
        {"measured_from": None, "calibrated": None, "more": [tool("b", -4, 1), tool("a", 0, 2)]},
    ),
    "the first day not known, and calibrated from one on": (
        K.RELEASE_CALIBRATION_UNKNOWN,
        {"measured_from": None, "calibrated": "2026-01-01"},
    ),
    "calibrated between the days": (K.RELEASE_CALIBRATION_OVER, NINE_DAYS | {"calibrated": "2026-03-02"}),
    "withdrawn, whatever the clock says": (K.RELEASE_WITHDRAWN, {"withdrawals": [Withdrawal("x", time(400), "y")]}),
    "replaced": (K.RELEASE_REPLACED, {"replaced_by": 7}),
    "over": (K.RELEASE_OVER, {"now": "2026-03-21T00:00:00.000000Z"}),
    "end unknown": (K.RELEASE_END_UNKNOWN, {"valid_until": None}),
    "ahead": (K.RELEASE_AHEAD, {"now": time(239)}),
    "time unknown": (K.RELEASE_AHEAD, {"at": ""}),
    "changed": (K.RELEASE_CONDITION_CHANGED, {"more": [Fact("tool", "b", time(260), 21)]}),
    "changed and back": (
        K.RELEASE_CONDITION_CHANGED,
        {"more": [Fact("tool", "b", time(260), 21), Fact("tool", "a", time(261), 22)]},
    ),
    "changed in the same moment": (K.RELEASE_CONDITION_CHANGED, {"more": [Fact("tool", "b", time(240), 21)]}),
    "another one then, told later": (K.RELEASE_CONDITION_CHANGED, {"more": [Fact("tool", "b", time(100), 21)]}),
    "changed and back, stated of a day": (
        K.RELEASE_CONDITION_CHANGED,
        {"more": [Fact("tool", "b", time(240)[:11] + "00", 21), Fact("tool", "a", time(240)[:11] + "00", 22)]},
    ),
    "of the day of the measurements, told later": (
        K.RELEASE_CONDITION_CHANGED,
        {"more": [Fact("tool", "b", time(2), 21)]},
    ),
    "of one day, told last": (K.RELEASE_CONDITION_CHANGED, {"more": [Fact("tool", "b", time(24), 3)]}),
    "of one day, told last but stated of its beginning": (
        K.RELEASE_CONDITION_CHANGED,
        {"more": [Fact("tool", "b", "2026-03-02T00:00:00.000000Z", 3)]},
    ),
    "entered again": (K.RELEASE_CAMPAIGN_CHANGED, {"entered_again": time(260)}),
    "two of one moment": (K.RELEASE_CONDITION_CHANGED, {"more": [Fact("tool", "b", time(24), 1)]}),
    "the same, read first": (K.RELEASE_CONDITION_CHANGED, {"facts": [Fact("tool", "b", time(24), 1), *KNOWN]}),
    "ahead of the clock": (K.RELEASE_CONDITION_CHANGED, {"more": [Fact("tool", "b", time(500), 21)]}),
    "not known since": (K.RELEASE_CONDITION_UNKNOWN, {"more": [Fact("tool", None, time(260), 21)]}),
    "not known then": (K.RELEASE_CONDITION_UNKNOWN, {"facts": [f for f in KNOWN if f.kind != "covers"]}),
    "not measured under": (K.RELEASE_CONDITION_UNKNOWN, {"conditions": dict(GOOD.conditions) | {"program": None}}),
    "device unknown": (K.RELEASE_CONDITION_UNKNOWN, {"conditions": dict(GOOD.conditions) | {DEVICE: None}}),
    "calibration over": (K.RELEASE_CALIBRATION_OVER, {"calibrated_until": "2026-02-28"}),
    "calibrated later": (K.RELEASE_CALIBRATION_OVER, {"calibrated": "2026-03-02"}),
    "measured later": (K.RELEASE_CALIBRATION_OVER, {"measured_on": "2026-03-12"}),
    "day unknown": (K.RELEASE_CALIBRATION_UNKNOWN, {"measured_on": None}),
    "calibration unknown": (K.RELEASE_CALIBRATION_UNKNOWN, {"calibrated_until": None}),
    "spring too soft": (K.SPRING_TOO_SOFT, {"area_spring": 84e3}),
    "spring of the device unknown": (K.SPRING_OF_DEVICE_NOT_STATED, {"device_spring": None}),
    "spring of the area unknown": (K.SPRING_OF_AREA_UNKNOWN, {"area_spring": None}),
}


@pytest.mark.parametrize("case", ALONE)
def test_each_reason_alone_ends_it_and_is_said(case):
    expected, changes = ALONE[case]
    changes = dict(changes)
    facts = changes.pop("facts", KNOWN) + changes.pop("more", [])
    asked = {
        name: changes.pop(name) for name in ("withdrawals", "replaced_by", "entered_again", "now") if name in changes
    }
    found = kinds_of(dataclasses.replace(GOOD, **changes), facts, **asked)
    assert found == {expected} or (expected in found and case == "time unknown")


VALUES = ("a", "a", "a", "b", None)
DAYS = (None, "2026-02-28", "2026-03-01", "2026-03-10", "2026-03-11", "2026-12-31")
SPRINGS = (None, 25e3, 60e3, 75e3, 84e3, 150e3)


def random_history(rng):
    """A release, facts of its cell, withdrawals, what replaces it, and the time; every second one is nearly good."""
    some = rng.random() < 0.5
    kinds = [kind for kind in CONDITIONS if some or rng.random() < 0.95]
    facts = [Fact(kind, "a", time(24), 1) for kind in kinds]
    for _ in range(rng.choice((0, 0, 1, 2, 5))):
        entry = rng.choice([number for number in range(2, 41) if number != 20])
        tick, shown = 225 + rng.randrange(40), rng.choice((None, None, GOOD.campaign, 2))
        facts.append(Fact(rng.choice(CONDITIONS[:3]), rng.choice(VALUES), time(tick), entry, shown))
    conditions = dict.fromkeys(KINDS, "a")
    changes = {"conditions": conditions, "valid_until": rng.choice(("2026-03-11", "2026-03-20", "2026-03-20"))}
    if not some:
        conditions[rng.choice(CONDITIONS[:2])] = rng.choice(VALUES)
        changes |= {
            "measured_on": rng.choice(DAYS),
            "calibrated": rng.choice(DAYS),
            "calibrated_until": rng.choice(DAYS),
        }
        changes |= {"device_spring": rng.choice(SPRINGS), "area_spring": rng.choice(SPRINGS)}
        changes["valid_until"] = rng.choice(("2026-03-11", "2026-03-20", None))
    if rng.random() < 0.5:
        changes["measured_on"] = rng.choice(("2026-03-10", "2026-03-11"))
        changes["measured_from"] = rng.choice((None, "2026-03-01", "2026-03-09", "2026-03-10"))
    changes.setdefault("measured_from", changes.get("measured_on", GOOD.measured_on))
    withdrawals = [Withdrawal("x", time(1), "y")] * (rng.random() < 0.1)
    replaced_by = 3 if rng.random() < 0.1 else None
    return dataclasses.replace(GOOD, **changes), facts, withdrawals, replaced_by, time(rng.randrange(236, 300))


def test_never_in_force_where_the_model_says_not():
    rng, in_force = random.Random(21), 0
    for _ in range(CASES):
        release, facts, withdrawals, replaced_by, now = random_history(rng)
        rng.shuffle(facts)
        found = failed(release, facts, withdrawals, replaced_by=replaced_by, now=now)
        assert (not found) == modelled(release, facts, withdrawals, replaced_by, now), (release, facts, now)
        in_force += not found
    assert in_force > CASES / 50


def modelled(release, facts, withdrawn, replaced_by, now):
    """A second opinion: the audit trail is walked through as written; what was told of a day is kept by the day."""
    if withdrawn or replaced_by is not None or now < release.at:
        return False
    if release.valid_until is None or now[:10] > release.valid_until:
        return False
    first, last = release.measured_from or "", release.measured_on or ""
    for kind in CONDITIONS:
        if changed_between(kind, release, facts, first, last):
            return False
        days = {}  # what was told of each day before the release, the last told at the end
        for number in range(42):
            told = [fact for fact in facts if fact.kind == kind and fact.entry == number]
            if number > release.entry:
                told = [fact for fact in told if fact.since[:10] >= first]
                if any(fact.value is None or fact.value != release.conditions[kind] for fact in told):
                    return False
                continue
            for day in {fact.since[:10] for fact in told}:
                days[day] = {fact.value for fact in told if fact.since[:10] == day}
        measured = [values for day, values in days.items() if first <= day <= last]
        if not days or any(values != {release.conditions[kind]} for values in (*measured, days[max(days)])):
            return False
        if release.conditions[kind] is None:
            return False
    if None in (release.measured_on, release.calibrated_until, release.device_spring, release.area_spring):
        return False
    if release.calibrated is not None and not release.calibrated <= first <= release.measured_on:
        return False
    calibrated = release.measured_on <= release.calibrated_until and release.measured_on <= "2026-03-11"
    return calibrated and release.device_spring >= 0.9 * release.area_spring


def changed_between(kind, release, facts, first, last):
    """Whether a person says of a day after the first and up to the last one that it is other than on the day before,
    as all but the release's own campaign have it."""
    held = {}  # the last told of each day
    for fact in sorted(facts, key=lambda fact: fact.entry):
        if fact.kind == kind and fact.campaign != release.campaign:
            held[fact.since[:10]] = fact
    for day, fact in held.items():
        earlier = [other for other in held if other < day]
        if first < day <= last and fact.campaign is None and earlier and held[max(earlier)].value != fact.value:
            return True
    return False


def test_whatever_the_clock_does_a_cell_that_has_changed_has_none_in_force():
    """Every change of the tool is entered at once; the clock between two steps jumps both ways."""
    rng = random.Random(22)
    for _ in range(CASES // 4):
        clock, newest, entry, tool, released, changed = 200, 0, 1, "a", None, False
        facts = [Fact(kind, "a", time(24), 1) for kind in KINDS]
        for _ in range(rng.randrange(1, 12)):
            clock = max(48, clock + rng.randrange(-30, 31))
            newest = max(newest, clock)  # the register's time: never before its newest entry
            entry += 1
            step = rng.choice(("change", "change", "release", "wait"))
            if step == "change":
                value = rng.choice("ab")
                facts.append(Fact("tool", value, time(newest), entry))
                changed, tool = changed or value != tool, value
            elif step == "release":
                stated = {"conditions": dict.fromkeys(KINDS, "a") | {"tool": tool}, "at": time(newest)}
                released = dataclasses.replace(GOOD, **stated, entry=entry, valid_until="2099-01-01")
                changed = False
            if released:
                found = failed(released, facts, (), replaced_by=None, now=time(newest))
                assert (not found) == (not changed)
