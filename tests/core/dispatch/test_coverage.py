"""Idle guards wait where they are needed next."""

import numpy as np
import pytest
from helpers.dva.dispatch_situations import INF, RNG, cover, look, situation

from dva_sim.core.dispatch import Assignment, Coverage, Relocation

# Two stations 100 s apart, a zone at each.
REACH = [[20, 120], [120, 20]]
AT_FIRST, AT_SECOND = [0, 100], [100, 0]


def advice(team, to_posts, demand, eta=(), gain_s=10.0, bound_for=(), reach=REACH):
    seen = situation(team, list(eta), cover=cover(to_posts, reach, demand, bound_for))
    return list(Coverage(gain_s=gain_s).advise(seen, RNG))


def test_a_guard_moves_to_where_most_is_expected_if_it_pays():
    """Here 0.6 of all events: 60 s expected at the first, 80 s at the second."""
    assert advice("g", [AT_SECOND], [0.6, 0.4]) == [Relocation(0, 0)]
    assert advice("g", [AT_SECOND], [0.6, 0.4], gain_s=20) == []
    assert advice("g", [AT_SECOND], [0.6, 0.4], gain_s=19) == [Relocation(0, 0)]
    assert advice("g", [AT_FIRST], [0.6, 0.4]) == []


def test_of_two_at_one_place_one_moves():
    assert advice("gg", [AT_FIRST, AT_FIRST], [0.5, 0.5]) == [Relocation(0, 1)]


def test_who_is_on_its_way_counts_as_there_and_is_left_alone():
    to_posts = [AT_FIRST, AT_FIRST]
    assert advice("gg", to_posts, [0.5, 0.5], bound_for=(1, None)) == []
    assert advice("gg", to_posts, [0.5, 0.5], bound_for=(None, 1)) == []


def test_who_is_a_few_steps_away_counts_as_there():
    assert advice("g", [[3, 103]], [0.9, 0.1], gain_s=1) == []
    assert advice("g", [[3.1, 103]], [0.9, 0.1], gain_s=1) == [Relocation(0, 0)]


def test_tasks_come_first_and_who_is_sent_does_not_move():
    got = advice("gg", [AT_FIRST, AT_FIRST], [0.5, 0.5], eta=[[30, 40]])
    assert got == [Assignment(0, 0)]  # the other one is all there is: either place is as good


def test_the_one_left_takes_over_for_who_was_sent():
    got = advice("gg", [AT_FIRST, AT_SECOND], [0.9, 0.1], eta=[[30, 400]])
    assert got == [Assignment(0, 0), Relocation(1, 0)]


def test_robots_and_who_cannot_be_sent_stay():
    assert advice("rg", [[INF, INF], [INF, INF]], [0.6, 0.4]) == []
    assert advice("g", [[INF, 0]], [0.9, 0.1]) == []


def test_a_zone_that_nobody_can_reach_draws_nobody():
    assert advice("g", [AT_SECOND], [0.5, 0.5], reach=[[INF, 120], [INF, 20]]) == []


def test_without_stations_it_is_the_earliest_arrival():
    seen = situation("gg", [[30, 20]], [look()])
    assert Coverage().advise(seen, RNG) == [Assignment(0, 1)]


@pytest.mark.parametrize("seed", range(10))
def test_the_moves_come_to_an_end_while_guards_walk(seed):
    """Four guards walk in a straight line at 1.3 m/s; they are asked every 10 s."""
    rng = np.random.default_rng(seed)
    stations, guards = rng.uniform(0, 400, (6, 2)), rng.uniform(0, 400, (4, 2))
    zones, demand = rng.uniform(0, 400, (12, 2)), rng.dirichlet(np.ones(12))
    reach = 20 + _far(stations, zones) / 1.3
    bound, moves, last, policy = [None] * 4, 0, 0, Coverage(gain_s=5)
    for step in range(200):
        eta = _far(guards, stations) / 1.3
        seen = situation("gggg", [], cover=cover(eta, reach, demand, tuple(bound)))
        for move in policy.advise(seen, RNG):
            assert bound[move.responder] is None
            bound[move.responder], moves, last = move.station, moves + 1, step
        for guard, station in enumerate(bound):
            if station is not None:
                way = stations[station] - guards[guard]
                length = np.hypot(*way)
                guards[guard] += way * min(1.0, 13.0 / max(length, 1e-9))
                bound[guard] = None if length <= 13.0 else station
    assert moves <= 12
    assert last < 100


def _far(a, b):
    return np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
