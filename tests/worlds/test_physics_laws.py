"""The laws that no robot breaks: energy, momentum, friction, and that walls are solid."""

import math

import numpy as np
import pytest
import shapely
from helpers.processes.search_settings import search
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.robot.profile import load_robot
from dva_sim.simulation.full.physical_world import PHYSICS_TICK
from dva_sim.simulation.full.team import WET_GRIP
from dva_sim.worlds.drives import MAX_TICK, DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World, hall

DT, G, MASS = 0.02, 9.81, 60.0
SPEC = DriveSpec()


def on_floor(grip=0.8, spec=SPEC, heading=0.0, dt=DT):
    """A robot in the middle of a large empty hall."""
    world = World(hall(60.0, 60.0), dt)
    robot = world.add_robot("robot-1", spec, Pose(30.0, 30.0, heading))
    robot.grip = grip
    return world, robot


def shove(robot, vx, vy, spin=0.0):
    """Give a robot a velocity at once, as if hit; its motors are to stop it."""
    robot.body.velocity, robot.body.angular_velocity = (vx, vy), spin
    robot.drive(0.0, 0.0, math.inf)


def kinetic_energy(robot):
    body = robot.body
    turning = 0.5 * body.moment * body.angular_velocity**2
    return 0.5 * body.mass * body.velocity.length_squared + turning


def ticks(world, count):
    for _ in range(count):
        world.advance_to(world.time + world.dt)
        yield


# --- friction with the floor -----------------------------------------------------------


@pytest.mark.parametrize("grip", [0.8, 0.3, 0.1])
def test_what_is_shoved_sideways_loses_the_work_of_friction_and_slides_v2_over_2_mu_g(grip):
    world, robot = on_floor(grip)
    shove(robot, 0.0, 2.0)
    while robot.body.velocity.y > grip * G * DT:
        before, speed = kinetic_energy(robot), robot.body.velocity.y
        next(ticks(world, 1))
        way = 0.5 * (speed + robot.body.velocity.y) * DT
        assert before - kinetic_energy(robot) == pytest.approx(grip * MASS * G * way)
    world.advance_to(world.time + 1.0)
    slid = robot.y - 30.0
    assert slid == pytest.approx(2.0**2 / (2 * grip * G), abs=2.0 * DT)
    assert robot.velocity == (0.0, 0.0)


@pytest.mark.parametrize("grip", [0.1, 0.05, 0.02])
def test_on_a_wet_floor_the_stopping_distance_is_v2_over_2_mu_g_whatever_the_brakes(grip):
    brakes = DriveSpec(max_deceleration=8.0, motor_time_constant=DT)
    world, robot = on_floor(grip, brakes)
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(30.0)
    assert robot.speed == pytest.approx(0.5)
    start = robot.x
    robot.drive(0.0, 0.0, math.inf)
    world.advance_to(50.0)
    assert robot.speed == 0.0
    assert robot.x - start == pytest.approx(0.5**2 / (2 * grip * G), abs=0.5 * DT)


@pytest.mark.parametrize("grip", [0.8, 0.1, 0.02])
def test_the_floor_changes_a_velocity_by_no_more_than_mu_g_dt_whatever_is_asked(grip):
    sporty = DriveSpec(max_speed=1.5, max_turn_rate=6.0, max_acceleration=9.0)
    world, robot = on_floor(grip, sporty)
    rng, largest = np.random.default_rng(1), 0.0
    for _ in range(60):
        robot.drive(rng.choice([0.0, 1.5]), rng.uniform(-6, 6), math.inf)
        for _ in range(20):
            before = robot.body.velocity
            next(ticks(world, 1))
            largest = max(largest, (robot.body.velocity - before).length)
    assert largest <= grip * G * DT * (1 + 1e-9)
    assert largest == pytest.approx(grip * G * DT)  # and it is used to the full


def ends(spec, grip):
    """Final poses after hard starts, stops and curves, on a floor of that grip."""
    world, robot = on_floor(grip, spec, dt=0.04)
    rng = np.random.default_rng(3)
    for _ in range(40):
        speed, turn_rate = rng.choice([0.0, 0.7, 1.0]), rng.choice([-1.0, -0.5, 0.0, 1.0])
        robot.drive(speed * spec.max_speed, turn_rate * spec.max_turn_rate, math.inf)
        world.advance_to(world.time + 0.6)
    return robot.pose()


@pytest.mark.parametrize("name", ["servrobot", "pibot", "tracked"])
def test_shipped_robots_drive_on_a_wet_floor_as_on_a_dry_one(name):
    spec = load_robot(name).drive_spec()
    assert ends(spec, WET_GRIP) == ends(spec, 0.8)


