"""How the conditions of two campaigns differ."""

from __future__ import annotations

from forcemap.campaigns.conditions import Conditions

_UNLIKE = ("date", "operator", "note")  # entries of campaign.toml that differ between any two campaigns


def differences(of_one: Conditions, of_other: Conditions, called: tuple[str, str]) -> list[str]:
    """Entries of campaign.toml that differ, a line each: what a change of the force may come from."""
    one, other = _entries(of_one), _entries(of_other)
    names = [name for name in dict.fromkeys([*one, *other]) if one.get(name) != other.get(name)]
    return [
        f"differs: {name}: {called[0]} {one.get(name, 'not stated')}, {called[1]} {other.get(name, 'not stated')}"
        for name in names
        if name.split(".")[-1] not in _UNLIKE
    ]


def _entries(conditions: Conditions) -> dict[str, object]:
    found: dict[str, object] = {}
    for section, value in conditions.to_tables().items():
        found |= (
            {f"{section}.{key}": inner for key, inner in value.items()} if isinstance(value, dict) else {section: value}
        )
    return found
