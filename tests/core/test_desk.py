"""The DVA's desk: registration, permissions, events, dispatch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from dva_sim.core.dispatch import Assignment, MinEta, Policy, Situation
from dva_sim.core.events import Event, EventBook, State
from dva_sim.core.ground import Start
from dva_sim.core.permissions import Permissions
from dva_sim.core.rules import Rules
from dva_sim.core.send import Send
from dva_sim.core.service import Desk
from dva_sim.core.sessions import Sessions
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import MAX_BYTES, encode

Floats = NDArray[np.float64]
DVA = "02:00:00:00:00:01"
ROBOT, OTHER_ROBOT = "02:00:00:01:00:01", "02:00:00:01:00:02"
GUARD, OPERATOR, OTHER_OPERATOR = "02:00:00:02:00:01", "02:00:00:03:00:01", "02:00:00:03:00:02"
DETECTOR = "02:00:00:04:00:01"
HERE = m.Position(38.6612, -9.2058)


def east(metres: float) -> m.Position:
    return m.Position(HERE.latitude, HERE.longitude + metres / 87_000)


PACES = {"guard": (1.3, 20.0), "robot": (0.35, 4.0)}  # [m/s], [s]
MAX_ATTEMPTS = 4


def crow(starts: Sequence[Start], goals: Sequence[m.Position]) -> tuple[Floats, Floats]:
    ways = [[abs(s.position.longitude - g.longitude) * 87_000 for s in starts] for g in goals]
    distance = np.array(ways).reshape(len(goals), len(starts))
    speed = np.array([PACES[s.kind][0] for s in starts])
    return distance, np.array([PACES[s.kind][1] for s in starts]) + distance / speed


class Office:
    """A desk with a guard at 0 m, a robot at 10 m, an operator and a detector."""

    def __init__(self, policy: Policy | None = None) -> None:
        rng, rules = np.random.default_rng(1), Rules(escalate_after=60.0)
        sessions = Sessions(Permissions(lambda: 7))
        self.desk = Desk(policy or MinEta(), crow, rules, rng, sessions)
        self.number = 0
        team = {GUARD: "Guard", ROBOT: "Robot", OPERATOR: "TeleOp", DETECTOR: "Sensor"}
        for id_tag, kind in team.items():
            self.say(id_tag, m.Registration(kind.lower(), kind, "192.168.1.9"))
        self.stands(GUARD, 0)
        self.status(ROBOT, 10)

    def say(self, source: str, body: m.Body, now: float = 0.0) -> tuple[m.Reply, list[Send]]:
        self.number += 1
        session = None if isinstance(body, m.Heartbeat) else 0
        message = m.Message(DVA, self.number, source, "12:00:00", session, body)
        return self.desk.handle(message, now)

    def status(self, robot: str, metres: float, now: float = 0.0) -> None:
        body = m.RobotStatus("Idle", east(metres), 0.0, 0.0, 0.0, 5)
        self.desk.note(m.Message(DVA, 1, robot, "12:00:00", 0, body), now)

    def stands(self, guard: str, metres: float, now: float = 0.0) -> None:
        body = m.PersonStatus("waiting", east(metres))
        self.desk.note(m.Message(DVA, 1, guard, "12:00:00", 0, body), now)

    def fire(self, metres: float, now: float = 0.0, kind: str = "fire") -> list[Send]:
        body = m.EventReport(None, kind, east(metres), 0.5, 0.9, "detected")
        return self.say(DETECTOR, body, now)[1]

    def event(self, number: int = 1) -> Event:
        event = self.desk.book.get(number)
        assert event is not None
        return event

    def busy(self, *names: str) -> None:
        """Somebody works on an event that is not ours."""
        self.desk.orders.engaged |= dict.fromkeys(names, Event(99, "flood", HERE, 0.5))


@pytest.fixture
def office() -> Office:
    return Office()


def test_who_is_not_registered_is_refused_and_counted(office: Office) -> None:
    reply, sends = office.say("02:00:00:09:00:09", m.GetDeviceList())
    assert (reply.code, sends) == (m.NOT_REGISTERED, [])
    assert office.desk.refused == 1


def test_the_device_list_shows_everybody_but_detectors(office: Office) -> None:
    content = office.say(OPERATOR, m.GetDeviceList())[0].content
    assert isinstance(content, m.DeviceList)
    assert [d.device_type for d in content.devices] == ["Robot", "TeleOp", "Guard"]


def test_a_robot_is_held_by_one_and_the_robot_is_told(office: Office) -> None:
    office.say(OTHER_OPERATOR, m.Registration("second", "TeleOp", "192.168.1.10"))
    reply, sends = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))
    assert isinstance(reply.content, m.Permission)
    told = m.PermissionGrant(OPERATOR, "teleoperation", reply.content.session, "192.168.1.9")
    assert sends == [Send(ROBOT, told)]
    other = office.say(OTHER_OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0]
    assert other.code == m.BUSY


def test_only_an_operator_whose_order_it_is_may_drive_a_robot(office: Office) -> None:
    asked = m.PermissionRequest(ROBOT, "teleoperation")
    assert office.say(DETECTOR, asked)[0].code == m.NOT_PERMITTED
    office.say(OTHER_OPERATOR, m.Registration("second", "TeleOp", "192.168.1.10"))
    office.fire(12)
    assert office.event().operator == OPERATOR
    assert office.say(OTHER_OPERATOR, asked)[0].code == m.BUSY
    assert office.say(OPERATOR, asked)[0].code == m.OK


def test_only_who_was_sent_can_tell_what_was_found(office: Office) -> None:
    office.fire(12)
    found = m.EventReport(1, "fire", east(12), 0.5, 0.9, "confirmed")
    assert office.say(DETECTOR, found, 2.0)[0].code == m.NOT_PERMITTED
    assert office.event().state is State.ASSIGNED
    assert office.say(OPERATOR, found, 3.0)[0].code == m.OK
    assert office.event().state is State.CONFIRMED


def test_a_declined_order_does_not_count_as_an_attempt(office: Office) -> None:
    for _ in range(3 * MAX_ATTEMPTS):
        for order in office.desk.tick(1.0) or office.fire(12):
            office.desk.undelivered(order, 1.0)
    assert office.event().state is State.PENDING
    assert office.event().attempts == 0


def test_sessions_only_grow(office: Office) -> None:
    sessions = []
    for _ in range(3):
        content = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0].content
        assert isinstance(content, m.Permission)
        sessions.append(content.session)
        office.desk.sessions.permissions.release(OPERATOR)
    assert sessions == sorted(set(sessions))


def test_the_earliest_expected_arrival_goes(office: Office) -> None:
    near_robot = office.fire(12)
    assert near_robot == [Send(OPERATOR, m.Order(1, "fire", east(12), ROBOT))]
    far = office.fire(40, kind="gas_leak")
    assert far == [Send(GUARD, m.Order(2, "gas_leak", east(40), None))]


def test_reports_of_one_kind_near_each_other_are_one_event(office: Office) -> None:
    office.fire(12)
    office.fire(15)
    office.fire(12, kind="gas_leak")
    assert {e.number: e.reports for e in office.desk.book.open.values()} == {1: 2, 2: 1}


def test_a_robot_goes_only_with_a_free_operator(office: Office) -> None:
    office.say(OTHER_ROBOT, m.Registration("second", "Robot", "192.168.1.11"))
    office.status(OTHER_ROBOT, 10)
    first, second = office.fire(12), office.fire(12, kind="gas_leak")
    assert [s.to for s in first + second] == [OPERATOR, GUARD]


def test_an_event_runs_its_course_with_its_times_in_order(office: Office) -> None:
    office.fire(12, now=1.0)
    office.say(OPERATOR, m.OrderProgress(1, "departed"), 3.0)
    office.say(OPERATOR, m.OrderProgress(1, "arrived"), 9.0)
    assert office.event().state is State.ON_SCENE
    office.say(OPERATOR, m.EventReport(1, "fire", east(12), 0.5, 0.9, "confirmed"), 12.0)
    assert office.event().state is State.CONFIRMED
    office.say(OPERATOR, m.OrderProgress(1, "done"), 13.0)
    assert office.event().times == {
        "detected": 1.0,
        "assigned": 1.0,
        "departed": 3.0,
        "arrived": 9.0,
        "confirmed": 12.0,
        "closed": 12.0,
    }
    assert office.desk.orders.engaged == {}


def test_a_responder_that_fails_is_replaced(office: Office) -> None:
    office.fire(12)
    sends = office.say(OPERATOR, m.OrderProgress(1, "failed"), 5.0)[1]
    assert sends == [Send(GUARD, m.Order(1, "fire", east(12), None))]


def test_a_responder_that_failed_goes_again_if_nobody_else_can(office: Office) -> None:
    office.busy(GUARD)
    office.fire(12)
    sends = office.say(OPERATOR, m.OrderProgress(1, "failed"), 5.0)[1]
    assert [s.to for s in sends] == [OPERATOR]


def test_an_event_that_nobody_settles_is_escalated_after_its_attempts(office: Office) -> None:
    orders = office.fire(12)
    for _ in range(MAX_ATTEMPTS + 2):
        if orders:
            orders = office.say(orders[0].to, m.OrderProgress(1, "failed"), 1.0)[1]
    assert office.event().attempts == MAX_ATTEMPTS
    assert office.event().state is State.ESCALATED


def test_pending_beyond_its_deadline_means_escalated(office: Office) -> None:
    office.busy(*office.desk.registry.entries)
    office.fire(12, now=0.0)
    office.desk.registry.silent_after = 1e9
    office.desk.tick(59.9)
    assert office.event().state is State.PENDING
    office.desk.tick(60.0)
    assert office.event().state is State.ESCALATED


def test_a_device_is_silent_only_after_its_timeout_has_passed(office: Office) -> None:
    office.fire(12)
    office.desk.tick(10.0)
    assert office.event().operator == OPERATOR
    office.say(GUARD, m.GetDeviceList(), 10.0)
    office.desk.tick(10.1)
    assert office.event().responder == GUARD


def test_an_order_that_is_not_delivered_leaves_the_event_open_to_others(office: Office) -> None:
    orders = office.fire(12)
    office.desk.undelivered(orders[0], 5.0)
    assert office.event().state is State.PENDING
    assert office.event().responder is None


class Greedy(Policy):
    """Sends the same responders everywhere."""

    def advise(self, situation: Situation, rng: np.random.Generator) -> list[Assignment]:
        every = range(len(situation.tasks))
        return [Assignment(t, r) for t in every for r in range(len(situation.responders))]


def test_the_desk_enforces_the_rules_whatever_a_policy_returns() -> None:
    office = Office(Greedy())
    office.fire(12)
    office.fire(12, kind="gas_leak")
    office.fire(12, kind="flood")
    held = [e.responder for e in office.desk.book.in_state(State.ASSIGNED)]
    assert len(held) == len(set(held)) == 2
    counts = office.desk.book.counts
    assert (counts[State.ASSIGNED], counts[State.PENDING]) == (2, 1)


def test_a_step_that_does_not_exist_is_refused() -> None:
    book = EventBook()
    event = book.add("fire", HERE, 0.5, 0.0)
    book.move(event, State.ESCALATED, 1.0)
    with pytest.raises(ValueError, match="cannot go from escalated to confirmed"):
        book.move(event, State.CONFIRMED, 2.0)


def granted(office: Office, who: str = OPERATOR, level: str = "teleoperation") -> m.Permission:
    content = office.say(who, m.PermissionRequest(ROBOT, level, ("heat_flux",)))[0].content
    assert isinstance(content, m.Permission)
    return content


def test_a_permission_introduces_holder_and_robot_to_each_other(office: Office) -> None:
    office.say(ROBOT, m.Registration("robot", "Robot", "192.168.1.20:5600"))
    reply, sends = office.say(OPERATOR, m.PermissionRequest(ROBOT, "both", ("heat_flux",)))
    content, grant = reply.content, sends[0].body
    assert isinstance(content, m.Permission)
    assert isinstance(grant, m.PermissionGrant)
    assert (content.address, content.sensors) == ("192.168.1.20:5600", ("heat_flux",))
    assert (grant.address, grant.sensors) == ("192.168.1.9", ("heat_flux",))
    assert grant.session == content.session


def test_a_session_grows_above_and_is_luck_below(office: Office) -> None:
    first = granted(office).session
    office.desk.sessions.permissions.release(OPERATOR)
    office.desk.sessions.permissions.draw = lambda: 2**32 - 1
    second = granted(office).session
    assert first & (2**32 - 1) == 7
    assert second & (2**32 - 1) == 2**32 - 1
    assert (second >> 32) - (first >> 32) == 1


def test_a_holder_gives_its_permission_back_and_the_robot_is_told(office: Office) -> None:
    session = granted(office).session
    mine = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert office.say(DETECTOR, mine)[0].code == m.BAD_SESSION
    wrong = m.PermissionRevocation(ROBOT, OPERATOR, session + 1)
    assert office.say(OPERATOR, wrong)[0].code == m.BAD_SESSION
    reply, sends = office.say(OPERATOR, mine)
    assert (reply.code, sends) == (m.OK, [Send(ROBOT, mine)])
    assert granted(office).session > session


def test_who_reads_sensors_holds_nothing_else_and_needs_no_order(office: Office) -> None:
    driver = granted(office).session
    office.desk.sessions.permissions.draw = lambda: 8
    reader = granted(office, DETECTOR, "sensors").session
    assert reader != driver
    assert reader >> 32 == driver >> 32  # only the right to drive uses up what makes them grow
    assert office.desk.sessions.permissions.grants[ROBOT].holder == OPERATOR


def test_a_silent_holder_loses_its_session_and_both_ends_are_told(office: Office) -> None:
    session = granted(office).session
    office.status(ROBOT, 10, now=11.0)
    sends = office.desk.tick(11.0)
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert sends == [Send(ROBOT, over), Send(OPERATOR, over)]
    assert office.desk.sessions.permissions.grants == {}


def test_a_renewed_registration_changes_nothing_and_a_new_life_ends_what_was_held(
    office: Office,
) -> None:
    registration = m.Registration("operator", "TeleOp", "192.168.1.9")
    session = granted(office).session
    assert office.say(OPERATOR, registration)[1] == []
    assert office.desk.sessions.permissions.grants[ROBOT].session == session
    office.number = 0  # started anew, it counts its messages from 1 again
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert office.say(OPERATOR, registration)[1] == [Send(ROBOT, over), Send(OPERATOR, over)]


def test_who_declines_an_order_is_not_asked_again_at_once(office: Office) -> None:
    order = office.fire(12)[0]
    assert order.to == OPERATOR
    office.desk.undelivered(order, 1.0)
    assert [send.to for send in office.desk.tick(2.0)] == [GUARD]


def test_a_declined_order_leaves_the_operator_what_it_held_by_itself(office: Office) -> None:
    session = granted(office).session
    order = office.fire(12)[0]
    assert office.desk.undelivered(order, 1.0) == []
    assert office.desk.sessions.permissions.grants[ROBOT].session == session


def test_all_sessions_end_with_the_desk(office: Office) -> None:
    over = m.PermissionRevocation(ROBOT, OPERATOR, granted(office).session)
    assert office.desk.close() == [Send(ROBOT, over), Send(OPERATOR, over)]


def test_a_list_of_any_devices_fits_into_a_message(office: Office) -> None:
    for number in range(200):
        name = ("&" if number % 2 else "\U0001f525") * 64
        office.say(
            f"02:00:00:01:01:{number:02X}", m.Registration(name, "Robot", "255.255.255.255:65534")
        )
    reply = office.say(OPERATOR, m.GetDeviceList())[0]
    data = encode(m.Message(OPERATOR, 1, DVA, "12:00:00", 0, reply))
    assert 5000 < len(data) <= MAX_BYTES


def test_a_robot_is_told_of_a_permission_once_and_again_when_its_holder_moves(
    office: Office,
) -> None:
    ask = m.PermissionRequest(ROBOT, "both")
    first = office.say(OPERATOR, ask)[1]
    assert [type(send.body) for send in first] == [m.PermissionGrant]
    assert office.say(OPERATOR, ask)[1] == []
    office.say(OPERATOR, m.Registration("operator", "TeleOp", "192.168.1.77"))
    moved = office.say(OPERATOR, ask)[1][0].body
    assert isinstance(moved, m.PermissionGrant)
    assert moved.address == "192.168.1.77"
    assert isinstance(first[0].body, m.PermissionGrant)
    assert moved.session == first[0].body.session


def test_a_grant_that_fails_ends_its_own_session_alone(office: Office) -> None:
    driver = granted(office).session
    office.desk.sessions.permissions.draw = lambda: 8
    _, sends = office.say(OPERATOR, m.PermissionRequest(ROBOT, "sensors", ("heat_flux",)))
    office.desk.undelivered(sends[0], 1.0)
    assert office.desk.sessions.permissions.grants[ROBOT].session == driver
    assert office.desk.sessions.permissions.observers == {}


def test_a_robot_that_could_not_be_told_is_told_again(office: Office) -> None:
    session = granted(office).session
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    sent = office.say(OPERATOR, over)[1][0]
    assert office.desk.undelivered(sent, 1.0) == []
    assert office.desk.tick(2.0) == [sent]
    assert office.desk.tick(3.0) == []


def test_a_copy_of_an_old_registration_ends_nothing(office: Office) -> None:
    registration = m.Registration("operator", "TeleOp", "192.168.1.9")
    granted(office)
    first = m.Message(DVA, office.number + 1, OPERATOR, "12:00:01", 0, registration)
    later = m.Message(DVA, office.number + 9, OPERATOR, "12:00:11", 0, registration)
    for message in (first, later, first, later):
        assert office.desk.handle(message, 1.0)[1] == []
    assert office.desk.sessions.permissions.grants[ROBOT].holder == OPERATOR


def test_a_device_stays_what_it_is(office: Office) -> None:
    changed = m.Registration("detector", "TeleOp", "192.168.1.9")
    assert office.say(DETECTOR, changed)[0].code == m.NOT_PERMITTED


def test_a_robot_that_somebody_holds_is_sent_nowhere_by_another(office: Office) -> None:
    office.say(OTHER_OPERATOR, m.Registration("second", "TeleOp", "192.168.1.10"))
    granted(office)
    assert [send.to for send in office.fire(12)] == [GUARD]


def test_news_of_an_order_that_is_another_responders_by_now_takes_nothing_from_it(
    office: Office,
) -> None:
    """The first one fell silent and was replaced; its request fails only after three attempts."""
    late = office.fire(12)[0]
    assert late.to == OPERATOR
    office.stands(GUARD, 0, now=10.5)
    office.status(ROBOT, 10, now=10.5)
    orders = [send for send in office.desk.tick(11.0) if isinstance(send.body, m.Order)]
    assert [order.to for order in orders] == [GUARD]
    office.desk.undelivered(late, 27.0)
    assert office.event().state is State.ASSIGNED
    assert office.desk.orders.engaged[GUARD] is office.event()
    done = m.OrderProgress(1, "arrived")
    assert office.say(GUARD, done, 30.0)[0].code == m.OK
