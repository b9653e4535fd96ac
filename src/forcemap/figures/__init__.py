"""Figures: every result of forcemap to look at (matplotlib). They take results and compute nothing."""

from forcemap.figures.evolution import force_evolution_figure
from forcemap.figures.formats import figure_file, pdf, png, svg
from forcemap.figures.grey import in_grey
from forcemap.figures.heights import Mapped, force_heights_figure
from forcemap.figures.maps import force_profiles_figure, model_comparison_figure, residuals_figure, workspace_figure
from forcemap.figures.measured import measurement_grid_figure, repeatability_figure
from forcemap.figures.places import places_to_measure_figure
from forcemap.figures.planar import planar_inspection_figure, planar_mass_figure
from forcemap.figures.speeds import path_speeds_figure, safe_speed_figure
from forcemap.figures.standard import standard_figure
from forcemap.figures.style import COLUMN_WIDTH, PAGE_WIDTH

__all__ = [
    "COLUMN_WIDTH", "PAGE_WIDTH", "Mapped", "figure_file", "force_evolution_figure", "force_heights_figure",
    "force_profiles_figure", "in_grey", "measurement_grid_figure", "model_comparison_figure", "path_speeds_figure",
    "pdf", "places_to_measure_figure", "planar_inspection_figure", "planar_mass_figure", "png", "repeatability_figure",
    "residuals_figure", "safe_speed_figure", "standard_figure", "svg", "workspace_figure",
]  # fmt: skip
