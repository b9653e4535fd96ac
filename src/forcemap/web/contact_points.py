"""The list of contact points as the page shows and edits it: judged points, photographs, films of their pressure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, Field

from forcemap import LimitTable, read_campaign
from forcemap.answers.answer import Answer, Figure
from forcemap.assessment.assess_campaign import AssessedPoints, assess_points
from forcemap.assessment.contact_points import (
    NUMBERS,
    PHOTOGRAPHS_FOLDER,
    POINTS_FILE,
    list_text,
    listed_cells,
    parse_contact_points,
)
from forcemap.assessment.missing import Missing
from forcemap.assessment.point_results import PointResult
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.point_list import POINTS_FOLDER
from forcemap.campaigns.point_recordings import POINT_FILMS, point_files
from forcemap.campaigns.pressures import PRESSURES_FOLDER, usable_film
from forcemap.files import alone, read_bytes, sha256, write_atomically
from forcemap.web.intake import TYPES
from forcemap.web.request_error import RequestError
from forcemap.words import sentence, sentences

PICTURE_TYPES = (".jpg", ".jpeg", ".png")
"""How the names of photographs end that are taken."""

FILM_TYPES = (".csv", ".txt", ".tsv", ".dat", ".asc")
"""How the names of films end that are taken; what they hold is judged by the reader."""

_PICTURES = {"image/jpeg": ".jpg", "image/png": ".png"}
_MOST_PICTURES = 99  # of one point; a choice
_STEM = re.compile(r"[\w.-]{1,200}", re.ASCII)


POINT_FIELDS = {
    "point_id": "Name",
    "hazard": "Hazard or number in the risk assessment",
    "contact_site": "Contact site: part of robot, tool or workpiece",
    "distance_m": "Distance [m]",
    "distance_to_m": "Distance to, of a zone [m]",
    "height_m": "Height [m]",
    "height_to_m": "Height to, of a zone [m]",
    "direction": "Direction of motion",
    "recordings": "Recordings of this point",
    "recorded_at_mps": "Programmed while they were recorded [m/s]",
    "programmed_mps": "Programmed now [m/s]",
    "photograph": "Photograph",
    "remark": "Remark",
}
"""Columns that are typed, and what the page calls them."""


class PointCells(BaseModel):
    """A row of contact_points.csv; an empty text is "not stated"."""

    point_id: str = Field("", max_length=36)
    hazard: str = Field("", max_length=500)
    contact_site: str = Field("", max_length=500)
    distance_m: str = Field("", max_length=40)
    distance_to_m: str = Field("", max_length=40)
    height_m: str = Field("", max_length=40)
    height_to_m: str = Field("", max_length=40)
    direction: str = Field("", max_length=500)
    body_area: str = Field("", max_length=100)
    contact: str = Field("transient", max_length=40)
    body: str = Field("constrained", max_length=40)
    rests_on: str = Field("map", max_length=40)
    recordings: str = Field("", max_length=500)
    recorded_at_mps: str = Field("", max_length=40)
    programmed_mps: str = Field("", max_length=40)
    photograph: str = Field("", max_length=500)
    remark: str = Field("", max_length=500)


class PointChange(BaseModel):
    """A contact point to add, or to put in the place of one of the list."""

    list_sha256: str = Field(description="SHA-256 of the list as it was looked at; empty if there is none.")
    replaces: str = Field("", description="Name of the point whose row it replaces; a new one if empty.", max_length=36)
    cells: PointCells


class PointImpactLine(Answer):
    """An impact made at a contact point."""

    recording: str
    speed_mps: Figure
    peak_force_N: Figure
    phase2_force_N: Figure
    pressure_N_per_cm2: Figure
    outcome: str
    reason: str
    excluded: bool


class PointAnswer(Answer):
    """A contact point, and what permits it or what it lacks; the program may have at most `program_at_most_mps`,
    which is a figure also where it has more, and the point is not permitted for that. `words` tells the outcome to
    people."""

    cells: PointCells
    outcome: str
    words: str
    if_reason: bool
    speed_to_program_mps: Figure
    program_at_most_mps: Figure
    permission: str
    pressure: str
    rests_on: list[str]
    lacks: list[str]
    impacts: list[PointImpactLine]
    photograph_there: bool


class PointsAnswer(Answer):
    """The contact points of a campaign."""

    name: str
    simulated: bool
    list_sha256: str
    problem: str
    warnings: list[str]
    cell: str
    points: list[PointAnswer]


class PictureAnswer(Answer):
    """A photograph that was stored."""

    stored_as: str
    list_sha256: str


class FilmAnswer(Answer):
    """A film that was stored, its figure by the campaign's averaging, and why it does not count yet, if it does not."""

    stored_as: str
    pressure_N_per_cm2: float
    at_least: bool
    problem: str = ""


