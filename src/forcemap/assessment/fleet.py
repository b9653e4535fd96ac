"""A campaign among many: whether anything that its report rests on has changed, its last map, and what is due."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from forcemap._version import __version__
from forcemap.assessment.assess_campaign import CampaignAssessment
from forcemap.assessment.folder import InputFile, campaign_inputs, campaign_limit_table, inputs_sha256
from forcemap.assessment.missing import Missing, attempt, present
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.seal import is_sealed, seal
from forcemap.comparisons.map_check import MapCheck, MapOutcome, check_map, known_states
from forcemap.errors import InputError
from forcemap.files import file_sha256, read_bytes, sha256, write_atomically
from forcemap.findings import Finding, FindingKind
from forcemap.limits.force_limits import ForceLimit, force_limit
from forcemap.maps.carry_over import EARLIER_MAP
from forcemap.maps.force_map import ForceMap
from forcemap.maps.map_file import read_map, write_map
from forcemap.speeds.basis import against_bound

MEMORY_FILE, LAST_MAP_FILE = "fleet.json", "fleet-map.json"
"""What fleet keeps in a campaign's folder: what it found last, and the map that new impacts are checked against."""

_SCHEMA = "forcemap-fleet/2"
_DUE_WITHIN = 30  # days before a calibration ends in which it is said to be due; a choice: laboratories take weeks


def named_limits(folder: Path, conditions: Conditions, areas: Iterable[str]) -> tuple[tuple[ForceLimit, ...], str]:
    """The limits of body areas in the table that a campaign names, and that table's file if it is its own."""
    own = campaign_limit_table(folder, conditions)
    return tuple(force_limit(name, table=own.table) for name in areas), own.file


def rests_on(folder: Path, limits: Sequence[ForceLimit], own_table: str) -> str:
    """One hash of all that a report rests on as it is now: `made_from` of the assessment, if nothing changed."""
    return _hash(campaign_inputs(folder, further=[own_table] if own_table else []), limits)


def made_from(assessment: CampaignAssessment) -> str:
    """One hash of all that an assessment was made from: contents of its files, limits, version of the software."""
    return _hash(assessment.inputs, assessment.limits)


def _hash(inputs: Iterable[InputFile], limits: Iterable[ForceLimit]) -> str:
    asked = [(limit.name, limit.sha256) for limit in limits]
    return sha256(json.dumps([__version__, _source(), asked, inputs_sha256(inputs)]))


@cache
def _source() -> str:
    """The software by its source: what judges otherwise is asked again, whatever version it calls itself."""
    root = Path(__file__).parents[1]
    return sha256(
        "\n".join(f"{path.relative_to(root).as_posix()} {file_sha256(path)}" for path in sorted(root.rglob("*.py")))
    )


@dataclass(frozen=True)
class Memory:
    """What was found of a campaign last.

    Parameters
    ----------
    rests_on : str
        One hash of all that it rests on.
    report_sha256 : str
        Of the report that was written.
    known : list of list of float or None
        Distance, height, speed and ln F of every state that was there when the last map was kept;
        None where every impact was above the device range.
    found : dict
        What was found, as the faces say it.
    """

    rests_on: str
    report_sha256: str
    known: list[list[float | None]]
    found: dict[str, Any]

    def write(self, folder: Path) -> None:
        """Write it into a campaign's folder, under a seal of this account."""
        content = vars(self)
        sealed = {"schema": _SCHEMA, "seal": seal(json.dumps(content), _SCHEMA), **content}
        text = json.dumps(sealed, indent=1)
        write_atomically(folder / MEMORY_FILE, text + "\n")

    @classmethod
    def read(cls, folder: Path) -> Memory | None:
        """That of a campaign's folder; None if there is none, or none that this account sealed."""
        try:
            content = json.loads(read_bytes(folder / MEMORY_FILE))
            schema, found = content.pop("schema"), content.pop("seal")
            if schema == _SCHEMA and is_sealed(json.dumps(content), found, _SCHEMA):
                return cls(**content)
        except (InputError, ValueError, KeyError, TypeError, AttributeError):
            return None
        return None


