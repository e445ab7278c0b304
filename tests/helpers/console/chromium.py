"""The system's Chromium; `python tests/helpers/console/chromium.py` says whether there is one."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Browser, sync_playwright

NAMES = "chromium", "chromium-browser", "google-chrome"
"""Not its headless shell, which has no sensors of motion."""

ADDRESS_BAR = "WebUIOmniboxPopup", "WebUIOmniboxAimPopup"
"""Pages of its own that it keeps ready for it: a second of work for each window."""

ASK_THE_NETWORK = (
    "HttpsUpgrades",
    "MediaRouter",
    "NetworkTimeServiceQuerying",
    "OptimizationHints",
    "PreconnectToSearch",
)
"""Playwright switches them off, too; but our list takes the place of its own."""

MISSING = "tests in a browser need Chromium: make tools (make test leaves them out)"


def installed() -> str:
    """Path of the browser.

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
        off = ",".join((*ADDRESS_BAR, *ASK_THE_NETWORK))
        arguments = ["--no-sandbox", "--disable-gpu", f"--disable-features={off}"]
        browser = playwright.chromium.launch(executable_path=installed(), args=arguments)
        yield browser
        browser.close()


if __name__ == "__main__":
    installed()
