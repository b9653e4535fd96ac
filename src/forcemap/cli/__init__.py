"""The command line: each command parses, makes one public call, and prints."""

import gc
import json
import os
import sys

from forcemap.errors import MissingExtra

__all__ = ["main"]

_COLLECT_EVERY = 50_000
"""Objects made before Python looks for unreachable ones; a choice: at 700, as it is, a tenth of a command's time goes
into looking through the packages that were loaded."""


def _flushed(code: int) -> int:
    """The exit code after all that was printed is written; another one where its reader has gone."""
    from forcemap.cli.app import READER_GONE

    try:
        sys.stdout.flush()
    except BrokenPipeError:
        code = READER_GONE
    if code == READER_GONE:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is left goes nowhere, without a word
    return code


def main() -> None:
    """Run the command line and exit with its code; without the packages that it needs it says so, as any error."""
    # Matrices here are small: threads of numpy's would cost time at every start and save none.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(_COLLECT_EVERY, 20, 100)
    try:
        from forcemap.cli.app import run

        code = _flushed(run(sys.argv[1:]))
    except ModuleNotFoundError as error:
        missing = MissingExtra.of(error)
        print(f"error: {missing}", file=sys.stderr)
        if "--json" in sys.argv:
            where = dict.fromkeys(("file", "row", "column"))
            print(json.dumps({"error": {"kind": missing.kind, "message": missing.message, **where}}))
        code = 2
    sys.exit(code)
