"""Options that several commands share, and what they stand for."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

import forcemap as fm
from forcemap import LimitTable as TableOfLimits
from forcemap.campaigns.conditions import CAMPAIGN_FILE, FORM_NAMES
from forcemap.maps.bounds import Bound
from forcemap.maps.forms import form_of

if TYPE_CHECKING:  # most commands take one map
    from forcemap.paths.atlas import Atlas

Json = Annotated[bool, Option("--json", help="Print one JSON object.")]
TeamRegister = Annotated[
    str | None, Option("--register", metavar="FILE|URL", help="The team's register (docs/register.md).")
]
Table = Annotated[str, Argument(help="Impacts table (CSV) or campaign folder.")]
Source = Annotated[str, Argument(help=f"Map file, impacts table, campaign folder, or {', '.join(fm.PUBLISHED_MAPS)}.")]
Maps = Annotated[
    str,
    Argument(
        metavar="SOURCE",
        help=f"Map file, impacts table, campaign folder, or {', '.join(fm.PUBLISHED_MAPS)}; or an atlas: a folder of "
        "campaigns of one robot, or atlas.toml.",
    ),
]
FormName = Annotated[
    str | None,
    Option(
        "--form",
        help=f"Form to fit: {', '.join(FORM_NAMES)}; default: as campaign.toml states (map.form), else "
        "CFM_3D; see docs/forms.md.",
    ),
]
LimitTable = Annotated[str | None, Option("--limit-table", help="Your own table of limits (CSV).")]
_LIMIT = ("--area", "--limit-N", "--limit-table")
_OWN_TABLE = "a CSV file is your own table of limits."
Limit = Annotated[
    list[str] | None,
    Option(
        *_LIMIT,
        metavar="NAME|N|CSV",
        help=f"Force limit: body area or region (lowest of its areas), or newtons; {_OWN_TABLE}",
    ),
]
TaskOrLimit = Annotated[
    list[str] | None,
    Option(
        "--task",
        "--area",
        "--limit-table",
        metavar="TOML|NAME|CSV",
        help="Task file: segments, body areas, contact (docs/robot_program.md); or one body area or region for all of "
        f"the path; {_OWN_TABLE}",
    ),
]
TaskOrNewtons = Annotated[
    list[str] | None,
    Option(
        "--task",
        *_LIMIT,
        metavar="TOML|NAME|N|CSV",
        help=f"Task file, whose lowest limits hold everywhere; or one body area, region or newtons; {_OWN_TABLE}",
    ),
]
ContactKind = Annotated[fm.Contact | None, Option("--contact", help="Kind of contact.")]
QuasiStaticN = Annotated[
    float | None,
    Option("--quasi-static-limit-N", help="Quasi-static part of a transient --limit-N, for Phase II forces."),
]
LimitSpring = Annotated[
    float | None,
    Option("--limit-spring-N-per-mm", help="Spring constant of the body part that --limit-N is meant for."),
]
DeviceSpring = Annotated[
    float | None,
    Option("--device-spring-N-per-mm", help="Spring constant of the device, where no campaign.toml states it."),
]
BoundOption = Annotated[
    str | None,
    Option(
        "--bound",
        help="Upper bound on the force: tolerance, or tolerance:0.99/0.95 for 99 % confidence that 95 % of states lie "
        "below; or margin, the default for published maps.",
    ),
]
Margin = Annotated[float | None, Option("--margin", help="Share added by --bound margin; default 0.10.")]
MovingMass = Annotated[
    float | None, Option("--moving-mass-kg", help="Mass of the robot's moving parts; default: as campaign.toml states.")
]
Payload = Annotated[
    float | None, Option("--payload-kg", help="Effective payload; default: as campaign.toml states, else 0.")
]
Overshoot = Annotated[
    float, Option("--overshoot-mps", help="How much faster than programmed the robot may be; subtracted.")
]


def force_map_from(
    source: str, form: str | None, device_spring: float | None = None
) -> tuple[fm.ForceMap, fm.Accuracy | None]:
    """The map a source stands for: a published one, a map file, or a table whose train rows are fitted.

    `device_spring` [N/mm] states the device's spring of a table without campaign.toml. With the map's accuracy: on the
    table's test states, else with each state left out; None where neither can be.
    """
    require_one_map(source)
    is_file = source.lower().endswith(".json")
    if form and (source in fm.PUBLISHED_MAPS or is_file):
        raise fm.InputError("form: --form goes with an impacts table; a map has its own form")
    if device_spring is not None and (source in fm.PUBLISHED_MAPS or is_file):
        raise fm.InputError(
            "device spring: --device-spring-N-per-mm goes with impacts; a map keeps what its impacts stated: fit "
            "them again (forcemap fit IMPACTS --device-spring-N-per-mm N -o MAP.json)"
        )
    if source in fm.PUBLISHED_MAPS and not Path(source).exists():
        return fm.published_map(source), None
    if not Path(source).exists():
        raise fm.InputError(f"no such file, folder or published map ({', '.join(fm.PUBLISHED_MAPS)})", file=source)
    if is_file:
        force_map = fm.read_map(source)
        with contextlib.suppress(fm.InputError):  # a published map, or as many states as coefficients
            return force_map, fm.leave_one_state_out(force_map)
        return force_map, None
    dataset, force_map = fitted(source, form, device_spring=device_spring)
    return force_map, fm.map_accuracy(force_map, dataset)[0]


def several_maps(source: str) -> bool:
    """True if a source stands for several maps: atlas.toml, its folder, or a folder of campaigns."""
    if source in fm.PUBLISHED_MAPS or source.lower().endswith((".json", ".csv")):
        return False
    from forcemap.paths.atlas import is_atlas

    return is_atlas(source)


def require_one_map(source: str) -> None:
    """Refuse an atlas where one campaign is asked for."""
    if several_maps(source):
        raise fm.InputError("this is an atlas, of several maps; name the folder of one campaign", file=source)


def maps_from(source: str, device_spring: float | None = None) -> fm.ForceMap | Atlas:
    """The map a source stands for, or the maps of an atlas."""
    if not several_maps(source):
        return force_map_from(source, None, device_spring)[0]
    if device_spring is not None:
        raise fm.InputError("device spring: the campaigns of an atlas state it in their campaign.toml")
    from forcemap.assessment.folder_map import map_of_folder

    return fm.read_atlas(source, map_of=map_of_folder)


def fitted(
    table: str,
    form: str | None,
    impacts: fm.CensoredImpacts = fm.CensoredImpacts.AT_LEAST,
    *,
    device_spring: float | None = None,
) -> tuple[fm.ImpactDataset, fm.ForceMap]:
    """The impacts of a table or campaign folder, and the map fitted to its train rows."""
    require_one_map(table)
    dataset = impacts_of(table, device_spring)
    from forcemap.assessment.folder_map import folder_map  # a map file needs none of it

    found = folder_map(table, dataset, form=wanted_form(form), impacts=impacts)
    return found.dataset, found.force_map


LIMIT_MISSING = (
    "limit: expected one of --area or --limit-N: a body area such as --area back_of_hand (forcemap limits lists them), "
    "or newtons"
)
CONTACT_MISSING = (
    "contact: expected --contact transient (the body part can give way) or --contact quasi-static (it can be clamped)"
)


def wanted_form(form: str | None) -> fm.Form | None:
    """The form that --form names; None if there is no such option, for the one of the campaign."""
    return fm.form_named(form) if form else None


def of_other_form(form: fm.Form | None, conditions: fm.Conditions, what: str) -> list[str]:
    """That something is for another form than the campaign's own, and how it becomes the campaign's; else nothing."""
    own = form_of(conditions)
    if form in (None, own):
        return []
    return [
        f"{what} for {form.name}; speeds, exports and the page take {own.name} until campaign.toml states below [map] "
        f'form = "{form.name}"'
    ]


def impacts_of(table: str, device_spring: float | None = None) -> fm.ImpactDataset:
    """The impacts of a table or campaign folder."""
    require_impacts(table)
    return fm.read_dataset(table, device_stiffness=stiffness(device_spring))


def require_impacts(table: str) -> None:
    """Refuse a published map, which has no impacts, and say what takes it."""
    if table in fm.PUBLISHED_MAPS and not Path(table).exists():
        raise fm.InputError(
            f"{table} is a published map, already fitted, without impacts; forcemap speed {table}, figure heights "
            f"{table} and compare {table} OTHER take it, and forcemap evaluate IMPACTS --map {table} compares impacts "
            "with it"
        )


def stiffness(spring: float | None) -> float | None:
    """A spring constant in N/mm as N/m."""
    if spring is None:
        return None
    try:
        return fm.Device(stiffness=1000 * spring).stiffness
    except fm.InputError as error:
        raise fm.InputError(f"spring: found {spring:g} N/mm; {error.message}") from None


@contextlib.contextmanager
def too_few_states_named(table: str, form: str | None) -> Iterator[None]:
    """Name the table, and a form that its states determine, in the refusal to fit it."""
    try:
        yield
    except (fm.TooFewStates, fm.RankDeficient) as error:
        wanted = form_of(impacts_of(table).conditions, wanted_form(form))
        message = f"{error.problem} (form {wanted.name}); {error.remedy}{_other_form(table, wanted)}"
        raise type(error)(message, file=error.file or table) from None


def _other_form(table: str, wanted: fm.Form) -> str:
    """The largest of the smaller forms that the states determine."""
    for form in (fm.CFM_3D, fm.CFM_2D):
        if len(form.terms) < len(wanted.terms):
            with contextlib.suppress(fm.FitError):
                fm.fit_force_map(impacts_of(table), form=form)
                knows = ", knows no height" if form == fm.CFM_2D else ""
                return f", or use --form {form.name} ({len(form.terms)} coefficients{knows})"
    return ""


@dataclass(frozen=True)
class Stated:
    """What the spellings of the limit name: a task file, tables of limits, newtons, names of areas or regions."""

    tasks: list[str]
    tables: list[str]
    newtons: list[float]
    names: list[str]
    source: str = ""

    @property
    def table(self) -> TableOfLimits | None:
        """The user's own table of limits, if one is named: by the option, else by the campaign that is the source."""
        return fm.read_limit_table(self.tables[0]) if self.tables else campaign_table(self.source)


