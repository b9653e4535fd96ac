"""Options that say how a device writes its files, in place of the [recordings] table of a campaign.toml."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer

from forcemap import ColumnMap, Conditions, Device, InputError, Recording, read_campaign_file, read_recordings
from forcemap.cli.options import stiffness

Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        help="How the file is written, as in [recordings] of campaign.toml, one entry each: --column time=time_ms "
        "--column time_unit=ms --column force=force_N; three columns: --column force=20,21,22.",
    ),
]
CampaignOption = Annotated[
    str | None,
    typer.Option("--campaign", help="Campaign folder whose campaign.toml says how the device writes its files."),
]
DeviceRange = Annotated[float | None, typer.Option("--device-range-N", help="Largest force the device can measure.")]
DeviceError = Annotated[
    float | None, typer.Option("--device-error-N", help="Largest error of a reading; default 3 N, if not stated.")
]
FrequencyClass = Annotated[
    float | None,
    typer.Option("--channel-frequency-class", help="Also read the peak after this low-pass (60, 180, 600, 1000)."),
]

_NUMBERS = {
    "sampling_rate_Hz": float,
    "newtons_per_count": float,
    "zero_count": float,
    "sign": int,
    "header_lines": int,
}


def recordings_from(
    file: str,
    campaign: str | None,
    entries: list[str] | None,
    device_range: float | None,
    device_error: float | None,
    device_spring: float | None = None,
) -> tuple[list[Recording], Conditions]:
    """The recordings of a file, and the conditions of the campaign it belongs to; simulated if either says so.

    A file in the folder `recordings` of a campaign is read as its campaign.toml says, without being asked.
    """
    folder = Path(campaign) if campaign else _home(Path(file))
    described = folder / "campaign.toml"
    if campaign and not described.exists():
        raise InputError("there is no campaign.toml in this folder", file=campaign)
    conditions, columns = read_campaign_file(described) if described.exists() else (Conditions(), None)
    if entries:
        columns = ColumnMap.from_table(dict(_entry(each) for each in entries))
    conditions = conditions.with_device_stiffness(stiffness(device_spring))
    device = device_with(conditions.device, device_range, device_error)
    recordings = read_recordings(file, columns=columns, device=device)
    if conditions.date:
        date = {"date": conditions.date}
        recordings = [dataclasses.replace(each, metadata={**each.metadata, **date}) for each in recordings]
    simulated = conditions.simulated or any(recording.simulated for recording in recordings)
    return recordings, dataclasses.replace(conditions, device=device, simulated=simulated)


def _home(file: Path) -> Path:
    """The campaign's folder above a file in its `recordings`, whatever links lead there."""
    for path in (file.absolute(), file.resolve()):
        for folder in path.parents:
            if folder.name == "recordings" and (folder.parent / "campaign.toml").exists():
                return folder.parent
    return file.absolute().parent.parent


def device_with(device: Device, device_range: float | None, device_error: float | None) -> Device:
    """The device with the figures that options state."""
    return dataclasses.replace(
        device,
        range=device.range if device_range is None else device_range,
        error=device.error if device_error is None else device_error,
    )


def _entry(text: str) -> tuple[str, Any]:
    """key=value of the option as the value of campaign.toml it stands for."""
    key, sign, value = text.partition("=")
    key, value = key.strip(), value.strip()
    if not sign or not value:
        raise InputError(f"column: found {text!r}, expected KEY=VALUE such as time=time_ms")
    if key in _NUMBERS:
        try:
            return key, _NUMBERS[key](value)
        except ValueError:
            raise InputError(f"column: found {text!r}, expected a number after {key}=") from None
    if key == "direction":
        try:
            return key, [float(part) for part in value.split(",")]
        except ValueError:
            raise InputError(f"column: found {text!r}, expected three numbers such as direction=0,0,-1") from None
    if key in ("force", "runs") and "," in value:
        return key, [_column(part) for part in value.split(",")]
    if key == "runs" and value != "all":
        return key, [_column(value)]
    return key, _column(value) if key in ("time", "force", "curve") else value


def _column(text: str) -> str | int:
    return int(text) if text.strip().isdigit() else text.strip()
