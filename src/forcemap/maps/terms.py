"""Terms of a form: monomials in distance, height, speed and ln speed."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

_FACTOR = re.compile(r"(d|h|v|ln\(v\))(?:\^([1-9]\d?))?")
_FIELDS = {"d": "distance", "h": "height", "v": "speed", "ln(v)": "log_speed"}


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
            if isinstance(exponent, bool) or not isinstance(exponent, int) or not 0 <= exponent < 100:
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
