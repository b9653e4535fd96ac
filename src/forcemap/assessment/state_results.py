"""What was measured at every state of a campaign, and how it compares with the limits and the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from forcemap.assessment.missing import Missing
from forcemap.campaigns.dataset import ImpactDataset
from forcemap.campaigns.repeatability import Repeatability
from forcemap.impacts.scenario import ContactScenario
from forcemap.maps.force_map import ForceMap
from forcemap.verdicts.recording_results import JudgedRecordings, RecordingResult, gravest_judgement
from forcemap.verdicts.verdict import Judgement


@dataclass(frozen=True)
class StateResult:
    """One state.

    Parameters
    ----------
    name : str
        Its name.
    distance, height, speed : float
        Its coordinates [m], [m], [m/s].
    role : str
        "train", "test", or both; "slower" where it is slower than the map is to hold for.
    impacts, censored : int
        Number of uncensored and of censored repeats.
    mean, sd, highest : float
        Mean, standard deviation of repeats and largest of the uncensored peak forces [N]; NaN where there is none.
    at_least : float
        Largest force that censored repeats reached at least [N]; NaN where none is censored.
    predicted : float
        Force predicted by the map [N]; NaN without a map, and where it is not to hold.
    phase2_force : float
        Largest Phase II force [N]; NaN if none was recorded.
    scenarios : mapping of ContactScenario to int
        Impacts of each contact scenario.
    flags : tuple of str
        Names of quality flags of its impacts.
    recordings : tuple of RecordingResult
        Its recordings, those that are not used, too.
    judgements : tuple of (Judgement or None)
        The gravest of its recordings, one for each limit; None if none was judged.
    """

    name: str
    distance: float
    height: float
    speed: float
    role: str
    impacts: int
    censored: int
    mean: float
    sd: float
    highest: float
    at_least: float
    predicted: float
    phase2_force: float
    scenarios: dict[ContactScenario, int]
    flags: tuple[str, ...]
    recordings: tuple[RecordingResult, ...]
    judgements: tuple[Judgement | None, ...]


def state_results(
    dataset: ImpactDataset,
    scatter: Repeatability,
    recordings: JudgedRecordings | Missing,
    force_map: ForceMap | Missing,
    limits: int,
) -> tuple[StateResult, ...]:
    """The states of a dataset in order of distance, height and speed; `limits` is the number of limits judged."""
    states = dataset.states
    unknown = np.full(len(states), math.nan)
    predicted = unknown if isinstance(force_map, Missing) else force_map.predict(*states.coordinates.T)
    slower = dataset.slower
    predicted = np.where(np.isin(states.name, dataset.state[slower]), math.nan, predicted)  # it is not to hold there
    judged = () if isinstance(recordings, Missing) else recordings.results
    columns: dict[str, Any] = {"mean": states.force, "sd": scatter.sd, "predicted": predicted}
    for field in ("distance", "height", "speed", "impacts", "censored", "highest", "at_least"):
        columns[field] = getattr(states, field)
    results = []
    for i, name in enumerate(states.name):
        rows = dataset.state == name
        own = [recording for recording in judged if recording.entry.state_id == name]
        scenarios = dataset.scenario[rows].tolist()
        flags = [flag for cell in dataset.flags[rows].tolist() for flag in cell.split("; ")]
        judgements = [[j for recording in own if (j := recording.judgements[k]) is not None] for k in range(limits)]
        results.append(
            StateResult(
                name=name,
                **{field: column[i].item() for field, column in columns.items()},
                role="slower"
                if slower[rows].all()
                else " and ".join(sorted(set(dataset.role[rows].tolist()), reverse=True)),
                phase2_force=float(np.fmax.reduce(dataset.phase2_force[rows])),
                scenarios={scenario: count for scenario in ContactScenario if (count := scenarios.count(scenario))},
                flags=tuple(sorted(set(flags) - {"", "simulated"})),
                recordings=tuple(own),
                judgements=tuple(map(gravest_judgement, judgements)),
            )
        )
    return tuple(results)
