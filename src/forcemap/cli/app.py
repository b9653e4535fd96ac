"""The commands together, what becomes of errors, and where options have gone that commands had before."""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from typer.exceptions import TyperException

from forcemap._version import __version__
from forcemap.cli.check import check, inspect
from forcemap.cli.collect import collect
from forcemap.cli.compare import compare
from forcemap.cli.confirm import confirm
from forcemap.cli.demo import demo
from forcemap.cli.effective_mass import effective_mass
from forcemap.cli.evaluate import evaluate
from forcemap.cli.export import export, export_path
from forcemap.cli.fit import fit
from forcemap.cli.limits import limits
from forcemap.cli.next import next_
from forcemap.cli.options import require_as_spelled
from forcemap.cli.output import emit_error
from forcemap.cli.path import path, place
from forcemap.cli.plan import plan
from forcemap.cli.report import report
from forcemap.cli.serve import serve
from forcemap.cli.simulate import simulate
from forcemap.cli.speed import speed, speed_map
from forcemap.errors import ForcemapError, InputError, MissingExtra

_PLAN = {
    "--next": "is a command: forcemap next FOLDER",
    "--confirm": "is a command: forcemap confirm FOLDER",
    "--batch": "goes with forcemap next",
    "--largest-force-N": "goes with forcemap next",
    "--form": "is part of the design: --design i-optimal:LOG_SPEED",
    "--device-error-N": "is stated in campaign.toml (device.error_N)",
    "--payload-kg": "is stated in campaign.toml (tool.payload_kg)",
}
_BOUND = dict.fromkeys(("--confidence", "--content"), "is part of the bound: --bound tolerance:CONFIDENCE/CONTENT")
_FITTED = _BOUND | {"--form": "goes with forcemap fit: fit the map first, then name its file"}
_EXPORT = _FITTED | {
    "--path": "is a command: forcemap export-path SOURCE PATH, for --format scaling or safety",
    "--date": "is taken from SOURCE_DATE_EPOCH",
}
_ROBOT = dict.fromkeys(("--base", "--tip"), "is part of the robot: --robot arm.urdf:base=LINK:tip=LINK")
_MOVED = {
    "plan": _PLAN,
    "speed": _BOUND,
    "speed-map": _BOUND,
    "report": _BOUND,
    "path": _FITTED | _ROBOT,
    "place": _FITTED,
    "export": _EXPORT,
}

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


_MEASURING = (demo, plan, next_, simulate, collect, inspect, check, confirm)
_USING = (fit, evaluate, compare, limits, speed, speed_map, path, place, export, export_path, effective_mass)
for command in (*_MEASURING, *_USING, report, serve):
    app.command(name=command.__name__.rstrip("_").replace("_", "-"))(command)


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code; every error becomes one line on stderr (and JSON if asked for)."""
    as_json = "--json" in arguments
    if not arguments:
        app(["--help"], standalone_mode=False)
        return 2
    try:
        command = typer.main.get_group(app).commands.get(arguments[0])
        if command and any({"--area", "--limit-table"} <= set(param.opts) for param in command.params):
            require_as_spelled(arguments)
        return int(app(arguments, standalone_mode=False) or 0)
    except ForcemapError as error:
        emit_error(error, as_json=as_json)
    except TyperException as error:
        found = " ".join(error.format_message().split()).replace("Value error, ", "")
        words = _moved_option(arguments) or found or "see --help"
        emit_error(InputError(words), as_json=as_json)
    except ModuleNotFoundError as error:
        emit_error(MissingExtra.of(error), as_json=as_json)
    except BrokenPipeError:
        sys.stdout = None  # the reader has gone; nothing is left to flush
    except (KeyboardInterrupt, typer.Abort):
        emit_error(ForcemapError("interrupted"), as_json=as_json)
        return 130
    except Exception as error:
        words = f"a defect of forcemap ({type(error).__name__}: {' '.join(str(error).split())}); please report it"
        emit_error(ForcemapError(words), as_json=as_json)
    return 2


def _moved_option(arguments: list[str]) -> str:
    """Where an option has gone, if the arguments have one that their command had before; else empty."""
    given = {argument.partition("=")[0] for argument in arguments}
    found = _MOVED.get(arguments[0], {})
    return next((f"{arguments[0]}: {option} {where}" for option, where in found.items() if option in given), "")
