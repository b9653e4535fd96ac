"""What `simulate` has written."""

from __future__ import annotations

from forcemap.answers.answer import Answer


class SimulationAnswer(Answer):
    """A simulated campaign; nothing of it is a measurement. `not_simulated` are entries of campaign.toml that the lab
    has of its own."""

    folder: str
    simulated: bool = True
    preset: str
    changes: tuple[str, ...]
    recordings: int
    lowest_peak_force_N: float
    highest_peak_force_N: float
    beyond_device_range: int
    scenarios: list[str]
    seed: int
    not_simulated: list[str]
