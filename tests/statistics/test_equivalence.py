import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import equivalence, one_sided_test, paired_difference


def test_five_persons_give_the_two_t_tests_of_scipy():
    off = np.array([0.1, -0.2, 0.05, 0.3, -0.1])
    above = stats.ttest_1samp(off, -0.5, alternative="greater").pvalue
    below = stats.ttest_1samp(off, 0.5, alternative="less").pvalue
    found = equivalence(off, np.zeros(5), range(5), margin=0.5)
    assert found == pytest.approx(max(above, below))
    assert found < 0.05 < equivalence(off, np.zeros(5), range(5), margin=0.1)


@pytest.mark.parametrize("margin", [0.2, 0.3, 0.4, 0.5])
def test_it_is_equivalent_where_the_interval_of_90_percent_lies_within_the_margin(margin):
    rng = np.random.default_rng(1)
    a, b = rng.gamma(1, 0.5, (2, 24))
    difference = paired_difference(a, b, range(24), level=0.9)
    inside = -margin < difference.low and difference.high < margin
    assert (equivalence(a, b, range(24), margin) < 0.05) == inside


@pytest.mark.parametrize("true", [0.5, -0.5])
def test_at_the_edge_of_the_margin_it_errs_in_at_most_one_of_twenty_studies(true):
    rng = np.random.default_rng(2)
    shape = (2 / 1.1) ** 2  # skewness 1.1
    errors = 0
    for _ in range(600):
        off = 0.5 * (rng.gamma(shape, 1, 24) - shape) / math.sqrt(shape) + true
        errors += equivalence(off, np.zeros(24), range(24), margin=0.5) < 0.05
    assert 0.01 <= errors / 600 <= 0.06


def test_persons_who_do_not_differ_are_equivalent_beyond_doubt():
    assert equivalence([1, 2, 3], [1, 2, 3], range(3), margin=0.1) == 0
    assert equivalence([2, 3, 4], [1, 2, 3], range(3), margin=0.5) == 1


def test_one_person_proves_nothing():
    assert math.isnan(equivalence([1], [1], [0], margin=1))


def test_a_one_sided_p_is_below_a_fortieth_where_the_interval_lies_beyond_the_bound():
    rng = np.random.default_rng(3)
    off = rng.gamma(1, 1, 24)
    found = paired_difference(off, np.zeros(24), range(24))
    for bound in np.linspace(found.low - 0.1, found.low + 0.1, 9):
        p = one_sided_test(off, np.zeros(24), range(24), bound, "above")
        assert (p < 0.025) == (found.low > bound)
        assert one_sided_test(-off, np.zeros(24), range(24), -bound, "below") == p
