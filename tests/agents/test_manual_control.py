"""A robot in somebody's hand, at the robot itself: what the controller decides."""

import math

import pytest
from helpers.dva.permissions import confirmation, give, hear
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import (
    INQUIRY_WAIT_S,
    LEASE_S,
    STANDSTILL,
    Limits,
    Mode,
    RobotController,
)
from dva_sim.agents.robot.decision_log import (
    ASKS,
    LET_GO,
    PRESSED,
    RELEASES_UNKNOWN,
    TAKEN_BY_HAND,
    DecisionLog,
    replay,
)
from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.protocol import messages as m

DVA, ROBOT, ANA = (f"02:00:00:00:00:0{i}" for i in range(1, 4))
HERE, THERE = "one hand", "another hand"


@pytest.fixture
def robot() -> RobotController:
    return RobotController(ROBOT, DVA, Limits(watchdog=3.0, max_age=6.0))


@pytest.fixture
def in_hand(robot: RobotController) -> RobotController:
    assert robot.take_by_hand(HERE, 0.0, moving=False).code == m.OK
    return robot


def say(robot: RobotController, source: str, body: m.Body, now: float, number: int = 1):
    if isinstance(body, m.PermissionGrant):
        return give(robot, body, now)
    message = m.Message(ROBOT, number, source, "12:00:00", 7, body)
    return robot.handle(message, now, now, moving=False)


def test_what_a_hand_wants_is_in_force_until_the_watchdog(in_hand):
    decision = in_hand.drive_by_hand(HERE, 0.4, -0.2, 5.0)
    assert decision.set_point == (0.4, -0.2, 8.0)
    assert in_hand.mode is Mode.IDLE


@pytest.mark.invariant("S2")
def test_whoever_has_permission_is_told_that_the_robot_is_busy(in_hand):
    assert say(in_hand, DVA, m.PermissionGrant(ANA, "both", 7), 1.0).code == m.OK
    for number, body in enumerate((m.StartTeleOp(), m.ReturnToBase()), 2):
        decision = say(in_hand, ANA, body, 2.0, number)
        assert decision.code == m.BUSY
        assert "at the robot" in decision.text
    assert in_hand.drive_by_hand(HERE, 0.4, 0.0, 3.0).code == m.OK
    assert in_hand.let_go(HERE).set_point == STANDSTILL
    assert say(in_hand, ANA, m.StartTeleOp(), 4.0, 9).code == m.OK


def test_a_robot_in_a_hand_is_not_free_for_the_dva(in_hand):
    assert not in_hand.free
    decision = say(in_hand, DVA, m.TaskAward(1), 1.0)
    assert decision.code == m.BUSY
    assert "at the robot" in decision.text


@pytest.mark.invariant("S2")
def test_a_robot_that_somebody_holds_says_who_and_goes_into_no_hand(robot):
    say(robot, DVA, m.PermissionGrant(ANA, "teleoperation", 7), 0.0)
    decision = robot.take_by_hand(HERE, 1.0, moving=False)
    assert (decision.code, decision.text) == (m.BUSY, f"held by {ANA}")
    say(robot, DVA, m.PermissionRevocation(ROBOT, ANA, 7), 2.0, 2)
    assert robot.inquiry.next(2.0) is not None
    assert robot.take_by_hand(HERE, 2.5, moving=False).code == m.BUSY  # the DVA is being asked
    assert robot.take_by_hand(HERE, 2.0 + INQUIRY_WAIT_S, moving=False).code == m.OK


@pytest.mark.invariant("S2")
def test_a_robot_that_has_restarted_asks_who_holds_it_before_it_goes_into_a_hand(robot):
    grant = m.PermissionGrant(ANA, "teleoperation", 7)
    say(robot, DVA, grant, 0.0)
    robot.restart(clock_offset=5.0, now=100.0)
    assert robot.take_by_hand(HERE, 100.03, moving=False).code == m.BUSY
    assert robot.inquiry.next(100.1) == m.GetGrant()
    hear(robot, confirmation(grant), 100.2)
    assert robot.take_by_hand(HERE, 200.0, moving=False).text == f"held by {ANA}"


@pytest.mark.invariant("S2")
def test_a_robot_that_has_restarted_without_a_dva_goes_into_a_hand_after_a_while(robot):
    robot.restart(clock_offset=5.0, now=100.0)
    assert robot.take_by_hand(HERE, 100.0 + INQUIRY_WAIT_S, moving=False).code == m.OK


@pytest.mark.invariant("S2")
def test_only_a_robot_that_stands_is_taken_and_by_one_hand(robot):
    refused = robot.take_by_hand(HERE, 0.0, moving=True)
    assert (refused.code, unnamed(refused.text, "standstill")) == (m.BUSY, [])
    assert robot.take_by_hand(HERE, 1.0, moving=False).code == m.OK
    assert robot.take_by_hand(HERE, 1.0, moving=True).code == m.OK
    assert robot.take_by_hand(THERE, 2.0, moving=False).code == m.BUSY
    assert robot.drive_by_hand(THERE, 0.1, 0.0, 2.0).code == m.WRONG_MODE
    assert robot.let_go(THERE).code == m.WRONG_MODE


