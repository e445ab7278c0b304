import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import components


def test_a_case_worked_by_hand():
    # means 2, 5, 8 around 5: mean square between 2 x 18 / 2 = 18; within 6 x 1 / 3 = 2
    found = components([[1, 3], [4, 6], [7, 9]])
    assert found.within == pytest.approx(2.0)
    assert found.between == pytest.approx((18 - 2) / 2)
    assert found.share == pytest.approx(0.8)


def test_persons_with_unequal_numbers_of_trials_count_with_what_they_have():
    # 1 and 3, and 6 alone: within 2 / 1; grand mean 10/3; between 2 (4/3)^2 + (8/3)^2 = 32/3;
    # trials per person 3 - 5/3 = 4/3
    found = components([[1, 3], [6, np.nan], [np.nan, np.nan]])
    assert found.within == pytest.approx(2.0)
    assert found.between == pytest.approx((32 / 3 - 2) / (4 / 3))


def test_persons_alike_have_no_variance_between_them_and_never_less():
    assert components([[1, 3], [3, 1]]).between == 0.0


@pytest.mark.parametrize("values", [[[1, 2]], [[1], [2]], [[np.nan, np.nan], [1, 2]]])
def test_too_few_to_split_is_nan(values):
    assert np.isnan(components(values).between)


def test_the_mean_squares_are_those_of_scipys_analysis_of_variance():
    values = np.random.default_rng(2).normal(0, 1, (12, 5)) + np.arange(12)[:, np.newaxis] / 6
    found = components(values)
    f = stats.f_oneway(*values).statistic
    assert found.between / found.within == pytest.approx((f - 1) / 5)
    assert found.within == pytest.approx(values.var(axis=1, ddof=1).mean())
