import math

import numpy as np
import pytest
from helpers.processes.second_process import run_here_and_elsewhere

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World
from dva_sim.worlds.site import load_site

SPEC = DriveSpec()
DT = 0.02


@pytest.fixture
def world():
    return World(load_site("caparica"), DT)


def in_corridor(world, x=4.0, heading=0.0, name="robot-1"):
    return world.add_robot(name, SPEC, Pose(x, 12.0, heading))


def test_full_speed_is_reached_and_never_passed(world):
    robot = in_corridor(world)
    robot.drive(0.5, 0.0, math.inf)
    speeds = []
    for tick in range(1, 300):
        world.advance_to(tick * DT)
        speeds.append(robot.speed)
    assert max(speeds) <= 0.5 + 1e-9
    assert speeds[-1] == pytest.approx(0.5, abs=1e-4)
    assert max(np.diff(speeds)) <= SPEC.max_acceleration * DT + 1e-9


def test_the_stopping_distance_is_v_squared_over_two_a_and_a_little_for_the_motor(world):
    robot = in_corridor(world)
    robot.drive(0.5, 0.0, 5.0)
    world.advance_to(5.0)
    start, ideal = robot.pose().x, 0.5**2 / (2 * SPEC.max_deceleration)
    world.advance_to(20.0)
    assert ideal <= robot.pose().x - start <= ideal + 0.5 * SPEC.motor_time_constant
    assert robot.speed == 0.0


def test_the_path_of_a_steady_turn_is_a_circle_of_radius_v_over_omega(world):
    robot = world.add_robot("robot-1", SPEC, Pose(6.0, 15.0, 0.0))
    robot.drive(0.4, 0.5, math.inf)
    points = []
    for tick in range(200, 900):
        world.advance_to(tick * DT)
        points.append(robot.pose()[:2])
    xy = np.array(points)
    system = np.column_stack([2 * xy, np.ones(len(xy))])
    a, b, c = np.linalg.lstsq(system, (xy**2).sum(axis=1), rcond=None)[0]
    assert robot.contacts == 0
    assert math.sqrt(c + a * a + b * b) == pytest.approx(0.4 / 0.5, rel=0.01)


@pytest.mark.invariant("S4")
@pytest.mark.parametrize(("asked", "got"), [(9.0, 0.5), (-9.0, 0.0), (0.3, 0.3)])
def test_speed_is_clamped_at_the_motor(world, asked, got):
    robot = in_corridor(world)
    robot.drive(asked, 0.0, math.inf)
    world.advance_to(5.0)
    assert robot.speed == pytest.approx(got, abs=1e-4)


@pytest.mark.invariant("S4")
@pytest.mark.parametrize("sign", [1, -1])
def test_turn_rate_is_clamped_at_the_motor(world, sign):
    robot = in_corridor(world)
    robot.drive(0.0, sign * 0.56, math.inf)
    world.advance_to(5.0)
    assert robot.turn_rate == pytest.approx(sign * math.pi / 6, abs=1e-4)


@pytest.mark.invariant("S4")
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_a_finite_number_means_stop(world, bad):
    robot = in_corridor(world)
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(2.0)
    robot.drive(bad, 0.0, math.inf)
    world.advance_to(4.0)
    assert robot.speed == 0.0
    robot.drive(0.5, bad, math.inf)
    world.advance_to(6.0)
    assert robot.speed == robot.turn_rate == 0.0
    robot.drive(0.5, 0.0, math.nan)
    world.advance_to(8.0)
    assert robot.speed == 0.0


@pytest.mark.parametrize(("until", "last_pushed"), [(1.0, 50), (1.01, 51), (0.99, 50), (1.02, 51)])
def test_a_set_point_ends_with_the_tick_in_which_its_time_is_up(world, until, last_pushed):
    robot = in_corridor(world)
    robot.drive(0.5, 0.0, until)
    world.advance_to(0.9)
    speeds = {}
    for tick in range(46, 60):
        world.advance_to(tick * DT)
        speeds[tick] = robot.speed
    assert max(speeds, key=speeds.__getitem__) == last_pushed


