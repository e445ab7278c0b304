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


def drive(page: Page) -> None:
    """Take both robots, one under each pattern, and drive them until the fire is reported."""
    page.get_by_role("button", name="robot-2 beside it").click()
    page.get_by_role("button", name="500 ms").click()
    page.get_by_role("combobox").nth(1).select_option(label="REQ/REP")
    page.get_by_role("button", name="Take control").click()
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("status", name="Mode")).to_contain_text("robot-2 Teleoperation")
    page.keyboard.down("ArrowUp")
    page.wait_for_timeout(9_000)
    page.keyboard.down("ArrowLeft")
    page.wait_for_timeout(1_500)


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
