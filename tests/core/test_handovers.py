"""Handover of a robot: requested, granted, declined or forced."""

import pytest
from helpers.dva.dispatch_office import (
    ADDRESS,
    DVA,
    GUARD,
    OPERATOR,
    OTHER_OPERATOR,
    ROBOT,
    TEAM,
    Office,
)
from helpers.wording import unnamed

from dva_sim.core.events import State
from dva_sim.core.handovers import ANSWER_WITHIN, DECLINED_FOR, FETCH_WITHIN, STOP_WITHIN
from dva_sim.core.permissions import Access, AccessRule
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m

THIRD = "02:00:00:03:00:03"
HANDOVER = Send(OPERATOR, m.HandoverRequest(ROBOT, OTHER_OPERATOR, "remote control"))


@pytest.fixture
def office() -> Office:
    """Somebody with a remote control is there, too, and supervises."""
    office = Office(supervisors=frozenset({OTHER_OPERATOR}))
    office.core.sessions.permissions.own = DVA
    office.register(OTHER_OPERATOR, "Remote Control")
    return office


def ask(
    office: Office, who: str = OTHER_OPERATOR, takeover: str | None = "ask", now: float = 0.0
) -> tuple[m.Reply, list[Send]]:
    return office.say(who, m.PermissionRequest(ROBOT, "teleoperation", (), takeover), now)


def hold(office: Office, now: float = 0.0) -> m.PermissionRevocation:
    """The operator holds the robot; what will be said when that is over."""
    content = ask(office, OPERATOR, None, now)[0].content
    assert isinstance(content, m.Permission)
    return m.PermissionRevocation(ROBOT, OPERATOR, content.session)


# --- who holds it ------------------------------------------------------------------------------


def test_who_is_told_no_is_told_who_holds_it_and_since_when(office):
    hold(office, 2.0)
    reply, _ = ask(office, takeover="no", now=14.5)
    assert (reply.code, unnamed(reply.text, "teleop", "12 s")) == (m.BUSY, [])
    assert reply.content == m.Holder(OPERATOR, "teleop", 12.5)


def test_who_has_not_shown_that_it_knows_1_4_is_told_in_words_alone(office):
    hold(office)
    reply, sends = ask(office, takeover=None, now=3.0)
    assert (reply.code, reply.content, sends) == (m.BUSY, None, [])
    assert unnamed(reply.text, "teleop", " 3 s") == []


def test_who_has_an_order_with_it_holds_it_before_it_has_the_permission(office):
    office.fire(12, now=1.0)
    reply, _ = ask(office, takeover="no", now=4.0)
    assert reply.content == m.Holder(OPERATOR, "teleop", 3.0)


# --- asked for ---------------------------------------------------------------------------------


@pytest.mark.invariant("S2")
def test_a_robot_is_handed_over_through_standstill_and_a_confirmed_end(office):
    over = hold(office)
    reply, sends = ask(office, now=1.0)
    assert reply.code == m.BUSY
    assert not unnamed(reply.text, "teleop for 1 s", "asked")
    assert sends == [HANDOVER]
    assert ask(office, now=2.0)[1] == []  # once is enough
    reported = office.ok(sends, 3.0)
    assert reported == [Send(ROBOT, over), Send(OPERATOR, over)]
    office.status(ROBOT, 10, now=3.5)  # it stands, but has not said that it has heard
    assert ask(office, now=4.0)[0].text.startswith("it is being stopped")
    office.ok(reported, 4.5)
    office.status(ROBOT, 10, now=5.0, speed=0.3)
    assert ask(office, now=5.5)[0].code == m.BUSY
    office.status(ROBOT, 10, now=6.0)
    reply, sends = ask(office, now=6.5)
    assert isinstance(reply.content, m.Permission)
    assert reply.content.session > over.session
    assert [type(send.body) for send in sends] == [m.PermissionGrant]
    assert office.core.counters["robot handed over"] == 1
    assert ask(office, OPERATOR, "no", 8.5)[0].content == m.Holder(
        OTHER_OPERATOR, "remote control", 2.0
    )


def test_meanwhile_it_is_nobody_elses(office):
    hold(office)
    office.ok(ask(office)[1], 1.0)
    reply = ask(office, OPERATOR, "no", 2.0)[0]
    assert reply.content == m.Holder(OTHER_OPERATOR, "remote control", 0.0)
    assert [send.to for send in office.fire(12)] == [GUARD]


@pytest.mark.parametrize("takeover", ["ask", "no", None])
def test_a_holder_that_declines_keeps_it_and_is_left_alone_for_a_while(office, takeover):
    hold(office)
    office.no(ask(office)[1], 1.0)
    reply, sends = ask(office, now=2.0)
    assert sends == []
    assert not unnamed(reply.text, "teleop for 2 s", "not give")
    assert ask(office, OPERATOR, takeover, 3.0)[0].code == m.OK
    office.tick(1.0 + DECLINED_FOR)
    assert ask(office, now=12.0)[1] == [HANDOVER]


def test_only_one_waits_for_a_robot(office):
    third = "02:00:00:03:00:03"
    office.register(third, "Teleoperation")
    hold(office)
    ask(office)
    reply, sends = ask(office, third, now=1.0)
    assert sends == []
    assert not unnamed(reply.text, "teleop for 1 s", "another")


