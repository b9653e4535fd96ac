"""The documentation site's reference pages, made from commands, docstrings and examples while it is built.

mkdocs loads this file as a hook (mkdocs.yml): it adds the generated pages, links words of the written ones to them,
and writes nothing into docs/.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import typing
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

from forcemap.cli.app import app

ROOT = Path(__file__).parents[1]
PACKAGES = ("forcemap", "forcemap.figures")

# Pages of the API reference, and the rooms they cover: first the data's way, then what is beside it.
API_PAGES = {
    "Recordings, impacts, verdicts": ("recordings", "impacts", "verdicts"),
    "Campaigns and plans": ("campaigns", "planning"),
    "Maps and bounds": ("maps",),
    "Limits of the standard": ("limits",),
    "Safe speeds": ("speeds",),
    "Paths and places": ("paths",),
    "Comparisons and assessment": ("comparisons", "assessment"),
    "Effective mass": ("dynamics",),
    "Exports": ("exports",),
    "Figures": ("figures",),
    "Findings and errors": ("findings", "words", "errors"),
}

OPTIONS_HEAD = """# Options of every command

What `forcemap COMMAND --help` says. A unit is part of an option's name. {epilog} Errors are one line on
stderr, and with `--json` one JSON object.

| command | what it does |
|---|---|
"""

API_HEAD = """# Python

Every public name of `forcemap`, and the types that their results are made of, which a program reads but need not name;
a name that is not here is not public. SI units; arrays broadcast; a scalar in gives a float out.

