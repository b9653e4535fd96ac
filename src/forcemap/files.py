"""Files that survive a crash: written aside, flushed to disk, then renamed; locks of folders; dates; TOML."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import date
from pathlib import Path
from typing import Any, BinaryIO

from forcemap.errors import InputError

_PART = 1 << 17  # bytes read at once for a hash; a choice: most recordings are one part
MARKED_BY = 4000
"""First bytes of a result file, within which it says what it is."""

_BEING_WRITTEN = ".forcemap-part-"


def write_atomically(path: str | Path, text: str | bytes) -> None:
    """Write bytes, or a text as UTF-8; at any moment the file is either the old one or the new one, whole."""
    target = Path(path)
    try:
        with hidden_file(target.parent) as (hidden, stream):
            stream.write(text.encode() if isinstance(text, str) else text)
            stream.flush()
            os.fsync(stream.fileno())
            os.replace(hidden, target)
            flush_to_disk(target.parent)
    except OSError as error:
        remedy = "" if target.parent.is_dir() else "; name a folder that exists"
        raise InputError(f"cannot be written ({error.strerror}){remedy}", file=str(path)) from error


@contextmanager
def hidden_file(folder: Path, ending: str = "") -> Iterator[tuple[Path, BinaryIO]]:
    """A new hidden file, locked, and deleted afterwards unless it was renamed; those of killed processes go first."""
    sweep(folder)
    while True:
        hidden = folder / f"{_BEING_WRITTEN}{secrets.token_hex(8)}{ending}"
        descriptor = os.open(hidden, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)
        _lock(descriptor)
        if os.fstat(descriptor).st_nlink:
            break
        os.close(descriptor)  # swept by another process before it was locked
    with os.fdopen(descriptor, "wb") as stream:
        try:
            yield hidden, stream
        finally:
            hidden.unlink(missing_ok=True)


def sweep(folder: Path) -> None:
    """Delete the hidden files of killed processes: those that no process has locked, whatever their time."""
    for left in folder.glob(f"{_BEING_WRITTEN}*"):
        with suppress(OSError), left.open("rb+") as stream:  # of another user, or a folder
            if _lock(stream.fileno(), wait=False):
                left.unlink()


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder: other processes that ask for it wait."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        _lock(descriptor)
        yield
    finally:
        os.close(descriptor)


def flush_to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _lock(descriptor: int, *, wait: bool = True) -> bool:
    """Lock a file until it is closed or its process ends; False if another has locked it, or the drive has no locks."""
    import fcntl  # there is none on Windows, where files can be read

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def read_bytes(path: str | Path) -> bytes:
    """The bytes of a file, or an InputError that names it."""
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("there is no such file", file=str(path)) from None
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=str(path)) from error


def new_folder(folder: str | Path) -> Path:
    """Make a folder, or take an empty one; an InputError if it holds files already, or cannot be made."""
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
        if any(target.iterdir()):
            raise InputError("the folder holds files already, expected a new or empty one", file=str(folder))
    except OSError as error:
        raise InputError(f"the folder cannot be made ({error.strerror})", file=str(folder)) from error
    return target


def file_sha256(path: str | Path) -> str:
    """SHA-256 of a file's content, in hexadecimal, or an InputError that names it."""
    try:
        with open(path, "rb", buffering=0) as stream:
            digest = hashlib.sha256()
            while part := stream.read(_PART):
                digest.update(part)
            return digest.hexdigest()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=str(path)) from error


def begins_with(path: str | Path, size: int, checksum: str) -> bool:
    """Whether the first bytes of a file are the content that has this SHA-256."""
    try:
        with Path(path).open("rb") as stream:
            return hashlib.sha256(stream.read(size)).hexdigest() == checksum
    except OSError:
        return False


def sha256(content: bytes | str) -> str:
    """SHA-256 of bytes, or of a text's UTF-8, in hexadecimal."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def stated_date(what: str, text: str) -> date:
    """A date written as YYYY-MM-DD.

    Raises
    ------
    InputError
        Not a date; `what` it is of comes first.
    """
    try:
        if re.fullmatch(r"\d{4}-\d{2}-\d{2}", text, re.ASCII):
            return date.fromisoformat(text)
    except (TypeError, ValueError):
        pass
    raise InputError(f"{what}: found {text!r}, expected YYYY-MM-DD")


# Bytes, bytes in a line, levels: more than any campaign or task needs (docs/decisions.md).
_LARGEST_TOML, _LONGEST_TOML_LINE, _DEEPEST_TOML = 1 << 18, 1 << 12, 20
_LONGEST_SHOWN = 100  # characters of an entry's name in an error


_DECIMAL_COMMA = re.compile(r"^[ \t]*[\w.]+[ \t]*=[ \t]*[-+]?[0-9]+,[0-9]+(?=[ \t]*(?:#.*)?$)", re.MULTILINE)


def _slip(content: bytes, error: str) -> str:
    """What is probably wrong in a TOML file that cannot be read."""
    if commas := _DECIMAL_COMMA.findall(content.decode("utf-8", "replace")):
        return f"; numbers have a decimal point: {commas[0].strip().replace(',', '.')}"
    if "Illegal character '\\n'" in error:
        return "; a text is not closed by its quotation mark"
    return "; a text stands in quotation marks" if error.startswith("Invalid value") else ""


def toml_tables(content: bytes) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises
    ------
    InputError
        Not TOML in UTF-8, larger or deeper than any campaign needs, or a whole number beyond 64 bits, the most that
        TOML has.
    """
    longest = max(map(len, content.split(b"\n")))
    if len(content) > _LARGEST_TOML or longest > _LONGEST_TOML_LINE:
        most = f"at most {_LARGEST_TOML} bytes, {_LONGEST_TOML_LINE} in a line"
        raise InputError(f"found a TOML file of {len(content)} bytes, {longest} in a line, expected {most}")
    try:
        tables = tomllib.loads(content.decode("utf-8-sig"))
    except RecursionError:
        raise InputError("not a TOML file that can be used: nested too deeply") from None
    except ValueError as error:  # also a number of thousands of digits
        raise InputError(f"not a TOML file in UTF-8: {error}{_slip(content, str(error))}") from None
    entries: list[tuple[str, Any, int]] = [("", tables, 0)]
    while entries:
        name, value, depth = entries.pop()
        if depth > _DEEPEST_TOML:
            raise InputError("found tables nested too deeply", column=name[:_LONGEST_SHOWN])
        if isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise InputError(
                "found a whole number beyond 64 bits, expected one that fits", column=name[:_LONGEST_SHOWN]
            )
        if isinstance(value, dict):
            entries += [(f"{name}.{key}".strip("."), item, depth + 1) for key, item in value.items()]
        elif isinstance(value, list):
            entries += [(name, item, depth + 1) for item in value]
    return tables
