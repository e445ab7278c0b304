"""Walking: alone, past each other, through doors, and around obstacles."""

import itertools
import math
from functools import partial

import numpy as np
import pytest
from helpers.processes.second_process import run_here_and_elsewhere
from helpers.worlds.hall_with_people import People, gap, hall, two_rooms

from dva_sim.agents.people.pedestrian_avoidance import (
    RELAXATION,
    USUAL,
    Courtesy,
    Door,
    Mover,
    beside,
    doors_on,
    find_middles,
    is_clear,
    velocity,
)
from dva_sim.agents.people.profiles import FASTEST, SLOWEST, PaceProfile
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.bodies import Body
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.planning import Planner

CORRIDOR = 2.4  # width [m]
SPEED = 1.34  # [m/s]


class FreeBody:
    """A body that nothing stops: it has at once the velocity that is wanted."""

    def __init__(self, clock: Clock, x: float, y: float) -> None:
        self._clock, self._since = clock, clock.now
        self._x, self._y, self.radius = x, y, USUAL.radius_m
        self.velocity = 0.0, 0.0

    @property
    def x(self) -> float:
        return self._x + self.velocity[0] * (self._clock.now - self._since)

    @property
    def y(self) -> float:
        return self._y + self.velocity[1] * (self._clock.now - self._since)

    def walk(self, vx: float, vy: float) -> None:
        self._x, self._y, self._since = self.x, self.y, self._clock.now
        self.velocity = vx, vy

    def take_up(self, radius: float) -> None:
        self.radius = radius


class OpenGround:
    """Ground without physics, for who walks alone."""

    def __init__(self) -> None:
        self.bodies: list[Body] = []

    def advance_to(self, time: float) -> None:
        pass

    def neighbours(self, x: float, y: float, within: float) -> list[tuple[Body, float]]:
        found = [(body, math.dist((body.x, body.y), (x, y))) for body in self.bodies]
        return sorted((f for f in found if f[1] <= within), key=lambda f: f[1])


def wide_open(points):
    return np.full(len(points), 10.0)


# --- manners: pure ---------------------------------------------------------------------

ME = Mover(0.0, 0.0, SPEED, 0.0, 0.2)


def test_who_is_behind_or_walks_the_same_way_as_fast_changes_nothing():
    behind, same = Mover(-1.0, 0.0, 0.0, 0.0, 0.2), Mover(1.0, 0.0, SPEED, 0.0, 0.2)
    for other in (behind, same):
        assert velocity(ME, 0.0, SPEED, [other], wide_open) == pytest.approx((SPEED, 0.0))


@pytest.mark.parametrize("speed", [0.0, -SPEED])
def test_who_stands_or_comes_right_ahead_is_passed_on_the_right(speed):
    vx, vy = velocity(ME, 0.0, SPEED, [Mover(2.0, 0.0, speed, 0.0, 0.2)], wide_open)
    assert vx > 0
    assert vy < 0


def test_who_stands_a_little_to_the_right_is_passed_on_the_left():
    _, vy = velocity(ME, 0.0, SPEED, [Mover(1.5, -0.25, 0.0, 0.0, 0.2)], wide_open)
    assert vy > 0


def test_who_cannot_pass_walks_no_faster_than_stops_in_half_a_second_before_who_stands_ahead():
    for distance in (1.0, 0.8, 0.6):
        queue = [Mover(distance, y, 0.0, 0.0, 0.2) for y in np.arange(-9.0, 9.1, 0.3)]
        vx, _ = velocity(ME, 0.0, SPEED, queue, wide_open)
        assert 0.0 < vx < 1.2 * (distance - 0.4 - USUAL.berth_m) / RELAXATION


def test_nobody_steps_aside_into_a_wall():
    def wall_on_the_right(points):
        return points[:, 1] + 0.25

    _, vy = velocity(ME, 0.0, SPEED, [Mover(1.5, 0.0, 0.0, 0.0, 0.2)], wall_on_the_right)
    assert vy > 0


def test_where_it_is_clear_the_rules_keep_direction_and_speed():
    rng = np.random.default_rng(2)
    clear = 0
    for _ in range(500):
        others = [
            Mover(*rng.uniform(-3, 3, 2), *rng.uniform(-1.5, 1.5, 2), 0.2)
            for _ in range(int(rng.integers(1, 4)))
        ]
        others = [o for o in others if math.hypot(o.x, o.y) > 0.6]
        if others and is_clear(ME, 0.0, SPEED, others):
            clear += 1
            assert velocity(ME, 0.0, SPEED, others, wide_open) == pytest.approx((SPEED, 0.0))
    assert 100 < clear < 450  # of some 480


# --- doorways: pure --------------------------------------------------------------------


