"""Contacts: what counts as one, when a robot is jammed, and how it gets free."""

import math

import pytest

from dva_sim.agents.robot.profile import load_robot
from dva_sim.worlds.bodies import JAM_TIME, Contacts
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World, hall

DT = 0.04
CAR = load_robot("pibot").drive_spec()


def before_a_wall(spec, gap=0.1):
    """A robot that faces a wall, so far before it [m]."""
    world = World(hall(10.0, 10.0), DT)
    nose = spec.corners[0][0] if spec.corners else spec.radius
    return world, world.add_robot("robot-1", spec, Pose(10.0 - nose - gap, 5.0, 0.0))


def test_touching_again_within_half_a_second_is_the_same_contact():
    contacts = Contacts()
    for begin, end in ((1.0, 1.2), (1.6, 2.0), (2.6, 3.0)):
        contacts.begin(begin)
        contacts.end(end)
    assert contacts.count == 2


def test_two_shapes_at_once_are_one_contact_until_both_are_left():
    contacts = Contacts()
    contacts.begin(1.0)
    contacts.begin(9.0)
    contacts.end(20.0)
    contacts.begin(21.0)
    assert (contacts.count, contacts.touching) == (1, 2)


@pytest.mark.parametrize("spec", [DriveSpec(), CAR])
def test_a_robot_that_strains_against_a_wall_is_jammed_after_five_seconds(spec):
    world, robot = before_a_wall(spec)
    robot.drive(0.5, 0.0, math.inf)
    while not robot.in_contact:
        world.advance_to(world.time + DT)
    begun = world.time
    world.advance_to(begun + JAM_TIME - 0.5)
    assert not robot.jammed
    world.advance_to(begun + JAM_TIME + 0.5)
    assert robot.jammed
    world.advance_to(60.0)
    assert (robot.jammed, robot.jams, robot.contacts) == (True, 1, 1)


def test_time_in_which_nothing_is_asked_does_not_count_and_resets_nothing():
    world, robot = before_a_wall(DriveSpec(), gap=0.0)
    for begin in (0.0, 10.0, 20.0):
        robot.drive(0.5, 0.0, begin + 2.0)
        world.advance_to(begin + 10.0)
        assert robot.jammed == (begin == 20.0)


def test_a_robot_that_stands_at_a_wall_is_not_jammed():
    world, robot = before_a_wall(DriveSpec(), gap=0.0)
    robot.drive(0.0, 0.0, math.inf)
    world.advance_to(60.0)
    assert not robot.jammed


def test_a_robot_without_power_is_not_jammed():
    world, robot = before_a_wall(DriveSpec(), gap=0.0)
    robot.powered = False
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(60.0)
    assert (robot.jams, robot.speed) == (0, 0.0)


def test_who_turns_on_the_spot_gets_free_and_drives_away():
    world, robot = before_a_wall(DriveSpec())
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(10.0)
    assert robot.jammed
    robot.drive(0.0, 0.5, 10.0 + math.pi / 0.5)
    world.advance_to(11.0)
    assert not robot.jammed
    world.advance_to(20.0)
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(25.0)
    assert robot.x < 9.0
    assert not robot.in_contact


def test_a_car_with_its_nose_at_a_wall_stays_jammed_whichever_way_it_steers():
    world, robot = before_a_wall(CAR)
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(10.0)
    for turn_rate in (1.5, -1.5, 0.0):
        robot.drive(0.0, turn_rate, math.inf)
        world.advance_to(world.time + 10.0)
        assert robot.jammed
    assert robot.jams == 1


def test_who_is_pushed_out_is_free():
    world, robot = before_a_wall(CAR)
    robot.drive(0.5, 0.0, 12.0)
    world.advance_to(12.0)
    assert robot.jammed
    pusher = world.add_robot("robot-2", DriveSpec(), Pose(9.69, 4.4, math.pi / 2))
    pusher.drive(0.5, 0.0, 14.0)
    world.advance_to(15.0)
    assert not robot.jammed


def test_robots_that_block_each_other_are_both_jammed():
    world = World(hall(10.0, 10.0), DT)
    left = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 5.0, 0.0))
    right = world.add_robot("robot-2", DriveSpec(), Pose(6.0, 5.0, math.pi))
    left.drive(0.5, 0.0, math.inf)
    right.drive(0.5, 0.0, math.inf)
    world.advance_to(20.0)
    assert left.jammed
    assert right.jammed


def test_a_person_in_the_way_jams_a_robot_and_the_contact_is_counted_as_one_with_a_person():
    world = World(hall(10.0, 10.0), DT)
    robot = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 5.0, 0.0))
    world.add_person("guard-1", Pose(6.0, 5.0, 0.0)).walk(-0.1, 0.0)
    robot.drive(0.1, 0.0, math.inf)
    world.advance_to(40.0)
    assert (robot.contacts, robot.person_contacts) == (1, 1)


def test_power_that_fails_brakes_the_robot_and_comes_back():
    world, robot = World(hall(30.0, 30.0), DT), None
    robot = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 5.0, 0.0))
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(5.0)
    robot.powered = False
    start = robot.x
    world.advance_to(10.0)
    assert robot.speed == 0.0
    assert robot.x - start <= robot.spec.stopping_distance + 0.5 * DT
    robot.powered = True
    world.advance_to(15.0)
    assert robot.speed == pytest.approx(0.5, abs=1e-3)
