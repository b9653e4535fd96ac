"""What a report says about itself and its inputs, for programs: hashes in the page, and what changed since."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Self
from urllib.parse import quote, unquote_to_bytes

from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.folder import (
    InputFile,
    campaign_inputs,
    campaign_limit_table,
    inputs_sha256,
    is_standard_input,
)
from forcemap.assessment.missing import Missing, attempt
from forcemap.campaigns.conditions import CAMPAIGN_FILE, read_conditions
from forcemap.errors import InputError
from forcemap.files import MARKED_BY, read_bytes, sha256
from forcemap.limits.body_areas import standard_limit_table
from forcemap.limits.force_limits import ForceLimit

MARK = "forcemap-report/1"
"""Schema of the page, within its first 4000 bytes."""

REPORT_MARK = 'name="forcemap-report"'
"""By which a page is known as a report, of a campaign or an atlas."""

REPORT_FILE = "report.html"
"""The report in a campaign's folder, unless another file is named."""

LIST_ENDING = ".sha256"
"""Of the file beside the page that lists every input with its SHA-256, as sha256sum writes and checks it."""

PDF = b"%PDF"
"""How the content of a PDF begins."""

_OPEN = "0" * 64
_DIGITS = 12  # of a table's SHA-256 that name its version
_LINE = re.compile(r"([0-9a-f]{64}|-)  (.+)")
_TEXTS = (".csv", ".toml", ".txt", ".json")  # inputs whose line ends mail may change
_OWN = "forcemap-report-sha256"
_SEAL = f'<meta name="{_OWN}" content="{{}}">'
_HASH = re.compile(r"[0-9a-f]{64}")
_ALTERED = "ALTERED since it was written; do not sign it, keep this file, and ask for the report as it was written"


@dataclass(frozen=True)
class MadeFor:
    """What a report gives an answer for.

    Parameters
    ----------
    areas : tuple of str
        Body areas, each with the version of its table of limits (`area_with_table`); none if it does not say.
    bound : str
        The bound.
    form : str
        Form of the map; empty if it has none, or does not say.
    refused : tuple of str or None
        Contact points that it does not permit; None if it does not say.
    """

    areas: tuple[str, ...] = ()
    bound: str = ""
    form: str = ""
    refused: tuple[str, ...] | None = None

    @classmethod
    def of(cls, assessment: CampaignAssessment) -> Self:
        """What the report of an assessment is made for."""
        bound = "no bound" if isinstance(assessment.bound, Missing) else str(assessment.bound)
        form = "" if isinstance(assessment.force_map, Missing) else assessment.force_map.form.name
        return cls(tuple(sorted(map(area_with_table, assessment.limits))), bound, form, refused_points(assessment))

    @classmethod
    def read(cls, text: str) -> Self:
        """As a page states it; nothing if it does not."""
        try:
            stated = json.loads(text)
        except (ValueError, RecursionError):
            return cls()
        match stated:
            case [[*areas], str(bound), *more] if all(isinstance(area, str) for area in areas):
                match more:
                    case [str(form), [*refused]] if all(isinstance(name, str) for name in refused):
                        return cls(tuple(areas), bound, form, tuple(refused))
                    case []:  # of an earlier version
                        return cls(tuple(areas), bound)
        return cls()

    @property
    def text(self) -> str:
        """As it stands in the page."""
        return json.dumps([self.areas, self.bound, *([] if self.refused is None else [self.form, self.refused])])

    @property
    def tables(self) -> tuple[str, ...]:
        """The first digits of the SHA-256 of its tables of limits."""
        found = (re.search(rf", ([0-9a-f]{{{_DIGITS}}})\)$", area) for area in self.areas)
        return tuple(dict.fromkeys(each[1] for each in found if each))

    def unlike(self, other: Self) -> str:
        """In words, areas and bound as far as they are not those of another report."""
        areas = "" if self.areas == other.areas else ", ".join(self.areas)
        return " with ".join(filter(None, [areas, "" if self.bound == other.bound else self.bound]))

    def answers_for(self, earlier: Self) -> bool:
        """True if it answers all that a report made for `earlier` does."""
        return self.bound == earlier.bound and set(earlier.areas) <= set(self.areas)


