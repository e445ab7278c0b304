"""Emergencies as the DVA knows them: whom it does not send, who may release, and what survives."""

from __future__ import annotations

import pytest
from helpers.dva.dispatch_office import (
    GUARD,
    OPERATOR,
    OTHER_ROBOT,
    OTHER_ROOM,
    ROBOT,
    ROOM,
    Office,
)

from dva_sim.core.assignments import Rules
from dva_sim.core.emergencies import UNCONFIRMED_AFTER
from dva_sim.core.sessions import Send
from dva_sim.core.store import Store
from dva_sim.protocol import messages as m

STOPPED = m.RobotEmergency(GUARD, 0.5, 7000)
LATER = m.RobotEmergency(GUARD, 0.0, 9000)
pytestmark = pytest.mark.invariant("S3")


def staffed(**roles: str) -> Office:
    office = Office(rules=Rules(escalate_after=500.0), roles={ROOM: "dispatch", **roles})
    office.register(ROOM, "ControlRoom")
    return office


def release_of(reply: m.Reply) -> m.EmergencyRelease:
    assert isinstance(reply.content, m.EmergencyRelease)
    return reply.content


def stopped(office: Office, emergency: m.RobotEmergency = STOPPED, now: float = 1.0):
    return release_of(office.say(ROBOT, emergency, now)[0])


@pytest.fixture
def office() -> Office:
    return staffed()


def test_who_releases_depends_on_who_is_registered():
    for roles, rule in [
        ({}, "drive"),
        ({ROOM: "look"}, "drive"),
        ({ROOM: "drive"}, "drive"),
        ({ROOM: "dispatch"}, "person"),
        ({ROOM: "supervise"}, "person"),
    ]:
        office = Office(roles=roles)
        if roles:
            office.register(ROOM, "ControlRoom")
        assert stopped(office) == m.EmergencyRelease(7000, rule, None), roles


def test_a_stopped_robot_is_sent_nowhere_and_its_event_is_open_to_others(office):
    office.fire(12)
    assert office.event().responder == ROBOT
    stopped(office)
    assert office.event().responder == GUARD
    office.fire(90, now=2.0)
    assert office.event(2).responder is None
    reply, _ = office.say(ROOM, m.Assign(2, ROBOT), 3.0)
    assert reply.code == m.BUSY
    reply, _ = office.say(ROOM, m.GetProposal(2), 3.0)
    (candidate,) = (each for each in reply.content.candidates if each.device == ROBOT)
    assert "emergency" in candidate.reason


def test_a_released_robot_is_told_to_ask_and_may_be_sent(office):
    stopped(office)
    reply, sends = office.say(ROOM, m.ReleaseEmergency(ROBOT, "nobody is hurt"), 5.0)
    assert reply.code == m.OK
    assert Send(ROBOT, m.ReleaseEmergency(ROBOT)) in sends
    assert stopped(office, now=5.5).released == m.ByWhom(ROOM, "controlroom", 0.5)
    office.fire(12, now=6.0)
    assert office.event().responder == ROBOT


def test_a_release_is_for_one_emergency(office):
    stopped(office)
    office.say(ROOM, m.ReleaseEmergency(ROBOT), 5.0)
    assert stopped(office, LATER, 6.0).released is None
    assert office.core.emergencies.holds(ROBOT)
    assert stopped(office, LATER, 7.0).released is None


def test_pressing_release_twice_or_together_is_one_release():
    office = staffed(**{OTHER_ROOM: "dispatch"})
    office.register(OTHER_ROOM, "ControlRoom")
    stopped(office)
    assert office.say(ROOM, m.ReleaseEmergency(ROBOT), 5.0)[0].code == m.OK
    reply, sends = office.say(OTHER_ROOM, m.ReleaseEmergency(ROBOT), 6.0)
    assert (reply.code, sends) == (m.OK, [])
    assert stopped(office, now=7.0).released.device == ROOM


@pytest.mark.parametrize(
    ("source", "robot", "code"),
    [
        (OPERATOR, ROBOT, m.NOT_PERMITTED),
        (OTHER_ROOM, ROBOT, m.NOT_PERMITTED),
        (ROOM, OTHER_ROBOT, m.UNKNOWN_DEVICE),
        (ROOM, GUARD, m.UNKNOWN_DEVICE),
    ],
)
def test_who_may_not_release_or_nothing_that_is_there_changes_nothing(source, robot, code):
    office = staffed(**{OTHER_ROOM: "drive"})
    office.register(OTHER_ROOM, "ControlRoom")
    stopped(office)
    reply, sends = office.say(source, m.ReleaseEmergency(robot), 5.0)
    assert (reply.code, sends) == (code, [])
    assert office.core.emergencies.holds(ROBOT)


def test_an_emergency_that_nobody_has_reported_cannot_be_released():
    assert staffed().say(ROOM, m.ReleaseEmergency(ROBOT), 5.0)[0].code == m.WRONG_MODE


def test_only_a_robot_reports_an_emergency():
    assert staffed().say(GUARD, STOPPED, 1.0)[0].code == m.NOT_SUPPORTED


def test_stop_and_release_are_in_the_trail_with_who_and_when(office):
    stopped(office)
    stopped(office, now=2.0)
    office.say(ROOM, m.ReleaseEmergency(ROBOT, "checked"), 5.0)
    facts = [(f.time, f.author, f.action, f.device, f.cause) for f in office.core.trail.take()]
    assert facts == [
        (1.0, GUARD, "emergency", ROBOT, ""),
        (5.0, ROOM, "release_emergency", ROBOT, "checked"),
    ]


def test_a_robot_whose_program_was_replaced_is_stopped_again(office):
    stopped(office)
    office.number = 0  # of its new program
    sends = office.register(ROBOT, "Robot", now=3.0)
    assert Send(ROBOT, m.Emergency()) in sends


def test_a_robot_that_no_longer_says_that_it_is_stopped_is_sent_again(office):
    stopped(office)
    office.status(ROBOT, 10, 2.0 + UNCONFIRMED_AFTER)
    office.core.tick(2.5 + UNCONFIRMED_AFTER)
    assert not office.core.emergencies.holds(ROBOT)


def test_a_stopped_robot_that_is_silent_is_not_forgotten(office):
    stopped(office)
    office.core.tick(5000.0)
    assert office.core.emergencies.holds(ROBOT)
    assert ROBOT in office.core.registry.entries


def test_a_restarted_dva_knows_who_is_stopped(office, tmp_path):
    memory = Store(tmp_path / "dva.sqlite")
    stopped(office)
    assert memory.keep(office.core, office.core.events.changes(), 1.0) is None
    memory.close()
    office.core = office.new_core()
    Store(tmp_path / "dva.sqlite").recall(office.core, 100.0)
    assert office.core.emergencies.holds(ROBOT)
    assert office.say(ROOM, m.ReleaseEmergency(ROBOT), 101.0)[0].code == m.OK
    assert stopped(office, now=102.0).released.device == ROOM


def test_a_release_is_remembered_too(office, tmp_path):
    memory = Store(tmp_path / "dva.sqlite")
    stopped(office)
    memory.keep(office.core, office.core.events.changes(), 1.0)
    office.say(ROOM, m.ReleaseEmergency(ROBOT), 5.0)
    memory.keep(office.core, office.core.events.changes(), 5.0)
    memory.close()
    office.core = office.new_core()
    Store(tmp_path / "dva.sqlite").recall(office.core, 100.0)
    assert not office.core.emergencies.holds(ROBOT)
