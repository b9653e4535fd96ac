"""Whether the page of an atlas is of its campaigns and their reports as they are now."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from forcemap.errors import InputError
from forcemap.files import read_bytes
from forcemap.maps.map_file import map_sha256, read_map
from forcemap.paths.atlas import atlas_names
from forcemap.report.seal import REPORT_FILE, is_intact, page_meta, quoted, unquoted, verify_report


def campaigns_meta(digests: Mapping[str, str]) -> str:
    """The campaigns of an atlas for its page, each with the digest of its inputs, of a map file that of the map."""
    return "|".join(f"{digest or '-'} {quoted(name)}" for name, digest in digests.items())


@dataclass(frozen=True)
class AtlasVerification:
    """The page of an atlas beside what its campaigns and their reports are now.

    Parameters
    ----------
    intact : bool
        True if the page is as it was written.
    changed, vanished, new : tuple of str
        Campaigns whose inputs or map, or whose report, are not those of the page; that are gone; that it does not know.
    software, date : str
        What made the page, and the date it states.
    """

    intact: bool
    changed: tuple[str, ...]
    vanished: tuple[str, ...]
    new: tuple[str, ...]
    software: str
    date: str

    @property
    def holds(self) -> bool:
        """True if nothing changed."""
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
    return AtlasVerification(
        intact=is_intact(content),
        changed=tuple(name for name in names if name in then and not _as_then(root / name, then[name])),
        vanished=tuple(name for name in then if name not in names),
        new=tuple(name for name in names if name not in then),
        software=meta.get("generator", ""),
        date=meta.get("forcemap-date", ""),
    )


def _as_then(campaign: Path, digest: str) -> bool:
    """Whether a campaign of an atlas, with its report, or a map file, is that of this digest."""
    if not campaign.is_dir():
        return map_sha256(read_map(campaign)) == digest
    report = campaign / REPORT_FILE
    found = verify_report(report, campaign) if report.exists() else None
    return found is not None and found.nothing_changed and found.digest == digest
