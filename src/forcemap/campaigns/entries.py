"""An entry of campaign.toml: whether its value is of the kind that is expected."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from forcemap.errors import InputError


def typed_entry(entry: str, value: Any, default: Any) -> Any:
    """The value, if it is of the kind of the default: true/false, a finite number, or a text (a date as text).

    Raises
    ------
    InputError
        Of another kind; `column` names the entry.
    """
    if isinstance(default, bool):
        good, expected = isinstance(value, bool), "true or false"
    elif isinstance(default, float):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        good, expected = number and math.isfinite(value), "a finite number"
    else:
        good, expected = not isinstance(value, Mapping | list | bool), "a text"
    if not good:
        raise InputError(f"found {value!r}, expected {expected}", column=entry)
    return type(default)(value)
