"""The folder that is served: its campaigns by name, and nothing outside it."""

from __future__ import annotations

import os
from pathlib import Path

from forcemap.errors import InputError
from forcemap.web.refusal import Refusal

_FILES = ("campaign.toml", "plan.csv", "recordings.csv", "impacts.csv", "recordings")
_MARKS = ("campaign.toml", "plan.csv", "impacts.csv")


class Folder:
    """A campaign's folder, or a folder of such folders.

    Raises
    ------
    InputError
        There is no such folder.
    """

    def __init__(self, path: str | Path) -> None:
        if not Path(path).is_dir():
            message = "there is no such folder; name a campaign's folder or a folder of campaigns"
            raise InputError(message, file=str(path))
        self.root = Path(path).resolve()
        self.single = _is_campaign(self.root)

    def campaigns(self) -> dict[str, Path]:
        """Folders of the campaigns by name; a folder that is a link is left alone."""
        if self.single:
            return {_shown(self.root): self.root}
        folders = sorted(Path(e.path) for e in os.scandir(self.root) if e.is_dir(follow_symlinks=False))
        return {_shown(e): e for e in folders if not e.name.startswith(".") and _is_campaign(e)}

    def campaign(self, name: str) -> Path:
        """The folder of a campaign, looked up by its name, never made from it.

        Raises
        ------
        Refusal
            No campaign has the name; or one of its files is a link that leads out of the folder.
        """
        found = self.campaigns().get(name)
        if found is None:
            raise Refusal(404, "not_found", f"no campaign is named {name!r}; the overview lists them")
        self._require_inside(found)
        return found

    def _require_inside(self, campaign: Path) -> None:
        for path in (campaign / name for name in _FILES):
            if path.is_symlink():
                self._refuse_outside(path)
        for home, folders, files in os.walk(campaign / "recordings"):
            for path in (Path(home, name) for name in (*folders, *files)):
                if path.is_symlink():
                    self._refuse_outside(path)

    def _refuse_outside(self, path: Path) -> None:
        if not path.resolve().is_relative_to(self.root):
            shown = path.relative_to(self.root).as_posix()
            message = "a link that leads out of the served folder is not followed; put the file itself there"
            raise Refusal(409, "link", message, file=shown)


def _shown(folder: Path) -> str:
    """The name of a folder, also where its bytes are no text."""
    return folder.name.encode(errors="surrogateescape").decode(errors="replace")


def _is_campaign(folder: Path) -> bool:
    return any((folder / name).exists() for name in _MARKS)
