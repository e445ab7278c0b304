import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.experiments.analysis.sample_size import IntervalLaw, law_of
from dva_sim.statistics import band, mean_interval

PILOT = np.array([-1.5, 0.5, 1.0])  # variance 1.75
SKEWED = np.array([0.2, 0.4, 0.5, 0.9, 1.1, 1.4, 2.0, 9.5])


def power_by_hand(persons, effect, spread, alpha=0.025):
    critical, shift = stats.t.isf(alpha, persons - 1), effect / spread * math.sqrt(persons)
    return stats.nct.sf(critical, persons - 1, shift)


def test_without_an_interval_of_its_own_a_study_follows_students_law():
    law = law_of(PILOT, [0, 1, 2])
    assert (law.persons, law.stretch) == (3, 1.0)
    assert law.reach(10) == pytest.approx(stats.t.isf(0.025, 9) * math.sqrt(1.75 / 10))
    assert law.power(1.0, 10) == pytest.approx(power_by_hand(10, 1.0, math.sqrt(1.75)))
    assert law.power(-1.0, 10) == law.power(1.0, 10)


def test_with_as_many_persons_the_law_gives_the_interval_that_is_shown():
    shown = mean_interval(SKEWED, range(8))
    up, down = shown.high - shown.mean, shown.mean - shown.low
    assert law_of(SKEWED, range(8), up).reach(8) == pytest.approx(up)
    assert law_of(SKEWED, range(8), down).reach(8) == pytest.approx(down)
    assert law_of(SKEWED, range(8), up).stretch > 1.5  # Student's alone knows nothing of skewness


def test_with_as_many_persons_the_law_gives_the_band_that_is_shown():
    rng = np.random.default_rng(1)
    differences = rng.normal(1.0, 2.0, (12, 5))
    shown = band(differences)
    for level in range(5):
        reach = shown.mean[level] - shown.low[level]
        law = law_of(differences[:, level], range(12), reach, 1 - 0.05 / 5)
        assert law.reach(12) == pytest.approx(reach)


def test_studies_of_a_size_are_as_narrow_as_the_law_says_on_the_average():
    rng = np.random.default_rng(1)
    law = law_of(rng.normal(0, 3, 4000), range(4000))
    widths = [mean_interval(x, range(38)).half_width for x in rng.normal(0, 3, (200, 38))]
    assert law.reach(38) == pytest.approx(1.0, abs=0.02)
    assert np.mean(widths) == pytest.approx(law.reach(38), abs=0.05)


def test_that_share_of_studies_shows_the_effect():
    rng = np.random.default_rng(3)
    shown = [mean_interval(x, range(24)).low > 0 for x in rng.normal(0.6, 1, (400, 24))]
    expected = law_of(rng.normal(0, 1, 5000), range(5000)).power(0.6, 24)
    assert expected == pytest.approx(0.80, abs=0.02)
    assert np.mean(shown) == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize("stretch", [1.0, 1.8])
def test_more_persons_never_make_it_less_likely_to_show_an_effect(stretch):
    law = IntervalLaw(spread=16.0, persons=8, level=0.975, stretch=stretch)
    chances = [law.power(1.0, n) for n in (100, 1000, 5000, 8038, 8039, 10_000, 16_384)]
    assert chances == sorted(chances)
    assert chances[-1] > 0.99


def test_trials_count_with_the_mean_of_their_person():
    law = law_of([1.0, 3.0, 2.0, 6.0], [0, 0, 1, 1])
    assert law.spread == pytest.approx(math.sqrt(2.0))


def test_persons_who_are_all_alike_and_one_alone_follow_no_law():
    assert law_of([1.0, 1.0], [0, 1]) is None
    assert law_of([1.0, 2.0], [0, 0]) is None
