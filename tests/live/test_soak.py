"""The soak: what is said to grow does, and its program plays a minute."""

import math
import random
import subprocess
import sys

import pytest
from helpers.paths import TESTS
from helpers.soak.slopes import slope

HOURS = [n / 360 for n in range(720)]  # two hours, a sample each ten seconds


def memory(leak: float, seed: int) -> list[float]:
    """Memory [MB] that wanders slowly about 100 MB, and grows by so much in an hour."""
    rng = random.Random(seed)
    wander = 0.0
    values = []
    for at in HOURS:
        wander = 0.95 * wander + rng.gauss(0.0, 0.3)
        values.append(100.0 + wander + leak * at)
    return values


def test_a_leak_is_found_and_a_process_that_wanders_has_none():
    leaks = [slope(HOURS, memory(6.0, seed)) for seed in range(20)]
    assert all(grows.low > 3.0 for grows in leaks)
    still = [slope(HOURS, memory(0.0, seed)) for seed in range(40)]
    assert sum(grows.low <= 0.0 <= grows.high for grows in still) >= 34  # of 40, at 95 %
    assert all(grows.low < 1.0 for grows in still)


def test_of_too_short_a_time_nothing_is_said():
    grows = slope(HOURS[:5], memory(50.0, 1)[:5])
    assert math.isnan(grows.hourly)
    assert (grows.low, grows.high) == (-math.inf, math.inf)


@pytest.mark.soak
def test_a_minute_of_it_ends_well_and_keeps_what_each_process_took(tmp_path):
    command = [sys.executable, str(TESTS / "soak.py"), "--hours", "0.02", "--keep", str(tmp_path)]
    played = subprocess.run(command, capture_output=True, text=True, cwd=TESTS.parent, check=False)
    assert played.returncode == 0, played.stdout + played.stderr
    rows = (tmp_path / "samples.csv").read_text().splitlines()
    for part in ("live dva", "live world", "dva_sim.console.web"):
        assert sum(part in row for row in rows) >= 4