def campaign_table(source: str) -> TableOfLimits | None:
    """The table of limits that a campaign names, of which the folder, a recording or the impacts table is given.

    None if it names none. Of several campaigns the one that all of them name; if they name others, each says first that
    its own is not used.
    """
    from forcemap.assessment.folder import campaign_limit_table, folder_of  # most campaigns name none

    folders: list[Path | None] = [None if source.lower().endswith(".json") else folder_of(source)]
    if several_maps(source):
        from forcemap.paths.atlas import atlas_names

        root, names = atlas_names(source)
        folders = [folder if (folder := root / name).is_dir() else None for name in names]
    named = [campaign_limit_table(each, fm.read_conditions(each / CAMPAIGN_FILE)) if each else None for each in folders]
    own = [found.table for found in named if found is not None and found.file]
    return own[0] if len({table.sha256 for table in own}) == 1 and len(own) == len(folders) else None


def stated(limit: Sequence[str] | None, source: str = "") -> Stated:
    """The values of the limit's option, sorted by kind; without a table that of the campaign counts."""
    values = Stated([], [], [], [], source)
    for text in limit or ():
        newtons = number(text)
        if newtons is not None:
            values.newtons.append(newtons)
        else:
            kinds = {".toml": values.tasks, ".csv": values.tables}
            kinds.get(Path(text).suffix.lower(), values.names).append(text)
    if len(values.tables) > 1:
        raise fm.InputError("limit: found several of --limit-table, expected one")
    return values


