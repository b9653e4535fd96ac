"""Files that a person drops: a hidden file of the campaign while they are judged, then stored as a run of the plan."""

from __future__ import annotations

import asyncio
import json
import os
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from fastapi import Request
from pydantic import BaseModel, Field
from starlette.requests import ClientDisconnect

from forcemap import Campaign, ForcemapError, InputError, collect_campaign, read_campaign
from forcemap.answers.check import CheckAnswer
from forcemap.answers.collect import CollectAnswer
from forcemap.campaigns.build import entered_since, registered_recordings
from forcemap.files import file_sha256, flush_to_disk, hidden_file, sweep
from forcemap.recordings.column_map import ColumnMap
from forcemap.web.campaign_answers import problem_words
from forcemap.web.columns import ColumnsAnswer, columns_answer
from forcemap.web.conditions import stated_columns
from forcemap.web.fitted_campaign import impacts_of
from forcemap.web.folder import Folder
from forcemap.web.judgements import MeasuredAnswer, TableAnswer, file_answer, is_table, read_answer, table_answer
from forcemap.web.limits import given_table, limits_of
from forcemap.web.question import Area
from forcemap.web.request_error import RequestError
from forcemap.words import sentence

LARGEST_UPLOAD = 20_000_000
"""The largest file that is taken [bytes]: several times the longest recording of a device (docs/decisions.md)."""

MOST_RECORDINGS = 5_000
"""The most recordings of a campaign to which the page adds one; a choice: every one is hashed to find a duplicate."""

TYPES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".lvm", ".tdms")
"""How the names of files end that are taken; what they hold is judged by the reader."""

LARGEST_TABLE = 2_000_000
"""The largest impacts table that is judged [bytes]: some ten thousand impacts; every cell is held as text."""

_UPLOADS = 8
"""Files that arrive or wait at the same time; a choice: together they fill 160 MB of the disk."""

_JUDGED_TOGETHER = 2
"""Files judged at the same time; a choice: a recording of 20 MB takes 140 MB of memory (docs/decisions.md)."""

_ARRIVAL = 60.0
"""How long a file may take to arrive [s]; a choice: it comes from the same machine."""

_DIGESTS = 20_000
"""Hashes of stored recordings that stay in memory; a choice: four of the largest campaigns."""

_NAME_DIGITS = 12
"""Digits of a hash in the name of a recording that belongs to no run; a choice: 48 bits, no two alike in a campaign."""


Judgement = CheckAnswer | MeasuredAnswer | TableAnswer
"""What a file that is judged is answered with."""


class Upload(Area):
    """A file to judge."""

    file: str = Field(
        description="Name of the file, by which errors call it; it names nothing on disk.", max_length=255
    )


class Judged(Upload):
    """A file to judge, with its curves or without, read as the campaign says or by columns that are tried."""

    curves: bool = Field(False, description="Also the curve of every recording, thinned to what can be drawn.")
    columns: str = Field("", description="Entries of [recordings] as JSON, to try them.", max_length=4000)

    @property
    def tried(self) -> ColumnMap | None:
        """The columns that are tried; None to read as the campaign says.

        Raises
        ------
        InputError
            No table as JSON, or one that cannot be used.
        """
        if not self.columns:
            return None
        try:
            table = json.loads(self.columns)
        except (ValueError, RecursionError):
            table = None
        if not isinstance(table, dict):
            raise InputError("expected the entries of [recordings] as a JSON object", column="columns")
        return stated_columns(table)


class Addition(Upload):
    """A recording to add to a campaign."""

    run: str | None = Field(None, description="Run of the plan; found by the file's name if not given.", max_length=255)


class StoredAnswer(BaseModel):
    """A recording that was stored, and what became of it."""

    stored_as: str
    use: str
    reason: str
    problem: str
    judgement: CheckAnswer | MeasuredAnswer


@dataclass
class _CampaignIntake:
    """The intake of one campaign: it stores one file at a time, and one collect serves all files stored before it."""

    storing: threading.Lock = field(default_factory=threading.Lock)
    collecting: asyncio.Lock = field(default_factory=asyncio.Lock)
    requested: int = 0
    served: int = 0
    enter: bool = False
    problem: ForcemapError | None = None


