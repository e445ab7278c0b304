"""Promises of robot motors: kept by the shipped ones, missed by the bad ones here."""

import itertools
import math

import pytest
from helpers.paths import ROOT

from dva_sim.cli import checks
from dva_sim.testing.promises import tried
from dva_sim.testing.robots import check_robot
from dva_sim.worlds.drives import Differential

NAMES = sorted(path.stem for path in (ROOT / "agents/robots").glob("*.yaml"))


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_that_is_shipped_keeps_its_promises(fewer, name):
    outcome = tried(check_robot, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), ())
    assert outcome.tries >= 48


honest = Differential.accelerations
count = itertools.count(1)


def aims(set_point):
    """Motors that make something else of what they are asked for."""
    return type("Bad", (Differential,), {"set_point": lambda self, *asked: set_point(*asked)})


def answers(accelerations):
    """Motors that answer otherwise; given the honest answer, the speed, and that asked for."""

    def other(self, speed, turn_rate, now, now_turn_rate, dt):
        fair = honest(self, speed, turn_rate, now, now_turn_rate, dt)
        return accelerations(*fair, now, speed)

    return type("Bad", (Differential,), {"accelerations": other})


def brakes_beyond_zero(_along, turn, now, _speed):
    return (-0.5 if now > -0.2 else 0.0), turn


@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        (aims(lambda speed, turn: (2 * speed, turn)), "aims at a speed beyond the limits: ("),
        (aims(lambda speed, turn: (speed, 2 * turn)), "aims at a turn rate beyond the limit: ("),
        (aims(lambda speed, turn: (speed / (speed or math.nan), turn)), "no number: (nan, "),
        (
            answers(lambda along, turn, now, _: (math.inf if now < 0 else along, turn)),
            "no number: ",
        ),
        (answers(lambda *_: (0.001 * next(count), 0.0)), "remembers: "),  # shared by all of them
        (answers(lambda _, turn, now, v: (0.5 if v > 0 else -now, turn)), "drives faster than"),
        (answers(lambda along, *_: (along, 1.0)), "turns faster than its limit: "),
        (answers(brakes_beyond_zero), "drives backwards: "),
        (answers(lambda along, turn, *_: (max(along, -0.1), turn)), "stops too late: 1.25"),
        (answers(lambda along, turn, *_: (max(along, 0.0), turn)), "within a minute: 0.5 m/s"),
    ],
)
def test_a_broken_promise_is_told_in_a_plain_line(fewer, drive, expected):
    outcome = tried(check_robot, drive)
    assert any(expected in line for line in outcome.broken), outcome.broken


@pytest.mark.parametrize(
    ("names", "options", "expected"),
    [
        (["robot", "servrobut"], [], "did you mean 'servrobot'?"),
        (["robot", "tracked"], ["scrub=2"], "option 'scrub' is 2; "),
        (["robot", "tracked"], ["speed=2"], "has no option 'speed'; known: scrub"),
        (["robot", "pibot"], ["steering_deg=90"], "is 90; should be in (0, 80)"),
    ],
)
def test_a_mistake_is_one_line(names, options, expected, capsys):
    assert checks.check(names, options) == 1
    out = capsys.readouterr().out
    assert expected in out
    assert len(out.splitlines()) == 2
