"""forcemap inspect."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from forcemap import find_impacts, no_impact
from forcemap.cli.column_options import (
    CampaignOption,
    Columns,
    DeviceError,
    DeviceRange,
    FrequencyClass,
    recordings_from,
)
from forcemap.cli.impact_results import impact_lines, recording_lines, recording_result
from forcemap.cli.options import Json
from forcemap.cli.output import emit


def inspect(
    file: Annotated[str, typer.Argument(help="A file of recordings (delimited text or TDMS).")],
    campaign: CampaignOption = None,
    column: Columns = None,
    device_range: DeviceRange = None,
    device_error: DeviceError = None,
    frequency_class: FrequencyClass = None,
    as_json: Json = False,
) -> None:
    """Show what a file of recordings holds: impacts, their figures, contact scenario, quality flags and a plot.

    Example: forcemap inspect run7.csv --column time=time_ms --column time_unit=ms --column force=force_N
    """
    recordings, conditions = recordings_from(file, campaign, column, device_range, device_error)
    wanted = conditions.channel_frequency_class if frequency_class is None else frequency_class
    results, lines = [], []
    for recording in recordings:
        impacts = find_impacts(recording, channel_frequency_class=wanted)
        results.append(recording_result(recording, impacts))
        lines += recording_lines(recording)
        lines += [line for impact in impacts for line in ["", *impact_lines(impact)]] or [f"  {no_impact(recording)}"]
        lines.append("")
    if math.isnan(conditions.device.range):
        lines.append("the device range is not stated, so saturation was judged by the shape alone: --device-range-N")
    if conditions.simulated:
        lines.insert(0, "SIMULATED recordings: not a measurement of any robot")
    result = {"file": file, "simulated": conditions.simulated, "recordings": results}
    emit(result, lines, as_json=as_json)
