"""The paper's conclusion, 0.8 m away and 0.4 m above the base, with a bound and within what was measured.

Run: python examples/002_what_the_published_maps_allow.py
"""

from __future__ import annotations

import math

import forcemap as fm

hand = fm.force_limit("back_of_hand")
region = fm.body_region("back_of_hand")

for name in fm.PUBLISHED_MAPS:
    force_map = fm.published_map(name)
    robot_mass = fm.pfl_robot_mass(force_map.conditions.moving_mass, force_map.conditions.payload)
    print(name)
    for contact in fm.Contact:
        newtons = hand.force(contact)
        answer = fm.safe_speed(force_map, 0.8, 0.4, limit=hand, contact=contact, bound=fm.FixedMargin(0.10))
        formula = fm.pfl_speed_limit(newtons, robot_mass=robot_mass, body_mass=math.inf, stiffness=region.stiffness)
        crossing = force_map.crossing_speed(0.8, 0.4, newtons)
        speed = f"{fm.floor_speed(answer.speed)} m/s at contact" if answer.outcome.has_speed else "no speed"
        print(
            f"  {contact}, {newtons:g} N: {answer.outcome}, {speed} ({fm.sentence(answer.reason)}); "
            f"the prediction alone reaches the limit at {fm.floor_speed(crossing)} m/s, "
            f"the contact model says {fm.floor_speed(formula)} m/s"
        )
