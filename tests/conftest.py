"""What holds for all tests: how they are shared between processes, and how many may be skipped."""

from __future__ import annotations

from pathlib import Path

import pytest
from halves import Helper, Leader
from hypothesis import settings
from searching import search

MOST_SKIPPED = 20

settings.register_profile("search", search())
settings.load_profile("search")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--halves", action="store_true", help="Share the tests with a second process.")
    parser.addoption("--half-of", type=Path, help="This is the second process, and they meet here.")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    if config.option.half_of:
        config.workerinput = {}  # as pytest calls it: who leads writes what is kept of a run
        config.pluginmanager.register(Helper(config, config.option.half_of))
    elif config.option.halves and not config.option.collectonly:
        config.pluginmanager.register(Leader(config))
