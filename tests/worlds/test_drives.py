import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.agents.robot.profile import load_robot
from dva_sim.worlds.drives import Differential, DriveSpec, GuardedDrive, ThreeWay, load_drive
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World, hall

DT = 0.02
CAR = DriveSpec(
    mass=2.0, radius=0.2, max_speed=0.8, max_turn_rate=1.5, max_acceleration=1.5,
    max_deceleration=2.0, motor_time_constant=0.1, drive=ThreeWay,
)  # fmt: skip
RADIUS = 0.26 / math.tan(math.radians(25.0))  # of its curve, 0.56 m


def car(spec=CAR, dt=DT):
    world = World(hall(20.0, 20.0), dt)
    return world, world.add_robot("pibot-1", spec, Pose(10.0, 10.0, 0.4))


# --- differential ----------------------------------------------------------------------


def test_a_motor_is_63_percent_there_after_its_time_constant():
    spec = DriveSpec(max_acceleration=100.0, motor_time_constant=0.15)
    drive, speed, dt = Differential(spec), 0.0, 0.001
    for _ in range(150):
        along, _ = drive.accelerations(0.5, 0.0, speed, 0.0, dt)
        speed += along * dt
    assert speed / 0.5 == pytest.approx(1 - math.exp(-1), abs=0.005)


def test_a_motor_is_never_asked_for_more_than_its_acceleration():
    drive = Differential(DriveSpec())
    assert drive.accelerations(0.5, 0.5, 0.0, 0.0, DT) == (0.5, 1.5)
    assert drive.accelerations(0.0, -0.5, 0.5, 0.5, DT) == (-1.0, -1.5)
    assert drive.accelerations(0.3, 0.2, 0.3, 0.2, DT) == (0.0, 0.0)


# --- three ways ------------------------------------------------------------------------


@pytest.mark.parametrize(("turn_rate", "side"), [(0.9, 1), (-0.9, -1), (5.0, 1)])
def test_the_curve_of_a_car_has_the_radius_of_its_wheelbase_and_steering_angle(turn_rate, side):
    world, robot = car()
    robot.drive(0.5, turn_rate, math.inf)
    world.advance_to(3.0)
    assert robot.turn_rate == pytest.approx(side * robot.speed / RADIUS, rel=1e-3)
    assert robot.motors.turning_radius == pytest.approx(RADIUS)
    points = []
    for _ in range(400):
        world.advance_to(world.time + DT)
        points.append((robot.x, robot.y))
    size = np.ptp(np.array(points), axis=0) / 2
    assert size == pytest.approx([RADIUS, RADIUS], rel=0.02)


@pytest.mark.parametrize(
    ("asked", "steering"),
    [(0.0, 0), (0.44, 0), (-0.44, 0), (0.46, 1), (-0.46, -1), (1.5, 1)],
)
def test_the_steering_goes_to_the_nearest_of_three_positions(asked, steering):
    """At 0.5 m/s, a side is 0.90 rad/s: half of it, 0.45, is where it changes."""
    speed, turn_rate = ThreeWay(CAR).set_point(0.504, asked)
    assert speed == pytest.approx(0.504)  # 63 %
    assert turn_rate == pytest.approx(steering * speed / RADIUS)


@pytest.mark.parametrize(("asked", "got"), [(0.3, 0.304), (0.8, 0.8), (0.003, 0.0), (0.005, 0.008)])
def test_the_motor_knows_whole_percentages(asked, got):
    assert ThreeWay(CAR).set_point(asked, 0.0)[0] == pytest.approx(got)


def test_a_car_does_not_turn_on_the_spot():
    world, robot = car()
    robot.drive(0.0, 1.5, math.inf)
    world.advance_to(5.0)
    assert robot.pose() == Pose(10.0, 10.0, 0.4)


def test_a_car_never_turns_faster_than_its_curve_allows_whatever_it_is_asked():
    world, robot = car()
    rng, sharpest = np.random.default_rng(1), 0.0
    for _ in range(100):
        robot.drive(rng.choice([0.0, 0.2, 0.8]), rng.uniform(-1.5, 1.5), math.inf)
        for _ in range(20):
            world.advance_to(world.time + DT)
            if not robot.in_contact and abs(robot.speed) > 0.02:
                sharpest = max(sharpest, abs(robot.turn_rate / robot.speed))
    assert sharpest == pytest.approx(1 / RADIUS, rel=0.01)


