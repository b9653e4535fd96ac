"""URScript functions that return the allowed speed for a pose, or for a straight motion."""

from __future__ import annotations

import itertools

import numpy as np

from forcemap.exports.directed_tables import DirectedTables
from forcemap.exports.head import comment_lines, head_comment, way_spacing
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

_USE = """\
how to ask it: the TCP is the contact site, the motion (movel) is straight and in the map's direction; take the least
along the whole way to a pose there, asked every {spacing_mm:g} mm, never the speed at one end; on 0 do not move
(docs/universal_robots.md)
  here = get_actual_tcp_pose()
  v = forcemap_speed(there)
  i = 0.0
  while i < 1.0:
    w = forcemap_speed(interpolate_pose(here, there, i))
    if w < v:
      v = w
    end
    i = i + {spacing} / (point_dist(here, there) + {spacing})
  end
  if v > 0, and only then: movel(there, a = 1.0, v = v)
"""

_USE_ALONG = """\
how to ask it: the TCP is the point whose motion the maps are of; one question holds for the whole straight way
(movel) to a pose there; on 0 do not move (docs/universal_robots.md, docs/atlas.md)
  v = forcemap_speed_along(get_actual_tcp_pose(), there, {tool})
  if v > 0, and only then: movel(there, a = 1.0, v = v)
"""

_ALONG = """\
def forcemap_speed_along(start, target, tool):
  # allowed speed of the contact point [m/s] on the straight way between two poses in the frame of the base, with a tool
  # by its number in the head; 0 is no permission
  local tools = {tools}
  local needed = {needed}
  local site_x = {site_x}
  local site_y = {site_y}
  local site_z = {site_z}
  local directions = {directions}
  local level = {level}
  local site = {site}
  local tool_of = {tool_of}
  local distance_edges = {distance_edges}
  local first_distance = {first_distance}
  local height_edges = {height_edges}
  local first_height = {first_height}
  local speeds = {speeds}
  local first_speed = {first_speed}
  local x = target[0] - start[0]
  local y = target[1] - start[1]
  local z = target[2] - start[2]
  local length = sqrt(x * x + y * y + z * z)
  local from_x = 0.0
  local from_y = 0.0
  local to_x = 0.0
  local to_y = 0.0
  local start_distance = 0.0
  local target_distance = 0.0
  local nearest = 0.0
  local farthest = 0.0
  local lowest = 0.0
  local highest = 0.0
  local share = 0.0
  local aside = 0.0
  local along = 0.0
  local least = 0.0
  local beside = 0.0
  local cosine = 0.0
  local speed = 0.0
  local of_site = 0.0
  local allowed = 0.0
  local columns = 0
  local at = 0
  local t = 0
  local s = 0
  local k = 0
  local i = 0
  local j = 0
  if length > 0.000001:
    while t < {count}:
      if tools[t] == tool:
        allowed = 9.0
        s = 0
        while s < {sites}:
          if needed[t * {sites} + s] > 0:
            from_x = start[0] + site_x[s]
            from_y = start[1] + site_y[s]
            to_x = target[0] + site_x[s]
            to_y = target[1] + site_y[s]
            start_distance = sqrt(from_x * from_x + from_y * from_y)
            target_distance = sqrt(to_x * to_x + to_y * to_y)
            nearest = start_distance
            farthest = start_distance
            if target_distance < nearest:
              nearest = target_distance
            end
            if target_distance > farthest:
              farthest = target_distance
            end
            if x * x + y * y > 0.0:
              share = (0.0 - from_x * x - from_y * y) / (x * x + y * y)
              if share > 0.0 and share < 1.0:
                along = from_x + share * x
                aside = from_y + share * y
                nearest = sqrt(along * along + aside * aside)
              end
            end
            lowest = start[2] + site_z[s]
            highest = lowest
            if target[2] + site_z[s] < lowest:
              lowest = target[2] + site_z[s]
            end
            if target[2] + site_z[s] > highest:
              highest = target[2] + site_z[s]
            end
            of_site = 0.0
            k = 0
            while k < {tables}:
              if tool_of[k] == t + 1 and site[k] == s + 1 and nearest > {closest}:
                # the motion must point along the table's direction at both ends, wherever beside it the robot is
                cosine = {cosine}
                if level[k] > 0.0:
                  beside = {tolerance} / nearest
                  cosine = {cosine} * sqrt(1.0 - beside * beside) + {sine} * beside
                end
                along = directions[3 * k] * from_x - directions[3 * k + 1] * from_y
                aside = directions[3 * k] * from_y + directions[3 * k + 1] * from_x
                least = (x * along + y * aside) / start_distance
                along = directions[3 * k] * to_x - directions[3 * k + 1] * to_y
                aside = directions[3 * k] * to_y + directions[3 * k + 1] * to_x
                along = (x * along + y * aside) / target_distance
                if along < least:
                  least = along
                end
                if least >= 0.0 and least + z * directions[3 * k + 2] >= cosine * length:
                  speed = 9.0
                  columns = first_height[k + 1] - first_height[k] - 1
                  if nearest < distance_edges[first_distance[k]]:
                    speed = 0.0
                  end
                  if farthest > distance_edges[first_distance[k + 1] - 1]:
                    speed = 0.0
                  end
                  if lowest < height_edges[first_height[k]]:
                    speed = 0.0
                  end
                  if highest > height_edges[first_height[k + 1] - 1]:
                    speed = 0.0
                  end
                  i = first_distance[k]
                  while i < first_distance[k + 1] - 1:
                    if distance_edges[i] <= farthest and distance_edges[i + 1] >= nearest:
                      j = first_height[k]
                      while j < first_height[k + 1] - 1:
                        if height_edges[j] <= highest and height_edges[j + 1] >= lowest:
                          at = first_speed[k] + (i - first_distance[k]) * columns + j - first_height[k]
                          if speeds[at] < speed:
                            speed = speeds[at]
                          end
                        end
                        j = j + 1
                      end
                    end
                    i = i + 1
                  end
                  of_site = speed
                end
              end
              k = k + 1
            end
            if of_site < allowed:
              allowed = of_site
            end
          end
          s = s + 1
        end
      end
      t = t + 1
    end
  end
  if allowed > 8.0:
    allowed = 0.0
  end
  return allowed
end
"""


