"""What holds for all tests: how they are shared between processes, and how many may be skipped."""

import signal

from halves import pytest_addoption, pytest_configure
from helpers.processes.search_settings import search
from hypothesis import settings
from skips import pytest_sessionfinish

__all__ = ["pytest_addoption", "pytest_configure", "pytest_sessionfinish"]

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # As for a command that a script starts with `&`: then nothing that is started here would hear
    # a Ctrl-C either, and tests of it would wait for ever.
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("search", search())
settings.load_profile("search")
