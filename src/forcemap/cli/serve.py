"""forcemap serve."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import Annotated

from typer import Argument, Option

from forcemap.cli.options import LimitTable


def serve(
    folder: Annotated[str, Argument(help="Campaign folder, or a folder of campaign folders.")],
    port: Annotated[int, Option("--port", min=0, max=65535, help="Port; 0 takes a free one.")] = 8000,
    host: Annotated[str, Option("--host", help="127.0.0.1; any other address is refused.")] = "127.0.0.1",
    area: Annotated[
        str | None, Option("--area", help="Body area or region to open the page with; default: it asks.")
    ] = None,
    limit_table: LimitTable = None,
    register: Annotated[
        str | None, Option("--register", metavar="FILE|URL", help="The team's register, shown at /register.")
    ] = None,
) -> int:
    """Show campaigns as a web page on this machine: drop recordings, turn the map, move a task, take away a report.

    Nothing is reached over the network and no other machine can reach it; the printed address carries a token, without
    which nothing is answered. Ends with Ctrl-C.

    Example: forcemap serve my-campaign --area back_of_hand
    """
    from forcemap.web.server import serve as serve_page

    def ready(address: str) -> None:
        print(f"Open {address} (Ctrl-C ends it)", file=sys.stderr, flush=True)
        if register is not None:
            print(f"Then the register: {address.partition('/?')[0]}/register", file=sys.stderr, flush=True)

    limits = limit_table or ""
    with suppress(KeyboardInterrupt):
        serve_page(folder, port=port, host=host, area=area, limit_table=limits, register=register, ready=ready)
    return 0
