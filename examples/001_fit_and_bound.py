"""From a table of impacts to a bounded map: fit, accuracy, tolerance bound.

Run: python examples/001_fit_and_bound.py
"""

from __future__ import annotations

import tempfile

import forcemap as fm

folder = fm.copy_example("ur10e", tempfile.mkdtemp())  # a simulated campaign; your own folder works the same
dataset = fm.read_dataset(folder)
force_map = fm.fit_force_map(dataset)  # the paper's nine coefficients, from the 27 training states

for term, coefficient in zip(force_map.form.term_names, force_map.coefficients, strict=True):
    print(f"{term:6s} {coefficient:9.4f}")

accuracy = fm.map_accuracy(force_map, dataset)[0]  # on test states that were not fitted, if there are six or more
print(
    f"{accuracy.states} {accuracy.on}: underestimated by at most {accuracy.max_underestimation_percent:.1f} %, "
    f"overestimated by at most {accuracy.max_overestimation_percent:.1f} %"
)

place = (0.8, 0.4)  # distance and height [m]
for speed in (0.2, 0.3, 0.4):
    predicted = force_map.predict(*place, speed)
    bound = fm.ToleranceBound().upper(force_map, *place, speed)
    print(f"at {speed:.2f} m/s: predicted {predicted:.0f} N, bound {bound:.0f} N")
