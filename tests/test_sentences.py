"""No sentence decides anything: with every sentence replaced by another, outcomes, numbers and exit codes are the same.

A second process imports the rooms of the library and the table of sentences with each text of three words or more
spelt otherwise, letters and marks, and runs the same commands on the same files. What it prints and writes may differ
in the words alone.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from forcemap.campaigns.conditions import Conditions
from forcemap.findings import Finding, FindingKind, in_words
from forcemap.words import SENTENCES, SHORT, sentence, short_reason
from pulses import TOML, collect, write_campaign

HAND = ["--area", "back_of_hand", "--contact", "quasi-static"]
QUICK = ["--area", "back_of_hand", "--contact", "transient"]
IN_NEWTONS = ["--limit-N", "150", "--contact", "quasi-static"]
COMMANDS = [
    ["speed", "ur10e", "--distance", "0.8", "--height", "0.4", *QUICK],
    ["speed", "ur10e", "--distance", "0.8", "--height", "0.4", "--area", "temple", "--contact", "transient"],
    ["speed", "cell", "--distance", "0.85", "--height", "0.25", *HAND],
    ["speed", "cell", "--distance", "0.85", "--height", "0.25", *QUICK],
    ["speed", "cell", "--distance", "0.85", "--height", "0.25", *IN_NEWTONS],
    ["speed", "soft", "--distance", "0.85", "--height", "0.25", *HAND],
    ["speed", "broken", "--distance", "0.85", "--height", "0.25", *HAND],
    ["speed-map", "cell", *HAND, "--step-m", "0.1"],
    ["speed-map", "kuka-iiwa7-30nm", *QUICK, "--step-m", "0.1"],
    ["fit", "cell"],
    ["fit", "broken"],
    ["evaluate", "cell"],
    ["compare", "cell", *HAND[:2]],
    ["check", "cell", *HAND[:2]],
    ["path", "cell", "press.csv", *HAND],
    ["path", "ur10e", "press.csv", "--area", "face", "--contact", "transient"],
    ["export", "cell", *HAND, "--format", "csv", "-o", "zones.csv"],
    ["export", "cell", *HAND, "--format", "urscript", "-o", "speeds.script"],
    ["export", "cell", *IN_NEWTONS, "--format", "csv", "-o", "none.csv"],
    ["export", "broken", *HAND, "--format", "csv", "-o", "none.csv"],
    ["export", "ur10e", "--area", "temple", "--contact", "transient", "--format", "csv", "-o", "none.csv"],
    ["collect", "cell"],
    ["plan", "new", "--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--speeds-mps", "0.1,0.4",
     "--reach-m", "0.95", "--device-range-N", "500", "--moving-mass-kg", "30", *IN_NEWTONS],
    ["next", "more", *HAND],
    ["next", "begun", *IN_NEWTONS, "--distances-m", "0.52,0.89", "--heights-m", "0.14,0.46", "--moving-mass-kg", "30",
     "--device-range-N", "500"],
    ["confirm", "more", *HAND],
    ["evaluate", "cell", "--forms"],
    ["fit", "cell", "-o", "cell.json"],
    ["evaluate", "later", "--against", "cell.json"],
    ["evaluate", "soft", "--against", "cell.json"],
    ["compare", "ur10e", "kuka-iiwa7-30nm"],
    ["compare", "cell.json", "ur10e"],
]  # fmt: skip

WORLD = r"""
import ast, contextlib, io, json, os, re, sys
from importlib.machinery import PathFinder, SourceFileLoader

ROOMS = {"campaigns", "maps", "limits", "speeds", "verdicts", "planning", "comparisons", "paths", "assessment"}
TURNED = str.maketrans(
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ;:", "nopqrstuvwxyzabcdefghijklmNOPQRSTUVWXYZABCDEFGHIJKLM!?"
)

FIGURES = re.compile(r"({[^}]*}|\[\w+\?)")


def other(text):
    if len(re.findall(r"[A-Za-z]{2,}", text)) < 3 or text.count(" ") < 2:
        return text
    return "".join(part if part[:1] in ("{", "[") else part.translate(TURNED) for part in FIGURES.split(text))


class Other(ast.NodeTransformer):
    def visit_Constant(self, node):
        return ast.copy_location(ast.Constant(other(node.value)), node) if isinstance(node.value, str) else node

    def documented(self, node):
        first = node.body[:1] if ast.get_docstring(node, clean=False) is not None else []
        node.body = [*first, *(self.visit(each) for each in node.body[len(first):])]
        return node

    visit_Module = visit_ClassDef = visit_FunctionDef = documented


class Loader(SourceFileLoader):
    def get_code(self, name):
        tree = Other().visit(ast.parse(self.get_data(self.path)))
        return compile(ast.fix_missing_locations(tree), self.path, "exec")


class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        parts = name.split(".")
        if parts[0] == "forcemap" and (parts[1:2] and parts[1] in ROOMS or name == "forcemap.words"):
            spec = PathFinder.find_spec(name, path, target)
            if spec is not None and spec.origin is not None:
                spec.loader = Loader(name, spec.origin)
            return spec
        return None


if sys.argv[1] == "other":
    sys.meta_path.insert(0, Finder)
    from forcemap.words import SENTENCES

    SENTENCES.update({kind: other(words) for kind, words in SENTENCES.items()})
os.chdir(sys.argv[2])
from forcemap.cli.app import run

