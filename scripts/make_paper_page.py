"""Write docs/paper.md: the paper's figures and tables, each with the command that draws it, and what it gives.

The commands on the page are run, in a folder that is thrown away, on the simulated example campaigns and the published
maps; the pictures go to docs/pictures. Run from the root of the project; the same software gives the same files.
"""

from __future__ import annotations

import contextlib
import io
import shlex
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from forcemap.campaigns.examples import copy_example
from forcemap.cli.app import run
from forcemap.files import write_atomically
from forcemap.lab.example_campaigns import simulate_example

PAGE, PICTURES = Path("docs/paper.md"), Path("docs/pictures")
SMALLER, COLOURS = 0.45, 128  # of the 300 dpi that a figure has, enough for a page; of a picture
LINES = 40  # of the output that are shown at most, up to its first empty one
ALL = "all"  # of the output of a command that gives a speed: it never comes alone

HEAD = """# The paper's figures and tables

Each figure and table of *3D Collision-Force-Map for Safe Human-Robot Collaboration* (Svarny, Rozlivek, Rustler,
Hoffmann, ICRA 2021) with the command that draws it. `scripts/make_paper_page.py` wrote this page: every command
was run; `...` stands for lines of its answer that are left out here. The three published maps are the paper's
equations. Its impacts are not part of forcemap: where impacts are needed, the commands use the bundled example
campaigns, which are SIMULATED, drawn from those maps with scatter of the size the paper states. Yours, or [a
published data set](published_data.md), take their place.

The folders of the commands, in the Python of an environment that forcemap is installed in (`.venv/bin/python`; pipx
and uv keep theirs apart):

```python
import forcemap

for name in forcemap.EXAMPLE_CAMPAIGNS:
    forcemap.copy_example(name, f"{name}-impacts")
```

and, with recordings, `forcemap demo ur10e-recordings --example ur10e` and the same for `kuka-iiwa7-30nm`. Figures 1
(photographs of the set-up) and 2 (a drawing of the phases) are not drawn here; figure 8 shows the phases of
recordings.
"""


@dataclass(frozen=True)
class Item:
    """A figure, a table or a statement of the paper, and the command for it."""

    title: str
    words: str
    command: str
    first: str = ""
    """The first line of the output to show; of a figure nothing is shown."""
    python: str = ""
    """A block of Python below, with what introduces it."""


