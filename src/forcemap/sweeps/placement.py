"""Where a table should stand, over robots, tools and paths: a map stands for a robot with its tool."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import forcemap as fm
from forcemap.sweeps.block import Computed
from forcemap.sweeps.entries import Entries

_POSITION_STEP = 0.05  # as of `forcemap place` [m]


@dataclass(frozen=True)
class PlacementCase:
    """Cycle times of a task on one path with one map, over positions of the table.

    Parameters
    ----------
    name : str
        Map and path.
    force_map : ForceMap
        The map.
    path : ToolPath
        The path in the frame of the table.
    task : Task
        Body areas and contact.
    table : LimitTable or None
        Table of limits; None for the standard's.
    step : float
        Distance between positions [m].
    """

    name: str
    force_map: fm.ForceMap
    path: fm.ToolPath
    task: fm.Task
    table: fm.LimitTable | None
    step: float

    means: ClassVar[tuple[str, ...]] = ("permitted_share",)
    best: ClassVar[tuple[str, bool]] = ("cycle_time_s", False)

    @property
    def blocks(self) -> int:
        """One: its best position is that of all."""
        return 1

    def compute(self, number: int, rng: np.random.Generator) -> Computed:
        """Cycle times at the allowed speeds; empty (nan) where a part of the path has no permission."""
        bound = fm.FixedMargin() if self.force_map.fit is None else fm.ToleranceBound()
        found = fm.place_task(self.force_map, self.path, self.task, bound=bound, step=self.step, table=self.table)
        d, h = np.meshgrid(found.distance, found.height, indexing="ij")
        columns = {
            "distance_m": d.ravel(),
            "height_m": h.ravel(),
            "cycle_time_s": found.duration.ravel(),
            "standard_cycle_time_s": found.standard_duration.ravel(),
            "permitted_share": found.permitted.ravel(),
        }
        warned = [each for basis in found.bases for each in basis.warnings]
        stated = [each for basis in found.bases for each in basis.statements]
        said = dict.fromkeys(map(fm.sentence, [*warned, *stated, *found.notes]))
        return Computed(columns, (f"map: SHA-256 {fm.map_sha256(self.force_map)}", *said))


def placement_cases(entries: Entries) -> Iterator[PlacementCase]:
    """The cases of a study: every map with every path."""
    beside = entries.file.parent
    maps, paths, step = entries.texts("maps"), entries.texts("paths"), entries.number("step_m", _POSITION_STEP)
    own = entries.text("limit_table", "")
    table = fm.read_limit_table(beside / own) if own else None
    task = fm.read_task(beside / entries.text("task"), table=table)
    for source, path in itertools.product(maps, paths):
        file = beside / source
        force_map = fm.read_map(file) if file.is_file() else fm.published_map(source)
        yield PlacementCase(f"{source}, {path}", force_map, fm.read_path(beside / path), task, table, step)
