"""Forms of collision-force maps: the terms whose sum is ln F, and how that sum depends on speed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.campaigns.dataset import Conditions
from forcemap.errors import InputError, UnknownName
from forcemap.findings import Finding, FindingKind

_FACTOR = re.compile(r"(d|h|v|ln\(v\))(?:\^([1-9]\d?))?")
_FIELDS = {"d": "distance", "h": "height", "v": "speed", "ln(v)": "log_speed"}

_MAX_EXPONENT = 99  # two digits, what _FACTOR reads back
_MAX_SPEED_DEGREE = 3  # of ln F in v: up to here the first crossing has a solution that cannot miss it
_FASTEST_CROSSING = 1e6  # [m/s]; a crossing beyond it counts as none, so that the bisection has an end
_BISECTIONS = 80  # halve 1e6 m/s to less than the spacing of doubles at any speed of a robot


@dataclass(frozen=True)
class Term:
    """The monomial d^distance h^height v^speed ln(v)^log_speed; all exponents 0 is the constant "1".

    `str(term)` is its readable name, for example "d*h^2"; `Term.parse` reads it back.
    """

    distance: int = 0
    height: int = 0
    speed: int = 0
    log_speed: int = 0

    def __post_init__(self) -> None:
        for field in _FIELDS.values():
            exponent = getattr(self, field)
            if isinstance(exponent, bool) or not isinstance(exponent, int) or not 0 <= exponent <= _MAX_EXPONENT:
                raise InputError(f"term: found the exponent {exponent!r} of {field}, expected 0, 1, 2, ...")

    def __str__(self) -> str:
        exponents = {letter: getattr(self, field) for letter, field in _FIELDS.items()}
        factors = [letter if n == 1 else f"{letter}^{n}" for letter, n in exponents.items() if n]
        return "*".join(factors) or "1"

    @classmethod
    def parse(cls, name: str) -> Term:
        """The term of a readable name.

        Raises
        ------
        InputError
            Not a product of powers of d, h, v and ln(v).
        """
        exponents: dict[str, int] = {}
        for factor in [] if name == "1" else name.split("*"):
            match = _FACTOR.fullmatch(factor)
            if not match or _FIELDS[match[1]] in exponents:
                raise InputError(f"found the term {name!r}, expected a product like d*h^2 or d*ln(v)")
            exponents[_FIELDS[match[1]]] = int(match[2] or 1)
        return cls(**exponents)

    def values(self, distance: FloatArray, height: FloatArray, speed: FloatArray) -> FloatArray:
        """The term at places [m] and speeds [m/s] of one shape."""
        value = distance**self.distance * height**self.height * speed**self.speed
        return value * np.log(speed) ** self.log_speed if self.log_speed else value


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
        """Smallest v >= 0 [m/s] at which the profile rises to `level`; 0 if it is reached at rest, NaN if never."""
        if self.log is not None:
            return _first_rise_logarithmic(self.powers[0], self.log, level)
        constant = self.powers[0] - level
        higher = [*self.powers[1:], np.zeros(()), np.zeros(())]
        cubic = len(self.powers) - 1 == _MAX_SPEED_DEGREE
        root = _first_root_cubic(constant, *higher[:3]) if cubic else _first_root_quadratic(constant, *higher[:2])
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
    bound = np.minimum(bound, _FASTEST_CROSSING)
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
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        above = value(middle) >= 0
        high = np.where(above, middle, high)
        low = np.where(above, low, middle)
    return np.where(reached.any(axis=0), high, np.nan)


@dataclass(frozen=True)
class Form:
    """A named set of terms, ln F = sum of coefficient x term (paper, eq. 4).

    Parameters
    ----------
    name : str
        Name of the form, as it stands in map files.
    terms : tuple of Term
        Terms in the order of the coefficients.

    Raises
    ------
    InputError
        No term, a term twice, or a dependence on speed that is neither a polynomial up to degree three nor
        linear in ln v (the crossing speed has a safe closed solution for these alone).
    """

    name: str
    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        if not self.terms or len(set(self.terms)) != len(self.terms):
            raise InputError(f"form {self.name}: expected at least one term and none twice")
        log_power = max(term.log_speed for term in self.terms)
        if self.speed_degree > _MAX_SPEED_DEGREE or log_power > 1 or (self.speed_degree and log_power):
            raise InputError(f"form {self.name}: expected powers of v up to {_MAX_SPEED_DEGREE}, or ln(v) alone")

    @classmethod
    def of(cls, name: str, terms: Sequence[str]) -> Form:
        """A form from the readable names of its terms."""
        return cls(name, tuple(Term.parse(term) for term in terms))

    @property
    def term_names(self) -> list[str]:
        """Readable names of the terms."""
        return [str(term) for term in self.terms]

    @cached_property
    def speed_degree(self) -> int:
        """Highest power of v."""
        return max(term.speed for term in self.terms)

    @cached_property
    def logarithmic(self) -> bool:
        """True if ln F is linear in ln v."""
        return any(term.log_speed for term in self.terms)

    def design(self, distance: FloatArray, height: FloatArray, speed: FloatArray) -> FloatArray:
        """Design matrix, shape (n, terms), for places [m] and speeds [m/s] of shape (n,)."""
        return np.column_stack([term.values(distance, height, speed) for term in self.terms])

    def speed_profiles(self, coefficients: FloatArray, distance: FloatArray, height: FloatArray) -> list[SpeedProfile]:
        """How ln F of each row of `coefficients`, shape (m, terms), depends on speed at places [m] of any one shape.

        Sums run in a fixed order, so a single place gives the same bits as many.
        """
        return [self._speed_profile(row, distance, height) for row in coefficients.tolist()]

    def _speed_profile(self, row: list[float], distance: FloatArray, height: FloatArray) -> SpeedProfile:
        tables: dict[tuple[int, int], dict[int, dict[int, float]]] = {}  # (speed, log_speed): {distance: {height: b}}
        for coefficient, term in zip(row, self.terms, strict=True):
            if coefficient != 0.0:
                table = tables.setdefault((term.speed, term.log_speed), {})
                table.setdefault(term.distance, {})[term.height] = coefficient

        def coefficient_of(speed: int, log_speed: int) -> FloatArray:
            table = tables.get((speed, log_speed), {})
            return np.asarray(horner({i: horner(column, height) for i, column in table.items()}, distance))

        powers = tuple(coefficient_of(k, 0) for k in range(self.speed_degree + 1))
        return SpeedProfile(powers, coefficient_of(0, 1) if self.logarithmic else None)


def form_named(name: str) -> Form:
    """The form of that name; capitals and hyphens do not matter.

    Raises
    ------
    UnknownName
        No form has the name.
    """
    wanted = name.upper().replace("-", "_")
    for form in FORMS:
        if form.name == wanted:
            return form
    raise UnknownName("form", name, [form.name for form in FORMS])


def form_of(conditions: Conditions, form: Form | None = None) -> Form:
    """The form of a campaign's map: the one that is asked for, else `map.form` of campaign.toml, else CFM_3D."""
    return form or form_named(conditions.form or CFM_3D.name)


