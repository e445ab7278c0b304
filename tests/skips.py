"""How many tests may be skipped: what nobody runs any more proves nothing."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

MOST_SKIPPED = 40
"""On Linux, where all is installed; 17 of them without an emulated link, 4 without ../shared."""


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> Iterator[None]:
    """A run with more of them has failed, and says so."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = len(reporter.stats.get("skipped", [])) if reporter else 0
    if skipped > MOST_SKIPPED and sys.platform == "linux" and exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        told = f"\n{skipped} tests were skipped; at most {MOST_SKIPPED} may be."
        reporter.write_line(told, red=True)
    yield