@pytest.mark.parametrize(("grip", "holds"), [(0.8, 6.0), (WET_GRIP, WET_GRIP * G)])
def test_brakes_of_6_m_s2_are_more_than_a_wet_floor_holds(grip, holds):
    spec = DriveSpec(max_speed=1.5, max_deceleration=6.0, motor_time_constant=DT)
    world, robot = on_floor(grip, spec)
    robot.drive(1.5, 0.0, 6.0)
    world.advance_to(6.0)
    start = robot.x
    world.advance_to(8.0)
    assert robot.speed == 0.0
    assert robot.x - start == pytest.approx(1.5**2 / (2 * holds), abs=1.5 * DT)


def test_a_robot_skids_out_of_a_curve_that_the_floor_cannot_hold():
    """1 m/s and 1 rad/s want 1 m/s^2 across; ice of 0.05 gives half of it."""
    sporty = DriveSpec(max_speed=1.0, max_turn_rate=1.0, max_acceleration=2.0)

    def radius(grip):
        world, robot = on_floor(grip, sporty)
        robot.drive(1.0, 0.0, math.inf)
        world.advance_to(6.0)
        robot.drive(1.0, 1.0, math.inf)
        world.advance_to(8.0)
        (vx, vy), (x, y) = robot.velocity, (robot.x, robot.y)
        next(ticks(world, 1))
        turned = math.atan2(robot.velocity[1], robot.velocity[0]) - math.atan2(vy, vx)
        return math.dist((x, y), (robot.x, robot.y)) / turned

    assert radius(0.8) == pytest.approx(1.0, rel=0.05)
    assert radius(0.05) > 1.5


def test_on_ice_nobody_spins_up_faster_than_friction_allows():
    world, robot = on_floor(grip=0.01)
    robot.drive(0.0, SPEC.max_turn_rate, math.inf)
    next(ticks(world, 2))
    most = 0.01 * G * 0.5 * SPEC.radius / (0.5 * SPEC.radius**2)  # mu g times arm, by inertia
    list(ticks(world, 10))
    assert robot.turn_rate <= 12 * most * DT
    assert robot.turn_rate > 0.0


# --- energy and momentum ---------------------------------------------------------------


def test_what_the_motors_do_becomes_kinetic_energy():
    world, robot = on_floor()
    robot.drive(0.5, 0.0, math.inf)
    for _ in ticks(world, 100):
        assert robot.work == pytest.approx(kinetic_energy(robot))
    assert robot.work == pytest.approx(0.5 * MASS * 0.5**2, rel=1e-3)