def body(x, y, vx=0.0, vy=0.0):
    made = FreeBody(Clock(), x, y)
    made.walk(vx, vy)
    return made


def test_the_doors_of_a_way_are_found_in_its_order_and_wide_ones_need_no_manners():
    ends = np.array([[7, -0.5, 7, 0.5], [3, -0.5, 3, 0.5], [5, -2, 5, 2], [5, 8, 5, 9]], float)
    way = np.stack([np.arange(0, 10.01, 0.25), np.zeros(41)], 1)
    doors = doors_on(way, find_middles(ends, USUAL.narrow_m))
    assert [(d.along, d.x) for d in doors] == [(3.0, 3.0), (7.0, 7.0)]
    assert doors_on(way, np.empty((0, 2))) == []


def test_who_is_nearer_to_a_door_goes_first_and_the_other_waits_for_five_seconds_at_most():
    door = Door(10.0, 10.0, 0.0)
    me, nearer = body(8.5, 0.0), body(11.0, 0.0, -1.0)
    courtesy = Courtesy([door])
    waits = [courtesy.waits_for(me, 8.5, [nearer], now) for now in (0.0, 4.9, 5.1)]
    assert waits == [door, door, None]
    assert Courtesy([door]).waits_for(me, 8.5, [body(12.0, 0.0, -1.0)], 0.0) is None  # farther
    assert Courtesy([door]).waits_for(me, 8.5, [body(9.5, 0.0, 1.0)], 0.0) is None  # same way
    assert Courtesy([door]).waits_for(me, 3.0, [nearer], 0.0) is None  # far from the door yet


def test_who_waits_stands_right_of_the_way_through_the_door_or_left_if_a_wall_is_there():
    door, me = Door(10.0, 10.0, 0.0), body(8.5, 0.0)
    assert beside(door, me, wide_open) == pytest.approx((9.2, -0.9))
    assert beside(door, me, lambda points: points[:, 1]) == pytest.approx((9.2, 0.9))
    assert beside(door, me, lambda points: np.zeros(len(points))) == (8.5, 0.0)


# --- how fast people are ---------------------------------------------------------------


def test_a_population_walks_as_weidmann_found_though_nobody_is_slower_or_faster_than_people_are():
    """Weidmann 1993: 1.34 m/s, SD 0.26; within 3 % also of those whose speed was cut."""
    rng = np.random.default_rng(1)
    speeds = np.array([PaceProfile().draw_speed(rng) for _ in range(8_000)])
    assert speeds.mean() == pytest.approx(1.34, rel=0.03)
    assert speeds.std() == pytest.approx(0.26, rel=0.03)
    assert (speeds.min(), speeds.max()) == (SLOWEST, FASTEST)


# --- alone -----------------------------------------------------------------------------


def test_a_walk_takes_its_length_by_its_speed_and_little_more():
    people = People(hall(20, CORRIDOR))
    walker = people.add((1.0, 1.2), (19.0, 1.2))
    people.run_until(people.all_settled, 30.0)
    assert 18.0 / SPEED < people.arrived[0] < 18.0 / SPEED + 1.6  # to begin and to stop
    assert math.dist(walker.place, (19.0, 1.2)) < 2 * USUAL.arrived_m


def test_a_slower_pace_takes_longer_in_proportion():
    times = []
    for pace in (1.0, 0.5):
        people = People(hall(20, CORRIDOR))
        people.add((1.0, 1.2), (19.0, 1.2)).pace = pace
        people.run_until(people.all_settled, 60.0)
        times.append(people.arrived[0])
    assert times[1] == pytest.approx(2 * times[0], rel=0.1)


def test_where_there_is_no_physics_the_same_walk_is_walked_by_a_body_that_moves_freely():
    site, clock, seen = hall(20, CORRIDOR), Clock(), []
    walker = Walking(
        clock,
        Planner(site, 0.3),
        OpenGround(),
        FreeBody(clock, 1.0, 1.2),
        speed=SPEED,
        doors=site.doors,
    )
    walker.go((19.0, 1.2), lambda: seen.append(clock.now), lambda: None)
    clock.run(5.0)
    assert walker.place == pytest.approx((1.0 + 5.0 * SPEED, 1.2), abs=0.01)
    clock.run(30.0)
    assert seen == [pytest.approx(18.0 / SPEED, abs=2.0)]


def test_who_stands_costs_nothing():
    people = People(hall(20, CORRIDOR))
    people.add((1.0, 1.2), (3.0, 1.2))
    people.run_until(people.all_settled, 30.0)
    people.run_until(lambda: False, 40.0)
    assert people.clock.env.peek() == math.inf  # nothing is due


