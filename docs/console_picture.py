"""Draws `docs/pictures/console.png`: the console while a person drives two robots over 500 ms.

It needs the development environment and Chromium: `.venv/bin/python docs/console_picture.py`.
"""

import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

PICTURE = Path(__file__).parent / "pictures" / "console.png"
CONSOLE = ["-m", "dva_sim", "console", "hands-on", "--no-open", "--port", "0"]
PATIENCE = 60_000  # [ms]


PLACE = """() => import('/static/js/store.js').then(({tracks, robots}) => {
  const {x, heading} = tracks.last(robots.value[0].i); return [x, heading]; })"""
DOOR_M, LOOKS_IN_RAD = 18.4, 1.15  # where robot-1 turns, and how far, to look at the fire


def begin(page: Page) -> None:
    """Start both robots, if they are not driven: a machine that lags ends each drive."""
    mode = page.get_by_role("status", name="Mode")
    start = page.get_by_role("button", name="Start", exact=True)
    while mode.inner_text().count("Teleoperation") < 2:
        if start.is_enabled():
            start.click()
        page.wait_for_timeout(500)


def hold(page: Page, key: str, value: int, most: float) -> None:
    """Hold a key until a number of robot-1's place is large enough."""
    while page.evaluate(PLACE)[value] < most:
        begin(page)
        page.keyboard.down(key)
        page.wait_for_timeout(200)
        if page.locator(".hint").inner_text().startswith(("You hold", "Held")):
            page.keyboard.up(key)  # what was held before a start counts for nothing


def drive(page: Page) -> None:
    """Take both robots, one under each pattern, and go on until one of them looks at the fire."""
    page.get_by_role("button", name="robot-2 beside it").click()
    page.get_by_role("button", name="500 ms").click()
    page.get_by_label("Pattern of robot-1").select_option("req-rep")
    page.get_by_role("button", name="Take control").click()
    hold(page, "ArrowUp", 0, DOOR_M)
    page.keyboard.up("ArrowUp")
    hold(page, "ArrowLeft", 1, LOOKS_IN_RAD)


def main() -> None:
    """Start a console, drive, and keep what is seen."""
    console = subprocess.Popen([sys.executable, *CONSOLE], stdout=subprocess.PIPE, text=True)
    assert console.stdout is not None
    address = console.stdout.readline().split()[-1]
    try:
        with sync_playwright() as playwright:
            chromium = shutil.which("chromium")
            browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.set_default_timeout(PATIENCE)
            expect.set_options(timeout=PATIENCE)
            page.goto(f"{address}#/drive")
            drive(page)
            page.screenshot(path=PICTURE)
            browser.close()
    finally:
        console.terminate()
        console.wait()


if __name__ == "__main__":
    main()
