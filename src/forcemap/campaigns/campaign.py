"""A campaign's folder: campaign.toml, plan.csv, recordings/, recordings.csv, impacts.csv."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from forcemap.campaigns.conditions import CAMPAIGN_FILE, Conditions, read_campaign_file
from forcemap.campaigns.impacts_table import TABLE_FILE
from forcemap.campaigns.plan import PLAN_FILE, MeasurementPlan, read_plan
from forcemap.campaigns.recordings_table import REGISTER_FILE, Entry, Use, read_register
from forcemap.campaigns.state import StateTolerance
from forcemap.errors import CampaignFileError, InputError
from forcemap.files import file_sha256
from forcemap.recordings.column_map import ColumnMap

RECORDINGS_FOLDER = "recordings"


@dataclass(frozen=True, eq=False)
class Campaign:
    """A campaign as its folder states it.

    Parameters
    ----------
    folder : Path
    conditions : Conditions
        What it is measured under.
    columns : ColumnMap or None
        How the device writes its files; None if campaign.toml does not say.
    plan : MeasurementPlan
        What is to be measured.
    entries : tuple of Entry
        The register of recordings as it was last written.
    register_sha256 : str
        SHA-256 of the register's file; empty if there is none.
    stated_sha256 : tuple of str
        SHA-256 of campaign.toml and of plan.csv, from before they were read; empty if they are not known.
    """

    folder: Path
    conditions: Conditions
    columns: ColumnMap | None
    plan: MeasurementPlan
    entries: tuple[Entry, ...] = ()
    register_sha256: str = ""
    stated_sha256: tuple[str, ...] = ()

    @property
    def recordings(self) -> Path:
        """The folder of raw files."""
        return self.folder / RECORDINGS_FOLDER

    @property
    def register_file(self) -> Path:
        """The register of recordings."""
        return self.folder / REGISTER_FILE

    @property
    def table_file(self) -> Path:
        """The impacts table."""
        return self.folder / TABLE_FILE

    def files(self) -> list[str]:
        """Paths of the raw files below the folder of recordings, sorted; hidden ones are left alone.

        Raises
        ------
        CampaignFileError
            A link that leads to no file.
        """
        if not self.recordings.is_dir():
            return []
        return sorted(files_below(self.recordings))

    @property
    def missing(self) -> list[str]:
        """Planned runs without a recording that is used, in the order of the plan."""
        used = {(entry.state_id, entry.repeat) for entry in self.entries if entry.use is Use.USED}
        runs = zip(self.plan.recording, self.plan.state_id, self.plan.repeat, strict=True)
        return [str(name) for name, state, repeat in runs if (str(state), int(repeat)) not in used]

    @property
    def recorded(self) -> set[str]:
        """Planned states of which there is a recording, whatever became of it: registered, or named for a run."""
        files = [PurePosixPath(file).stem for file in (*self.files(), *(entry.file for entry in self.entries))]
        runs = [self.plan.run_named(name) for name in (*files, *(entry.curve for entry in self.entries))]
        return {state for state, _ in filter(None, runs)} | {entry.state_id for entry in self.entries}


def is_campaign(folder: Path) -> bool:
    """True if a folder holds a campaign.toml, a plan or an impacts table."""
    return any((folder / name).exists() for name in (CAMPAIGN_FILE, PLAN_FILE, TABLE_FILE))


def campaign_folders(root: Path) -> list[str]:
    """Names of the campaigns in a folder, sorted; hidden folders are left alone.

    Raises
    ------
    CampaignFileError
        One that would be overlooked: a link, a folder in a folder, or one that states no conditions.
    """
    found = sorted(folder for folder in root.glob("[!.]*") if is_campaign(folder))
    deeper = [folder for each in root.glob("[!.]*") for folder in each.glob("[!.]*") if is_campaign(folder)]
    for folder, why in (
        *((each, "a link") for each in found if each.is_symlink()),
        *((each, f"without {CAMPAIGN_FILE}") for each in found if not (each / CAMPAIGN_FILE).exists()),
        *((each, "a folder deeper than the others") for each in deeper),
    ):
        message = f"this campaign, {why}, would be overlooked; move it, complete it, or name what belongs together in"
        raise CampaignFileError(f"{message} atlas.toml", file=str(folder))
    return [folder.name for folder in found]


def campaign_folder(folder: str | Path) -> Path:
    """The folder, which has to be there."""
    root = Path(folder)
    if root.is_file():
        raise InputError(
            "this is a file; name the folder of a campaign, with its impacts as impacts.csv", file=str(folder)
        )
    if not root.is_dir():
        raise InputError("there is no such folder", file=str(folder))
    return root


def read_campaign(folder: str | Path) -> Campaign:
    """Read a campaign's folder.

    Parameters
    ----------
    folder : str or Path
        Must hold `campaign.toml` and `plan.csv`.

    Returns
    -------
    Campaign

    Raises
    ------
    InputError
        The folder or one of the two files is missing.
    CampaignFileError
        campaign.toml cannot be used.
    TableError
        plan.csv or recordings.csv cannot be used.
    """
    root = campaign_folder(folder)
    _require(root / CAMPAIGN_FILE, folder)
    of_conditions = file_sha256(root / CAMPAIGN_FILE)
    conditions, columns = read_campaign_file(root / CAMPAIGN_FILE)
    _require(root / PLAN_FILE, folder)
    stated = of_conditions, file_sha256(root / PLAN_FILE)
    tolerance = StateTolerance.stated(conditions.place_tolerance, conditions.speed_tolerance)
    plan = read_plan(root / PLAN_FILE, tolerance=tolerance)
    campaign = with_register(Campaign(root, conditions, columns, plan, stated_sha256=stated))
    if conditions.devices:
        runs = zip(campaign.plan.state_id.tolist(), campaign.plan.recording.tolist(), strict=True)
        registered = ((entry.state_id, entry.name) for entry in campaign.entries)
        names = [*runs, *registered, *(("", file) for file in campaign.files())]
        conditions.require_devices_used(names, str(root / CAMPAIGN_FILE))
    return campaign


def with_register(campaign: Campaign) -> Campaign:
    """The campaign with its register as it is now.

    Raises
    ------
    TableError
        The register cannot be used.
    """
    register = campaign.register_file
    if not register.exists():
        return replace(campaign, entries=(), register_sha256="")
    checksum = file_sha256(register)  # before it is read: an edit then shows
    return replace(campaign, entries=read_register(register), register_sha256=checksum)


def files_below(folder: Path, above: str = "") -> Iterator[str]:
    """Paths of the files in a folder and those below it, but for hidden ones, behind the names of the folders above.

    Raises
    ------
    CampaignFileError
        A link to a folder, or to nothing, or a folder that may not be read: what lies there would silently count for
        nothing.
    """
    try:
        entries = [entry for entry in os.scandir(folder) if not entry.name.startswith(".")]
    except PermissionError:
        raise CampaignFileError("the folder may not be read; what lies in it counts", file=str(folder)) from None
    for entry in entries:
        if entry.is_symlink() and not entry.is_file():
            message = "a link to a folder, or to nothing, is not followed; put the files themselves there"
            raise CampaignFileError(message, file=entry.path)
        if entry.is_dir():
            yield from files_below(Path(entry.path), f"{above}{entry.name}/")
        elif entry.is_file():
            yield above + entry.name


def _require(file: Path, folder: str | Path) -> None:
    if not file.exists():
        below = sorted(each.name for each in Path(folder).glob("[!.]*") if is_campaign(each))
        if below and not Path(folder, CAMPAIGN_FILE).exists():
            raise InputError(f"this folder holds campaigns ({', '.join(below)}); name one of them", file=str(folder))
        message = f"a campaign's folder holds {CAMPAIGN_FILE} and {PLAN_FILE}, this one has no {file.name}"
        raise InputError(f"{message}; forcemap plan writes both", file=str(folder))
