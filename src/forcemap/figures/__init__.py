"""Figures: every result of forcemap to look at (matplotlib). They take results and compute nothing."""

from forcemap.figures.evolution import force_evolution_figure
from forcemap.figures.formats import png, svg
from forcemap.figures.grid import measurement_grid_figure
from forcemap.figures.model_comparison import model_comparison_figure
from forcemap.figures.path_speeds import path_speeds_figure
from forcemap.figures.planar import planar_inspection_figure, planar_mass_figure
from forcemap.figures.profiles import force_profiles_figure
from forcemap.figures.repeatability import repeatability_figure
from forcemap.figures.residuals import residuals_figure
from forcemap.figures.safe_speeds import safe_speed_figure
from forcemap.figures.style import COLUMN_WIDTH, PAGE_WIDTH
from forcemap.figures.workspace import workspace_figure

__all__ = [
    "COLUMN_WIDTH",
    "PAGE_WIDTH",
    "force_evolution_figure",
    "force_profiles_figure",
    "measurement_grid_figure",
    "model_comparison_figure",
    "path_speeds_figure",
    "planar_inspection_figure",
    "planar_mass_figure",
    "png",
    "repeatability_figure",
    "residuals_figure",
    "safe_speed_figure",
    "svg",
    "workspace_figure",
]
