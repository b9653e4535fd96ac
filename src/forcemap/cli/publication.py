"""forcemap publication: a campaign as a folder to publish beside a paper."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from typer import Argument, Option

import forcemap as fm
from forcemap.assessment.folder import campaign_inputs, campaign_limit_table, is_standard_input
from forcemap.campaigns.campaign import campaign_folder
from forcemap.campaigns.conditions import CAMPAIGN_FILE
from forcemap.campaigns.impacts_table import TABLE_FILE
from forcemap.cli.drawings import Choices, Kind, Source, draw
from forcemap.cli.figure import WidthOption, drawn_width
from forcemap.cli.options import FormName, Json, MovingMass
from forcemap.cli.output import Progress, emit, verdict_first
from forcemap.cli.publication_tables import tables_of
from forcemap.files import new_folder, read_bytes, sha256, write_atomically
from forcemap.maps.forms import form_chosen
from forcemap.maps.map_file import map_text
from forcemap.speeds.basis import doubts_of_fit
from forcemap.words import sentences

_PAPER = "3D Collision-Force-Map for Safe Human-Robot Collaboration"
_PAPERS_AUTHORS = (("Svarny", "Petr"), ("Rozlivek", "Jakub"), ("Rustler", "Lukas"), ("Hoffmann", "Matej"))
_NO_AUTHOR = "authors not stated: write them here"
_KINDS = (Kind.GRID, Kind.HEIGHTS, Kind.PROFILES, Kind.WORKSPACE, Kind.RESIDUALS, Kind.REPEATABILITY)
_SUMS = "SHA256SUMS"
_ACCURACY_BY = (
    "| `tables/accuracy.csv` | `forcemap evaluate data{} --json`, `forcemap compare data{} --area AREA --json` |"
)
_SPEEDS_BY = "| `tables/speeds-*.csv` | `forcemap speed-map data{} --area AREA --contact CONTACT -o FILE` |"
_OF_AREA = (
    "; speeds and `comparison` are for that body area, `speeds-transient` and `speeds-quasi-static` for the contact "
    "that they name"
)
_COUNTED = {"data": "files of data", "tables": "tables", "figures": "figures"}


def publication(
    folder: Annotated[str, Argument(help="Campaign folder, or an impacts table (CSV).")],
    output: Annotated[str | None, Option("-o", "--output", help="New folder to write.")] = None,
    area: Annotated[
        str | None, Option("--area", help="Body area; without it neither the standard's model nor safe speeds.")
    ] = None,
    form: FormName = None,
    moving_mass: MovingMass = None,
    author: Annotated[
        list[str] | None, Option("--author", help="For CITATION.cff; several times. Default: the campaign's operator.")
    ] = None,
    width: WidthOption = "column",
    grey: Annotated[bool, Option("--grey", help="Figures in grey.")] = False,
    as_json: Json = False,
) -> None:
    """Write a campaign as a folder to publish: data, map, tables, figures, checksums, and how to cite it.

    The standard's model (the paper's Table III) and safe speeds need a body area, which is never assumed: --area.

    Example: forcemap publication my-campaign -o published --area back_of_hand
    """
    if output is None:
        raise fm.InputError("output: expected -o FOLDER, a new one")
    if folder.lower().endswith(".json"):
        raise fm.InputError("found a map, expected the folder or table of its impacts, and --form", file=folder)
    size = drawn_width(width)
    with TemporaryDirectory() as passing:
        campaign = _as_folder(folder, passing)
        source = Source(campaign, form)
        dataset, force_map = source.impacts(Kind.GRID), source.force_map
        own = campaign_limit_table(campaign, dataset.conditions).file
        inputs = [file.path for file in campaign_inputs(campaign, further=filter(None, [own]))]
        target = new_folder(output)  # before anything is drawn
        asked = Choices(area=area, moving_mass=moving_mass if area else None)
        tables, left_out, no_speed, doubts = tables_of(source, asked)
        parts: dict[str, bytes] = {f"data/{name}": read_bytes(Path(campaign, name)) for name in inputs}
        parts["map.json"] = map_text(force_map).encode()
        parts |= {f"tables/{name}.csv": text.encode() for name, text in tables.items()}
        wanted = list(_figures(area))
        with Progress("figures", len(wanted)) as progress:
            for done, (name, kind, chosen) in enumerate(wanted):
                progress.show(done)
                try:
                    parts |= _figure_files(name, kind, source, chosen | _mass(kind, moving_mass), size, grey=grey)
                except fm.ForcemapError as error:
                    left_out[f"figures/{name}"] = error.message
    parts["CITATION.cff"] = _citation(dataset.conditions, dataset.simulated, author or []).encode()
    first = [*dict.fromkeys(filter(None, [*sentences([dataset.binding.reason or "", *_doubts(force_map)]), *doubts]))]
    mass = [] if moving_mass is None else [f"--moving-mass-kg {moving_mass:g}"]
    of_form = [f"--form {form}"] * bool(form)
    options = [f"--area {area}" if area else "no --area", *of_form, *mass, f"--width {width}", *["--grey"] * grey]
    parts["README.md"] = _readme(dataset, force_map, first, parts, left_out, no_speed, options).encode()
    parts[_SUMS] = "".join(f"{sha256(data)}  {name}\n" for name, data in sorted(parts.items())).encode()
    for name, data in parts.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        write_atomically(target / name, data)
    said = {"folder": output, "files": sorted(parts), "left_out": left_out, "no_speed": no_speed, "warnings": first}
    counts = (f"{sum(name.startswith(f'{kind}/') for name in parts)} {what}" for kind, what in _COUNTED.items())
    whole = f"{target}: {', '.join(counts)}, map.json, CITATION.cff, README.md; checksums: sha256sum -c {_SUMS}"
    lines = [
        *verdict_first(whole, first, simulated=dataset.simulated),
        *(f"{name}: {why}" for name, why in no_speed.items()),
        *(f"left out: {name}: {why}" for name, why in left_out.items()),
    ]
    lines += [f"CITATION.cff says: {_NO_AUTHOR}"] if _NO_AUTHOR in parts["CITATION.cff"].decode() else []
    emit(said | {"simulated": dataset.simulated}, lines, as_json=as_json)


def _doubts(force_map: fm.ForceMap) -> list[fm.Finding]:
    """What must be said of a map before anything that rests on it."""
    transfer, conditions = force_map.require_fit().transfer, force_map.conditions
    return [*(transfer.warnings if transfer else ()), *doubts_of_fit(force_map), *conditions.doubts]


def _as_folder(named: str, passing: str) -> str:
    """The campaign's folder; a table alone becomes one in the folder `passing`, with the campaign.toml beside it."""
    table = Path(named)
    if not table.is_file():
        return named
    beside = {file.name for file in table.parent.iterdir() if file.is_file() and is_standard_input(file.name)}
    if beside - {CAMPAIGN_FILE, TABLE_FILE}:  # its recordings and contact points may speak against it
        campaign_folder(named)
    Source(named).impacts(Kind.GRID)  # what is wrong with the table is said of it by its name
    folder = Path(passing, table.stem)
    folder.mkdir()
    for file, name in ((table, TABLE_FILE), (table.with_name(CAMPAIGN_FILE), CAMPAIGN_FILE)):
        if file.is_file():
            (folder / name).write_bytes(read_bytes(file))
    return str(folder)


