"""A sheet with what a person would type into a robot's safety configuration, and what they must check first."""

from __future__ import annotations

from forcemap.exports.head import head_lines
from forcemap.robot_tables import RobotTable


def safety_proposal(table: RobotTable) -> str:
    """The text of the sheet (Markdown): one speed limit for the largest block of zones, planes, and lines to sign."""
    block = widest_block(table)
    lines = ["# Proposal for the safety configuration", "", *(f"- {line}" for line in head_lines(table.provenance)), ""]
    if block is None:
        return "\n".join([*lines, "No zone has a permitted speed: there is nothing to configure.", ""])
    first, last, bottom, top, speed = block
    near, far = table.distance_edges[first], table.distance_edges[last]
    low, high = table.height_edges[bottom], table.height_edges[top]
    entries = [
        ("tool speed limit", f"{speed / 1000:.3f} m/s", "lowest speed of the zones below, allowance subtracted"),
        ("least distance of the contact point from the base z-axis", f"{near:.3f} m", "safety plane or zone"),
        ("largest distance", f"{far:.3f} m", "safety plane or zone"),
        ("least height above the base", f"{low:.3f} m", "safety plane"),
        ("largest height", f"{high:.3f} m", "safety plane"),
    ]
    lines += ["| entry | proposed | note | typed in | by, date |", "|---|---|---|---|---|"]
    lines += [f"| {name} | {value} | {note} | | |" for name, value, note in entries]
    lines += [
        "",
        "The block is the rectangle of permitted zones with the largest area times speed. A faster program needs the",
        "table of zones; the safety configuration knows one speed.",
        "",
        "- [ ] the campaign's safety settings are those of this robot; changing them makes the map invalid",
        "- [ ] speeds confirmed by measurement at the places used: ______________________",
        "- [ ] checksum of the safety configuration after typing in: ______________________",
        "- [ ] released by (risk assessment): ______________________  date: ______________",
        "",
    ]
    return "\n".join(lines)


def widest_block(table: RobotTable) -> tuple[int, int, int, int, int] | None:
    """Edges from, to along distance and height, and lowest speed [mm/s], of the rectangle largest in area x speed."""
    speeds = table.speed_mmps
    best, found = 0.0, None
    rows, columns = speeds.shape
    for first in range(rows):
        least = speeds[first]
        for last in range(first + 1, rows + 1):
            least = least if last == first + 1 else least.clip(max=speeds[last - 1])
            for bottom in range(columns):
                lowest = int(least[bottom])
                for top in range(bottom + 1, columns + 1):
                    lowest = min(lowest, int(least[top - 1]))
                    if lowest == 0:
                        break
                    wide = table.distance_edges[last] - table.distance_edges[first]
                    worth = lowest * wide * (table.height_edges[top] - table.height_edges[bottom])
                    if worth > best:
                        best, found = float(worth), (first, last, bottom, top, lowest)
    return found
