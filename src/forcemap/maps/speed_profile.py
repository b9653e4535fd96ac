"""How ln F depends on speed at a place: a polynomial in v up to degree three, or c0 + c ln v."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class SpeedProfile:
    """ln F(v) = sum of powers[k] v^k + log ln v, with one coefficient array per power [1/(m/s)^k].

    Either `log` is None, or `powers` holds the constant alone. The arrays broadcast over places.
    """

    powers: tuple[FloatArray, ...]
    log: FloatArray | None = None

    def __call__(self, speed: FloatArray) -> FloatArray:
        """The value at a speed [m/s]; -inf or inf at 0 if the profile is logarithmic."""
        value = np.asarray(horner(dict(enumerate(self.powers)), speed))
        if self.log is None:
            return value
        with np.errstate(divide="ignore", invalid="ignore"):
            log = self.log * np.log(speed)
        return value + np.where(self.log == 0, 0.0, log)

    def slope(self, speed: FloatArray) -> FloatArray:
        """The derivative with respect to speed [1/(m/s)]."""
        slope = np.zeros(np.broadcast_shapes(self.powers[0].shape, speed.shape))
        for k in range(len(self.powers) - 1, 0, -1):
            slope = slope * speed + k * self.powers[k]
        return slope if self.log is None else slope + self.log / speed

    def first_rise(self, level: FloatArray) -> FloatArray:
        """Smallest v >= 0 [m/s] at which the profile rises to `level`; 0 if it is there at rest, NaN if never."""
        if self.log is not None:
            return _first_rise_logarithmic(self.powers[0], self.log, level)
        constant = self.powers[0] - level
        higher = [*self.powers[1:], *[np.zeros(())] * (4 - len(self.powers))]
        root = (
            _first_root_cubic(constant, higher[0], higher[1], higher[2])
            if len(self.powers) == 4
            else _first_root_quadratic(constant, higher[0], higher[1])
        )
        return np.where(constant >= 0, 0.0, root)


def horner(coefficients: Mapping[int, FloatArray | float], x: FloatArray) -> FloatArray | float:
    """The sum of coefficients[k] x^k, in place as far as shapes allow: memory, not arithmetic, costs time."""
    top = max(coefficients, default=0)
    value: Any = coefficients.get(top, 0.0)
    own = False
    for k in range(top - 1, -1, -1):
        for operation, operand in ((np.multiply, x), (np.add, coefficients.get(k))):
            if operand is not None:
                in_place = own and np.broadcast(value, operand).shape == value.shape
                value, own = operation(value, operand, out=value if in_place else None), True
    return value  # type: ignore[no-any-return]


def _first_rise_logarithmic(constant: FloatArray, log: FloatArray, level: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.exp((level - constant) / log)
    at_rest = (log < 0) | ((log == 0) & (constant >= level))  # F grows without bound, or is constant
    return np.where(at_rest, 0.0, np.where((log > 0) & np.isfinite(root), root, np.nan))


def _first_root_quadratic(c: FloatArray, b: FloatArray, a: FloatArray) -> FloatArray:
    """Smallest positive root of a v^2 + b v + c for c < 0, without cancellation; NaN if there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root_of_discriminant = np.sqrt(b * b - 4.0 * a * c)
        rising = -2.0 * c / (b + root_of_discriminant)
        falling_first = (root_of_discriminant - b) / (2.0 * a)
    root = np.where(b >= 0, rising, np.where(a > 0, falling_first, np.nan))
    return np.where(np.isfinite(root) & (root > 0), root, np.nan)


def _first_root_cubic(c: FloatArray, b: FloatArray, a: FloatArray, cubic: FloatArray) -> FloatArray:
    """Smallest positive root of cubic v^3 + a v^2 + b v + c for c < 0; NaN if there is none.

    Between neighbouring turning points the polynomial is monotone, so the first piece that ends at or above 0
    holds the first root; bisection inside it cannot miss.
    """
    c, b, a, cubic = np.broadcast_arrays(c, b, a, cubic)
    bound = 2.0 + np.max(np.abs([b, a, c]), axis=0) / np.maximum(np.abs(cubic), 1e-300)  # Cauchy: no root beyond
    bound = np.minimum(bound, 1e6)  # [m/s]; a crossing beyond it is none
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(a * a - 3.0 * cubic * b)
        q = -(a + np.copysign(root, a))
        turns = np.stack([q / (3.0 * cubic), b / q])
    turns = np.sort(np.clip(np.where(np.isfinite(turns), turns, 0.0), 0.0, bound), axis=0)
    ends = np.stack([turns[0], turns[1], bound])

    def value(v: FloatArray) -> FloatArray:
        return np.asarray(((cubic * v + a) * v + b) * v + c)

    reached = value(ends) >= 0
    piece = np.argmax(reached, axis=0)
    high = np.take_along_axis(ends, piece[None], axis=0)[0]
    low = np.where(piece == 0, 0.0, np.take_along_axis(ends, np.maximum(piece - 1, 0)[None], axis=0)[0])
    for _ in range(80):
        middle = 0.5 * (low + high)
        above = value(middle) >= 0
        high = np.where(above, middle, high)
        low = np.where(above, low, middle)
    return np.where(reached.any(axis=0), high, np.nan)
