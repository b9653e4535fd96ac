"""What a protocol needs and campaign.toml does not state, by how much it matters."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from operator import attrgetter

from forcemap.campaigns.conditions import Conditions
from forcemap.campaigns.protocol import PROTOCOL_ENTRIES, Protocol


class Matters(StrEnum):
    """How much it matters that something is not stated, the gravest first."""

    TRACE = "without it nobody can tell which robot, device, settings or person the result is of"
    REPEAT = "without it the measurement cannot be repeated"
    FILE = "without it the document cannot be filed"

    @property
    def gravity(self) -> int:
        """Its place in that order."""
        return list(Matters).index(self)


@dataclass(frozen=True)
class NotStated:
    """An entry of campaign.toml that a protocol needs and that is not stated.

    Parameters
    ----------
    entry : str
        Such as `protocol.document_number`.
    matters : Matters
    """

    entry: str
    matters: Matters

    @property
    def words(self) -> str:
        """The entry in words for who does not write campaign.toml, such as `document number`."""
        words = self.entry.removeprefix("protocol.").replace(".", " ").replace("_", " ")
        return words.removesuffix(" N per m").removesuffix(" deg")


_NEEDED = {
    Matters.TRACE: (
        *("robot.model", "protocol.robot_serial_number", "robot.firmware", "protocol.safety_checksum"),
        *("device.model", "protocol.device_serial_number", "protocol.device_certificate", "device.calibrated"),
        *("operator", "date", "protocol.checked_by", "protocol.signed_by"),
        "protocol.document_number",
    ),
    Matters.REPEAT: (
        *("protocol.program", "robot.safety_settings", "protocol.controller_serial_number", "tool.name"),
        *("tool.payload_kg", "tool.covers", "contact.site", "contact.direction", "contact.speed"),
        "contact.base_angle_deg",
        *("device.stiffness_N_per_m", "device.pad", "protocol.device_fixing", "robot.controller"),
    ),
    Matters.FILE: (
        *("protocol.customer", "protocol.site", "protocol.cell", "protocol.revision"),
        *("standard.edition", "protocol.device_certificate_date", "protocol.ambient_temperature_C"),
    ),
}
_OF_FILM = ("protocol.film_serial_number", "protocol.film_certificate", "protocol.film_certificate_date")


def not_stated(conditions: Conditions, protocol: Protocol) -> tuple[NotStated, ...]:
    """What a protocol needs and campaign.toml does not state, what matters most first.

    Serial number and certificate of a film count where one is named; of several devices those of the table [protocol]
    are one list for all.
    """
    stated = {f"protocol.{name}" for name in PROTOCOL_ENTRIES if (v := getattr(protocol, name)) != "" and v == v}
    stated |= conditions.stated.keys()
    if conditions.devices:
        named = {"device.model": "model", "device.calibrated": "calibrated", "device.pad": "pad"}
        devices = [device for _, device in conditions.devices]
        stated |= {entry for entry, name in named.items() if all(map(attrgetter(name), devices))}
    needed = dict(_NEEDED)
    if protocol.film:
        needed[Matters.TRACE] = (*needed[Matters.TRACE], *_OF_FILM)
    return tuple(
        NotStated(entry, matters) for matters, entries in needed.items() for entry in entries if entry not in stated
    )
