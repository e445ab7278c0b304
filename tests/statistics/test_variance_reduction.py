import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import pair_correlation, variance_reduction


def test_pairs_correlate_as_much_as_they_share():
    rng = np.random.default_rng(15)
    common, own = rng.normal(size=(2, 100_000)), rng.normal(size=(2, 100_000))
    found = pair_correlation(3 * common[0] + own[0], 3 * common[0] + own[1])
    assert found == pytest.approx(0.9, abs=0.01)
    assert pair_correlation([1, 2, np.nan], [2, 4, 0]) == pytest.approx(1)


def test_no_correlation_where_one_side_never_varies():
    assert math.isnan(pair_correlation([1, 1, 1], [1, 2, 3]))
    assert math.isnan(pair_correlation([1], [2]))


def people(n, shared, rng):
    common, own = rng.lognormal(0, 0.4, n), rng.lognormal(0, 0.3, (2, n))
    other = common if shared else rng.lognormal(0, 0.4, n)
    return 30 * common * own[0], 24 * other * own[1]


def test_correlation_and_ratio_are_those_of_numpy():
    a, b = people(24, True, np.random.default_rng(1))
    found = variance_reduction(a, b, range(24))
    assert found.correlation.mean == pytest.approx(np.corrcoef(a, b)[0, 1])
    assert found.ratio.mean == pytest.approx(np.var(a - b) / (np.var(a) + np.var(b)))


def test_the_interval_of_the_correlation_is_near_fishers_where_persons_are_normal():
    rng = np.random.default_rng(2)
    common, own = rng.normal(size=60), rng.normal(size=(2, 60))
    a, b = common + own[0], common + own[1]
    exact = stats.pearsonr(a, b).confidence_interval(0.95)
    found = variance_reduction(a, b, range(60)).correlation
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high), abs=0.1)


def test_lower_variance_is_claimed_where_persons_are_shared_and_hardly_ever_where_not():
    rng = np.random.default_rng(3)
    pairs = {shared: [people(24, shared, rng) for _ in range(120)] for shared in (True, False)}
    claims = {
        shared: np.mean([variance_reduction(*p, range(24), resamples=200).is_lower for p in own])
        for shared, own in pairs.items()
    }
    assert claims[True] > 0.5
    assert claims[False] <= 0.06


def test_nothing_is_claimed_of_two_persons_or_of_one_treatment_without_spread():
    for a, b, person in (([1, 2], [1, 3], [0, 1]), ([1, 1, 1], [1, 2, 3], [0, 1, 2])):
        found = variance_reduction(a, b, person)
        assert math.isnan(found.ratio.mean)
        assert not found.is_lower


def test_the_same_person_twice_leaves_no_variance_at_all():
    found = variance_reduction([1, 2, 4, 7], [1, 2, 4, 7], range(4))
    assert found.ratio.mean == pytest.approx(0, abs=1e-9)
    assert found.is_lower
