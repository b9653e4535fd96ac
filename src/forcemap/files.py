"""Files that survive a crash: written aside, flushed to disk, then renamed; and dates as files state them."""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from datetime import date
from pathlib import Path

from forcemap.errors import InputError


def write_atomically(path: str | Path, text: str | bytes) -> None:
    """Write bytes, or a text as UTF-8; at any moment the file is either the old one or the new one, whole."""
    target = Path(path)
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror}); name a folder that exists", file=str(path)) from error
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(text.encode() if isinstance(text, str) else text)
            stream.flush()
            os.fsync(stream.fileno())
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, target)
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise InputError(f"cannot be written ({error.strerror})", file=str(path)) from error
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


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
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=str(path)) from error


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
