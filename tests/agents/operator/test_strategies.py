"""Strategies in closed loops, where commands take effect exactly, one delay later."""

import math
from dataclasses import replace
from itertools import groupby, pairwise
from typing import Any

import pytest
from helpers.worlds.delayed_loops import (
    CURSOR,
    ROBOT,
    At,
    arc,
    drive,
    follow,
    offsets,
    person,
    point,
    way,
)

from dva_sim.agents.operator.strategies import (
    Adaptive,
    Intent,
    MoveAndWait,
    Oracle,
    Predictor,
    Pursuit,
    Reach,
    Strategy,
    Truth,
    TwoPoint,
    View,
)
from dva_sim.agents.route_following import Route

FREE = 1e9  # a margin that holds nobody back
LIMITLESS = Reach(speed=1e6, turn_rate=1e6)
KINDS: list[type[Strategy]] = [Pursuit, TwoPoint, MoveAndWait, Predictor, Adaptive]
CORNER = (0.0, 0.0), (5.0, 0.0), (5.0, 5.0)


def swing(values: list[float]) -> float:
    """Largest swing of the last quarter, in those of the second."""
    quarter = len(values) // 4
    late, early = values[-quarter:], values[quarter : 2 * quarter]
    return max(map(abs, late)) / max(map(abs, early))


# --- limits of stability ---------------------------------------------------------------------


@pytest.mark.parametrize(("product", "grows"), [(1.52, False), (1.62, True)])
def test_a_loop_of_gain_and_delay_is_stable_up_to_their_product_of_half_pi(product, grows):
    who = person(margin=FREE, pointing=product, pace=1.0)
    cursor = point(Strategy(who, LIMITLESS), lambda now: 1.0, 1.0, 40.0, frame=0.005)
    assert (swing([x - 1.0 for _, x, _ in cursor]) > 1.0) == grows
    who = person(margin=FREE, crossover=product)
    # At the end of its way the robot only turns towards it.
    turned = drive(
        *(Pursuit(who, LIMITLESS), way((0, 0), (9, 0)), 1.0, 40.0),
        start=(8.0, 0.0, 0.1),
        stop_before=2.0,
        frame=0.005,
    )
    assert (swing([at.heading for at in turned]) > 1.0) == grows


@pytest.mark.parametrize(("share", "grows"), [(0.504, False), (0.536, True)])
def test_pure_pursuit_of_a_straight_line_is_stable_up_to_half_a_look_ahead_of_delay(share, grows):
    """The published limit of v tau / L is 0.52."""
    who = person(caution=share, pace=1.0)
    fast = Reach(speed=1.0, turn_rate=1e6)
    track = drive(
        *(Pursuit(who, fast), way((0, 0), (400, 0)), 0.6, 150.0),
        start=(0.0, 0.001, 0.0),
        frame=0.005,
    )
    assert (swing([at.y for at in track]) > 1.0) == grows


def test_the_margin_of_a_person_keeps_any_delay_far_from_the_limit():
    for delay in (0.2, 1.0, 5.0):
        track = point(Strategy(person(), CURSOR), lambda now: 0.3, delay, 30.0 * delay + 5.0)
        assert max(x for _, x, _ in track) < 0.33
        assert track[-1][1] == pytest.approx(0.3, abs=0.005)


# --- every strategy --------------------------------------------------------------------------


@pytest.mark.parametrize("delay", [1.0, pytest.param(0.0, marks=pytest.mark.soak)])
@pytest.mark.parametrize("kind", KINDS)
def test_drives_around_a_corner_and_stands_before_its_end(kind, delay):
    route = way(*CORNER)
    track = drive(kind(person(), ROBOT), route, delay, 150.0, stop_before=0.5)
    assert max(offsets(route, track)) < 0.75
    assert math.dist((track[-1].x, track[-1].y), (5.0, 5.0)) < 0.55
    assert all(at.wanted.speed == 0.0 for at in track[-100:])


@pytest.mark.parametrize("kind", KINDS)
def test_asks_for_nothing_that_the_robot_cannot_do(kind):
    car = Reach(speed=0.8, turn_rate=1.4, radius=0.56)
    for reach in (ROBOT, car):
        track = drive(kind(person(), reach), way(*CORNER), 0.5, 60.0, start=(0, 0, 2.0))
        assert all(0.0 <= at.wanted.speed <= reach.speed for at in track)
        assert all(abs(at.wanted.turn_rate) <= reach.turn_rate + 1e-9 for at in track)


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_drive_again_is_the_same(kind):
    first, again = (drive(kind(person(), ROBOT), way(*CORNER), 0.7, 60.0) for _ in range(2))
    assert first == again


