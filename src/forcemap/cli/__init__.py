"""The command line: each command parses, makes one public call, and prints."""

import json
import os
import sys

from forcemap.errors import MissingExtra

__all__ = ["main"]


def main() -> None:
    """Run the command line and exit with its code; without the packages that it needs it says so, as any error."""
    # Matrices here are small: threads of numpy's would cost time at every start and save none.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from forcemap.cli.app import run

        code = run(sys.argv[1:])
    except ModuleNotFoundError as error:
        missing = MissingExtra.of(error)
        print(f"error: {missing}", file=sys.stderr)
        if "--json" in sys.argv:
            where = dict.fromkeys(("file", "row", "column"))
            print(json.dumps({"error": {"kind": missing.kind, "message": missing.message, **where}}))
        code = 2
    sys.exit(code)
