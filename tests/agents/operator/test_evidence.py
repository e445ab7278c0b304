"""Decision times of a person, against closed forms for a sum of evidence.

A sum that is never below nothing, with drift m and variance 1 a second, reaches the level a after
    m > 0: a/m - (1 - exp(-2 m a)) / (2 m^2)
    m < 0: (exp(2 |m| a) - 1 - 2 |m| a) / (2 m^2)
seconds on average. Looked at every dt, both ends are overshot: a counts as a + 2 x 0.583 sqrt(dt)
(D. Siegmund: Sequential Analysis. Springer, 1985).
"""

import math

import numpy as np
import pytest
from helpers.worlds.delayed_loops import normals

from dva_sim.agents.habits import LookingHabits
from dva_sim.agents.operator.inspection import WeighedEvidence, clearness, worth

HABITS = LookingHabits()
SENSITIVITY, LOOK = 4.5, 1.5  # of the person in the middle of the population


def mean_time(drift: float, level: float, step: float, variance: float = 1.0) -> float:
    """In closed form [s]."""
    m, a = drift / variance, level + 1.166 * math.sqrt(step * variance)
    if m > 0:
        return (a / m - (1 - math.exp(-2 * m * a)) / (2 * m**2)) / variance
    return (math.expm1(-2 * m * a) + 2 * m * a) / (2 * m**2) / variance


def until_sure(
    seed: int,
    clear: float,
    contrast: float = 1.0,
    look: float = LOOK,
    rate: float = 10.0,
    sensitivity: float = SENSITIVITY,
    at_most: float = math.inf,
) -> float:
    """Time that a person looks until it is sure [s]; infinite if it never is."""
    evidence, now = WeighedEvidence(sensitivity, look, normals(seed), HABITS), 0.0
    while not evidence.sure:
        now += 1.0 / rate
        if now > at_most:
            return math.inf
        evidence.weigh(worth(1.0 / rate), clear, contrast)
    return now


def times(count: int = 400, **how: float) -> np.ndarray:
    return np.array([until_sure(seed, **how) for seed in range(count)])


def test_what_is_in_plain_view_is_confirmed_after_1_4_s_in_the_middle_and_never_after_8_s():
    took = times(clear=1.0)
    assert np.median(took) == pytest.approx(1.4, abs=0.15)
    assert took.min() >= 0.4
    assert took.max() < 8.0


@pytest.mark.parametrize("rate", [30.0, 10.0, 4.0])
def test_the_mean_time_to_confirm_is_that_of_the_closed_form(rate):
    criterion = 0.5 * SENSITIVITY * LOOK
    expected = mean_time(0.5 * SENSITIVITY, criterion, 1.0 / rate)
    took = times(count=1000, clear=1.0, rate=rate)
    assert took.mean() == pytest.approx(expected, abs=3.5 * took.std() / math.sqrt(1000))


def test_false_confirmations_are_as_frequent_as_the_closed_form_says():
    """In haste (0.5 s in plain view would do): by chance once in 81 s of looking."""
    look, step = 0.5, 0.1
    expected = mean_time(-0.5 * SENSITIVITY, 0.5 * SENSITIVITY * look, step)
    took = times(count=400, clear=0.0, look=look)
    assert expected == pytest.approx(81.3, abs=0.2)
    assert took.mean() == pytest.approx(expected, rel=0.15)


def test_in_25_s_of_clear_pictures_fewer_than_1_in_1000_confirms_what_is_not_there():
    by_chance = 25.0 / mean_time(-0.5 * SENSITIVITY, 0.5 * SENSITIVITY * LOOK, 0.1)
    assert by_chance < 1e-3
    assert np.isinf(times(count=200, clear=0.0, at_most=25.0)).all()


def test_haste_and_smoke_make_false_confirmations_frequent():
    def share(**how: float) -> float:
        return float(np.isfinite(times(count=300, clear=0.0, at_most=25.0, **how)).mean())

    hasty, hastier = share(look=0.75), share(look=0.4)
    assert 0.0 < hasty < 0.25 < hastier
    assert share(contrast=0.3, look=0.75) > 1.5 * hasty


def test_smoke_that_leaves_a_quarter_of_the_contrast_makes_looking_eight_times_as_long():
    """The drift is 0.25^1.5 = 1/8, the variance 1/4."""
    criterion = 0.5 * SENSITIVITY * LOOK
    expected = mean_time(0.5 * SENSITIVITY / 8, criterion, 0.1, 0.25)
    took = times(count=300, clear=1.0, contrast=0.25)
    assert took.mean() == pytest.approx(expected, rel=0.1)
    assert 6.0 < took.mean() / times(count=300, clear=1.0).mean() < 8.0


@pytest.mark.parametrize(("rate", "factor"), [(3.0, 1.0), (1.0, 3.0), (0.2, 15.0)])
def test_a_still_picture_tells_something_for_a_third_of_a_s(rate, factor):
    """Below three frames a second evidence comes as slowly as the frames do."""
    assert worth(1.0 / rate) == pytest.approx(1.0 / 3.0)
    fast, slow = times(clear=1.0, rate=3.0), times(clear=1.0, rate=rate)
    assert slow.mean() / fast.mean() == pytest.approx(factor)


def test_what_looks_small_speaks_against_itself():
    """From 0.03 rad on it looks more like the event than like none."""
    assert clearness(0.03, 0.03) == pytest.approx(0.5)
    assert clearness(0.17, 0.03) > 0.98  # 1 m across, 6 m away
    assert np.isinf(times(count=50, clear=clearness(0.01, 0.03), at_most=25.0)).all()


def test_having_long_seen_nothing_makes_nobody_harder_to_convince():
    evidence = WeighedEvidence(SENSITIVITY, LOOK, normals(1), HABITS)
    for _ in range(3000):
        evidence.weigh(0.1, 0.0, 1.0)
    assert 0.0 <= evidence.level < evidence.criterion