def form_chosen(name: str) -> list[Finding]:
    """That the form of a fitted map is another one than CFM_3D, which may have been chosen on the states of the map."""
    return [] if name == CFM_3D.name else [Finding.of(FindingKind.FORM_CHOSEN, form=name)]


CFM_2D = Form.of("CFM_2D", ["1", "v", "d", "d^2"])
"""The 2D collision-force map of Schlotzhauer et al. 2019 (paper, eq. 2)."""

CFM_3D = Form.of("CFM_3D", ["1", "v", "d", "d^2", "d*h", "h^2", "d^2*v", "d*v^2", "d*h^2"])
"""The paper's 3D collision-force map, coefficients in the paper's order (eq. 4)."""

FULL_CUBIC = Form(
    "FULL_CUBIC",
    tuple(
        Term(distance=d, height=degree - v - d, speed=v)
        for degree in range(4)
        for v in range(degree, -1, -1)
        for d in range(degree - v, -1, -1)
    ),
)
"""All monomials up to degree three: the intercept and the 19 terms the paper's selection starts from."""

LOG_SPEED = Form.of("LOG_SPEED", ["1", "d", "h", "d^2", "d*h", "h^2", "d*h^2", "ln(v)", "d*ln(v)", "h*ln(v)"])
"""Second form: a power of v whose exponent depends on the place; monotone in v where that exponent is positive."""

FORMS = (CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED)
