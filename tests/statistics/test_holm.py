import itertools

import numpy as np
import pytest

from dva_sim.statistics import holm


def test_the_smallest_is_multiplied_by_their_number_the_next_by_one_less():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])


def test_each_family_pays_for_its_own_tests_only():
    found = holm([0.01, 0.04, 0.03, 0.02], ["main", "main", "side", "main"])
    assert found == pytest.approx([0.03, 0.04, 0.03, 0.04])


def test_a_test_that_was_not_made_costs_nothing():
    assert holm([0.02, np.nan, 0.5]) == pytest.approx([0.04, np.nan, 0.5], nan_ok=True)


def test_adjusted_values_end_at_one_and_none_give_none():
    assert holm([0.6, 0.7]).tolist() == [1, 1]
    assert holm([]).tolist() == []


def test_it_is_the_closure_of_bonferronis_test_over_all_subsets():
    """A test is as significant as the least significant of the subsets that it is in."""
    p = np.random.default_rng(1).random(6) ** 3
    subsets = [s for k in range(1, 7) for s in itertools.combinations(range(6), k)]
    closure = [max(len(s) * min(p[list(s)]) for s in subsets if i in s) for i in range(6)]
    assert holm(p) == pytest.approx(np.minimum(closure, 1))


def test_true_hypotheses_of_a_family_are_rejected_in_one_study_of_twenty():
    """Three of five are true; the others are always found, so three share the 5 %: 4.9 %."""
    rng = np.random.default_rng(2)
    p = np.column_stack([rng.random((4000, 3)), np.full((4000, 2), 1e-6)])
    alarms = np.mean([(holm(own)[:3] <= 0.05).any() for own in p])
    assert alarms == pytest.approx(1 - (1 - 0.05 / 3) ** 3, abs=0.01)