@pytest.mark.parametrize("kind", KINDS)
def test_brings_a_cursor_to_its_target_and_keeps_it_there(kind):
    for delay in (0.4, 2.0):
        track = point(kind(person(), CURSOR), lambda now: 0.2, delay, 40.0)
        assert all(abs(x - 0.2) < 0.005 for now, x, _ in track if now > 25.0)


@pytest.mark.parametrize("kind", KINDS)
def test_goes_through_a_tunnel_without_touching_its_sides(kind):
    """A bend of 10 cm radius, 4 cm wide, with 0.3 s of delay."""
    track = follow(kind(person(), CURSOR), arc(0.1), 0.02, 0.3, 30.0)
    assert all(abs(math.hypot(x, y - 0.1) - 0.1) < 0.02 for _, x, y in track)
    assert math.dist(track[-1][1:], (0.1, 0.1)) < 0.01


def test_a_person_follows_a_target_that_moves_steadily_without_falling_behind():
    for delay in (0.0, 0.3):
        track = point(Strategy(person(), CURSOR), lambda now: 0.05 * now, delay, 20.0)
        assert track[-1][1] == pytest.approx(0.05 * track[-1][0], abs=1e-3)


def test_half_the_width_of_a_tunnel_takes_twice_the_time():
    def time_in(half_width: float) -> float:
        slow = Strategy(person(), replace(CURSOR, speed=10.0))
        track = follow(slow, way((0, 0), (1, 0)), half_width, 0.3, 60.0)
        return next(now for now, x, _ in track if x > 0.9) - 0.3

    assert time_in(0.01) == pytest.approx(2.0 * time_in(0.02), rel=0.05)


# --- pursuit ---------------------------------------------------------------------------------


def test_who_pursues_slows_so_that_the_delay_covers_a_share_of_the_look_ahead():
    """Look-aheads in a building are at most 1.8 m: at 3 s, 0.3 x 1.8 m / 3 s = 0.18 m/s."""
    for delay, speed in ((0.5, 0.475), (1.0, 0.475), (3.0, 0.18)):
        track = drive(Pursuit(person(), ROBOT), way((0, 0), (40, 0)), delay, 10.0)
        assert track[-1].wanted.speed == pytest.approx(speed)


# --- two points ------------------------------------------------------------------------------


def test_two_points_follow_an_arc():
    route = arc(3.0)
    track = drive(TwoPoint(person(), ROBOT), route, 0.3, 30.0)
    assert max(offsets(route, track)) < 0.25
    assert math.dist((track[-1].x, track[-1].y), (3.0, 3.0)) < 0.35


def test_two_points_correct_five_times_a_second_and_hold_in_between():
    track = drive(TwoPoint(person(), ROBOT), arc(3.0), 0.3, 6.0, frame=0.05)
    held = [len(list(same)) for _, same in groupby(at.wanted.turn_rate for at in track)]
    assert held[1:-1] == [4] * (len(held) - 2)


# --- move and wait ---------------------------------------------------------------------------


def spells(track: list[At]) -> list[tuple[bool, float, float]]:
    """Alternately moving and waiting: (moves, from, until) [s]."""
    found = []
    for moves, group in groupby(track, lambda at: at.wanted != (0.0, 0.0)):
        of = list(group)
        found.append((moves, of[0].time, of[-1].time + 0.1))
    return found


@pytest.mark.parametrize("delay", [0.5, 2.0, 6.0])
def test_who_moves_and_waits_moves_again_only_when_the_result_is_seen_to_have_settled(delay):
    """The delay, and both the reaction of 0.3 s and 0.3 s of a picture that stands still."""
    strategy = MoveAndWait(person(), ROBOT)
    track = drive(strategy, way(*CORNER), delay, 200.0, stop_before=0.5)
    waits = [until - since for moves, since, until in spells(track) if not moves]
    assert len(waits) == strategy.moves.waits == strategy.workload()["waits"] > 3
    assert all(wait >= 0.3 + delay - 1e-6 for wait in waits)
    assert all(wait < 0.3 + delay + 0.7 for wait in waits[:-1])
    assert min(waits) == pytest.approx(strategy.moves.usual_wait(delay), abs=0.2)


def test_time_by_moving_and_waiting_grows_with_the_delay_by_the_number_of_waits():
    times, waits = {}, set()
    for delay in (1.0, 2.0, 4.0, 8.0):
        strategy = MoveAndWait(person(), ROBOT)
        track = drive(strategy, way(*CORNER), delay, 200.0, stop_before=0.5)
        *_, last = (until for moves, _, until in spells(track) if moves)
        times[delay] = last
        waits.add(strategy.moves.waits)
    (count,) = waits
    slope = (times[8.0] - times[1.0]) / 7.0
    assert slope == pytest.approx(count - 1, abs=0.5)  # after the last one it has arrived


