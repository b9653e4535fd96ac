"""Force, leverage and crossing speed of many scattered points, compiled: bit for bit what numpy gives.

The kernels do the algebra of ln F, the same steps of Horner's scheme that `forms.horner` takes, and the first root of a
parabola; exponentials and logarithms stay numpy's. Forms up to v^2 and without ln v have kernels, regular grids have none:
there numpy does once what an axis alone decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from forcemap import arrays
from forcemap.arrays import FloatArray, Indices
from forcemap.compiled import kernel
from forcemap.maps.forms import Form

LEAST = 524_288
"""Points from which numba is loaded and used. A choice: numpy takes for them about as long as loading numba does."""

_BLOCK = 8192  # points at once: their arrays, 64 kB each, stay in a processor's cache
_TILE = 512  # points that a step runs over: the registers, 4 kB each, stay in its fastest cache
_CHECKED = 1024  # points of every call that numpy computes again

# Steps: t = a; t = a f + b; t = t f + b; t = t f + r; result += t^2
_SET, _START, _TIMES, _ADD, _SQUARE = range(5)

_Nested: TypeAlias = Any  # coefficients {power of v: {power of d: {power of h: b}}}, or less deep down to a float
_Step: TypeAlias = tuple[int, int, int, int, float, float]  # kind, t, f, r, a, b
_Block: TypeAlias = Callable[..., None]  # of three arrays of one size, and one of that size for the result


def force(form: Form, coefficients: FloatArray, by_numpy: Callable[..., FloatArray], *arguments: ArrayLike) -> Any:
    """`in_blocks(by_numpy, distance, height, speed)`: exp of the sum of coefficient x term."""

    def compiled() -> _Block | None:
        steps: list[_Step] = []
        _finished(_horner(_nested(form, coefficients), 2, 3, steps), 3, steps)
        run = _runner(steps, 1)

        def block(d: FloatArray, h: FloatArray, v: FloatArray, out: FloatArray) -> None:
            with np.errstate(over="ignore", invalid="ignore"):
                np.exp(run(d, h, v)[0], out=out)

        return run and block

    return _in_blocks(form, compiled, by_numpy, *arguments)


def leverage(form: Form, rows: FloatArray, by_numpy: Callable[..., FloatArray], *arguments: ArrayLike) -> Any:
    """`in_blocks(by_numpy, distance, height, speed)`: squares of the sums of coefficient x term of every row, summed."""

    def compiled() -> _Block | None:
        steps: list[_Step] = [(_SET, 3, 0, 0, 0.0, 0.0)]
        for row in rows:
            _finished(_horner(_nested(form, row), 2, 2, steps), 2, steps)
            steps.append((_SQUARE, 2, 0, 0, 0.0, 0.0))
        run = _runner(steps, 1)

        def block(d: FloatArray, h: FloatArray, v: FloatArray, out: FloatArray) -> None:
            out[:] = run(d, h, v)[0]

        return run and block

    return _in_blocks(form, compiled, by_numpy, *arguments)


def crossing_speed(
    form: Form, coefficients: FloatArray, by_numpy: Callable[..., FloatArray], *arguments: ArrayLike
) -> Any:
    """`in_blocks(by_numpy, distance, height, force)`: where the sum of coefficient x term first rises to ln force."""

    def compiled() -> _Block | None:
        steps: list[_Step] = []
        nested = _nested(form, coefficients)
        for power in range(3):
            _finished(_horner(nested.get(power, {}), 1, 3 + power, steps), 3 + power, steps)
        run, first_rise = _runner(steps, 3), kernel(_first_rise, "F2 F1 F1")

        def block(d: FloatArray, h: FloatArray, force: FloatArray, out: FloatArray) -> None:
            first_rise(run(d, h, d), np.log(force), out)

        return run and first_rise and block

    return _in_blocks(form, compiled, by_numpy, *arguments)


def _in_blocks(
    form: Form, compiled: Callable[[], _Block | None], by_numpy: Callable[..., FloatArray], *arguments: ArrayLike
) -> Any:
    """As `arrays.in_blocks(by_numpy, ...)`: by the compiled function where there is one and it differs nowhere.

    Compared are the first points, and every block with a NaN in it, which may be what a slip of a compiler leaves.
    """
    simple = form.speed_degree <= 2 and not form.logarithmic
    points = _scattered(arguments) if simple else None
    block = compiled() if points else None
    if block is None or points is None:
        return arrays.in_blocks(by_numpy, *arguments)
    result = np.empty(points[0].shape)
    if not _filled(result.reshape(-1), block, by_numpy, points):
        return arrays.in_blocks(by_numpy, *arguments)
    return result


def _filled(result: FloatArray, block: _Block, by_numpy: Callable[..., FloatArray], points: list[FloatArray]) -> bool:
    """Fill the result; false where it is not numpy's."""
    flat = [array.reshape(-1) for array in points]
    constant = {i: np.full(_BLOCK, array[0]) for i, array in enumerate(flat) if array.size == 1}
    for start in range(0, result.size, _BLOCK):
        out = result[start : start + _BLOCK]
        parts = [constant[i][: out.size] if i in constant else _plain(a, start, out.size) for i, a in enumerate(flat)]
        block(*parts, out)
        again = out.size if np.isnan(out).any() else 0 if start else _CHECKED
        if again:
            expected = by_numpy(*(flat[i] if i in constant else part[:again] for i, part in enumerate(parts)))
            if not np.array_equal(out[:again], expected, equal_nan=True):
                return False
    return True