def _figures(area: str | None) -> Iterator[tuple[str, Kind, dict[str, Any]]]:
    """Name, kind and choices of every figure."""
    yield from ((kind.value, kind, {}) for kind in _KINDS)
    yield "evolution", Kind.EVOLUTION, {"area": area} if area else {}
    if area:
        yield "comparison", Kind.COMPARISON, {"area": area}
        for contact in fm.Contact:
            yield f"speeds-{contact}", Kind.SPEEDS, {"area": area, "contact": contact}


def _mass(kind: Kind, moving_mass: float | None) -> dict[str, float]:
    return {"moving_mass": moving_mass} if moving_mass and kind in (Kind.COMPARISON, Kind.SPEEDS) else {}


def _figure_files(
    name: str, kind: Kind, source: Source, chosen: dict[str, Any], size: tuple[float, float], *, grey: bool
) -> dict[str, bytes]:
    from forcemap.figures import figure_file, in_grey

    wide, larger = size
    drawn = draw(kind, [source], Choices(**chosen), width=wide)
    drawn = in_grey(drawn) if grey else drawn
    files = [f"figures/{name}{ending}" for ending in (".pdf", ".png", ".svg")]
    return {file: figure_file(drawn, file, larger=larger) for file in files}


def _citation(conditions: fm.Conditions, simulated: bool, authors: list[str]) -> str:
    """CITATION.cff, schema 1.2.0: the data, the software and the paper."""
    names = authors or ([conditions.operator] if conditions.operator else [_NO_AUTHOR])
    robot = conditions.robot or "robot not stated"
    title = f"{'SIMULATED: ' if simulated else ''}Collision forces and collision-force map, {robot}"
    lines = [
        "cff-version: 1.2.0",
        "message: Please cite these data, and the paper whose method they use.",
        "type: dataset",
    ]
    lines += [f"title: {json.dumps(title)}", "authors:", *(f"  - name: {json.dumps(name)}" for name in names)]
    lines += [f"date-released: {conditions.date}"] if conditions.date else []
    lines += ["references:", "  - type: software", "    title: forcemap", f"    version: {json.dumps(fm.__version__)}"]
    lines += ["    authors:", "      - name: The forcemap authors", "  - type: conference-paper"]
    lines += [f"    title: {json.dumps(_PAPER)}", "    year: 2021", "    authors:"]
    for family, given in _PAPERS_AUTHORS:
        lines += [f"      - family-names: {family}", f"        given-names: {given}"]
    lines += ["    conference:", "      name: IEEE International Conference on Robotics and Automation (ICRA)"]
    return "\n".join(lines) + "\n"


