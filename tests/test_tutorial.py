"""The tutorial: its commands run in order in an empty folder, and print what it shows of them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from forcemap.cli.app import run

TUTORIAL = Path(__file__).parents[1] / "docs" / "tutorial.md"
PREFIX = r"    forcemap "
PARTS = re.compile(rf"^{PREFIX}(?P<command>[^\n]*)$|^```(?P<kind>\w+)\n(?P<block>.*?)```$", re.M | re.S)
NAMED = re.compile(r" as\s`([\w./]+)`")


def test_the_tutorial_runs_from_nothing_to_a_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text, printed, commands = TUTORIAL.read_text(), "", []
    prose = re.sub(r"^```\w+\n.*?^```$", "", text, flags=re.M | re.S)  # a printed line may begin as a command does
    sections = iter(re.split(PREFIX, prose)[1:])
    for part in PARTS.finditer(text):
        if command := part["command"]:
            said = int("exit code 1" in next(sections))
            assert run(shlex.split(command)) == said, (command, capsys.readouterr().err)
            printed = capsys.readouterr().out
            commands.append(command.split()[0])
        elif part["kind"] == "text":
            for excerpt in part["block"].split("...\n"):
                assert excerpt in printed, (commands[-1], excerpt)
                printed = printed.partition(excerpt)[2]
        else:
            Path(NAMED.findall(text[: part.start()])[-1]).write_text(part["block"])
    chain = (
        "plan simulate inspect collect check fit evaluate compare speed speed speed-map path export report report "
        "confirm simulate collect confirm"
    )
    assert commands == chain.split()
    for name in re.findall(r"^\| `(.*?)` \|", text, re.M):
        assert (tmp_path / name).exists(), name
