import math

import numpy as np
import pytest
from scipy import special, stats

from dva_sim.experiments.statistics import effect_size


def test_sizes_are_means_over_spreads_with_hedges_correction():
    a, b = np.array([4.0, 7, 5, 9, 6]), np.array([3.0, 5, 5, 5, 4])
    correction = special.gamma(2) / (math.sqrt(2) * special.gamma(1.5))  # 4 degrees of freedom
    found = effect_size(a, b, range(5))
    assert found.paired.mean == pytest.approx(correction * 1.8 / np.std(a - b, ddof=1))
    average = (np.std(a, ddof=1) + np.std(b, ddof=1)) / 2
    assert found.average.mean == pytest.approx(correction * 1.8 / average)
    assert found.superiority.mean == pytest.approx(0.9)  # four of five, and a tie


def test_hedges_correction_takes_away_the_bias_of_few_persons():
    rng = np.random.default_rng(1)
    sizes = [
        effect_size(x, np.zeros(6), range(6), resamples=2).paired.mean
        for x in rng.normal(0.8, 1, (600, 6))
    ]
    assert np.mean(sizes) == pytest.approx(0.8, abs=0.08)  # 0.95 without it


def test_the_interval_of_the_paired_size_is_near_that_of_the_noncentral_t():
    values = stats.norm.ppf((np.arange(40) + 0.5) / 40) + 0.7
    t = values.mean() / stats.sem(values)
    exact = special.nctdtrinc(39, [0.975, 0.025], t) / math.sqrt(40)
    found = effect_size(values, np.zeros(40), range(40)).paired
    assert (found.low, found.high) == pytest.approx(tuple(exact), abs=0.06)


def test_the_intervals_hold_in_most_of_many_skewed_studies():
    rng = np.random.default_rng(2)
    held = np.zeros(3)
    skill, noise = rng.lognormal(0, 0.4, (200, 24)), rng.lognormal(0, 0.3, (2, 200, 24))
    slow, fast = 30 * skill * noise[0], 24 * skill * noise[1]
    truth = 0.464, 0.418, 0.702  # of 480,000 persons
    for a, b in zip(slow, fast, strict=True):
        found = effect_size(a, b, range(24), resamples=200)
        sizes = found.paired, found.average, found.superiority
        held += [x.low <= true <= x.high for x, true in zip(sizes, truth, strict=True)]
    assert np.all(held / 200 >= 0.90)
    assert np.all(held / 200 <= 0.99)


def test_two_persons_have_a_superiority_but_no_size():
    found = effect_size([1, 2], [0, 1], [0, 1])
    assert math.isnan(found.paired.mean)
    assert found.superiority.mean == 1


def test_a_difference_without_spread_has_no_size():
    found = effect_size([1, 2, 3], [0, 1, 2], [0, 1, 2])
    assert math.isnan(found.paired.mean)
    assert found.average.mean > 0
