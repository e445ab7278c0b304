"""Whatever happens in whatever order: no rule is broken, nothing is forgotten, all recovers."""

from pathlib import Path

import pytest
from helpers.dva.random_days import POLICY_NAMES, Walk

# A walk of 400 steps finds what one of 100 does not: orders that come to nothing time and again.
SHORT, LONG = 100, 400


def walk(seed: int, folder: Path, steps: int, policy: str | None = None) -> None:
    day = Walk(seed, folder, policy)
    for _ in range(steps):
        day.step()
    day.recover()
    day.memory.close()


@pytest.mark.invariant("S6")
@pytest.mark.parametrize("policy", POLICY_NAMES)
def test_a_day_that_goes_wrong_breaks_no_rule_and_ends_well(policy, tmp_path):
    for seed in range(3):
        walk(seed, tmp_path, SHORT, policy)


@pytest.mark.soak
@pytest.mark.parametrize("policy", POLICY_NAMES)
def test_long_days_that_go_wrong(policy, tmp_path):
    for seed in range(100, 115):
        walk(seed, tmp_path, LONG, policy)
