import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import sobol_indices
from dva_sim.statistics.persons import draws

NAMES = ("x", "y", "z")


def saltelli(blocks, seed, factors=3):
    """Points in (-pi, pi) by block: A, A with each coordinate from B, B."""
    points = stats.qmc.Sobol(2 * factors, rng=np.random.default_rng(seed)).random(blocks)
    a, b = np.hsplit(math.pi * (2 * points - 1), 2)
    mixed = [np.where(np.arange(factors) == i, b, a) for i in range(factors)]
    return np.stack([a, *mixed, b], axis=1).reshape(-1, factors)


def ishigami(points):
    x, y, z = points.T
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def indices(points, values, **more):
    levels = dict(zip(NAMES, points.T, strict=False))
    runs = np.arange(len(points))
    return sobol_indices(levels, values, np.zeros(len(points)), runs, **more)


def test_ishigamis_function_has_its_known_indices():
    x = 0.5 * (1 + 0.1 * math.pi**4 / 5) ** 2
    y = 7**2 / 8
    xz = 0.1**2 * math.pi**8 * (1 / 18 - 1 / 50)
    whole = x + y + xz
    points = saltelli(2048, 1)
    found = indices(points, ishigami(points), resamples=200)
    assert [i.factor for i in found] == list(NAMES)
    assert [i.first.mean for i in found] == pytest.approx([x / whole, y / whole, 0], abs=0.02)
    total = [(x + xz) / whole, y / whole, xz / whole]
    assert [i.total.mean for i in found] == pytest.approx(total, abs=0.02)
    for index, first, of_all in zip(found, [x / whole, y / whole, 0], total, strict=True):
        assert index.first.low <= first <= index.first.high
        assert index.total.low <= of_all <= index.total.high


def test_the_estimates_are_those_of_scipy_from_the_same_runs():
    points = saltelli(256, 2)
    outcome = ishigami(points).reshape(256, 5)
    runs = {"f_A": outcome[:, 0], "f_B": outcome[:, 4], "f_AB": outcome[:, 1:4].T[:, None]}
    runs["f_A"], runs["f_B"] = runs["f_A"][None], runs["f_B"][None]
    theirs = stats.sobol_indices(func=runs, n=256)
    found = indices(points, outcome.ravel(), resamples=10)
    assert [i.first.mean for i in found] == pytest.approx(theirs.first_order.ravel(), abs=2e-3)
    assert [i.total.mean for i in found] == pytest.approx(theirs.total_order.ravel(), abs=2e-3)


def test_the_interval_is_that_of_blocks_drawn_again_written_out():
    points = saltelli(16, 11)
    blocks = points.reshape(16, 5, 3)
    drawn = [np.repeat(blocks, own, axis=0) for own in draws(16, 100).astype(int)]
    rows = [block.reshape(-1, 3) for block in drawn]
    first = [indices(own, ishigami(own), resamples=2)[0].first.mean for own in rows]
    found = indices(points, ishigami(points), resamples=100)[0].first
    assert (found.low, found.high) == pytest.approx(tuple(np.quantile(first, [0.025, 0.975])))


@pytest.mark.soak
def test_their_intervals_hold_in_at_least_93_of_100_studies_of_few_points_and_persons():
    """Ishigami's function, which noise of variance 1 in each cell of 12 persons blurs by 1/12."""
    parts = 0.5 * (1 + 0.1 * math.pi**4 / 5) ** 2, 7**2 / 8, 0.1**2 * math.pi**8 * (1 / 18 - 1 / 50)
    first, total = np.array([*parts[:2], 0]), np.array([parts[0] + parts[2], parts[1], parts[2]])
    blur, rng = 1 / 12, np.random.default_rng(10)
    truth = np.array([first, total + blur]) / (sum(parts) + blur)
    held, studies = np.zeros((2, 3)), 300
    for seed in range(studies):
        points = saltelli(64, seed)
        levels = dict(zip(NAMES, np.repeat(points, 12, axis=0).T, strict=True))
        values = ishigami(points)[:, np.newaxis] + rng.normal(size=(len(points), 12))
        runs = np.repeat(np.arange(len(points)), 12), np.tile(np.arange(12), len(points))
        found = sobol_indices(levels, values.ravel(), runs[1], runs[0], resamples=300)
        ends = np.array([[(x.low, x.high) for x in (i.first, i.total)] for i in found])
        held += ((ends[:, :, 0] <= truth.T) & (ends[:, :, 1] >= truth.T)).T
    assert np.all(held / studies >= 0.93)


def test_persons_count_in_the_mean_and_in_the_interval():
    points = saltelli(64, 4)
    runs, persons = len(points), 12
    rng = np.random.default_rng(5)
    levels = dict(zip(NAMES, np.repeat(points, persons, axis=0).T, strict=True))
    noise = rng.normal(0, 6, (runs, persons))
    values = ishigami(points)[:, np.newaxis] + noise - noise.mean(axis=1, keepdims=True)
    person, cell = np.tile(np.arange(persons), runs), np.repeat(np.arange(runs), persons)
    found = sobol_indices(levels, values.ravel(), person, cell)
    alone = indices(points, ishigami(points))
    for many, one in zip(found, alone, strict=True):
        assert many.first.mean == pytest.approx(one.first.mean)
        assert many.first.half_width > one.first.half_width
        assert many.first.n_persons == 12


def test_a_block_that_nobody_completed_is_left_out():
    points = saltelli(64, 6)
    values = ishigami(points)
    shorter = indices(points[5:], values[5:], resamples=10)
    values[2] = np.nan
    assert indices(points, values, resamples=10)[0].first.mean == shorter[0].first.mean


@pytest.mark.parametrize(
    "points",
    [saltelli(8, 7)[1:], saltelli(8, 7)[::-1], np.random.default_rng(8).random((40, 3))],
    ids=["cut", "turned round", "random"],
)
def test_another_design_is_refused(points):
    with pytest.raises(ValueError, match="saltelli: N"):
        indices(points, ishigami(points))
