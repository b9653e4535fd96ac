"""What `forcemap figure` draws: a figure of each kind from maps, impacts, recordings, or the paper's planar arm."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import forcemap as fm
from forcemap import figures
from forcemap.assessment.assess_campaign import PLACES_APART
from forcemap.assessment.folder import read_recorded
from forcemap.assessment.missing import Missing, attempt, present
from forcemap.assessment.place_speeds import PlaceSpeeds, place_speeds
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.recorded_impacts import recorded_impacts
from forcemap.cli.check import SHOWN
from forcemap.cli.column_options import campaign_of, described
from forcemap.cli.options import (
    CONTACT_MISSING,
    bound_from,
    campaign_table,
    fitted,
    force_map_from,
    no_area,
    require_one_map,
    stated,
    wanted_form,
)
from forcemap.cli.task_options import path_from, task_from
from forcemap.comparisons.contact_model import ContactModel, contact_model
from forcemap.comparisons.force_models import maps_per_height
from forcemap.comparisons.map_and_standard import as_impacts
from forcemap.dynamics.mass_map import MassMap, planar_mass_map
from forcemap.dynamics.planar_arm import INSPECTION_DISTANCES, INSPECTION_HEIGHTS, PlanarArm, papers_arms
from forcemap.errors import UnknownName
from forcemap.figures.heights import default_cuts, states_shown
from forcemap.figures.maps import profile_states_shown, workspace_states_shown
from forcemap.figures.names import label
from forcemap.maps.bounds import Bound
from forcemap.words import sentence, sentences, warnings

_DENSE = 38, 33
"""Distances and heights of a dense grid, 1 cm apart, as dense as the paper's figure 3 seems; a choice."""


class Kind(StrEnum):
    """What there is to draw."""

    GRID = "grid"
    REPEATABILITY = "repeatability"
    PROFILES = "profiles"
    HEIGHTS = "heights"
    WORKSPACE = "workspace"
    RESIDUALS = "residuals"
    COMPARISON = "comparison"
    EVOLUTION = "evolution"
    SPEEDS = "speeds"
    TO_MEASURE = "to-measure"
    PATH = "path"
    PLANAR_POSTURES = "planar-postures"
    PLANAR_MASS = "planar-mass"


@dataclass(frozen=True, kw_only=True)
class Choices:
    """What a figure is drawn for; None is not chosen.

    Parameters
    ----------
    area : str or None
        Body area or region.
    contact : Contact or None
        Kind of contact.
    speeds : tuple of float or None
        Speeds at contact [m/s].
    distance, height : float or None
        Where to cut [m].
    moving_mass : float or None
        Mass of the robot's moving parts [kg].
    step : float or None
        Distance between places [m].
    path, task : str or None
        Files of a path and its task.
    form : str or None
        Form of the map that is fitted.
    """

    area: str | None = None
    contact: fm.Contact | None = None
    speeds: tuple[float, ...] | None = None
    distance: float | None = None
    height: float | None = None
    moving_mass: float | None = None
    step: float | None = None
    path: str | None = None
    task: str | None = None
    form: str | None = None

    def limit(self, source: Source) -> fm.ForceLimit:
        """The limit of the body area, in the table that a campaign names or else the standard's.

        Raises
        ------
        InputError
            None is chosen.
        """
        if self.area is None:
            raise no_area()
        return fm.force_limit(self.area, table=campaign_table(source.name))


