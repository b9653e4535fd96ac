"""Contact scenarios: what the force does after the dynamic impact (paper, section II-A)."""

from __future__ import annotations

from enum import StrEnum
from functools import lru_cache

from forcemap.errors import InputError


class ContactScenario(StrEnum):
    """What follows Phase I."""

    UNCONSTRAINED = "unconstrained"
    WITHOUT_CLAMPING = "constrained_without_clamping"
    WITH_CLAMPING = "constrained_with_clamping"
    UNDETERMINED = "undetermined"

    @property
    def words(self) -> str:
        """The name as it is written in a sentence."""
        return self.value.replace("_", " ")

    @classmethod
    @lru_cache(maxsize=64)  # a table says the same few again and again
    def parse(cls, text: str) -> ContactScenario:
        """The scenario of that name; spaces, hyphens, capitals and a missing "constrained" are accepted.

        Raises
        ------
        InputError
            A name that is none of the four.
        """
        name = "_".join(text.lower().replace("-", " ").replace("_", " ").split())
        for scenario in cls:
            if name in (scenario.value, scenario.value.removeprefix("constrained_"), _SHORT.get(scenario)):
                return scenario
        raise InputError(f"found {text!r}, expected one of {', '.join(cls)}")


_SHORT = {ContactScenario.WITH_CLAMPING: "clamping", ContactScenario.WITHOUT_CLAMPING: "no_clamping"}


BARRING = (ContactScenario.WITH_CLAMPING, ContactScenario.UNDETERMINED)
"""Scenarios that forbid the transient limit: the contact clamps, or may."""
