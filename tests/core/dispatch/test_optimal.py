"""All tasks at once, and operators as a resource."""

from itertools import permutations

import numpy as np
import pytest
from helpers.dva.dispatch_situations import INF, look, pairs, situation, total_eta
from helpers.processes.search_settings import search
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.core.dispatch import BatchOptimal, MinEta, NearestIdle, OperatorAware

eta_tables = st.integers(1, 6).flatmap(
    lambda responders: st.lists(
        st.lists(
            st.one_of(st.integers(1, 300).map(float), st.just(INF)),
            min_size=responders,
            max_size=responders,
        ),
        min_size=1,
        max_size=6,
    )
)


def test_the_oldest_leaves_the_one_to_the_next_that_needs_it_more():
    seen = situation("gg", [[10, 20], [15, 90]])
    assert pairs(MinEta(), seen) == [(0, 0), (1, 1)]  # 100 s
    assert pairs(BatchOptimal(), seen) == [(0, 1), (1, 0)]  # 35 s


def test_two_served_late_are_better_than_one_served_early():
    assert pairs(BatchOptimal(), situation("gg", [[1, 500], [1, INF]])) == [(0, 1), (1, 0)]


def test_distance_can_be_what_is_added_up():
    seen = situation("gr", [[30, 20]], distance=[[5, 9]])
    assert pairs(BatchOptimal(), seen) == [(0, 1)]
    assert pairs(BatchOptimal(objective="distance"), seen) == [(0, 0)]


def test_with_too_few_responders_the_near_one_goes_first_until_the_far_one_has_waited():
    """The way differs by 80 s, so 80 s more of waiting turn the choice."""
    for earlier, served in ((79.0, 1), (81.0, 0)):
        tasks = [look(1, since=0.0), look(2, since=earlier)]
        seen = situation("g", [[100], [20]], tasks)
        assert pairs(BatchOptimal(), seen) == [(served, 0)]
    assert pairs(BatchOptimal(ageing_per_s=0), seen) == [(1, 0)]


def test_an_operator_goes_where_a_robot_saves_most_against_a_person():
    """One operator: robots would save 20 s at the first event, 70 s at the second."""
    seen = situation("ggrr", [[40, 99, 20, 99], [99, 90, 99, 20]], operators=1)
    assert pairs(MinEta(), seen) == [(0, 2), (1, 1)]  # 110 s
    assert pairs(OperatorAware(), seen) == [(0, 0), (1, 3)]  # 60 s


def test_a_robot_that_saves_less_than_an_operator_is_worth_stays():
    seen = situation("gr", [[50, 20]])
    assert pairs(OperatorAware(operator_worth_s=29), seen) == [(0, 1)]
    assert pairs(OperatorAware(operator_worth_s=31), seen) == [(0, 0)]
    assert pairs(OperatorAware(operator_worth_s=31), situation("r", [[20]])) == [(0, 0)]


def best_by_trying(eta, robots, operators):
    """Most tasks served, then least total, of all ways with no more robots than operators."""
    tasks, team = len(eta), len(eta[0])
    columns = [*range(team), *[None] * tasks]
    best = (0, 0.0)
    for chosen in set(permutations(columns, tasks)):
        sent = [(t, r) for t, r in enumerate(chosen) if r is not None]
        if all(eta[t][r] < INF for t, r in sent) and sum(robots[r] for _, r in sent) <= operators:
            best = max(best, (len(sent), -sum(eta[t][r] for t, r in sent)))
    return best[0], -best[1]


@pytest.mark.system
@search(150)
@given(st.data())
def test_it_is_the_best_of_all_ways_with_so_many_operators(data):
    tasks, team = data.draw(st.integers(1, 4)), data.draw(st.integers(1, 4))
    minutes = st.sampled_from([1.0, 2.0, 3.0, 5.0, 8.0, 13.0, INF])
    row = st.lists(minutes, min_size=team, max_size=team)
    eta = data.draw(st.lists(row, min_size=tasks, max_size=tasks))
    letters = data.draw(st.text("gr", min_size=team, max_size=team))
    operators = data.draw(st.integers(0, 3))
    seen = situation(letters, eta, operators=operators)
    robots = [letter == "r" for letter in letters]
    for policy in (BatchOptimal(), OperatorAware(operator_worth_s=0)):
        chosen = pairs(policy, seen)
        found = len(chosen), total_eta(seen, chosen)
        assert found == pytest.approx(best_by_trying(eta, robots, operators))


@pytest.mark.system
@search(300)
@given(eta_tables, st.integers(0, 6), st.sampled_from([0.0, 1.0]))
def test_it_is_never_worse_than_one_after_the_other(eta, operators, ageing):
    """All have waited equally long."""
    team = "".join("gr"[place % 2] for place in range(len(eta[0])))
    seen = situation(team, eta, operators=operators)
    chosen = pairs(BatchOptimal(ageing_per_s=ageing), seen)
    for greedy in (NearestIdle(), MinEta()):
        other = pairs(greedy, seen)
        assert len(chosen) >= len(other)
        if len(chosen) == len(other):
            assert total_eta(seen, chosen) <= total_eta(seen, other) + 1e-6


def test_large_numbers_do_not_hide_small_differences():
    """500 tasks that have waited up to a day, ways that differ by a second."""
    rng = np.random.default_rng(5)
    eta = 1000.0 + rng.permuted(np.tile(np.arange(80.0), (60, 1)), axis=1)
    tasks = [look(e, since=86_400.0 * e / 61) for e in range(1, 61)]
    seen = situation("g" * 40 + "r" * 40, eta, tasks, now=90_000.0, operators=25)
    chosen = pairs(BatchOptimal(), seen)
    assert len(chosen) == 60
    assert sum(responder >= 40 for _, responder in chosen) <= 25
    assert total_eta(seen, chosen) < 60 * 1004