def refused_points(assessment: CampaignAssessment) -> tuple[str, ...]:
    """Contact points that are not permitted; of a list that cannot be used a word for all of them."""
    if isinstance(assessment.points, Missing):
        return ("all of the list",)
    return tuple(result.point.name for result in assessment.points if result.lacks)


def area_with_table(limit: ForceLimit) -> str:
    """A body area with the edition and the version of its table of limits."""
    return f"{limit.name} ({limit.edition}, {limit.sha256[:_DIGITS]})"


@dataclass(frozen=True)
class Sealed:
    """What a report says about itself.

    Parameters
    ----------
    software, date : str
        What made it, and the date it states.
    inputs_sha256 : str
        Of all inputs together.
    further : tuple of str
        Inputs that no other campaign would have, as its own table of limits.
    intact : bool
        True if the page is as it was written; line ends may differ.
    made_for : MadeFor
        What it gives an answer for.
    """

    software: str
    date: str
    inputs_sha256: str
    further: tuple[str, ...]
    intact: bool
    made_for: MadeFor = MadeFor()


def seal_tag() -> str:
    """The tag that carries the page's own hash, still open."""
    return _SEAL.format(_OPEN)


def seal(page: str) -> str:
    """The page with its own SHA-256 in it: that of the page with zeros in its place."""
    return page.replace(seal_tag(), _SEAL.format(_sha256(page)), 1)


def _sha256(page: str) -> str:
    """SHA-256 of a page, whatever its line ends, and with or without line ends behind it."""
    return sha256(page.replace("\r\n", "\n").rstrip("\n"))


def inputs_list(inputs: Iterable[InputFile]) -> str:
    """The file that lists every input with its SHA-256, a line each."""
    return "".join(f"{file.sha256 or '-'}  {quoted(file.path)}\n" for file in inputs)


def is_inputs_list(content: bytes) -> bool:
    """True if a file is such a list."""
    lines = content.decode("ascii", "replace").splitlines()
    return bool(lines) and all(map(_LINE.fullmatch, lines))


def further_inputs(inputs: Iterable[InputFile]) -> str:
    """The inputs that no other campaign would have, for the page."""
    return "|".join(quoted(file.path) for file in inputs if not is_standard_input(file.path))


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
        was = f": a report that was {_ALTERED}" if is_report(content) else ", expected the HTML file of a report"
        raise InputError(f"not a text in UTF-8{was}", file=file) from None
    meta = page_meta(page)
    if meta.get("forcemap-report") != MARK:
        raise InputError(f"no report of schema {MARK}, expected the HTML file that forcemap report wrote", file=file)
    digest = meta.get("forcemap-inputs-sha256", "")
    if not _HASH.fullmatch(meta.get(_OWN, "")) or not _HASH.fullmatch(digest):
        raise InputError(f"the report carries no hashes any more: it was {_ALTERED}", file=file)
    return Sealed(
        software=meta.get("generator", ""),
        date=meta.get("forcemap-date", ""),
        inputs_sha256=digest,
        further=tuple(unquoted(path) for path in meta.get("forcemap-further-inputs", "").split("|") if path),
        intact=is_intact(content),
        made_for=MadeFor.read(meta.get("forcemap-limits", "")),
    )


def is_report(content: bytes) -> bool:
    """True if a file is a report of a campaign or an atlas, altered or not."""
    return REPORT_MARK.encode() in content[:MARKED_BY]


def is_atlas_page(content: bytes) -> bool:
    """True if a report is that of an atlas."""
    return f'{REPORT_MARK} content="{MARK}, atlas"'.encode() in content[:MARKED_BY]


