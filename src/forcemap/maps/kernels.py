"""Force, leverage and crossing speed of many scattered points, compiled: bit for bit what numpy gives.

The kernels do the algebra of ln F = p0 + p1 v + p2 v^2, with p0 a polynomial of up to d^2 and h^2, p1 and p2 of up to
d^2: CFM_2D, CFM_3D and forms like them. Exponentials and logarithms stay numpy's. A term that a map lacks has the
coefficient -0.0, which adds nothing to any number; where it meets an infinite one a NaN is left, and numpy computes the
block again. Regular grids have no kernel: there numpy does once what an axis alone decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcemap.arrays import BLOCK, FloatArray, in_blocks, large_result
from forcemap.compiled import in_threads, kernel
from forcemap.maps.forms import Form

LEAST = 524_288
"""Points from which numba is loaded and used. A choice: numpy takes for them about as long as loading numba does."""

_TILE = 512  # points that a row of leverages runs over, in its fastest cache
_CHECKED = 1024  # points of every call that numpy computes again

_TERMS = {
    powers: number
    for number, powers in enumerate(
        [(0, d, h) for d in (2, 1, 0) for h in (2, 1, 0)] + [(v, d, 0) for v in (1, 2) for d in (2, 1, 0)]
    )
}
"""Where the coefficient of v^i d^j h^k stands in a row of coefficients."""

_ByNumpy = Callable[..., FloatArray]
_Block = Callable[..., None]  # of distance, height, speed or force, and the array for the result


def force(form: Form, coefficients: FloatArray, by_numpy: _ByNumpy, *arguments: ArrayLike) -> Any:
    """`in_blocks(by_numpy, distance, height, speed)`: exp of the sum of coefficient x term."""

    def compiled() -> _Block | None:
        (row,) = _rows(form, coefficients[None])
        run = kernel(_log_force, "F1 F1 F1 F1 F1")
        if run is None:
            return None

        def block(d: FloatArray, h: FloatArray, v: FloatArray, out: FloatArray) -> None:
            run(row, d, h, _spread(v, d.size), out)
            with np.errstate(over="ignore", invalid="ignore"):
                np.exp(out, out=out)

        return block

    return _evaluated(form, compiled, by_numpy, arguments)


def leverage(form: Form, coefficients: FloatArray, by_numpy: _ByNumpy, *arguments: ArrayLike) -> Any:
    """`in_blocks(by_numpy, distance, height, speed)`: the squares of the sums of every row, summed."""

    def compiled() -> _Block | None:
        rows = _rows(form, coefficients)
        run = kernel(_sum_of_squares, "F2 F1 F1 F1 F1")
        return run and (lambda d, h, v, out: run(rows, d, h, _spread(v, d.size), out))

    return _evaluated(form, compiled, by_numpy, arguments)


def crossing_speed(form: Form, coefficients: FloatArray, by_numpy: _ByNumpy, *arguments: ArrayLike) -> Any:
    """`in_blocks(by_numpy, distance, height, force)`: where the sum of coefficient x term rises to ln force."""

    def compiled() -> _Block | None:
        (row,) = _rows(form, coefficients[None])
        run = kernel(_first_rise, "F1 F1 F1 F1 F1")
        return run and (lambda d, h, force, out: run(row, d, h, _spread(np.log(force), d.size), out))

    return _evaluated(form, compiled, by_numpy, arguments)


def _evaluated(
    form: Form, compiled: Callable[[], _Block | None], by_numpy: _ByNumpy, arguments: tuple[ArrayLike, ...]
) -> Any:
    """By the compiled function where there is one for these arguments, and the first points agree with numpy's."""
    has_kernel = all((term.speed, term.distance, term.height) in _TERMS and not term.log_speed for term in form.terms)
    points = _scattered(arguments) if has_kernel else None
    if points is not None and (block := compiled()):
        result = large_result(points[0].shape)
        if _filled(result.reshape(-1), block, by_numpy, [array.reshape(-1) for array in points]):
            return result
    return in_blocks(by_numpy, *arguments)


def _scattered(arguments: tuple[ArrayLike, ...]) -> list[FloatArray] | None:
    """The arguments as arrays if they are many places, each with its own speed or force, or with one for all."""
    place, *_ = arguments
    if not isinstance(place, np.ndarray) or place.size < LEAST or any(np.ma.is_masked(a) for a in arguments):
        return None
    d, h, third = points = [np.asarray(argument, dtype=np.float64) for argument in arguments]
    fits = d.shape == h.shape and (third.shape == d.shape or (third.size == 1 and third.ndim <= d.ndim))
    return points if fits else None