class PointRecordingAnswer(Answer):
    """A recording that was stored at a point, and why it does not count yet, if it does not."""

    stored_as: str
    list_sha256: str
    problem: str = ""


def points_answer(name: str, folder: Path, table: LimitTable | None) -> PointsAnswer:
    """The list of contact points with the verdicts; a list that cannot be used says why, and permits nothing."""
    from forcemap.report.permission import cell_words

    content, assessed = _content(folder), assess_points(folder, limit_table=table)
    points, problem = ((), assessed.points.reason) if isinstance(assessed.points, Missing) else (assessed.points, "")
    cells = [] if problem or not content else listed_cells(content, POINTS_FILE)
    return PointsAnswer(
        name=name,
        simulated=assessed.simulated,
        list_sha256=sha256(content) if content else "",
        problem=problem,
        warnings=sentences(assessed.findings),
        cell=cell_words(assessed),
        points=[_point(result, row, assessed) for result, row in zip(points, cells, strict=True)],
    )


def _point(result: PointResult, cells: dict[str, str], assessed: AssessedPoints) -> PointAnswer:
    from forcemap.report.permission import point_permission, pressure_words

    return PointAnswer(
        cells=PointCells.model_validate(cells),
        outcome=result.outcome.value,
        words=result.words,
        if_reason=result.if_reason,
        speed_to_program_mps=result.speed,
        program_at_most_mps=result.program_at_most,
        permission=point_permission(result, assessed.conditions, assessed.protocol),
        pressure=pressure_words(result),
        rests_on=sentences(result.rests_on),
        lacks=list(dict.fromkeys(sentences(result.lacks))),
        impacts=[
            PointImpactLine(
                recording=impact.recording,
                speed_mps=impact.speed,
                peak_force_N=impact.peak_force,
                phase2_force_N=impact.phase2_force,
                pressure_N_per_cm2=impact.pressure.pressure if impact.pressure else math.nan,
                outcome=impact.outcome.value,
                reason=sentence(impact.reason),
                excluded=impact.excluded,
            )
            for impact in result.impacts
        ],
        photograph_there=result.photograph is not None and result.photograph.is_file(),
    )


def change_point(folder: Path, change: PointChange, table: LimitTable | None) -> None:
    """Write the list with a point added or replaced; nothing is written that could not be read again.

    Raises
    ------
    RequestError
        The list is no longer the one that was looked at; it has no such point.
    TableError
        A cell that cannot be used.
    """
    with alone(folder):
        rows = _looked_at(folder, change.list_sha256)
        cells = {name: " ".join(text.split()) for name, text in change.cells.model_dump().items()}
        cells |= {name: cells[name].replace(",", ".") for name in NUMBERS}  # as some type them
        at = len(rows) if not change.replaces else _row_of(rows, change.replaces)
        _write(folder, [*rows[:at], cells, *rows[at + 1 :]], table)


