"""The documentation site: it builds without a warning, no link is dead, nothing loads from outside, all is in it."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urljoin, urlsplit

import pytest
import typer.main

import forcemap
import forcemap.figures
from forcemap.cli.app import app

ROOT = Path(__file__).parents[1]
NEEDED = ("latex2mathml", "mkdocs", "material", "mkdocstrings", "mkdocstrings_handlers")
missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
builds = pytest.mark.skipif(bool(missing), reason=f"no {', '.join(missing)}: pip install '.[docs]'")


class Page(HTMLParser):
    """Anchors, links and loaded files of a page, and its words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.anchors |= {values[key] for key in ("id", "name") if values.get(key)}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        elif tag != "a":
            self.loaded += [values[key] for key in ("src", "href", "data", "srcset", "action") if values.get(key)]
        self.loaded += re.findall(r"url\(([^)]*)\)", values.get("style") or "")

    def handle_data(self, data):
        self.words += data


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site):
    return {str(path.relative_to(site)): Page(path.read_text()) for path in site.rglob("*.html")}


def in_nav():
    return re.findall(r"^ +- (?:[\w ]+: )?([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.M)


def test_the_nav_names_every_page_once():
    written = {path.name for path in (ROOT / "docs").glob("*.md")}
    named = in_nav()
    assert len(named) == len(set(named))
    assert written <= set(named)


def test_every_how_to_starts_with_what_the_reader_wants_to_do():
    (part,) = re.findall(r"^  - How to:\n((?:      .*\n)+)", (ROOT / "mkdocs.yml").read_text(), re.M)
    names = part.replace("- ", "").split()
    assert len(names) >= 16
    for name in names:
        _, first, *_ = (ROOT / "docs" / name).read_text().split("\n\n")
        assert first.startswith("You want "), name


@builds
def test_every_page_of_the_nav_is_built(pages):
    assert {name.replace(".md", ".html") for name in in_nav()} | {"404.html"} == set(pages)


@builds
def test_every_internal_link_and_anchor_resolves(pages):
    links = 0
    for name, page in pages.items():
        for link in page.links:
            if urlsplit(link).scheme or name == "404.html":
                continue
            target, _, anchor = urljoin(name, link).partition("#")
            assert target in pages, (name, link)
            assert not anchor or unquote(anchor) in pages[target].anchors, (name, link)
            links += 1
    assert links > 1000


@builds
def test_no_page_loads_anything_from_elsewhere(site, pages):
    for name, page in pages.items():
        for loaded in page.loaded:
            assert not re.match(r"(\w+:)?//", loaded), (name, loaded)
            where = urljoin(name, loaded).partition("#")[0]
            assert loaded.startswith(("data:", "#")) or name == "404.html" or (site / where).exists(), (name, loaded)
    styles = list(site.rglob("*.css"))
    assert styles
    for style in styles:
        assert not re.search(r"url\(\s*[\"']?(\w+:)?//|@import", style.read_text()), style


@builds
def test_the_page_of_options_has_every_command_with_all_its_options(pages):
    words = pages["options.html"].words
    for name, command in typer.main.get_command(app).commands.items():
        assert f"forcemap-{name}" in pages["options.html"].anchors
        for parameter in command.params:
            assert all(option in words for option in parameter.opts if option != "--help"), (name, parameter.opts)


@builds
def test_the_python_pages_have_every_public_name_and_what_it_is(pages):
    reference = [page for name, page in pages.items() if name.startswith("api/")]
    anchors = set().union(*(page.anchors for page in reference))
    words = " ".join(" ".join(page.words for page in reference).split())
    for package in (forcemap, forcemap.figures):
        for name in package.__all__:
            if name.startswith("__"):
                continue
            assert f"{package.__name__}.{name}" in anchors
            value = getattr(package, name)
            if isinstance(value, type) and value.__doc__:
                assert " ".join(value.__doc__.split("\n")[0].split()[:4]).replace("`", "") in words, name


@builds
@pytest.mark.parametrize("name", ["ZoneSpeeds", "JudgedRecordings", "PhaseTwo", "BodyRegion"])
def test_the_types_that_results_are_made_of_are_in_the_reference(pages, name):
    anchors = set().union(*(page.anchors for where, page in pages.items() if where.startswith("api/")))
    assert [each for each in anchors if each.endswith(f".{name}")]


@builds
def test_words_of_the_pages_lead_to_the_reference(pages):
    assert any(link.endswith("#forcemap.safe_speed") for link in pages["equations.html"].links)
    assert any(link.endswith("options.html#forcemap-fit") for link in pages["your_device_files.html"].links)


@builds
def test_equations_are_set_as_equations(site):
    """Every block of LaTeX is MathML on its page, with all of its words, and none of the commands is left."""
    source = (ROOT / "docs" / "equations.md").read_text()
    page = (site / "equations.html").read_text()
    blocks = re.findall(r"^```math\n(.*?)^```$", source, re.M | re.S)
    made = re.findall(r'<div class="equation"><math .*?</math></div>', page, re.S)
    assert len(blocks) == len(made) == 29
    for latex, mathml in zip(blocks, made, strict=True):
        assert "\\" not in mathml
        assert "merror" not in mathml
        words = " ".join(re.findall(r"\\text\{([^}]*)\}", latex)).split()
        shown = re.sub(r"<[^>]*>", " ", mathml.replace("&#x000A0;", " ")).split()
        assert set(words) <= set(shown)


def test_the_equations_are_numbered_and_name_functions_that_exist():
    text = (ROOT / "docs" / "equations.md").read_text()
    sections = re.split(r"^### ", text, flags=re.M)[1:]
    assert [int(section.split(".")[0]) for section in sections] == list(range(1, len(sections) + 1))
    for section in sections:
        assert "- Source: " in section
        named = [
            span
            for line in re.findall(r"^- (?:Func|Form|Bound).*", section, re.M)
            for span in re.findall(r"`([^`]+)`", line)
        ]
        assert named
        for name in named:
            module, _, own = name.rpartition(".")
            if module.startswith("forcemap."):
                assert hasattr(importlib.import_module(module), own), name
            else:
                assert functools.reduce(getattr, name.split("."), forcemap) is not None
    for label in (
        "eq:v_pfl",
        "eq:linear_model",
        "eq:eff_mass",
        "eq:our_model",
        "eq:ur_model",
        "eq:kuka30_model",
        "eq:kuka10_model",
    ):
        assert f"`{label}`" in text


def test_the_equations_have_the_published_coefficients():
    text = (ROOT / "docs" / "equations.md").read_text()
    (table,) = re.findall(r"<!-- published maps -->\n\n\| \|(.*?)\n\n", text, re.S)
    header, _, *rows = table.splitlines()
    columns = list(zip(*(map(float, row.split("|")[2:5]) for row in rows), strict=True))
    for name, column in zip(re.findall(r"`(.*?)`", header), columns, strict=True):
        assert list(column) == forcemap.published_map(name).coefficients.tolist()


def test_the_pictures_are_small():
    for path in (ROOT / "docs" / "pictures").glob("*.png"):
        assert path.stat().st_size < 150_000, path
