"""The seal of what a campaign's folder remembers: made with a secret of this account that no campaign holds."""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
from contextlib import suppress
from pathlib import Path

from forcemap.files import flush_to_disk, hidden_file

_KEY_FILE = "memory.key"  # in the account's folder of program states
_KEY_BYTES = 32


def seal(text: str, under: str) -> str:
    """The seal of a text under what it depends on; empty if that is unknown or there is nowhere to keep a secret."""
    secret = _secret() if under else b""
    key = hmac.new(secret, under.encode(), hashlib.sha256).digest()
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest() if secret else ""


def is_sealed(text: str, found: str, under: str) -> bool:
    """Whether this account sealed the text under the same."""
    expected = seal(text, under)
    return bool(expected) and hmac.compare_digest(found.encode(), expected.encode())


def _secret() -> bytes:
    """Random bytes that this account alone can read, made when first needed; empty if there is nowhere to keep them."""
    try:
        state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
        file = Path(state) / "forcemap" / _KEY_FILE
        if not file.exists():
            _make_secret(file)
        private = not file.stat().st_mode & 0o077
        content = file.read_bytes()
    except (OSError, RuntimeError):  # RuntimeError: an account without a home
        return b""
    return content if private and len(content) == _KEY_BYTES else b""


def _make_secret(file: Path) -> None:
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with hidden_file(file.parent) as (hidden, stream):
        hidden.chmod(0o600)
        stream.write(secrets.token_bytes(_KEY_BYTES))
        stream.flush()
        flush_to_disk(hidden)
        with suppress(FileExistsError):  # another process was first
            os.link(hidden, file)
