"""The commands together, what becomes of errors, and where options have gone that commands had before."""

from __future__ import annotations

import gc
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.exceptions import TyperException

from forcemap._version import __version__
from forcemap.errors import ForcemapError, InputError, MissingExtra

READER_GONE = 141
"""Exit code where whoever read the output has closed it, as `| head` does: that of other tools, and no answer."""

_COMMA = re.compile(r"-?[0-9]+,[0-9]+")

_REGION = re.compile("^--region(?==|$)")
"""An earlier spelling of --area, which names regions, too."""

_COMMANDS = {
    "demo": "Run the whole chain on a simulated campaign.",
    "plan": "Plan a campaign: its folder, states and run sheet.",
    "next": "Add the states to measure next for a limit.",
    "simulate": "Simulate a planned campaign in the virtual lab.",
    "collect": "Read all recordings; write the impacts table.",
    "inspect": "Show the impacts and phases in a file of recordings.",
    "check": "Check impacts against the limits of a body area.",
    "confirm": "Plan impacts at released speeds; judge them.",
    "fit": "Fit a collision-force map.",
    "transfer": "Carry a map over to a changed robot.",
    "evaluate": "Say how far predicted forces are from measured ones.",
    "select": "Show which terms the paper's selection keeps.",
    "compare": "Compare a map with the standard, or another map.",
    "limits": "Show force and pressure limits of body areas.",
    "speed": "Give the highest speed to program at a place.",
    "speed-map": "Give safe speeds on a grid of places.",
    "path": "Give the speeds allowed along a robot's path.",
    "place": "Find where the table of a task should stand.",
    "export": "Write the allowed speeds for a robot's controller.",
    "export-path": "Write what a robot's program takes for one path.",
    "estimate": "Estimate a force where the contact is another.",
    "effective-mass": "Show the effective mass of a robot.",
    "planar-arm": "Show the effective mass of the paper's planar arm.",
    "figure": "Draw a figure for a paper, a page or a slide.",
    "publication": "Write a campaign as a folder to publish.",
    "report": "Write the validation report of a campaign.",
    "sweep": "Compute a study of many blocks, on many machines.",
    "fleet": "Bring many campaigns up to date; one table of all.",
    "register": "Keep cells and releases; say what is in force.",
    "serve": "Show campaigns as a web page on this machine.",
}
"""What each command does; its function is found and loaded when it is used."""

_TOGETHER = {"inspect": "check", "speed-map": "speed", "place": "path", "export-path": "export"}
"""Commands in the file of another."""

_GROUPS = ("register",)
"""Commands that have commands of their own: their file has an `app`."""

_PLAN = {
    "--next": "is a command: forcemap next FOLDER",
    "--confirm": "is a command: forcemap confirm FOLDER",
    "--batch": "goes with forcemap next",
    "--largest-force-N": "goes with forcemap next",
    "--form": "is part of the design: --design i-optimal:LOG_SPEED",
    "--device-error-N": "is stated in campaign.toml (device.error_N)",
}
_BOUND = dict.fromkeys(("--confidence", "--content"), "is part of the bound: --bound tolerance:CONFIDENCE/CONTENT")
_FITTED = _BOUND | {"--form": "goes with forcemap fit: fit the map first, then name its file"}
_EXPORT = _FITTED | {
    "--path": "is a command: forcemap export-path SOURCE PATH, for --format scaling or safety",
    "--date": "is taken from SOURCE_DATE_EPOCH",
}
_ROBOT = dict.fromkeys(("--base", "--tip"), "is part of the robot: --robot arm.urdf:base=LINK:tip=LINK")
_MOVED = {
    "fit": {"--select": "is a command: forcemap select TABLE"},
    "plan": _PLAN,
    "speed": _BOUND,
    "speed-map": _BOUND,
    "report": _BOUND,
    "path": _FITTED | _ROBOT,
    "place": _FITTED,
    "export": _EXPORT,
}


_LANGUAGES = {"kuka": "krl is KUKA's", "ur": "urscript is Universal Robots'"}
"""What a person may name a format by, the robot's maker, and what it is called."""


