"""The protocol of a validation, `[protocol]` in campaign.toml: serial numbers, certificates, who checked, the document.

Nothing of it says under what the impacts were measured, so no table is bound to it: it may be stated afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from forcemap.campaigns.entries import typed_entry
from forcemap.errors import CampaignFileError, InputError, nearest_names
from forcemap.files import read_bytes, stated_date, toml_tables

_LONGEST = 300  # characters of an entry; a choice
_DATES = ("device_certificate_date", "film_certificate_date")


@dataclass(frozen=True)
class Protocol:
    """What a protocol states besides the conditions; an empty text or NaN is "not stated".

    Parameters
    ----------
    document_number, revision, replaces : str
        Of the document, and what it replaces.
    customer, site, cell : str
        Whose cell it is, and where it stands.
    robot_serial_number, controller_serial_number : str
    safety_checksum : str
        Of the robot's safety configuration.
    program : str
        Name and version of the robot's program.
    device_serial_number, device_certificate, device_certificate_date : str
        Of the force measuring device.
    device_fixing : str
        How it was fixed.
    film, film_serial_number, film_certificate, film_certificate_date : str
        The pressure film or array, if one was used.
    ambient_temperature_C : float
        Where it was measured [degrees Celsius].
    checked_by, signed_by : str
        Who checked the measurement, and who is to sign for the cell.
    """

    document_number: str = ""
    revision: str = ""
    replaces: str = ""
    customer: str = ""
    site: str = ""
    cell: str = ""
    robot_serial_number: str = ""
    controller_serial_number: str = ""
    safety_checksum: str = ""
    program: str = ""
    device_serial_number: str = ""
    device_certificate: str = ""
    device_certificate_date: str = ""
    device_fixing: str = ""
    film: str = ""
    film_serial_number: str = ""
    film_certificate: str = ""
    film_certificate_date: str = ""
    ambient_temperature_C: float = math.nan
    checked_by: str = ""
    signed_by: str = ""

    @classmethod
    def from_table(cls, table: Any) -> Protocol:
        """The protocol stated in the table [protocol] of campaign.toml.

        Raises
        ------
        InputError
            No table, an unknown entry, or a value that is not of the expected kind; `column` names the entry.
        """
        if not isinstance(table, Mapping):
            raise InputError("found no table, expected [protocol]", column="protocol")
        blank, values = cls(), {}
        for key, value in table.items():
            entry = f"protocol.{key}"
            if key not in PROTOCOL_ENTRIES:
                near = ", ".join(f"protocol.{name}" for name in nearest_names(key, PROTOCOL_ENTRIES, 3))
                raise InputError(f"unknown entry; the nearest known ones are {near}", column=entry)
            values[key] = typed_entry(entry, value, getattr(blank, key))
            if isinstance(values[key], str) and len(values[key]) > _LONGEST:
                found = f"found {len(values[key])} characters"
                raise InputError(f"{found}, expected at most {_LONGEST}", column=entry)
            if key in _DATES and values[key]:
                _require_date(entry, values[key])
        temperature = values.get("ambient_temperature_C", 20.0)
        if not -60 <= temperature <= 100:
            expected = "expected degrees Celsius from -60 to 100"
            raise InputError(f"found {temperature:g}, {expected}", column="protocol.ambient_temperature_C")
        return cls(**values)


def _require_date(entry: str, text: str) -> None:
    try:
        stated_date("date", text)
    except InputError as error:
        raise InputError(error.message, column=entry) from None


PROTOCOL_ENTRIES = tuple(field.name for field in fields(Protocol))


def read_protocol(path: str | Path) -> Protocol:
    """The protocol of a campaign.toml; an empty one where it states none.

    Raises
    ------
    CampaignFileError
        Not TOML, or an entry that cannot be used.
    """
    try:
        return Protocol.from_table(toml_tables(read_bytes(path)).get("protocol", {}))
    except InputError as error:
        raise CampaignFileError(error.message, file=str(path), column=error.column) from None