def is_intact(content: bytes) -> bool:
    """True if a report, of a campaign or an atlas, is as it was written; line ends may differ."""
    try:
        page = content.decode("utf-8")
    except UnicodeDecodeError:
        return False
    own = page_meta(page).get(_OWN, "")
    return _sha256(page.replace(_SEAL.format(own), seal_tag(), 1)) == own


def altered(report: str | Path) -> str:
    """In words, what of a report that is there is not as it was written, the page or its list; empty if nothing is."""
    content, beside = read_bytes(report), Path(report).with_suffix(LIST_ENDING)
    if not is_report(content):
        return ""
    if not is_intact(content):
        return "this report"
    digest = page_meta(content.decode("utf-8")).get("forcemap-inputs-sha256")
    same = not digest or not beside.exists() or _digest(read_bytes(beside)) == digest
    return "" if same else f"the list of inputs beside this report ({beside.name})"


def _digest(listed: bytes) -> str:
    """The digest of all inputs of a list."""
    return inputs_sha256(InputFile(*entry) for entry in _read_list(listed).items())


def page_meta(page: str) -> dict[str, str]:
    """The meta entries of the head."""
    reader = _Reader()
    reader.feed(page.partition("</head>")[0])
    return reader.meta


def unquoted(path: str) -> str:
    """The path that `quoted` wrote."""
    return os.fsdecode(unquote_to_bytes(path))


class _Reader(HTMLParser):
    """Collects the meta entries."""

    def __init__(self) -> None:
        super().__init__()
        self.meta: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect from a meta entry."""
        values = {name: value or "" for name, value in attrs}
        if tag == "meta" and "name" in values:
            self.meta.setdefault(values["name"], values.get("content", ""))


@dataclass(frozen=True)
class Verification:
    """A report beside the campaign's folder as it is now; paths are below the folder.

    Parameters
    ----------
    intact : bool
        True if the report file is as it was written. Its hash is no signature: who alters it knowingly can make a new
        one.
    changed, vanished, new : tuple of str
        Inputs whose content changed, inputs that are gone, and files that the report does not know; as far as the list
        beside the report tells.
    line_ends : tuple of str
        Inputs in which nothing but the line ends changed.
    unchanged : int
        Number of inputs that are as they were.
    not_compared : tuple of str
        Files below the folder that are no input, such as tables of speeds: whether they changed is not told.
    tables_not_compared : tuple of str
        First digits of the SHA-256 of tables of limits that the report rests on, but which are no file of the folder
        and not the standard's: whether they changed is not told.
    inputs_hold : bool
        True if the inputs are those of the digest that stands in the report.
    listed : bool
        True if the list of inputs beside the report is that of the digest.
    list_altered : bool
        True if there is a list beside the report, and it is another.
    software, date : str
        What made the report, and the date it states.
    digest, digest_now : str
        SHA-256 of all inputs together: as it stands in the report, on its page 1, and of the folder as it is.
    """

    intact: bool
    changed: tuple[str, ...]
    vanished: tuple[str, ...]
    new: tuple[str, ...]
    line_ends: tuple[str, ...]
    unchanged: int
    not_compared: tuple[str, ...]
    tables_not_compared: tuple[str, ...]
    inputs_hold: bool
    listed: bool
    list_altered: bool
    software: str
    date: str
    digest: str
    digest_now: str

    @property
    def nothing_changed(self) -> bool:
        """True if nothing that was compared changed, neither the report nor an input."""
        return self.intact and self.inputs_hold and not self.list_altered

    @property
    def holds(self) -> bool:
        """True if nothing changed, and all that the report rests on was compared."""
        return self.nothing_changed and not self.tables_not_compared


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
        The file is no report, or cannot be read; there is no such folder. Of a PDF the error names the folder's digest.
    """
    content, beside = read_bytes(report), Path(report).with_suffix(LIST_ENDING)
    there = _read_list(read_bytes(beside)) if beside.exists() else None
    if content.startswith(PDF) or Path(report).suffix.lower() == ".pdf":
        digest = inputs_sha256(_inputs(folder, {*(there or ()), *_own_table(folder)}))
        said = f"compare the digest on its page 1 with this one, of the folder as it is now: {digest}"
        raise InputError(f"a PDF, as a print, is checked by its digest: {said}", file=str(report))
    sealed = read_seal(content, str(report))
    listed = there is not None and _digest(read_bytes(beside)) == sealed.inputs_sha256
    then = there if listed and there is not None else {}
    inputs = _inputs(folder, {*sealed.further, *then})
    now = {file.path: file.sha256 for file in inputs}
    differing = tuple(path for path, digest in then.items() if path in now and now[path] != digest)
    line_ends = tuple(path for path in differing if _line_ends_alone(Path(folder, path), then[path]))
    changed = tuple(path for path in differing if path not in line_ends)
    vanished = tuple(path for path in then if path not in now)
    new = tuple(path for path in now if path not in then) if listed else ()
    digest_now = inputs_sha256(inputs)
    same = digest_now == sealed.inputs_sha256
    return Verification(
        intact=sealed.intact,
        changed=changed,
        vanished=vanished,
        new=new,
        line_ends=line_ends,
        unchanged=len(then) - len(differing) - len(vanished) if listed else len(now) if same else 0,
        not_compared=_no_inputs(folder, {*now, *then}, {Path(report), beside}),
        tables_not_compared=_elsewhere(sealed.made_for.tables, [*now.values(), *then.values()]),
        inputs_hold=not (changed or vanished or new) if listed else same,
        listed=listed,
        list_altered=there is not None and not listed,
        software=sealed.software,
        date=sealed.date,
        digest=sealed.inputs_sha256,
        digest_now=digest_now,
    )


