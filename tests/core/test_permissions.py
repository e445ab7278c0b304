"""Permissions: grants, sessions, sensors, and the rules of access."""

import math

import pytest
from helpers.dva.dispatch_office import (
    ADDRESS,
    DETECTOR,
    GUARD,
    OPERATOR,
    OTHER_OPERATOR,
    OTHER_ROBOT,
    ROBOT,
    Office,
)
from helpers.wording import unnamed

from dva_sim.core.events import State
from dva_sim.core.permissions import Access, AccessRule
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m

ASK = m.PermissionRequest(ROBOT, "teleoperation")


@pytest.fixture
def office() -> Office:
    return Office()


def guarded(*rules: AccessRule) -> Office:
    """Labels there are the types in small letters: operator is `teleop`."""
    return Office(access=Access(rules))


def granted(
    office: Office, who: str = OPERATOR, level: str = "teleoperation", now: float = 0.0
) -> m.Permission:
    asked = m.PermissionRequest(ROBOT, level, ("heat_flux",))
    content = office.say(who, asked, now)[0].content
    assert isinstance(content, m.Permission)
    return content


# --- one holder at a time ------------------------------------------------------------------


def test_a_robot_is_held_by_one_and_the_robot_is_told(office):
    office.register(OTHER_OPERATOR, "TeleOp")
    reply, sends = office.say(OPERATOR, ASK)
    assert isinstance(reply.content, m.Permission)
    reported = m.PermissionGrant(OPERATOR, "teleoperation", reply.content.session, ADDRESS)
    assert sends == [Send(ROBOT, reported, reported.session)]
    assert office.say(OTHER_OPERATOR, ASK)[0].code == m.BUSY


def test_only_an_operator_whose_order_it_is_may_drive_a_robot(office):
    assert office.say(DETECTOR, ASK)[0].code == m.NOT_PERMITTED
    office.register(OTHER_OPERATOR, "TeleOp")
    office.fire(12)
    assert office.event().operator == OPERATOR
    assert office.say(OTHER_OPERATOR, ASK)[0].code == m.BUSY
    assert office.say(OPERATOR, ASK)[0].code == m.OK


def test_nobody_can_be_granted_what_is_no_robot(office):
    for device in (GUARD, OTHER_ROBOT):
        asked = m.PermissionRequest(device, "teleoperation")
        assert office.say(OPERATOR, asked)[0].code == m.UNKNOWN_DEVICE


def test_sessions_only_grow(office):
    sessions = []
    for _ in range(3):
        sessions.append(granted(office).session)
        office.core.sessions.permissions.release(OPERATOR)
    assert sessions == sorted(set(sessions))


def test_a_session_grows_above_and_is_random_below(office):
    first = granted(office).session
    office.core.sessions.permissions.release(OPERATOR)
    office.core.sessions.permissions.draw = lambda: 2**32 - 1
    second = granted(office).session
    assert first & (2**32 - 1) == 7
    assert second & (2**32 - 1) == 2**32 - 1
    assert (second >> 32) - (first >> 32) == 1


def test_a_permission_introduces_holder_and_robot_to_each_other(office):
    office.say(ROBOT, m.Registration("robot", "Robot", "192.168.1.20:5600"), 10.1)
    reply, sends = office.say(OPERATOR, m.PermissionRequest(ROBOT, "both", ("heat_flux",)))
    content, grant = reply.content, sends[0].body
    assert isinstance(content, m.Permission)
    assert isinstance(grant, m.PermissionGrant)
    assert (content.address, content.sensors) == ("192.168.1.20:5600", ("heat_flux",))
    assert (grant.address, grant.sensors) == (ADDRESS, ("heat_flux",))
    assert grant.session == content.session


def test_a_robot_is_told_of_a_permission_once_and_again_when_its_holder_moves(office):
    ask = m.PermissionRequest(ROBOT, "both")
    first = office.say(OPERATOR, ask)[1]
    assert [type(send.body) for send in first] == [m.PermissionGrant]
    assert office.say(OPERATOR, ask)[1] == []
    office.say(OPERATOR, m.Registration("operator", "TeleOp", "192.168.1.77"), 10.1)
    moved = office.say(OPERATOR, ask)[1][0].body
    assert isinstance(moved, m.PermissionGrant)
    assert moved.address == "192.168.1.77"
    assert isinstance(first[0].body, m.PermissionGrant)
    assert moved.session == first[0].body.session


# --- the end of a session ------------------------------------------------------------------


def test_a_holder_gives_its_permission_back_and_the_robot_is_told(office):
    session = granted(office).session
    mine = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert office.say(DETECTOR, mine)[0].code == m.BAD_SESSION
    wrong = m.PermissionRevocation(ROBOT, OPERATOR, session + 1)
    assert office.say(OPERATOR, wrong)[0].code == m.BAD_SESSION
    reply, sends = office.say(OPERATOR, mine)
    assert (reply.code, sends) == (m.OK, [Send(ROBOT, mine)])
    assert granted(office).session > session