@dataclass(frozen=True)
class Source:
    """What a figure is drawn of: a map, impacts, a campaign's folder.

    Parameters
    ----------
    name : str
        A map file, an impacts table, a campaign's folder, or a published map.
    form : str or None
        Form of the map that is fitted; that of the campaign if not given.
    """

    name: str
    form: str | None = None

    @cached_property
    def dataset(self) -> fm.ImpactDataset | None:
        """The impacts; None of a map."""
        self._require_there()
        return None if self._is_map else read_recorded(self.name)

    @cached_property
    def force_map(self) -> fm.ForceMap:
        """The map, fitted if there are impacts."""
        self._require_there()
        return force_map_from(self.name, self.form)[0] if self._is_map else fitted(self.name, self.form)[1]

    @cached_property
    def campaign(self) -> Campaign | None:
        """The campaign of a folder with a plan."""
        return fm.read_campaign(self.name) if Path(self.name, "plan.csv").exists() else None

    def impacts(self, kind: Kind) -> fm.ImpactDataset:
        """The impacts.

        Raises
        ------
        InputError
            There are none: it is a map.
        """
        if self.dataset is None:
            instead = "name their table or folder, with --form the form of its map"
            raise fm.InputError(f"found the map {self.name}, but {kind} shows impacts; {instead}")
        return self.dataset

    def mapped(self) -> figures.Mapped:
        """The map beside its impacts."""
        own = self.name if self._published else Path(self.name).resolve().stem
        return figures.Mapped(self.force_map, self.dataset, own)

    def model(self, choices: Choices) -> ContactModel:
        """The standard's contact model for the body area."""
        conditions = self.force_map.conditions
        return contact_model(conditions, choices.limit(self).name, moving_mass=choices.moving_mass)

    @property
    def _published(self) -> bool:
        return self.name in fm.PUBLISHED_MAPS and not Path(self.name).exists()

    @property
    def _is_map(self) -> bool:
        return self._published or self.name.lower().endswith(".json")

    def _require_there(self) -> None:
        require_one_map(self.name)
        if not (self._published or Path(self.name).exists()):
            expected = f"expected a file, a folder or a published map ({', '.join(fm.PUBLISHED_MAPS)})"
            raise fm.InputError(f"no such file; {expected}", file=self.name)


@dataclass(frozen=True)
class _Way:
    """How a kind is drawn, from how many sources, and which choices it knows."""

    draw: Callable[..., Figure]
    most: int
    choices: frozenset[str] = frozenset()


def draw(
    kind: Kind, sources: Sequence[Source], choices: Choices, *, width: float, said: list[str] | None = None
) -> Figure:
    """A figure of a kind.

    Parameters
    ----------
    kind : Kind
        What to draw.
    sources : sequence of Source
        Of what: maps, tables, folders, recordings.
    choices : Choices
        What for.
    width : float
        Width of the figure [m].
    said : list of str, optional
        Takes what must be read before speeds in the figure are used, which counts it alone.

    Raises
    ------
    InputError
        Too few or too many sources, or a choice that the kind does not know.
    """
    way = _WAYS[kind]
    if not min(way.most, 1) <= len(sources) <= way.most:
        wanted = {0: "none", 1: "one"}.get(way.most, f"one to {way.most}")
        raise fm.InputError(f"{kind}: found {len(sources)} sources, expected {wanted}")
    given = {field.name for field in fields(choices) if getattr(choices, field.name) is not None}
    if further := sorted(given - way.choices):
        knows = ", ".join(sorted(way.choices)).replace("_", " ") or "nothing more"
        raise fm.InputError(f"{further[0].replace('_', ' ')}: {kind} does not take it; it takes {knows}")
    doubts = {"said": [] if said is None else said} if kind in _OF_SPEEDS else {}
    return way.draw(list(sources), choices, width=width, **doubts)


def _grid(sources: list[Source], _: Choices, **size: Any) -> Figure:
    return figures.measurement_grid_figure(sources[0].impacts(Kind.GRID), **size)


def _states_of(source: Source) -> fm.ImpactDataset:
    """The impacts; of a map its states, with the forces that it predicts."""
    return as_impacts(source.force_map) if source.dataset is None else source.dataset


def _repeatability(sources: list[Source], _: Choices, **size: Any) -> Figure:
    dataset = sources[0].impacts(Kind.REPEATABILITY)
    if dataset.repeat.size == len(dataset.states):
        raise fm.InputError("found no state that was repeated, so nothing tells how repeats scatter")
    return figures.repeatability_figure(fm.repeatability(dataset), dataset, **size)


def _profiles(sources: list[Source], choices: Choices, **size: Any) -> Figure:
    _require_measured(sources, choices)
    (source,) = sources
    shown: dict[str, Any] = {"bound": bound_from(source.force_map), "speeds": choices.speeds}
    return figures.force_profiles_figure(source.force_map, source.dataset, **shown, **size)