def remove_point(folder: Path, point: str, list_sha256: str, table: LimitTable | None) -> None:
    """Write the list without a point, whose recordings and photographs stay; errors as `change_point`.

    Refused while another point's patterns fit recordings of it, which would then count for that one.
    """
    with alone(folder):
        rows = _looked_at(folder, list_sha256)
        at = _row_of(rows, point)
        of_it = _files_of(folder, rows[at])
        for row in (*rows[:at], *rows[at + 1 :]):
            if shared := sorted(of_it & _files_of(folder, row)):
                message = f"{shared[0]} would then count for {row['point_id']}; move the files of {point} away first"
                raise RequestError(409, "shared", message)
        _write(folder, [*rows[:at], *rows[at + 1 :]], table)


def _files_of(folder: Path, row: Mapping[str, str]) -> set[str]:
    """Files in points/ that the patterns of a point fit."""
    patterns = [pattern.strip().casefold() for pattern in row["recordings"].split(";") if pattern.strip()]
    return {name for name in point_files(folder) if any(fnmatchcase(name.casefold(), each) for each in patterns)}


def store_photograph(folder: Path, point: str, list_sha256: str, content: bytes, file: str) -> PictureAnswer:
    """Store a photograph of a point, decoded and encoded anew, and name it in the list; no file is replaced.

    Raises
    ------
    RequestError
        The list is no longer the one that was looked at; it has no such point; it has too many photographs.
    InputError
        Neither JPEG nor PNG, too large, or damaged.
    """
    from forcemap.report.photographs import reencoded

    kind, encoded = reencoded(content, file)
    with alone(folder):
        rows = _looked_at(folder, list_sha256)
        at, pictures = _row_of(rows, point), folder / PHOTOGRAPHS_FOLDER
        pictures.mkdir(exist_ok=True)
        taken = {path.name.lower() for path in pictures.iterdir()}
        names = (f"{rows[at]['point_id']}{f'-{n}' if n > 1 else ''}{_PICTURES[kind]}" for n in range(1, _MOST_PICTURES))
        name = next((name for name in names if name.lower() not in taken), "")
        if not name:
            raise RequestError(409, "too_many", f"{point} has {_MOST_PICTURES} photographs; delete some by hand")
        write_atomically(pictures / name, encoded)
        rows[at] = rows[at] | {"photograph": name}
        write_atomically(folder / POINTS_FILE, list_text(rows))
        return PictureAnswer(stored_as=name, list_sha256=sha256(list_text(rows)))


def store_recording(folder: Path, point: str, list_sha256: str, staged: Path, file: str) -> PointRecordingAnswer:
    """Store a recording that was made at a point alone, and name those of the point in the list; no file is replaced.

    Raises
    ------
    RequestError
        The list is no longer the one that was looked at; it has no such point, or the same content is there.
    """
    ending = PurePosixPath(file.replace("\\", "/")).suffix.lower()
    if ending not in TYPES:
        raise RequestError(415, "type", f"found {ending or 'nothing'!r}, expected one of {', '.join(TYPES)}", file=file)
    with alone(folder):
        rows, there = _looked_at(folder, list_sha256), point_files(folder)
        at, content = _row_of(rows, point), read_bytes(staged)
        if same := next((name for name, path in there.items() if read_bytes(path) == content), ""):
            raise RequestError(409, "duplicate", f"the same content as {same}, already there", file=file)
        stems = {PurePosixPath(name).stem.lower() for name in there}
        number = next(n for n in range(1, len(stems) + 2) if f"{point}-{n}".lower() not in stems)
        name, pattern = f"{POINTS_FOLDER}/{point}-{number}{ending}", f"{POINTS_FOLDER}/{point}-*"
        (folder / POINTS_FOLDER).mkdir(exist_ok=True)
        write_atomically(folder / name, content)
        named = [text.strip() for text in rows[at]["recordings"].split(";") if text.strip()]
        if not any(fnmatchcase(name.casefold(), each.casefold()) for each in named):
            rows[at] = rows[at] | {"recordings": "; ".join([*named, pattern])}
            write_atomically(folder / POINTS_FILE, list_text(rows))
        return PointRecordingAnswer(stored_as=name, list_sha256=sha256(_content(folder)))


