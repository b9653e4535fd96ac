"""Joint room: design x expected force x limit -> what to measure, next, and to confirm.

- A whole campaign: `measurements` (plan_measurements), by `design`; I-optimal by `optimal_states` and its search
  `optimal_exchange`; `bound_width` and `designed_plan` say what a design is expected to give.
- What to measure next: `next_measurements`, its search `next_search`, what further states gain `next_outlook`, and
  its arguments `next_inputs`.
- How fast may be measured: `ladder`, by what to expect (`expectation`) and what was measured (`measured_before`).
- What confirms a map: `confirmation`, the choice `confirmation_states`, the answer `confirmation_result`.
- What all share: `places`, `runs`, `run_sheet`, `plan_warnings`.
"""