"""


def pages() -> dict[str, str]:
    """Text of every generated page by its place in the site."""
    made = {"options.md": options_page(), "examples.md": examples_page(), "figures.md": figures_page()}
    return {**made, **api_pages(), **project_pages()}


@cache
def command_group() -> Any:
    """All commands, as the command line has them."""
    import typer.main

    return typer.main.get_command(app)


def options_page() -> str:
    """Every command with usage, arguments, options and example, from the command objects."""
    group = command_group()
    rows, sections = "", ""
    for name, command in all_commands(group):
        summary, *further = inspect.cleandoc(command.help).split("\n\n")
        rows += f"| [`forcemap {name}`](#forcemap-{name.replace(' ', '-')}) | {_prose(summary)} |\n"
        context = command.context_class(command, info_name=f"forcemap {name}")
        usage = " ".join(command.get_usage(context).removeprefix("Usage: ").split())
        sections += f"\n## forcemap {name}\n\n{_prose(summary)}\n\n```text\n{usage}\n```\n"
        for paragraph in further:
            words, is_example, example = " ".join(paragraph.split()).partition("Example: ")
            sections += f"\n{_prose(words)}\n" if words else ""
            sections += f"\nExample:\n\n```text\n{example}\n```\n" if is_example else ""
        sections += "\n| option | meaning |\n|---|---|\n"
        for parameter in command.get_params(context):
            record = parameter.get_help_record(context)
            if record and parameter.name != "help":
                sections += f"| `{record[0]}` | {_prose(record[1])} |\n"
    made = OPTIONS_HEAD.format(epilog=group.epilog) + rows + sections
    return re.sub(r"\bdocs/(\w+\.md)", r"[\1](\1)", made)


def all_commands(group: Any) -> Iterator[tuple[str, Any]]:
    """Every command by its name, and those of a group behind it: `register`, `register init`."""
    for name, command in group.commands.items():
        yield name, command
        yield from ((f"{name} {each}", below) for each, below in getattr(command, "commands", {}).items())


def api_pages() -> dict[str, str]:
    """A page for each group of rooms, with the directives that put the docstrings there, and an overview."""
    pages_of_rooms = {room: title for title, rooms in API_PAGES.items() for room in rooms}
    grouped: dict[str, list[str]] = {title: [] for title in API_PAGES}
    in_rooms = dict.fromkeys([*names_in_rooms(), *result_types()])
    for name, home in [*public_names().items(), *((name, name) for name in in_rooms)]:
        grouped[pages_of_rooms[home.split(".")[1]]].append(name)
    overview, made = API_HEAD, {}
    for title, names in grouped.items():
        path = f"{title.lower().replace(',', '').replace(' ', '-')}.md"
        rows = "".join(f"| [`{_shown(name)}`][{name}] | {_summary(name)} |\n" for name in names)
        overview += f"## [{title}]({path})\n\n| name | what |\n|---|---|\n{rows}\n"
        made[f"api/{path}"] = f"# {title}\n\n" + "".join(f"::: {name}\n\n{_values(name)}" for name in names)
    return {"api/index.md": overview, **made}


def examples_page() -> str:
    """The numbered examples as they stand in examples/."""
    text = "# Examples\n\nPrograms that `make test` runs, from a few lines up. They lie in the folder `examples`.\n"
    for path in sorted((ROOT / "examples").glob("*.py")):
        text += f"\n## {path.stem}\n\n```python\n{path.read_text()}```\n"
    return text


def figures_page() -> str:
    """The pictures that scripts/make_figures.py made."""
    source = "simulated campaigns and published maps"
    text = f"# Figures\n\nMade by `make docs` from {source}, with [`forcemap.figures`](api/figures.md).\n"
    for path in sorted((ROOT / "docs" / "pictures").glob("*.png")):
        title = path.stem.replace("-", " ").capitalize()
        text += f"\n## {title}\n\n![{title}](pictures/{path.name})\n"
    return text


def project_pages() -> dict[str, str]:
    """The pages that lie beside the README, their links into docs/ as links beside them."""
    texts = {name: (ROOT / f"{name}.md").read_text() for name in ("CONTRIBUTING", "CHANGELOG")}
    return {f"{name.lower()}.md": text.replace("](docs/", "](") for name, text in texts.items()}


@cache
def public_names() -> dict[str, str]:
    """Every public name, with its package, and the module that it is defined in."""
    found: dict[str, str] = {}
    for package in map(importlib.import_module, PACKAGES):
        source = Path(str(package.__file__))
        stub = source.with_suffix(".pyi")
        tree = ast.parse((stub if stub.exists() else source).read_text())
        imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
        modules = {
            alias.asname or alias.name: f"{package.__name__}.{node.module}" if node.level else str(node.module)
            for node in imports
            for alias in node.names
        }
        names = [name for name in package.__all__ if not name.startswith("__")]
        found |= {f"{package.__name__}.{name}": modules[name] for name in names}
    return found


@cache
def names_in_rooms() -> list[str]:
    """What the pages name with its module: functions of a room that are no public names."""
    pages = "".join(path.read_text() for path in sorted((ROOT / "docs").glob("*.md")))
    return sorted(set(re.findall(r"`(forcemap(?:\.[a-z_]+){2,}\.\w+)`", pages)))


@cache
def result_types() -> list[str]:
    """Types that public functions give, and their fields in turn, that are no public names themselves."""
    public = [_value(name) for name in public_names()]
    named = {each for each in public if inspect.isclass(each)}
    waiting: list[Any] = [each for each in public if inspect.isclass(each) or inspect.isfunction(each)]
    further: set[type] = set()
    while waiting:
        each = waiting.pop()
        hints = typing.get_type_hints(each)
        for hint in [hints.get("return")] if inspect.isfunction(each) else hints.values():
            new = set(_classes(hint)) - named - further
            further |= new
            waiting += new
    return sorted(f"{each.__module__}.{each.__name__}" for each in further)


def _classes(hint: Any) -> Iterator[type]:
    """Our classes in a type annotation, such as those of `tuple[A | None, ...]`."""
    if inspect.isclass(hint) and hint.__module__.startswith("forcemap."):
        yield hint
    for argument in typing.get_args(hint):
        yield from _classes(argument)


def _shown(name: str) -> str:
    """A public name without its package, a type of results by its own name."""
    return name.removeprefix("forcemap.") if name in public_names() else name.rpartition(".")[2]


def set_equations(markdown: str) -> str:
    """Blocks of LaTeX as MathML, which browsers set by themselves; nothing is fetched."""
    from latex2mathml.converter import convert

    def equation(block: re.Match[str]) -> str:
        return f'<div class="equation">{convert(block[1].strip(), display="block")}</div>\n'

    return re.sub(r"^```math\n(.*?)^```\n", equation, markdown, flags=re.M | re.S)


def linked(markdown: str) -> str:
    """Commands and public names in code spans become links; links out of docs/ lead to the generated pages."""
    markdown = re.sub(r"\]\(\.\./examples/(\w+)\.py\)", r"](examples.md#\1)", markdown)
    markdown = re.sub(r"\]\(\.\./(CONTRIBUTING|CHANGELOG)\.md\)", lambda m: f"]({m[1].lower()}.md)", markdown)
    parts = re.split(
        r"(^```.*?^```$|^#.*?$|^    .*?$|\[[^\]]*\]\([^)]*\)|\[[^\]]*\]\[[^\]]*\])", markdown, flags=re.M | re.S
    )
    parts[::2] = [re.sub(r"`([^`\n]+)`", _link, part) for part in parts[::2]]
    return "".join(parts)


def _link(span: re.Match[str]) -> str:
    name = span[1].removesuffix("()").removeprefix("forcemap.").removeprefix("fm.")
    if f"forcemap.{name}" in public_names() or f"forcemap.{name}" in names_in_rooms():
        return f"[{span[0]}][forcemap.{name}]"
    command = re.match(r"forcemap ([a-z-]+)", span[1])
    known = command and command[1] in command_group().commands
    return f"[{span[0]}][forcemap-{command[1]}]" if command and known else span[0]


def _summary(name: str) -> str:
    """First sentence of a docstring; of a constant, the type."""
    value = _value(name)
    if inspect.isclass(value) or inspect.isfunction(value):
        return _prose((inspect.getdoc(value) or "").split("\n\n")[0])
    return f"`{type(value).__name__}`"


def _values(name: str) -> str:
    """What an enumeration can be: its members have no docstrings."""
    value = _value(name)
    if not (inspect.isclass(value) and issubclass(value, Enum)):
        return ""
    return f"Values of `{name}`: {', '.join(f'`{member.value}`' for member in value)}.\n\n"


def _value(name: str) -> Any:
    package, _, own = name.rpartition(".")
    return getattr(importlib.import_module(package), own)


def _prose(text: str) -> str:
    """A paragraph as Markdown on one line: options become code, asterisks, brackets and pipes mean themselves."""
    text = re.sub(r"(?<![\w`-])(--[a-zA-Z][\w-]*)", r"`\1`", " ".join(text.split()))
    parts = re.split(r"(`[^`]*`)", text)
    parts[::2] = [re.sub(r"([*_<\[\]|])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def on_files(files: Any, config: Any) -> Any:
    """Add the generated pages (called by mkdocs)."""
    from mkdocs.structure.files import File

    generated: Callable[..., Any] = File.generated
    for path, text in pages().items():
        files.append(generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Link the words of a page (called by mkdocs)."""
    generated = page.file.src_uri.startswith(("api/", "options", "changelog", "examples", "figures"))
    return markdown if generated else set_equations(linked(markdown))
