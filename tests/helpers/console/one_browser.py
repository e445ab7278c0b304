"""The one browser of a process of tests: Playwright lets no second one begin beside it."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.fixture(scope="session", name="browser")  # while it runs, no other test has asyncio
def _browser() -> "Iterator[Browser]":
    """Start the system's own, for all files of a process."""
    from helpers.console.chromium import chromium

    with chromium() as browser:
        yield browser
