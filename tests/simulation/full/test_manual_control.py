"""A robot of a run in somebody's hand: it moves, is stopped, and the audit believes nobody."""

import pytest
from helpers.dva.permissions import enter
from helpers.mutation.bugs import planted

from dva_sim.agents.robot.controller import (
    INQUIRY_WAIT_S,
    LEASE_S,
    STANDSTILL,
    Decision,
    RobotController,
    TimedSetPoint,
)
from dva_sim.agents.robot.faults import RobotFaults
from dva_sim.agents.robot.manual_control import ManualControl
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of

ROBOT, OPERATOR = id_of("robot", 1), id_of("operator", 9)
HAND = "hand"


class InHand:
    """A run in which nothing else happens, with a hand on its robot."""

    def __init__(self) -> None:
        quiet = {"events": [{"kind": "fire", "at_s": 500}], "horizon_s": 600}
        self.run = Run(scenarios.build(scenarios.load("drive-to-event"), quiet), 1)
        self.robot = self.run.field.robots[ROBOT]
        self.hand = ManualControl(self.robot)
        self.let(5.0)

    def let(self, seconds: float) -> None:
        self.run.clock.run(self.run.clock.now + seconds)

    def drive(self, seconds: float, speed: float = 0.3) -> list[int]:
        codes = []
        for _ in range(round(10 * seconds)):
            codes.append(self.hand.drive(HAND, speed, 0.0).code)
            self.let(0.1)
        return codes

    def asks(self, *bodies: m.Body, session: int = 0) -> None:
        """Somebody sends the robot requests, and each is answered."""
        device = self.run.stage.device("operator", 9)
        for body in bodies:
            device.ask(ROBOT, body, session=session)
            self.let(1.0)

    def is_held(self) -> None:
        """The DVA gives the robot to an operator."""
        grant = m.PermissionGrant(OPERATOR, "both", 1 << 33)
        enter(self.run.dva.core, ROBOT, grant)
        self.run.dva.device.ask(ROBOT, grant)
        self.let(1.0)

    def restarts_alone(self) -> None:
        """The robot restarts while the DVA is down, and waits as long as it waits for that."""
        self.run.dva.device.silent = True
        self.robot.restart(0.0)
        self.let(INQUIRY_WAIT_S)

    @property
    def broken(self) -> set[str]:
        return set(self.run.recorder.violations)


@pytest.fixture
def bench() -> InHand:
    return InHand()


def test_a_hand_drives_a_robot_and_breaks_no_rule(bench):
    assert bench.hand.take(HAND).code == m.OK
    assert set(bench.drive(3.0)) == {m.OK}
    assert bench.robot.body.speed == pytest.approx(0.3, abs=0.02)
    assert bench.hand.let_go(HAND).code == m.OK
    bench.let(2.0)
    assert bench.robot.body.speed == pytest.approx(0.0, abs=1e-3)
    assert bench.broken == set()


@pytest.mark.invariant("S2")
def test_a_hand_takes_a_robot_that_has_restarted_though_no_dva_has_told_it_that_it_is_free(bench):
    bench.is_held()
    assert bench.hand.take(HAND).code == m.BUSY
    bench.restarts_alone()
    assert bench.hand.take(HAND).code == m.OK
    assert bench.broken == set()


@pytest.mark.invariant("S2")
def test_a_robot_that_keeps_its_holder_over_a_restart_breaks_s2(bench):
    with planted("grant-kept-over-restart"):
        bench.is_held()
        bench.restarts_alone()
        bench.asks(m.StartTeleOp(), session=1 << 33)
    assert bench.broken == {"S2"}


@pytest.mark.invariant("S2")
def test_a_hand_that_was_silent_for_the_lease_has_let_go(bench):
    bench.hand.take(HAND)
    bench.drive(2.0)
    bench.let(LEASE_S + 5.0)
    bench.is_held()
    bench.asks(m.StartTeleOp(), m.SetTeleOp(0.2, 0.0), session=1 << 33)
    assert bench.robot.body.speed > 0.0
    assert bench.broken == set()


@pytest.mark.invariant("S1")
def test_a_hand_that_falls_silent_is_stopped_by_the_watchdog(bench):
    bench.hand.take(HAND)
    bench.drive(2.0)
    bench.let(2.5)
    assert bench.robot.body.speed > 0.2
    bench.let(2.0)
    assert bench.robot.body.speed == pytest.approx(0.0, abs=1e-3)
    assert bench.broken == set()


@pytest.mark.invariant("S4")
def test_a_hand_gets_no_more_than_the_motors_limits(bench):
    bench.hand.take(HAND)
    bench.drive(4.0, speed=9.0)
    assert bench.robot.body.speed <= 0.5 * 1.02
    assert bench.broken == set()


def test_an_emergency_stops_a_hand_for_good(bench):
    bench.hand.take(HAND)
    bench.drive(2.0)
    bench.asks(m.Emergency())
    bench.let(1.0)
    assert set(bench.drive(2.0)) == {m.WRONG_MODE}
    assert bench.robot.body.speed == pytest.approx(0.0, abs=1e-3)
    assert bench.broken == set()


def slack_watchdog(self: RobotController, who: str, speed: float, turn: float, now: float):
    return Decision(m.OK, set_point=TimedSetPoint(speed, turn, now + 60.0))


