"""The bytes of a file -> its lines as UTF-8: which kind of file it is, encodings, line ends."""

from __future__ import annotations

import codecs
import itertools
from collections.abc import Iterator

from forcemap.errors import RecordingError

_AS_CSV = "open it in the program that wrote it and export the recording as CSV in UTF-8"
_SIGNATURES = {
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": f"an Excel workbook (.xls) or another Office file, expected text; {_AS_CSV}",
    b"\x89HDF": "an HDF5 file (MATLAB 7.3 or a logger), expected text; export the recording as CSV in UTF-8",
    b"MATLAB 5.0 MAT-file": "a MATLAB file, expected text; write time and force with writematrix, or as CSV in UTF-8",
    b"MDF ": f"an MDF file, expected text; {_AS_CSV}",
    b"#ROSBAG": "a ROS bag, expected text; write the topic as CSV: rostopic echo -b FILE -p /TOPIC > run.csv",
    b"SQLite format 3": "a database (a ROS 2 bag?), expected text; write the topic as CSV",
    b"\x93NUMPY": "a NumPy file, expected text; write it with numpy.savetxt",
    b"PAR1": "a Parquet file, expected text; export the recording as CSV in UTF-8",
    b"\x1f\x8b": "a compressed file (gzip), expected text; unpack it",
    b"%PDF": "a PDF, expected text; export the recording itself as CSV in UTF-8",
    b"{\\rtf": "a text with formatting (RTF), expected plain text; save it as plain text in UTF-8",
    b"<": "a page or document (HTML, XML), expected plain text; export the recording as CSV in UTF-8",
}
_BYTE_ORDER_MARKS = {codecs.BOM_UTF8: "", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
LONGEST_LINE = 1 << 19
"""Characters of the longest line that a table may have."""
_LONGEST_HEADER, _MOST_HEADER_LINES = 1 << 22, 10_000  # bytes, lines: far more than any device writes
_MOST_LINES_OF_NAMES = 4  # that a name in quotes goes over
_LOOKED_AT = 4096  # bytes at the beginning of a file that show its encoding
# In UTF-16 digits, signs and line ends are every other byte a zero: shares of these bytes, and of the others.
_MANY_ZEROS, _FEW_ZEROS = 0.8, 0.2


def lines_of(content: bytes) -> bytes:
    r"""The lines of a text file in UTF-8 (or another superset of ASCII), each but the last with \n at its end.

    Raises
    ------
    RecordingError
        Empty, no text, another kind of file; the message says what to do.
    """
    if content.startswith(b"PK\x03\x04"):
        workbook = "an Excel workbook (.xlsx), expected text; open it and save the sheet as CSV UTF-8"
        raise RecordingError(workbook if b"xl/" in content else "an archive (zip), expected text; unpack it")
    for signature, message in _SIGNATURES.items():
        if content.startswith(signature):
            raise RecordingError(message)
    text = _utf8(content)
    if not text or text.isspace():
        raise RecordingError("the file is empty, expected lines of numbers")
    if (nul := text.find(b"\0")) >= 0:
        row = text.count(b"\n", 0, nul) + 1
        raise RecordingError("found a NUL byte: this is no text, or damaged; export the recording as CSV", row=row)
    if b"\r" in text:
        text = text.replace(b"\r\r\n", b"\r\n")
        text = text if b"\n" in text else text.replace(b"\r", b"\n")
    return text


def _utf8(content: bytes) -> bytes:
    """The text without a byte-order mark, from UTF-16 if the mark or zero bytes show that it is."""
    mark = next((mark for mark in _BYTE_ORDER_MARKS if content.startswith(mark)), b"")
    encoding, text = _BYTE_ORDER_MARKS.get(mark, ""), content[len(mark) :] if mark else content
    if not mark and b"\0" in (head := content[:_LOOKED_AT]):
        first, second = (head[parity::2].count(0) / max(1, len(head) // 2) for parity in (0, 1))
        if max(first, second) > _MANY_ZEROS and min(first, second) < _FEW_ZEROS:
            encoding = "utf-16-be" if first > second else "utf-16-le"
    if not encoding:
        return text
    try:
        return text[: len(text) // 2 * 2].decode(encoding).encode()
    except UnicodeError as error:
        row = text[: getattr(error, "start", 0)].decode(encoding, "replace").count("\n") + 1
        raise RecordingError("not UTF-16, though it begins so; export the recording in UTF-8", row=row) from None


def text_of(line: bytes) -> str:
    """The text in UTF-8, else in Latin-1: units such as µs and °, which are never part of a number."""
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def first_lines(content: bytes) -> Iterator[tuple[int, str]]:
    """(byte at which it begins, text) of the lines that may hold the header.

    Names in quotes that go over several lines stand in the first of them, and the others are empty.

    Raises
    ------
    RecordingError
        A line longer than any table's.
    """
    begun: list[tuple[int, str]] = []
    for line in _lines(content):
        begun.append(line)
        if open_quotes := sum(text.count('"') for _, text in begun) % 2:
            if len(begun) < _MOST_LINES_OF_NAMES:
                continue
        elif len(begun) > 1:
            begun = [(begun[0][0], " ".join(text for _, text in begun)), *((start, "") for start, _ in begun[1:])]
        yield from begun[:1] if open_quotes else begun
        begun = begun[1:] if open_quotes else []
    yield from begun


def _lines(content: bytes) -> Iterator[tuple[int, str]]:
    """(byte at which it begins, text) of the first lines.

    Raises
    ------
    RecordingError
        A line longer than any table's.
    """
    start = 0
    for row in itertools.islice(itertools.count(1), _MOST_HEADER_LINES):
        end = content.find(b"\n", start, start + LONGEST_LINE)
        if end < 0 and start + LONGEST_LINE < len(content):
            raise RecordingError(f"found over {LONGEST_LINE} characters without a line end, expected lines", row=row)
        stop = len(content) if end < 0 else end
        yield start, text_of(content[start:stop]).removesuffix("\r")
        if end < 0 or (start := end + 1) > _LONGEST_HEADER:
            return
