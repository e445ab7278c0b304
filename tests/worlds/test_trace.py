"""Every short cut of the world, against a plain stepper that takes none: equal to the bit.

The plain one pushes everybody in every tick whether they stand or not, by pymunk's properties,
and knows neither sleep nor looking only when asked.
"""

import math

import numpy as np
import pymunk
import pytest

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import SLOP, World, hall

DT, SPEC = 0.04, DriveSpec()
SITE = hall(9.0, 9.0, [(3.0, 0.0, 3.0, 6.0), (6.0, 9.0, 6.0, 3.0), (4.0, 4.0, 5.0, 4.5)])


class PlainWorld:
    def __init__(self):
        self.space = pymunk.Space()
        self.space.collision_slop = SLOP
        for x1, y1, x2, y2 in SITE.walls.tolist():
            wall = pymunk.Segment(self.space.static_body, (x1, y1), (x2, y2), 0.0)
            wall.friction, wall.elasticity = 0.3, 0.1
            self.space.add(wall)
        self.robots, self.people = [], []
        self.locks, self.braked = {}, {}

    def add(self, pose, robot):
        """A disc of a robot, or of a person."""
        mass, radius = (60.0, 0.3) if robot else (75.0, 0.25)
        moment = 0.5 * mass * radius**2 if robot else math.inf
        body = pymunk.Body(mass, moment)
        body.position, body.angle = pose[:2], pose[2] if robot else 0.0
        shape = pymunk.Circle(body, radius)
        shape.friction, shape.elasticity = (0.3, 0.1) if robot else (0.0, 0.0)
        self.space.add(body, shape)
        (self.robots if robot else self.people).append(body)
        if robot:
            self.lock(body)

    def lock(self, body):
        """Hold a robot with the friction of its wheels, 0.8 of its weight on half its radius."""
        place = pymunk.PivotJoint(self.space.static_body, body, (0, 0), (0, 0))
        angle = pymunk.GearJoint(self.space.static_body, body, 0.0, 1.0)
        place.max_bias = angle.max_bias = 0.0
        place.max_force, angle.max_force = 0.8 * 9.81 * 60.0, 0.8 * 9.81 * 60.0 * 0.15
        self.space.add(place, angle)
        self.locks[body], self.braked[body] = (place, angle), 0.0

    def tick(self, speeds, walks):
        """One tick with what is wanted of everybody."""
        for body, (speed, turn_rate) in zip(self.robots, speeds, strict=True):
            is_still, rests = speed == turn_rate == 0, push_robot(body, speed, turn_rate)
            if not is_still and body in self.locks:
                self.space.remove(*self.locks.pop(body))
            self.braked[body] = self.braked[body] + DT if is_still and not rests else 0.0
            late = self.braked[body] > 0.5 / 1.0 + 8 * 0.15
            if (rests or late) and body not in self.locks:
                self.lock(body)
            if is_still and body in self.locks:
                body.force, body.torque = (0.0, 0.0), 0.0
        for body, wanted in zip(self.people, walks, strict=True):
            push_person(body, wanted)
        self.space.step(DT)


def push_robot(body, wanted, wanted_spin):
    """Motor force and torque; brakes if the robot is to stand."""
    velocity, spin = body.velocity, body.angular_velocity
    angle = body.angle + spin * DT
    cos, sin = math.cos(angle), math.sin(angle)
    forward = velocity.x * cos + velocity.y * sin
    sideways = velocity.y * cos - velocity.x * sin
    if wanted == wanted_spin == 0 and abs(forward) + abs(sideways) + abs(spin) < 1e-3:
        body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        return True
    gain = 1.0 / 0.15
    along = min(max((wanted - forward) * gain, -1.0), 0.5)
    turn = min(max((wanted_spin - spin) * gain, -1.5), 1.5)
    across, grip = -sideways / DT, 0.8 * 9.81
    asked = math.hypot(along, across)
    if asked > grip:
        along, across = along * grip / asked, across * grip / asked
    along, across = 60.0 * along, 60.0 * across
    body.force = along * cos - across * sin, along * sin + across * cos
    body.torque = body.moment * turn
    return False


def push_person(body, wanted):
    (wx, wy), (vx, vy) = wanted, body.velocity
    if wx == wy == 0 and abs(vx) + abs(vy) < 1e-3:
        body.velocity = (0.0, 0.0)
        return
    ax, ay = (wx - vx) / 0.5, (wy - vy) / 0.5
    asked = math.hypot(ax, ay)
    share = 75.0 * min(1.0, 3.0 / asked) if asked else 0.0
    body.force = ax * share, ay * share


def scene():
    """Start poses of six robots and four people."""
    across, up = (0.8, 2.0, 3.8, 7.5), (1.1, 3.2, 7.0)
    places = [(across[n % 4], up[n // 4], 0.7 * n) for n in range(10)]
    return places[:6], places[6:]


def wishes(rng, count, most):
    """Mostly something, often nothing at all."""
    asked = rng.uniform(-1, 1, (count, 2)) * most
    return np.where(rng.random((count, 1)) < 0.4, 0.0, asked).tolist()


@pytest.mark.parametrize(("seed", "look_every"), [(0, 1), (1, 7)])
def test_lazy_sleeping_and_direct_stepping_leaves_the_trajectory_as_it_is(seed, look_every):
    world, plain = World(SITE, DT), PlainWorld()
    robots, people = scene()
    for number, place in enumerate(robots):
        world.add_robot(f"robot-{number}", SPEC, Pose(*place))
        plain.add(place, robot=True)
    for number, place in enumerate(people):
        world.add_person(f"person-{number}", Pose(*place))
        plain.add(place, robot=False)
    rng, tick = np.random.default_rng(seed), 0
    for _ in range(40):
        speeds = [(max(v, 0.0), w) for v, w in wishes(rng, 6, (0.5, 0.5))]
        walks = wishes(rng, 4, 1.2)
        world.advance_to(tick * DT)
        for robot, (speed, turn_rate) in zip(world.robots, speeds, strict=True):
            robot.drive(speed, turn_rate, math.inf)
        for person, (vx, vy) in zip(world.people, walks, strict=True):
            person.walk(vx, vy)
        for _ in range(35):
            plain.tick(speeds, walks)
            tick += 1
            if tick % look_every == 0:
                world.advance_to(tick * DT)
                assert states(world.robots) == [state(body) for body in plain.robots]
                assert states(world.people) == [state(body) for body in plain.people]
    assert sum(robot.contacts for robot in world.robots) > 5


def state(body):
    return (*body.position, body.angle, *body.velocity, body.angular_velocity)


def states(bodies):
    return [state(body.body) for body in bodies]


def test_who_sleeps_is_not_pushed_and_wakes_when_touched():
    world = World(SITE, DT)
    asleep = world.add_robot("robot-1", SPEC, Pose(1.0, 4.0, 0.0))
    hitter = world.add_robot("robot-2", SPEC, Pose(1.0, 2.5, math.pi / 2))
    pushed = []
    push, asleep.push = asleep.push, lambda *given: pushed.append(world.time) or push(*given)
    hitter.drive(0.5, 0.0, 6.0)
    world.advance_to(20.0)
    assert asleep.contacts == 1
    assert pushed[0] > 1.0
    assert len(pushed) < 200
    assert asleep.y > 4.0
