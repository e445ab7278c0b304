"""Trials of what users bring are shorter in a quick run: fewer looks, drives and ages."""

import pytest
from helpers.processes.search_settings import LONGER

from dva_sim.testing import hazards, operators, policies, robots

FEWER = {
    hazards: {"AGES": (0.5, 7.0, 60.0, 200.0, 601.0)},
    operators: {"LOOKS": 100, "ROUTES": {"a double bend": operators.ROUTES["a double bend"]}},
    policies: {"_LARGEST": policies._Draw((200, 200), (50, 50), (50, 50), (20, 20), cut_off=0.05)},
    robots: {"DRIVES": 6, "COMMANDS": 12, "APPROACHES": 8, "HOSTILE": robots.HOSTILE[::2]},
}


@pytest.fixture
def fewer(monkeypatch):
    """Reduce the number of tries, except in `make test-soak`."""
    for module, numbers in FEWER.items() if LONGER == 1 else ():
        for name, number in numbers.items():
            monkeypatch.setattr(module, name, number)