def limit_from(
    limit: Sequence[str] | None,
    contact: fm.Contact | None,
    quasi_static: float | None = None,
    spring: float | None = None,
    *,
    source: str,
    contact_needed: bool = True,
) -> tuple[fm.ForceLimit | fm.NewtonLimit, fm.Contact | None]:
    """The limit that the options name, and the kind of contact, which a body area's needs where speeds are asked.

    Body areas are those of `--limit-table`, else of the table that the campaign `source` names, else the standard's.
    """
    given = stated(limit, source)
    if len(given.names) > 1 and not (given.tasks or given.newtons):
        raise fm.InputError(
            f"limit: found --area {' and '.join(given.names)}, expected one: the lowest speed of all holds; export and "
            "path take several areas in a task file (--task)"
        )
    if given.tasks or len(given.newtons) + len(given.names) != 1 or given.names == [""]:
        raise fm.InputError(LIMIT_MISSING)
    if given.newtons:
        if given.tables:
            raise fm.InputError("limit: --limit-table goes with --area, not with --limit-N")
        return fm.NewtonLimit(given.newtons[0], quasi_static, stiffness(spring)), contact
    if quasi_static is not None or spring is not None:
        raise fm.InputError("limit: --quasi-static-limit-N and --limit-spring-N-per-mm go with --limit-N")
    if contact is None and contact_needed:
        raise fm.InputError(CONTACT_MISSING)
    return fm.force_limit(given.names[0], table=given.table), contact