class Intake:
    """Takes files for the campaigns of a folder."""

    def __init__(self, folder: Folder, limit_table: str) -> None:
        self._folder, self._limit_table = folder, limit_table
        self._uploads = asyncio.Semaphore(_UPLOADS)
        self._judging = asyncio.Semaphore(_JUDGED_TOGETHER)
        self._intakes: dict[Path, _CampaignIntake] = {}
        for campaign in folder.campaigns().values():
            sweep(campaign)

    async def columns(self, request: Request, name: str, upload: Upload) -> ColumnsAnswer:
        """The first lines of a file as a table, without storing it."""
        campaign, suffix = self._folder.campaign(name), _suffix(upload.file)
        async with self._uploads, _received(request, campaign, suffix) as staged, self._judging:
            with _errors_naming(staged, upload.file):
                return await asyncio.to_thread(columns_answer, staged, upload.file)

    async def judge(self, request: Request, name: str, upload: Judged, *, drawn: bool) -> Judgement:
        """Judge a file without storing it; with its curves if they are to be drawn."""
        campaign, suffix = self._folder.campaign(name), _suffix(upload.file)
        async with self._uploads, _received(request, campaign, suffix) as staged, self._judging:
            return await asyncio.to_thread(self._judged, campaign, staged, upload, drawn)

    async def add(self, request: Request, name: str, addition: Addition) -> StoredAnswer:
        """Judge a recording, store it as a run of the plan, and collect the campaign."""
        path, suffix = self._folder.campaign(name), _suffix(addition.file)
        async with self._uploads, _received(request, path, suffix) as staged, self._judging:
            stored, judgement = await asyncio.to_thread(self._stored, path, staged, addition)
        problem = await self._collected(path)
        entries = [entry for entry in read_campaign(path).entries if entry.file == stored]
        unused = [entry for entry in entries if entry.use.value != "used"] or entries
        return StoredAnswer(
            stored_as=stored,
            use=unused[0].use.value if unused else "not_collected",
            reason=unused[0].reason if unused else "",
            problem=problem_words(problem) if problem else "",
            judgement=judgement,
        )

    @asynccontextmanager
    async def staged(self, request: Request, name: str, suffix: str) -> AsyncIterator[tuple[Path, Path]]:
        """The file of a request while it is looked at: the campaign's folder, and a hidden file in it."""
        path = self._folder.campaign(name)
        async with self._uploads, _received(request, path, suffix) as staged, self._judging:
            yield path, staged

    async def collected(self, campaign: Path) -> str:
        """Collect a campaign; in words why that could not be done, empty if it was."""
        problem = await self._collected(campaign)
        return problem_words(problem) if problem else ""

    async def collect(self, name: str) -> CollectAnswer:
        """Read and judge all recordings of a campaign and write its impacts table, as forcemap collect does."""
        path = self._folder.campaign(name)
        before = registered_recordings(read_campaign(path))
        self._intakes.setdefault(path, _CampaignIntake()).enter = True
        problem = await self._collected(path)
        entered = entered_since(before, campaign := read_campaign(path))
        if problem is not None and entered:
            message = f"{problem.message}. {sentence(entered)}"
            raise type(problem)(message, file=problem.file, row=problem.row, column=problem.column)
        if problem is not None:
            raise problem
        return await asyncio.to_thread(lambda: CollectAnswer.of_campaign(campaign, impacts_of(path), entered))

    def _judged(self, campaign: Path, staged: Path, upload: Judged, drawn: bool) -> Judgement:
        columns, limits = upload.tried, limits_of(campaign, given_table(self._limit_table))
        with _errors_naming(staged, upload.file):
            if is_table(staged):
                if staged.stat().st_size > LARGEST_TABLE:
                    raise too_large(LARGEST_TABLE)
                return table_answer(staged, upload.file, campaign)
            answer = read_answer if columns else file_answer  # how a file is read is tried without a verdict, too
            return answer(staged, upload.file, campaign, upload, limits, columns=columns, drawn=drawn)

    def _stored(self, path: Path, staged: Path, addition: Addition) -> tuple[str, CheckAnswer | MeasuredAnswer]:
        campaign, file_name = read_campaign(path), addition.file
        if is_table(staged):
            message = "this is an impacts table; only recordings are added, the impacts table is made from them"
            raise RequestError(422, "table", message, file=file_name)
        with _errors_naming(staged, file_name):
            judgement = read_answer(staged, file_name, path, addition, limits_of(path, given_table(self._limit_table)))
        digest = file_sha256(staged)
        with self._intakes.setdefault(path, _CampaignIntake()).storing:
            target = campaign.recordings / _stored_name(campaign, addition, staged.suffix, digest)
            _require_new(campaign, target, digest, file_name)
            _store(staged, target)
        return target.name, judgement

    async def _collected(self, campaign: Path) -> ForcemapError | None:
        """Collect once for all requests that wait; the error, None if there is none."""
        intake = self._intakes.setdefault(campaign, _CampaignIntake())
        intake.requested += 1
        request_number = intake.requested
        async with intake.collecting:
            if intake.served < request_number:
                requests, enter, intake.enter = intake.requested, intake.enter, False
                intake.problem = await asyncio.to_thread(_collect, campaign, enter)
                intake.served = requests
            return intake.problem


