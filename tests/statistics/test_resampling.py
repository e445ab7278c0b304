import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import bootstrap_interval
from dva_sim.statistics.persons import draws, tails


def test_the_tails_are_as_wide_as_makes_a_normal_mean_students():
    """The draws' spread is sqrt(23/24) of the standard error."""
    z = stats.norm.ppf(tails(0.95, 24))
    t = stats.t.isf(0.025, 23)
    assert z * math.sqrt(23 / 24) == pytest.approx([-t, t])


def test_its_ends_are_those_of_scipy_from_the_same_draws_so_far_out_as_few_persons_need():
    values = np.random.default_rng(5).gamma(0.3, 1, 24)
    drawn = draws(24, 1, 4000) @ values / 24
    exact = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=0,
        bootstrap_result=SimpleNamespace(bootstrap_distribution=drawn),
        confidence_level=1 - 2 * tails(0.95, 24)[0],
        method="BCa",
    ).confidence_interval
    found = bootstrap_interval(values, range(24), np.mean)
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high))


def test_persons_are_drawn_with_all_their_trials():
    means = np.random.default_rng(3).normal(size=20)
    alone = bootstrap_interval(means, range(20), np.mean)
    again = bootstrap_interval(np.repeat(means, 10), np.repeat(range(20), 10), np.mean)
    assert (again.low, again.high) == pytest.approx((alone.low, alone.high))
    assert again.n_persons == 20


def test_a_ratio_of_two_columns_is_covered_nineteen_times_in_twenty():
    rng = np.random.default_rng(4)
    held = []
    for _ in range(150):
        skill = rng.gamma(4, 1, (24, 1))
        runs = np.stack([skill * rng.gamma(4, 0.5, (24, 5)), skill * rng.gamma(4, 0.25, (24, 5))])
        rows = runs.reshape(2, -1).T
        found = bootstrap_interval(
            rows, np.repeat(range(24), 5), lambda x: x[:, 0].sum() / x[:, 1].sum(), resamples=300
        )
        held.append(found.low <= 2 <= found.high)
    assert 0.90 <= np.mean(held) <= 0.985


def test_a_run_with_a_missing_value_is_left_out():
    rows = [[1, 2], [np.nan, 3], [3, 6], [4, 8]]
    found = bootstrap_interval(rows, [0, 0, 1, 2], lambda x: x.sum())
    assert found.mean == 24


def test_nobody_and_one_person_have_no_interval():
    assert math.isnan(bootstrap_interval([np.nan], [0], np.mean).mean)
    found = bootstrap_interval([1, 3], [0, 0], np.mean)
    assert found.mean == 2
    assert math.isnan(found.low)
