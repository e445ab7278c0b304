"""Ask, and take the best offer."""

import numpy as np
from helpers.dva.dispatch_situations import INF, RNG, act, look, situation

from dva_sim.core.dispatch import Announcement, Assignment, Auction

NAN = float("nan")


def advice(team, eta, tasks, bids=None, operators=9):
    bids = np.full(np.shape(eta), NAN) if bids is None else np.array(bids, dtype=float)
    return list(Auction().advise(situation(team, eta, tasks, bids=bids, operators=operators), RNG))


def test_the_oldest_task_is_announced_and_only_one_at_a_time():
    assert advice("gg", [[9, 9], [9, 9]], [look(1), look(2)]) == [Announcement(0)]
    assert advice("gg", [[9, 9], [9, 9]], [look(1, auction="open"), look(2)]) == []


def test_the_earliest_offer_wins_whatever_was_expected_and_the_next_is_announced():
    tasks = [look(1, auction="over"), look(2)]
    got = advice("ggg", [[10, 50, 60]] * 2, tasks, [[NAN, 45, 40], [NAN] * 3])
    assert got == [Assignment(0, 2), Announcement(1)]


def test_a_task_that_nobody_offered_for_lets_the_next_have_its_turn():
    assert advice("gg", [[9, 9]] * 2, [look(1, auction="over"), look(2)]) == [Announcement(1)]
    assert advice("gg", [[9, 9]] * 2, [look(1), look(2)]) == [Announcement(0)]


def test_an_offer_of_who_cannot_get_there_does_not_win():
    assert advice("gg", [[INF, 9]], [look(auction="over")], [[1, 50]]) == [Assignment(0, 1)]


def test_a_robot_wins_only_with_an_operator():
    bids = [[50, 10]]
    tasks = [look(auction="over")]
    assert advice("gr", [[9, 9]], tasks, bids, operators=1) == [Assignment(0, 1)]
    assert advice("gr", [[9, 9]], tasks, bids, operators=0) == [Assignment(0, 0)]


def test_nothing_is_announced_that_nobody_could_do():
    assert advice("gr", [[INF, 9], [9, INF]], [look(1), look(2)], operators=0) == [Announcement(1)]
    assert advice("", [[]], [look(1)]) == []


def test_who_contains_is_not_asked():
    assert advice("gg", [[30, 20]], [act()]) == [Assignment(0, 1)]
    assert advice("gg", [[30, 20]], [act(due=False)]) == []
