"""The commands together, and what becomes of errors."""

from __future__ import annotations

import sys
from typing import Annotated

try:
    import typer
    from typer.exceptions import TyperException
except ImportError:
    sys.exit("error: the command line needs an extra; install it with: pip install 'forcemap[app]'")

from forcemap._version import __version__
from forcemap.cli.check import check
from forcemap.cli.collect import collect
from forcemap.cli.compare import compare
from forcemap.cli.demo import demo
from forcemap.cli.effective_mass import effective_mass
from forcemap.cli.evaluate import evaluate
from forcemap.cli.export import export
from forcemap.cli.fit import fit
from forcemap.cli.inspect import inspect
from forcemap.cli.limits import limits
from forcemap.cli.output import emit_error
from forcemap.cli.path import path
from forcemap.cli.place import place
from forcemap.cli.plan import plan
from forcemap.cli.report import report
from forcemap.cli.serve import serve
from forcemap.cli.simulate import simulate
from forcemap.cli.speed import speed
from forcemap.cli.speed_map import speed_map
from forcemap.errors import ForcemapError, InputError

app = typer.Typer(
    name="forcemap",
    help="3D collision-force maps: from measured impacts to bounded forces and safe robot speeds.",
    epilog="Exit codes: 0 done, or yes; 1 the answer is no; 2 cannot answer.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _version(asked: bool) -> None:
    if asked:
        print(f"forcemap {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """3D collision-force maps: from measured impacts to bounded forces and safe robot speeds."""


for command in (
    demo,
    plan,
    simulate,
    collect,
    inspect,
    check,
    fit,
    evaluate,
    compare,
    limits,
    speed,
    speed_map,
    path,
    place,
    export,
    effective_mass,
    report,
    serve,
):
    app.command(name=command.__name__.replace("_", "-"))(command)


def main() -> None:
    """Run the command line and exit with its code."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code; every error becomes one line on stderr (and JSON if asked for)."""
    as_json = "--json" in arguments
    if not arguments:
        app(["--help"], standalone_mode=False)
        return 2
    try:
        return int(app(arguments, standalone_mode=False) or 0)
    except ForcemapError as error:
        emit_error(error, as_json=as_json)
    except TyperException as error:
        emit_error(InputError(" ".join(error.format_message().split()) or "see --help"), as_json=as_json)
    except BrokenPipeError:
        sys.stdout = None  # the reader has gone; nothing is left to flush
    except (KeyboardInterrupt, typer.Abort):
        emit_error(ForcemapError("interrupted"), as_json=as_json)
        return 130
    except Exception as error:
        what = " ".join(str(error).split())
        emit_error(
            ForcemapError(f"a defect of forcemap ({type(error).__name__}: {what}); please report it"),
            as_json=as_json,
        )
    return 2
