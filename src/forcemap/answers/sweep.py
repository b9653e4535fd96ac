"""What a sweep has done, and what is left."""

from __future__ import annotations

from forcemap.answers.answer import Answer


class NotComputed(Answer):
    """A block that gave nothing."""

    block: str
    reason: str


class SweepAnswer(Answer):
    """A study's parts in their folder; times are of this run, what is left is of the whole study."""

    study: str
    kind: str
    study_sha256: str
    folder: str
    blocks: int
    there_before: int
    computed: int
    failed: list[NotComputed]
    left: int
    missing: list[str]
    processor_s: float
    wall_s: float
    processor_s_per_block: float | None
    left_processor_s: float | None
    summary: str | None