def test_a_new_goal_replaces_the_old_one_and_standing_still_forgets_it():
    people = People(hall(20, CORRIDOR))
    walker = people.add((1.0, 1.2), (19.0, 1.2))
    people.clock.run(3.0)
    ended = []
    walker.go((1.0, 1.2), lambda: ended.append("back"), lambda: None)
    people.clock.run(12.0)
    walker.go((19.0, 1.2), lambda: ended.append("there"), lambda: None)
    people.clock.run(14.0)
    walker.stop()
    people.clock.run(60.0)
    assert (ended, people.arrived) == (["back"], {})
    assert not walker.go((500.0, 1.2), lambda: None, lambda: None)


# --- each other ------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [-0.3, 0.0, 0.1])
def test_two_who_meet_in_a_corridor_pass_without_touching_and_lose_hardly_any_time(offset):
    people = People(hall(20, CORRIDOR))
    one, other = people.add((1, 1.2), (19, 1.2)), people.add((19, 1.2 + offset), (1, 1.2))
    least = []
    people.run_until(lambda: least.append(gap(one, other)) or people.all_settled(), 30.0, 0.04)
    assert min(least) > 0
    assert max(people.arrived.values()) == pytest.approx(18.0 / SPEED, abs=2.0)
    assert len(people.arrived) == 2


def test_the_fast_overtake_the_slow():
    people = People(hall(20, CORRIDOR))
    people.add((3, 1.2), (19, 1.0), speed=0.7)
    people.add((1, 1.2), (19, 1.4), speed=1.6)
    people.run_until(people.all_settled, 60.0)
    assert people.arrived[1] == pytest.approx(18.0 / 1.6, abs=2.0)
    assert people.arrived[1] < people.arrived[0] - 8.0


@pytest.mark.system
def test_nobody_walks_through_a_wall_or_anybody_even_in_a_crowd():
    people = People(two_rooms(door=1.1))
    rng = np.random.default_rng(4)
    spots = [(x, y) for x in np.arange(0.6, 5.5, 0.9) for y in np.arange(0.6, 9.5, 0.9)]
    for index in rng.permutation(len(spots))[:10]:
        x, y = spots[index]
        people.add((x, y), (12 - x, y))
        people.add((12 - x, y), (x, y), speed=1.0)
    deepest, side = [], [w.place[0] < 6 for w in people.walkings]

    def look():
        nonlocal side
        places = [w.place for w in people.walkings]
        now = [x < 6 for x, _ in places]
        for was, is_, (_, y) in zip(side, now, places, strict=True):
            assert was == is_ or 4.4 < y < 5.6  # only the door leads to the other room
        side = now
        assert all(0.15 < x < 11.85 and 0.15 < y < 9.85 for x, y in places)
        pairs = itertools.combinations(people.walkings, 2)
        deepest.append(min(gap(one, other) for one, other in pairs))
        return people.all_settled()

    people.run_until(look, 20.0, 0.2)
    assert min(deepest) > -0.1


@pytest.mark.parametrize("width", [0.9, 1.1, 1.3])
def test_two_who_meet_at_a_door_pass_one_after_the_other(width):
    people = People(two_rooms(width))
    one, other = people.add((1, 5), (11, 5)), people.add((11.3, 5), (1, 5))
    least = []
    people.run_until(lambda: least.append(gap(one, other)) or people.all_settled(), 30.0)
    assert min(least) > 0
    assert people.arrived[0] == pytest.approx(10.0 / SPEED, abs=1.0)  # it was nearer
    assert people.arrived[1] < people.arrived[0] + 5.0


def flow_through(width, seed, count=32):
    """Persons per second of the middle half of a crowd of different paces at a door."""
    people, passed = People(two_rooms(width, width=9.0, height=7.0)), []
    rng = np.random.default_rng(seed)
    spots = [(x, y) for x in np.arange(0.5, 4.2, 0.55) for y in np.arange(0.5, 6.6, 0.55)]

    def leave(walker):
        passed.append(people.clock.now)
        people.world.remove(walker.body)

    for index in rng.permutation(len(spots))[:count]:
        walker = people.add(spots[index], speed=PaceProfile().draw_speed(rng))
        leaves = partial(leave, walker)
        assert walker.go((8.0, 3.5), leaves, pytest.fail, lambda at: at[0] > 5.0)
    people.run_until(lambda: len(passed) == count, 120.0, 1.0)
    first, last = count // 4, 3 * count // 4
    return (last - first) / (passed[last] - passed[first])


