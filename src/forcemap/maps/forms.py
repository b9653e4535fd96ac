"""Forms of collision-force maps: the terms whose sum is ln F."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError, UnknownName
from forcemap.maps.speed_profile import SpeedProfile, horner
from forcemap.maps.terms import Term


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
        if (
            self.speed_degree > 3
            or any(t.log_speed > 1 for t in self.terms)
            or (self.speed_degree and self.logarithmic)
        ):
            raise InputError(f"form {self.name}: expected powers of v up to 3, or ln(v) alone")

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
        """How each row of `coefficients`, shape (m, terms), depends on speed at places of any one shape [m].

        Sums run in a fixed order, so one place gives the same bits as many.
        """
        return [self._speed_profile(row, distance, height) for row in coefficients.tolist()]

    def _speed_profile(self, row: list[float], distance: FloatArray, height: FloatArray) -> SpeedProfile:
        tables: dict[tuple[int, int], dict[int, dict[int, float]]] = {}  # (speed, log_speed): {distance: {height: b}}
        for coefficient, term in zip(row, self.terms, strict=True):
            if coefficient != 0.0:
                table = tables.setdefault((term.speed, term.log_speed), {})
                table.setdefault(term.distance, {})[term.height] = coefficient

        def at_places(speed: int, log_speed: int) -> FloatArray:
            table = tables.get((speed, log_speed), {})
            return np.asarray(horner({i: horner(column, height) for i, column in table.items()}, distance))

        powers = tuple(at_places(k, 0) for k in range(self.speed_degree + 1))
        return SpeedProfile(powers, at_places(0, 1) if self.logarithmic else None)


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


CFM_2D = Form.of("CFM_2D", ["1", "v", "d", "d^2"])
"""The 2D collision-force map of Schlotzhauer et al. 2019 (paper, eq. 2)."""

CFM_3D = Form.of("CFM_3D", ["1", "v", "d", "d^2", "d*h", "h^2", "d^2*v", "d*v^2", "d*h^2"])
"""The paper's 3D collision-force map, coefficients in the paper's order (eq. 4)."""

FULL_CUBIC = Form(
    "FULL_CUBIC",
    tuple(
        Term(distance=d, height=h, speed=v)
        for degree in range(4)
        for v in range(degree, -1, -1)
        for d in range(degree - v, -1, -1)
        for h in [degree - v - d]
    ),
)
"""All monomials up to degree three: the intercept and the 19 terms the paper's selection starts from."""

LOG_SPEED = Form.of("LOG_SPEED", ["1", "d", "h", "d^2", "d*h", "h^2", "d*h^2", "ln(v)", "d*ln(v)", "h*ln(v)"])
"""Second form: a power of v whose exponent depends on the place; monotone in v where that exponent is positive."""

FORMS = (CFM_2D, CFM_3D, FULL_CUBIC, LOG_SPEED)