def test_who_brakes_in_a_curve_stays_on_it():
    world, robot = car()
    robot.drive(0.5, 1.0, 2.0)
    world.advance_to(2.0)
    before = robot.pose().heading
    start = robot.distance
    world.advance_to(4.0)
    assert robot.speed == 0.0
    assert robot.pose().heading - before == pytest.approx(
        (robot.distance - start) / RADIUS, rel=0.05
    )


def test_a_servo_takes_its_time_from_straight_to_a_side():
    world, robot = car()
    robot.drive(0.5, 0.0, math.inf)
    world.advance_to(2.0)
    robot.drive(0.5, 1.0, math.inf)
    world.advance_to(2.0 + 0.075 + DT)
    half = robot.turn_rate * RADIUS / robot.speed
    assert half == pytest.approx(0.5, abs=0.15)
    world.advance_to(2.0 + 0.15 + 2 * DT)
    assert robot.turn_rate * RADIUS / robot.speed == pytest.approx(1.0, rel=0.01)


# --- of users --------------------------------------------------------------------------


class Wild(Differential):
    def set_point(self, speed, turn_rate):
        return (math.nan, 0.0) if speed > 0.4 else (7.0, -9.0)

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return (math.inf, 0.0) if speed == 0 else (99.0, 0.5)


@pytest.mark.invariant("S4")
def test_a_drive_of_a_user_is_kept_within_the_limits_whatever_it_answers():
    spec = DriveSpec()
    drive = GuardedDrive(Wild(spec))
    assert drive.set_point(0.5, 0.0) == (0.0, 0.0)
    assert drive.set_point(0.1, 0.0) == (0.5, -spec.max_turn_rate)
    assert drive.accelerations(0.5, 0.0, 0.1, 0.0, DT) == (0.5, 0.5)
    assert drive.accelerations(0.5, 0.0, 0.499, 0.0, DT)[0] == pytest.approx(0.001 / DT)
    assert drive.accelerations(0.0, 0.0, 0.3, 0.1, DT) == (-1.0, -1.5)


class Racing(Differential):
    def set_point(self, speed, turn_rate):
        return 50.0, 0.0


class Raving(Differential):
    """Its set point is as it should be, what it does is not."""

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return (50.0 - now_speed) / dt, 0.0


class Dancing(Differential):
    def set_point(self, speed, turn_rate):
        return speed, 9.0


@pytest.mark.invariant("S4")
@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (Racing, "aims [m/s] 50; 0 to 0.5"),
        (Raving, "drives [m/s] 0.52; 0 to 0.5"),
        (Dancing, "aims [rad/s] 9; -0.524 to 0.524"),
    ],
)
def test_a_drive_that_wants_more_than_its_profile_has_is_limited_and_counted(kind, names):
    world = World(hall(20.0, 20.0), 0.04)
    spec = DriveSpec(drive=lambda spec: GuardedDrive(kind(spec)))
    robot = world.add_robot("robot-1", spec, Pose(10.0, 10.0, 0.0))
    for _ in range(20):
        robot.drive(0.5, 0.0, world.time + 0.4)
        world.advance_to(world.time + 0.1)
        assert robot.speed <= 0.5 + 1e-9
    assert robot.motors.failures >= 10
    assert unnamed(robot.motors.first_failure, *names.split()) == []


def test_a_drive_that_keeps_within_its_profile_is_never_counted_whatever_it_is_asked_for():
    world = World(hall(20.0, 20.0), 0.04)
    for number, (kind, own) in enumerate(((Differential, DriveSpec()), (ThreeWay, CAR))):
        spec = replace(own, drive=lambda spec, kind=kind: GuardedDrive(kind(spec)))
        robot = world.add_robot(f"robot-{number}", spec, Pose(5.0 + 9.0 * number, 10.0, 0.0))
        for speed, turn_rate in itertools.product((9.0, 0.5, 0.0), (-9.0, 0.1, 0.0)):
            robot.drive(speed, turn_rate, math.inf)
            world.advance_to(world.time + 1.0)
        assert (robot.motors.failures, robot.motors.first_failure) == (0, "")


