"""Emergencies in a whole run: nothing drives on until a person who may has released the robot."""

from __future__ import annotations

import random

import pytest
from helpers.mutation.bugs import planted

from dva_sim.agents.robot.controller import Mode
from dva_sim.core.events import State
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.storms.intruder import Intruder
from dva_sim.storms.releaser import LABEL, Releaser

ROBOTS = [id_of("robot", number) for number in (1, 2, 3)]
STOPPED_AT = 30.0  # [s]; all three are on their rounds
STARTS = {"events.0.at_s": 5, "events.1.at_s": 40, "events.2.at_s": 35}
ENDS = 110.0  # [s]; the guard is at the flood, and nobody is free for the fire
pytestmark = pytest.mark.invariant("S3")


def patrol(release: str | None = "person") -> tuple[Run, Releaser]:
    """The campus at night, and a person who releases nobody by herself."""
    changes = {"emergency.release": release, "dva.control_rooms": {LABEL: "dispatch"}} | STARTS
    run = Run(scenarios.build(scenarios.load("campus-patrol"), changes), 1)
    releaser = Releaser(run.stage, (), random.Random(1))
    releaser.start()
    intruder = Intruder(run.stage)
    for robot in ROBOTS:
        run.clock.call_at(STOPPED_AT, intruder.ask, robot, m.Emergency())
    return run, releaser


def driven(run: Run, since: float, until: float) -> dict[str, float]:
    """Return how far each robot gets in that time [m]."""
    run.clock.run(since)
    before = {robot: run.field.robots[robot].body.distance for robot in ROBOTS}
    run.clock.run(until)
    return {robot: run.field.robots[robot].body.distance - before[robot] for robot in ROBOTS}


def test_after_an_emergency_no_patrol_order_or_operator_moves_a_robot():
    run, _ = patrol()
    assert min(driven(run, 0.0, STOPPED_AT).values()) > 2.5
    assert max(driven(run, STOPPED_AT + 3.0, ENDS).values()) < 0.01
    assert [event.state for event in run.dva.events.values()] == [State.ASSIGNED, State.PENDING]
    assert all(run.field.robots[robot].controller.latch.holds for robot in ROBOTS)
    assert run.recorder.violations == {}


def test_a_released_robot_goes_its_rounds_and_is_sent_again_and_the_others_stand():
    run, releaser = patrol()
    run.clock.call_at(45.0, releaser.release, ROBOTS[1])
    ways = driven(run, 48.0, ENDS)
    assert ways[ROBOTS[1]] > 5.0
    assert ROBOTS[1] in [event.responder for event in run.dva.events.values()]
    assert max(ways[ROBOTS[0]], ways[ROBOTS[2]]) < 0.01
    assert run.field.robots[ROBOTS[1]].controller.latch.released.label == LABEL
    assert run.recorder.violations == {}


def test_a_robot_stays_stopped_over_restarts_of_its_program_and_of_the_dva():
    run, releaser = patrol()
    robot = run.field.robots[ROBOTS[0]]
    run.clock.call_at(40.0, robot.restart, 77.0)
    run.clock.call_at(42.0, setattr, robot.device, "silent", False)
    run.clock.run(ENDS)
    assert robot.controller.latch.holds
    assert robot.controller.mode is Mode.IDLE
    releaser.release(ROBOTS[0])
    run.clock.run(ENDS + 10.0)
    assert not robot.controller.latch.holds
    assert run.recorder.violations == {}


def test_without_anybody_who_may_release_only_a_start_of_its_holder_does():
    """The operators here send missions, which release nothing."""
    run, _ = patrol(None)
    assert max(driven(run, STOPPED_AT + 3.0, ENDS).values()) < 0.01
    assert run.recorder.violations == {}


@pytest.mark.parametrize("name", ["policy-drives-on", "releases-unasked"])
def test_a_dva_that_lets_the_policy_go_on_is_found(name):
    with planted(name) as bug:
        run, _ = patrol()
        run.clock.run(STOPPED_AT + 20.0)
    assert bug.acts > 0
    assert set(run.recorder.violations) == {"S3"}


@pytest.mark.parametrize(("kept_nothing_s", "broken"), [(0.0, {"S3"}), (5.0, set())])
def test_a_dva_that_could_keep_nothing_has_forgotten_what_robots_told_it(kept_nothing_s, broken):
    run, _ = patrol()
    run.clock.run(STOPPED_AT + 10.0)
    run.audit.kept_nothing_for(kept_nothing_s)
    order = m.Message(ROBOTS[0], 9999, DVA, "12:00:00", 0, m.ReturnToBase())
    run.audit.sent(run.clock.now, DVA, ROBOTS[0], encode(order))
    assert set(run.recorder.violations) == broken
