"""A comparison with effective mass, as JSON and as text."""

from __future__ import annotations

from typing import Any

import numpy as np

from forcemap import MassComparison
from forcemap.cli.output import listing, table


def mass_comparison_result(comparison: MassComparison) -> dict[str, Any]:
    """A MassComparison for JSON."""
    columns = zip(
        comparison.distance, comparison.height, comparison.measured_force, comparison.measured_mass, strict=True
    )
    return {
        "on": comparison.on,
        "robot": comparison.robot,
        "speed_mps": comparison.speed,
        "stiffness_N_per_m": comparison.stiffness,
        "force_spread": comparison.force_spread,
        "places": [
            {
                "distance_m": float(d),
                "height_m": float(h),
                "force_N": float(force),
                "measured_effective_mass_kg": float(mass),
                "by_mass": [
                    {
                        "effective_mass_kg": float(each.mass.value[i]),
                        "outcome": each.mass.outcome[i].value,
                        "force_N": float(each.force[i]),
                        "ratio": float(each.ratio[i]),
                    }
                    for each in comparison.explanations
                ],
            }
            for i, (d, h, force, mass) in enumerate(columns)
        ],
        "by_mass": [
            {
                "name": each.name,
                "assumption": each.mass.assumption,
                "places": each.places,
                "rank_correlation": each.rank_correlation,
                "explained_share": each.explained_share,
                "explained_share_scaled": each.explained_share_scaled,
                "ratio_lowest": float(np.nanmin(each.ratio)),
                "ratio_highest": float(np.nanmax(each.ratio)),
            }
            for each in comparison.explanations
        ],
        "statements": list(comparison.statements),
    }


def mass_comparison_lines(comparison: MassComparison) -> list[str]:
    """A MassComparison in words."""
    mass = comparison.measured_mass
    lines = [
        f"Forces of {comparison.on} at {comparison.speed:g} m/s beside F = v sqrt(k m_u) of {comparison.robot}",
        f"they vary by a factor of {comparison.force_spread:.2f}; "
        f"the effective mass that they would take, (F / v)^2 / k, is {mass.min():.1f} to {mass.max():.1f} kg",
    ]
    rows = []
    for each in comparison.explanations:
        value = each.mass.value[np.isfinite(each.mass.value)]
        rows.append(
            [
                each.name,
                str(each.places),
                f"{value.min():.1f} to {value.max():.1f} kg",
                f"{np.nanmin(each.ratio):.2f} to {np.nanmax(each.ratio):.2f}",
                f"{each.rank_correlation:.2f}",
                f"{100 * each.explained_share:.0f} %",
                f"{100 * each.explained_share_scaled:.0f} %",
            ]
        )
    header = ["effective mass", "places", "m_u", "force / F", "rank corr.", "of ln F explained", "with one factor"]
    lines += ["", *table(header, rows)]
    for each in comparison.explanations:
        lines += ["", f"force / F, {each.name}", *_ratio_map(comparison, each.ratio)]
    return [*lines, "", *listing("This holds for", comparison.statements)]


def _ratio_map(comparison: MassComparison, ratio: Any) -> list[str]:
    distances, heights = np.unique(comparison.distance), np.unique(comparison.height)
    cell = {
        (d, h): f"{r:.2f}" if np.isfinite(r) else "."
        for d, h, r in zip(comparison.distance, comparison.height, ratio, strict=True)
    }
    rows = [[f"{h:.3f}", *(cell.get((d, h), "") for d in distances)] for h in heights[::-1]]
    return table(["h \\ d [m]", *(f"{d:.3f}" for d in distances)], rows)