def _require_measured(sources: list[Source], choices: Choices) -> None:
    """Refuse to cut where a map was not measured: nothing would be there."""
    cuts = (("distance", choices.distance), ("height", choices.height), *(("speed", v) for v in choices.speeds or ()))
    for source in sources:
        reach = source.force_map.measured_range
        for what, value in cuts:
            axis = ("distance", "height", "speed").index(what)
            low, high, unit = reach.lowest[axis], reach.highest[axis], ("m", "m", "m/s")[axis]
            if value is not None and not low - 1e-9 <= value <= high + 1e-9:
                expected = f"expected {low:g} to {high:g} {unit}, as was measured"
                raise fm.InputError(f"{what}: found {value:g} {unit}, {expected}", file=source.name)


def _heights(sources: list[Source], choices: Choices, **size: Any) -> Figure:
    _require_measured(sources, choices)
    return figures.force_heights_figure([source.mapped() for source in sources], speeds=choices.speeds, **size)


def left_out(kind: Kind, sources: Sequence[Source], choices: Choices) -> list[str]:
    """How many measured states of each source a figure of lines or slices does not show."""
    if kind is Kind.HEIGHTS:
        counts = states_shown([source.mapped() for source in sources], speeds=choices.speeds)
    elif kind in (Kind.PROFILES, Kind.WORKSPACE):
        shown = profile_states_shown if kind is Kind.PROFILES else workspace_states_shown
        counts = [shown(source.force_map, source.dataset, choices.speeds) for source in sources]
    else:
        return []
    return [
        f"{source.name}: {most - seen} of {most} measured states are not shown: they lie on no line or slice that is "
        f"drawn; forcemap figure residuals shows all states of their table or folder, --speeds-mps other speeds"
        for source, (seen, most) in zip(sources, counts, strict=True)
        if seen < most
    ]


def unlike(kind: Kind, sources: Sequence[Source], choices: Choices) -> list[str]:
    """Where panels that stand beside each other are cut at different places or speeds, which compare no forces."""
    if kind not in (Kind.HEIGHTS, Kind.COMPARISON) or len(sources) < 2:
        return []
    shown, lines = [source.mapped() for source in sources], []
    for axis, (name, unit) in enumerate((("distance", "m"), ("height", "m"), ("speed", "m/s"))):
        stated = choices.speeds if name == "speed" else getattr(choices, name)
        cuts = default_cuts(shown, axis, choices.speeds[0] if choices.speeds else None)
        if stated is None and len(set(cuts)) > 1 and (kind is Kind.COMPARISON or name == "speed"):
            listed = ", ".join(f"{source.name} {cut:g} {unit}" for source, cut in zip(sources, cuts, strict=True))
            no = f"the measured ranges of {name} have nothing in common, so no option makes them equal"
            lines.append(f"panels are at different {name}s, forces in them do not compare: {listed}; {no}")
    return lines


def _workspace(sources: list[Source], choices: Choices, **size: Any) -> Figure:
    _require_measured(sources, choices)
    return figures.workspace_figure(sources[0].force_map, sources[0].dataset, speeds=choices.speeds, **size)


def _residuals(sources: list[Source], _: Choices, **size: Any) -> Figure:
    (source,) = sources
    plan = source.campaign.plan if source.campaign else None
    return figures.residuals_figure(source.force_map, source.impacts(Kind.RESIDUALS), plan=plan, **size)


def _comparison(sources: list[Source], choices: Choices, **size: Any) -> Figure:
    if choices.speeds and len(choices.speeds) > 1:
        raise fm.InputError("speeds: comparison shows one speed, found several")
    _require_measured(sources, choices)
    speed = choices.speeds[0] if choices.speeds else None
    cut: dict[str, Any] = {"speed": speed, "height": choices.height, "distance": choices.distance}
    models = [source.model(choices).figures for source in sources]
    cut["maps_2d"] = [_maps_2d(_states_of(source)) for source in sources]
    if len(sources) == 1 and (dataset := sources[0].dataset) is not None:
        (cut["maps_2d"],), force_map = cut["maps_2d"], sources[0].force_map
        form = wanted_form(sources[0].form)
        comparison = fm.compare_force_models(dataset, form=form, bound=bound_from(force_map), **models[0])
        return figures.model_comparison_figure(comparison, dataset, force_map, **models[0], **cut, **size)
    return figures.standard_figure([source.mapped() for source in sources], models=models, **cut, **size)


def _maps_2d(dataset: fm.ImpactDataset) -> list[fm.ForceMap]:
    """The 2D map of all heights, and those of single ones."""
    return [fm.fit_force_map(dataset, form=fm.CFM_2D), *maps_per_height(dataset).values()]


