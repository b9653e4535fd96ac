"""Where the real recordings are, and the one reason to leave out what needs them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

FOLDER = Path(os.environ.get("FORCEMAP_REAL_DATA") or "no-such-folder")
REASON = "FORCEMAP_REAL_DATA names no folder of real recordings"
needs_real_data = pytest.mark.skipif(not FOLDER.is_dir(), reason=REASON)
