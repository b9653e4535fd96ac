"""Take the pictures of the page and of the report that README and tutorial show, of the demo's campaign, in a browser.

Run from the root of the project, with the packages of the extra test and a Chromium; it takes half a minute.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

from forcemap.files import write_atomically

SCREENS = Path("docs/pictures/screens")
LARGEST = 250_000  # bytes of one picture
PAGE, REPORT = (1280, 800), (900, 1000)  # what is seen of each, width and height
SETTLED = 15_000  # until nothing on the page is drawn any more [ms]
FORCEMAP = [sys.executable, "-c", "from forcemap.cli import main; main()"]


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of the page of a campaign, with its token."""
    process = subprocess.Popen([*FORCEMAP, "serve", str(folder), "--port", "0"], stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        yield process.stderr.readline().split()[1]
    finally:
        process.kill()
        process.wait()


def taken(browser: Browser, address: str, *, seen: tuple[int, int]) -> bytes:
    """The picture of a page once it has settled."""
    page = browser.new_page(viewport={"width": seen[0], "height": seen[1]})
    page.goto(address, wait_until="networkidle")
    page.wait_for_timeout(SETTLED)
    return page.screenshot()


def main() -> None:
    """Take both pictures."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    root = ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)
    SCREENS.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as home, sync_playwright() as started:
        folder = Path(home, "forcemap-demo")
        subprocess.run([*FORCEMAP, "demo", str(folder)], check=True, stdout=subprocess.DEVNULL)
        browser = started.chromium.launch(executable_path=chromium, args=root)
        with served(folder) as address:
            pictures = {"page": taken(browser, f"{address}&area=back_of_hand", seen=PAGE)}
        pictures["report"] = taken(browser, (folder / "report.html").as_uri(), seen=REPORT)
        browser.close()
    for name, picture in pictures.items():
        if len(picture) > LARGEST:
            raise SystemExit(f"{name}.png: found {len(picture)} bytes, expected at most {LARGEST}")
        write_atomically(SCREENS / f"{name}.png", picture)
        print(f"{SCREENS / name}.png: {len(picture) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