found = []
for command in json.load(sys.stdin):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(command)
    found.append([code, out.getvalue(), err.getvalue()])
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def worlds(tmp_path_factory):
    """Folder and answers, once with the sentences as they are and once with others."""
    home = tmp_path_factory.mktemp("sentences")
    as_is = home / "as_is"
    toml = TOML.replace("[device]", "simulated = true\n[device]") + '[contact]\ndirection = "down"\n'
    collect(write_campaign(as_is / "cell", toml=toml))
    shutil.copytree(as_is / "cell", as_is / "broken")
    write_campaign(as_is / "soft", toml=toml.replace("75000", "25000"))
    collect(as_is / "soft")
    table = as_is / "broken" / "impacts.csv"
    table.write_text(table.read_text().replace(",0.1,", ",0.1001,", 1))
    shutil.copytree(as_is / "cell", as_is / "more")
    collect(write_campaign(as_is / "later", toml=toml, seed=1))
    (as_is / "press.csv").write_text("x_m,y_m,z_m\n0.85,0,0.3\n0.85,0,0.22\n0.7,0,0.22\n")
    shutil.copytree(as_is, home / "other")
    commands = COMMANDS + [[*command, "--json"] for command in COMMANDS]
    answers = []
    for world in ("as_is", "other"):
        ran = subprocess.run(
            [sys.executable, "-c", WORLD, world, str(home / world)],
            input=json.dumps(commands), capture_output=True, text=True, check=True,
            env=os.environ | {"SOURCE_DATE_EPOCH": "1795305600"},
        )  # fmt: skip
        answers.append(json.loads(ran.stdout))
    return home, commands, answers


def masked(text):
    """A text without its words and marks, and hashes of words: what is left are figures and the form."""
    return re.sub(r"[A-Za-z;:!?]+", "w", re.sub(r"\b[0-9a-f]{64}\b", "", text))


def test_outcomes_figures_and_exit_codes_do_not_hang_on_words(worlds):
    _, commands, (as_is, other) = worlds
    for command, one, two in zip(commands, as_is, other, strict=True):
        assert one[0] == two[0], command
        for text, turned in zip(one[1:], two[1:], strict=True):
            assert masked(text) == masked(turned), command
        if command[-1] == "--json":
            assert names(json.loads(one[1])) == names(json.loads(two[1])), command


def names(value):
    """Keys, and texts of less than three words, such as outcomes and kinds."""
    if isinstance(value, dict):
        return {key: names(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [names(inner) for inner in value]
    return value if not isinstance(value, str) or (value.count(" ") < 2 and len(value) < 64) else ""


def test_the_second_world_speaks_otherwise(worlds):
    _, commands, (as_is, other) = worlds
    assert sum(one[1:] != two[1:] for one, two in zip(as_is, other, strict=True)) > 0.75 * len(commands)
    said = other[commands.index(COMMANDS[2])][1]
    assert "FVZHYNGRQ vzcnpgf" in said  # the banner of simulated impacts is there, in other words
    assert as_is[commands.index(COMMANDS[2])][1].count("SIMULATED impacts") == 1


def test_files_are_the_same_but_for_words(worlds):
    home, _, _ = worlds
    files = {path.relative_to(home / "as_is") for path in (home / "as_is").rglob("*") if path.is_file()}
    assert files == {path.relative_to(home / "other") for path in (home / "other").rglob("*") if path.is_file()}
    assert {Path("zones.csv"), Path("speeds.script")} <= files
    assert Path("none.csv") not in files
    for file in ("zones.csv", "speeds.script"):
        one, two = ((home / world / file).read_text() for world in ("as_is", "other"))
        assert masked(one) == masked(two)
        assert one != two


def test_every_kind_of_finding_has_its_sentence():
    assert list(SENTENCES) == [kind.value for kind in FindingKind]
    for words in SENTENCES.values():
        assert words.count("[") == words.count("]") == len(re.findall(r"\[\w+\?[^\[\]]*\]", words))


def test_short_reasons_are_of_kinds_and_the_gravest_is_said():
    assert SHORT.keys() <= {kind.value for kind in FindingKind}
    few = Finding.of(FindingKind.POINT_FEW_REPEATS, impacts=2, needed=3)
    exceeded = [
        Finding.of(
            FindingKind.POINT_IMPACT_NOT_WITHIN,
            Finding.of(FindingKind.FORCE_EXCEEDS, force_N=force, limit_N=280.0, at_least=False),
            recording="a",
        )
        for force in (281.0, 290.12)
    ]
    slow = Finding.of(FindingKind.POINT_MAP_REFUSES, Finding.of(FindingKind.UNCONFIRMED))
    unclear = Finding.of(FindingKind.POINT_IMPACT_NOT_WITHIN, in_words("the limit exceeded?"), recording="a")
    fast = Finding.of(FindingKind.POINT_TOO_FAST, programmed_mps=0.35, permitted_mps=0.328)
    for findings, said in (
        ([few], "2 of 3 repeats"),
        ([slow], "limit not kept at the slowest speed measured"),
        ([unclear], "an impact not shown to be within the limit"),
        ([few, slow, *exceeded], "limit exceeded, 290.1 N of 280 N"),
        ([fast], "too fast, at most 0.328 m/s"),
        ([in_words("whatever")], "no speed"),
    ):
        assert short_reason(findings) == said


def test_an_effective_payload_of_0_kg_is_stated():
    said = [sentence(finding) for finding in Conditions(payload=0).findings]
    assert "tool: not stated; payload: 0 kg; covers: not stated" in said