@pytest.mark.invariant("S3")
def test_an_emergency_wins_and_the_robot_has_to_be_taken_again(in_hand):
    in_hand.drive_by_hand(HERE, 0.4, 0.0, 1.0)
    assert say(in_hand, ANA, m.Emergency(), 2.0).set_point == STANDSTILL
    assert in_hand.drive_by_hand(HERE, 0.4, 0.0, 2.1).code == m.WRONG_MODE
    assert in_hand.take_by_hand(HERE, 2.5, moving=False).code == m.BUSY
    assert in_hand.release_by_hand("warden").code == m.OK
    assert in_hand.take_by_hand(HERE, 3.0, moving=False).code == m.OK
    assert in_hand.drive_by_hand(HERE, 0.4, 0.0, 3.1).code == m.OK


@pytest.mark.invariant("S4")
@pytest.mark.parametrize(
    ("speed", "turn"), [(-0.1, 0.0), (math.nan, 0.0), (math.inf, 0.0), (0.1, math.nan)]
)
def test_a_hand_that_wants_what_no_motor_does_moves_nothing(in_hand, speed, turn):
    assert in_hand.drive_by_hand(HERE, speed, turn, 1.0).code == m.BAD_MESSAGE


def test_a_hand_of_which_nothing_is_heard_has_let_go(in_hand):
    in_hand.drive_by_hand(HERE, 0.0, 0.0, 5.0)
    assert not in_hand.expire(5.0 + LEASE_S)
    assert in_hand.expire(5.1 + LEASE_S)
    assert in_hand.take_by_hand(THERE, 40.0, moving=False).code == m.OK


def test_a_trace_of_a_robot_that_was_in_a_hand_is_replayed_to_the_same_decisions(robot, tmp_path):
    log = DecisionLog(tmp_path / "robot.trace.jsonl", robot)

    def receive(source: str, body: m.Body, now: float, number: int) -> None:
        message = m.Message(ROBOT, number, source, "12:00:00", 8, body)
        log.decided(message, now, now, False, robot.handle(message, now, now, False))
        if isinstance(body, m.PermissionGrant | m.PermissionRevocation):
            log.happened(ASKS, now)
            robot.inquiry.next(now)
            receive(
                DVA, confirmation(body if isinstance(body, m.PermissionGrant) else None), now, 1
            )

    receive(DVA, m.PermissionGrant(ANA, "both", 7), 1.0, 1)
    receive(DVA, m.PermissionRevocation(ROBOT, ANA, 7), 2.0, 2)
    robot.take_by_hand(HERE, 3.0, moving=False)
    log.happened(TAKEN_BY_HAND, 3.0)
    receive(DVA, m.PermissionGrant(ANA, "both", 8), 4.0, 3)
    receive(ANA, m.StartTeleOp(), 5.0, 4)
    robot.let_go(HERE)
    log.happened(LET_GO, 6.0)
    receive(ANA, m.StartTeleOp(), 7.0, 5)
    log.close()

    asked = list(replay(tmp_path / "robot.trace.jsonl"))
    assert [then.code for _, then, _ in asked][-2:] == [m.BUSY, m.OK]
    assert len(asked) == 5 + 3
    assert all(then == now for _, then, now in asked)


def test_a_trace_of_a_robot_whose_dva_knows_no_releases_is_replayed_to_the_same_decisions(
    robot, tmp_path
):
    robot.latch = EmergencyLatch(None)
    log = DecisionLog(tmp_path / "robot.trace.jsonl", robot)

    def receive(source: str, body: m.Body, now: float) -> int:
        message = m.Message(ROBOT, int(now), source, "12:00:00", 7, body)
        decision = robot.handle(message, now, now, False)
        log.decided(message, now, now, False, decision)
        return decision.code

    receive(DVA, m.PermissionGrant(ANA, "both", 7), 1.0)
    log.happened(ASKS, 1.0)
    robot.inquiry.next(1.0)
    receive(DVA, confirmation(m.PermissionGrant(ANA, "both", 7)), 2.0)
    robot.stop(3.0)
    log.happened(PRESSED, 3.0)
    assert receive(ANA, m.StartTeleOp(), 4.0) == m.BUSY
    robot.latch.take_refusal()
    log.happened(RELEASES_UNKNOWN, 5.0)
    assert receive(ANA, m.StartTeleOp(), 6.0) == m.OK
    log.close()
    codes = [(then.code, now.code) for _, then, now in replay(tmp_path / "robot.trace.jsonl")]
    assert codes == [(code, code) for code in (m.OK, m.OK, m.BUSY, m.OK)]