def _evolution(sources: list[Source], choices: Choices, **size: Any) -> Figure:
    limit = None if choices.area is None else choices.limit(sources[0])
    impacts, conditions, names = zip(*(_impact_of(source.name) for source in sources), strict=True)
    (first, *beside) = impacts
    shown = {"conditions": next((each for each in conditions if each.simulated), conditions[0]), "names": names}
    return figures.force_evolution_figure(first.recording, first, limit, beside=beside, **shown, **size)


def _impact_of(name: str) -> tuple[fm.Impact, fm.Conditions, str]:
    """The first impact in a recording, FILE or FILE#CURVE, its conditions, and what to call it.

    Of a folder that of the largest force.
    """
    file, curve = _file_and_curve(_hardest(name) if Path(name).is_dir() else name)
    conditions, columns = described(file, None, None, None, None, None)
    recorded = recorded_impacts(file, conditions, columns)
    curves = [each.recording.curve for each in recorded]
    if curve and curve not in curves:
        raise UnknownName(f"curve of {file}", curve, curves)
    if not curve and len(curves) > 1:
        more = f" and {len(curves) - SHOWN} more" if len(curves) > SHOWN else ""
        listed = f"{', '.join(curves[:SHOWN])}{more}"
        raise fm.InputError(
            f"found {len(curves)} curves, expected one: name it as {file}#CURVE, of {listed}", file=file
        )
    chosen = (each for each in recorded if each.recording.curve == curve or not curve)
    impact = next((impact for each in chosen for impact in each.impacts), None)
    if impact is None:
        raise fm.InputError("found no impact, expected one to draw; forcemap inspect says why", file=file)
    folder, of_file = campaign_of(file, None), Path(file).stem
    called = Path(file).name + f"#{curve}" * bool(curve)
    return impact, conditions, _called(fm.read_campaign(folder), curve or of_file) if folder else called


def _file_and_curve(name: str) -> tuple[str, str]:
    """A file of recordings, and the curve that is named behind it after a "#"; a "#" may stand in either."""
    parts = name.split("#")
    if Path(name).exists():
        return name, ""
    ends = [number for number in range(len(parts) - 1, 0, -1) if Path("#".join(parts[:number])).is_file()]
    return ("#".join(parts[: ends[0]]), "#".join(parts[ends[0] :])) if ends else (name, "")


def _hardest(folder: str) -> str:
    """The recording of a campaign's largest force."""
    dataset = read_recorded(folder)
    recording = dataset.recording[int(np.argmax(np.where(dataset.censored, 0.0, dataset.peak_force)))]
    named = str(Path(folder, "recordings", str(recording)))
    if recording and Path(_file_and_curve(named)[0]).is_file():
        return named
    files = sorted(Path(folder, "recordings").rglob(f"{recording}*")) if recording else []
    if not files:
        raise fm.InputError("found no recording of its largest force; name the file of one", file=folder)
    return str(files[0])


def _called(campaign: Campaign, recording: str) -> str:
    """The robot with its setting, place and speed of a recording; without a plan's run its name, file or curve."""
    plan = campaign.plan
    robot = label(campaign.conditions)
    runs = np.flatnonzero(plan.recording == recording)
    if not runs.size:
        return f"{robot}, {recording}"
    d, h, v = (float(axis[runs[0]]) for axis in (plan.distance, plan.height, plan.speed))
    return f"{robot}, d {d:.2f} m, h {h:.2f} m, {v:.2f} m/s"


def _speeds(sources: list[Source], choices: Choices, *, said: list[str], **size: Any) -> Figure:
    found = _at_places(sources[0], choices)
    speeds = present(found.speeds)
    if np.isnan(speeds.speeds.speed_to_program).all():
        said.append(f"NO SPEED AT ANY PLACE: {sentence(_commonest(speeds))}")
    said += warnings([speeds.speeds.basis])
    said += [sentence(note) for note in speeds.speeds.basis.notes if note.kind is fm.FindingKind.NOT_CONFIRMED_YET]
    return figures.safe_speed_figure(speeds, standard=found.standard_speed, **size)


