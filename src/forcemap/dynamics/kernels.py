"""Effective mass of a robot in many postures, compiled: what `kinematics` and `effective_mass` do, to rounding.

Every inner loop runs over postures and stores one array, so that the compiler makes it one over vectors; the arrays of
a block stay in the processor's cache. Sine and cosine are numpy's.
"""

from __future__ import annotations

import math

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.compiled import kernel
from forcemap.dynamics.rigid_body import cross_matrix
from forcemap.dynamics.robot import JointKind, Robot

LEAST = 50_000
"""Postures from which numba is loaded and used. A choice: a tenth of a second in numpy."""

_BLOCK = 256  # postures at once
_NEAR = 2.0  # times the limit of what is singular: nearer to it numpy decides

# Rows of a joint: three matrices of the turn, where the frame stands in the one before, its axis, whether it slides
_ORIGIN, _AXIS, _SLIDES = 9, 10, 11
# Rows of a frame: position (3), axis (3), rotation (9, row by row)


def many_masses(robot: Robot, q: FloatArray, u: FloatArray, singular: float, least_pivot: float) -> FloatArray | None:
    """Effective masses [kg], shape (batch,), in postures (batch, n) along u; NaN where it is numpy that has to decide.

    That is where the share of the motion along u is not well above `singular`, or a pivot of the mass matrix not above
    `least_pivot` of its diagonal. None for few postures, and without numba.
    """
    if len(q) < LEAST:
        return None
    kernels = [run for function, arguments in _KERNELS.items() if (run := kernel(function, arguments))]
    if len(kernels) < len(_KERNELS):
        return None
    frames_of, motions_of, composites_of, matrix_of, solve = kernels
    joints, bodies, offset, drives = _figures(robot)
    n, value = len(joints), np.empty(len(q))
    padded, lever = np.zeros((2, n, _BLOCK))
    frames, rates, composites = (np.empty((rows, k, _BLOCK)) for rows, k in ((n + 1, 15), (n, 6), (n, 9)))
    matrix = np.empty((n, n, _BLOCK))
    size, worst, mass = np.empty((3, _BLOCK))
    for start in range(0, len(q), _BLOCK):
        part = q[start : start + _BLOCK].T
        padded[:, : part.shape[1]] = part  # behind a last part that is shorter stand postures of the one before
        frames_of(joints, padded, np.cos(padded), np.sin(padded), frames)
        motions_of(joints, frames, offset, u, rates, lever, size)
        motion = np.square(lever).sum(axis=0)
        composites_of(bodies, frames, composites)
        matrix_of(bodies[:, 0].copy(), rates, composites, matrix)
        solve(drives, least_pivot, matrix, lever, worst, mass)
        sure = (motion > (_NEAR * singular) ** 2 * size) & (worst > 0)
        value[start : start + _BLOCK] = np.where(sure, mass, np.nan)[: part.shape[1]]
    return value


