"""A URScript function that returns the allowed speed for a pose."""

from __future__ import annotations

from forcemap.exports.head import head_comment
from forcemap.exports.robot_table import RobotTable

_FUNCTION = """\
def forcemap_speed(pose):
  # allowed speed of the contact point [m/s] for its pose in the frame of the base; 0 is no permission
  local distance_edges = {distance_edges}
  local height_edges = {height_edges}
  local speeds = {speeds}
  local distance = sqrt(pose[0] * pose[0] + pose[1] * pose[1])
  local height = pose[2]
  local speed = 0.0
  local i = 0
  local j = 0
  if distance >= {nearest} and distance <= {farthest} and height >= {lowest} and height <= {highest}:
    while i < {last_i} and distance >= distance_edges[i + 1]:
      i = i + 1
    end
    while j < {last_j} and height >= height_edges[j + 1]:
      j = j + 1
    end
    speed = speeds[i * {columns} + j]
  end
  return speed
end
"""


def urscript(table: RobotTable) -> str:
    """The text of a URScript file with the function `forcemap_speed(pose)` [m/s].

    Zones run along distance first; what is outside, unconfirmed or no number gives 0.
    """
    rows, columns = table.speed_mmps.shape
    function = _FUNCTION.format(
        distance_edges=_list(table.distance_edges.tolist()),
        height_edges=_list(table.height_edges.tolist()),
        speeds=_list([speed / 1000 for speed in table.speed_mmps.ravel().tolist()]),
        nearest=f"{table.distance_edges[0]:.3f}",
        farthest=f"{table.distance_edges[-1]:.3f}",
        lowest=f"{table.height_edges[0]:.3f}",
        highest=f"{table.height_edges[-1]:.3f}",
        last_i=rows - 1,
        last_j=columns - 1,
        columns=columns,
    )
    return "\n".join([*head_comment(table.provenance, "#"), function])


def _list(values: list[float]) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in values) + "]"
