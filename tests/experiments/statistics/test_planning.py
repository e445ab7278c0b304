import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.experiments.statistics import mean_interval, needed_persons, power

PILOT = np.array([-1.5, 0.5, 1.0])  # variance 1.75


def by_brute_force(spread, half_width):
    n = np.arange(2, 10_000)
    return n[stats.t.isf(0.025, n - 1) * spread / np.sqrt(n) <= half_width][0]


@pytest.mark.parametrize("half_width", [4.0, 1.0, 0.5, 0.1])
def test_the_number_is_the_first_whose_student_interval_is_narrow_enough(half_width):
    expected = by_brute_force(math.sqrt(1.75), half_width)
    assert needed_persons(PILOT, [0, 1, 2], half_width) == expected


def test_studies_of_that_size_are_as_narrow_as_wanted_on_the_average():
    rng = np.random.default_rng(1)
    n = needed_persons(rng.normal(0, 3, 4000), range(4000), half_width=1.0)
    widths = [mean_interval(x, range(n)).half_width for x in rng.normal(0, 3, (200, n))]
    assert n == 38
    assert np.mean(widths) == pytest.approx(1.0, abs=0.05)


def test_more_trials_save_persons_only_as_far_as_a_persons_own_luck_goes():
    rng = np.random.default_rng(2)
    values = rng.normal(0, 3, (2000, 1)) + rng.normal(0, 2, (2000, 5))
    person = np.repeat(np.arange(2000), 5)
    found = [needed_persons(values.ravel(), person, 1.0, trials=k) for k in (1, 5, 1000)]
    for n, spread in zip(found, (math.sqrt(9 + 4), math.sqrt(9 + 4 / 5), 3), strict=True):
        assert n == pytest.approx(by_brute_force(spread, 1.0), rel=0.08)
    assert needed_persons(values.ravel(), person, 1.0) == pytest.approx(found[1], rel=0.02)


def test_the_power_is_that_of_the_noncentral_t():
    shift = 1.0 / math.sqrt(1.75) * math.sqrt(10)
    t = stats.t.isf(0.025, 9)
    exact = stats.nct.sf(t, 9, shift) + stats.nct.cdf(-t, 9, shift)
    assert power(PILOT, [0, 1, 2], effect=1.0, persons=10) == pytest.approx(exact)
    assert power(PILOT, [0, 1, 2], effect=-1.0, persons=10) == pytest.approx(exact)
    assert power(PILOT, [0, 1, 2], effect=0.0, persons=10) == pytest.approx(0.05)


def test_that_share_of_studies_tells_the_effect_from_zero():
    rng = np.random.default_rng(3)
    told = [mean_interval(x, range(24)).low > 0 for x in rng.normal(0.6, 1, (400, 24))]
    expected = power(rng.normal(0, 1, 5000), range(5000), effect=0.6, persons=24)
    assert expected == pytest.approx(0.80, abs=0.02)
    assert np.mean(told) == pytest.approx(expected, abs=0.06)


def test_persons_who_are_all_alike_need_two_and_tell_everything():
    assert needed_persons([1.0, 1.0], [0, 1], 0.1) == 2
    assert power([1.0, 1.0], [0, 1], effect=0.1, persons=2) == 1


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: needed_persons([1, 2], [0, 1], 0), "above zero, not 0"),
        (lambda: needed_persons([1, 2], [0, 0], 1), "a pilot of at least two"),
        (lambda: needed_persons([1, 2], [0, 1], 1, trials=3), "at least two for a person"),
        (lambda: needed_persons([1, 2], [0, 1], 1e-6), "more than 1000000 persons"),
        (lambda: power([1, 2], [0, 1], 1, persons=1), "at least 2 persons, not 1"),
    ],
)
def test_what_a_pilot_cannot_tell_is_said(ask, message):
    with pytest.raises(ValueError, match=message):
        ask()