def test_a_set_point_changes_nothing_before_it_was_given(world):
    robot = in_corridor(world)
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(2.019)  # within tick 100
    robot.drive(0.0, 0.0, math.inf)
    world.advance_to(2.02)
    assert robot.speed == pytest.approx(0.5, abs=1e-3)
    world.advance_to(2.04)
    assert robot.speed < 0.49


def test_set_points_that_come_faster_than_ticks_move_the_robot_like_a_single_one(world):
    other = World(load_site("caparica"), DT)
    once, often = in_corridor(world), in_corridor(other)
    once.drive(0.5, 0.0, 3.0)
    for time in np.arange(0.0, 3.0, 0.3 * DT):
        other.advance_to(time)
        often.drive(0.5, 0.0, 3.0)
    for each in (world, other):
        each.advance_to(5.0)
    assert often.pose().x - 4.0 == pytest.approx(once.pose().x - 4.0, abs=1e-9)
    assert once.pose().x > 5.0


def test_a_robot_that_presses_against_a_wall_has_one_contact_and_its_momentum_as_impulse(world):
    robot = in_corridor(world, x=38.0)
    robot.drive(0.5, 0.0, math.inf)
    while not robot.in_contact:
        world.advance_to((world.next_tick() + 1) * DT)
    assert robot.impulse == pytest.approx(SPEC.mass * 0.5, rel=0.15)
    world.advance_to(30.0)
    assert robot.contacts == 1
    assert robot.in_contact
    assert robot.pose().x == pytest.approx(40 - SPEC.radius, abs=0.01)


def test_two_robots_head_on_keep_their_total_momentum(world):
    left = in_corridor(world, 10.0, 0.0, "robot-1")
    right = in_corridor(world, 14.0, math.pi, "robot-2")
    left.drive(0.5, 0.0, math.inf)
    right.drive(0.5, 0.0, math.inf)
    for tick in range(400):
        world.advance_to(tick * DT)
        momentum = left.body.velocity * SPEC.mass + right.body.velocity * SPEC.mass
        assert momentum.length < 1e-6
    assert left.contacts == right.contacts == 1
    assert left.impulse == pytest.approx(right.impulse)
    assert right.pose().x - left.pose().x == pytest.approx(2 * SPEC.radius, abs=0.01)


def test_a_standing_robot_hit_from_behind_is_pushed_and_stands_again(world):
    hit = in_corridor(world, 6.0, 0.0, "robot-1")
    hitter = in_corridor(world, 4.8, 0.0, "robot-2")
    hitter.drive(0.5, 0.0, 3.0)
    world.advance_to(30.0)
    assert hit.contacts == 1
    assert 6.0 < hit.pose().x < 6.6
    assert hit.speed == 0.0


def test_standing_robots_stay_where_they_are_to_the_bit(world):
    idle, busy = in_corridor(world, 30.0, 1.0, "robot-1"), in_corridor(world, 4.0, 0.0, "robot-2")
    before = idle.pose()
    busy.drive(0.5, 0.0, 20.0)
    world.advance_to(3600.0)
    assert idle.pose() == before
    assert busy.distance == pytest.approx(busy.pose().x - 4.0, abs=1e-6)


DRIVE = """
import math
from dva_sim.agents.robot.profile import load_robot
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import DriveSpec, World
from dva_sim.worlds.site import load_site
world = World(load_site("caparica"))
kinds = DriveSpec(), load_robot("pibot").drive_spec()
robots = [world.add_robot(str(i), kinds[i % 2], Pose(4 + 2 * i, 12, i)) for i in range(4)]
people = [world.add_person(f"person-{i}", Pose(5 + 2 * i, 12.3, 0)) for i in range(3)]
for step in range(300):
    world.advance_to(step / 10)
    for number, robot in enumerate(robots):
        robot.drive(0.5, math.sin(step / 9 + number), step / 10 + 0.5)
    for number, person in enumerate(people):
        person.walk(math.cos(step / 30 + number), 0.3 * math.sin(step / 20))
bodies = [*robots, *people]
print([(b.x.hex(), b.y.hex(), b.body.angle.hex(), b.contacts, b.impulse.hex()) for b in bodies])
"""


@pytest.mark.system
def test_two_processes_give_the_same_trajectories_to_the_bit():
    here, elsewhere = run_here_and_elsewhere(DRIVE)
    assert here == elsewhere
    assert "0x" in here
