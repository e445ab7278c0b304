"""Robots on missions, in real physics on the site caparica: corridors of 2.4 m, doors of 1.1 m.

The main corridor runs along y = 12 m; the door between control room and server room is 1.1 m wide
at (33.15, 18.2); the canteen has doors at (19.65, 10.8) and (26, 8.8).
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.wording import unnamed
from helpers.worlds.robot_fleet import Fleet, Robot, caparica

from dva_sim.agents.robot.collision_guard import PERSONAL
from dva_sim.agents.robot.field_of_view import HazardSpot
from dva_sim.agents.robot.manoeuvres import INSPECT_FOR, LOOK_FROM
from dva_sim.agents.robot.missions import (
    GIVE_UP_AFTER,
    MAX_JAMS,
    REACHED_WITHIN_M,
    RESERVE,
    MissionGoal,
)
from dva_sim.agents.robot.profile import RobotProfile
from dva_sim.protocol import messages as m
from dva_sim.worlds.site import Site

WEST, EAST = (6.0, 12.0), (20.0, 12.0)
SOUTH_OF_DOOR, NORTH_OF_DOOR = (33.15, 16.0), (33.15, 20.5)
EASTWARD, NORTHWARD, WESTWARD, SOUTHWARD = 0.0, math.pi / 2, math.pi, -math.pi / 2


def to(*goals: tuple[float, float], laps: int = 1) -> MissionGoal:
    return MissionGoal(goals, laps)


def closed(*doors: tuple[float, float, float, float]) -> Site:
    """The site with some doors closed, of which no robot's map knows."""
    site = caparica()
    return replace(site, walls=np.vstack([site.walls, np.array(doors)]))


def untouched(*robots: Robot) -> bool:
    return all(robot.body.contacts == 0 for robot in robots)


@pytest.fixture
def fleet() -> Fleet:
    return Fleet()


# --- getting there ------------------------------------------------------------------------


def test_a_robot_visits_its_waypoints_in_order_and_is_done(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to((13.1, 12.0), (13.1, 20.0)))
    fleet.run(120.0)
    assert robot.end == ("done", "")
    assert math.dist(robot.here, (13.1, 20.0)) < REACHED_WITHIN_M + 0.05
    assert [step.left for _, step in robot.steps] == [2, 1, 0]
    assert untouched(robot)


def test_a_patrol_goes_round_as_often_as_it_was_told(fleet):
    beat = ((9.0, 12.0), WEST)
    robot = fleet.robot(1, (*WEST, EASTWARD), to(*beat, laps=3))
    fleet.run(400.0)
    assert robot.end == ("done", "")
    assert [step.left for _, step in robot.steps] == [2, 1, 2, 1, 2, 1, 0]
    legs = 3.0 + 5 * 3.0
    assert robot.body.distance == pytest.approx(
        legs - 6 * 2 * REACHED_WITHIN_M + REACHED_WITHIN_M, abs=1.0
    )


def test_a_patrol_without_a_number_of_laps_does_not_end(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to((8.0, 12.0), WEST, laps=0))
    fleet.run(300.0)
    assert not robot.over
    assert len(robot.steps) > 8


def test_there_is_no_way_into_a_wall_block_and_the_robot_says_so_at_once(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to((100.0, 100.0)))
    fleet.run(10.0)
    assert robot.end == ("failed", "no way")
    assert fleet.now < 0.5


def test_a_message_becomes_an_errand():
    to_xy = lambda latitude, longitude: (10 * latitude, 10 * longitude)  # noqa: E731
    one, two = m.Position(1.0, 2.0), m.Position(3.0, 4.0)
    base = (5.0, 6.0)
    assert MissionGoal.of(m.GoTo((one, two)), to_xy, base) == MissionGoal(
        ((10.0, 20.0), (30.0, 40.0))
    )
    assert MissionGoal.of(m.Patrol((one,), 0), to_xy, base) == MissionGoal(((10.0, 20.0),), laps=0)
    assert MissionGoal.of(m.ReturnToBase(), to_xy, base) == MissionGoal((base,), home=True)
    look = MissionGoal.of(m.Inspect(3, "flood", two), to_xy, base)
    assert look == MissionGoal(((30.0, 40.0),), event="flood")


CAR = RobotProfile(
    mass_kg=2.0, radius_m=0.24, max_speed_mps=0.8, max_turn_rate_rad_s=1.5, drive="three_way"
).drive_spec()


@pytest.mark.parametrize("heading", [EASTWARD, WESTWARD])
def test_a_car_that_cannot_turn_on_the_spot_turns_in_the_corridor(fleet, heading):
    robot = fleet.robot(1, (*WEST, heading), to((13.1, 12.0), (13.1, 20.0)), CAR)
    assert robot.body.motors.turning_radius > 0.3
    fleet.run(60.0)
    assert robot.end == ("done", "")
    assert untouched(robot)


# --- other robots -------------------------------------------------------------------------