def _inputs(folder: str | Path, further: set[str]) -> tuple[InputFile, ...]:
    """The inputs of a campaign as they are, with further ones that a report had."""
    return campaign_inputs(folder, further=further - {file.path for file in campaign_inputs(folder)})


def _no_inputs(folder: str | Path, inputs: set[str], own: set[Path]) -> tuple[str, ...]:
    """Files below the folder that are neither an input nor the report's own; hidden ones left out."""
    beside = {path.resolve() for path in own}
    files = {path.relative_to(folder): path for path in sorted(Path(folder).rglob("*")) if path.is_file()}
    shown = {below.as_posix(): path for below, path in files.items() if not any(p.startswith(".") for p in below.parts)}
    return tuple(name for name, path in shown.items() if name not in inputs and path.resolve() not in beside)


def _elsewhere(tables: Iterable[str], digests: Sequence[str]) -> tuple[str, ...]:
    """Of tables of limits, by the first digits of their SHA-256, those that are neither an input nor the standard's."""
    known = [*digests, standard_limit_table().sha256]
    return tuple(table for table in tables if not any(digest.startswith(table) for digest in known))


def _own_table(folder: str | Path) -> list[str]:
    """The campaign's own table of limits, as a report without a list beside it had it."""
    own = attempt(lambda: campaign_limit_table(folder, read_conditions(Path(folder, CAMPAIGN_FILE))))
    return [] if isinstance(own, Missing) or not own.file else [own.file]


def _read_list(content: bytes) -> dict[str, str]:
    """SHA-256 by path; empty where a line is none of a list, so that its digest is another."""
    lines = [_LINE.fullmatch(line) for line in content.decode("ascii", "replace").splitlines()]
    if not all(lines):
        return {}
    return {unquoted(line[2]): line[1].replace("-", "") for line in lines if line}


def _line_ends_alone(path: Path, digest: str) -> bool:
    """True if a text is as it was but for its line ends."""
    if path.suffix.lower() not in _TEXTS:
        return False
    plain = read_bytes(path).replace(b"\r\n", b"\n")
    return digest in (sha256(plain), sha256(plain.replace(b"\n", b"\r\n")))