@pytest.mark.system
def test_a_crowd_leaves_by_a_door_at_a_rate_that_has_been_seen_of_crowds():
    """At a door of 1.1 m. Nothing in the model was fitted to it.

    SFPE reckons with 1.3 persons/s per metre of effective width, which is 0.3 m less than the
    door; measured was 1.9 per metre of the door itself (Seyfried et al., Transportation Science
    43, 2009).
    """
    flow = flow_through(1.1, seed=1)
    assert 1.3 * (1.1 - 0.3) < flow < 1.9 * 1.1


# --- robots ----------------------------------------------------------------------------


def test_a_robot_that_stands_in_a_corridor_is_walked_around_without_touching_it():
    people = People(hall(20, CORRIDOR))
    robot = people.world.add_robot("robot", DriveSpec(), Pose(10, 1.2, 0))
    people.add((1, 1.2), (19, 1.2))
    people.run_until(people.all_settled, 40.0)
    assert people.arrived[0] == pytest.approx(18.0 / SPEED, abs=2.0)
    assert robot.person_contacts == 0


def test_a_robot_that_comes_through_a_door_finds_nobody_in_its_way():
    people = People(two_rooms(1.1))
    robot = people.world.add_robot("robot", DriveSpec(), Pose(7.5, 5, math.pi))
    robot.drive(0.5, 0.0, 10.0)
    people.add((1, 5), (11, 5))
    people.run_until(people.all_settled, 60.0)
    assert people.arrived
    assert robot.person_contacts == 0


# --- blocked ---------------------------------------------------------------------------


def test_who_finds_the_door_blocked_by_a_robot_goes_by_another_one():
    walls = [(6, 0, 6, 1.5), (6, 2.6, 6, 7.4), (6, 8.5, 6, 10)]
    doors = [(6, 1.5, 6, 2.6), (6, 7.4, 6, 8.5)]
    people = People(hall(12, 10, walls, doors))
    people.world.add_robot("robot", DriveSpec(), Pose(6, 2.05, 0))
    walker = people.add((2, 2), (10, 2))
    people.run_until(people.all_settled, 90.0)
    assert people.arrived
    assert walker.place[0] > 9


def test_who_is_held_up_by_a_robot_in_a_door_squeezes_past_if_there_is_a_gap():
    """0.25 m are left on each side of the robot, and a person turned sideways takes 0.24 m."""
    people = People(two_rooms(1.1))
    robot = people.world.add_robot("robot", DriveSpec(), Pose(6, 5, 0))
    walker = people.add((1, 5), (11, 5))
    people.run_until(people.all_settled, 60.0)
    assert people.arrived
    assert walker.body.radius == USUAL.radius_m  # and turns back
    assert math.dist(robot.pose()[:2], (6, 5)) < 0.05


def test_who_can_get_through_nowhere_says_so_and_does_not_push_for_ever():
    people = People(two_rooms(0.9))
    robot = people.world.add_robot("robot", DriveSpec(), Pose(6, 5, 0))
    people.add((1, 5), (11, 5))
    people.run_until(people.all_settled, 200.0)
    assert people.arrived == {}
    assert USUAL.gives_up_s < people.gave_up[0] < 2 * USUAL.gives_up_s
    assert math.dist(robot.pose()[:2], (6, 5)) < 0.05


def test_who_waits_until_a_robot_leaves_the_door_gets_through_then():
    people = People(two_rooms(0.9))
    robot = people.world.add_robot("robot", DriveSpec(), Pose(6, 5, 0))
    people.add((1, 5), (11, 5))
    people.clock.run(30.0)
    robot.drive(0.5, 0.0, 36.0)
    people.run_until(people.all_settled, 90.0)
    assert people.arrived


def test_two_who_are_sent_to_one_place_both_arrive():
    people = People(hall(10, 10))
    people.add((1, 5), (5, 5))
    people.add((9, 5), (5, 5))
    people.run_until(people.all_settled, 30.0)
    assert len(people.arrived) == 2
    assert max(people.arrived.values()) < 4.0 / SPEED + USUAL.tired_s + 4.0


# --- the same again --------------------------------------------------------------------

CROWD = """
import numpy as np
from helpers.worlds.hall_with_people import People, two_rooms
people = People(two_rooms(1.1))
rng = np.random.default_rng(2)
for y in np.arange(1.0, 9.5, 1.4):
    people.add((1.0, y), (11.0, 10.0 - y), float(rng.normal(1.34, 0.2)))
    people.add((11.0, y), (1.0, 10.0 - y), float(rng.normal(1.34, 0.2)))
people.run_until(lambda: False, 8.0)
print([repr(c) for w in people.walkings for c in w.place])
"""


@pytest.mark.system
def test_two_processes_walk_a_crowd_to_the_same_bit():
    here, elsewhere = run_here_and_elsewhere(CROWD)
    assert here == elsewhere
    assert len(here) > 500
