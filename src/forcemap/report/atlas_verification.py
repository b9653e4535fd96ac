"""Whether the page of an atlas is of its campaigns and their reports as they are now."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from forcemap.errors import InputError
from forcemap.files import read_bytes, sha256
from forcemap.maps.map_file import map_sha256, read_map
from forcemap.paths.atlas import atlas_names
from forcemap.report.seal import (
    REPORT_FILE,
    MadeFor,
    Verification,
    is_intact,
    page_meta,
    quoted,
    read_seal,
    unquoted,
    verify_report,
)


def campaigns_meta(digests: Mapping[str, str]) -> str:
    """The campaigns of an atlas for its page, each with the digest of its report, of a map file that of the map."""
    return "|".join(f"{digest or '-'} {quoted(name)}" for name, digest in digests.items())


def report_digest(inputs_sha256: str, made_for: MadeFor) -> str:
    """SHA-256 of what a report rests on and what it is made for: of another bound or area it is another report."""
    return sha256(f"{inputs_sha256} {made_for.text}".encode())


@dataclass(frozen=True)
class AtlasVerification:
    """The page of an atlas beside what its campaigns and their reports are now.

    Parameters
    ----------
    intact : bool
        True if the page is as it was written.
    changed, vanished, new : tuple of str
        Campaigns whose inputs or map, or whose report, are not those of the page; that are gone; that it does not know.
    not_compared : tuple of str
        Campaigns of which all that could be compared is as then, but not a table of limits that is no file of theirs.
    software, date : str
        What made the page, and the date it states.
    """

    intact: bool
    changed: tuple[str, ...]
    vanished: tuple[str, ...]
    new: tuple[str, ...]
    not_compared: tuple[str, ...]
    software: str
    date: str

    @property
    def holds(self) -> bool:
        """True if nothing changed, and all that it rests on was compared."""
        return self.nothing_changed and not self.not_compared

    @property
    def nothing_changed(self) -> bool:
        """True if nothing that was compared changed."""
        return self.intact and not (self.changed or self.vanished or self.new)


def verify_atlas(page: str | Path, atlas: str | Path) -> AtlasVerification:
    """Compare the page of an atlas with its campaigns, and with their reports beside them.

    Raises
    ------
    InputError
        It is no page of an atlas, or one of an earlier version, which does not say what it rests on.
    """
    content = read_bytes(page)
    meta = page_meta(content.decode("utf-8", "replace"))
    if not (stated := meta.get("forcemap-campaigns")):
        raise InputError("this page does not say what it rests on; write the reports again", file=str(page))
    then = {unquoted(name): digest for digest, name in (each.split(" ", 1) for each in stated.split("|"))}
    root, names = atlas_names(atlas)
    known = [name for name in names if name in then]
    reports = {name: _report(root / name) for name in known if (root / name).is_dir()}
    digests = {name: _digest_now(root / name, reports.get(name)) for name in known}
    as_then = [name for name in known if digests[name] == then[name]]
    return AtlasVerification(
        intact=is_intact(content),
        changed=tuple(name for name in known if name not in as_then),
        vanished=tuple(name for name in then if name not in names),
        new=tuple(name for name in names if name not in then),
        not_compared=tuple(name for name in as_then if (one := reports.get(name)) and one.tables_not_compared),
        software=meta.get("generator", ""),
        date=meta.get("forcemap-date", ""),
    )


def _report(campaign: Path) -> Verification | None:
    """The report of a campaign beside its folder; None if it is gone."""
    report = campaign / REPORT_FILE
    return verify_report(report, campaign) if report.exists() else None


def _digest_now(campaign: Path, report: Verification | None) -> str:
    """The digest of a campaign of an atlas as it is now, of a map file that of the map; empty if what it rests on is
    not that of its report."""
    if not campaign.is_dir():
        return map_sha256(read_map(campaign))
    if report is None or not report.nothing_changed:
        return ""
    file = campaign / REPORT_FILE
    return report_digest(report.digest, read_seal(read_bytes(file), str(file)).made_for)