def _plain(array: FloatArray, start: int, size: int) -> FloatArray:
    """A part of an array as kernels take it: contiguous, aligned and, for numba tells them apart, writeable."""
    part = array[start : start + size]
    return part if part.flags.carray else part.copy()


def _scattered(arguments: tuple[ArrayLike, ...]) -> list[FloatArray] | None:
    """The arguments as arrays if they are many places, each with its own speed or force, or with one for all."""
    place, *_ = arguments
    if not isinstance(place, np.ndarray) or place.size < LEAST or any(np.ma.is_masked(a) for a in arguments):
        return None
    points = [np.asarray(argument, dtype=np.float64) for argument in arguments]
    d, h, third = points
    fits = d.shape == h.shape and (third.shape == d.shape or (third.size == 1 and third.ndim <= d.ndim))
    return points if fits else None


def _nested(form: Form, coefficients: FloatArray) -> _Nested:
    """The coefficients by the powers of v, d and h; those of zero are left out, as numpy leaves them out."""
    nested: _Nested = {power: {} for power in range(form.speed_degree + 1)}
    for coefficient, term in zip(coefficients.tolist(), form.terms, strict=True):
        if coefficient != 0.0:
            nested[term.speed].setdefault(term.distance, {})[term.height] = coefficient
    return nested


def _horner(nested: _Nested, axis: int, target: int, steps: list[_Step]) -> float | None:
    """Append the steps of Horner's scheme along an axis, 0 is h, 1 is d, 2 is v; the value if it is a constant.

    Else the value stands in the target. What is added along an axis stands in the register of the axis before.
    """
    if not nested:
        return 0.0
    if axis < 0:
        return float(nested)
    top = max(nested)
    value = _horner(nested[top], axis - 1, target, steps)
    for power in range(top - 1, -1, -1):
        added = _horner(nested[power], axis - 1, axis - 1, steps) if power in nested else -0.0  # x + -0.0 is x
        if value is not None and added is None:
            steps.append((_SET, target, 0, 0, value, 0.0))
        kind = _ADD if added is None else _TIMES if value is None else _START
        steps.append((kind, target, axis, axis - 1, value or 0.0, added or 0.0))
        value = None
    return value


def _finished(value: float | None, target: int, steps: list[_Step]) -> None:
    """A sum that is a constant goes to the target, too."""
    if value is not None:
        steps.append((_SET, target, 0, 0, value, 0.0))


def _runner(steps: list[_Step], rows: int) -> Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None:
    """The steps as a function of distance, height and speed, blocks of one size; its rows are valid until the next."""
    run = kernel(_run, "I2 F2 F1 F1 F1 F2")
    if run is None:
        return None
    codes, numbers = np.array([step[:4] for step in steps]), np.array([step[4:] for step in steps])
    scratch = np.zeros(rows * _BLOCK)

    def rows_of(d: FloatArray, h: FloatArray, v: FloatArray) -> FloatArray:
        out = scratch[: rows * d.size].reshape(rows, d.size)
        run(codes, numbers, d, h, v, out)
        return out

    return rows_of


def _run(
    codes: Indices, numbers: FloatArray, d: FloatArray, h: FloatArray, v: FloatArray, out: FloatArray
) -> None:
    """Take the steps over tile after tile."""
    registers = np.empty((3, _TILE))
    for start in range(0, d.size, _TILE):
        stop = min(start + _TILE, d.size)
        for step in range(len(codes)):
            kind, target, factor, other = codes[step]
            a, b = numbers[step]
            f = (h, d, v)[factor][start:stop]
            t = registers[target, : stop - start] if target < 3 else out[target - 3, start:stop]
            r = registers[other]
            if kind == _SET:
                for i in range(f.size):
                    t[i] = a
            elif kind == _START:
                for i in range(f.size):
                    t[i] = a * f[i] + b
            elif kind == _TIMES:
                for i in range(f.size):
                    t[i] = t[i] * f[i] + b
            elif kind == _ADD:
                for i in range(f.size):
                    t[i] = t[i] * f[i] + r[i]
            else:
                for i in range(f.size):
                    out[0, start + i] += t[i] * t[i]


def _first_rise(powers: FloatArray, level: FloatArray, out: FloatArray) -> None:
    """As `SpeedProfile.first_rise` of a parabola."""
    for i in range(level.size):
        c, b, a = powers[0, i] - level[i], powers[1, i], powers[2, i]
        root_of_discriminant = math.sqrt(b * b - 4.0 * a * c)
        rising = -2.0 * c / (b + root_of_discriminant)
        falling_first = (root_of_discriminant - b) / (2.0 * a)
        root = rising if b >= 0 else (falling_first if a > 0 else math.nan)
        out[i] = 0.0 if c >= 0 else (root if 0 < root < math.inf else math.nan)
