"""Estimates with control variates: no bias, honest errors, and verdicts by the stated rule."""

import math

import numpy as np
import pytest

from dva_sim.validation.dispatch.estimation import (
    Estimate,
    adjusted,
    estimate,
    expected_alarms,
    verdict,
)


def some_batches(seed, n=100):
    """Batches whose mean is 2, and two controls of which the first explains much of it."""
    rng = np.random.default_rng(seed)
    controls = rng.normal(size=(n, 2))
    values = 2 + 3 * controls[:, 0] + 0.5 * controls[:, 0] ** 2 - 0.5 + rng.normal(size=n)
    return values, controls


def test_a_mean_has_the_standard_error_of_its_batches():
    found = estimate(np.array([1.0, 2.0, 3.0, 6.0]), np.ones(4))
    assert found.value == found.plain == 3.0
    assert found.error == pytest.approx(math.sqrt(14 / 3 / 4))
    assert found.batches == 4


def test_a_ratio_weighs_batches_by_their_customers():
    found = estimate(np.array([10.0, 90.0]), np.array([10.0, 30.0]))
    assert found.value == 2.5


def test_batches_in_a_fixed_proportion_have_no_error():
    counts = np.array([3.0, 7.0, 5.0])
    assert estimate(2 * counts, counts) == Estimate(2.0, 0.0, 2.0, 0.0, 3)


def test_controls_make_the_error_a_third():
    values, controls = some_batches(seed=1)
    found = estimate(values, np.ones(100), controls)
    assert found.error < 0.45 * found.plain_error
    assert abs(found.value - 2) < 3 * found.error


def test_estimates_with_controls_have_no_bias_and_their_errors_cover():
    found = [estimate(v, np.ones(100), c) for v, c in map(some_batches, range(400))]
    off = np.array([(f.value - 2) / f.error for f in found])
    assert abs(np.mean([f.value for f in found]) - 2) < 3 * np.std([f.value for f in found]) / 20
    assert 0.93 < np.mean(abs(off) < 1.96) < 0.97
    assert np.mean(abs(off) < 3) > 0.993
    assert 0.9 < off.std() < 1.1


def test_few_batches_with_skewed_values_still_have_no_bias():
    """Weights fitted to the same batches would make it 16 % too low here."""
    rng = np.random.default_rng(3)
    found = []
    for _ in range(600):
        control = rng.exponential(size=(20, 1)) - 1
        values = control[:, 0] ** 2  # mean 1
        found.append(estimate(values, np.ones(20), control).value)
    assert abs(np.mean(found) - 1) < 3 * np.std(found) / math.sqrt(len(found))


def test_ratios_with_controls_cover_too():
    rng = np.random.default_rng(4)
    inside = 0
    for _ in range(500):
        customers = rng.poisson(50, size=80).astype(float)
        chance = rng.normal(size=80)
        waits = customers * (4 + 0.5 * chance) + rng.normal(size=80)
        found = estimate(waits, customers, np.column_stack([customers - 50, chance]))
        inside += abs(found.value - 4) < 1.96 * found.error
    assert 0.92 < inside / 500 < 0.98


def test_a_wrong_value_stays_wrong_whatever_the_controls():
    values, controls = some_batches(seed=2)
    right = estimate(values, np.ones(100), controls)
    wrong = estimate(values + 0.7, np.ones(100), controls)
    assert wrong.value - right.value == pytest.approx(0.7)
    assert verdict(right, 2.0) != "misses"
    assert verdict(wrong, 2.0) == "misses"


def test_controls_that_do_not_vary_or_that_there_are_too_few_batches_for_are_left_out():
    values = np.arange(4.0)
    assert adjusted(values, np.zeros((4, 1))) is values
    assert adjusted(values, np.random.default_rng(1).normal(size=(4, 3))) is values


def an_estimate(value, error, plain=None, plain_error=None, batches=100):
    """Estimate on which control variates had no effect by default."""
    plain, plain_error = plain or value, plain_error or error
    return Estimate(value, error, plain, plain_error, batches)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (an_estimate(1.02, 0.008), "holds"),  # 2.5 standard errors
        (an_estimate(1.004, 0.0001), "holds"),  # many standard errors, but within 0.5 %
        (an_estimate(1.006, 0.0001), "misses"),
        (an_estimate(1.03, 0.009), "misses"),
        (an_estimate(1.02, 0.011), "too rough"),
        (an_estimate(1.06, 0.011), "misses"),
        (an_estimate(math.nan, math.nan), "misses"),
        (an_estimate(1.0, 0.001, 0.8, 0.1), "holds"),
        (an_estimate(1.0, 0.001, 0.8, 0.06), "misses"),  # what only the controls make right
    ],
)
def test_an_estimate_of_1_agrees_within_3_errors_or_half_a_percent(found, expected):
    assert verdict(found, 1.0) == expected


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (an_estimate(1.2, 0.1), "holds"),
        (an_estimate(1.4, 0.1), "misses"),
        # With 10 batches 4.09 standard errors are as rare as 3 are with many.
        (an_estimate(1.4, 0.1, batches=10), "holds"),
        (an_estimate(1.42, 0.1, batches=10), "misses"),
    ],
)
def test_where_no_precision_is_asked_for_a_rough_estimate_agrees(found, expected):
    assert verdict(found, 1.0, precision=None) == expected


def test_where_nothing_is_left_to_chance_only_rounding_is_forgiven():
    assert verdict(Estimate(1e-12, 0.0, 0.0, 0.0, 10), 0.0) == "holds"
    assert verdict(Estimate(1e-6, 0.0, 0.0, 0.0, 10), 0.0) == "misses"


def test_of_370_right_checks_two_at_most_differ_on_average():
    assert expected_alarms(370) == pytest.approx(2.0, abs=0.02)