def _rows(form: Form, coefficients: FloatArray) -> FloatArray:
    """Coefficients, shape (m, terms), as the kernels take them; zeros count as lacking, as for numpy."""
    rows = np.full((len(coefficients), len(_TERMS)), -0.0)
    rows[:, [_TERMS[term.speed, term.distance, term.height] for term in form.terms]] = coefficients
    rows[rows == 0] = -0.0
    return rows


def _filled(result: FloatArray, block: _Block, by_numpy: _ByNumpy, points: list[FloatArray]) -> bool:
    """Fill the result block by block, by numpy where numbers are not finite; false if numpy's first points differ."""

    def fill(starts: range) -> None:
        for start in starts:
            out = result[start : start + BLOCK]
            parts = [array if array.size == 1 else _plain(array[start : start + BLOCK]) for array in points]
            block(*parts, out)
            if np.isnan(out).any() and not all(np.isfinite(part).all() for part in parts):
                out[:] = by_numpy(*parts)

    starts = range(0, result.size, BLOCK)
    fill(starts[:1])
    if not np.array_equal(result[:_CHECKED], by_numpy(*(part[:_CHECKED] for part in points)), equal_nan=True):
        return False
    in_threads(fill, starts[1:])
    return True


def _plain(part: FloatArray) -> FloatArray:
    """A part of an array as kernels take it: contiguous, aligned and, for numba tells them apart, writeable."""
    return part if part.flags.carray else part.copy()


def _spread(part: FloatArray, size: int) -> FloatArray:
    """A part of that size, where one figure may stand for all."""
    return part if part.size == size else _constant(part.tobytes())[:size]


@lru_cache(maxsize=4)
def _constant(figure: bytes) -> FloatArray:
    """A block full of one figure, by its bytes: zeros have signs."""
    return np.full(BLOCK, np.frombuffer(figure))


def _log_force(b: FloatArray, d: FloatArray, h: FloatArray, v: FloatArray, out: FloatArray) -> None:
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, b13, b14 = b
    for i in range(d.size):
        x, y = d[i], h[i]
        p0 = (((b0 * y + b1) * y + b2) * x + ((b3 * y + b4) * y + b5)) * x + ((b6 * y + b7) * y + b8)
        p1 = (b9 * x + b10) * x + b11
        p2 = (b12 * x + b13) * x + b14
        out[i] = (p2 * v[i] + p1) * v[i] + p0


def _sum_of_squares(rows: FloatArray, d: FloatArray, h: FloatArray, v: FloatArray, out: FloatArray) -> None:
    out[:] = 0.0
    for start in range(0, d.size, _TILE):
        tile = slice(start, start + _TILE)
        x, y, z, total = d[tile], h[tile], v[tile], out[tile]
        for b in rows:
            b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, b13, b14 = b
            for i in range(total.size):
                p0 = (((b0 * y[i] + b1) * y[i] + b2) * x[i] + ((b3 * y[i] + b4) * y[i] + b5)) * x[i]
                p0 += (b6 * y[i] + b7) * y[i] + b8
                p1 = (b9 * x[i] + b10) * x[i] + b11
                p2 = (b12 * x[i] + b13) * x[i] + b14
                value = (p2 * z[i] + p1) * z[i] + p0
                total[i] += value * value


def _first_rise(b: FloatArray, d: FloatArray, h: FloatArray, level: FloatArray, out: FloatArray) -> None:
    """As `SpeedProfile.first_rise` of a parabola, with one division."""
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, b13, b14 = b
    for i in range(d.size):
        x, y = d[i], h[i]
        p0 = (((b0 * y + b1) * y + b2) * x + ((b3 * y + b4) * y + b5)) * x + ((b6 * y + b7) * y + b8)
        p1 = (b9 * x + b10) * x + b11
        p2 = (b12 * x + b13) * x + b14
        c = p0 - level[i]
        root = math.sqrt(p1 * p1 - 4.0 * p2 * c)
        above = -2.0 * c if p1 >= 0 else root - p1
        below = p1 + root if p1 >= 0 else 2.0 * p2
        speed = above / below
        known = (p1 >= 0 or p2 > 0) and 0 < speed < math.inf
        out[i] = 0.0 if c >= 0 else (speed if known else math.nan)
