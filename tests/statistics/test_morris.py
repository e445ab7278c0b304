"""Morris's screening finds what moves an outcome, and which way."""

import numpy as np
import pytest

from dva_sim.statistics.morris import STEP, elementary_effects, trajectories


def walks(axes=5, count=6, seed=1):
    return trajectories(axes, count, np.random.default_rng(seed))


def test_a_trajectory_changes_each_factor_once_by_the_step_and_stays_in_the_cube():
    for walk in walks():
        changes = np.diff(walk, axis=0)
        assert sorted(abs(changes).argmax(axis=1)) == [0, 1, 2, 3, 4]
        assert abs(changes).sum(axis=1) == pytest.approx([STEP] * 5)
        assert walk.min() >= 0.0
        assert walk.max() <= 1.0 + 1e-12


def test_effects_of_a_linear_outcome_are_its_slopes_whatever_the_trajectory():
    slopes = np.array([8.0, -3.0, 0.0, 1.0, 0.5])
    found = elementary_effects(walks(), walks() @ slopes)
    assert [each.mean.mean for each in found] == pytest.approx(slopes)
    assert [each.size for each in found] == pytest.approx(abs(slopes))
    assert max(each.spread for each in found) < 1e-9


def test_an_effect_whose_sign_depends_on_another_factor_has_a_size_and_no_direction():
    points = walks(axes=2, count=100)
    outcome = 4.0 * (points[..., 0] - 0.5) * (points[..., 1] - 0.5)
    first, _ = elementary_effects(points, outcome)
    assert first.size > 0.5
    assert abs(first.mean.mean) < 0.4
    assert first.spread > 0.5


def test_a_point_without_an_outcome_is_left_out():
    outcome = walks() @ np.array([8.0, -3.0, 0.0, 1.0, 0.5])
    outcome[0, 2] = np.nan
    assert elementary_effects(walks(), outcome)[0].mean.mean == pytest.approx(8.0)
