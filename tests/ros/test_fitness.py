"""Fitness of a ROS robot for driving, by the times of its messages."""

import pytest
from helpers.wording import unnamed

from dva_sim.ros.fitness import BACKLOG, Fitness
from dva_sim.ros.profile import RosLimits


@pytest.fixture
def fitness():
    fitness = Fitness(RosLimits(odometry_within_s=0.5, stands_within_s=2.0))
    fitness.connected()
    return fitness


def test_without_a_bridge_or_odometry_nobody_drives(fitness):
    assert "odometry" in fitness.problem(0.0)
    fitness.moved(0.0, None)
    assert fitness.problem(0.5) == ""
    fitness.lost("connection reset")
    assert unnamed(fitness.problem(0.5), "bridge", "connection reset") == []
    fitness.connected()
    assert "odometry" in fitness.problem(0.5)  # that of the lost bridge counts no more


def test_odometry_is_late_after_its_time_and_not_before(fitness):
    fitness.moved(1.0, None)
    assert fitness.problem(1.5) == ""
    assert unnamed(fitness.problem(1.51), "odometry", "0.5 s") == []
    fitness.moved(1.6, None)
    assert fitness.problem(1.6) == ""


def test_a_queue_that_grows_in_the_bridge_is_noticed_by_the_robots_own_clock(fitness):
    # Every 0.1 s comes odometry of 0.1 s, 0.15 s, 0.2 s, ... later: none is missing, all are old.
    for number in range(12):
        fitness.moved(0.1 * number, 5000.0 + 0.05 * number)
    assert "late" in fitness.problem(1.1)


def test_clocks_that_differ_by_hours_and_drift_a_little_are_no_lateness(fitness):
    for number in range(100_000):
        now = 0.1 * number
        fitness.moved(now, 7200.0 + now * (1.0 - 5e-5))
    assert fitness.problem(10_000.0) == ""


def test_odometry_that_stays_old_asks_for_another_bridge(fitness):
    fitness.moved(0.0, 100.0)
    fitness.moved(1.0, 100.1)
    assert "late" in fitness.problem(1.0)
    assert not fitness.needs_another_bridge(1.0 + BACKLOG)
    fitness.moved(1.1 + BACKLOG, 100.2)
    assert "late" in fitness.problem(1.1 + BACKLOG)
    assert fitness.needs_another_bridge(1.1 + BACKLOG)


def test_a_robot_that_has_not_stood_by_its_time_does_not_obey(fitness):
    fitness.moved(9.9, None)
    fitness.obeys(2.0, stopped_at=0.0, has_stood=False)
    assert fitness.problem(10.0) == ""
    fitness.obeys(2.1, stopped_at=0.0, has_stood=False)
    assert unnamed(fitness.problem(10.0), "stop", "2 s") == []
    fitness.obeys(2.2, stopped_at=0.0, has_stood=True)
    assert fitness.problem(10.0) == ""


def test_refused_odometry_is_told_by_its_reason(fitness):
    fitness.refused("header.frame_id is 'map', not 'odom'")
    assert unnamed(fitness.problem(0.0), "refused", "'map'") == []
