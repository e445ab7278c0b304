"""Attention: choosing one of several robots to look at."""

from dataclasses import dataclass, field
from itertools import pairwise, repeat

import numpy as np
import pytest

from dva_sim.agents.habits import AttentionHabits
from dva_sim.agents.operator.attention import Attention, next_screen
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import DriveLog

HABITS = AttentionHabits(glance_s=3.0)


@dataclass
class Robot:
    """A screen that notes when the person looks away."""

    waits_since: float | None = None
    log: DriveLog = field(default_factory=lambda: DriveLog("robot", "operator", 1, 0.0))
    left: int = 0

    def look_away(self) -> None:
        self.left += 1


def two_screens() -> tuple[Clock, Robot, Robot, Attention]:
    """Two robots that somebody has begun to look at."""
    clock, one, two = Clock(), Robot(), Robot()
    attention = Attention(clock, 1.0, HABITS, repeat(0.0))
    attention.begin(one)
    attention.begin(two)
    return clock, one, two, attention


@pytest.mark.parametrize(
    ("why", "waits", "chosen"),
    [
        ("who is judged now is judged to the end", (90.0, 10.0, 20.0), 0),
        ("who has waited longest comes first", (None, 30.0, 20.0), 2),
        ("a robot that only drives is left for one that waits", (None, None, 99.9), 2),
    ],
)
def test_judgements_come_first(why, waits, chosen):
    assert next_screen(100.0, 0, 99.0, waits, (0.0, 50.0, 40.0), HABITS.glance_s) == chosen, why


@pytest.mark.parametrize("glance", [1.5, 3.0])
def test_while_none_waits_each_is_glanced_at_in_turn(glance):
    waits, seen = (None, None, None), (0.0, 50.0, 40.0)
    assert next_screen(100.0, 0, 100.1 - glance, waits, seen, glance) == 0
    assert next_screen(100.0, 0, 100.0 - glance, waits, seen, glance) == 2  # not seen for longest


def test_of_a_single_robot_everything_is_seen_at_once_and_all_the_time():
    clock, robot = Clock(), Robot()
    attention = Attention(clock, 1.0, HABITS, repeat(0.0))
    attention.begin(robot)
    assert attention.looks_at(robot)
    clock.run(60.0)
    assert attention.looks_at(robot)
    attention.end(robot)
    assert robot.log.attended == [(0.0, 60.0)]
    assert robot.log.turned_to == 0


def test_two_robots_share_the_eyes_and_each_turn_costs_the_switch():
    """3 s of looking, up to 0.5 s until the person moves on, 1 s to find into the other."""
    clock, one, two, attention = two_screens()
    clock.run(90.0)
    attention.end(one)
    attention.end(two)
    for robot in (one, two):
        seen = sum(until - since for since, until in robot.log.attended)
        assert seen == pytest.approx(90.0 / 2 * 3.0 / 4.0, rel=0.15)
    turns = one.log.turned_to + two.log.turned_to
    assert turns == pytest.approx(90.0 / 4.0, abs=3)
    spans = sorted(one.log.attended + two.log.attended)
    gaps = [after[0] - before[1] for before, after in pairwise(spans)]
    assert gaps == pytest.approx([1.0] * len(gaps))


def test_looks_differ_as_the_spread_of_their_logarithm_says():
    clock, robots = Clock(), (Robot(), Robot())
    habits = AttentionHabits(reconsiders_s=0.05)
    noise = iter(np.random.default_rng(1).normal(size=2000).tolist())
    attention = Attention(clock, 1.0, habits, noise)
    for robot in robots:
        attention.begin(robot)
    clock.run(6000.0)
    looks = np.log([until - since for r in robots for since, until in r.log.attended])
    assert np.exp(np.median(looks)) == pytest.approx(habits.glance_s, rel=0.1)
    assert looks.std() == pytest.approx(habits.glance_spread, rel=0.1)


def test_who_waits_for_a_judgement_keeps_the_eyes_until_it_is_over():
    clock, one, two, attention = two_screens()
    clock.run(0.2)
    two.waits_since = 0.2
    clock.run(50.0)
    assert attention.looks_at(two)
    assert (one.left, one.log.turned_to, two.log.turned_to) == (1, 0, 1)
    attention.end(two)
    assert not attention.looks_at(one)
    clock.run(51.0)
    assert attention.looks_at(one)


def test_the_last_screen_that_goes_off_leaves_nothing_to_look_at():
    clock, one, two = Clock(), Robot(), Robot()
    attention = Attention(clock, 1.0, HABITS, repeat(0.0))
    attention.begin(one)
    attention.end(one)
    attention.end(one)  # said twice
    attention.begin(two)
    assert not attention.looks_at(one)
    assert attention.looks_at(two)
