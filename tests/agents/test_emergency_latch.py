"""Latch of a robot: who and what ends an emergency, and who and what does not."""

from __future__ import annotations

import pytest
from helpers.dva.permissions import confirmation, hear

from dva_sim.agents.robot.controller import Decision, Limits, Mode, RobotController
from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.protocol import messages as m

DVA, ROBOT, ANA, RUI = (f"02:00:00:00:00:0{i}" for i in range(1, 5))
PLACE = m.Position(38.66, -9.2)
ORDERS = {
    "start": m.StartTeleOp(),
    "go to": m.GoTo((PLACE,)),
    "patrol": m.Patrol((PLACE,), 0),
    "inspect": m.Inspect(3, "fire", PLACE),
    "return": m.ReturnToBase(),
}
pytestmark = pytest.mark.invariant("S3")


class Stopped:
    """A robot held by one device, and stopped by Rui at 2 s."""

    def __init__(self, rule: str | None = None, holder: str = ANA) -> None:
        self.robot = RobotController(ROBOT, DVA, Limits(3.0, 6.0), latch=EmergencyLatch(rule))
        self.number = 0
        self.say(DVA, m.PermissionGrant(holder, "both", 7), 0.0)
        self.robot.inquiry.next(0.0)
        hear(self.robot, confirmation(m.PermissionGrant(holder, "both", 7)))
        assert self.say(RUI, m.Emergency(), 2.0, 0).code == m.OK

    def say(self, source: str, body: m.Body, now: float, session: int = 7) -> Decision:
        self.number += 1
        message = m.Message(ROBOT, self.number, source, "12:00:00", session, body)
        return self.robot.handle(message, now, now, moving=False)

    def answer(self, released_by: str, tick: int = 2000, releaser: str | None = None) -> None:
        """Let the DVA answer the robot's request for a release."""
        released = None if releaser is None else m.ByWhom(releaser, "Rui", 0.0)
        hear(self.robot, m.Reply(1, m.OK, "", m.EmergencyRelease(tick, released_by, released)))


@pytest.fixture
def stopped() -> Stopped:
    return Stopped()


def test_nothing_is_ordered_while_an_emergency_holds_the_robot():
    for order in ORDERS.values():
        for holder in (ANA, DVA):
            stopped = Stopped("person", holder)
            decision = stopped.say(holder, order, 60.0)
            assert (decision.code, stopped.robot.mode) == (m.BUSY, Mode.IDLE), order


@pytest.mark.parametrize("name", ORDERS)
def test_a_release_by_a_person_lets_orders_through_again(stopped, name):
    stopped.answer("person", releaser=RUI)
    assert stopped.say(ANA, ORDERS[name], 3.0).code == m.OK


def test_a_new_holder_does_not_release_it(stopped):
    stopped.say(DVA, m.PermissionGrant(RUI, "both", 8), 3.0)
    stopped.robot.inquiry.next(3.0)
    hear(stopped.robot, confirmation(m.PermissionGrant(RUI, "both", 8)), 3.1)
    assert stopped.robot.grant.holder == RUI
    assert stopped.say(RUI, m.StartTeleOp(), 4.0, 8).code == m.BUSY


def test_a_start_releases_it_only_where_nobody_else_can():
    for rule, said, code in [
        ("drive", None, m.OK),
        ("person", None, m.BUSY),
        ("person", "drive", m.BUSY),
        (None, None, m.BUSY),  # the DVA has not answered yet
        (None, "drive", m.OK),
        (None, "person", m.BUSY),
    ]:
        stopped = Stopped(rule)
        if said is not None:
            stopped.answer(said)
        assert stopped.say(ANA, m.StartTeleOp(), 5.0).code == code, (rule, said)
        assert stopped.robot.latch.holds == (code == m.BUSY)


@pytest.mark.parametrize("name", ["go to", "patrol", "inspect", "return"])
def test_a_mission_never_releases_it(name):
    for holder in (ANA, DVA):
        assert Stopped("drive", holder).say(holder, ORDERS[name], 60.0).code == m.BUSY


def test_once_a_person_is_needed_a_later_answer_does_not_loosen_that(stopped):
    stopped.answer("person")
    stopped.answer("drive")
    assert stopped.say(ANA, m.StartTeleOp(), 5.0).code == m.BUSY


def test_a_dva_that_knows_no_releases_leaves_it_to_the_holder(stopped):
    stopped.robot.latch.take_refusal()
    assert stopped.say(ANA, m.StartTeleOp(), 5.0).code == m.OK


def test_a_release_for_an_earlier_emergency_does_not_count(stopped):
    stopped.say(ANA, m.Emergency(), 3.0, 0)
    stopped.answer("person", tick=2000, releaser=RUI)
    assert stopped.robot.latch.holds
    stopped.answer("person", tick=3000, releaser=RUI)
    assert not stopped.robot.latch.holds


def test_a_message_in_the_dvas_name_releases_nothing(stopped):
    assert stopped.say(RUI, m.ReleaseEmergency(ROBOT), 3.0).code == m.NOT_PERMITTED
    assert stopped.say(DVA, m.ReleaseEmergency(ROBOT), 3.0).code == m.OK
    assert stopped.robot.latch.holds


def test_a_restart_of_its_program_keeps_it_stopped(stopped):
    stopped.robot.restart(clock_offset=500.0, now=10.0)
    assert stopped.robot.latch.message(12.0) == m.RobotEmergency(RUI, 10.0, 2000)


def test_the_first_who_stopped_it_is_named_and_the_last_who_released_it(stopped):
    stopped.say(ANA, m.Emergency(), 4.0, 0)
    assert stopped.robot.latch.message(5.0) == m.RobotEmergency(RUI, 3.0, 4000)
    stopped.answer("person", tick=4000, releaser=ANA)
    assert stopped.robot.latch.message(6.0).released == m.ByWhom(ANA, "Rui", 0.0)
    stopped.say(ANA, m.Emergency(), 7.0, 0)
    assert stopped.robot.latch.message(8.0) == m.RobotEmergency(ANA, 1.0, 7000)


def test_a_hand_at_the_robot_releases_it_and_a_taker_does_not():
    stopped = Stopped("person")
    stopped.robot.grant = None
    assert stopped.robot.take_by_hand("warden", 5.0, moving=False).code == m.BUSY
    assert stopped.robot.release_by_hand("warden").code == m.OK
    assert stopped.robot.release_by_hand("warden").code == m.WRONG_MODE
    assert stopped.robot.take_by_hand("warden", 6.0, moving=False).code == m.OK


def test_a_robot_that_stands_after_a_sleep_takes_the_next_order(stopped):
    stopped.answer("person", releaser=RUI)
    stopped.robot.stand(10.0)
    assert stopped.say(ANA, m.StartTeleOp(), 9.0).code == m.STALE
    assert stopped.say(ANA, m.StartTeleOp(), 11.0).code == m.OK
