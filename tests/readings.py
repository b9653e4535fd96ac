"""Curves of every kind that the reading of impacts tells apart, each swept across where it does: what is read of them.

Where a threshold lies was tried, and no theory says it: tests/readings.csv holds what was read when it was chosen.
tests/edges.csv holds on either side of which shares other words were read of the same curve: other flags, another
scenario; where processors differ in which share that is, the two lie further apart. Whoever changes a rule on purpose
writes both anew (`python tests/readings.py`) and looks at what changed.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import itertools
import re
from pathlib import Path

import numpy as np

import forcemap as fm
import recorded
from curves import SHAPES, arch
from forcemap.impacts.detect import force_without_impact, no_impact

TABLE = Path(__file__).with_suffix(".csv")
EDGES = Path(__file__).with_name("edges.csv")
SEED, EDGE_CURVES = 202690, 16
ASIDE, NEAR = 0.002, (-0.0015, -0.001, 0.001, 0.002, 0.004)
"""How far from a change of words they are compared; where else they must be the same, by distance from there."""
DEVICE = fm.Device(range=500.0, error=3.0, stiffness=75e3)


def base(rng, *, rate=None, noise=None, shape=None, duration=None, before=0.15, after=0.8):
    """Time since contact [s] and the force that is read [N], of a shape drawn."""
    rate, noise = rate or rng.choice([500.0, 1000.0, 2000.0]), rng.uniform(0, 1) if noise is None else noise
    shape = SHAPES[rng.integers(len(SHAPES))] if shape is None else SHAPES[shape]
    drawn = shape(rng, rng.uniform(60, 400), duration or rng.uniform(0.012, 0.05), noise)
    time = np.arange(-round(before * rate), round(after * rate)) / rate + rng.uniform(0, 1 / rate)
    force = drawn.force(time) + rng.normal(0, noise, time.size)
    return time, np.round(force, 1) if rng.uniform() < 0.3 else force


def top(time, force):
    return int(np.where(time < 0.06, force, -np.inf).argmax())


def plain(rng, share):
    return base(rng, noise=3.0 * share)


def cut_off(rng, share):
    time, force = base(rng, shape=rng.integers(5), rate=5000.0 if share < 0.5 else None, after=0.5)
    ceiling = (0.999 - 0.7 * share * rng.uniform()) * force.max()
    return time, np.minimum(force, ceiling) + rng.normal(0, rng.choice([0.0, 0.3]), time.size)


def few_samples(rng, share):
    return base(rng, rate=np.round(100.0 * 12.0**share), duration=0.02, noise=0.2)


def spike(rng, share):
    time, force = base(rng, rate=2000.0, noise=0.3, shape=rng.integers(3))
    at = top(time, force) + rng.integers(-15, 20)
    force[at : at + rng.integers(1, 5)] += rng.choice([-1, 1]) * 0.6 * share**2 * force.max()
    return time, force


def lost(rng, share):
    time, force = base(
        rng, rate=rng.choice([2000.0, 5000.0]), noise=0.2, duration=0.03, shape=rng.integers(4), after=0.4
    )
    kept = np.abs(time - 0.015 - rng.uniform(-0.006, 0.006)) > 0.01 * share
    return time[: kept.sum()], force[kept]


def stuck(rng, share):
    time, force = base(rng, rate=2000.0, noise=rng.choice([0.0, 0.3]), duration=0.03, shape=rng.integers(4), after=0.4)
    first = top(time, force) - rng.integers(0, 25)
    force[first : first + 1 + int(50 * share**2)] = force[first]
    return time, force


def hum(rng, share):
    time, force = base(rng, noise=0.3, rate=2000.0, shape=rng.integers(2), before=0.25)
    swing = np.sin(2 * np.pi * rng.choice([50.0, 60.0, 23.0]) * time + rng.uniform(0, 6))
    return time, force + 0.15 * share * force.max() * swing


def drift(rng, share):
    time, force = base(rng, noise=0.3 * rng.integers(0, 4), before=rng.choice([0.02, 0.1, 0.4]))
    return time, force + 40.0 * share**2 * rng.choice([-1, 1]) * time + rng.uniform(-60, 60) * (share > 0.7)


def unquiet(rng, share):
    time, force = base(rng, noise=0.4, before=0.5)
    return time, force + rng.uniform(3, 30) * arch(time, 0.45 * share + 0.01, -0.5 + rng.uniform(0, 0.03))


def gap(rng, share):
    time, force = base(rng, rate=1000.0, noise=0.2)
    start = rng.choice([rng.uniform(0, 0.02), rng.uniform(0.02, 0.6)])
    kept = (time < start) | (time > start + 0.07 * share**2)
    return time[kept], force[kept]


def ends_early(rng, share):
    return base(rng, rate=2000.0, after=0.004 * 220.0**share, noise=0.3)


def begins_late(rng, share):
    return base(rng, rate=rng.choice([1000.0, 5000.0]), before=0.001 + 0.04 * share, noise=0.5, after=0.6)


def three_components(rng, share):
    time, force = base(rng, noise=0.0, rate=1000.0)
    angle = 0.6 * share
    axes = np.outer(force, [np.sin(angle), 0.0, np.cos(angle)])
    return time, axes + rng.normal(0, 0.3, axes.shape) + rng.uniform(-9, 9, 3)


def force_before(rng, share):
    time, force = base(rng, noise=0.4, before=0.4)
    return time, force + 60.0 * share**1.5 * arch(time, rng.uniform(0.02, 0.2), -0.3)


def pulls(rng, share):
    time, force = base(rng, noise=0.4, shape=rng.integers(3))
    return time, (force - force.max() * 0.8 * share * arch(time, 0.05, 0.06)) * (1 if share < 0.9 else -1)


def second_impact(rng, share):
    time, force = base(rng, noise=0.3, shape=rng.integers(3), after=1.8, rate=1000.0)
    return time, force + rng.uniform(0.3, 1.3) * force.max() * arch(time, 0.03, 0.06 + 0.9 * share)


def rings(rng, share):
    time, force = base(rng, noise=0.2, rate=5000.0, shape=rng.integers(2), duration=0.03, after=0.3)
    return time, force * (1 + 0.3 * share * np.sin(2 * np.pi * rng.uniform(100, 350) * time))


def held(rng, share):
    time, force = base(rng, noise=0.2 + share, shape=0, rate=1000.0, after=1.0)
    level = (2.0 + 40.0 * rng.uniform() ** 2) * np.exp(-np.maximum(time - 0.05, 0) * 6.0 * share)
    return time, np.maximum(force, level * (time > 0.01)) + rng.normal(0, 0.2, time.size)


def tail(rng, share):
    time = np.arange(-800, 4000) / 10_000.0
    rise, falls = 45.0 * np.clip(time / 0.003, 0, 1), 45.0 * np.clip((0.01 + 0.05 * share - time) / 0.038, 0, 1)
    return time, np.minimum(np.sin(rise / 45 * np.pi / 2) * 45, falls) + 60.0 * arch(time, 0.02, 0.07)


def hard(rng, share):
    rate = rng.choice([20_000.0, 50_000.0])
    return base(rng, rate=rate, noise=0.2, shape=rng.integers(2), duration=1e-4 * 40**share, before=0.02, after=0.04)


def no_contact(rng, share):
    time, force = base(rng, noise=0.5)
    return time, 0.1 * share * force / force.max() * 150.0


def valley(rng, share):
    """Two humps of which the second stands out of the noise more and more."""
    time = np.arange(-300, 1200) / 2000.0
    noise = rng.uniform(2.5, 4.0)
    force = 90.0 * arch(time, 0.04) + (3.0 + 6.0 * share) * noise * arch(time, 0.03, 0.045) + 20.0 * arch(time, 0.1)
    return time, force + rng.normal(0, noise, time.size)


def gap_to_the_end(rng, share):
    """Samples missing from within the contact until it is over."""
    time, force = base(rng, rate=2000.0, noise=0.2, shape=0, duration=0.03)
    start = 0.0285 + 0.004 * share
    kept = (time < start) | (time > start + 0.03)
    return time[kept], force[kept]


def whole_numbers(rng, share):
    """Readings of whole newtons, at rest none, on a binary clock: what a rule compares is often equal."""
    peak = rng.choice([20, 50, 100, 200, 400])
    shares = (0.0, 0.1, 0.12, 0.25, 0.3, 0.5, 0.75, 0.8, 0.88, 0.9, 1.0)
    levels = [0, 0, 4, 5, 6, 10, -10, -10, -np.round(0.5 * peak), *(np.round(each * peak) for each in shares)]
    knots, force = [0, peak, *rng.choice(levels, rng.integers(2, 7))], [np.zeros(rng.choice([4, 10, 64, 200]))]
    for low, high in itertools.pairwise(knots):
        samples = rng.choice([1, 2, 4, 8, 12, 16, 25, 50, 100])
        bow = rng.choice([0.0, 0.3, 0.3]) * (high - low) * np.sin(np.pi * np.arange(samples) / samples)
        force.append(np.round(low + (high - low) * np.arange(samples) / samples + bow))
        force.append(np.full(rng.choice([1, 1, 1, 2, 3, 4, 8, 20, 51, 205]), high))
    force.append(np.full(round(rng.choice([2, 20, 512, 717, 900]) * share) + 1, knots[-1]))
    force = np.concatenate(force).astype(float)
    return np.arange(-100, force.size - 100) / rng.choice([512, 1024, 2048]), force


def slow(rng, share):
    """Forces that come too slowly for an impact, or hardly."""
    time = np.arange(-400, 800) / 1000.0
    force = rng.choice([6.0, 12.0, 40.0, 150.0]) * np.clip(time / (0.6 - 0.5 * share), 0, 1) * rng.choice([-1, 1])
    noise = rng.normal(0, rng.choice([0.0, 0.3, 2.0]), time.size)
    if rng.uniform() < 0.6:
        return time, force + noise + 7.0
    return time, np.outer(force, rng.dirichlet([1, 1, 1])) + rng.normal(0, 0.5, (time.size, 3)) + [5.0, -8.0, 0.0]


def tent(rng, share):
    """Two slopes that meet between two samples, rounder or sharper, on a force that rings."""
    time = np.arange(-300, 900) / rng.choice([1000.0, 2000.0, 5000.0])
    rise, fall = rng.uniform(0.004, 0.02, 2)
    round_off = rng.choice([0.0, 0.0, 0.002]) + 1e-6
    away = np.minimum(np.where(time < rise, rise - time, (time - rise) * rise / fall) / rise, 1.2)
    force = np.clip(1.0 - np.hypot(away, round_off / rise) * (1.0 - 0.3 * rng.uniform() * share * away), 0, None)
    force = force + rng.choice([0.0, 0.4]) * np.clip(1 - np.abs(time - rise - 2 * fall) / fall / 2, 0, 1) * share
    ringing = 1 + 0.15 * share * rng.integers(0, 2) * np.sin(2 * np.pi * rng.uniform(100, 400) * time)
    return time, rng.uniform(60, 400) * force * ringing + rng.normal(0, rng.choice([0.0, 0.2, 1.0]), time.size)


def spoilt(rng, what, time, force, k, much, some):
    """A force to which one thing is done, about sample k."""
    force, peak, sign = force.copy(), force.max(), rng.choice([-1, 1])
    if what == 0:
        force = np.minimum(force, (1 - 0.6 * much) * peak)
    elif what == 1:
        for at in (k, k + some, k + 3 * some)[: rng.integers(1, 4)]:
            force[at : at + int(rng.integers(1, 4))] += sign * much * peak
    elif what == 2:
        for at in (k, k + 4 * some):
            force[at : at + some + int(20 * much)] = force[at]
    elif what == 3:
        force[k:] += 0.4 * much * peak * sign
    elif what == 4:
        force = np.round(force / (1 + 12 * much)) * (1 + 12 * much)
    elif what == 5:
        force += 0.15 * much * peak * np.sin(2 * np.pi * rng.choice([50.0, 60.0, 11.0, 120.0]) * time)
    elif what == 6:
        force += 130 * much * sign
    elif what == 7:
        force += rng.uniform(0.2, 1.3) * peak * arch(time, rng.uniform(0.01, 0.2), 0.8 * much)
    elif what == 8:
        force += 30 * much * sign * time
    return force


def mixed(rng, share):
    """Several things at once, on devices of any range."""
    rate = rng.choice([500.0, 1000.0, 2000.0, 5000.0])
    time, force = base(rng, rate=rate, noise=rng.choice([0.0, 0.2, 1.0]), before=rng.choice([0.01, 0.03, 0.2, 0.5]))
    kept, options = np.ones(time.size, bool), {}
    for what in rng.permutation(12)[: rng.integers(1, 4)]:
        k = np.clip(top(time, force) + rng.integers(-15, 25), 1, time.size - 30)
        much, some = share * rng.uniform(), int(rng.integers(1, 6))
        force = spoilt(rng, what, time, force, k, much, some)
        if what == 9:
            time = time + rng.uniform(-0.45, 0.45, time.size) * much / rate
        elif what == 10:
            kept &= time < rng.choice([0.02, 0.1, 0.55, 0.65]) + 0.2 * much
        elif what == 11:
            kept[k : k + int(1 + 30 * much)] = False
    time, force = time[kept], force[kept]
    options["device"] = fm.Device(range=rng.choice([np.nan, 150.0, 300.0, 1000.0]), error=3.0, stiffness=75e3)
    if rng.uniform() < 0.15:
        options["beyond_range"] = force >= (1 - 0.3 * share * rng.uniform()) * force.max()
    if rng.uniform() < 0.3:
        angle = 0.6 * share * rng.uniform()
        force = np.outer(force, [0.0, np.sin(angle), np.cos(angle)]) + rng.normal(0, 0.2, (force.size, 3))
        options["direction"] = rng.choice([None, 1])
    return time, force, options


def begins_within(rng, share):
    """A recording that begins on the rise."""
    time, force = base(rng, noise=0.3, duration=0.03, rate=rng.choice([1000.0, 2000.0, 5000.0]))
    first = np.argmax((force > 0.9 * share * force[time < 0.03].max()) & (time > 0))
    return time[first:], force[first:]


def few_equal(rng, share):
    """Few readings in fine or coarse steps, some of them equal, anywhere in the contact."""
    rate, step = rng.choice([300.0, 500.0, 800.0, 2000.0]), rng.choice([0.01, 0.1, 1.0])
    time, force = base(rng, rate=rate, noise=rng.choice([0.0, 0.8]), duration=0.04, shape=rng.integers(1, 5))
    first = top(time, force) + rng.integers(-6, 40)
    force[first : first + 2 + int(8 * share)] = force[first]
    return time, np.round(force / step) * step


def two_jumps(rng, share):
    time, force = base(rng, rate=rng.choice([2000.0, 5000.0]), noise=0.2, duration=0.04, shape=rng.integers(0, 4))
    first = top(time, force) - rng.integers(-5, 40)
    for at, part in zip((first, first + rng.integers(2, 30)), rng.uniform(-0.35, 0.35, 2), strict=True):
        force[at:] += share * part * force.max()
        force[at : at + rng.integers(0, 4)] += share * rng.choice([0.0, 0.5]) * force.max()
    return time, force


def ragged(rng, share):
    """Spikes of several samples of different height, or several of them, in a row or apart."""
    time, force = base(rng, rate=2000.0, noise=0.2, duration=0.04, shape=rng.integers(3))
    first = top(time, force) + rng.integers(-25, 30)
    for _ in range(rng.integers(1, 3)):
        samples = rng.integers(2, 5)
        force[first : first + samples] += rng.uniform(-1, 1, samples) * share * force.max()
        first += rng.integers(3, 12)
    return time, force


def three_rounded(rng, share):
    """Components in steps, one of them silent, one cut off."""
    time, force = base(rng, rate=2000.0, noise=0.3, shape=rng.integers(5))
    parts = np.outer(force, [0.0, 0.6, -0.8]) + rng.uniform(-20, 20, 3)
    parts[:, rng.integers(1, 3)] = np.clip(force * rng.choice([-0.6, 0.8]), -1000.0, (1.01 - 0.5 * share) * force.max())
    return time, np.round(parts, rng.integers(0, 2))


def gaps(rng, share):
    """Two gaps anywhere, on force or at rest, until well after the time that counts."""
    time, force = base(rng, rate=1000.0, noise=0.2, after=1.1)
    force += rng.choice([0.0, 40.0]) * np.clip(time / 0.03, 0, 1)
    kept = np.ones(time.size, bool)
    for _ in range(2):
        start = rng.choice([rng.uniform(-0.01, 0.04), rng.uniform(0.0, 1.0)])
        kept &= (time < start) | (time > start + 0.1 * share * rng.uniform())
    return time[kept], force[kept]


KINDS = {
    plain: 24, cut_off: 40, few_samples: 20, spike: 24, lost: 24, stuck: 30, hum: 20, drift: 20, unquiet: 14,
    gap: 20, ends_early: 24, begins_late: 16, three_components: 16, force_before: 14, pulls: 12,
    second_impact: 16, rings: 20, held: 16, tail: 8, hard: 10, no_contact: 8, valley: 20, gap_to_the_end: 12,
    whole_numbers: 160, slow: 20, tent: 40, mixed: 160,
    begins_within: 16, few_equal: 30, two_jumps: 24, ragged: 24, three_rounded: 20, gaps: 24,
}  # fmt: skip


def recordings(kind):
    """The recordings of a kind, each with its name."""
    for i in range(KINDS[kind]):
        yield f"{kind.__name__} {i}", one(kind, i, i / (KINDS[kind] - 1), SEED)


def one(kind, number, share, seed):
    time, force, *others = kind(np.random.default_rng([seed, list(KINDS).index(kind), number]), share)
    options = {"device": DEVICE, "direction": number % 2 or None} | dict(*others)
    options["direction"] = (0.0, 0.0, 1.0) if force.ndim > 1 and options["direction"] else None
    return fm.Recording(time=time, force=force, **options)


def read(kind):
    """What is read of each recording of a kind: rows of words and figures."""
    rows = []
    for name, recording in recordings(kind):
        impacts = fm.find_impacts(recording)
        if not impacts:
            rows.append([name, no_impact(recording), f"{force_without_impact(recording):.9g}"])
        for impact in impacts:
            contact = {f"contact_{key}": getattr(impact.contact, key) for key in of(impact.contact)}
            fields = {key: getattr(impact, key) for key in of(impact)} | contact
            after, force = impact.curve()
            fields |= {"map": impact.map_force, "verdict": impact.verdict_peak_force, "samples": after.size}
            fields |= {"ends": after[-1], "mean": force.mean()}
            figures = [value if isinstance(value, str) else f"{float(value):.9g}" for value in fields.values()]
            doubts = [" ".join([flag.name, *re.findall(r"-?\d+(?:\.\d+)?", flag.figure)]) for flag in impact.flags]
            rows.append([name, *figures, impact.scenario.value, *doubts])
    return rows


def of(result):
    """The fields of a result that are figures."""
    fields = [field.name for field in dataclasses.fields(result)]
    return [name for name in fields if isinstance(getattr(result, name), bool | int | float)]


def words(kind, number, share):
    """What is read of a curve, without figures."""
    said = []
    for impact in fm.find_impacts(one(kind, number, share, SEED + 1)):
        over = ["over"] * impact.contact_over + ["after"] * impact.acts_after_phase1
        said.append([impact.scenario.value, str(impact.bounces), *over, *(flag.name for flag in impact.flags)])
    return " / ".join(" ".join(each) for each in said) or "no impact"


def edges():
    """Where the words change as the share grows: shares on either side of it, and what is read there.

    No more than two of a kind for the same change of words, and none where the words change to and fro: noise decides
    there, and processors round it differently.
    """
    found = {}
    numbers = ((kind, number) for kind in KINDS for number in range(EDGE_CURVES * (3 if kind is mixed else 1)))
    for kind, number in numbers:
        said = functools.cache(functools.partial(words, kind, number))
        for low, high in itertools.pairwise((np.arange(9) / 8).tolist()):
            while said(low) != said(high) and high - low > 1e-3:
                middle = (low + high) / 2
                low, high = (middle, high) if said(low) == said(middle) else (low, middle)
            low, high = max(low - ASIDE, 0.0), min(high + ASIDE, 1.0)
            same = (said(max(low - by, 0.0)) == said(low) and said(min(high + by, 1.0)) == said(high) for by in NEAR)
            if said(low) != said(high) and all(same):
                change = frozenset(said(low).split()) ^ frozenset(said(high).split())
                found.setdefault((kind, change), []).append([kind.__name__, number, low, high, said(low), said(high)])
    return [row for rows in found.values() for row in rows[:2]]


if __name__ == "__main__":
    found = edges()  # minutes: the file stays what it was until then
    with EDGES.open("w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(found)
    recorded.write(TABLE, [row for kind in KINDS for row in read(kind)], rtol=1e-6)