def _suffix(file_name: str) -> str:
    suffix = PurePosixPath(file_name.replace("\\", "/")).suffix.lower()
    if suffix not in TYPES:
        problem = f"found a file that ends with {suffix or 'nothing'!r}, expected one of {', '.join(TYPES)}"
        message = f"{problem}; of a workbook save the sheet as CSV UTF-8"
        raise RequestError(415, "type", message, file=file_name)
    return suffix


@asynccontextmanager
async def _received(request: Request, campaign: Path, suffix: str) -> AsyncIterator[Path]:
    """The body of a request as a hidden file in the campaign's folder: never whole in memory, deleted afterwards."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/octet-stream":
        message = "expected the file itself as the body, with Content-Type: application/octet-stream"
        raise RequestError(415, "type", message)
    with ExitStack() as stack:
        try:
            staged, stream = stack.enter_context(hidden_file(campaign, suffix))
            await _write(request, stream)
        except OSError as error:
            raise InputError(f"cannot be written ({error.strerror})", file=campaign.name) from error
        yield staged


async def _write(request: Request, stream: BinaryIO) -> None:
    """Write the body of a request, unless it is too large or too slow."""
    size = 0
    try:
        async with asyncio.timeout(_ARRIVAL):
            async for part in request.stream():
                size += len(part)
                if size > LARGEST_UPLOAD:
                    raise too_large()
                stream.write(part)
        stream.flush()
    except TimeoutError:
        raise RequestError(408, "too_slow", f"the file did not arrive within {_ARRIVAL:g} s; send it again") from None
    except ClientDisconnect:
        raise RequestError(408, "gone", "the file did not arrive as a whole; send it again") from None
    if not size:
        raise RequestError(422, "input", "found an empty file, expected a recording or an impacts table")


def too_large(most: int = LARGEST_UPLOAD) -> RequestError:
    """The refusal of a file that is too large."""
    largest = f"{most / 1e6:.0f} MB"
    return RequestError(413, "too_large", f"found more than {largest}, expected at most {largest}; export a part of it")


@contextmanager
def _errors_naming(staged: Path, file_name: str) -> Iterator[None]:
    """Let errors name the file as the person does."""
    try:
        yield
    except ForcemapError as error:
        if error.file and Path(error.file).name == staged.name:
            error.file = file_name
        error.message = error.message.replace(str(staged), file_name).replace(staged.name, file_name)
        raise


def _stored_name(campaign: Campaign, addition: Addition, suffix: str, digest: str) -> str:
    """The name under which a recording is stored: that of its run, else one from the hash of its content."""
    name = PurePosixPath(addition.file.replace("\\", "/")).stem if addition.run is None else addition.run
    run = campaign.plan.run_named(name)  # as the plan spells it; further repeats of a planned state count
    if run is None and addition.run is not None:
        raise RequestError(
            422, "run", f"found {name!r}, expected a run of the plan such as {campaign.plan.recording[0]}"
        )
    return (f"{run[0]}-r{run[1]}" if run else f"upload-{digest[:_NAME_DIGITS]}") + suffix


def _require_new(campaign: Campaign, target: Path, digest: str, file_name: str) -> None:
    files = campaign.files()
    for file in files:
        path = campaign.recordings / file
        if _digest(path, path.stat().st_mtime_ns, path.stat().st_size) == digest:
            raise RequestError(409, "duplicate", f"the same content as {file}, already in the campaign", file=file_name)
    if len(files) >= MOST_RECORDINGS:
        message = f"the campaign holds {len(files)} files, the page adds to at most {MOST_RECORDINGS}; copy it by hand"
        raise RequestError(409, "too_many", message, file=file_name)
    if any(PurePosixPath(file).stem.lower() == target.stem.lower() for file in files):
        message = f"run {target.stem} has a recording already; add this one as another repeat"
        raise RequestError(409, "run_taken", message, file=file_name)


@lru_cache(maxsize=_DIGESTS)
def _digest(path: Path, _changed: int, _size: int) -> str:
    return file_sha256(path)


def _store(staged: Path, target: Path) -> None:
    """Give a complete file its name once it is on the disk; an existing file is never replaced."""
    try:
        flush_to_disk(staged)
        target.parent.mkdir(exist_ok=True)
        os.link(staged, target)
        flush_to_disk(target.parent)
    except FileExistsError:
        raise RequestError(409, "run_taken", f"{target.name} exists already; add this one as another repeat") from None
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=target.name) from error


def _collect(path: Path, enter: bool) -> ForcemapError | None:
    """Collect a campaign; the error, None if there is none."""
    try:
        collect_campaign(path, enter=enter)
    except ForcemapError as error:
        return error
    return None
