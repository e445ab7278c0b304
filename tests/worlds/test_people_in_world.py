"""People as bodies: they walk, are stopped by walls, push and are pushed by robots."""

import math

import pytest

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World
from dva_sim.worlds.site import load_site

DT = 0.04


@pytest.fixture
def world():
    return World(load_site("caparica"), DT)


def test_a_person_walks_as_wanted_and_stops_within_a_metre(world):
    person = world.add_person("guard-1", Pose(4.0, 12.0, 0.0))
    person.walk(1.4, 0.0)
    world.advance_to(5.0)
    assert person.velocity == pytest.approx((1.4, 0.0), abs=1e-3)
    person.walk(0.0, 0.0)
    here = person.x
    world.advance_to(15.0)
    assert 0.3 < person.x - here < 1.0
    assert person.velocity == (0.0, 0.0)


def test_legs_push_with_bounded_force(world):
    person = world.add_person("guard-1", Pose(4.0, 12.0, 0.0))
    person.walk(30.0, 40.0)
    world.advance_to(DT)
    assert math.hypot(*person.velocity) == pytest.approx(3.0 * DT)


def test_a_person_slides_along_a_wall_and_does_not_pass_it(world):
    person = world.add_person("guard-1", Pose(10.0, 12.5, 0.0))
    person.walk(0.5, 1.0)
    world.advance_to(4.0)
    assert person.y == pytest.approx(13.2 - 0.25, abs=0.01)
    assert person.x > 11.0
    assert person.contacts == 0


def test_who_is_hit_by_a_robot_is_counted_by_both_and_feels_its_momentum(world):
    robot = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 12.0, 0.0))
    person = world.add_person("guard-1", Pose(6.0, 12.0, 0.0))
    robot.drive(0.5, 0.0, math.inf)
    while not robot.in_contact:
        world.advance_to(world.time + DT)
    assert (robot.contacts, robot.person_contacts, person.contacts) == (1, 1, 1)
    reduced_mass = 60.0 * 75.0 / (60.0 + 75.0)
    assert person.impulse == pytest.approx(reduced_mass * 0.5, rel=0.05)
    assert person.impulse == robot.impulse


def leant_on(world, heading):
    """A robot that stands, and somebody who walks against it for 10 s along x."""
    robot = world.add_robot("robot-1", DriveSpec(), Pose(20.0, 12.0, heading))
    person = world.add_person("guard-1", Pose(19.4, 12.0, 0.0))
    person.walk(1.3, 0.0)
    world.advance_to(10.0)
    return robot


@pytest.mark.parametrize("heading", [0.0, 0.5 * math.pi, math.pi])
def test_a_robot_that_stands_locks_its_wheels_and_does_not_creep_under_225_n(world, heading):
    """Rubber holds 0.8 of 589 N; motors that only brake with 1 m/s^2 would hold 60 N."""
    robot = leant_on(world, heading)
    here = robot.pose()
    assert here.x - 20.0 < 0.05  # what the blow moved it, mostly by ticks of 0.04 s
    world.advance_to(60.0)
    assert robot.pose() == here
    assert robot.velocity == (0.0, 0.0)


@pytest.mark.parametrize("heading", [0.0, 0.5 * math.pi])
def test_on_ice_a_robot_that_stands_is_pushed_along_with_the_rest_of_the_force(world, heading):
    """Mu of 0.1 holds 59 N: 225 N push robot and person together with 166 N."""
    robot = world.add_robot("robot-1", DriveSpec(), Pose(20.0, 12.0, heading))
    robot.grip = 0.1
    person = world.add_person("guard-1", Pose(19.4, 12.0, 0.0))
    person.walk(9.0, 0.0)
    world.advance_to(0.6)
    before = robot.velocity[0]
    world.advance_to(1.0)
    gained = (robot.velocity[0] - before) / 0.4
    assert gained == pytest.approx((75 * 3.0 - 0.1 * 60 * 9.81) / 135, rel=0.02)


def test_who_is_pushed_while_it_brakes_stands_all_the_same(world):
    """0.5 s of brakes and 8 time constants of 0.15 s: after 1.7 s the wheels are locked."""
    robot = world.add_robot("robot-1", DriveSpec(), Pose(10.0, 12.0, 0.0))
    person = world.add_person("guard-1", Pose(9.4, 12.0, 0.0))
    person.walk(1.3, 0.0)
    robot.drive(0.5, 0.0, 1.0)
    world.advance_to(2.6)
    assert robot.speed > 0.5
    world.advance_to(3.5)
    here = robot.x
    world.advance_to(20.0)
    assert robot.velocity == (0.0, 0.0)
    assert robot.x == here


def test_wheels_that_were_locked_roll_again_when_they_are_asked_to(world):
    robot = leant_on(world, math.pi / 2)
    robot.drive(0.5, 0.0, 12.0)
    world.advance_to(11.5)
    assert robot.speed == pytest.approx(0.5, abs=0.01)
    world.advance_to(20.0)
    assert robot.velocity == (0.0, 0.0)


def test_a_wall_or_another_person_is_no_contact_with_a_robot(world):
    one = world.add_person("guard-1", Pose(6.0, 12.0, 0.0))
    other = world.add_person("guard-2", Pose(8.0, 12.0, 0.0))
    one.walk(1.0, 0.0)
    world.advance_to(10.0)
    assert one.contacts == other.contacts == 0
    assert one.impulse == other.impulse == 0.0
    assert other.x > 8.1  # it was asleep, and was woken and pushed on


def test_neighbours_are_those_within_a_distance_the_nearest_first(world):
    far = world.add_robot("robot-1", DriveSpec(), Pose(7.0, 12.0, 0.0))
    near = world.add_person("guard-1", Pose(5.0, 12.5, 0.0))
    world.add_person("guard-2", Pose(12.0, 12.0, 0.0))
    assert world.neighbours(5.0, 12.0, 3.0) == [(near, 0.5), (far, 2.0)]
    assert world.neighbours(5.0, 12.0, 1.9) == [(near, 0.5)]
    assert world.neighbours(20.0, 12.0, 3.0) == []


def test_neighbours_are_found_where_they_have_moved_to(world):
    robot = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 12.0, 0.0))
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(20.0)
    (found, distance), *others = world.neighbours(robot.x + 0.1, 12.0, 0.2)
    assert (found, others) == (robot, [])
    assert distance == pytest.approx(0.1)
