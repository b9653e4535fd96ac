"""Make the pictures of the documentation: figures of a simulated example campaign and of the published maps.

Run from the root of the project; the same software gives the same files.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import forcemap as fm
from forcemap import figures
from forcemap.comparisons.contact_model import contact_model
from forcemap.dynamics.mass_map import planar_mass_map
from forcemap.dynamics.planar_arm import INSPECTION_DISTANCES, INSPECTION_HEIGHTS, papers_arms
from forcemap.figures.names import label
from forcemap.files import write_atomically
from forcemap.lab.example_campaigns import simulate_example

PICTURES = Path("docs/pictures")
LARGEST = 150_000  # bytes of one picture

AREA = "back_of_hand"


def campaign_figures(folder: Path, other: Path) -> Iterator[tuple[str, Figure]]:
    """Figures of one simulated campaign; an impact of another one stands beside its own."""
    campaign = fm.read_campaign(folder)
    dataset = fm.build_dataset(campaign)
    force_map, limit, bound = fm.fit_force_map(dataset), fm.force_limit(AREA), fm.ToleranceBound()
    yield "force-profiles", figures.force_profiles_figure(force_map, dataset, bound=bound)
    yield "measurement-grid", figures.measurement_grid_figure(dataset)
    yield "workspace", figures.workspace_figure(force_map, dataset)
    yield "residuals", figures.residuals_figure(force_map, dataset)
    yield "repeatability", figures.repeatability_figure(fm.repeatability(dataset), dataset)
    grid, model = fm.measured_grid(force_map, 0.05), contact_model(dataset.conditions, AREA)
    for contact in fm.Contact:
        speeds = fm.speed_map(force_map, *grid, limit=limit, bound=bound, contact=contact)
        standard = model.speed_limit(limit, contact)
        yield f"safe-speeds-{contact}", figures.safe_speed_figure(speeds, standard=standard)

    conditions, masses = dataset.conditions, model.figures
    comparison = fm.compare_force_models(dataset, bound=bound, limit=limit, **masses)
    maps_2d = [fm.fit_force_map(dataset, form=fm.CFM_2D)]
    yield (
        "model-comparison",
        figures.model_comparison_figure(comparison, dataset, force_map, maps_2d=maps_2d, **masses),
    )
    impacts = [an_impact(each) for each in (folder, other)]
    names = [f"{label(fm.read_campaign(each).conditions)}, 0.20 m/s" for each in (folder, other)]
    evolution = figures.force_evolution_figure(
        impacts[0].recording, impacts[0], limit, beside=impacts[1:], names=names, conditions=conditions
    )
    yield "force-evolution", evolution


def an_impact(folder: Path) -> fm.Impact:
    """The first impact at the slowest speed, farthest out and lowest."""
    campaign = fm.read_campaign(folder)
    run = np.lexsort((campaign.plan.repeat, campaign.plan.height, -campaign.plan.distance, campaign.plan.speed))[0]
    (file,) = (folder / "recordings").glob(f"{campaign.plan.recording[run]}.*")
    recording = fm.read_recording(file, columns=campaign.columns)
    return fm.find_impact(replace(recording, device=campaign.conditions.device))


def published_figures() -> Iterator[tuple[str, Figure]]:
    """Figures that need no campaign: a published map's path speeds, the planar arm."""
    arms = papers_arms()
    nine = (INSPECTION_DISTANCES, INSPECTION_HEIGHTS)
    first = next(iter(arms.values()))
    variants = {name: planar_mass_map(arm, *nine) for name, arm in arms.items()}
    yield "planar-inspection", figures.planar_inspection_figure(variants, arm=first)
    dense = planar_mass_map(first, np.linspace(0.52, 0.89, 38), np.linspace(0.14, 0.46, 33))
    yield "planar-mass", figures.planar_mass_figure(dense)
    force_map = fm.published_map("kuka-iiwa7-10nm")
    yield "force-profiles-kuka", figures.force_profiles_figure(force_map, bound=fm.FixedMargin(0.10))
    yield "path-speeds", figures.path_speeds_figure(documented_path())


def documented_path() -> fm.PathSpeeds:
    """The speeds along the path of docs/robot_program.md."""
    page = Path("docs/robot_program.md").read_text()
    with tempfile.TemporaryDirectory() as home:
        for name, kind in (("path.csv", "csv"), ("task.toml", "toml")):
            (text,) = re.findall(rf"```{kind}\n(.*?)```", page, re.S)[:1]
            Path(home, name).write_text(text)
        path, task = fm.read_path(Path(home, "path.csv")), fm.read_task(Path(home, "task.toml"))
    return fm.path_speeds(fm.published_map("ur10e"), path, task, bound=fm.FixedMargin(0.10))


def main() -> None:
    """Write all pictures."""
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as home:
        folders = [simulate_example(name, Path(home, name)).folder for name in ("ur10e", "kuka-iiwa7-30nm")]
        for name, figure in [*campaign_figures(*folders), *published_figures()]:
            picture = figures.png(figure, dpi=135)
            if len(picture) > LARGEST:
                raise SystemExit(f"{name}.png: found {len(picture)} bytes, expected at most {LARGEST}")
            write_atomically(PICTURES / f"{name}.png", picture)
            print(f"{PICTURES / name}.png: {len(picture) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
