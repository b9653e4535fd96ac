"""The folder that is served: its campaigns by name, and nothing outside it."""

from __future__ import annotations

import os
from pathlib import Path

from forcemap.campaigns.campaign import is_campaign
from forcemap.errors import InputError
from forcemap.web.request_error import RequestError

_FILES = (
    *("campaign.toml", "plan.csv", "recordings.csv", "impacts.csv"),
    *("contact_points.csv", "point_recordings.csv"),
)
_FOLDERS = ("recordings", "maps", "pressures", "points", "photographs")


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
        self.single = is_campaign(self.root)

    def campaigns(self) -> dict[str, Path]:
        """Folders of the campaigns by name; folders that are links are ignored."""
        return {_shown(folder): folder for folder in self._folders()}

    def _folders(self) -> list[Path]:
        if self.single:
            return [self.root]
        folders = sorted(Path(entry.path) for entry in os.scandir(self.root) if entry.is_dir(follow_symlinks=False))
        return [folder for folder in folders if not folder.name.startswith(".") and is_campaign(folder)]

    def campaign(self, name: str) -> Path:
        """The folder of a campaign: looked up by name, never built from the name.

        Raises
        ------
        RequestError
            No campaign has the name, or two have; one of its files is a link that leads out of the folder, or no file.
        """
        matches = [folder for folder in self._folders() if _shown(folder) == name]
        if not matches:
            raise RequestError(404, "not_found", f"no campaign is named {name!r}; the overview lists them")
        if len(matches) > 1:
            raise RequestError(
                409, "ambiguous", f"{len(matches)} folders are shown by the name {name!r}; rename all but one"
            )
        self._require_files(matches[0])
        return matches[0]

    def _require_files(self, campaign: Path) -> None:
        for name in _FILES:
            self._require_file(campaign / name)
        for folder in _FOLDERS:
            self._require_inside(campaign / folder)
            if (campaign / folder).exists() and not (campaign / folder).is_dir():
                raise RequestError(409, "file", "not a folder, expected one", file=self._below(campaign / folder))
            for directory, folders, files in os.walk(campaign / folder):
                for name in folders:
                    self._require_inside(Path(directory, name))
                for name in files:
                    self._require_file(Path(directory, name))

    def _require_file(self, path: Path) -> None:
        """Refuse what is no file, such as a pipe, which has no end; a link to nothing is left to the reader."""
        self._require_inside(path)
        if path.exists() and not path.is_file():
            raise RequestError(409, "file", "not a file, expected one", file=self._below(path))

    def _require_inside(self, path: Path) -> None:
        if path.is_symlink() and not path.resolve().is_relative_to(self.root):
            message = "a link that leads out of the served folder is not followed; put the file itself there"
            raise RequestError(409, "link", message, file=self._below(path))

    def _below(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix()


def _shown(folder: Path) -> str:
    """The name of a folder, with a replacement character for bytes that are no UTF-8."""
    return folder.name.encode(errors="surrogateescape").decode(errors="replace")
