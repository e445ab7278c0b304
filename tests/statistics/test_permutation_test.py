import itertools
import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import permutation_test


def test_three_persons_who_agree_either_way_are_two_of_eight_by_chance():
    assert permutation_test([3, 5, 9], [1, 1, 1], [0, 1, 2]) == pytest.approx(2 / 8)
    assert permutation_test([1, 1, 1], [3, 5, 9], [0, 1, 2]) == pytest.approx(2 / 8)


def test_few_persons_give_the_exact_p_of_scipy():
    rng = np.random.default_rng(1)
    a, b = rng.normal(0.5, 1, (2, 9))
    exact = stats.permutation_test((a, b), lambda x, y: (x - y).mean(), permutation_type="samples")
    assert permutation_test(a, b, range(9)) == pytest.approx(exact.pvalue)


def test_all_trials_of_a_person_flip_together():
    rng = np.random.default_rng(2)
    off = rng.normal(0.6, 1, (7, 1)) + rng.normal(size=(7, 4))
    means = off.mean(axis=1)
    flipped = [abs(np.dot(signs, means)) for signs in itertools.product([1, -1], repeat=7)]
    by_hand = np.mean(np.array(flipped) >= abs(means.sum()) - 1e-9)
    found = permutation_test(off.ravel(), np.zeros(28), np.repeat(range(7), 4))
    assert found == pytest.approx(by_hand)


def test_many_persons_give_a_sample_of_the_flips_near_the_exact_p():
    off = np.random.default_rng(3).normal(0.4, 1, 16)
    signs = 1 - 2 * (np.arange(2**16)[:, None] >> np.arange(16) & 1)
    exact = (abs(signs @ off) >= abs(off.sum()) - 1e-9).mean()
    found = permutation_test(off, np.zeros(16), range(16))
    assert found == pytest.approx(exact, abs=4 * math.sqrt(exact / 10_000))


def test_a_random_p_is_never_zero():
    assert permutation_test(np.ones(30), np.zeros(30), range(30)) == pytest.approx(1 / 10_001)


def test_swapped_labels_alone_are_found_in_one_of_twenty_studies():
    rng = np.random.default_rng(4)
    found = []
    for _ in range(2000):
        a, b = rng.lognormal(0, 1, (2, 8))
        found.append(permutation_test(a, b, range(8)) <= 0.05)
    assert 0.035 <= np.mean(found) <= 0.06


def test_nobody_with_both_runs_gives_nan():
    assert math.isnan(permutation_test([1, np.nan], [np.nan, 2], [0, 1]))
