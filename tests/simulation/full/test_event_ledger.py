"""The second book of the events: what restarts a deadline, and what does not."""

import pytest

from dva_sim.core.assignments import Rules
from dva_sim.core.events import Cause, Event, EventTable, State
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.event_ledger import EventLedger
from dva_sim.simulation.full.observations import Page
from dva_sim.simulation.full.stage import DVA

OPERATOR, ROBOT, OTHER = "02:00:00:03:00:01", "02:00:00:01:00:01", "02:00:00:01:00:02"
PLACE, AFAR = m.Position(38.66, -9.2), m.Position(38.6603, -9.2)
RULES = Rules(order_limit=90.0, depart_within=30.0, still_within=45.0)


class Hearer:
    """A ledger that hears of one event, and of what is said about it."""

    def __init__(self):
        self.places = {}
        self.ledger = EventLedger(RULES, DVA, lambda who: self.places.get(who, PLACE), 5.0, str)
        self.table, self._number = EventTable(), 0
        self._looked = 0
        self.event = self.table.add("fire", PLACE, 0.5, 0.0)

    def assigns(self, now: float, robot: str = ROBOT) -> None:
        """The DVA's table says who has it from now on."""
        self.event.operator, self.event.responder = OPERATOR, robot
        self.event.times["assigned"] = now
        if self.event.state is State.PENDING:
            self.table.move(self.event, Cause.ORDERED, now)

    def orders(self, now: float, robot: str = ROBOT) -> None:
        """An order is sent, and accepted."""
        self.assigns(now, robot)
        order = m.Order(self.event.number, "fire", PLACE, robot)
        self._number += 1
        self.ledger.says(m.Message(OPERATOR, self._number, DVA, "12:00:00", 0, order))
        self.says(now, m.Reply(self._number, m.OK, ""))

    def says(self, now: float, body: m.Body) -> None:
        """The operator says something to the DVA."""
        self._number += 1
        message = m.Message(DVA, self._number, OPERATOR, "12:00:00", 0, body)
        self.ledger.hears(OPERATOR, message, now)

    def is_answered(self, code: int) -> None:
        """The DVA answers what the operator said last."""
        reply = m.Reply(self._number, code, "")
        self.ledger.says(m.Message(OPERATOR, 1, DVA, "12:00:00", 0, reply))

    def broken(self, until: float, works: bool = True) -> list[str]:
        """Everything that is wrong until then, looked at twice a second."""
        first = self._looked + 1
        self._looked = int(2 * until)
        return [
            what
            for tick in range(first, self._looked + 1)
            for _, what in self.ledger.check(tick / 2, Page(self.table, (), works))
        ]


@pytest.fixture
def heard() -> Hearer:
    return Hearer()


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(("robot", "breaks"), [(ROBOT, True), (OTHER, False)])
def test_an_order_with_another_robot_has_its_own_time_to_set_out(heard, robot, breaks):
    assert heard.broken(1.0) == []
    heard.orders(1.0)
    assert heard.broken(20.0) == []
    heard.orders(20.0, robot)
    assert any("set out" in line for line in heard.broken(45.0)) is breaks


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(("is_given_again", "breaks"), [(False, True), (True, False)])
def test_work_that_is_over_and_given_again_at_once_has_its_own_time(heard, is_given_again, breaks):
    assert heard.broken(1.0) == []
    heard.orders(1.0)
    heard.event.times["departed"] = 1.5
    heard.says(1.5, m.OrderProgress(heard.event.number, "departed"))
    assert heard.broken(40.0) == []
    heard.says(40.0, m.OrderProgress(heard.event.number, "failed"))
    if is_given_again:
        heard.assigns(40.0)
        del heard.event.times["departed"]
    assert any("pair of hands" in line for line in heard.broken(95.0)) is breaks


def raises(table: EventTable, event: Event, severity: float) -> None:
    table.merge(event, severity)


def keeps(table: EventTable, event: Event, severity: float) -> None:
    table.merge(event, 0.0)


def forgets(table: EventTable, event: Event, severity: float) -> None:
    raises(table, event, severity)
    event.severity = 0.5


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(
    ("merge", "severity", "breaks"),
    [(raises, 0.9, False), (keeps, 0.9, True), (forgets, 0.9, True), (keeps, 0.4, False)],
)
def test_an_event_is_as_severe_as_the_worst_report_that_the_dva_has_taken(
    heard, merge, severity, breaks
):
    assert heard.broken(1.0) == []
    heard.says(1.0, m.EventReport(None, "fire", PLACE, severity, 0.9, "detected"))
    merge(heard.table, heard.event, severity)
    heard.is_answered(m.OK)
    assert any("severity" in line for line in heard.broken(2.0)) is breaks


