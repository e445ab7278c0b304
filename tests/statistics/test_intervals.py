import math

import numpy as np
import pytest
from scipy import stats

from dva_sim import statistics


def test_a_persons_mean_leaves_out_missing_runs_and_missing_persons():
    persons, means = statistics.person_means([1, 3, np.nan, 5, np.nan], [7, 7, 7, 2, 9])
    assert persons.tolist() == [2, 7]
    assert means.tolist() == [5, 2]


def test_the_interval_of_a_paired_difference_is_that_of_a_bootstrap_t_written_out():
    rng = np.random.default_rng(3)
    a, b = rng.gamma(0.4, 20, (24, 5)), rng.gamma(2, 1, (24, 5))
    person = np.repeat(np.arange(24), 5)
    found = statistics.paired_difference(a.ravel(), b.ravel(), person)
    off = (a - b).mean(axis=1)
    drawn = rng.choice(off, (20_000, 24))
    ratios = (drawn.mean(axis=1) - off.mean()) / stats.sem(drawn, axis=1)
    students, either = stats.t.isf(0.025, 23), np.quantile(np.abs(ratios), 0.95)
    down = max(students, either, np.quantile(ratios, 0.975))
    up = max(students, either, -np.quantile(ratios, 0.025))
    assert found.mean == pytest.approx((a - b).mean())
    assert (found.mean - found.low) / stats.sem(off) == pytest.approx(down, rel=0.03)
    assert (found.high - found.mean) / stats.sem(off) == pytest.approx(up, rel=0.03)
    assert found.n_persons == 24
    assert up > either > students


def test_the_interval_of_mirrored_values_is_the_mirrored_interval():
    values = np.random.default_rng(4).gamma(0.4, 20, 24)
    found, mirrored = (statistics.mean_interval(side * values, range(24)) for side in (1, -1))
    assert (mirrored.low, mirrored.high) == pytest.approx((-found.high, -found.low))
    assert found.high - found.mean > 1.2 * (found.mean - found.low)


def test_with_fewer_than_six_persons_the_interval_is_students():
    values = np.array([1.0, 4.0, 2.0, 7.0, 3.0])
    found = statistics.mean_interval(values, np.arange(5))
    exact = stats.ttest_1samp(values, 0).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx(tuple(exact), rel=1e-12)


def test_trials_of_one_person_do_not_narrow_the_interval():
    one = statistics.mean_interval([1, 2, 4], [0, 1, 2])
    many = statistics.mean_interval(np.repeat([1, 2, 4], 100), np.repeat([0, 1, 2], 100))
    assert (many.low, many.high) == pytest.approx((one.low, one.high))


@pytest.mark.parametrize(
    "interval",
    [statistics.mean_interval, statistics.quantile_interval, statistics.share_interval],
)
def test_one_person_has_a_mean_but_no_interval_and_nobody_has_nothing(interval):
    one, nobody = interval([1, 3], [0, 0]), interval([np.nan], [0])
    assert (one.mean, one.n_persons, nobody.n_persons) == (2, 1, 0)
    assert np.isnan([one.low, one.high, nobody.mean]).all()


def skewed(rng: np.random.Generator, persons: int, levels: int) -> np.ndarray:
    """Correlated, log-normal differences whose true mean is zero."""
    common = rng.normal(size=(persons, 1))
    own = rng.normal(size=(persons, levels))
    return np.exp(0.5 * (0.8 * common + 0.6 * own)) - math.exp(0.125)


def test_the_band_is_wider_than_each_levels_own_interval():
    band = statistics.band(skewed(np.random.default_rng(6), 24, 6))
    assert np.all(band.low < band.pointwise_low)
    assert np.all(band.high > band.pointwise_high)
    assert np.all(band.high - band.mean > band.mean - band.low)  # as each level's own is


def test_few_persons_get_bonferronis_band():
    values = np.random.default_rng(10).normal(size=(3, 4))
    assert statistics.band(values).critical == pytest.approx([stats.t.isf(0.025 / 4, 2)] * 4)


