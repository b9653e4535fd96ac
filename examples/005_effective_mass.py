"""What effective mass says of the forces over a workspace, and what it does not.

Run: python examples/005_effective_mass.py
"""

from __future__ import annotations

import forcemap as fm
from forcemap.dynamics.mass_map import planar_mass_map
from forcemap.dynamics.planar_arm import (
    INSPECTION_DISTANCES,
    INSPECTION_HEIGHTS,
    LINK_ALIGNED,
    LinkMass,
    PlanarArm,
    Wrist,
)
from forcemap.dynamics.robots import identified_drive_inertia

# the paper's planar arm: what the paper does not state has to be chosen
arm = PlanarArm(link_mass=LinkMass.UNIFORM_ROD, last_link=LINK_ALIGNED, wrist=Wrist.LOCKED, base_height=0.18)
planar = planar_mass_map(arm, INSPECTION_DISTANCES, INSPECTION_HEIGHTS)
print(f"planar arm: {planar.trend_with_distance} with distance, {planar.trend_with_height} with height")
print(planar.mass.value.round(2))

# a real robot at a place, with and without the inertia of its drives
robot = fm.robot_named("ur10e")
with_drives = robot.with_drive_inertia(identified_drive_inertia("ur10e"))
for each in (robot, with_drives):
    mass = fm.robot_effective_mass_at(each, 0.8, 0.4)
    print(f"{each.name} at d = 0.8 m, h = 0.4 m: {mass.value:.2f} kg ({mass.assumption})")
print(f"the standard's, for every place: {robot.standard_effective_mass:.1f} kg")
print(f"2 m away: {fm.robot_effective_mass_at(robot, 2.0, 0.4).outcome}")

# the published forces beside F = v sqrt(k m_u)
comparison = fm.compare_effective_mass(fm.published_map("ur10e"), with_drives)
print(f"forces vary by a factor of {comparison.force_spread:.2f} at {comparison.speed} m/s")
for each in comparison.explanations:
    print(
        f"{each.name}: force / F from {each.ratio.min():.2f} to {each.ratio.max():.2f}, rank correlation "
        f"{each.rank_correlation:.2f}, {100 * each.explained_share_scaled:.0f} % of ln F explained with one factor"
    )
print(fm.sentence(comparison.statements[-1]))
