"""What holds for all tests: how they are shared between processes, and how many may be skipped."""

import signal

import pytest
from hypothesis import settings
from searching import search
from skips import pytest_sessionfinish

__all__ = ["pytest_sessionfinish"]

DEAR = "live", "system"
"""Folders whose files take long: they come first, so that all processes end at the same time."""

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # As for a command that a script starts with `&`: then nothing that is started here would hear
    # a Ctrl-C either, and tests of it would wait for ever.
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("search", search())
settings.load_profile("search")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: not set(DEAR).intersection(item.path.parts))
