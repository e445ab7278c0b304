import math

import numpy as np
import pytest
from scipy import special, stats

from dva_sim.statistics import effect_size
from dva_sim.statistics.persons import draws


def test_sizes_are_means_over_spreads_with_hedges_correction():
    a, b = np.array([4.0, 7, 5, 9, 6]), np.array([3.0, 5, 5, 5, 4])
    correction = special.gamma(2) / (math.sqrt(2) * special.gamma(1.5))  # 4 degrees of freedom
    found = effect_size(a, b, range(5))
    assert found.paired.mean == pytest.approx(correction * 1.8 / np.std(a - b, ddof=1))
    average = (np.std(a, ddof=1) + np.std(b, ddof=1)) / 2
    assert found.average.mean == pytest.approx(correction * 1.8 / average)


def test_the_interval_of_the_paired_size_is_near_that_of_the_noncentral_t():
    values = stats.norm.ppf((np.arange(40) + 0.5) / 40) + 0.7
    t = values.mean() / stats.sem(values)
    exact = special.nctdtrinc(39, [0.975, 0.025], t) / math.sqrt(40)
    found = effect_size(values, np.zeros(40), range(40)).paired
    assert (found.low, found.high) == pytest.approx(tuple(exact), abs=0.06)


def test_the_interval_of_the_average_size_is_a_bootstrap_t_written_out():
    rng = np.random.default_rng(4)
    a, b = rng.lognormal(0, 1.2, (2, 12))

    def size(x, y):
        return (x - y).mean() / (np.std(x, ddof=1) + np.std(y, ddof=1)) * 2

    def with_error(rows):
        left_out = [size(*np.delete(rows, i, axis=1)) for i in range(12)]
        return size(*rows), math.sqrt(11 * np.var(left_out))

    estimate, error = with_error(np.stack([a, b]))
    counts = draws(12, 200).astype(int)
    drawn = [with_error(np.repeat(np.stack([a, b]), own, axis=1)) for own in counts]
    ratios = np.sort([(size - estimate) / max(spread, error / 4) for size, spread in drawn])
    least = max(stats.t.isf(0.025, 11), np.sort(abs(ratios))[189])
    ends = -max(least, ratios[194]), max(least, -ratios[5])
    assert abs(ends[0] + ends[1]) > 0.1
    found = effect_size(a, b, range(12), resamples=200).average
    unit = found.mean / estimate * error
    assert found.mean == pytest.approx((1 - 3 / (4 * 11 - 1)) * estimate, rel=1e-3)
    assert (found.low, found.high) == pytest.approx([found.mean + unit * end for end in ends])


def test_two_persons_and_a_difference_without_spread_have_no_size():
    assert math.isnan(effect_size([1, 2], [0, 1], [0, 1]).paired.mean)
    found = effect_size([1, 2, 3], [0, 1, 2], [0, 1, 2])
    assert math.isnan(found.paired.mean)
    assert found.average.mean > 0
