"""What every answer is: a model with units in its keys, null where there is no value."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict


class Answer(BaseModel):
    """A result as one JSON object; its schema is `model_json_schema()`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def json_text(self) -> str:
        """The object as text, a key a line."""
        return self.model_dump_json(indent=1)


def _figure(value: Any) -> Any:
    return float(value) if value is not None and math.isfinite(value) else None


def _figures(values: Any) -> Any:
    array = np.asarray(values, dtype=np.float64)
    cells = array.astype(object)
    cells[~np.isfinite(array)] = None
    return cells.tolist()


Figure = Annotated[float | None, BeforeValidator(_figure)]
"""A number; null if there is no value."""

Figures = Annotated[list[float | None], BeforeValidator(_figures)]
"""Numbers of a one-dimensional array; null where there is no value."""