def photograph(folder: Path, file: str) -> tuple[str, bytes]:
    """A photograph of the folder, encoded anew: its media type and its bytes.

    Raises
    ------
    RequestError
        There is none of this name.
    InputError
        It is no picture.
    """
    from forcemap.report.photographs import reencoded

    pictures = folder / PHOTOGRAPHS_FOLDER
    there = {path.name: path for path in pictures.iterdir() if path.is_file()} if pictures.is_dir() else {}
    if file not in there or not file.lower().endswith(PICTURE_TYPES):
        raise RequestError(404, "not_found", f"there is no photograph {file!r}")
    return reencoded(read_bytes(there[file]), file)


def store_film(folder: Path, staged: Path, file: str) -> FilmAnswer:
    """Store a film or matrix of pressures under the name of its recording, once it can be used; no file is replaced.

    Raises
    ------
    RequestError
        Its name is that of no recording; the recording has a film.
    CampaignFileError, RecordingError
        It cannot be used.
    """
    campaign = read_campaign(folder)
    stem, ending = PurePosixPath(file.replace("\\", "/")).stem, PurePosixPath(file).suffix.lower()
    if ending not in FILM_TYPES or not _STEM.fullmatch(stem):
        raise RequestError(415, "type", f"expected one of {', '.join(FILM_TYPES)}, of plain letters", file=file)
    target, force = _film_of(campaign, folder, stem, ending, file)
    with alone(folder):
        if any(path.stem == stem for path in target.parent.glob("*")):
            raise RequestError(409, "run_taken", f"there is a film of {stem} already; move it away by hand", file=file)
        measured = usable_film(staged, campaign.conditions.film, force)
        target.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(target, read_bytes(staged))
    below = target.relative_to(folder).as_posix()
    return FilmAnswer(stored_as=below, pressure_N_per_cm2=measured.pressure, at_least=measured.above_range)


def _film_of(campaign: Campaign, folder: Path, stem: str, ending: str, file: str) -> tuple[Path, float]:
    """Where a film belongs by its name, and the peak force of its recording [N]; NaN if that is not known yet."""
    if any(PurePosixPath(name).stem == stem for name in point_files(folder)):
        return folder / POINT_FILMS / f"{stem}{ending}", math.nan
    named = [entry for entry in campaign.entries if stem in (entry.name, PurePosixPath(entry.file).stem)]
    if not named and campaign.plan.run_named(stem) is None:
        expected = f"expected that of a run of the plan, or of a recording in recordings/ or {POINTS_FOLDER}/"
        raise RequestError(422, "run", f"found the name {stem!r}, {expected}", file=file)
    return folder / PRESSURES_FOLDER / f"{stem}{ending}", named[0].peak_force if named else math.nan


def _content(folder: Path) -> bytes:
    """The list as it is; empty if there is none."""
    there = folder / POINTS_FILE
    return read_bytes(there) if there.exists() else b""


def _looked_at(folder: Path, list_sha256: str) -> list[dict[str, str]]:
    """The rows of the list, if it is still the one that was looked at."""
    content = _content(folder)
    if (sha256(content) if content else "") != list_sha256:
        raise RequestError(
            409, "changed", "the list has changed meanwhile, so nothing was written; open the page again"
        )
    return listed_cells(content, POINTS_FILE) if content else []


def _row_of(rows: Iterable[dict[str, str]], point: str) -> int:
    at = next((i for i, cells in enumerate(rows) if cells["point_id"] == point), None)
    if at is None:
        raise RequestError(404, "not_found", f"the list has no point {point!r}")
    return at


def _write(folder: Path, rows: list[dict[str, str]], table: LimitTable | None) -> None:
    """Write a list that can be read again; a list without points is deleted."""
    if not rows:
        (folder / POINTS_FILE).unlink()
        return
    text = list_text(rows)
    parse_contact_points(text.encode(), POINTS_FILE, table=table)
    write_atomically(folder / POINTS_FILE, text)