def _figures(robot: Robot) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Joints, shape (n, 12, 3); bodies, (n, 13); the contact point in the last frame, (3,); drives, (n,)."""
    joints, bodies = np.zeros((len(robot.joints), 12, 3)), np.zeros((len(robot.joints), 13))
    for row, of_body, joint in zip(joints, bodies, robot.joints, strict=True):
        slides = joint.kind is JointKind.PRISMATIC
        along = np.outer(joint.axis, joint.axis)
        turn = [np.eye(3), *np.zeros((2, 3, 3))] if slides else [along, np.eye(3) - along, -cross_matrix(joint.axis)]
        row[:9] = np.concatenate(turn) @ joint.origin.rotation.T
        row[_ORIGIN], row[_AXIS], row[_SLIDES] = joint.origin.position, joint.origin.rotation @ joint.axis, slides
        body = joint.body
        of_body[:] = [body.mass, *body.centre_of_mass, *body.inertia.ravel()]
    offset = robot.flange.position + robot.flange.rotation @ robot.contact_offset
    drives = np.zeros(len(joints)) if robot.drive_inertia is None else robot.drive_inertia.values.copy()
    return joints, bodies, offset, drives


def _frames(joints: FloatArray, q: FloatArray, cos: FloatArray, sin: FloatArray, frames: FloatArray) -> None:
    """Frames of the joints after that of the base, as `posture_of`."""
    turn = np.empty((9, q.shape[1]))
    frames[0] = 0.0
    frames[0, 6], frames[0, 10], frames[0, 14] = 1.0, 1.0, 1.0
    for i in range(len(joints)):
        joint, before, after = joints[i], frames[i], frames[i + 1]
        for c in range(3):
            for k in range(3):
                row, cosine, sine = turn[3 * c + k], cos[i], sin[i]
                fixed, even, odd = joint[c, k], joint[3 + c, k], joint[6 + c, k]
                for p in range(row.size):
                    row[p] = fixed + even * cosine[p] + odd * sine[p]
        for r in range(3):
            x, y, z = before[6 + 3 * r], before[7 + 3 * r], before[8 + 3 * r]
            here, there, axis, value = before[r], after[r], after[3 + r], q[i]
            (a, b, c), (e, f, g), slides = joint[_ORIGIN], joint[_AXIS], joint[_SLIDES, 0]
            for p in range(axis.size):
                axis[p] = e * x[p] + f * y[p] + g * z[p]
            for p in range(there.size):
                there[p] = here[p] + a * x[p] + b * y[p] + c * z[p] + slides * value[p] * axis[p]
            for k in range(3):
                entry, i0, i1, i2 = after[6 + 3 * r + k], turn[3 * k], turn[3 * k + 1], turn[3 * k + 2]
                for p in range(entry.size):
                    entry[p] = i0[p] * x[p] + i1[p] * y[p] + i2[p] * z[p]


def _motions(
    joints: FloatArray,
    frames: FloatArray,
    offset: FloatArray,
    u: FloatArray,
    rates: FloatArray,
    lever: FloatArray,
    size: FloatArray,
) -> None:
    """Turning of each joint and velocity at the last; how it moves the contact point along u; squares of all."""
    n = len(joints)
    last, point = frames[n], np.empty((3, size.size))
    arm, velocity = np.empty((2, 3, size.size)), np.empty(size.size)
    for r in range(3):
        for p in range(size.size):
            point[r, p] = (
                offset[0] * last[6 + 3 * r, p] + offset[1] * last[7 + 3 * r, p] + offset[2] * last[8 + 3 * r, p]
            )
    size[:] = 0.0
    for i in range(n):
        turns, frame = 1.0 - joints[i, _SLIDES, 0], frames[i + 1]
        lever[i] = 0.0
        for r in range(3):
            rates[i, r] = turns * frame[3 + r]
            arm[0, r] = last[r] - frame[r]
            arm[1, r] = arm[0, r] + point[r]
        for r in range(3):
            s, t = (r + 1) % 3, (r + 2) % 3
            x, y, along = rates[i, s], rates[i, t], u[r]
            there, slid, here, total = rates[i, 3 + r], frame[3 + r], lever[i], size
            near, far = arm[0, t], arm[0, s]
            for p in range(there.size):
                there[p] = x[p] * near[p] - y[p] * far[p] + (1.0 - turns) * slid[p]
            near, far = arm[1, t], arm[1, s]
            for p in range(velocity.size):
                velocity[p] = x[p] * near[p] - y[p] * far[p] + (1.0 - turns) * slid[p]
            for p in range(here.size):
                here[p] += along * velocity[p]
            for p in range(total.size):
                total[p] += velocity[p] * velocity[p]


def _composites(bodies: FloatArray, frames: FloatArray, composites: FloatArray) -> None:
    """What lies beyond each joint, about the last: first moment (3 rows), inertia xx, yx, yy, zx, zy, zz (6 rows)."""
    n, batch = len(bodies), frames.shape[2]
    centre, half = np.empty((3, batch)), np.empty((3, batch))
    for i in range(n - 1, -1, -1):
        frame, body, row = frames[i + 1], bodies[i], 3
        mass, own = body[0], composites[i]
        own[:] = 0.0
        if i + 1 < n:
            own[:] = composites[i + 1]
        for r in range(3):
            x, y, z, here, there = frame[6 + 3 * r], frame[7 + 3 * r], frame[8 + 3 * r], frame[r], frames[n, r]
            c, moment = centre[r], own[r]
            for p in range(batch):
                c[p] = body[1] * x[p] + body[2] * y[p] + body[3] * z[p] + (here[p] - there[p])
            for p in range(batch):
                moment[p] += mass * c[p]
        for r in range(3):
            x, y, z = frame[6 + 3 * r], frame[7 + 3 * r], frame[8 + 3 * r]
            for k in range(3):
                a, b, e, h = body[4 + k], body[7 + k], body[10 + k], half[k]
                for p in range(batch):
                    h[p] = a * x[p] + b * y[p] + e * z[p]
            x, y, z = half[0], half[1], half[2]
            for k in range(r + 1):
                a, b, e, entry = frame[6 + 3 * k], frame[7 + 3 * k], frame[8 + 3 * k], own[row]
                for p in range(batch):
                    entry[p] += x[p] * a[p] + y[p] * b[p] + z[p] * e[p]
                c, d = centre[r], centre[k]
                if k < r:
                    for p in range(batch):
                        entry[p] -= mass * c[p] * d[p]
                row += 1
            c, d = centre[(r + 1) % 3], centre[(r + 2) % 3]
            for p in range(batch):
                entry[p] += mass * (c[p] * c[p] + d[p] * d[p])


def _mass_matrix(masses: FloatArray, rates: FloatArray, composites: FloatArray, matrix: FloatArray) -> None:
    """The lower triangle of the mass matrix: momenta of what lies beyond a joint, along the joints before it."""
    n, batch = rates.shape[0], rates.shape[2]
    momentum = np.empty((6, batch))
    for i in range(n):
        own, rate, mass = composites[i], rates[i], masses[i:].sum()
        for r in range(3):
            s, t = (r + 1) % 3, (r + 2) % 3
            angular, linear = momentum[r], momentum[3 + r]
            turn0, turn1, slide0, slide1 = rate[s], rate[t], rate[3 + s], rate[3 + t]
            moment0, moment1, slide = own[s], own[t], rate[3 + r]
            for p in range(batch):
                linear[p] = mass * slide[p] + turn0[p] * moment1[p] - turn1[p] * moment0[p]
            for p in range(batch):
                angular[p] = moment0[p] * slide1[p] - moment1[p] * slide0[p]
            for k in range(3):
                high, low = max(r, k), min(r, k)
                inertia, turn = own[3 + high * (high + 1) // 2 + low], rate[k]
                for p in range(batch):
                    angular[p] += inertia[p] * turn[p]
        for j in range(i + 1):
            entry = matrix[i, j]
            entry[:] = 0.0
            for k in range(6):
                a, b = rates[j, k], momentum[k]
                for p in range(batch):
                    entry[p] += a[p] * b[p]


def _solve(
    drives: FloatArray,
    least_pivot: float,
    matrix: FloatArray,
    lever: FloatArray,
    worst: FloatArray,
    mass: FloatArray,
) -> None:
    """One over lever . (matrix + drives)^-1 lever, by Cholesky in place; how far the worst pivot is above the least."""
    n, batch = lever.shape
    worst[:] = math.inf
    mass[:] = 0.0
    for j in range(n):
        pivot, right = matrix[j, j], lever[j]
        for p in range(batch):
            pivot[p] += drives[j]
        least = least_pivot * pivot
        for k in range(j):
            left, above = matrix[j, k], lever[k]
            for p in range(batch):
                pivot[p] -= left[p] * left[p]
            for p in range(batch):
                right[p] -= left[p] * above[p]
        for p in range(batch):
            gap = pivot[p] - least[p]
            worst[p] = gap if gap < worst[p] else worst[p]
        for p in range(batch):
            pivot[p] = math.sqrt(pivot[p])
        for p in range(batch):
            right[p] /= pivot[p]
        for p in range(batch):
            mass[p] += right[p] * right[p]
        for i in range(j + 1, n):
            entry = matrix[i, j]
            for k in range(j):
                left, above = matrix[i, k], matrix[j, k]
                for p in range(batch):
                    entry[p] -= left[p] * above[p]
            for p in range(batch):
                entry[p] /= pivot[p]
    for p in range(batch):
        mass[p] = 1.0 / mass[p]


_KERNELS = {
    _frames: "F3 F2 F2 F2 F3",
    _motions: "F3 F3 F1 F1 F3 F2 F1",
    _composites: "F2 F3 F3",
    _mass_matrix: "F1 F3 F3 F3",
    _solve: "F1 f F3 F2 F1 F1",
}