@dataclass(frozen=True)
class LastMap:
    """The last map of a campaign beside impacts that are newer.

    Parameters
    ----------
    force_map : ForceMap or None
        The map; None if there is none.
    check : MapCheck, Missing or None
        What the impacts that it was not fitted to say of it; None if there is no such impact.
    """

    force_map: ForceMap | None
    check: MapCheck | Missing | None = None

    @property
    def stands(self) -> bool:
        """False where impacts are newer and do not say that it holds: another map must not take its place unseen."""
        return self.check is None or (isinstance(self.check, MapCheck) and self.check.outcome is MapOutcome.HOLDS)


def last_map(folder: Path, assessment: CampaignAssessment, memory: Memory | None) -> LastMap:
    """The last map, which fleet keeps, else the last by name in maps/, beside impacts that it was not fitted to.

    Raises
    ------
    MapFileError
        The file is no map.
    """
    released = sorted(path for path in (folder / "maps").glob("*.json") if path != folder / EARLIER_MAP)
    file = next((path for path in (folder / LAST_MAP_FILE, *released[::-1]) if path.is_file()), None)
    if file is None:
        return LastMap(None)
    force_map, dataset = read_map(file), assessment.dataset
    if isinstance(dataset, Missing):
        return LastMap(force_map, dataset)
    there = memory.known if memory and file.name == LAST_MAP_FILE else []
    of_then = [name for name, state in zip(dataset.states.name, _states(dataset), strict=True) if state in there]
    new = ~np.isin(dataset.state, [*known_states(force_map, dataset), *of_then])
    if not new.any():
        return LastMap(force_map)
    return LastMap(force_map, attempt(lambda: check_map(force_map, dataset.select(new))))


def keep_map(
    folder: Path, assessment: CampaignAssessment, last: LastMap, memory: Memory | None
) -> list[list[float | None]]:
    """Keep the map as the last one if every planned run is there, it carries its bound, and newer impacts bear it out.

    Returns the states that are known to the map that is kept: its test states, too, tell nothing new of it.
    """
    campaign, force_map, dataset = assessment.campaign, assessment.force_map, assessment.dataset
    whole = isinstance(campaign, Missing) or not campaign.missing  # without a plan nothing is missing
    if not (whole and last.stands) or isinstance(assessment.bound, Missing) or against_maps(assessment):
        return memory.known if memory else []
    write_map(present(force_map), folder / LAST_MAP_FILE)
    return _states(present(dataset))


def against_maps(assessment: CampaignAssessment) -> tuple[Finding, ...]:
    """What measurements say against a campaign's maps so that no speed of them holds; none without a map."""
    if isinstance(assessment.force_map, Missing) or isinstance(assessment.bound, Missing):
        return ()
    found, by_chance = against_bound(assessment.force_map, assessment.bound), FindingKind.POINTS_ABOVE_BOUND
    return tuple(each for each in found if each.kind is not by_chance or each.figure("refuses"))


def _states(dataset: ImpactDataset) -> list[list[float | None]]:
    states = dataset.states
    figures = np.column_stack([states.coordinates, states.log_force]).tolist()
    return [[None if figure != figure else figure for figure in state] for state in figures]


def due(conditions: Conditions, on: date) -> tuple[Finding, ...]:
    """What is due of the devices on a day, as campaign.toml states their calibration."""
    found = []
    for device in [device for _, device in conditions.devices] or [conditions.device]:
        days = (device.expires - on).days
        figures = {"model": device.model, "until": device.expires.isoformat()}
        if not device.calibration_stated:
            found.append(Finding.of(FindingKind.CALIBRATION_UNDATED, model=device.model))
        elif days < 0:
            found.append(Finding.of(FindingKind.CALIBRATION_OVER, **figures))
        elif days <= _DUE_WITHIN:
            found.append(Finding.of(FindingKind.CALIBRATION_ENDS, **figures, days=days))
    return tuple(dict.fromkeys(found))