class Spinning(Differential):
    """Always in reverse, and turning as hard as it can."""

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return -5.0, 50.0


class Eager(Differential):
    """Its brake does not know when the robot stands."""

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return -1.0 if speed == 0.0 else 0.5, 0.0


@pytest.mark.parametrize("kind", [Spinning, Eager])
def test_motors_of_a_user_neither_reverse_nor_spin_beyond_the_limit_whatever_they_ask_for(kind):
    world = World(hall(20.0, 20.0), 0.04)
    spec = DriveSpec(drive=lambda spec: GuardedDrive(kind(spec)))
    robot = world.add_robot("robot-1", spec, Pose(10.0, 10.0, 0.0))
    robot.drive(0.5, 0.1, 2.0)
    speeds, turn_rates = [], []
    for _ in range(250):
        world.advance_to(world.time + 0.04)
        speeds.append(robot.speed)
        turn_rates.append(robot.turn_rate)
    assert min(speeds) > -1e-9
    assert max(speeds) <= 0.5 + 1e-9
    assert max(map(abs, turn_rates)) <= spec.max_turn_rate + 1e-9
    driven = itertools.pairwise(turn_rates[:50])
    assert max(abs(b - a) for a, b in driven) <= 1.5 * 0.04 + 1e-9
    assert (robot.speed, robot.turn_rate) == (0.0, 0.0)  # its wheels are locked at last


def test_who_was_pushed_beyond_a_limit_comes_back_no_faster_than_its_accelerations_allow():
    drive = GuardedDrive(Differential(DriveSpec()))
    assert drive.accelerations(0.5, 0.0, -1.0, 0.0, DT) == (0.5, 0.0)
    assert drive.accelerations(0.5, 0.0, 2.0, 9.0, DT) == (-1.0, -1.5)


def answering(what):
    """A drive that answers everything with the same, or raises it."""

    class Odd(Differential):
        def set_point(self, speed, turn_rate):
            return self.accelerations()

        def accelerations(self, *_):
            if isinstance(what, BaseException):
                raise what
            return what

    return GuardedDrive(Odd(DriveSpec()))


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        ((math.nan, 0.0), "answers nan, 0.0"),
        ((0.0, -math.inf), "answers 0.0, -inf"),
        (None, "TypeError: cannot unpack non-iterable NoneType object"),
        ("ab", "TypeError: must be real number, not str"),
        ((1.0, 2.0, 3.0), "ValueError: too many values to unpack (expected 2)"),
        ((10**400, 0.0), "OverflowError: int too large to convert to float"),
        (ValueError("broken\nwire"), "ValueError: broken wire"),
        (SystemExit(3), "SystemExit: 3"),
    ],
)
def test_a_drive_without_an_answer_brakes_and_is_counted(answer, expected):
    drive = answering(answer)
    assert drive.set_point(0.5, 0.5) == (0.0, 0.0)
    assert drive.accelerations(0.5, 0.5, 0.5, 0.5, DT) == (-1.0, -1.5)
    assert drive.accelerations(0.5, 0.5, 0.01, 0.0, DT) == (pytest.approx(-0.01 / DT), 0.0)
    assert (drive.failures, drive.first_failure) == (3, expected)


def test_drives_are_made_by_name_and_by_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_drive("differential") is Differential
    assert load_drive("three_way", {"steering_deg": 45.0})(CAR).turning_radius == pytest.approx(
        0.26
    )
    tracked = load_drive("tracked.py:Tracked", {"scrub": 1.0})(DriveSpec())
    assert tracked.set_point(0.5, math.pi / 6) == (0.0, math.pi / 6)


@pytest.mark.parametrize("name", ["servrobot", "pibot", "tracked"])
def test_every_robot_that_is_shipped_drives_and_stops(name):
    world = World(hall(20.0, 20.0), 0.04)
    spec = load_robot(name).drive_spec()
    robot = world.add_robot("robot-1", spec, Pose(5.0, 10.0, 0.0))
    robot.drive(spec.max_speed, 0.0, 10.0)
    world.advance_to(10.0)
    assert robot.speed == pytest.approx(spec.max_speed, rel=1e-3)
    start = robot.x
    world.advance_to(20.0)
    assert robot.speed == 0.0
    assert 0.5 * spec.stopping_distance < robot.x - start < spec.stopping_distance
