"""Options that say how a device writes its files, in place of the [recordings] table of a campaign.toml."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from forcemap import ColumnMap, Conditions, InputError
from forcemap.campaigns.conditions import read_campaign_file
from forcemap.cli.options import stiffness

Columns = Annotated[
    list[str] | None,
    Option(
        "--column",
        help="How the file is written, as in [recordings] of campaign.toml, one entry each: --column time=time_ms "
        "--column time_unit=ms --column force=force_N; three columns: --column force=20,21,22.",
    ),
]
CampaignOption = Annotated[
    str | None, Option("--campaign", help="Campaign folder whose campaign.toml says how the device writes its files.")
]
DeviceRange = Annotated[float | None, Option("--device-range-N", help="Largest force the device can measure.")]
DeviceError = Annotated[
    float | None, Option("--device-error-N", help="Largest error of a reading; default 3 N, if not stated.")
]
FrequencyClass = Annotated[
    float | None,
    Option("--channel-frequency-class", help="Also read the peak after this low-pass (60, 180, 600, 1000)."),
]

_NUMBERS = ("sampling_rate_Hz", "newtons_per_count", "zero_count")
_WHOLE_NUMBERS = ("sign", "header_lines")


def described(
    source: str,
    campaign: str | None,
    entries: list[str] | None,
    device_range: float | None,
    device_error: float | None,
    frequency_class: float | None,
    device_spring: float | None = None,
) -> tuple[Conditions, ColumnMap | None]:
    """Conditions and column map of the recordings of a file or campaign, as the options say.

    A file in the folder `recordings` of a campaign is read as its campaign.toml says, without being asked.
    """
    folder = Path(campaign) if campaign else Path(source) if Path(source).is_dir() else _campaign_folder(Path(source))
    file = folder / "campaign.toml"
    if campaign and not file.exists():
        raise InputError("there is no campaign.toml in this folder", file=campaign)
    conditions, columns = read_campaign_file(file) if file.exists() else (Conditions(), None)
    if entries:
        columns = ColumnMap.from_table(entries_of(entries))
    conditions = conditions.with_device_stiffness(stiffness(device_spring))
    figures = {"range": device_range, "error": device_error}
    stated: dict[str, Any] = {name: figure for name, figure in figures.items() if figure is not None}
    if stated and conditions.devices:
        raise InputError("device: campaign.toml states several devices; state range and error there", file=str(file))
    device = dataclasses.replace(conditions.device, **stated)
    wanted = conditions.channel_frequency_class if frequency_class is None else frequency_class
    return dataclasses.replace(conditions, device=device, channel_frequency_class=wanted), columns


def campaign_of(file: str, campaign: str | None) -> Path | None:
    """The folder of the campaign that a file of recordings lies in; None for a file elsewhere."""
    path = Path(file)
    folder = Path(campaign) if campaign else _campaign_folder(path)
    inside = (folder / "plan.csv").exists() and path.resolve().is_relative_to((folder / "recordings").resolve())
    return folder if inside else None


def _campaign_folder(file: Path) -> Path:
    """The campaign's folder above a file in its `recordings`, whatever links lead there."""
    for path in (file.absolute(), file.resolve()):
        for folder in path.parents:
            if folder.name == "recordings" and (folder.parent / "campaign.toml").exists():
                return folder.parent
    return file.absolute().parent.parent


def entries_of(entries: Sequence[str]) -> dict[str, Any]:
    """The options KEY=VALUE as a table of entries."""
    return dict(_entry(entry) for entry in entries)


def _entry(text: str) -> tuple[str, Any]:
    """key=value of the option as the value of campaign.toml it stands for."""
    key, sign, value = text.partition("=")
    key, value = key.strip(), value.strip()
    if not sign or not value:
        raise InputError(f"column: found {text!r}, expected KEY=VALUE such as time=time_ms")
    try:
        if key in (*_NUMBERS, *_WHOLE_NUMBERS):
            return key, int(value) if key in _WHOLE_NUMBERS else float(value)
        if key == "direction":
            return key, [float(part) for part in value.split(",")]
    except ValueError:
        numbers = "three numbers such as direction=0,0,-1" if key == "direction" else f"a number after {key}="
        raise InputError(f"column: found {text!r}, expected {numbers}") from None
    if (key in ("force", "position") and "," in value) or (key == "runs" and value != "all"):
        return key, [_column(part) for part in value.split(",")]
    return key, _column(value) if key in ("time", "force", "curve", "segment") else value


def _column(text: str) -> str | int:
    return int(text) if text.strip().isdigit() else text.strip()
