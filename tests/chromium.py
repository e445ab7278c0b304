"""The system's Chromium; `python tests/chromium.py` says whether there is one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Browser, sync_playwright

NAMES = "chromium", "chromium-browser", "google-chrome"
"""Not its headless shell, which has no sensors of motion."""

NOT_SHOWN = "WebUIOmniboxPopup", "WebUIOmniboxAimPopup"
"""Pages of its own that it keeps ready for an address bar, a second of work for each window."""

MISSING = "tests in a browser need Chromium: apt-get install chromium (make test leaves them out)"


def installed() -> str:
    """Where it is.

    Raises:
        SystemExit: nowhere.
    """
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        raise SystemExit(MISSING)
    return path


@contextmanager
def chromium() -> Iterator[Browser]:
    """It runs, without a screen. No asyncio is possible meanwhile."""
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", f"--disable-features={','.join(NOT_SHOWN)}"]
        browser = playwright.chromium.launch(executable_path=installed(), args=arguments)
        yield browser
        browser.close()


if __name__ == "__main__":
    installed()