def _commonest(speeds: fm.SpeedMap) -> fm.Finding:
    """Why most places without a speed have none, those outside the measured range apart."""
    inside = speeds.speeds.to_program_outcome != fm.SpeedOutcome.OUTSIDE
    reasons = speeds.speeds.to_program_reason
    counted: Counter[fm.Finding] = Counter((reasons[inside] if inside.any() else reasons.ravel()).tolist())
    return counted.most_common(1)[0][0]


def _to_measure(sources: list[Source], choices: Choices, **size: Any) -> Figure:
    found = _at_places(sources[0], choices)
    plan = None if isinstance(found.measure_next, Missing) else found.measure_next.plan
    return figures.places_to_measure_figure(present(found.speeds), plan, **size)


def _at_places(source: Source, choices: Choices) -> PlaceSpeeds:
    """Speeds on a grid for the limit, with what to measure next."""
    limit = choices.limit(source)
    limit.require_permitted()
    if choices.contact is None:
        raise fm.InputError(CONTACT_MISSING)
    force_map = source.force_map
    measured = force_map.conditions if source.dataset is None else source.dataset
    return place_speeds(
        limit,
        choices.contact,
        force_map,
        bound_from(force_map),
        measured=measured,
        plan=source.campaign.plan if source.campaign else None,
        model=attempt(lambda: source.model(choices)),
        step=choices.step or PLACES_APART,
        allowance=fm.Allowance(),
    )


def _path(sources: list[Source], choices: Choices, *, said: list[str], **size: Any) -> Figure:
    if choices.path is None:
        raise fm.InputError("path: expected --path, the file of a path")
    tool_path = path_from(choices.path)
    chosen = [text for text in (choices.task, choices.area) if text is not None]
    task = task_from(stated(chosen, sources[0].name), tool_path.names, choices.contact)
    bound: Bound = bound_from(sources[0].force_map)
    speeds = fm.path_speeds(sources[0].force_map, tool_path, task, bound=bound)
    said += [*sentences((*speeds.atlas.warnings, *speeds.doubts)), *warnings(speeds.bases)]
    return figures.path_speeds_figure(speeds, **size)


def _planar_postures(_: list[Source], __: Choices, **size: Any) -> Figure:
    arms = papers_arms()
    nine = INSPECTION_DISTANCES, INSPECTION_HEIGHTS
    variants = {name: planar_mass_map(arm, *nine) for name, arm in arms.items()}
    return figures.planar_inspection_figure(variants, arm=next(iter(arms.values())), **size)


def _planar_mass(_: list[Source], __: Choices, **size: Any) -> Figure:
    name, arm = next(iter(papers_arms().items()))
    return figures.planar_mass_figure(_dense(arm), title=name, **size)


def _dense(arm: PlanarArm) -> MassMap:
    ends = (INSPECTION_DISTANCES, _DENSE[0]), (INSPECTION_HEIGHTS, _DENSE[1])
    return planar_mass_map(arm, *(np.linspace(places[0], places[-1], count) for places, count in ends))


_OF_SPEEDS = (Kind.SPEEDS, Kind.PATH)
_CUT = {"speeds", "distance", "height"}
_WAYS = {
    Kind.GRID: _Way(_grid, 1),
    Kind.REPEATABILITY: _Way(_repeatability, 1),
    Kind.PROFILES: _Way(_profiles, 1, frozenset({"speeds", "form"})),
    Kind.HEIGHTS: _Way(_heights, 3, frozenset({"speeds", "form"})),
    Kind.WORKSPACE: _Way(_workspace, 1, frozenset({"speeds", "form"})),
    Kind.RESIDUALS: _Way(_residuals, 1, frozenset({"form"})),
    Kind.COMPARISON: _Way(_comparison, 3, frozenset({"area", "moving_mass", "form", *_CUT})),
    Kind.EVOLUTION: _Way(_evolution, 4, frozenset({"area"})),
    Kind.SPEEDS: _Way(_speeds, 1, frozenset({"area", "contact", "step", "moving_mass", "form"})),
    Kind.TO_MEASURE: _Way(_to_measure, 1, frozenset({"area", "contact", "step", "moving_mass", "form"})),
    Kind.PATH: _Way(_path, 1, frozenset({"path", "task", "area", "contact", "form"})),
    Kind.PLANAR_POSTURES: _Way(_planar_postures, 0),
    Kind.PLANAR_MASS: _Way(_planar_mass, 0),
}
