"""What a report says about itself and its inputs, for programs: hashes in the page, and what changed since."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import quote, unquote_to_bytes

from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.folder import campaign_inputs
from forcemap.assessment.missing import Missing
from forcemap.errors import InputError
from forcemap.files import read_bytes, sha256

MARK = "forcemap-report/1"
"""Schema of the page, within its first 4000 bytes."""

_OPEN = "0" * 64
_SEAL = '<meta name="forcemap-report-sha256" content="{}">'


@dataclass(frozen=True)
class Sealed:
    """What a report says about itself.

    Parameters
    ----------
    software, date : str
        What made it, and the date it states.
    inputs : dict of str to str
        SHA-256 of every input by its path below the campaign's folder.
    intact : bool
        True if the page is as it was written.
    made_for : str
        The body areas it was made for, as `made_for` names them; empty if it does not say.
    """

    software: str
    date: str
    inputs: dict[str, str]
    intact: bool
    made_for: str = ""


def made_for(assessment: CampaignAssessment) -> str:
    """The body areas of a report, each with the version of its table of limits, and its bound."""
    areas = sorted(f"{limit.name} ({limit.edition}, {limit.sha256[:12]})" for limit in assessment.limits)
    bound = assessment.bound
    return f"{', '.join(areas)}; {'no bound' if isinstance(bound, Missing) else bound}"


def seal_tag() -> str:
    """The tag that carries the page's own hash, still open."""
    return _SEAL.format(_OPEN)


def seal(page: str) -> str:
    """The page with its own SHA-256 in it: that of the page with zeros in its place."""
    return page.replace(seal_tag(), _SEAL.format(sha256(page)), 1)


def quoted(path: str) -> str:
    """A path of any bytes as plain ASCII, percent-encoded."""
    return quote(os.fsencode(path), safe="/ ")


def read_seal(content: bytes, file: str) -> Sealed:
    """What the page of a report says about itself.

    Raises
    ------
    InputError
        Not a report, or one without hashes.
    """
    try:
        page = content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError("not a text in UTF-8, expected the HTML file of a report", file=file) from None
    reader = _Reader()
    reader.feed(page)
    if reader.meta.get("forcemap-report") != MARK:
        raise InputError(f"no report of schema {MARK}, expected the HTML file that forcemap report wrote", file=file)
    own = reader.meta.get("forcemap-report-sha256", "")
    if not re.fullmatch(r"[0-9a-f]{64}", own) or not reader.inputs:
        raise InputError("the report carries no hashes any more: it was altered; write it again", file=file)
    return Sealed(
        software=reader.meta.get("generator", ""),
        date=reader.meta.get("forcemap-date", ""),
        inputs=reader.inputs,
        intact=sha256(page.replace(_SEAL.format(own), seal_tag(), 1)) == own,
        made_for=reader.meta.get("forcemap-limits", ""),
    )


class _Reader(HTMLParser):
    """Collects the meta entries and the hashes of the inputs."""

    def __init__(self) -> None:
        super().__init__()
        self.meta: dict[str, str] = {}
        self.inputs: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect from a meta entry or a row of the inputs."""
        values = {name: value or "" for name, value in attrs}
        if tag == "meta" and "name" in values:
            self.meta.setdefault(values["name"], values.get("content", ""))
        if tag == "tr" and "data-file" in values:
            self.inputs[os.fsdecode(unquote_to_bytes(values["data-file"]))] = values.get("data-sha256", "")


@dataclass(frozen=True)
class Verification:
    """A report beside the campaign's folder as it is now; paths are below the folder.

    Parameters
    ----------
    intact : bool
        True if the report file is as it was written. Its hash is no signature: who alters it knowingly can make a new
        one.
    changed, vanished, new : tuple of str
        Inputs whose content changed, inputs that are gone, and files that the report does not know.
    unchanged : int
        Number of inputs that are as they were.
    software, date : str
        What made the report, and the date it states.
    """

    intact: bool
    changed: tuple[str, ...]
    vanished: tuple[str, ...]
    new: tuple[str, ...]
    unchanged: int
    software: str
    date: str

    @property
    def holds(self) -> bool:
        """True if nothing changed, neither the report nor an input."""
        return self.intact and not (self.changed or self.vanished or self.new)


def verify_report(report: str | Path, folder: str | Path) -> Verification:
    """Compare a report with the folder of its campaign.

    Parameters
    ----------
    report : str or Path
        The HTML file of the report.
    folder : str or Path
        The campaign's folder.

    Raises
    ------
    InputError
        The file is no report, or cannot be read; there is no such folder.
    """
    sealed = read_seal(read_bytes(report), str(report))
    known = {file.path for file in campaign_inputs(folder)}
    now = {file.path: file.sha256 for file in campaign_inputs(folder, further=sealed.inputs.keys() - known)}
    changed = tuple(path for path, digest in sealed.inputs.items() if path in now and now[path] != digest)
    vanished = tuple(path for path in sealed.inputs if path not in now)
    return Verification(
        intact=sealed.intact,
        changed=changed,
        vanished=vanished,
        new=tuple(path for path in now if path not in sealed.inputs),
        unchanged=len(sealed.inputs) - len(changed) - len(vanished),
        software=sealed.software,
        date=sealed.date,
    )
