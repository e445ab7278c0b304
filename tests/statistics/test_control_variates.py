"""Differences adjusted for what is known beforehand, and how much narrower that makes intervals."""

import numpy as np
import pytest

from dva_sim.statistics import adjusted, band, off_zero
from dva_sim.statistics.control_variates import MIN_EACH


def persons(n, seed=1):
    """Differences of 8 s that a covariate of mean zero explains in part `(n, 1)`, `(1, n, 1)`."""
    rng = np.random.default_rng(seed)
    known = rng.normal(size=n)
    return (8 + 3 * known + rng.normal(size=n))[:, np.newaxis], known[np.newaxis, :, np.newaxis]


def constant(values, known):
    """Intercept of a straight line through the points."""
    return np.polyfit(known, values, 1)[1]


def test_a_pseudo_value_is_what_leaving_that_person_out_changes():
    values, known = persons(20)
    y, x = values[:, 0], known[0, :, 0]
    whole = constant(y, x)
    left_out = np.array([constant(np.delete(y, i), np.delete(x, i)) for i in range(20)])
    assert adjusted(values, known)[:, 0] == pytest.approx(20 * whole - 19 * left_out)


def test_what_the_sample_has_too_much_of_is_taken_off():
    values, known = persons(200)
    assert abs(values.mean() - 8) > 0.1  # this sample's persons are off the average
    assert adjusted(values, known).mean() == pytest.approx(8, abs=0.1)


def test_a_covariate_that_explains_nine_tenths_makes_intervals_a_third_as_long():
    values, known = persons(400)
    plain, ours = band(values), band(adjusted(values, known))
    ratio = (ours.pointwise_high - ours.pointwise_low) / (
        plain.pointwise_high - plain.pointwise_low
    )
    assert ratio[0] == pytest.approx(np.sqrt(0.1), abs=0.04)


def test_a_covariate_of_nothing_makes_intervals_hardly_longer():
    values, _ = persons(100)
    known = np.random.default_rng(2).normal(size=(1, 100, 1))
    plain, ours = band(values), band(adjusted(values, known))
    assert (ours.high - ours.low)[0] < 1.1 * (plain.high - plain.low)[0]


def test_with_too_few_persons_nothing_is_learned():
    values, known = persons(2 * MIN_EACH - 1)
    assert np.array_equal(adjusted(values, known), values)
    values, known = persons(2 * MIN_EACH)
    assert not np.array_equal(adjusted(values, known), values)


def test_who_is_missing_at_one_level_counts_at_the_other():
    values, known = (np.repeat(x, 2, axis=-1) for x in persons(30))
    values[4, 1] = np.nan
    found = adjusted(values, known)
    assert np.isnan(found[4]).tolist() == [False, True]
    alone = adjusted(np.delete(values, 4, axis=0), np.delete(known, 4, axis=1))
    assert np.delete(found[:, 1], 4) == pytest.approx(alone[:, 1])


def test_a_covariate_given_twice_counts_once():
    values, known = persons(40)
    assert adjusted(values, np.repeat(known, 2, axis=0)) == pytest.approx(adjusted(values, known))


def test_no_covariate_and_one_that_describes_a_single_person_leave_all_as_it_is():
    values, _ = persons(30)
    alone = np.zeros((1, 30, 1))
    alone[0, 3, 0] = 1.0
    for known in (alone, np.empty((0, 30, 1))):
        assert np.array_equal(adjusted(values, known), values)


def test_how_far_a_mean_is_off_zero_is_counted_in_standard_errors():
    assert off_zero([1.0, 3.0, np.nan]) == pytest.approx(2.0)
    assert off_zero([0.0, 0.0]) == 0.0
    assert off_zero([2.0, 2.0]) == np.inf