@pytest.mark.invariant("S6")
def test_a_severity_that_is_lost_later_is_noticed(heard):
    heard.says(0.0, m.EventReport(None, "fire", PLACE, 0.9, 0.9, "detected"))
    raises(heard.table, heard.event, 0.9)
    heard.is_answered(m.OK)
    assert heard.broken(2.0) == []
    heard.event.severity = 0.5
    assert any("severity" in line for line in heard.broken(3.0))


@pytest.mark.invariant("S6")
def test_of_a_report_that_was_refused_nothing_need_be_noted(heard):
    heard.says(0.0, m.EventReport(None, "fire", PLACE, 0.9, 0.9, "detected"))
    heard.is_answered(m.BUSY)
    assert heard.broken(2.0) == []


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(
    ("is_restarted", "since", "breaks"),
    [
        (True, 0.0, False),
        (True, 40.0, False),  # time for which the DVA was down does not count
        (True, 50.0, True),  # the wait begins again with the restart
        (True, 120.0, True),
        (False, 50.0, False),  # an order came to nothing
    ],
)
def test_a_restart_gives_an_event_no_more_time_to_wait(heard, is_restarted, since, breaks):
    assert heard.broken(10.0) == []
    assert heard.broken(50.0, works=not is_restarted) == []
    heard.event.waiting_since = since
    assert any("more to wait" in line for line in heard.broken(51.0)) is breaks


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(("is_sent", "breaks"), [(True, True), (False, False)])
def test_an_order_that_still_waits_for_its_device_was_not_accepted(heard, is_sent, breaks):
    heard.orders(1.0)
    assert heard.broken(2.0) == []
    heard.says(2.0, m.OrderProgress(heard.event.number, "declined"))
    heard.table.move(heard.event, Cause.GIVEN_BACK, 2.0)
    heard.event.operator = heard.event.responder = None
    assert heard.broken(10.0) == []
    heard.assigns(10.0)
    if is_sent:
        heard.orders(10.0)
    assert any("set out" in line for line in heard.broken(45.0)) is breaks


def confirms(heard: Hearer, now: float, arrives: bool) -> list[str]:
    """The first robot is there, a second has been ordered, and the operator speaks of the first."""
    heard.places[OTHER] = AFAR
    assert heard.broken(1.0) == []
    heard.orders(1.0)
    assert heard.broken(now - 1.0) == []
    heard.orders(now - 1.0, OTHER)
    report = m.EventReport(heard.event.number, "fire", PLACE, 0.5, 1.0, "confirmed")
    heard.says(now, report)
    if arrives:
        heard.event.times |= {"departed": now, "arrived": now}
    heard.table.move(heard.event, Cause.CONFIRMED, now)
    return heard.broken(now + 2.0)


@pytest.mark.invariant("S6")
def test_a_finding_may_be_of_an_earlier_order_with_another_robot():
    assert confirms(Hearer(), 10.0, arrives=False) == []


@pytest.mark.invariant("S7")
def test_nobody_is_booked_as_arrived_who_has_not_been_there():
    (line,) = confirms(Hearer(), 10.0, arrives=True)
    assert line == f"event 1: {OTHER} has arrived, and is not there"


@pytest.mark.invariant("S7")
def test_an_arrival_that_is_forgotten_when_another_is_sent_is_none_of_the_other(heard):
    heard.places[OTHER] = AFAR
    assert heard.broken(1.0) == []
    heard.orders(1.0)
    heard.event.times |= {"departed": 2.0, "arrived": 2.0}
    assert heard.broken(2.0) == []
    heard.orders(3.0, OTHER)
    del heard.event.times["departed"], heard.event.times["arrived"]
    assert heard.broken(4.0) == []


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(("has_set_out", "breaks"), [(True, False), (False, True)])
def test_who_registers_again_on_the_way_has_taken_the_event_up(heard, has_set_out, breaks):
    assert heard.broken(1.0) == []
    heard.orders(1.0)
    heard.says(1.0, m.Registration("operator-1", "TeleOp", "192.168.1.9"))
    heard.assigns(1.5, OTHER)  # the order with it is sent, and its answer is lost
    if has_set_out:
        heard.event.times["departed"] = 1.5
        heard.says(1.5, m.OrderProgress(heard.event.number, "departed"))
    heard.broken(80.0)
    heard.event.operator = heard.event.responder = None
    heard.table.move(heard.event, Cause.GIVEN_BACK, 80.0)
    found = heard.broken(80.0 + RULES.escalate_after - 1.0)
    assert any("is pending after" in line for line in found) is breaks
