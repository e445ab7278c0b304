"""What holds for all tests: how they are shared between processes, and how many may be skipped."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest
from halves import pytest_addoption, pytest_configure
from hypothesis import settings
from searching import search

__all__ = ["pytest_addoption", "pytest_configure"]

MOST_SKIPPED = 40
"""On Linux; 17 of them without an emulated link. What nobody runs any more proves nothing."""

settings.register_profile("search", search())
settings.load_profile("search")


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> Iterator[None]:
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = len(reporter.stats.get("skipped", [])) if reporter else 0
    if skipped > MOST_SKIPPED and sys.platform == "linux" and exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        reporter.write_line(
            f"\n{skipped} tests were skipped; at most {MOST_SKIPPED} may be.", red=True
        )
    yield
