"""Design x expected force x limit -> what to measure: a whole campaign, what comes next, what confirms a map.

- A whole campaign: `measurements` (plan_measurements), by `design`; its states by `chosen_states`: of grids, spread
  ones by `spread_states`, I-optimal ones by `optimal_states`, which also computes the bound to expect.
- What to measure next: `next/measurements` (next_measurements), its `search`, how fast may be measured (`ladder`), and
  what further states gain (`outlook`).
- What confirms a map: `confirm` (confirm_plan), the rule and its answer.
- What they share: `places` to choose from, `runs` of states, the force to expect (`expectation`) and what was
  `measured_before`, `plan_warnings`.
"""
