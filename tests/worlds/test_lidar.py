import math

import numpy as np
import pymunk
import pytest

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.lidar import Lidar
from dva_sim.worlds.physics import World, hall
from dva_sim.worlds.site import load_site

BOX = ((0.21, 0.10), (-0.21, 0.10), (-0.21, -0.10), (0.21, -0.10))
CAR = DriveSpec(radius=0.24, corners=BOX)


def ends(pose, lidar):
    angles = pose.heading + lidar.angles
    return pose.x + lidar.reach * np.cos(angles), pose.y + lidar.reach * np.sin(angles)


def by_pymunk(world, robot, lidar):
    """The nearest hit that the physics itself finds, with the robot out of the way."""
    pose, space = robot.pose(), world.space
    robot.shape.filter = pymunk.ShapeFilter(categories=4)
    others = pymunk.ShapeFilter(mask=pymunk.ShapeFilter.ALL_MASKS() ^ 4)
    found = []
    for end in zip(*ends(pose, lidar), strict=True):
        hit = space.segment_query_first((pose.x, pose.y), end, 0.0, others)
        found.append(lidar.reach if hit is None else hit.alpha * lidar.reach)
    robot.shape.filter = pymunk.ShapeFilter(categories=2)
    return np.array(found)


def crowd(seed=1, count=12):
    """An office with robots of two shapes and people here and there."""
    world, rng = World(load_site("caparica"), 0.04), np.random.default_rng(seed)
    for number in range(count):
        x, y = world.site.sample_free(rng, 0.6)
        while world.neighbours(x, y, 1.0):
            x, y = world.site.sample_free(rng, 0.6)
        pose = Pose(x, y, rng.uniform(-9, 9))
        if number % 3 == 2:
            world.add_person(f"person-{number}", pose)
        else:
            world.add_robot(f"robot-{number}", (DriveSpec(), CAR)[number % 3], pose)
    world.space.step(1e-9)  # the physics looks where things are only when it moves them
    return world


def test_in_an_empty_hall_the_distances_are_those_of_geometry():
    world = World(hall(10.0, 6.0))
    robot = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 2.0, math.pi / 2))
    ahead, left, behind, right = Lidar(world, rays=4, reach=8.0).scan([robot])[0]
    assert [ahead, left, behind, right] == pytest.approx([4.0, 4.0, 2.0, 6.0])


def test_what_is_out_of_reach_is_not_seen():
    world = World(hall(40.0, 40.0))
    robot = world.add_robot("robot-1", DriveSpec(), Pose(20.0, 20.0, 0.3))
    assert Lidar(world, reach=8.0).scan([robot]).tolist() == [[8.0] * 36]


def test_robots_and_people_are_seen_at_their_near_side_and_the_one_that_looks_is_not():
    world = World(hall(20.0, 6.0))
    eye = world.add_robot("robot-1", DriveSpec(), Pose(4.0, 3.0, 0.0))
    world.add_robot("robot-2", CAR, Pose(8.0, 3.0, 0.0))
    world.add_person("person-1", Pose(4.0, 4.5, 0.0), radius=0.25)
    ahead, left, behind, right = Lidar(world, rays=4).scan([eye])[0]
    assert [ahead, left, behind, right] == pytest.approx([4 - 0.21, 1.25, 4.0, 3.0])


@pytest.mark.parametrize("seed", range(2))
def test_every_ray_is_as_long_as_the_physics_has_it(seed):
    world = crowd(seed, count=20)
    lidar = Lidar(world, rays=36, reach=12.0)
    for robot, scan in zip(world.robots, lidar.scan(world.robots), strict=True):
        assert scan == pytest.approx(by_pymunk(world, robot, lidar), abs=1e-9)


def test_no_ray_slips_through_the_corner_of_two_walls():
    """Walls of a closed ring, seen by rays that aim at each of its corners."""
    for corners in (4, 7, 12, 36):
        turn = 2 * np.pi * np.arange(corners + 1) / corners
        x, y = 5 + 3 * np.cos(turn), 5 + 3 * np.sin(turn)
        walls = [*zip(x[:-1], y[:-1], x[1:], y[1:], strict=True)]
        world = World(hall(10.0, 10.0, walls))
        for heading in (0.0, 0.1, -2.0):
            world.robots.clear()
            robot = world.add_robot("robot-1", DriveSpec(), Pose(5.0, 5.0, heading))
            world.space.remove(robot.body, robot.shape)
            for rays in (corners, 360):
                assert Lidar(world, rays=rays, reach=9.0).scan([robot]).max() < 3.001


def test_who_is_scanned_with_whom_changes_nothing():
    world = crowd()
    lidar = Lidar(world)
    together = lidar.scan(world.robots)
    alone = [lidar.scan([robot])[0].tolist() for robot in reversed(world.robots)]
    assert together.tolist() == alone[::-1]


def test_nobody_asks_and_nothing_is_cast():
    world = crowd()
    assert Lidar(world).scan([]).shape == (0, 36)


def test_to_read_one_after_the_other_gives_what_a_scan_gives():
    world = crowd()
    lidar, other = Lidar(world), Lidar(world)
    for robot in world.robots:
        robot.drive(0.5, 0.4, math.inf)
    for tick in range(40):
        world.advance_to(0.04 * tick)
        for robot in world.robots[tick % 3 :: 1 + tick % 2]:
            assert lidar.read(robot).tolist() == other.scan([robot])[0].tolist()


def test_who_listens_is_scanned_together_and_who_has_ceased_to_is_not(monkeypatch):
    world, scanned = crowd(), []
    lidar = Lidar(world)
    scan = lidar.scan
    monkeypatch.setattr(lidar, "scan", lambda bodies: scanned.append(len(bodies)) or scan(bodies))
    world.robots[-1].drive(0.1, 0.0, math.inf)
    for tick in range(20):
        world.advance_to(0.04 * tick)
        for robot in world.robots[: 6 if tick < 3 else 1]:
            lidar.read(robot)
    assert scanned[:6] == [1] * 6  # nobody is known yet
    assert scanned[6:8] == [6, 6]
    assert scanned[-1] == 1
    assert len(scanned) == 6 + 19