def areas_from(source: str, named: Sequence[str] | None) -> list[str]:
    """The body areas and regions that the options name; without any those of the contact points beside a table.

    None is assumed: another area has another limit.
    """
    if named:
        return list(dict.fromkeys(named))
    from forcemap.assessment.contact_points import POINTS_FILE, read_contact_points  # most commands name their area

    beside = (Path(source) if Path(source).is_dir() else Path(source).parent) / POINTS_FILE
    table = campaign_table(source)
    areas = [point.limit.name for point in read_contact_points(beside, table=table)] if beside.exists() else []
    if not areas:
        raise no_area(f", or the contact points in {beside.name}")
    return list(dict.fromkeys(areas))


def no_area(otherwise: str = "") -> fm.InputError:
    """The error where no body area is named; `otherwise` is what would do as well."""
    return fm.InputError(
        f"area: expected --area, the body area or region that can be hit, such as --area back_of_hand{otherwise}: none "
        f"is assumed; regions are {', '.join(fm.standard_limit_table().regions)}; forcemap limits lists their areas"
    )


def require_as_spelled(arguments: Sequence[str]) -> None:
    """Refuse a number for an area, or a name for newtons: `arguments` of a command where these spell one option."""
    for argument, after in zip(arguments, [*arguments[1:], ""], strict=True):
        name, equals, value = argument.partition("=")
        value = value if equals else after
        kind = "newtons" if number(value) is not None else Path(value).suffix.lower()
        wanted = {"--limit-N": "newtons", "--limit-table": ".csv", "--task": ".toml"}.get(name, kind)
        if kind != wanted or (name == "--area" and kind in ("newtons", ".csv", ".toml")):
            what = wanted if kind != wanted else "the name of a body area or region"
            hint = "; newtons are --limit-N" if kind == "newtons" else ""
            raise fm.InputError(f"{name.removeprefix('--')}: found {value}, expected {what}{hint}")


def number(text: str) -> float | None:
    """A text as a number, None if it is not one."""
    try:
        return float(text)
    except ValueError:
        return None


def stated_bound(bound: str | None, margin: float | None, device_error: float) -> Bound | None:
    """The bound that the options name; None if they name none."""
    kind, _, figures = (bound or "").lower().partition(":")
    if kind not in ("", "tolerance", "margin") or (figures and kind != "tolerance"):
        raise fm.InputError(f"bound: found {bound!r}, expected tolerance, tolerance:CONFIDENCE/CONTENT or margin")
    if margin is not None and kind != "margin":
        raise fm.InputError("margin: --margin goes with --bound margin")
    if kind == "margin":
        return fm.FixedMargin() if margin is None else fm.FixedMargin(margin)
    if not kind:
        return None
    if not figures:
        return fm.ToleranceBound(device_error=device_error)
    try:
        confidence, content = (float(figure) for figure in figures.split("/"))
    except ValueError:
        raise fm.InputError(f"bound: found {bound!r}, expected two figures as in tolerance:0.95/0.95") from None
    return fm.ToleranceBound(confidence, content, device_error)


def bound_from(maps: fm.ForceMap | Atlas, bound: str | None = None, margin: float | None = None) -> Bound:
    """The bound the options name; a tolerance bound for fitted maps, a margin for published ones."""
    force_maps = (maps,) if isinstance(maps, fm.ForceMap) else maps.force_maps
    default = "margin" if all(force_map.fit is None for force_map in force_maps) else "tolerance"
    error = max(force_map.conditions.device.error_or_default for force_map in force_maps)
    chosen = stated_bound(bound or default, margin, error)
    assert chosen is not None
    if isinstance(maps, fm.ForceMap):
        chosen.require(maps)
    return chosen