def test_two_that_meet_head_on_in_a_corridor_get_past_each_other(fleet):
    east = fleet.robot(1, (*WEST, EASTWARD), to(EAST))
    west = fleet.robot(2, (*EAST, WESTWARD), to(WEST))
    fleet.run(120.0)
    assert east.end == west.end == ("done", "")
    assert untouched(east, west)
    assert min(fleet.gaps) > 0.05
    alone = math.dist(WEST, EAST) / 0.5
    assert fleet.now < alone + 10.0


@pytest.mark.parametrize(("south", "north"), [(1, 2), (2, 1)])
def test_at_a_door_that_lets_one_through_the_lower_number_goes_first(fleet, south, north):
    a = fleet.robot(south, (*SOUTH_OF_DOOR, NORTHWARD), to(NORTH_OF_DOOR))
    b = fleet.robot(north, (*NORTH_OF_DOOR, SOUTHWARD), to(SOUTH_OF_DOOR))
    fleet.run(120.0)
    assert a.end == b.end == ("done", "")
    assert untouched(a, b)
    first, second = (a, b) if south == 1 else (b, a)
    assert first.when("done") < second.when("done") - 5.0
    assert not unnamed(second.reasons(), "somebody")
    assert unnamed(first.reasons(), "somebody")


def test_who_is_in_the_door_already_goes_first_whatever_its_number(fleet):
    within = fleet.robot(2, (33.15, 18.2, SOUTHWARD), to(SOUTH_OF_DOOR))
    comes = fleet.robot(1, (33.15, 15.6, NORTHWARD), to(NORTH_OF_DOOR))
    fleet.run(120.0)
    assert within.end == comes.end == ("done", "")
    assert within.when("done") < 10.0
    assert untouched(within, comes)


@pytest.mark.system
def test_five_in_one_corridor_all_arrive(fleet):
    for number, x in enumerate((4.0, 6.0), 1):
        fleet.robot(number, (x, 12.0, EASTWARD), to((28.0 + 2 * number, 12.0)))
    for number, x in enumerate((24.0, 26.5, 29.0), 3):
        fleet.robot(number, (x, 12.0, WESTWARD), to((1.0 + 2 * number, 12.0)))
    fleet.run(300.0)
    assert [robot.end[0] for robot in fleet.robots] == ["done"] * 5
    assert untouched(*fleet.robots)


def test_a_robot_that_is_parked_in_the_corridor_is_driven_around(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to(EAST))
    parked = fleet.parked(2, 12.0, 12.0)
    fleet.run(120.0)
    assert robot.end == ("done", "")
    assert untouched(robot)
    assert parked.distance == 0.0


def test_where_somebody_stands_in_the_only_door_there_is_no_way_after_a_minute(fleet):
    robot = fleet.robot(1, (*SOUTH_OF_DOOR, NORTHWARD), to(NORTH_OF_DOOR))
    fleet.parked(2, 33.15, 18.2)
    fleet.run(120.0)
    assert robot.end == ("failed", "no way")
    assert robot.when("failed") == pytest.approx(GIVE_UP_AFTER, abs=2.0)
    assert not unnamed(robot.reasons(), "a robot")
    assert untouched(robot)


def test_a_place_where_somebody_stands_already_counts_as_visited_from_beside_it(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to((12.0, 12.0), WEST))
    fleet.parked(2, 12.0, 12.0)
    fleet.run(120.0)
    assert robot.end == ("done", "")
    assert untouched(robot)


# --- people -------------------------------------------------------------------------------


def test_beside_somebody_who_stands_at_the_wall_a_robot_is_slow_and_keeps_its_distance(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to(EAST))
    fleet.person(12.0, 12.9)
    fleet.run(120.0)
    assert robot.end == ("done", "")
    assert min(fleet.gaps) >= PERSONAL == 0.45
    nearest = fleet.gaps.index(min(fleet.gaps))
    assert robot.speeds[nearest] < 0.30
    assert max(robot.speeds) > 0.48


def test_somebody_who_walks_towards_a_robot_passes_it_without_a_touch(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to(EAST))
    person = fleet.person(20.0, 12.0, vx=-1.2)
    fleet.run(120.0, lambda: person.walk(0.0, 0.0) if person.x < 3.0 else None)
    assert robot.end == ("done", "")
    assert person.x < 3.0
    assert person.contacts == 0
    nearest = fleet.gaps.index(min(fleet.gaps))
    assert robot.speeds[nearest] < 0.05  # the person walks past, the robot stands


def test_somebody_who_stands_in_the_middle_is_gone_around_and_never_touched(fleet):
    robot = fleet.robot(1, (*WEST, EASTWARD), to(EAST))
    person = fleet.person(12.0, 12.0)
    fleet.run(200.0)
    assert robot.end == ("done", "")
    assert not unnamed(robot.reasons(), "a person", "closed")
    assert person.contacts == 0
    assert min(fleet.gaps) > 0.2