def urscript_along(tables: DirectedTables) -> str:
    """The text of a URScript file with the function `forcemap_speed_along(start, target, tool)` [m/s].

    It holds for straight motions (movel) from one pose to another. What points along no table's direction, leaves the
    zones, has a contact site without a table, or is no number gives 0.
    """
    zones, (cosine, sine) = [each.table for each in tables.tables], tables.cosine_and_sine
    vectors = np.array([each.campaign.direction for each in tables.tables])
    numbers = [tables.numbers(each) for each in tables.tables]
    offsets = np.array(tables.offsets).T.tolist()
    function = _ALONG.format(
        directions=_exact(vectors.ravel().tolist()),
        level=_exact(np.hypot(*vectors.T[:2]).tolist()),
        site=[site for site, _ in numbers],
        tool_of=[tool for _, tool in numbers],
        needed=list(itertools.chain(*tables.needed)),
        distance_edges=_list([edge for table in zones for edge in table.distance_edges.tolist()]),
        first_distance=_starts([table.distance_edges.size for table in zones]),
        height_edges=_list([edge for table in zones for edge in table.height_edges.tolist()]),
        first_height=_starts([table.height_edges.size for table in zones]),
        speeds=_list([speed / 1000 for table in zones for speed in table.speed_mmps.ravel().tolist()]),
        first_speed=_starts([table.speed_mmps.size for table in zones]),
        closest=f"{tables.closest:.6f}",
        tolerance=f"{tables.provenance.allowance.position:.6f}",
        cosine=f"{cosine:.12f}",
        sine=f"{sine:.12f}",
        sites=len(tables.sites),
        tools=list(tables.codes),
        count=len(tables.tools),
        site_x=_exact(offsets[0]),
        site_y=_exact(offsets[1]),
        site_z=_exact(offsets[2]),
        tables=len(zones),
    )
    use = _USE_ALONG.format(tool=tables.codes[0])
    return "\n".join([*comment_lines([*tables.lines, *use.splitlines()], "#"), function])


def _starts(sizes: list[int]) -> list[int]:
    """Where each part of a list begins, and where the last one ends."""
    return [0, *itertools.accumulate(sizes)]


def _exact(values: list[float]) -> str:
    return "[" + ", ".join(f"{value + 0.0:.12f}" for value in values) + "]"


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
    spacing = way_spacing(table.provenance)
    use = comment_lines(_USE.format(spacing=f"{spacing:g}", spacing_mm=1000 * spacing).splitlines(), "#")
    return "\n".join([*head_comment(table.provenance, "#"), *use, function])


def _list(values: list[float]) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in values) + "]"