def test_what_its_holder_was_to_look_at_is_open_to_others(office):
    office.busy(GUARD)
    office.ok(office.fire(12))
    hold(office)
    office.idle(GUARD)
    sends = office.ok(ask(office)[1], 1.0)
    assert Send(OPERATOR, m.OrderProgress(1, "done")) in sends
    assert (office.event().responder, office.event().state) == (GUARD, State.ASSIGNED)


@pytest.mark.parametrize(
    ("is_acknowledged", "waited"),
    [(False, ANSWER_WITHIN), (True, STOP_WITHIN)],
    ids=["asked", "stopping"],
)
def test_a_handover_that_leads_nowhere_ends(office, is_acknowledged, waited):
    hold(office)
    sends = ask(office)[1]
    if is_acknowledged:
        office.ok(sends)
    assert office.core.next_deadline() <= waited
    office.tick(waited)
    assert office.core.handovers.under_way == {}
    assert office.core.sessions.reserved == set()


def test_who_does_not_come_for_it_in_time_gets_nothing(office):
    hold(office)
    office.ok(office.ok(ask(office)[1], 1.0), 1.0)
    office.status(ROBOT, 10, now=2.0)
    office.tick(2.0 + FETCH_WITHIN)
    assert ask(office, OPERATOR, None, 33.0)[0].code == m.OK


def asked_and_given_back(office: Office) -> list[Send]:
    """The holder is asked for the robot, and gives it back with a third operator there."""
    office.register(THIRD, "TeleOp")
    over = hold(office)
    asked = ask(office)[1]
    office.say(OPERATOR, over)
    return asked


def test_a_late_yes_takes_nothing_from_the_next_holder(office):
    asked = asked_and_given_back(office)
    assert ask(office, THIRD, None, 1.0)[0].code == m.OK
    assert office.ok(asked, 2.0) == []
    assert office.core.sessions.permissions.grants[ROBOT].holder == THIRD


def test_a_late_yes_takes_nothing_from_who_was_sent_with_it_meanwhile(office):
    asked = asked_and_given_back(office)
    office.busy(GUARD, OPERATOR)
    office.fire(12, now=1.0)
    assert office.event().operator == THIRD
    assert office.ok(asked, 2.0) == []
    assert office.event().operator == THIRD


# --- forced ------------------------------------------------------------------------------------


@pytest.mark.invariant("S2")
def test_a_supervisor_need_not_ask_but_waits_for_standstill_too(office):
    over = hold(office)
    reply, sends = ask(office, takeover="force")
    assert (reply.code, sends) == (m.BUSY, [Send(ROBOT, over), Send(OPERATOR, over)])
    office.status(ROBOT, 10, now=1.0)
    assert ask(office, takeover="force", now=2.0)[0].code == m.BUSY
    office.ok(sends, 3.0)
    office.status(ROBOT, 10, now=4.0)
    assert isinstance(ask(office, takeover="force", now=5.0)[0].content, m.Permission)


@pytest.mark.invariant("S5")
def test_who_is_no_supervisor_forces_nothing(office):
    assert ask(office)[0].code == m.OK
    reply, sends = ask(office, OPERATOR, "force")
    assert (reply.code, sends) == (m.NOT_PERMITTED, [])
    assert unnamed(reply.text, "teleop", "supervisor") == []
    assert office.core.sessions.permissions.grants[ROBOT].holder == OTHER_OPERATOR


def test_a_supervisor_does_not_wait_for_who_is_being_asked(office):
    hold(office)
    asked = ask(office)[1]
    ask(office, takeover="force", now=1.0)
    assert office.no(asked, 2.0) == []  # the answer comes too late to matter
    assert ask(office, now=3.0)[0].text.startswith("it is being stopped")


def test_who_may_not_have_the_level_takes_nothing_over_supervisor_or_not():
    rules = Access([AccessRule(holders=frozenset({"teleop"}))])
    office = Office(access=rules, supervisors=frozenset({OTHER_OPERATOR}))
    office.register(OTHER_OPERATOR, "Remote Control")
    hold(office)
    for takeover in ("no", "ask", "force"):
        reply, sends = ask(office, takeover=takeover)
        assert (reply.code, sends) == (m.NOT_PERMITTED, [])


# --- types of devices --------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["Remote Control", "Teleoperation", "TeleOp"])
def test_who_drives_by_its_type_may_have_a_robot_and_is_listed(kind):
    office = Office()
    office.register(OTHER_OPERATOR, kind)
    assert ask(office, OTHER_OPERATOR, None)[0].code == m.OK
    content = office.say(OPERATOR, m.GetDeviceList())[0].content
    assert isinstance(content, m.DeviceList)
    device = next(one for one in content.devices if one.id_tag == OTHER_OPERATOR)
    assert (device.device_type, device.address) == (kind, ADDRESS)
    assert device.label.startswith(kind.lower())


@pytest.mark.parametrize(("kind", "sent"), [("Remote Control", False), ("Teleoperation", True)])
def test_orders_go_to_teleoperation_and_never_to_a_remote_control(kind, sent):
    office = Office()
    office.busy(GUARD, OPERATOR)
    office.register(OTHER_OPERATOR, kind)
    assert [send.to for send in office.fire(12)] == [OTHER_OPERATOR] * sent


def test_a_type_of_another_name_drives_nothing():
    office = Office()
    office.register(OTHER_OPERATOR, "Telephone")
    assert ask(office, OTHER_OPERATOR, None)[0].code == m.NOT_PERMITTED
    assert TEAM[OPERATOR] == "TeleOp"
