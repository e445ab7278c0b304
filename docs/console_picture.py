"""Draws `docs/pictures/console.png`: the console while a person drives two robots, 1 s away.

It needs the development environment and Chromium: `.venv/bin/python docs/console_picture.py`.
"""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

PICTURE = Path(__file__).parent / "pictures" / "console.png"
CONSOLE = ["-m", "dva_sim", "console", "hands-on", "--no-open", "--port", "0"]
PATIENCE = 60_000  # [ms]


PLACE = """() => import('/static/js/store.js').then(({tracks, robots}) => {
  const {x, heading} = tracks.last(robots.value[0].i); return [x, heading]; })"""
AHEAD_RAD, DOOR_M, LOOKS_IN_RAD = 0.08, 18.0, 1.0  # along the corridor, to the door, in at it
DRIVES_WITHIN = 120_000  # of which most is a machine that lags [ms]


def begin(page: Page) -> None:
    """Start both robots, if they are not driven: a machine that lags ends each drive."""
    mode = page.get_by_role("status", name="Mode")
    start = page.get_by_role("button", name="Start", exact=True)
    while mode.inner_text().count("Teleoperation") < 2:
        if start.is_enabled() and "Starting" not in page.locator(".hint").inner_text():
            start.click()
        page.wait_for_timeout(1000)


def hold(page: Page, key: str, there: Callable[[float, float], bool]) -> None:
    """Hold a key until robot-1 is there, by its place along the corridor and its heading."""
    ends = time.monotonic() + DRIVES_WITHIN / 1000
    while not there(*page.evaluate(PLACE)):
        if time.monotonic() > ends:
            raise TimeoutError(f"robot-1 has come no further than {page.evaluate(PLACE)}")
        begin(page)
        page.keyboard.down(key)
        page.wait_for_timeout(50)
        if page.locator(".hint").inner_text().startswith(("You hold", "Held")):
            page.keyboard.up(key)  # what was held before a start counts for nothing


def drive(page: Page) -> None:
    """Take both robots, one under each pattern, and go on until one of them looks at the fire."""
    page.get_by_role("button", name="robot-2 beside it").click()
    page.get_by_role("button", name="Take control").click()
    page.keyboard.down("Shift")  # slowly, and before there is a delay
    hold(page, "ArrowRight", lambda _, heading: heading < AHEAD_RAD)
    page.keyboard.up("ArrowRight")
    page.keyboard.up("Shift")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.get_by_role("status", name="Mode")).to_have_text("robot-1 Idle, robot-2 Idle")
    page.get_by_label("Pattern of robot-1").select_option("req-rep")
    page.get_by_role("button", name="1 s", exact=True).click()
    hold(page, "ArrowUp", lambda x, _: x > DOOR_M)
    page.keyboard.up("ArrowUp")
    hold(page, "ArrowLeft", lambda _, heading: heading > LOOKS_IN_RAD)
    page.keyboard.up("ArrowLeft")
    page.wait_for_timeout(2500)  # until it has come to a stand, and is seen to
    page.keyboard.down("ArrowUp")
    page.wait_for_timeout(2500)


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