@cache
def _command(name: str) -> TyperCommand | TyperGroup:
    """A command, from its file."""
    gc.disable()  # of what is imported nothing is garbage: looking for some, now or at the end, takes time
    module = import_module(f"forcemap.cli.{_TOGETHER.get(name, name).replace('-', '_')}")
    gc.freeze()
    gc.enable()
    if name in _GROUPS:
        group = typer.main.get_command(module.app)
        assert isinstance(group, TyperGroup)
        group.name = name
        return group
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(name=name)(getattr(module, {"next": "next_"}.get(name, name.replace("-", "_"))))
    command = typer.main.get_command(alone)
    assert isinstance(command, TyperCommand)
    return command


class _Commands(Mapping[str, TyperCommand | TyperGroup]):
    """The commands by name; the file of each is imported when it is asked for."""

    def __getitem__(self, name: str) -> TyperCommand | TyperGroup:
        if name not in _COMMANDS:
            raise KeyError(name)
        return _command(name)

    def __iter__(self) -> Iterator[str]:
        return iter(_COMMANDS)

    def __len__(self) -> int:
        return len(_COMMANDS)


class _Group(TyperGroup):
    """All commands; their list is printed without loading one of them."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = _Commands()  # type: ignore[assignment]

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Print the list of commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


app = typer.Typer(
    name="forcemap",
    cls=_Group,
    help="3D collision-force maps: from measured impacts to bounded forces and safe robot speeds.",
    epilog="Exit codes: 0 done, or yes; 1 the answer is no; 2 cannot answer.",
    add_completion=False,
    context_settings={"help_option_names": ["--help", "-h"]},
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


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code; every error becomes one line on stderr (and JSON if asked for)."""
    as_json = "--json" in arguments
    arguments = [_REGION.sub("--area", argument) for argument in arguments]
    if not arguments:
        app(["--help"], standalone_mode=False)
        return 2
    try:
        command = _Commands().get(arguments[0])
        if command and any({"--area", "--limit-table"} <= set(param.opts) for param in command.params):
            from forcemap.cli.options import require_as_spelled

            require_as_spelled(arguments)
        return int(app(arguments, standalone_mode=False) or 0)
    except ForcemapError as error:
        _emit_error(error, as_json=as_json)
    except TyperException as error:
        message = " ".join(error.format_message().split()).replace("Value error, ", "")
        words = _moved_option(arguments) or _decimal_comma(arguments) or _of_maker(arguments, message) or message
        words = words or "see --help"
        _emit_error(InputError(words), as_json=as_json)
    except ModuleNotFoundError as error:
        _emit_error(MissingExtra.of(error), as_json=as_json)
    except (BrokenPipeError, SystemExit):  # typer makes the second of the first
        return READER_GONE
    except (KeyboardInterrupt, typer.Abort):
        _emit_error(ForcemapError("interrupted"), as_json=as_json)
        return 130
    except Exception as error:
        words = f"a defect of forcemap ({type(error).__name__}: {' '.join(str(error).split())}); please report it"
        _emit_error(ForcemapError(words), as_json=as_json)
    return 2


def _moved_option(arguments: list[str]) -> str:
    """Where an option has gone, if the arguments have one that their command had before; else empty."""
    given = {argument.partition("=")[0] for argument in arguments}
    moved = _MOVED.get(arguments[0], {})
    return next((f"{arguments[0]}: {option} {where}" for option, where in moved.items() if option in given), "")


def _of_maker(arguments: list[str], message: str) -> str:
    """What a maker's language is called, if a refused format names the maker; else empty."""
    for option, value in pairwise([*arguments, ""]):
        name, _, after = option.partition("=")
        if name == "--format" and name in message and (language := _LANGUAGES.get((after or value).lower())):
            return f"{message.removesuffix('.')}; {language}"
    return ""


def _decimal_comma(arguments: list[str]) -> str:
    """What to write for a number with a decimal comma; empty if no argument is one."""
    for option, value in pairwise([*arguments, ""]):
        name, _, after = option.partition("=")
        if name.startswith("--") and _COMMA.fullmatch(text := after or value):
            return f"{name}: found {text}, expected a decimal point, {text.replace(',', '.')}"
    return ""


def _emit_error(error: ForcemapError, *, as_json: bool) -> None:
    from forcemap.cli.output import emit_error

    emit_error(error, as_json=as_json)
