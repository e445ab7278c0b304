"""Manoeuvres of a robot on a mission, step by step: aside, and out of a jam."""

import math

import numpy as np
import pytest

from dva_sim.agents.observation import Observation
from dva_sim.agents.robot.collision_guard import KEEP_ROBOT, CollisionGuard, Nearby
from dva_sim.agents.robot.manoeuvres import (
    FREE_FOR,
    NOBODY_MOVES,
    Aside,
    Intent,
    JamRecovery,
    Sensed,
)

RADIUS, MOST_TURN = 0.30, 0.5
WAY = np.stack([np.arange(-4.0, 8.0, 0.2), np.zeros(60)], 1)  # along x
PLACE = (0.0, 2.0)  # beside it
WAITS = Intent(0.0, 0.0)


def seen(now: float, here: tuple[float, float], *others: Nearby, heading: float = 0.0) -> Sensed:
    return Sensed(now, Observation(0, *here, heading, 0.0, 0.0, ()), others)


def other(y: float, vy: float) -> Nearby:
    return Nearby("robot", "robot-2", 0.0, y, 0.0, vy, RADIUS, KEEP_ROBOT)


def aside(*others: Nearby) -> Aside:
    """A robot that has reached the place."""
    made = Aside(seen(0.0, PLACE), PLACE, WAY, RADIUS, MOST_TURN)
    made.step(seen(0.0, PLACE, *others))
    return made


@pytest.mark.parametrize(
    ("passer", "is_free"),
    [
        (other(-3.0, 0.0), True),
        (other(-0.75, 0.0), True),
        (other(-0.65, 0.0), False),
        (other(-3.0, 1.0), True),  # in two seconds a metre off
        (other(-2.5, 1.0), False),
        (other(-1.5, 1.0), False),
        (other(-1.0, -1.0), True),
    ],
)
def test_the_way_is_free_if_nobody_is_there_or_will_be_within_two_seconds(passer, is_free):
    made = aside(passer)
    assert made.step(seen(FREE_FOR - 0.1, PLACE, passer)) == WAITS
    assert made.step(seen(FREE_FOR, PLACE, passer)) == (None if is_free else WAITS)


def test_a_way_that_was_free_for_less_than_a_moment_is_not():
    made = aside()
    assert made.step(seen(0.9, PLACE, other(0.0, 0.0))) == WAITS
    assert made.step(seen(1.0, PLACE)) == WAITS
    assert made.step(seen(1.9, PLACE)) == WAITS
    assert made.step(seen(2.0, PLACE)) is None


def test_nobody_waits_long_for_who_does_not_move():
    made, parked = aside(other(0.0, 0.3)), other(0.0, 0.0)
    assert made.step(seen(NOBODY_MOVES, PLACE, parked)) == WAITS
    assert made.step(seen(NOBODY_MOVES + 0.1, PLACE, parked)) is None


@pytest.mark.parametrize(("heading", "drives"), [(math.pi / 2, True), (-math.pi / 2, False)])
def test_a_robot_turns_to_its_place_before_it_drives_there(heading, drives):
    made = Aside(seen(0.0, (0.0, 0.0)), PLACE, WAY, RADIUS, MOST_TURN)
    intent = made.step(seen(0.1, (0.0, 0.0), other(0.0, 0.0), heading=heading))
    assert (intent.speed > 0.0) is drives
    assert abs(intent.turn_rate) <= MOST_TURN


def test_a_jammed_robot_turns_to_the_open_side_and_leaves():
    """A wall ahead, at x = 0.4 m; headings that were tried are not tried again."""
    guard = CollisionGuard(RADIUS, 1.0, lambda points: 0.4 - points[:, 0])
    begin = seen(0.0, (0.0, 0.0))
    out = JamRecovery(begin, guard, MOST_TURN, [])
    assert math.cos(out.heading) < 0.1
    again = JamRecovery(begin, guard, MOST_TURN, [out.heading])
    assert abs(math.remainder(again.heading - out.heading, 2 * math.pi)) > 0.3
    assert math.cos(again.heading) < 0.1
    turn = out.step(seen(0.1, (0.0, 0.0)))
    assert (turn.speed, abs(turn.turn_rate)) == (0.0, MOST_TURN)
    drive = out.step(seen(5.0, (0.0, 0.0), heading=out.heading))
    assert drive.speed > 0.0
    assert out.step(seen(9.0, (-1.5, 0.0), heading=out.heading)) is None