def test_every_start_of_a_turn_on_the_spot_costs_its_kinetic_energy_and_braking_gives_none_back():
    world, robot = on_floor()
    one = 0.5 * robot.body.moment * SPEC.max_turn_rate**2
    for turn in range(1, 11):
        robot.drive(0.0, SPEC.max_turn_rate * (-1) ** turn, world.time + 3.0)
        world.advance_to(world.time + 6.0)
        assert robot.turn_rate == 0.0
        assert robot.work == pytest.approx(turn * one, rel=1e-3)
    assert robot.distance == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_nobody_pushes_and_energy_only_falls(seed):
    """Ten robots thrown together between walls, brakes on, grip anything from ice to rubber."""
    rng = np.random.default_rng(seed)
    world = World(hall(3.6, 3.6), DT)
    for number in range(10):
        at = Pose(0.5 + 0.85 * (number % 4), 0.5 + 0.85 * (number // 4), rng.uniform(-3, 3))
        robot = world.add_robot(f"robot-{number}", SPEC, at)
        robot.grip = rng.uniform(0.0, 0.8)
        shove(robot, *rng.uniform(-3, 3, 3))
    energy = sum(map(kinetic_energy, world.robots))
    for _ in ticks(world, 400):
        now = sum(map(kinetic_energy, world.robots))
        assert now <= energy * (1 + 1e-9)
        energy = now
    assert sum(robot.contacts for robot in world.robots) > 5


def test_a_collision_on_ice_keeps_the_momentum_to_rounding():
    world = World(hall(30.0, 30.0), DT)
    light = load_robot("pibot").drive_spec()
    left = world.add_robot("robot-1", SPEC, Pose(13.0, 15.0, 0.0))
    right = world.add_robot("robot-2", light, Pose(15.0, 15.1, 2.0))
    left.grip = right.grip = 0.0
    shove(left, 1.0, 0.0)
    shove(right, -1.0, 0.0)
    total = left.body.mass * left.body.velocity + right.body.mass * right.body.velocity
    for _ in ticks(world, 200):
        now = left.body.mass * left.body.velocity + right.body.mass * right.body.velocity
        assert (now - total).length < 1e-9
    assert left.contacts == right.contacts == 1
    assert right.velocity[0] > 0.9  # thrown back by thirty times its mass


# --- walls -----------------------------------------------------------------------------


def body_of(size, box, speed):
    """A robot as fast as its size allows at the longest tick."""
    corners = ((size, 0.7 * size), (-size, 0.7 * size), (-size, -0.7 * size), (size, -0.7 * size))
    around = math.hypot(size, 0.7 * size) if box else size
    bare = DriveSpec(radius=around, corners=corners if box else ())
    return DriveSpec(
        radius=around,
        corners=corners if box else (),
        max_speed=speed * bare.safe_speed(MAX_TICK),
        max_acceleration=7.0,
        max_deceleration=7.0,
    )


@given(
    size=st.floats(0.05, 0.5),
    box=st.booleans(),
    share=st.floats(0.2, 1.0),
    heading=st.floats(-math.pi, math.pi),
    turn_rate=st.floats(-0.5, 0.5),
    corners=st.lists(st.floats(4.0, 6.0), min_size=5, max_size=9),
)
@search(25)
def test_no_body_leaves_a_room_of_thin_walls_at_any_speed_that_it_may_have(
    size, box, share, heading, turn_rate, corners
):
    turn = np.linspace(0, 2 * math.pi, len(corners), endpoint=False)
    x, y = 7 + corners * np.cos(turn), 7 + corners * np.sin(turn)
    walls = [*zip(x, y, np.roll(x, -1), np.roll(y, -1), strict=True)]
    world = World(hall(14.0, 14.0, walls), MAX_TICK)
    robot = world.add_robot("robot-1", body_of(size, box, share), Pose(7.0, 7.0, heading))
    robot.body.velocity = (
        robot.spec.max_speed * math.cos(heading),
        robot.spec.max_speed * math.sin(heading),
    )
    robot.drive(robot.spec.max_speed, turn_rate, math.inf)
    room = shapely.Polygon(zip(x, y, strict=True))
    for _ in ticks(world, 250):
        assert room.contains(shapely.Point(robot.x, robot.y))


@pytest.mark.parametrize("angle", range(0, 360, 15))
@pytest.mark.parametrize("box", [True, False])
def test_the_end_of_a_single_thin_wall_stops_what_runs_into_it(angle, box):
    spec = body_of(0.1, box, 1.0)
    heading = math.radians(angle)
    world = World(hall(8.0, 8.0, [(4.0, 4.0, 4.0 + 0.5 * math.cos(heading),
                                   4.0 + 0.5 * math.sin(heading))]), MAX_TICK)  # fmt: skip
    start = Pose(4 - 1.5 * math.cos(heading), 4 - 1.5 * math.sin(heading), heading)
    robot = world.add_robot("robot-1", spec, start)
    robot.body.velocity = (
        spec.max_speed * math.cos(heading),
        spec.max_speed * math.sin(heading),
    )
    robot.drive(spec.max_speed, 0.0, math.inf)
    for _ in ticks(world, 60):
        assert math.dist((robot.x, robot.y), (4.0, 4.0)) > 0.5 * spec.inner_radius
    assert robot.contacts == 1


def test_a_light_robot_is_not_pressed_through_a_wall_by_a_heavy_one():
    light = load_robot("pibot").drive_spec()
    for offset in (0.0, 0.05, 0.15):
        world = World(hall(10.0, 10.0, [(6.0, 0.0, 6.0, 10.0)]), MAX_TICK)
        car = world.add_robot("pibot-1", light, Pose(5.5, 5.0, 0.3))
        heavy = world.add_robot("robot-1", SPEC, Pose(4.8, 5.0 + offset, 0.0))
        heavy.drive(0.5, 0.0, math.inf)
        for _ in ticks(world, 500):
            assert car.x < 6.0


def test_a_crowd_that_drives_into_a_corner_stays_in_the_room():
    world = World(hall(6.0, 6.0), MAX_TICK)
    for number in range(25):
        at = Pose(0.6 + 0.9 * (number % 5), 0.6 + 0.9 * (number // 5), -2.4 + 0.01 * number)
        world.add_robot(f"robot-{number}", SPEC, at).drive(0.5, 0.0, math.inf)
    world.advance_to(40.0)
    for robot in world.robots:
        assert min(robot.x, robot.y) > 0.5 * SPEC.radius


def test_runs_use_no_longer_tick_than_profiles_are_made_for():
    assert PHYSICS_TICK <= MAX_TICK
