"""What a campaign has and has not: recordings used and discarded, runs missing, which limit may be used where."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from forcemap.campaigns.campaign import Campaign
from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.dataset import ImpactDataset, PhaseTwo
from forcemap.campaigns.recordings_table import Entry, Use
from forcemap.findings import Finding, FindingKind
from forcemap.impacts.scenario import BARRING, ContactScenario

_ASKED = (
    *("robot.model", "robot.firmware", "robot.moving_mass_kg", "robot.safety_settings"),
    *("tool.name", "tool.payload_kg", "tool.covers", "contact.site", "contact.direction", "contact.speed", "date"),
)
_ASKED_OF_DEVICE = ("model", "error_N", "stiffness_N_per_m", "pad", "calibrated")


@dataclass(frozen=True)
class StateContact:
    """Which limit the impacts of a state allow.

    Parameters
    ----------
    state : str
    transient_allowed : bool
        False if an impact clamps, may clamp, or was not seen after Phase I.
    reason : Finding
        Why.
    """

    state: str
    transient_allowed: bool
    reason: Finding


@dataclass(frozen=True)
class CampaignSummary:
    """A campaign at a glance.

    Parameters
    ----------
    recordings : int
        Recordings registered.
    used : int
        Recordings whose impact is in the table.
    discards : tuple of Entry
        The others, each with its reason.
    missing : tuple of str
        Planned runs without a recording that is used.
    phase_two : PhaseTwo
        Contact scenarios and the largest Phase II force, of discarded recordings too.
    contacts : tuple of StateContact
        Which limit may be used for which state, and why.
    flags : mapping of str to int
        How many used recordings carry each quality flag.
    not_stated : tuple of str
        Conditions that campaign.toml does not state.
    """

    recordings: int
    used: int
    discards: tuple[Entry, ...]
    missing: tuple[str, ...]
    phase_two: PhaseTwo
    contacts: tuple[StateContact, ...]
    flags: dict[str, int]
    not_stated: tuple[str, ...]


def campaign_summary(campaign: Campaign, dataset: ImpactDataset) -> CampaignSummary:
    """Summarise a campaign whose table was built.

    Parameters
    ----------
    campaign : Campaign
        Read after `build_dataset`, so that its register is the new one.
    dataset : ImpactDataset
        What `build_dataset` returned.
    """
    names = [name for cell in dataset.flags.tolist() for name in cell.split("; ") if name and name != "simulated"]
    seen: dict[str, list[ContactScenario]] = {}
    for entry in campaign.entries:
        if entry.scenario is not None and entry.state_id and entry.use in (Use.USED, Use.DISCARDED):
            seen.setdefault(entry.state_id, []).append(entry.scenario)
    return CampaignSummary(
        recordings=len(campaign.entries),
        used=len(dataset),
        discards=tuple(entry for entry in campaign.entries if entry.use is not Use.USED),
        missing=tuple(campaign.missing),
        phase_two=dataset.phase_two,
        contacts=tuple(_contact(state, scenarios) for state, scenarios in seen.items()),
        flags={name: names.count(name) for name in sorted(set(names))},
        not_stated=tuple(_not_stated(campaign.conditions)),
    )


def _not_stated(conditions: Conditions) -> Iterator[str]:
    yield from (entry for entry in _ASKED if entry not in conditions.stated)
    for pattern, device in conditions.devices or (("", conditions.device),):
        stated = Conditions(device=device).to_tables().get("device", {})
        stated |= {"calibrated": True} if device.calibration_stated else {}
        of = f" of the device of {pattern}" if pattern else ""
        yield from (f"device.{key}{of}" for key in _ASKED_OF_DEVICE if key not in stated)


def _contact(state: str, scenarios: list[ContactScenario]) -> StateContact:
    for barrier in BARRING:
        if barrier in scenarios:
            count = {"impacts": scenarios.count(barrier), "of": len(scenarios)}
            return StateContact(state, False, Finding.of(FindingKind.BARRED, **count, scenario=barrier.words))
    return StateContact(state, True, Finding.of(FindingKind.DIMINISHES))
