"""What a campaign's folder remembers of its recordings, so that one that was judged need not be judged again.

A file that may be deleted at any time. It counts only under a seal of this account over what was remembered and all
that it depends on: the software, the column map, the device, the date and the
filter. One that was damaged, edited, written by another account or under anything else is as good as none. Whether a
recording is the one remembered is told by the hash of its content. Nothing rests on this memory but the tables that
`build_dataset` writes: reports, their verification and verdicts judge the recordings again.

Three lines: the seal of the second, the readouts, and the seal of the folder as it was when it was last collected, with
the hashes of all that collecting reads and writes: as long as it is so, collecting gives the same tables once more.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.pressures import PRESSURES_FOLDER, films_in
from forcemap.campaigns.readout import FileReadout, ImpactReadout, Reader, Readout, judging, sha256_of
from forcemap.campaigns.recorded_impacts import judged_under
from forcemap.campaigns.seal import is_sealed, seal
from forcemap.campaigns.workers import in_processes
from forcemap.errors import InputError
from forcemap.files import file_sha256, sha256, write_atomically
from forcemap.impacts.impact import Flag, Quality
from forcemap.impacts.scenario import ContactScenario

MEMORY_FILE, NOTE_FILE = ".judged", ".collecting"
"""What is remembered; the note that is beside the tables while they are being replaced."""

_ROOMS = ("recordings", "impacts", "campaigns")  # with the ground: all that a judgement can depend on
_PACKAGES = ("numpy", "scipy", "nptdms")

_Known = dict[tuple[str, str], FileReadout]  # by file and state


def checksums_of(campaign: Campaign) -> dict[str, str]:
    """SHA-256 of every raw file; empty where it cannot be read."""
    return {name: sha256_of(f"{campaign.recordings}/{name}") for name in campaign.files()}


def read_from(campaign: Campaign, checksums: Mapping[str, str]) -> str:
    """All that collecting reads but the register and the table, by hashes from before it is read; empty if unknown."""
    films = [file for found in films_in(campaign.folder / PRESSURES_FOLDER).values() for file in found]
    hashes = [(film.name, sha256_of(film)) for film in films]
    return json.dumps([campaign.stated_sha256, hashes, dict(checksums)]) if campaign.stated_sha256 else ""


def is_settled(campaign: Campaign, read: str) -> bool:
    """Whether the folder is to the byte as it was left by collecting, so that collecting it would write the same."""
    if not read or (campaign.folder / NOTE_FILE).exists():
        return False
    tables = sha256_of(campaign.register_file), sha256_of(campaign.table_file)
    return is_sealed("\n".join([read, *tables]), _lines(campaign)[2], _under(campaign))


def settle(campaign: Campaign, read: str, register: str, table: str) -> None:
    """Remember what was read and the texts that were written of it."""
    first, second, before = _lines(campaign)
    sealed = seal("\n".join([read, sha256(register), sha256(table)]), _under(campaign))
    if read and sealed not in ("", before):
        _write(campaign, (first, second, sealed))


@contextmanager
def remembering(campaign: Campaign, checksums: Mapping[str, str], *, workers: int = 1) -> Iterator[Reader]:
    """A reader that judges only what is not remembered; what was read is remembered at the end.

    It gives the same readouts as `judging`, without the recordings themselves.

    Parameters
    ----------
    campaign : Campaign
    checksums : mapping of str to str
        SHA-256 of every raw file.
    workers : int
        Processes that judge at once, where there are many files (`in_processes`).
    """
    under = _under(campaign)
    before = _opened(campaign, under)
    known, judge = _readouts(before), _without_recordings(judging(campaign))
    unknown = [name for name, checksum in checksums.items() if not _is(known.get((name, "")), checksum)]
    used: _Known = {}
    with in_processes(judge, unknown, workers) as judged:

        def read(file: str, state: str = "") -> FileReadout:
            checksum = checksums.get(file, "")
            shown = known.get((file, state))
            if shown is None or not _is(shown, checksum):
                shown = judged(file) if not state else judge(file, state)
            if _is(shown, checksum) and not shown.missing_extra:  # else it changed while it was read
                used[file, state] = shown
            return shown

        yield read
    if not before or list(used.items()) != list(known.items()):
        text = _text(used)
        if of_text := seal(text, under):
            _write(campaign, (of_text, text, ""))


def _is(shown: FileReadout | None, checksum: str) -> bool:
    """Whether a readout is that of the file with this hash."""
    return shown is not None and shown.sha256 == checksum != ""


def _without_recordings(read: Reader) -> Reader:
    def judge(file: str, state: str = "") -> FileReadout:
        return replace(read(file, state), recorded=())

    return judge


def _opened(campaign: Campaign, under: str) -> str:
    """The readouts that are remembered, as text; empty if there are none, or the seal is another one."""
    of_text, text, _ = _lines(campaign)
    return text if is_sealed(text, of_text, under) else ""


def _lines(campaign: Campaign) -> tuple[str, str, str]:
    """The lines of the file; empty ones where there is none."""
    try:
        lines = (campaign.folder / MEMORY_FILE).read_text(encoding="utf-8").split("\n")
    except (OSError, ValueError):
        lines = []
    first, second, third, *_ = [*lines, "", "", ""]
    return first, second, third


def _write(campaign: Campaign, lines: tuple[str, str, str]) -> None:
    with suppress(InputError):  # a folder that cannot be written has no memory
        write_atomically(campaign.folder / MEMORY_FILE, "\n".join(lines))


def _under(campaign: Campaign) -> str:
    """All that a judgement depends on; empty if the software cannot be told."""
    software = _software()
    return software and f"{software}\n{judged_under(campaign.conditions)!r}\n{campaign.columns!r}"


@cache
def _software() -> str:
    """The source that a judgement runs through, by its hashes, and versions of what it calls; empty without source."""
    root = Path(__file__).parents[1]
    sources = sorted([*root.glob("*.py"), *(path for room in _ROOMS for path in (root / room).rglob("*.py"))])
    hashes = [f"{path.relative_to(root).as_posix()} {file_sha256(path)}" for path in sources]
    return sha256("\n".join([sys.version, *map(_version, _PACKAGES), *hashes])) if hashes else ""


def _version(package: str) -> str:
    try:
        return f"{package} {metadata.version(package)}"
    except metadata.PackageNotFoundError:
        return f"{package} none"


def _text(used: Mapping[tuple[str, str], FileReadout]) -> str:
    """Readouts as JSON; the same readouts give the same text."""
    flat = [[*name, shown.sha256, shown.unreadable, shown.readouts] for name, shown in used.items()]
    return json.dumps(flat, default=_flag_text, separators=(",", ":"))


def _flag_text(flag: Flag) -> tuple[str, str]:
    return flag.name.value, flag.figure


def _readouts(text: str) -> _Known:
    """The readouts of a text that was sealed, so that it is as `_text` wrote it."""
    return {
        (file, state): FileReadout(sha256, tuple(_readout(*values) for values in readouts), unreadable)
        for file, state, sha256, unreadable, readouts in (json.loads(text) if text else [])
    }


def _readout(*values: Any) -> Readout:
    shown = Readout(*values)
    impacts = tuple(_impact(*figures) for figures in shown.impacts)
    return shown._replace(notes=tuple(shown.notes), impacts=impacts)


def _impact(*values: Any) -> ImpactReadout:
    shown = ImpactReadout(*values)
    flags = tuple(Flag(Quality(name), figure) for name, figure in values[-1])
    return shown._replace(scenario=ContactScenario(shown.scenario), flags=flags)
