"""What every answer is: a model with units in its keys, made of a result's attributes, null where there is no value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AliasPath, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from forcemap.words import sentence, sentences


class Answer(BaseModel):
    """A result as one JSON object; its schema is `model_json_schema(mode="serialization")`."""

    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True, defer_build=True)

    @classmethod
    def from_result(cls, result: object, **also: Any) -> Self:
        """The answer from a result's attributes and from `also`, those that the result does not have."""
        return cls.model_validate(_Attributes(result, also))

    @classmethod
    def of_columns(cls, **columns: Iterable[Any]) -> list[Self]:
        """An answer for each row of columns, which are named by the keys; arrays among them may be of any shape."""
        flat = (column.ravel().tolist() if isinstance(column, np.ndarray) else column for column in columns.values())
        return [cls.model_validate(dict(zip(columns, row, strict=True))) for row in zip(*flat, strict=True)]

    @model_validator(mode="before")
    @classmethod
    def _in_order(cls, result: Any) -> Any:
        """Take a place that a result has as a tuple as being in the order of the keys."""
        return dict(zip(cls.model_fields, result, strict=True)) if type(result) is tuple else result

    def json_text(self) -> str:
        """The object as text, a key a line."""
        return self.model_dump_json(indent=1)


class AtPlace(Answer):
    """A place."""

    distance_m: float
    height_m: float


class PlaceAndSpeed(AtPlace):
    """A place and a speed."""

    speed_mps: float


class PlannedState(Answer):
    """A state of a campaign."""

    state_id: str
    role: str
    distance_m: float
    height_m: float
    speed_mps: float


class _Attributes:
    def __init__(self, result: object, also: Mapping[str, Any]) -> None:
        self._result, self._also = result, also

    def __getattr__(self, name: str) -> Any:
        return self._also[name] if name in self._also else getattr(self._result, name)


def of(*path: str) -> Any:
    """A key whose value is an attribute of another name, or an attribute of an attribute."""
    return Field(validation_alias=AliasPath(*path) if len(path) > 1 else path[0])


def of_if_any(*path: str) -> Any:
    """As `of`, but null if an attribute on the way is None."""
    return Field(None, validation_alias=AliasPath(*path))


def if_any() -> Any:
    """A key that is there only if it was asked for."""
    return Field(None, exclude_if=lambda value: value is None)


def _figure(value: Any) -> Any:
    return float(value) if value is not None and math.isfinite(value) else None


def figures(values: Any) -> list[Any]:
    """Numbers of an array as lists, None where there is no number."""
    array = np.asarray(values, dtype=np.float64)
    cells = array.astype(object)
    cells[~np.isfinite(array)] = None
    return list(cells.tolist())


Figure = Annotated[float | None, BeforeValidator(_figure)]
"""A number; null if there is no value."""

Figures = Annotated[list[float | None], BeforeValidator(figures)]
"""Numbers of a one-dimensional array; null where there is no value."""

Percent = Annotated[Figure, BeforeValidator(lambda share: 100 * share)]
"""A share as a percentage."""

Said = Annotated[str, BeforeValidator(sentence)]
"""What a finding says; empty for None."""

SaidIfAny = Annotated[str | None, BeforeValidator(lambda finding: sentence(finding) or None)]
"""What a finding says; null if there is none."""

AllSaid = Annotated[list[str], BeforeValidator(sentences)]
"""What findings say, each once."""

Joined = Annotated[str, BeforeValidator(lambda findings: "; ".join(sentences(findings)))]
"""What findings say, each once, in one line."""

Words = Annotated[str, BeforeValidator(str)]
"""The name of something."""

Bound = Annotated[dict[str, str | float], BeforeValidator(lambda bound: bound.describe())]
"""Kind and figures of a bound."""
