"""Means under loss: a right model passes about as often as it should, a wrong one does not."""

import numpy as np
import pytest

from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network import pooling
from dva_sim.validation.network.pooling import (
    is_steady,
    pool,
    score,
    standard_error,
    tells,
    to_be_pooled,
)
from dva_sim.validation.network.reference import SocketRun
from dva_sim.validation.network.verdicts import BY_NAME, ComparedCell, ConditionGroup

RNG = np.random.default_rng


def cell(measured, predicted, name="age_p50", delay_ms=50.0):
    condition = Condition("pub", 10, loss=0.05, delay_ms=delay_ms)
    values = {"emu_late_p99_ms": 0.2}
    runs = [SocketRun(condition, "own", "lossy", seed, True, True, values) for seed in range(6)]
    group = ConditionGroup(condition, "pooled", tuple(runs))
    return ComparedCell(group, BY_NAME[name], np.asarray(measured), np.asarray(predicted))


def cells(factor, seed):
    """40 conditions of skewed ages, of which the model has everything times a factor."""
    rng = RNG(seed)
    real = [100 * rng.lognormal(0, 0.2, 6) for _ in range(40)]
    model = [factor * 100 * rng.lognormal(0, 0.2, 200) for _ in range(40)]
    return [cell(*pair, delay_ms=n) for n, pair in enumerate(zip(real, model, strict=True))]


def test_z_is_the_difference_over_the_spread_scaled_to_both_numbers_of_runs():
    model = np.tile([90.0, 110.0], 100)
    pooled = cell([120.0] * 6, model)
    scored = score(pooled, standard_error(pooled))
    spread = model.std(ddof=1) * np.sqrt(1 / 6 + 1 / 200)
    assert scored.z == pytest.approx(-20 / np.hypot(spread, 0.5))


def test_a_right_model_passes_and_one_that_is_a_quarter_off_does_not(monkeypatch):
    monkeypatch.setattr(pooling, "DRAWS", 150)
    passed = [pool(cells(1.0, seed), RNG(0)).passes for seed in range(8)]
    assert sum(passed) >= 5
    assert not any(pool(cells(1.25, seed), RNG(0)).passes for seed in range(3))


def test_a_model_that_is_a_little_off_everywhere_is_biased():
    assert pool(cells(1.1, 1), RNG(0)).biased == [BY_NAME["age_p50"]]


def test_something_is_significant_in_about_one_of_twenty_right_comparisons():
    assert 0.01 < pool(cells(1.0, 3), RNG(0)).false_alarms < 0.15


def test_where_runs_hardly_differ_means_are_not_pooled():
    steady = cell([100.3] * 6, np.full(200, 100.0))
    assert is_steady(steady)
    assert to_be_pooled([steady]) == []


def test_rare_events_tell_nothing():
    """One alert in six runs against one in two hundred."""
    assert not tells(cell([1, 0, 0, 0, 0, 0], [1] + [0] * 199, "alerts"))
    assert tells(cell([1, 1, 1, 1, 1, 1], [1] * 200, "alerts"))
