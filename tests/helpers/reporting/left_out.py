"""Summary of the tests left out, how to run them, and a limit on skipped ones."""

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import pytest

MOST_SKIPPED = 40
"""On Linux, where all is installed; 29 of them without an emulated link."""

VERB = {"browser": "make test-browser", "soak": "make test-long", "system": "make test-system"}


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(LeftOut())


class LeftOut:
    """Counts tests that were not chosen; processes that share them tell the one that reports."""

    def __init__(self) -> None:
        self._number: Counter[str] = Counter()

    def pytest_deselected(self, items: Sequence[pytest.Item]) -> None:
        for item in items:
            self._number.update([m for m in VERB if item.get_closest_marker(m)][:1])

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workeroutput"):
            session.config.workeroutput["left_out"] = dict(self._number)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        self._number |= Counter(getattr(node, "workeroutput", {}).get("left_out", {}))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        for marker, number in self._number.items():
            terminalreporter.write_line(f"Left out: {number} marked {marker} ({VERB[marker]})")


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> Iterator[None]:
    """Fail a run in which too many were skipped, and say so: what nobody runs proves nothing."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = len(reporter.stats.get("skipped", [])) if reporter else 0
    if skipped > MOST_SKIPPED and sys.platform == "linux" and exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        text = f"\n{skipped} tests were skipped; at most {MOST_SKIPPED} may be."
        reporter.write_line(text, red=True)
    yield
