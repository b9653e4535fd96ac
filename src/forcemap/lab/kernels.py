"""The course of many impacts, compiled: a twin of `course`, the same steps in the same order, impact by impact.

The exponentials of the reaction stay numpy's: an impact is stepped until its robot notices the collision, and from
there on in stretches for which they are computed beforehand. So forces are those of `course` bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from forcemap.arrays import FloatArray, Indices
from forcemap.compiled import kernel
from forcemap.lab.course import FALLEN, STEP, ImpactSetup, force_course, phase_one_peaks
from forcemap.lab.reaction import Reaction

LEAST = 600_000
"""Impacts x steps from which numba is loaded and used. A choice: 125 impacts of 1 s, a quarter of a second in numpy."""

_AT_ONCE = 65_536  # impacts x steps for which exponentials are computed at once
_STRETCH = (16, 512)  # steps of a stretch, at least and at most


def many_courses(setup: ImpactSetup, speed: FloatArray, *, duration: float, step: float = STEP) -> FloatArray:
    """`force_course`, of many impacts by a kernel where numba is installed."""
    times = round(duration / step) + 1
    if run := _kernel(speed.size * times):
        force = np.empty((times, speed.size))
        _step_on(run, setup, speed, step, times, force)
        if np.isfinite(force).all():
            return force
    return force_course(setup, speed, duration=duration, step=step)


def many_peaks(setup: ImpactSetup, speed: FloatArray, *, step: float = STEP, longest: float = 1.0) -> FloatArray:
    """`phase_one_peaks`, of many impacts by a kernel where numba is installed."""
    times = round(longest / step)
    if run := _kernel(speed.size * times):
        peak = _step_on(run, setup, speed, step, times, np.empty((0, speed.size)))
        if np.isfinite(peak).all():
            return peak
    return phase_one_peaks(setup, speed, step=step, longest=longest)


def _kernel(impact_steps: int) -> Callable[..., None] | None:
    return kernel(_course, "F1 F1 F2 F3 F2 I1 I1 F4 F2") if impact_steps >= LEAST else None


def _step_on(
    run: Callable[..., None], setup: ImpactSetup, speed: FloatArray, step: float, times: int, force: FloatArray
) -> FloatArray:
    """Fill the forces, shape (times, batch), or, if there are no rows to fill, step past the peaks; gives the peaks."""
    robot, reaction = setup.impactor, setup.reaction
    keep = math.exp(-step / reaction.torque_filter)
    constants = _constants(setup, step, keep)
    now = np.add.accumulate(np.concatenate([[0.0], np.full(times, step)]))  # rounded as a sum step by step
    gained = np.broadcast_to(step / setup.body_mass, speed.shape)  # rate of a free body part, per force
    figures = np.column_stack([speed, (1 - keep) * robot.joint_lever, gained])
    modes = _modes(setup, speed, step)
    state = np.zeros((speed.size, 9))  # path, pad, torque, depth, force, when the reaction begins, peak, body, its rate
    begun = state[:, 5]
    begun[:] = np.inf
    at = np.zeros(speed.size, dtype=np.int64)
    which, factors = np.arange(speed.size), np.zeros((1, 1, 2, 3))
    while which.size:
        run(constants, now, figures, modes, state, at, which, factors, force)
        which = np.flatnonzero(at < times)
        stretch = int(np.clip(_AT_ONCE // max(which.size, 1), *_STRETCH))
        steps = np.minimum(at[which, None] + np.arange(stretch), times - 1)
        since = np.stack([now[steps], now[steps + 1] - step / 2], axis=-1) - begun[which, None, None]
        factors = _factors(reaction, since)
    return state[:, 6].copy()


def _constants(setup: ImpactSetup, step: float, keep: float) -> FloatArray:
    contact, reaction = setup.contact, setup.reaction
    total = contact.device_stiffness + contact.pad_stiffness
    return np.array(
        [
            *(step, contact.device_stiffness, contact.device_stiffness / total),
            math.exp(-step * total / contact.pad_damping),
            math.exp(-step * contact.pad_stiffness / contact.pad_damping),
            *(keep, reaction.threshold, reaction.delay),
            *(reaction.retreat_speed, reaction.yielding, reaction.hold_force, FALLEN),
        ]
    )


def _modes(setup: ImpactSetup, speed: FloatArray, step: float) -> FloatArray:
    """What the steps need of every mode, shape (batch, 11, n); the last two are its motion and its rate."""
    robot, w, z = setup.impactor, 2 * np.pi * setup.servo.frequency, setup.servo.damping
    spring, damper = robot.shares * w**2, robot.shares * (2 * z * w)
    pulls = spring, spring * robot.approach, damper * robot.approach, robot.shares * robot.levers, robot.levers
    first = 1 - step / 2 * damper, step / 2 * np.ones_like(damper)
    whole = (1 - step / 2 * damper) / (1 + step / 2 * damper), step / (1 + step / 2 * damper)
    return np.stack([*pulls, *first, *whole, np.zeros_like(spring), robot.approach * speed]).transpose(2, 0, 1).copy()


def _factors(reaction: Reaction, since: FloatArray) -> FloatArray:
    """What the force does not change in a commanded speed: fading to the retreat, fading after it, whether it began."""
    backing = np.minimum(np.maximum(since, 0.0), reaction.retreat_time)
    after = np.maximum(since - reaction.retreat_time, 0.0)
    factors = np.empty((*since.shape, 3))
    for number, part in enumerate((backing, after)):
        np.exp(part / -reaction.time_constant, out=factors[..., number])
    factors[..., 2] = since > 0
    return factors


def _course(
    constants: FloatArray,
    now: FloatArray,
    figures: FloatArray,
    modes: FloatArray,
    state: FloatArray,
    at: Indices,
    which: Indices,
    factors: FloatArray,
    force: FloatArray,
) -> None:
    """Step impacts until they are over, their robots notice, or the factors are used up."""
    step, device, resting, in_contact, alone, keep, threshold, delay, retreat, yielding, held, fallen = constants
    for number in range(which.size):
        impact = which[number]
        m = modes[impact]
        speed, noticing, gained = figures[impact]
        path, pad, torque, depth, push, begun, peak, body, body_rate = state[impact]
        k, stop, reacting = at[impact], now.size - 1, begun < math.inf
        if reacting:
            stop = min(stop, k + factors.shape[1])
        commanded = halfway = -retreat + (speed + retreat) * 1.0
        begin = k
        while k < stop:
            if force.shape[0]:
                force[k, impact] = push
            elif push >= fallen * peak:
                peak = max(peak, push)
            else:
                k = now.size - 1
                break
            if reacting:
                f = factors[number, k - begin]
                hold = yielding * (held - push) * f[0, 2]
                commanded = ((-retreat + (speed + retreat) * f[0, 0]) - hold) * f[0, 1] + hold
                hold = yielding * (held - push) * f[1, 2]
                halfway = ((-retreat + (speed + retreat) * f[1, 0]) - hold) * f[1, 1] + hold
            before = 7 if k else 5
            previous, depth = depth, 0.0
            for j in range(m.shape[1]):
                pull = m[1, j] * path + m[2, j] * commanded - m[0, j] * m[9, j] - m[3, j] * push
                m[10, j] = m[before, j] * m[10, j] + m[before + 1, j] * pull
                m[9, j] = m[9, j] + step * m[10, j]
                depth += m[4, j] * m[9, j]
            path += step * halfway
            body_rate += gained * push
            body += step * body_rate
            depth -= body
            mean = (previous + depth) / 2
            rest = mean * resting if mean > pad else 0.0
            pad = rest + (pad - rest) * (in_contact if mean > pad else alone)
            push = 0.0 if depth - pad <= 0 else device * (depth - pad)
            noticed, torque = torque, keep * torque + noticing * push
            k += 1
            if not reacting and torque > threshold:
                begun = now[k] - step + (threshold - noticed) / (torque - noticed) * step + delay
                break
        at[impact] = k
        state[impact] = path, pad, torque, depth, push, begun, peak, body, body_rate
