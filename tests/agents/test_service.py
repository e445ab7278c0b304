"""Processing times of a robot's computer: laws with their mean and spread, and a cold start."""

import itertools
from typing import Any

import numpy as np
import pytest

from dva_sim.agents.robot.command_queue import ServiceLaw, mean_of, service_times


def draws(count: int = 40_000, **law: Any) -> np.ndarray:
    times = service_times(ServiceLaw(**law), np.random.default_rng(1))
    return np.array([times() for _ in range(count)])


@pytest.mark.parametrize(
    ("law", "cv"),
    [
        ({"law": "constant", "mean_s": 0.2}, 0.0),
        ({"law": "exponential", "mean_s": 0.2}, 1.0),
        ({"law": "lognormal", "mean_s": 0.2, "cv": 0.5}, 0.5),
        ({"law": "gamma", "mean_s": 0.2, "cv": 2.0}, 2.0),
    ],
)
def test_a_law_has_the_mean_and_the_spread_that_it_names(law, cv):
    times = draws(**law)
    assert times.min() >= 0.0
    assert times.mean() == pytest.approx(0.2, rel=0.03)
    assert times.std() == pytest.approx(0.2 * cv, rel=0.06)


def test_a_cold_start_makes_the_first_message_take_longer_and_only_that():
    times = draws(4, law="constant", mean_s=0.2, first_s=3.0)
    assert times.tolist() == [3.0, 0.2, 0.2, 0.2]


def test_a_number_is_always_the_same():
    times = service_times(0.05, np.random.default_rng(1))
    assert [times(), times()] == [0.05, 0.05]
    assert mean_of(0.05) == 0.05


def test_robots_draw_their_own_times_the_same_for_the_same_seed():
    law = ServiceLaw(law="gamma", mean_s=0.2, cv=0.5)
    first, again, other = (
        list(itertools.islice(iter(service_times(law, np.random.default_rng(seed)), None), 5))
        for seed in (1, 1, 2)
    )
    assert first == again != other