def test_a_silent_holder_loses_its_session_and_both_ends_are_told(office):
    session = granted(office).session
    office.status(ROBOT, 10, now=11.0)
    sends = office.core.tick(11.0)
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert sends == [Send(ROBOT, over), Send(OPERATOR, over)]
    assert office.core.sessions.permissions.grants == {}


def test_a_grant_that_fails_ends_its_own_session_alone(office):
    driver = granted(office).session
    office.core.sessions.permissions.draw = lambda: 8
    _, sends = office.say(OPERATOR, m.PermissionRequest(ROBOT, "sensors", ("heat_flux",)))
    office.no(sends, 1.0)
    assert office.core.sessions.permissions.grants[ROBOT].session == driver
    assert office.core.sessions.permissions.observers == {}


def test_a_robot_that_could_not_be_told_is_told_again(office):
    session = granted(office).session
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    sent = office.say(OPERATOR, over)[1][0]
    assert office.no([sent], 1.0) == []
    assert office.core.tick(2.0) == [sent]
    assert office.core.tick(3.0) == []


FLOOR = (2_000 << 32) + 2**32 - 1


def test_a_grant_that_was_too_low_is_given_again_above_what_the_robot_knows(office):
    (grant,) = office.say(OPERATOR, ASK)[1]
    refused = m.Reply(1, m.BAD_SESSION, "too low", m.SessionFloor(FLOOR))
    over, again = office.core.refused_grant(grant, refused, 1.0)
    assert over == Send(OPERATOR, m.PermissionRevocation(ROBOT, OPERATOR, grant.session))
    assert (again.to, again.body.holder, again.session) == (ROBOT, OPERATOR, again.body.session)
    assert again.session > FLOOR
    assert office.say(OPERATOR, ASK)[0].content.session == again.session


@pytest.mark.parametrize(
    ("code", "content"),
    [(m.BAD_SESSION, None), (m.BUSY, m.SessionFloor(FLOOR)), (m.BUSY, None)],
)
def test_a_grant_that_is_refused_otherwise_is_over(office, code, content):
    (grant,) = office.say(OPERATOR, ASK)[1]
    sends = office.core.refused_grant(grant, m.Reply(1, code, "no", content), 1.0)
    over = m.PermissionRevocation(ROBOT, OPERATOR, grant.session)
    assert sends == [Send(ROBOT, over), Send(OPERATOR, over)]
    assert office.core.sessions.permissions.grants == {}


def test_all_sessions_end_with_the_core(office):
    over = m.PermissionRevocation(ROBOT, OPERATOR, granted(office).session)
    assert office.core.close() == [Send(ROBOT, over), Send(OPERATOR, over)]


def test_a_declined_order_leaves_the_operator_what_it_held_by_itself(office):
    session = granted(office).session
    order = office.fire(12)[0]
    assert office.no([order], 1.0) == []
    assert office.core.sessions.permissions.grants[ROBOT].session == session


def test_the_right_to_drive_ends_with_the_order(office):
    office.fire(12)
    session = granted(office).session
    sends = office.progress(OPERATOR, "failed", 5.0)[1]
    assert Send(ROBOT, m.PermissionRevocation(ROBOT, OPERATOR, session)) in sends
    assert office.core.sessions.permissions.grants == {}


def test_a_robot_that_somebody_holds_is_sent_nowhere_by_another(office):
    office.register(OTHER_OPERATOR, "TeleOp")
    granted(office)
    assert [send.to for send in office.fire(12)] == [GUARD]


def test_an_order_belongs_to_no_session(office):
    assert [send.session for send in office.fire(80)] == [0]


# --- answers to a robot that asks for its holder -------------------------------------------


@pytest.mark.parametrize(
    ("about", "holder"),
    [
        (m.GetGrant(), OPERATOR),
        (m.GetGrant(OPERATOR), OPERATOR),
        (m.GetGrant(DETECTOR), None),
        (m.GetGrant(OTHER_OPERATOR), None),
        (m.GetGrant(DETECTOR, "sensors"), DETECTOR),
        (m.GetGrant(OPERATOR, "sensors"), OPERATOR),  # who drives is its holder all the same
        (m.GetGrant(OTHER_OPERATOR, "sensors"), None),
    ],
)
def test_a_robot_that_asks_is_told_of_the_holder_and_of_nobody_else(office, about, holder):
    office.register(OTHER_OPERATOR, "TeleOp")
    granted(office)
    granted(office, DETECTOR, "sensors")
    reply, sends = office.say(ROBOT, about)
    told = reply.content.device if isinstance(reply.content, m.Permission) else None
    assert (told, reply.code) == (holder, m.OK if holder else m.NOT_PERMITTED)
    assert sends == []


@pytest.mark.parametrize("about", [m.GetGrant(), m.GetGrant(OPERATOR), m.GetGrant(None, "sensors")])
def test_a_robot_that_nobody_holds_is_told_so(office, about):
    assert office.say(ROBOT, about)[0].code == m.NOT_PERMITTED


# --- sensors -------------------------------------------------------------------------------


