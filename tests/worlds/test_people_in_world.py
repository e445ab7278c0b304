"""People as bodies: they walk, are stopped by walls, push and are pushed by robots."""

import math

import pytest

from dva_sim.errors import ConfigError
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import DriveSpec, World
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


def test_a_wall_or_another_person_is_no_contact_with_a_robot(world):
    one = world.add_person("guard-1", Pose(6.0, 12.0, 0.0))
    other = world.add_person("guard-2", Pose(8.0, 12.0, 0.0))
    one.walk(1.0, 0.0)
    world.advance_to(10.0)
    assert one.contacts == other.contacts == 0
    assert one.impulse == other.impulse == 0.0
    assert other.x > 8.1  # it was asleep, and was woken and pushed on


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_nobody_walks_at_a_speed_that_is_no_number(world, bad):
    with pytest.raises(ValueError, match="guard-1 cannot walk at"):
        world.add_person("guard-1", Pose(4.0, 12.0, 0.0)).walk(bad, 0.0)


def test_people_are_placed_where_there_is_room(world):
    world.add_robot("robot-1", DriveSpec(), Pose(4.0, 12.0, 0.0))
    with pytest.raises(ConfigError, match=r"person 'guard-1' does not fit .*: a robot is in its"):
        world.add_person("guard-1", Pose(4.4, 12.0, 0.0))
    world.add_person("guard-1", Pose(6.0, 12.0, 0.0))
    with pytest.raises(ConfigError, match=r"person 'guard-2' does not fit .*: another person is"):
        world.add_person("guard-2", Pose(6.1, 12.0, 0.0))
    with pytest.raises(ConfigError, match=r"robot 'robot-2' does not fit .*: a person is in its"):
        world.add_robot("robot-2", DriveSpec(), Pose(6.5, 12.0, 0.0))


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
