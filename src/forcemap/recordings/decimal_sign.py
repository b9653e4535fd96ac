"""Is the sign in a number its decimal sign, or does it group thousands?"""

from __future__ import annotations

import re

from forcemap.errors import RecordingError
from forcemap.recordings.cells import text_of
from forcemap.recordings.layout import Layout


def refuse_doubtful_decimal(content: bytes, layout: Layout) -> None:
    """Refuse numbers that all look like "1.002": in one country that is one newton, in another a thousand.

    One number with other than three digits behind the sign, more than three before it or a leading zero settles it for
    the file. Between commas a decimal point is taken for granted, and so is a sign that the column map states.

    Raises
    ------
    RecordingError
        No number settles it.
    """
    sign = layout.decimal
    if layout.decimal_is_stated or content.find(sign.encode(), layout.start) < 0:
        return
    settled = re.compile(rf"[{sign}]([0-9]{{0,2}}(?![0-9])|[0-9]{{4}})|[0-9]{{4}}[{sign}]|(?<![0-9])(0[0-9]*)?[{sign}]")
    start, row, doubtful = layout.start, layout.row, 0
    while start < len(content):
        end = content.find(b"\n", start) + 1 or len(content)
        cells = (
            text_of(content[start:end]).split(layout.delimiter) if layout.delimiter else [text_of(content[start:end])]
        )
        for column in layout.selection.numbers:
            if column < len(cells) and sign in cells[column]:
                if settled.search(cells[column]):
                    return
                doubtful = doubtful or row
        start, row = end, row + 1
    if doubtful:
        raise RecordingError(
            f"every {sign!r} in a number has three digits behind it: it may be the decimal sign or group thousands; "
            "state decimal in the column map",
            row=doubtful,
        )
