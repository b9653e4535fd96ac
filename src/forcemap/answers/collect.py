"""What collecting a campaign's recordings gave: what `collect` prints, and the page answers."""

from __future__ import annotations

import math

import numpy as np

from forcemap.answers.answer import AllSaid, Answer, Figure, Said, of
from forcemap.answers.form_test import DriftAnswer
from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.dataset import ImpactDataset, unit_finding
from forcemap.campaigns.impacts_table import not_entered
from forcemap.campaigns.point_list import POINT_REGISTER
from forcemap.campaigns.point_recordings import point_names
from forcemap.campaigns.repeatability import repeatability
from forcemap.campaigns.summary import campaign_summary
from forcemap.findings import Finding, FindingKind
from forcemap.words import sentences


class Discard(Answer):
    """A recording that is not used."""

    recording: str = of("name")
    use: str
    reason: str


class ProposedRun(Answer):
    """A recording whose name tells no run, and the run that it is taken for."""

    recording: str = of("name")
    run: str
    written: str
    distance_m: float = of("distance")
    height_m: float = of("height")
    speed_mps: float = of("speed")
    expected_force_N: Figure = of("expected_force")
    peak_force_N: Figure = of("peak_force")
    out_of_order: bool


class AssignAnswer(Answer):
    """Recordings in the order of the run sheet; nothing is written yet."""

    folder: str
    by: str
    proposed: list[ProposedRun]


class StateContact(Answer):
    """Which limit the impacts of a state allow."""

    state_id: str = of("state")
    transient_allowed: bool
    reason: Said


class Outlier(Answer):
    """A repeat far from the others of its state that were measured in the same set-up."""

    state_id: str = of("state")
    repeat: int
    recording: str
    force_N: float = of("force")
    deviation_N: float = of("deviation")

    @property
    def words(self) -> str:
        """What to look at, in a line."""
        name = self.recording or self.state_id
        apart = f"{self.deviation_N:+.1f} N from the others of its set-up"
        remedy = "look at the recording; if it is of another run, give it that one in recordings.csv (state_id, repeat)"
        return f"{name} repeat {self.repeat}: {self.force_N:.1f} N, {apart}; {remedy}"


class Symmetry(Answer):
    """How far forces on one circle about the base differ."""

    max_difference_N: Figure = of("max_difference")
    mean_difference_N: Figure = of("mean_difference")
    max_difference_percent: Figure
    mean_difference_percent: Figure


class Repeatability(Answer):
    """How far repeats agree."""

    max_sd_N: Figure = of("max_sd")
    mean_sd_N: Figure = of("mean_sd")
    max_sd_percent: Figure
    mean_sd_percent: Figure
    within_state_sd_percent: Figure
    between_state_sd_percent: Figure
    outliers: list[Outlier]
    symmetry: Symmetry | None


class BindingAnswer(Answer):
    """Whether the table is what its recordings gave."""

    state: str
    reason: Said


class Saturated(Answer):
    """A recording in use whose peak is only known to be at least a force."""

    recording: str
    at_least_N: Figure


class CollectAnswer(Answer):
    """A campaign whose recordings are collected; `no_speed` says why its impacts give no speed, if so."""

    folder: str
    simulated: bool
    no_speed: Said
    binding: BindingAnswer
    recordings: int
    used: int
    states: int
    censored: int
    saturated: list[Saturated]
    discards: list[Discard]
    missing: list[str]
    flags: dict[str, int]
    scenarios: dict[str, int]
    largest_phase2_force_N: Figure = of("phase_two", "largest_force")
    phase_two: Said = of("phase_two", "finding")
    transient_refused: list[str]
    contacts: list[StateContact]
    repeatability: Repeatability
    disagreeing_repeats: list[str]
    contradictions: AllSaid
    drift: DriftAnswer | None
    not_stated: list[str]
    stated_since: Said
    units: Said
    point_recordings: int
    files: list[str]

    @classmethod
    def of_campaign(cls, campaign: Campaign, dataset: ImpactDataset, entered: Finding | None = None) -> CollectAnswer:
        """The answer for a campaign read after `build_dataset`, the dataset that this returned, and what it entered of
        what is stated since."""
        summary = campaign_summary(campaign, dataset)
        missing, used = not_entered(campaign.conditions, campaign.folder)
        unspeeded = [Finding.of(FindingKind.SPEEDS_NOT_ENTERED, missing=missing, recordings=used)] if missing else []
        refusal = summary.phase_two.transient_refusal(math.inf, 0.0)
        of_points = len(point_names(campaign.folder))
        return cls.from_result(
            summary,
            folder=campaign.folder.resolve().name,
            simulated=dataset.simulated,
            no_speed=dataset.no_speed,
            binding=dataset.binding,
            states=len(dataset.states),
            censored=int(dataset.censored.sum()),
            saturated=[
                Saturated(recording=dataset.recording[i], at_least_N=dataset.peak_force[i])
                for i in np.flatnonzero(dataset.censored)
            ],
            scenarios={scenario.value: count for scenario, count in summary.phase_two.scenarios.items()},
            transient_refused=sentences(refusal.also) if refusal else [],
            contradictions=(*unspeeded, *filter(None, [dataset.phase_two.doubt]), *dataset.contradictions),
            drift=dataset.drift,
            repeatability=repeatability(dataset),
            disagreeing_repeats=dataset.disagreeing_repeats,
            stated_since=entered,
            units=unit_finding(dataset.conditions, dataset.states),
            point_recordings=of_points,
            files=[campaign.register_file.name, campaign.table_file.name, *[POINT_REGISTER] * bool(of_points)],
        )
