"""Visit every page of a campaign in Chromium, as a person does, and write down what it took and what was wrong.

    python scripts/time_pages.py my-campaign [--pictures pictures] [--docs docs/web_page.md]

A figure of time holds for the machine it was taken on, quiet, and for nothing else: docs/web_page.md says which.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from axe_core_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, sync_playwright

PARTS = ("", "/map", "/speeds", "/compare", "/task", "/downloads", "/conditions", "/columns")
ASKED = "area=back_of_hand"
LOOKS = [(width, scheme) for width in (1280, 390) for scheme in ("light", "dark")]
MOST_ROWS = 1000
"""Rows seen up to which axe looks at a page; a choice: it takes minutes for thousands, all of one kind."""

SETTLED = 10_000
"""How long a page may take until it asks for nothing any more [ms]; a choice."""

OBSERVE = """
window.seen = { shift: 0, text: 0 };
const shifted = (entry) => (seen.shift += entry.hadRecentInput ? 0 : entry.value);
new PerformanceObserver((list) => list.getEntries().forEach(shifted))
  .observe({ type: "layout-shift", buffered: true });
new PerformanceObserver((list) => list.getEntries().forEach((entry) => (seen.text = entry.startTime)))
  .observe({ type: "largest-contentful-paint", buffered: true });
"""
FIGURES = """() => ({
  answer: performance.getEntriesByType("navigation")[0].responseEnd,
  first: performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? null,
  largest: seen.text, shift: seen.shift, wide: document.documentElement.scrollWidth > innerWidth,
})"""


@contextmanager
def serving(folder: str) -> Iterator[tuple[str, str]]:
    """Address and token of a server of a folder."""
    command = [sys.executable, "-m", "forcemap", "serve", folder, "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        address, token = process.stderr.readline().split()[1].split("/?token=")
        try:
            yield address, token
        finally:
            process.kill()


def noted(page: Page) -> list[str]:
    """What a page says on its console, as it comes."""
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    return said


def visit(
    browser: Browser, address: str, token: str, parts: list[str], pictures: Path | None
) -> Iterator[dict[str, Any]]:
    """What every page took, in every look."""
    for width, scheme in LOOKS:
        options: Any = {"viewport": {"width": width, "height": 900}, "color_scheme": scheme, "base_url": address}
        context = browser.new_context(**options)
        context.add_init_script(OBSERVE)
        context.request.get(f"/?token={token}")
        for part in parts:
            page = context.new_page()
            said = noted(page)
            start = time.perf_counter()
            answer = page.goto(f"{part}?{ASKED}")
            page.wait_for_load_state("networkidle", timeout=SETTLED)
            page.wait_for_timeout(400)
            figures = page.evaluate(FIGURES) | {"settled": 1000 * (time.perf_counter() - start) - 900}
            found = Axe().run(page)["violations"] if page.locator("tr:visible").count() < MOST_ROWS else []
            violations = [f"{each['id']} ({len(each['nodes'])}): {each['nodes'][0]['html'][:90]}" for each in found]
            status = answer.status if answer else 0
            yield {
                "page": part,
                "width": width,
                "scheme": scheme,
                "status": status,
                **figures,
                "said": said,
                "axe": violations,
            }
            if pictures:
                name = part.strip("/").replace("/", "-") or "overview"
                page.screenshot(path=pictures / f"{name}-{width}-{scheme}.png", full_page=True)
            page.close()
        context.close()


def pages_of(browser: Browser, address: str, token: str, wanted: list[str] | None) -> tuple[str, list[str]]:
    """What a folder holds, in words, and the addresses of its pages: of several campaigns the first one's."""
    asking = browser.new_context(base_url=address)
    asking.request.get(f"/?token={token}")
    lines = asking.request.get("/api/campaigns").json()["campaigns"]
    first = f"/campaigns/{lines[0]['name']}"
    several = ["/", "/together"] if len(lines) > 1 else []
    words = f"{len(lines)} campaigns" if several else f"{lines[0]['recordings']} recordings"
    asking.close()
    return words, [*several, *(f"{first}{part}" for part in (wanted or PARTS))]


def table(rows: list[dict[str, Any]]) -> str:
    """The slowest of all looks of every page, as a table of the documentation."""
    lines = ["| folder | page | first content [ms] | all there [ms] | layout shift |", "|---|---|---|---|---|"]
    for folder, page in dict.fromkeys((row["folder"], row["page"]) for row in rows):
        of_page = [row for row in rows if (row["folder"], row["page"]) == (folder, page)]
        first, settled = (max(row[key] or 0 for row in of_page) for key in ("first", "settled"))
        whole = "campaign" if page.startswith("/campaigns") else page.strip("/") or "overview"
        name = "/".join(page.split("/")[3:]) or whole
        lines.append(
            f"| {folder} | {name} | {first:.0f} | {settled:.0f} | {max(row['shift'] for row in of_page):.3f} |"
        )
    return "\n".join(lines)


def written(file: Path, text: str) -> None:
    """Put a text between the marks of the documentation."""
    before, start, rest = file.read_text().partition("<!-- times:start -->")
    _, end, after = rest.partition("<!-- times:end -->")
    file.write_text(f"{before}{start}\n\n{text}\n\n{end}{after}")


def main() -> None:
    """Visit the pages and print a line for each."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("folders", nargs="+")
    asked.add_argument("--pages", nargs="*", help="pages to visit, such as /map; all if not given")
    asked.add_argument("--pictures", type=Path, help="folder for a picture of every page")
    asked.add_argument("--docs", type=Path, help="page of the documentation that takes the table")
    stated = asked.parse_args()
    if stated.pictures:
        stated.pictures.mkdir(parents=True, exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    arguments = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    rows = []
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=arguments)
        for folder in stated.folders:
            with serving(folder) as (address, token):
                words, parts = pages_of(browser, address, token, stated.pages)
                for row in visit(browser, address, token, parts, stated.pictures):
                    rows.append(row | {"folder": words})
                    times = [f"{row[key] or 0:6.0f}" for key in ("first", "largest", "settled")]
                    first = f"{times[0]} ms first, {times[1]} largest, {times[2]} all"
                    look = f"{row['width']:4d} {row['scheme']:5s} {row['status']}"
                    wrong = [*row["said"], *row["axe"], *(["wider than the window"] if row["wide"] else [])]
                    said = "; ".join(wrong) or "nothing wrong"
                    print(f"{row['page']:34s} {look} {first}, shift {row['shift']:.3f}; {said}", flush=True)
        browser.close()
    if stated.docs:
        written(stated.docs, table(rows))


if __name__ == "__main__":
    main()