def takes_whatever(self: RobotController, who: str, now: float, moving: bool) -> Decision:
    self.by_hand, self.last_valid = who, now
    return Decision(m.OK, set_point=STANDSTILL)


def obeys_any_hand(self: RobotController, who: str, speed: float, turn: float, now: float):
    return Decision(m.OK, set_point=TimedSetPoint(speed, turn, now + self.limits.watchdog))


def does_not_begin(self: RobotController, *_: object, **__: object) -> None:
    """Faulty robot: starts any drive, even while another driver has it."""


def falls_silent(bench: InHand) -> None:
    bench.hand.take(HAND)
    bench.drive(1.0)
    bench.let(10.0)


def takes_a_held_one(bench: InHand) -> None:
    bench.is_held()
    bench.hand.take(HAND)


def drives_without_taking(bench: InHand) -> None:
    bench.drive(1.0)


def drives_after_an_emergency(bench: InHand) -> None:
    bench.hand.take(HAND)
    bench.drive(1.0)
    bench.asks(m.Emergency())
    bench.drive(1.0)


def takes_a_moving_one(bench: InHand) -> None:
    bench.hand.take(HAND)
    bench.drive(2.0)
    bench.hand.take("another")


def is_driven_by_messages_too(bench: InHand) -> None:
    bench.hand.take(HAND)
    bench.drive(1.0)
    bench.is_held()
    bench.asks(m.StartTeleOp(), session=1 << 33)


@pytest.mark.parametrize(
    ("what", "fault", "happens", "rule"),
    [
        ("drive_by_hand", slack_watchdog, falls_silent, "S1"),
        ("take_by_hand", takes_whatever, takes_a_held_one, "S2"),
        ("take_by_hand", takes_whatever, takes_a_moving_one, "S2"),
        ("_begin", does_not_begin, is_driven_by_messages_too, "S2"),
        ("drive_by_hand", obeys_any_hand, drives_without_taking, "S1"),
        ("drive_by_hand", obeys_any_hand, drives_after_an_emergency, "S3"),
    ],
)
def test_a_planted_fault_is_found_by_its_rule_and_without_it_nothing(
    monkeypatch, what, fault, happens, rule
):
    honest = InHand()
    happens(honest)
    honest.let(1.0)
    assert honest.broken == set()

    monkeypatch.setattr(RobotController, what, fault)
    faulty = InHand()
    happens(faulty)
    faulty.let(1.0)
    assert faulty.broken == {rule}


def test_every_fault_is_told_acts_and_leaves_no_trace_when_it_is_undone(bench):
    robot, frames = bench.robot, []
    robot.filmed = lambda _, frame: frames.append(frame)
    bench.run.network.subscribe(OPERATOR, ROBOT, "frame|", lambda _: None)
    faults = RobotFaults(robot)
    service = robot.inbox.service

    faults.slow_down(2.5)
    faults.drop_replies(True)
    faults.lose_camera(True)
    faults.stick("temperature", True)
    assert faults.any
    assert robot.inbox.service() == 2.5
    frames.clear()
    stuck = robot.sensors["temperature"].read(bench.run.clock.now)
    bench.let(60.0)
    assert robot.sensors["temperature"].read(bench.run.clock.now) == stuck
    assert frames == []

    faults.slow_down(None)
    faults.drop_replies(False)
    faults.lose_camera(False)
    faults.stick("temperature", False)
    bench.let(2.0)
    assert not faults.any
    assert robot.inbox.service is service
    assert frames
    story = [reported.what for reported in bench.run.recorder.timeline if reported.who == "robot-1"]
    faulty = [what for what in story if what.startswith("fault: ")]
    reported = zip(faulty, ("2.5 s", "replies", "camera", "temperature", "usual"), strict=True)
    assert all(word in what for what, word in reported)
    assert bench.broken == set()


def test_who_asks_a_robot_that_drops_its_replies_has_a_time_out(bench):
    faults, lost = RobotFaults(bench.robot, lambda robot, reply: lost.append(reply)), []
    device, answers = bench.run.stage.device("operator", 9), []
    faults.drop_replies(True)
    device.ask(ROBOT, m.GetSensorInfo(None), answers.append, lambda: answers.append(None))
    bench.let(60.0)
    assert answers == [None]
    assert len(lost) == device.attempts
    faults.drop_replies(False)
    device.ask(ROBOT, m.GetSensorInfo(None), answers.append)
    bench.let(5.0)
    assert answers[1].code == m.OK


def test_a_frozen_robot_runs_on_to_its_watchdog_and_wakes_up_idle(bench):
    faults = RobotFaults(bench.robot)
    bench.hand.take(HAND)
    bench.drive(2.0)
    faults.freeze(True)
    assert set(bench.drive(1.0)) == {m.BUSY}
    assert bench.robot.body.speed > 0.2
    bench.let(4.0)
    assert bench.robot.body.speed == pytest.approx(0.0, abs=1e-3)
    faults.freeze(False)
    bench.let(2.0)
    assert set(bench.drive(1.0)) == {m.WRONG_MODE}
    assert bench.hand.take(HAND).code == m.OK
    assert bench.broken == set()