def test_a_band_over_one_person_has_means_only_and_over_nobody_nothing():
    band, nothing = statistics.band([[1.0, 2.0]]), statistics.band(np.full((3, 2), np.nan))
    assert band.mean.tolist() == [1, 2]
    assert np.isnan([*band.low, *band.high, *band.critical, *nothing.mean]).all()
    assert nothing.n_persons == 0


def test_missing_cells_leave_the_other_levels_of_the_band_alone():
    values = skewed(np.random.default_rng(12), 24, 3)
    values[:, 1] = np.nan
    values[0, 2] = np.nan
    band = statistics.band(values)
    assert np.isfinite(band.low).tolist() == [True, False, True]
    assert band.mean[2] == pytest.approx(values[1:, 2].mean())


def test_a_level_that_few_persons_have_does_not_take_the_band_from_the_others():
    """One in 100 draws of 24 persons holds fewer than two of these 6."""
    values = skewed(np.random.default_rng(17), 24, 3)
    values[6:, 1] = np.nan
    band = statistics.band(values)
    assert np.isfinite([*band.low, *band.high]).all()
    alone = statistics.mean_interval(values[:6, 1], range(6))
    assert band.mean[1] == pytest.approx(alone.mean)
    assert 1 < (band.pointwise_high - band.pointwise_low)[1] / (alone.high - alone.low) < 2


def test_draws_that_say_nothing_of_a_level_do_not_take_away_its_interval():
    """Draws of 60 persons hold fewer than two of these 6 in 1.4 of 100 cases."""
    values = np.random.default_rng(22).normal(size=(60, 2))
    values[6:, 0] = np.nan
    band = statistics.band(values, level=0.99)
    assert np.isfinite([*band.low, *band.high, *band.pointwise_low, *band.pointwise_high]).all()


def test_a_band_of_one_level_is_its_interval_however_skewed():
    values = np.random.default_rng(4).gamma(0.4, 20, (24, 1))
    band = statistics.band(values)
    assert (band.low, band.high) == (band.pointwise_low, band.pointwise_high)
    assert band.high - band.mean > 1.2 * (band.mean - band.low)


def test_a_level_of_three_persons_gets_bonferronis_t_and_the_rest_what_it_leaves():
    values = np.random.default_rng(18).normal(size=(200, 4))
    values[3:, 0] = np.nan
    critical = statistics.band(values).critical
    assert critical[0] == pytest.approx(stats.t.isf(0.025 / 4, 2))
    whole = abs(np.random.default_rng(19).normal(size=(40_000, 3))).max(axis=1)
    assert critical[1:] == pytest.approx([np.quantile(whole, 1 - 0.05 * 3 / 4)] * 3, abs=0.12)


def test_the_band_is_each_levels_own_interval_at_the_confidence_that_holds_all_written_out():
    values = skewed(np.random.default_rng(20), 24, 5)
    drawn = values[np.random.default_rng(21).integers(0, 24, (10_000, 24))]
    ratios = (drawn.mean(axis=1) - values.mean(axis=0)) / stats.sem(drawn, axis=1)
    rarities = 1 - (stats.rankdata(abs(ratios), axis=0) - 1) / len(ratios)  # how rare, by level
    each = np.quantile(rarities.min(axis=1), 0.05)
    found, error = statistics.band(values), stats.sem(values, axis=0)
    up = np.maximum(
        -np.quantile(ratios, each / 2, axis=0), np.quantile(abs(ratios), 1 - each, axis=0)
    )
    assert (found.high - found.mean) / error == pytest.approx(up, rel=0.12)
    assert 0.05 / 5 < each < 0.05


def test_levels_at_which_nothing_differs_leave_the_band_of_the_others_alone():
    """One person in 24 differs by a little: without it a draw has no spread of its own."""
    rng = np.random.default_rng(23)
    differ, same = 5.0 + rng.normal(size=(24, 3)), np.zeros((24, 3))
    same[0] = 0.01
    widths = [
        band.high[:3] - band.low[:3]
        for band in map(statistics.band, (differ, np.hstack([differ, same])))
    ]
    bonferroni = 2.0 * stats.t.isf(0.025 / 6, 23) * stats.sem(differ, axis=0)
    assert np.all(widths[1] >= widths[0])
    assert np.all(widths[1] < 1.1 * bonferroni)