def _repeated_states(dataset: fm.ImpactDataset) -> list[str]:
    """That states of role test repeat training states, where some do."""
    counts = [len(part.states) if len(part) else 0 for part in (dataset.tested, dataset.independent_test)]
    again = f"{counts[0] - counts[1]} are training states measured again, which `states.csv` has a row of each role for"
    with_all = f"`accuracy.csv` compares the map with the other {counts[1]} (less those wholly above the device range) "
    with_all += "and with all."
    if not counts[1]:
        with_all = (
            "no state is an independent test: `accuracy.csv` has the errors with states and with places left out."
        )
    said = [f"Of the {counts[0]} states of role test (`testing_states` of `dataset.csv`), {again}; {with_all}"]
    return said * (counts[0] > counts[1])


def _form_line(force_map: fm.ForceMap) -> str:
    """The form of the map, whether it fits, and that it was chosen."""
    tested, form = force_map.form_test, force_map.form.name
    said = sentences([*([tested.finding] if tested else []), *form_chosen(form)])
    of_form = " ".join(f"{each[:1].upper()}{each[1:]}." for each in said)
    return f"Form of the map: {form}, which `forcemap evaluate data --forms` compares with others. {of_form}"


def _readme(
    dataset: fm.ImpactDataset,
    force_map: fm.ForceMap,
    first: list[str],
    parts: Iterable[str],
    left_out: dict[str, str],
    no_speed: dict[str, str],
    options: list[str],
) -> str:
    """What is in the folder, and how each part is made again; `first` is what speaks against the table and its map."""
    chosen = "".join(f" {option}" for option in options if option.startswith("--form"))
    error = dataset.conditions.speed_error
    less = "none is stated, both are the same" if math.isnan(error) else f"here {100 * error:g} %"
    files = [name.removeprefix("data/") for name in parts if name.startswith("data/")]
    data = ", ".join(dict.fromkeys(f"`{name.partition('/')[0]}{'/' * ('/' in name)}`" for name in sorted(files)))
    simulated = ["SIMULATED: not a measurement of any robot."] * dataset.simulated
    lines = [f"# Collision forces: {dataset.conditions.robot or 'robot not stated'}", ""]
    lines += [part for line in (*simulated, *first) for part in (f"**{line}**", "")]
    lines += [
        "Estimated from measurements; nothing here certifies a robot or a cell.",
        "",
        "| what | made by |",
        "|---|---|",
        f"| `data/` | the campaign as it was measured: {data} |",
        f"| `map.json` | `forcemap fit data{chosen} -o map.json` |",
        f"| `tables/dataset.csv`, `states.csv`, `coefficients.csv` | `forcemap fit data{chosen} --json` |",
        _ACCURACY_BY.format(chosen, chosen),
        *([] if "no --area" in options else [_SPEEDS_BY.format(chosen)]),
        f"| `figures/` | `forcemap figure KIND data{chosen} -o FILE`; grid, repeatability and evolution have no form |",
        f"| `{_SUMS}` | `sha256sum -c {_SUMS}` |",
        "",
        _form_line(force_map),
        f"Made with {', '.join(options)}{'' if 'no --area' in options else _OF_AREA}.",
        f"States were found {dataset.states_found}: repeatability is that of these.",
        "Speeds in `states.csv`: `speed_stated_mps` as the campaign states them, `speed_less_error_mps` less its speed "
        f"error ({less}): to these the map is fitted, and figures and other tables show them.",
        "In `dataset.csv`, `impacts_used` counts those below the device range; a map has those above it, too, as at "
        "least that force.",
        "Errors in `states.csv` and `accuracy.csv` are predicted less measured (underestimation is below 0, or named); "
        "figures show measured less predicted (underestimation is above 0).",
        "A state is outside the map's measured range if it lies farther from that than repeats of a state may differ.",
        "Of a coefficient `low` and `high` are the ends of its 95 % confidence interval (Student's t), "
        "the wider of those with the smallest and the largest correlation of the states of a place that is likely.",
        *_repeated_states(dataset),
        f"Software: forcemap {fm.__version__}. Units stand in the names of columns. How to cite: `CITATION.cff`. "
        "Choose a licence for the data before you publish them.",
    ]
    lines += (
        ["", "Without any speed:", "", *(f"- `{name}`: {why}" for name, why in no_speed.items())] if no_speed else []
    )
    lines += ["", "Left out:", "", *(f"- `{name}`: {why}" for name, why in left_out.items())] if left_out else []
    return "\n".join(lines) + "\n"
