"""How the conditions of two campaigns differ."""

from __future__ import annotations

from forcemap.campaigns.conditions import Conditions

# entries of campaign.toml that differ between any two campaigns, or that the results say themselves
_UNLIKE = ("date", "operator", "note", "simulated")


def differences(of_one: Conditions, of_other: Conditions, called: tuple[str, str]) -> list[str]:
    """Entries of campaign.toml that differ, a line each, and those that only one of the two states, in one line."""
    one, other = _entries(of_one), _entries(of_other)
    both = [name for name in one if name in other and one[name] != other[name]]
    alone = sorted(one.keys() ^ other.keys())
    lines = [f"differs: {name}: {called[0]} {one[name]}, {called[1]} {other[name]}" for name in both]
    return [*lines, f"stated by only one of the two campaigns: {', '.join(alone)}"] if alone else lines


def _entries(conditions: Conditions) -> dict[str, object]:
    found: dict[str, object] = {}
    for section, value in conditions.to_tables().items():
        inner = {f"{section}.{key}": each for key, each in value.items()} if isinstance(value, dict) else {}
        found |= inner or {section: value}
    return {name: value for name, value in found.items() if name.split(".")[-1] not in _UNLIKE}
