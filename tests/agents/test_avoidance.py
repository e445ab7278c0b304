"""Lanes past others, who goes first, and where to step aside: a corridor of 2.4 m along x."""

import numpy as np
import pytest

from dva_sim.agents.robot.avoidance import (
    CREEP,
    REFUGE,
    SOCIAL,
    SPARE,
    Avoidance,
    Blocked,
    Lane,
    pace_among,
)
from dva_sim.agents.robot.collision_guard import KEEP_ROBOT, PERSONAL, Nearby
from dva_sim.agents.route_following import Route

HALF = 1.2  # of the corridor [m]
ROUTE = Route(np.array([[0.0, 0.0], [20.0, 0.0]]))
HERE = (2.0, 0.0)


def corridor(name: str = "robot-5", half: float = HALF) -> Avoidance:
    return Avoidance(name, 0.30, lambda points: half - np.abs(points[:, 1]))


def robot(number: int, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> Nearby:
    return Nearby("robot", f"robot-{number}", x, y, vx, vy, 0.30, KEEP_ROBOT)


def person(x: float, y: float, vx: float = 0.0) -> Nearby:
    return Nearby("person", "person-1", x, y, vx, 0.0, 0.25, PERSONAL)


def choose(avoidance: Avoidance, *others: Nearby, last: float = 0.0) -> Lane | Blocked:
    return avoidance.lane(ROUTE, HERE[0], HERE, others, last)


def test_with_nobody_in_the_way_the_lane_is_the_planned_way():
    lane = choose(corridor(), robot(1, 5.0, 3.0))
    assert isinstance(lane, Lane)
    assert lane.side == 0.0
    assert np.abs(lane.points[:, 1]).max() < 1e-9


@pytest.mark.parametrize("vx", [0.0, -0.5])
def test_who_stands_or_comes_in_the_middle_is_passed_on_the_right(vx):
    lane = choose(corridor(), robot(1, 5.0, 0.0, vx))
    assert isinstance(lane, Lane)
    assert -0.85 < lane.side < -0.6
    assert np.abs(lane.points[:, 1]).max() <= HALF - 0.30


def test_who_is_on_the_right_is_passed_on_the_left():
    lane = choose(corridor(), robot(1, 5.0, -0.6))
    assert isinstance(lane, Lane)
    assert lane.side > 0.0


def test_a_choice_is_kept_while_it_is_as_good():
    """Both sides are free: who has begun to pass on the left goes on there."""
    lane = choose(corridor(), robot(1, 5.0, 0.0), last=0.7)
    assert isinstance(lane, Lane)
    assert lane.side > 0.6


def test_two_who_meet_choose_sides_that_suit_each_other():
    mine = choose(corridor("robot-1"), robot(2, 5.0, 0.0, -0.5))
    back = Route(np.array([[20.0, 0.0], [0.0, 0.0]]))
    other = corridor("robot-2").lane(back, 15.0, (5.0, 0.0), [robot(1, 2.0, 0.0, 0.5)], 0.0)
    assert isinstance(mine, Lane)
    assert isinstance(other, Lane)
    assert mine.points[:, 1].min() < -0.6
    assert other.points[:, 1].max() > 0.6


def test_in_a_corridor_of_one_and_a_half_metres_nobody_can_be_passed():
    blocked = choose(corridor(half=0.75), robot(1, 5.0, 0.0))
    assert isinstance(blocked, Blocked)
    assert blocked.by.name == "robot-1"
    assert blocked.distance == pytest.approx(5.0 - 2.0 - 0.60 - KEEP_ROBOT, abs=0.25)


def test_people_are_given_more_room_than_robots():
    """0.82 m to the side leaves a robot 0.22 m and a person 0.27 m: enough for one alone."""
    assert isinstance(choose(corridor(), robot(1, 5.0, 0.0)), Lane)
    blocked = choose(corridor(), person(5.0, 0.0))
    assert isinstance(blocked, Blocked)
    assert isinstance(choose(corridor(), person(5.0, 0.95)), Lane)


def test_who_goes_first():
    wide, narrow = corridor("robot-5"), corridor("robot-5", half=0.55)
    assert wide.yields_to(HERE, [person(5.0, 0.0)]) == [True]
    assert wide.yields_to(HERE, [robot(4, 5.0, 0.0)]) == [True]
    assert wide.yields_to(HERE, [robot(6, 5.0, 0.0)]) == [False]
    assert wide.yields_to(HERE, [robot(10, 5.0, 0.0)]) == [False]  # ten is more than five
    assert narrow.yields_to(HERE, [robot(4, 5.0, 0.0)]) == [True]


def test_who_is_in_the_narrow_part_goes_first_whatever_its_number():
    def door(points: np.ndarray) -> np.ndarray:
        return np.where(np.abs(points[:, 0] - 5.0) < 0.5, 0.55, 2.0)

    outside, inside = Avoidance("robot-1", 0.30, door), Avoidance("robot-9", 0.30, door)
    assert outside.yields_to((2.0, 0.0), [robot(9, 5.0, 0.0)]) == [True]
    assert inside.yields_to((5.0, 0.0), [robot(1, 2.0, 0.0)]) == [False]


def test_a_refuge_is_beside_the_way_with_room_for_who_passes():
    way = np.stack([np.arange(-4.0, 8.0, 0.2), np.zeros(60)], 1)
    place = corridor().refuge(HERE, way, [robot(1, 5.0, 0.0, -0.5)])
    assert place is not None
    assert 0.75 <= abs(place[1]) <= HALF - 0.30
    assert corridor(half=0.75).refuge(HERE, way, [robot(1, 5.0, 0.0)]) is None


WAY = np.stack([np.arange(-4.0, 8.0, 0.2), np.zeros(60)], 1)


def test_who_stands_at_a_wall_already_still_finds_a_refuge():
    beside = (2.0, HALF - 0.30 - 0.005)
    assert corridor().refuge(beside, WAY, [robot(1, 5.0, 0.0, -0.5)]) is not None


@pytest.mark.parametrize(("wide", "finds"), [(REFUGE - 0.3, True), (REFUGE + 0.3, False)])
def test_no_refuge_is_sought_far_away(wide, finds):
    """A way so wide that a refuge beside it is this far off."""
    wide -= 0.30 + SPARE
    others = [robot(1, 5.0, 0.0)._replace(radius=wide)]
    assert (corridor(half=9.0).refuge((2.0, 0.0), WAY, others) is not None) is finds


def test_no_refuge_is_behind_a_wall():
    def walls(points: np.ndarray) -> np.ndarray:
        return np.minimum(points[:, 1] + 0.45, np.abs(points[:, 1] - 0.45))

    assert Avoidance("robot-5", 0.30, walls).refuge(HERE, WAY, [robot(1, 5.0, 0.0)]) is None


@pytest.mark.parametrize(
    ("gap", "speed"),
    [(SOCIAL, 0.5), (2.0, 0.5), (PERSONAL, CREEP), (0.1, CREEP), (0.825, (0.5 + CREEP) / 2)],
)
def test_beside_people_a_robot_slows_between_1_2_and_0_45_metres(gap, speed):
    beside = person(0.0, 0.30 + 0.25 + gap)
    assert pace_among([beside], (0.0, 0.0), 0.30, 0.5) == pytest.approx(speed)


def test_robots_slow_nobody_and_nobody_is_made_faster():
    assert pace_among([robot(1, 0.7, 0.0)], (0.0, 0.0), 0.30, 0.5) == 0.5
    assert pace_among([person(0.6, 0.0)], (0.0, 0.0), 0.30, 0.05) == 0.05