def test_who_reads_sensors_holds_nothing_else_and_needs_no_order(office):
    driver = granted(office).session
    office.core.sessions.permissions.draw = lambda: 8
    reader = granted(office, DETECTOR, "sensors").session
    assert reader != driver
    assert reader >> 32 == driver >> 32  # only the right to drive uses up what makes them grow
    assert office.core.sessions.permissions.grants[ROBOT].holder == OPERATOR


def test_sensors_are_granted_one_by_one():
    office = guarded(AccessRule(sensors=frozenset({"heat_flux", "gas"})))
    asked = m.PermissionRequest(ROBOT, "sensors", ("gas", "camera"))
    content = office.say(DETECTOR, asked)[0].content
    assert isinstance(content, m.Permission)
    assert content.sensors == ("gas",)


def test_who_may_read_none_of_the_sensors_it_asks_for_is_refused():
    office = guarded(AccessRule(sensors=frozenset({"gas"})))
    asked = m.PermissionRequest(ROBOT, "sensors", ("camera",))
    assert office.say(DETECTOR, asked)[0].code == m.NOT_PERMITTED


def test_who_may_drive_but_not_read_drives_without_sensors():
    office = guarded(AccessRule(sensors=frozenset()))
    assert granted(office, level="both").sensors == ()


# --- rules of access -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("levels", "granted_levels"),
    [
        (("teleoperation",), {"teleoperation"}),
        (("missions",), {"missions"}),
        (("teleoperation", "missions"), {"teleoperation", "missions", "both"}),
        (("both",), {"teleoperation", "missions", "both"}),
        (("sensors",), {"sensors"}),
        ((), set()),
    ],
)
def test_a_rule_allows_its_levels_and_what_they_are_made_of(levels, granted_levels):
    got = set()
    for level in ("teleoperation", "missions", "both", "sensors"):
        office = guarded(AccessRule(levels=frozenset(levels)))
        if office.say(OPERATOR, m.PermissionRequest(ROBOT, level))[0].code == m.OK:
            got.add(level)
    assert got == granted_levels


def test_a_rule_is_about_its_holders_and_robots_only():
    rule = AccessRule(holders=frozenset({"teleop"}), robots=frozenset({"robot"}))
    assert guarded(rule).say(OPERATOR, ASK)[0].code == m.OK
    for other in (
        AccessRule(holders=frozenset({"somebody"})),
        AccessRule(robots=frozenset({"another"})),
    ):
        reply = guarded(other).say(OPERATOR, ASK)[0]
        assert reply.code == m.NOT_PERMITTED
        assert not unnamed(reply.text, "teleop", "teleoperation of robot")


def test_without_a_rule_nothing_is_allowed():
    assert guarded().say(OPERATOR, ASK)[0].code == m.NOT_PERMITTED


def test_a_rule_holds_from_its_beginning_and_before_its_end():
    codes = {}
    for now in (99.9, 100.0, 199.9, 200.0):
        office = guarded(AccessRule(since=100.0, until=200.0))
        codes[now] = office.say(OPERATOR, ASK, now)[0].code
    assert codes == {
        99.9: m.NOT_PERMITTED,
        100.0: m.OK,
        199.9: m.OK,
        200.0: m.NOT_PERMITTED,
    }


def test_a_permission_is_revoked_while_in_use_when_the_time_of_its_rule_ends():
    office = guarded(AccessRule(until=200.0))
    session = granted(office, now=190.0).session
    assert office.core.next_deadline() <= 200.0
    assert office.tick(199.9) == []
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert office.tick(200.0) == [Send(ROBOT, over), Send(OPERATOR, over)]
    assert office.core.counters["permission revoked"] == 1


def test_a_permission_that_another_rule_allows_too_is_not_revoked():
    office = guarded(AccessRule(until=200.0), AccessRule(since=150.0, until=400.0))
    granted(office, now=190.0)
    assert office.tick(200.0) == []
    assert len(office.tick(400.0)) == 2


def test_a_permission_ends_when_one_of_its_sensors_may_no_longer_be_read():
    office = guarded(AccessRule(sensors=frozenset()), AccessRule(until=200.0))
    assert granted(office, now=190.0).sensors == ("heat_flux",)
    assert len(office.tick(200.0)) == 2
    assert granted(office, now=201.0).sensors == ()


def test_an_order_outlives_a_revoked_permission_and_its_operator_says_how_it_ends():
    office = guarded(AccessRule(until=20.0))
    office.ok(office.fire(12, now=10.0), 10.0)
    granted(office, now=11.0)
    office.tick(20.0)
    assert office.event().state is State.ASSIGNED
    sends = office.progress(OPERATOR, "failed", 21.0)[1]
    assert [send.to for send in sends] == [GUARD]


def test_the_end_of_rules_is_no_deadline_once_it_is_past():
    office = guarded(AccessRule(until=200.0))
    assert math.isfinite(office.core.next_deadline())
    office.core.tick(200.0)
    assert office.core.next_deadline() == math.inf
