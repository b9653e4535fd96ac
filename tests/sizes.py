"""How large the runs are: at full size under `make validity`."""

from __future__ import annotations

import os

FULL_SIZE = os.environ.get("FORCEMAP_VALIDITY") == "full"
COSTLY = 100 if FULL_SIZE else 10  # examples of a property that takes a tenth of a second each
