"""One task after the other."""

import numpy as np
import pytest
from helpers.dva.dispatch_situations import INF, act, look, pairs, situation

from dva_sim.core.dispatch import MinEta, NearestIdle, Preference, RandomChoice

GREEDY = (NearestIdle, MinEta, Preference, RandomChoice)


def test_the_nearest_goes_even_if_another_is_there_earlier():
    seen = situation("gr", [[60, 50]], distance=[[10, 20]])
    assert pairs(NearestIdle(), seen) == [(0, 0)]
    assert pairs(MinEta(), seen) == [(0, 1)]


def test_the_oldest_task_chooses_first():
    seen = situation("gg", [[10, 20], [10, 99]])
    assert pairs(MinEta(), seen) == [(0, 0), (1, 1)]


def test_equals_go_in_order_of_registration():
    assert pairs(MinEta(), situation("ggr", [[30, 30, 30], [30, 30, 30]])) == [(0, 0), (1, 1)]


def test_the_first_on_the_list_goes_however_far():
    ranks = np.array([[2.0, 0.0, INF], [2.0, 0.0, INF]])
    seen = situation("ggg", [[10, 90, 5], [10, 90, 5]], preference=ranks)
    assert pairs(Preference(), seen) == [(0, 1), (1, 0)]


def test_without_lists_the_order_of_registration_is_the_list():
    assert pairs(Preference(), situation("gg", [[INF, 20], [50, 10]])) == [(0, 1), (1, 0)]


def test_a_random_choice_is_among_all_who_can_and_follows_the_generator_given():
    seen = situation("gggg", [[10, INF, 30, 40]])
    chosen = [RandomChoice().advise(seen, np.random.default_rng(i))[0].responder for i in range(50)]
    assert set(chosen) == {0, 2, 3}
    again = [RandomChoice().advise(seen, np.random.default_rng(i))[0].responder for i in range(50)]
    assert chosen == again


@pytest.mark.parametrize("policy", GREEDY)
def test_no_more_robots_are_sent_than_operators_are_free(policy):
    seen = situation("rrr", [[10, 20, 30]] * 3, operators=2)
    assert len(pairs(policy(), seen)) == 2
    assert pairs(policy(), situation("rrr", [[10, 20, 30]] * 3, operators=0)) == []


@pytest.mark.parametrize("policy", GREEDY)
def test_what_is_not_due_or_has_somebody_under_way_is_left_alone(policy):
    tasks = [act(1, due=False), look(2, engaged=1), look(3)]
    seen = situation("gg1", [[10, 5], [10, 5], [10, 5]], tasks)
    assert pairs(policy(), seen) == [(2, 0)]


@pytest.mark.parametrize("policy", GREEDY)
def test_nobody_goes_where_there_is_no_way(policy):
    assert pairs(policy(), situation("gr", [[INF, INF]], distance=[[1, 1]])) == []
    assert pairs(policy(), situation("", [[], []])) == []
    assert pairs(policy(), situation("gr", [])) == []