def test_what_no_sensor_can_see_changes_nothing():
    """Behind walls, and beyond eight metres, others are not there for a robot."""

    def trail(*others: tuple[float, float]) -> list[tuple[float, ...]]:
        fleet = Fleet()
        robot = fleet.robot(1, (*WEST, EASTWARD), to((10.0, 12.0)))
        for x, y in others:
            fleet.person(x, y)
        points: list[tuple[float, ...]] = []
        fleet.run(30.0, lambda: points.append(robot.body.pose()))
        return points

    beside, far = (8.0, 14.2), (24.0, 12.0)
    assert trail(beside, far) == trail()
    assert trail((9.0, 12.9)) != trail()


# --- jams and power -----------------------------------------------------------------------


def test_a_robot_that_runs_into_a_door_not_known_to_be_closed_takes_another_way():
    fleet = Fleet(closed((19.0, 10.8, 20.3, 10.8)))
    robot = fleet.robot(1, (19.6, 12.2, SOUTHWARD), to((19.6, 8.0)))
    fleet.run(300.0)
    assert "jammed" in robot.reasons()
    assert robot.end == ("done", "")
    assert robot.body.jams >= 1
    around = robot.body.distance
    assert around > 15.0  # by the door at (26, 8.8), where the straight way is 4 m


def test_a_robot_that_cannot_get_in_has_failed_after_so_many_jams():
    fleet = Fleet(closed((32.6, 18.2, 33.7, 18.2)))
    robot = fleet.robot(1, (*SOUTH_OF_DOOR, NORTHWARD), to(NORTH_OF_DOOR))
    fleet.run(400.0)
    assert robot.end == ("failed", "jammed")
    jammed = [step for _, step in robot.steps if step.reason == "jammed"]
    assert len(jammed) == MAX_JAMS + 1 == 4


def test_a_battery_that_is_nearly_empty_ends_a_mission_but_not_the_way_home():
    low = RESERVE - 0.01
    fleet = Fleet(charge=lambda now: 1.0 if now < 5.0 else low)
    robot = fleet.robot(1, (*WEST, EASTWARD), to(EAST))
    fleet.run(60.0)
    assert robot.end == ("failed", "battery")
    assert robot.when("failed") == pytest.approx(5.0, abs=0.15)
    fleet = Fleet(charge=lambda now: low)
    robot = fleet.robot(1, (*WEST, EASTWARD), MissionGoal(((10.0, 12.0),), home=True))
    fleet.run(60.0)
    assert robot.end == ("done", "")


# --- inspection ---------------------------------------------------------------------------


def test_an_inspection_ends_where_the_event_is_seen_and_faces_it(fleet):
    place = (10.0, 20.0)  # in the workshop, whose door is at (6.05, 13.2)
    fleet.hazards = [HazardSpot("fire", *place, 0.5, shines=True)]
    robot = fleet.robot(1, (*EAST, WESTWARD), MissionGoal((place,), event="fire"))
    fleet.run(120.0)
    state, reason = robot.end
    assert (state, reason) == ("waiting", "fire in view")
    assert math.dist(robot.here, place) <= LOOK_FROM == 4.0
    assert abs(robot.body.speed) < 0.01
    bearing = math.atan2(place[1] - robot.body.y, place[0] - robot.body.x)
    assert abs(math.remainder(bearing - robot.body.pose().heading, 2 * math.pi)) < 0.15


def test_an_inspection_with_nothing_in_view_goes_near_looks_all_around_and_ends_by_itself(fleet):
    place = (10.0, 20.0)
    robot = fleet.robot(1, (6.05, 12.0, NORTHWARD), MissionGoal((place,), event="fire"))
    headings: list[float] = []
    fleet.run(400.0, lambda: headings.append(robot.body.pose().heading))
    assert robot.end == ("done", "nothing in view")
    assert math.dist(robot.here, place) < 1.2
    assert max(headings) - min(headings) > 2 * math.pi
    assert robot.when("done") - robot.when("waiting") == pytest.approx(INSPECT_FOR, abs=0.2)


def test_something_else_at_the_place_is_not_the_event(fleet):
    place = (10.0, 20.0)
    fleet.hazards = [
        HazardSpot("flood", *place, 0.5),
        HazardSpot("fire", 2.0, 15.0, 0.5, shines=True),
    ]
    robot = fleet.robot(1, (6.05, 12.0, NORTHWARD), MissionGoal((place,), event="fire"))
    fleet.run(100.0)
    assert robot.end == ("waiting", "nothing in view")


# --- the same again -----------------------------------------------------------------------


def test_the_same_meeting_happens_the_same_way_again():
    def meeting() -> list[tuple[float, ...]]:
        fleet = Fleet()
        fleet.robot(1, (*SOUTH_OF_DOOR, NORTHWARD), to(NORTH_OF_DOOR))
        fleet.robot(2, (*NORTH_OF_DOOR, SOUTHWARD), to(SOUTH_OF_DOOR))
        fleet.person(34.5, 16.5)
        points: list[tuple[float, ...]] = []
        fleet.run(60.0, lambda: points.extend(tuple(r.body.pose()) for r in fleet.robots))
        return points

    assert meeting() == meeting()
