"""The robot looks, the person stands by."""

from helpers.dva.dispatch_situations import INF, act, look, pairs, situation

from dva_sim.core.dispatch import HazardTeam


def test_a_robot_looks_at_a_fire_if_it_is_not_much_later():
    for robot, goes in ((110, 1), (111, 0)):
        seen = situation("gr", [[50, robot]], [look(kind="fire")])
        assert pairs(HazardTeam(extra_s=60), seen) == [(0, goes)]


def test_a_person_looks_where_there_is_no_robot_or_no_operator():
    fire = [look(kind="fire")]
    assert pairs(HazardTeam(), situation("gr", [[50, INF]], fire)) == [(0, 0)]
    assert pairs(HazardTeam(), situation("gr", [[50, 20]], fire, operators=0)) == [(0, 0)]
    assert pairs(HazardTeam(), situation("gr", [[INF, 999]], fire)) == [(0, 1)]


def test_a_harmless_event_goes_to_the_earliest():
    flood = situation("gr", [[50, 60]], [look(kind="flood")])
    assert pairs(HazardTeam(), flood) == [(0, 0)]
    assert pairs(HazardTeam(dangerous=["flood"]), flood) == [(0, 1)]


def test_a_person_stands_by_while_the_robot_looks():
    tasks = [look(1, "fire"), act(1, "fire", due=False)]
    assert pairs(HazardTeam(), situation("gr", [[50, 60], [50, INF]], tasks)) == [(0, 1), (1, 0)]


def test_a_person_stands_by_also_when_one_becomes_free_later():
    policy = HazardTeam()
    pairs(policy, situation("r", [[60]], [look(7, "fire")]))
    later = situation("g", [[50]], [act(7, "fire", due=False)])
    assert pairs(policy, later) == [(0, 0)]


def test_nobody_stands_by_for_a_person_who_looks():
    policy = HazardTeam()
    pairs(policy, situation("gr", [[50, INF]], [look(7, "fire")]))
    assert pairs(policy, situation("g", [[50]], [act(7, "fire", due=False)])) == []


def test_what_is_remembered_gives_way_when_the_event_is_open_again():
    policy = HazardTeam()
    pairs(policy, situation("r", [[60]], [look(7, "fire")]))
    pairs(policy, situation("g", [[50]], [look(7, "fire")]))
    assert pairs(policy, situation("g", [[50]], [act(7, "fire", due=False)])) == []


def test_what_is_due_comes_before_standing_by():
    tasks = [look(1, "fire"), act(1, "fire", due=False), act(2, "fire", due=True)]
    eta = [[50, 60], [50, INF], [50, INF]]
    assert pairs(HazardTeam(), situation("gr", eta, tasks)) == [(0, 1), (2, 0)]