def test_a_level_without_spread_has_a_band_without_width():
    values = np.column_stack([np.full(24, 0.1), np.random.default_rng(13).normal(size=24)])
    band = statistics.band(values)
    assert band.low[0] == band.high[0] == pytest.approx(0.1)
    assert band.low[1] < band.high[1]


@pytest.mark.parametrize("happened", [0, 3, 12, 24])
def test_a_share_of_one_run_each_is_clopper_and_pearsons_of_scipy(happened):
    found = statistics.share_interval(np.arange(24) < happened, range(24))
    exact = stats.binomtest(happened, 24).proportion_ci(method="exact")
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high))


def test_a_share_over_persons_who_never_differ_counts_each_person_once():
    found = statistics.share_interval(np.ones(120), np.repeat(np.arange(24), 5))
    worth = 24 * (stats.t.isf(0.025, 119) / stats.t.isf(0.025, 23)) ** 2
    assert found.mean == found.high == 1
    assert found.low == pytest.approx(0.025 ** (1 / worth))


def test_a_share_of_persons_who_differ_is_worth_fewer_runs():
    """Persons' counts of 5 are 0, 0, 1, 2, 4, 5: 0.4 of the runs, between persons 0.4^2 / 0.16."""
    counts = np.array([0, 0, 1, 2, 4, 5])
    flags = (np.arange(5) < counts[:, np.newaxis]).ravel()
    found = statistics.share_interval(flags, np.repeat(np.arange(6), 5))
    runs = 0.4 * 0.6 / (np.var(counts / 5, ddof=1) / 6)
    worth = max(runs, 6) * (stats.t.isf(0.025, 29) / stats.t.isf(0.025, 5)) ** 2
    seen = 0.4 * worth
    assert found.mean == pytest.approx(0.4)
    assert found.low == pytest.approx(stats.beta.ppf(0.025, seen, worth - seen + 1))
    assert found.high == pytest.approx(stats.beta.ppf(0.975, seen + 1, worth - seen))


@pytest.mark.parametrize("q", [0.25, 0.5, 0.8])
def test_a_quantile_of_one_run_each_has_the_exact_interval_of_scipy(q):
    values = np.random.default_rng(14).lognormal(size=40)
    exact = stats.quantile_test(values, p=q).confidence_interval()
    found = statistics.quantile_interval(values, range(40), q)
    assert found.mean == np.quantile(values, q)
    assert (found.low, found.high) == (exact.low, exact.high)


def test_how_high_a_95th_percentile_is_24_persons_cannot_tell():
    """All of them lie below it in 0.95^24 = 29 of 100 studies."""
    values = np.random.default_rng(15).normal(size=24)
    found = statistics.quantile_interval(values, range(24), 0.95)
    assert np.isfinite(found.low)
    assert found.high == np.inf


def test_trials_of_one_person_do_not_narrow_the_interval_of_a_quantile():
    values, persons = np.random.default_rng(16).normal(size=24), range(24)
    alone = statistics.quantile_interval(values, persons)
    again = statistics.quantile_interval(np.repeat(values, 200), np.repeat(persons, 200))
    assert again.low <= alone.low < alone.high <= again.high


def test_a_level_at_which_most_persons_do_not_differ_does_not_make_the_band_endless():
    rng = np.random.default_rng(4)
    held, widest = 0, 0.0
    for _ in range(300):
        values = np.exp(0.6 * rng.normal(size=(12, 6))) - np.exp(0.18)
        values[rng.random(12) < 0.8, 0] = 0.0
        found = statistics.band(values, resamples=500)
        held += bool(((found.low <= 0) & (found.high >= 0)).all())
        widest = max(widest, found.critical.max())
    assert 0.92 <= held / 300 <= 0.985
    assert widest < 11