TABLES = "ur10e-impacts kuka-iiwa7-30nm-impacts kuka-iiwa7-10nm-impacts"
MAPS = "ur10e kuka-iiwa7-30nm kuka-iiwa7-10nm"
FIGURE = "forcemap figure"
PUBLISHED_COEFFICIENTS = """
The published maps are fitted already, so `fit` does not take them. Their coefficients, as the paper prints them:

```python
import forcemap

for name in forcemap.PUBLISHED_MAPS:
    published = forcemap.published_map(name)
    print(name, dict(zip(published.form.term_names, published.coefficients.tolist(), strict=True)))
```
"""
ITEMS = (
    Item(
        "Section II-A: speeds by the standard",
        "0.13 and 0.16 m/s quasi-static, 0.26 and 0.32 m/s transient, for 30 and 20 kg of moving mass.",
        "forcemap limits back_of_hand --moving-mass-kg 30",
        "back_of_hand: contact model",
    ),
    Item(
        "Figure 3: forces by distance, height and speed",
        "The UR10e, and the KUKA with the torque limit of 10 Nm.",
        f"{FIGURE} heights ur10e kuka-iiwa7-10nm --speeds-mps 0.2,0.4 --width page -o paper-heights.png",
    ),
    Item(
        "Figure 4 a: the planar arm at nine inspection points",
        "The paper leaves open how the last link stands, whether its joint gives way, where a link's mass lies and\n"
        "how high the shoulder is: six readings with uniform rods and a shoulder at 0.18 m (two nearly coincide);\n"
        "the others are in [effective_mass.md](effective_mass.md).",
        f"{FIGURE} planar-postures --width page -o paper-planar-postures.png",
    ),
    Item(
        "Figure 4 b: effective mass over distance and height",
        "Of the first reading; the figures of any other gives, for instance,\n"
        "`forcemap planar-arm --link-mass uniform_rod --last-link aligned --wrist locked --base-height-m 0.18`.",
        f"{FIGURE} planar-mass -o paper-planar-mass.png",
    ),
    Item(
        "Section II-D: selection of terms",
        "Over the three tables at once, as in the paper, and whether its outcome is stable.",
        f"forcemap select {TABLES}",
        "Conclusion",
    ),
    Item(
        "Figure 5: where was measured",
        "A panel a speed, or a few neighbouring ones; the example campaigns have the paper's grid as test states.",
        f"{FIGURE} grid ur10e-impacts --width page -o paper-grid.png",
    ),
    Item(
        "Table I: the data sets",
        "In `tables/dataset.csv` of a bundle to publish. `--area`, the body area that is hit, adds the standard's "
        "model\n(Table III) and safe speeds; without it the bundle is written without them, and says so.\n"
        "Figure 8 is left out of this one: these impacts have no recordings.",
        "forcemap publication ur10e-impacts -o published --area back_of_hand",
    ),
    Item(
        "Section V-A: repeatability",
        "Largest and mean standard deviation of the repeats of a state, above the picture. The paper: 3.85 and 1.12 N.",
        f"{FIGURE} repeatability ur10e-impacts -o paper-repeatability.png",
    ),
    Item(
        "Equations of section V: coefficients",
        "With their standard errors; `publication` writes them as a table.",
        "forcemap fit ur10e-impacts",
        "term ",
        PUBLISHED_COEFFICIENTS,
    ),
    Item(
        "Figure 6: the map in the workspace",
        "Slices at the lowest, middle and highest speed.",
        f"{FIGURE} workspace ur10e-impacts -o paper-workspace.png",
    ),
    Item(
        "Table II: accuracy of the 3D map",
        "Test states (Ts) and all states (All), underestimation first. Test states are the paper's grid; the\n"
        "example's training states lie at places of its own, not at the paper's nine. The paper has for its UR10e:\n"
        "test states underestimated by 3.56 % at most and 1.37 % on average, overestimated by 6.35 % and 2.40 %;\n"
        "all states 3.68 %, 1.50 %, 6.35 % and 2.16 %.",
        "forcemap evaluate ur10e-impacts",
        "                 ",
    ),
    Item(
        "Figure 7: the map, the 2D map and the standard",
        "At 0.30 m/s: above at a height of 0.14 m, below at a distance of 0.71 m. The published maps come without\n"
        "data: their 2D maps are fitted to the 3D map. With campaigns in their place the 2D maps are of the impacts.",
        f"{FIGURE} comparison {MAPS} --area back_of_hand --speeds-mps 0.3 --height 0.14 "
        "--width page -o paper-models.png",
    ),
    Item(
        "Table III: accuracy of the 2D maps",
        "With the standard's contact model beside them, which needs `--area`: the body area gives spring and mass.\n"
        "The paper trained its 2D maps for every height by itself: that is the row `CFM_2D per height`. It has for\n"
        "its UR10e, in the same order: test states 6.51 %, 2.23 %, 7.56 % and 1.76 %; all states 6.51 %, 2.27 %,\n"
        "9.13 % and 2.78 %.",
        "forcemap compare ur10e-impacts --area back_of_hand",
        "Force models",
    ),
    Item(
        "Section V-B: 10 Nm against 30 Nm",
        "Forces are on average approximately 5 % lower.",
        "forcemap compare kuka-iiwa7-30nm kuka-iiwa7-10nm",
        "force of the other",
    ),
    Item(
        "Figure 8: force over time",
        "Phase I, what follows it, and the limits of the back of the hand: the UR10e and the KUKA. The recordings are\n"
        "of the virtual lab, whose `ur10e-like` robot retreats at an external torque of 97.1 Nm at any joint, chosen\n"
        "so that its forces are those of the paper's UR10e.",
        f"{FIGURE} evolution ur10e-recordings/recordings/d890-h140-v200-r1.csv "
        "kuka-iiwa7-30nm-recordings/recordings/d860-h140-v200-r1.csv --area back_of_hand "
        "--width page -o paper-evolution.png",
    ),
    Item(
        "Section VI: speeds at 0.8 m and 0.4 m",
        "0.36 m/s for the UR10e at 280 N is the map without a margin (`--bound margin --margin 0`: 0.355 m/s at\n"
        "contact); with the paper's 10 % it is less.",
        "forcemap speed ur10e --distance 0.8 --height 0.4 --area back_of_hand --contact transient",
        ALL,
    ),
)


def sections() -> Iterator[str]:
    """Every item with its command, run in the working folder, and what it gave."""
    for item in ITEMS:
        yield f"\n## {item.title}\n\n{item.words}\n\n    {item.command}\n"
        words = shlex.split(item.command)[1:]
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            if run(words) not in (0, 1):
                raise SystemExit(f"{item.command}: failed")
        if words[0] == "figure":
            yield f"\n![{item.title}](pictures/{words[words.index('-o') + 1]})\n"
        elif item.first:
            lines = out.getvalue().splitlines()
            start = next((i for i, line in enumerate(lines) if line.startswith(item.first)), 0)
            shown = lines if item.first == ALL else lines[start : start + LINES]
            shown = shown[: shown.index("")] if "" in shown and item.first != ALL else shown
            if len(shown) < len(lines):
                shown = [*["..."] * (start > 0), *shown, *["..."] * (start + len(shown) < len(lines))]
            yield "\n```text\n" + "\n".join(shown) + "\n```\n"
        yield item.python


def main() -> None:
    """Write the page and its pictures."""
    with tempfile.TemporaryDirectory() as home, contextlib.chdir(home):
        for table in TABLES.split():
            copy_example(table.removesuffix("-impacts"), table)
        for name in ("ur10e", "kuka-iiwa7-30nm"):
            simulate_example(name, f"{name}-recordings")
        text = HEAD + "".join(sections())
        pictures = {}
        for path in sorted(Path().glob("*.png")):
            picture = Image.open(path).convert("RGB")
            size = round(picture.width * SMALLER), round(picture.height * SMALLER)
            stream = io.BytesIO()
            picture.resize(size, Image.Resampling.LANCZOS).quantize(COLOURS).save(stream, "png", optimize=True)
            pictures[path.name] = stream.getvalue()
    for name, data in pictures.items():
        write_atomically(PICTURES / name, data)
        print(f"{PICTURES / name}: {len(data) / 1000:.0f} kB")
    write_atomically(PAGE, text)
    print(PAGE)


if __name__ == "__main__":
    main()
