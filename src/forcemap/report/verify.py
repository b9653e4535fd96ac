"""What changed since a report was written."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from forcemap.assessment.inputs import campaign_inputs
from forcemap.files import read_bytes
from forcemap.report.seal import read_seal


@dataclass(frozen=True)
class Verification:
    """A report beside the campaign's folder as it is now; paths are below the folder.

    Parameters
    ----------
    intact : bool
        True if the report file is as it was written. Its hash is no signature: who alters it knowingly can make a new
        one.
    changed, vanished, new : tuple of str
        Inputs with another content, inputs that are gone, and files that the report does not know.
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
    known = {each.path for each in campaign_inputs(folder)}
    now = {each.path: each.sha256 for each in campaign_inputs(folder, further=sealed.inputs.keys() - known)}
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