def test_who_is_never_shown_a_move_tries_again_at_last():
    strategy = MoveAndWait(person(), ROBOT)
    track = drive(strategy, way((0, 0), (9, 0)), 300.0, 60.0, reported_delay=lambda now: 1.0)
    moves = [since for going, since, _ in spells(track) if going]
    assert len(moves) > 3
    assert min(b - a for a, b in pairwise(moves)) > 3.0 * 1.6


# --- predictor -------------------------------------------------------------------------------


@pytest.mark.parametrize("inner", ["pursuit", "two_point"])
@pytest.mark.parametrize("delay", [0.5, 2.0])
def test_a_perfect_prediction_steers_as_without_delay(inner, delay):
    kind = {"pursuit": Pursuit, "two_point": TwoPoint}[inner]
    without = drive(kind(person(), ROBOT), way(*CORNER), 0.0, 40.0)
    predicted = drive(Predictor(person(), ROBOT, kind(person(), ROBOT)), way(*CORNER), delay, 40.0)
    for ideal, at in zip(without, predicted, strict=True):
        assert at.wanted == pytest.approx(ideal.wanted, abs=1e-6)


def test_a_perfect_prediction_of_a_cursor_is_that_of_smith():
    """Gain 4, delay 0.5 s: 1 - exp(-4 (1.5 - 0.5)) = 0.982 of the way after 1.5 s."""
    who = person(pointing=4.0, pace=1.0)
    track = point(Predictor(who, LIMITLESS), lambda now: 1.0, 0.5, 2.0, frame=0.002)
    assert next(x for now, x, _ in track if now > 1.5) == pytest.approx(0.982, abs=0.005)


def test_without_quality_a_predictor_is_its_inner_strategy():
    plain = drive(Pursuit(person(), ROBOT), way(*CORNER), 1.0, 40.0)
    assert drive(Predictor(person(), ROBOT, quality=0.0), way(*CORNER), 1.0, 40.0) == plain


def test_the_better_the_prediction_the_sooner_one_arrives():
    def time(quality: float) -> float:
        route = way((0, 0), (10, 0))
        track = drive(Predictor(person(), ROBOT, quality=quality), route, 3.0, 120.0)
        return next(at.time for at in track if at.x > 9.5)

    assert time(0.0) > time(0.5) + 5.0 > time(1.0) + 10.0


class GivenDelay(Strategy):
    """An oracle in a closed loop: everything is seen without delay."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.oracle = Oracle(*given)

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        return self.oracle.drive(route, Truth(view.seen, view.delay), stop_before)


def test_the_oracle_steers_from_where_what_it_asks_for_takes_effect():
    without = drive(Pursuit(person(), ROBOT), way(*CORNER), 0.0, 40.0)
    reported = drive(GivenDelay(person(), ROBOT), way(*CORNER), 2.0, 40.0)
    for ideal, at in zip(without, reported, strict=True):
        assert at.wanted == pytest.approx(ideal.wanted, abs=1e-6)


# --- adaptive --------------------------------------------------------------------------------


def test_who_adapts_changes_once_as_the_delay_grows_and_says_for_how_long():
    strategy = Adaptive(person(), ROBOT)
    reported = lambda now: 0.05 * now  # noqa: E731
    track = drive(strategy, way((0, 0), (400, 0)), 0.5, 100.0, reported_delay=reported)
    assert strategy.using == "move_and_wait"
    assert strategy.switches == 1
    since = next(at.time for at in track[10:] if at.wanted == (0.0, 0.0))
    assert 1.0 < reported(since) < 3.0
    share = strategy.workload()["move_and_wait_share"]
    assert share == pytest.approx((100.0 - since) / 100.0, abs=0.01)


def test_who_adapts_does_not_wait_for_what_it_has_not_done():
    strategy = Adaptive(person(), ROBOT)
    track = drive(strategy, way((0, 0), (10, 0)), 4.0, 20.0)
    assert strategy.using == "move_and_wait"
    assert track[0].wanted != (0.0, 0.0)


def test_a_delay_that_comes_and_goes_a_little_changes_nothing():
    strategy = Adaptive(person(), ROBOT)
    grows = lambda now: 0.05 * min(now, 60.0) + 0.2 * (int(now) % 2)  # noqa: E731
    drive(strategy, way((0, 0), (400, 0)), 0.5, 120.0, reported_delay=grows)
    assert strategy.switches == 1


@pytest.mark.parametrize(("delay", "using"), [(0.3, "closed"), (4.0, "move_and_wait")])
def test_who_adapts_takes_what_is_done_sooner(delay, using):
    strategy = Adaptive(person(), ROBOT)
    drive(strategy, way((0, 0), (10, 0)), delay, 20.0)
    assert strategy.using == using
