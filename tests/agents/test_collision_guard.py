"""The collision guard: never faster, never turning, and able to stop before whatever is ahead."""

import math

import numpy as np
import pytest
from helpers.processes.search_settings import search
from helpers.worlds.robot_fleet import EMPTY, Fleet, map_of_caparica
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.robot.collision_guard import (
    KEEP_WALL,
    PERSONAL,
    TIME_TO_CONTACT,
    CollisionGuard,
    Nearby,
)

RADIUS, DECELERATION = 0.30, 1.0
TOP = 0.5


def before_a_wall(x: float) -> CollisionGuard:
    """A guard on a plane with a wall at x [m] and nothing else."""
    return CollisionGuard(RADIUS, DECELERATION, lambda points: x - points[:, 0])


def somebody(x: float, y: float, keep: float = PERSONAL) -> Nearby:
    return Nearby("person", "person-1", x, y, 0.0, 0.0, 0.25, keep)


OPEN = before_a_wall(1e6)


def test_in_the_open_a_command_passes_as_it_is():
    assert OPEN.limit((0.0, 0.0, 0.0), 0.5, 0.3) == 0.5
    assert OPEN.limit((0.0, 0.0, 0.0), 0.0, 0.3) == 0.0


@pytest.mark.parametrize("gap", [0.05, 0.1, 0.2, 0.3, 0.4])
def test_speed_falls_with_the_clearance_ahead(gap):
    guard = before_a_wall(RADIUS + KEEP_WALL + gap)
    speed = guard.limit((0.0, 0.0, 0.0), TOP, 0.0)
    assert 0.0 <= speed <= gap / TIME_TO_CONTACT + 1e-9
    assert guard.stopping_distance(speed) <= gap


def test_far_enough_from_the_wall_it_may_go_at_full_speed():
    guard = before_a_wall(RADIUS + KEEP_WALL + TOP * TIME_TO_CONTACT + 0.1)
    assert guard.limit((0.0, 0.0, 0.0), TOP, 0.0) == TOP


def test_at_the_wall_it_may_leave_but_not_go_on():
    guard = before_a_wall(RADIUS + 0.005)
    assert guard.limit((0.0, 0.0, 0.0), TOP, 0.0) == 0.0
    assert guard.limit((0.0, 0.0, math.pi), TOP, 0.0) == TOP
    assert guard.limit((0.0, 0.0, math.pi / 2), TOP, 0.0) == TOP  # along the wall


def test_it_is_the_arc_that_counts_not_the_heading():
    guard = before_a_wall(RADIUS + 0.2)
    straight = guard.limit((0.0, 0.0, math.pi / 3), 0.4, 0.0)
    away = guard.limit((0.0, 0.0, math.pi / 3), 0.4, 0.5)
    towards = guard.limit((0.0, 0.0, math.pi / 3), 0.4, -0.5)
    assert towards < straight <= away == 0.4


def test_a_robot_stops_before_a_person_and_passes_beside_one():
    ahead, beside = somebody(1.05, 0.0), somebody(1.05, RADIUS + 0.25 + PERSONAL + 0.01)
    assert OPEN.limit((0.0, 0.0, 0.0), TOP, 0.0, [ahead]) < 0.06
    assert OPEN.limit((0.0, 0.0, 0.0), TOP, 0.0, [beside]) == TOP
    assert OPEN.limit((0.0, 0.0, math.pi), TOP, 0.0, [ahead]) == TOP


poses = st.tuples(st.floats(0.0, 40.0), st.floats(0.0, 24.0), st.floats(-4.0, 4.0))


@search(300)
@given(poses, st.floats(0.0, TOP), st.floats(-0.6, 0.6), poses)
def test_it_never_makes_anything_faster_and_what_it_allows_can_be_braked(
    pose, speed, turn_rate, other
):
    guard = CollisionGuard(RADIUS, DECELERATION, map_of_caparica().room_at)
    others = [somebody(other[0], other[1])]
    allowed = guard.limit(pose, speed, turn_rate, others)
    assert 0.0 <= allowed <= speed
    if allowed > 0.0:
        free = guard.free_way(pose, allowed, turn_rate, others, reach=2.0)
        assert guard.stopping_distance(allowed) <= free + 0.05  # samples are so far apart


@pytest.mark.parametrize("speed", [math.nan, -0.3])
def test_what_is_no_speed_is_none(speed):
    assert OPEN.limit((0.0, 0.0, 0.0), speed, 0.0) == 0.0


def joystick(seed: int, guarded: bool) -> tuple[int, float, float]:
    """Two minutes of wild driving: contacts, their impulse [N s], and the way [m]."""
    fleet, rng = Fleet(), np.random.default_rng(seed)
    robot = fleet.robot(1, (20.0, 12.0, 0.0), EMPTY)
    fleet.parked(2, 16.0, 11.6)
    fleet.person(24.0, 12.5)
    wish = (0.0, 0.0)
    for step in range(1200):
        fleet.world.advance_to(step * 0.1)
        if step % 20 == 0:
            wish = float(rng.uniform(0.1, TOP)), float(rng.uniform(-0.5, 0.5))
        speed = wish[0]
        if guarded:
            around = robot.around
            speed = around.guard.limit(robot.body.pose(), *wish, around.nearby())
        robot.body.drive(speed, wish[1], step * 0.1 + 0.2)
    return robot.body.contacts, robot.body.impulse, robot.body.distance


@pytest.mark.parametrize("seed", range(2))
def test_whoever_drives_wildly_touches_nothing_with_the_guard_and_much_without(seed):
    contacts, impulse, way = joystick(seed, guarded=True)
    assert (contacts, impulse) == (0, 0.0)
    assert way > 3.0
    contacts, impulse, _ = joystick(seed, guarded=False)
    assert contacts > 0
    assert impulse > 5.0
