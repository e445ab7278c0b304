"""How often 95 % intervals hold, with as many persons and trials as the main study has."""

import numpy as np
import pytest

from dva_sim.experiments.statistics import band, mean_interval
from dva_sim.experiments.study import load_study

STUDY = load_study("req-rep-vs-pub-sub")
PERSONS, TRIALS = STUDY.persons, STUDY.replications
STUDIES = 10_000
AT_ONCE = 250


def gamma_persons(skewness, n, rng):
    """Persons whose means have this skewness; the true mean is zero."""
    shape = (2 / skewness) ** 2
    return rng.gamma(shape, 1, (n, PERSONS, 1)) - shape + np.zeros(TRIALS)


def paired_times(n, rng):
    """Log-normal times of two treatments, by persons of different skill: 6 s apart in the mean."""
    skill = rng.lognormal(-0.08, 0.4, (n, PERSONS, 1))
    slow, fast = rng.lognormal(-0.045, 0.3, (2, n, PERSONS, TRIALS))
    return skill * (30 * slow - 24 * fast) - 6


def mostly_unhurt(n, rng):
    """Seven runs in ten without any delay; in the others much for some, little for most."""
    delay = rng.gamma(1, 1, (n, PERSONS, 1)) * rng.gamma(1, 1, (n, PERSONS, TRIALS))
    return delay * (rng.random(delay.shape) < 0.3) - 0.3


def with_gaps(values, rng):
    """A fifth of the runs is missing, and one person in twelve altogether."""
    gone = rng.random(values.shape) < 0.2
    gone |= rng.random((*values.shape[:2], 1)) < 1 / 12
    return np.where(gone, np.nan, values)


def person_means(values):
    there = np.isfinite(values)
    count = there.sum(axis=2)
    total = np.where(there, values, 0).sum(axis=2)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).T


CASES = {
    "even": lambda n, rng: rng.normal(size=(n, PERSONS, 1)) + rng.normal(size=(n, PERSONS, TRIALS)),
    "skewness 1.1": lambda n, rng: gamma_persons(1.1, n, rng),
    "skewness 2.3": lambda n, rng: gamma_persons(2.3, n, rng),
    "skewness 2.3, the other way": lambda n, rng: -gamma_persons(2.3, n, rng),
    "skewness 2.3, incomplete": lambda n, rng: with_gaps(gamma_persons(2.3, n, rng), rng),
    "paired times": paired_times,
    "paired times, incomplete": lambda n, rng: with_gaps(paired_times(n, rng), rng),
    "mostly unhurt": mostly_unhurt,
    "mostly unhurt, incomplete": lambda n, rng: with_gaps(mostly_unhurt(n, rng), rng),
}


def test_the_main_study_is_of_24_persons_and_5_trials():
    assert (PERSONS, TRIALS) == (24, 5)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_an_interval_of_95_percent_holds_in_93_to_97_of_100_studies(case):
    rng = np.random.default_rng(2014)
    held = 0
    for _ in range(STUDIES // AT_ONCE):
        found = band(person_means(CASES[case](AT_ONCE, rng)))  # a column is a study
        held += int(((found.pointwise_low <= 0) & (found.pointwise_high >= 0)).sum())
    assert 0.93 <= held / STUDIES <= 0.97


def test_what_holds_in_columns_of_a_band_is_the_interval_of_the_runs():
    rng = np.random.default_rng(3)
    values = paired_times(5, rng)
    found = band(person_means(values))
    person = np.repeat(np.arange(PERSONS), TRIALS)
    for study, low, high in zip(values, found.pointwise_low, found.pointwise_high, strict=True):
        interval = mean_interval(study.ravel(), person)
        assert (interval.low, interval.high) == pytest.approx((low, high))
