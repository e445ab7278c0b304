"""Independent ledger of the events, from messages on the network, to check the DVA's table.

It notes which devices were sent where, which accepted, since when an event waits or is in the same
hands, and the findings; the fields of the DVA's events are not used for that. It also notes which
devices were heard, since no permission may outlive a silent holder, and which sessions are over,
since each robot has to be told.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from dva_sim.core.assignments import Rules
from dva_sim.core.events import ACT_STEPS, SAME_SPOT, STEPS, Event, EventTable, State, apart
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.observations import Page, Right

STEP_SLACK = 0.5  # tolerance of the time of a step of an event [s]
PENDING_SLACK = 2.0  # the core looks at deadlines once a second, the audit twice [s]
SILENT_AFTER = 10.0  # a device silent for this long holds nothing any longer [s]
LOST_BY_RESTART = 1.0  # a killed DVA continues from the time of its last write [s]
INFORMED_WITHIN = (
    90.0  # a robot that is heard is told of the end of a session, whatever waits before [s]
)
MISSED_WITHIN = 6.0  # DVAs that hear nothing of each other for so long are apart [s]
RETURNED_WITHIN = 12.0  # after contact: what its deputy sends first, then 4 s for responders [s]
SIMULTANEOUS_S = 20.0  # deaths of DVAs within this time are simultaneous: copies take a while [s]
HEARD_LATE = 25.0  # longest delay of a reported position over a bad link [s]
STIRRED = 0.25  # least distance that counts as a move: half of the DVA's own limit [m]
MAX_MOVE_M = 25.0  # maximum distance by which an event is moved to where a person sees it [m]
FELT_LATELY = 10.0  # time for which a robot's sensor value may confirm an event [s]
UNREPLICATED: Final = "unreplicated"  # text of the reply to a report that the deputy may not have
MAX_KEPT = 1000  # maximum unanswered reports, unanswered orders, and events that are kept
UNSETTLED: Final = State.PENDING, State.ASSIGNED, State.ON_SCENE
IN_HAND: Final = State.ASSIGNED, State.ON_SCENE
FOUND: Final = frozenset({"confirmed", "contained", "refuted"})
_ORDERED: Final = (
    *(b"<Order>", b"<TaskAward>", b"<OrderProgress>"),
    *(b"<PermissionRevocation>", b"<Permission>"),
)
"""Messages of the DVA that are read, besides replies that are waited for."""
OF_NO_EVENT: Final = m.Heartbeat, m.RobotStatus  # most of the messages that reach the DVA
Broken = tuple[str, str]


class Debt(NamedTuple):
    """Next step that a device owes after accepting an order: to set out, or to move.

    Attributes:
        who: Device that has the order; None: no step is owed.
        step: True if it has set out, and so has to move.
        since: Start of the debt [s].
        place: Position of the device at that time.
    """

    who: str | None
    step: bool
    since: float
    place: m.Position | None = None


class Seen(NamedTuple):
    """State of an event when it was last checked; times in [s].

    Attributes:
        found: Findings and actions reported at the event.
        hands: Devices in charge, by task; empty: nobody.
        since: Start of that.
        waits: Start of the wait for a device that accepts it.
        began: The same by the DVA's table.
        times: Time of each step by the DVA's table.
        debt: Next step owed by the device in charge.
        is_over: True if it is closed and final.
    """

    found: frozenset[str]
    hands: tuple[str | None, ...]
    since: float
    waits: float
    began: float
    times: Mapping[str, float] = MappingProxyType({})
    debt: Debt = Debt(None, False, 0.0)
    is_over: bool = False


@dataclass
class Word:
    """Statement about one event on the network.

    Attributes:
        ordered: Devices sent there, with the device that travels: a robot, or themselves.
        taken: Devices that have accepted the order.
        ended: Devices that have finished, by their own report or the DVA's.
        loose: Devices no longer in charge, by their own report or the DVA's, or after a restart.
        busy: True if somebody accepted it since the last check.
        sent_again: True if such a device, or one with another robot, was sent there since then.
        freed: True if somebody reported the end of the work since then: the DVA may have sent the
            same device again at once, with the order still in its queue.
        found: Findings and actions of those at the place.
        went: Pairs of all that were ever ordered there, with the device that travels.
        reached: Devices that were near the place while they had the event.
    """

    ordered: dict[str, str] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)
    ended: set[str] = field(default_factory=set)
    loose: set[str] = field(default_factory=set)
    busy: bool = False
    sent_again: bool = False
    freed: bool = False
    found: set[str] = field(default_factory=set)
    went: set[tuple[str, str]] = field(default_factory=set)
    reached: set[str] = field(default_factory=set)


class EventLedger:
    """Ledger of events from messages on the network, compared with the DVA's table.

    Args:
        rules: Limits on the waiting time of an event, and on the time of one responder.
        dva: Id of the DVA.
        place_of: True position of a device.
        at_event: Distance within which a device may have seen the event [m].
        name: Function that returns the name of a device by its id.
        books: Ledgers of all DVAs: an event may be in the table of another one.

    Attributes:
        knows_places: True if true positions are known; otherwise devices are believed.
    """

    def __init__(
        self,
        rules: Rules,
        dva: str,
        place_of: Callable[[str], m.Position | None],
        at_event: float,
        name: Callable[[str], str],
        books: Collection[EventLedger] = (),
    ) -> None:
        self._books = books
        self._events = EventTable()
        self._rules = rules
        self._dva = dva
        self._name = name
        self._place_of = place_of
        self._at_event = at_event
        self.knows_places = True
        self._is_new = True
        self._heard: dict[str, float] = {}
        self._held_since: dict[Right, float] = {}
        self._informed: dict[int, None] = {}
        self._uninformed: dict[Right, float] = {}
        self._asked: dict[tuple[str, int], m.EventReport] = {}
        self._taken: list[m.EventReport] = []
        self._unjudged: list[m.EventReport] = []
        self._unreplicated: list[m.EventReport] = []
        self._orders: dict[tuple[str, int], int] = {}
        self._called_false: dict[tuple[str, int], int] = {}
        self._words: dict[int, Word] = {}
        self._felt: dict[str, float] = {}
        self._seen: dict[int, Seen] = {}
        self._open: dict[int, tuple[str, m.Position]] = {}
        self._promised: dict[int, float] = {}  # with the highest severity that was reported
        self._registered: dict[str, float] = {}
        self._numbers: dict[int, None] = {}  # of events, where there are several DVAs
        self._lost: dict[int, tuple[str, m.Position, Word]] = {}
        self._now = 0.0
        self._was_down = False
        self._back_at = -math.inf
        self._down_at = -math.inf
        self._alone_at = -math.inf
        self._not_kept = 0.0

    # --- messages ------------------------------------------------------------------------

    def hears(self, source: str, message: m.Message | None, now: float) -> None:
        """Note a message that has reached the DVA; `source` is its true sender."""
        if message is None or message.source != source:
            return
        self.is_heard(source, now)
        if isinstance(message.body, OF_NO_EVENT):
            return
        match message.body:
            case m.Reply(answers=answers, code=code):
                ordered = self._orders.pop((source, answers), None)
                if ordered is not None and code == m.OK:
                    self._takes_up(ordered, source)
            case m.SensorValue():
                self._felt[source] = now
            case m.EventReport(event_id=None, finding="detected") as report:
                self._asked[source, message.message_id] = report
                _keep_newest(self._asked)
            case m.FalseAlarm(event_id=number):
                self._called_false[source, message.message_id] = number
                _keep_newest(self._called_false)
            case m.EventReport(event_id=int(number), finding=finding):
                self._finds(self._word(number), source, number, finding)
            case m.OrderProgress(event_id=number, state=state):
                if state != "declined":
                    self._takes_up(number, source)
                if state not in ("departed", "arrived"):
                    self._ends(self._word(number), source)
                    self._word(number).ended.add(source)
            case m.Replicate(event=event):  # its DVA may die before its book is seen
                self._numbers[event.event_id] = None
            case m.Registration():
                self._registered[source] = now
                for word in self._words.values():
                    self._ends(word, source)

    @staticmethod
    def _ends(word: Word, device: str) -> None:
        word.loose.add(device)
        word.freed = word.freed or device in word.ordered

    def is_heard(self, source: str, now: float) -> None:
        """Note that the DVA has received any message of a device."""
        self._heard[source] = now

    def kept_nothing_for(self, seconds: float) -> None:
        """Note the time before its death in which a killed DVA could write nothing [s]."""
        self._not_kept = seconds

    def waits_for(self, data: bytes) -> bool:
        """Return True for an order of the DVA, or an answer that is expected."""
        has_requests = self._asked or self._called_false
        return any(what in data for what in _ORDERED) or (bool(has_requests) and b"<reply>" in data)

    def says(self, message: m.Message | None) -> None:
        """Note that the DVA sends an order, or an answer."""
        if message is None:
            return
        match message.body:
            case m.Order(event_id=number, device=device):
                self._sends(message, number, device or message.destination)
            case m.TaskAward(event_id=number):
                self._sends(message, number, message.destination)
            case m.OrderProgress(event_id=number):
                self._word(number).loose.add(message.destination)
                self._word(number).ended.add(message.destination)
            case m.PermissionRevocation(device=robot, session=session):
                if message.destination == robot:
                    self._informed[session] = None
                    _keep_newest(self._informed)
            case m.Reply() as reply:
                self._answers(message.destination, reply)
                if isinstance(reply.content, m.Permission):
                    self._tells_holder(message.destination, reply.content)

    def _tells_holder(self, robot: str, permission: m.Permission) -> None:
        """Note that a robot informed of its new holder also knows that the old session is over."""
        for right in [right for right in self._uninformed if right.robot == robot]:
            if right.session != permission.session and permission.level != "sensors":
                del self._uninformed[right]

    def _word(self, number: int) -> Word:
        word = self._words.get(number)
        if word is None:
            word = self._words[number] = Word()
            _keep_newest(self._words)
        return word

    def _sends(self, message: m.Message, number: int, goes: str) -> None:
        word = self._word(number)
        to = message.destination
        if goes == to:  # a person has one order, the newest
            for other in self._words.values():
                other.ended.add(to)
        is_another = to in word.loose or word.ordered.get(to, goes) != goes
        word.ordered[to] = goes
        word.sent_again = word.sent_again or is_another
        word.went.add((to, goes))
        word.taken.discard(to)
        word.ended.discard(to)
        word.loose.discard(to)
        self._orders[to, message.message_id] = number
        _keep_newest(self._orders)

    def _takes_up(self, number: int, device: str) -> None:
        word = self._word(number)
        if device in word.ordered:
            word.busy = True
            word.taken.add(device)

    def _finds(self, word: Word, source: str, number: int, finding: str) -> None:
        """Count a finding of a device that was sent; a confirmation needs a device at the place.

        An operator who has been sent again with another robot may still report for the first.
        """
        event = self._events.get(number)
        went = [goes for reporter, goes in word.went if reporter == source]
        if not went or event is None:
            return
        self._takes_up(number, source)
        if finding != "confirmed" or any(self._is_near(goes, event) for goes in went):
            word.found.add(finding)

    def _is_near(self, device: str, event: Event) -> bool:
        if not self.knows_places or any(device == book._dva for book in self._books):
            return True  # another DVA's devices are judged by its own ledger
        place = self._place_of(device)
        return place is not None and apart(place, event.position) <= self._at_event

    def _answers(self, reporter: str, reply: m.Reply) -> None:
        """Note that the DVA accepted a report, or a person's statement of a false alarm."""
        none = self._called_false.pop((reporter, reply.answers), None)
        if none is not None and reply.code == m.OK:
            self._word(none).found.add("refuted")
        report = self._asked.pop((reporter, reply.answers), None)
        if report is not None and reply.code == m.OK:
            self._taken.append(report)
            self._unreplicated += [report] if reply.text == UNREPLICATED else []
            del self._unreplicated[:-MAX_KEPT]

    # --- the DVA's table -----------------------------------------------------------------

    def check(self, now: float, page: Page) -> Iterator[Broken]:
        """Yield the mistakes of the event table now."""
        if now < self._now:
            yield "S7", f"time runs back, from {self._now:g} to {now:g} s"
        passed = now - self._now
        last = self._now
        self._now = now
        yield from self._unheard(page.rights, now, page.works)
        if not page.works:  # it may come back without what it had not saved
            self._let_no_time_pass(passed)
            self._down_at = self._down_at if self._was_down else now
            self._was_down = True
            if len(self._books) > 1:  # S13 judges those of its last reports that were copied
                self._taken.clear()
                self._unjudged.clear()
            return
        if self._was_down:
            self._was_down = False
            self._let_no_time_pass(LOST_BY_RESTART + self._not_kept)
            self._not_kept = 0.0
            self._back_at = now if len(self._books) > 1 else -math.inf
            last = -math.inf
            self._seen = {n: e._replace(debt=Debt(None, False, now)) for n, e in self._seen.items()}
            self._forget_unpromised(page.events)
        events = self._events = page.events
        if self._is_new:
            self._is_new = False
            self._adopt(now)
            last = -math.inf
        judged = self._taken if len(self._books) < 2 else self._unjudged
        self._unjudged = self._taken  # of several DVAs: the other books are older than the report
        self._taken = []
        for report in judged:
            yield from self._listed(report)
        if sum(events.counts.values()) != events.total:
            yield "S6", f"{events.total} events, but {sum(events.counts.values())} in some state"
        if min(events.counts.values()) < 0:
            yield "S6", "a count of events is below zero"
        states = [event.state for event in events.open.values()]
        for state in UNSETTLED:
            count = states.count(state)
            if count != events.counts[state]:
                yield "S6", f"{count} events are {state}, but {events.counts[state]} counted"
        if len(events.open) + len(events.closed) == events.total:  # none is forgotten yet
            closed = Counter(event.state for event in events.closed.values())
            for state in events.counts.keys() - UNSETTLED:
                count = closed[state] + states.count(state)
                if count != events.counts[state]:
                    yield "S6", f"{count} events are {state}, but {events.counts[state]} counted"
        for number in events.open.keys() & events.closed.keys():
            yield "S6", f"event {number} is open and closed"
        gone = self._open.keys() - events.open.keys() - events.closed.keys()
        gone = {n for n in gone if not self._may_be_gone(n, *self._open[n])}
        returns = now - max(self._back_at, self._alone_at) < RETURNED_WITHIN
        if returns and any(not self._meets(book) for book in self._books):
            self._alone_at = now
        later = {number: self._open[number] for number in gone if returns}
        for number in gone - later.keys():
            yield "S6", f"event {number} was open, but the DVA does not list it"
        self._promised = {n: at for n, at in self._promised.items() if n in events.open}
        for number in self._lost.keys() & events.open.keys():
            self._find_again(events.open[number])
        before_by_number = self._open
        self._open = later | {n: (e.kind, e.position) for n, e in events.open.items()}
        for number in before_by_number.keys() & self._open.keys():
            kind, place = self._open[number]
            was, before = before_by_number[number]
            if kind != was or (place != before and apart(place, before) > MAX_MOVE_M):
                yield "S6", f"event {number} was a {was} elsewhere before"
        every = (*events.open.values(), *events.closed.values())
        past = self._seen
        self._seen = {}
        for event in every:
            old = past.get(event.number)
            if old is None and self._was_known(event.number) and last > -math.inf:
                old = self._adopted(event, now)
            if old is not None and old.is_over and not event.open and old.times == event.times:
                self._seen[event.number] = old
            else:
                yield from self._of_event(event, old, now, last)

    def _forget_unpromised(self, events: EventTable) -> None:
        """Drop events lost by a restart that were never confirmed to anybody.

        Another event may have the number of such a one.
        """
        for number in [n for n in self._open if n not in self._promised]:
            event = events.open.get(number)
            kind, place = self._open[number]
            if event is None or event.kind != kind or apart(event.position, place) > MAX_MOVE_M:
                del self._open[number]
                self._lost[number] = kind, place, self._words.pop(number, Word())
                self._seen.pop(number, None)
                _keep_newest(self._lost)

    def _find_again(self, event: Event) -> None:
        """Take over the orders of a lost event for a new one of its number, kind and place."""
        kind, place, word = self._lost.pop(event.number)
        if event.kind == kind and apart(event.position, place) <= MAX_MOVE_M:
            new = self._word(event.number)
            new.ordered = word.ordered | new.ordered
            new.went |= word.went

    def _listed(self, report: m.EventReport) -> Iterator[Broken]:
        """Yield the differences between an accepted report and the DVA's table."""
        fitting = [*self._fitting(report)]
        if not fitting:
            yield "S6", f"a {report.kind} was reported, but the DVA does not list it"
        elif max(event.severity for event in fitting) < report.severity:
            what = f"severity {report.severity:g} was reported of event {fitting[0].number}"
            yield "S6", f"{what}, which is listed with {fitting[0].severity:g}"
        severity = report.severity if len(fitting) == 1 else 0.0
        for event in fitting:
            self._promised[event.number] = max(severity, self._promised.get(event.number, 0.0))

    def _fitting(self, report: m.EventReport) -> Iterator[Event]:
        """Yield the events, open or closed, that fit a report."""
        near = max(self._rules.merge_distance, SAME_SPOT)
        kind = report.kind
        tables = [self._events, *(book._events for book in self._books if book is not self)]
        events = (e for t in tables for e in (*t.open.values(), *t.closed.values()))
        same = (e for e in events if e.kind == kind)
        return (e for e in same if apart(e.position, report.position) < near)

    def _adopt(self, now: float) -> None:
        """Accept the first table as it is: its events are from before a restart of the DVA.

        Their responders count as ordered there, although no order was heard here.
        """
        for event in (*self._events.open.values(), *self._events.closed.values()):
            self._seen[event.number] = self._adopted(event, now)

    def _adopted(self, event: Event, now: float) -> Seen:
        word = self._word(event.number)
        sent = {event.operator: event.responder, event.responder: event.responder}
        sent[event.actor] = event.actor
        self._promised[event.number] = 0.0
        word.ordered.update((device, goes or device) for device, goes in sent.items() if device)
        word.went.update(word.ordered.items())
        for book in self._books:  # orders that were accepted at the DVA before
            before = book._word(event.number)  # the deputy's copy may be older than its end
            word.taken |= (before.taken | before.ended) & word.ordered.keys()
        conclusions = FOUND.intersection((*event.times, event.state.value))
        return Seen(conclusions, _in_hand(event), now, now, now, times=dict(event.times))

    def _is_anothers(self, device: str) -> bool:
        """Return True if a device has registered with another DVA since it did with this one."""
        registered = self._registered.get(device, -math.inf)
        registrations = (book._registered.get(device, -math.inf) for book in self._books)
        return any(when > registered for when in registrations)

    def _may_be_gone(self, number: int, kind: str, place: m.Position) -> bool:
        """Return True if another DVA may have the event, or if its loss was not excluded.

        Deputies keep copies of open events only, so one that was closed just before its DVA died
        may be gone.
        """
        if len(self._books) > 1 and self._word(number).found:
            return True
        near = max(self._rules.merge_distance, SAME_SPOT)
        other_books = [book for book in self._books if book is not self]
        if not all(book._worked_since(self._down_at - SIMULTANEOUS_S) for book in other_books):
            return True  # the death of a DVA together with its deputy may lose events
        tables = [book._events for book in other_books]
        all_events: list[Event | m.EventReport] = [*self._unreplicated]
        all_events += [e for t in tables for e in (*t.open.values(), *t.closed.values())]
        return any(e.kind == kind and apart(e.position, place) < near for e in all_events)

    def _meets(self, book: EventLedger) -> bool:
        """Return True if this DVA hears another, and is heard, since this one is back."""
        heard = self._heard.get(book._dva, -math.inf), book._heard.get(self._dva, -math.inf)
        is_lately = min(heard) >= max(self._back_at, self._now - MISSED_WITHIN)
        return book is self or book._was_down or is_lately

    def _worked_since(self, time: float) -> bool:
        return not self._was_down and self._back_at < time

    def _was_known(self, number: int) -> bool:
        """Return True for an event that any of several DVAs has had before."""
        is_first = not any(number in book._numbers for book in self._books)
        if len(self._books) > 1:
            self._numbers[number] = None
            _keep_newest(self._numbers)
        return not is_first

    def _let_no_time_pass(self, passed: float) -> None:
        """Shift all deadlines: a DVA that was silenced decides nothing meanwhile."""
        for number, state in self._seen.items():
            self._seen[number] = state._replace(
                since=state.since + passed, waits=state.waits + passed, began=state.began + passed
            )

    def _unheard(self, rights: Sequence[Right], now: float, works: bool) -> Iterator[Broken]:
        """Yield permissions whose holders have been silent for longer than the DVA may wait."""
        before = self._held_since
        self._held_since = {}
        yield from self._check_informed(before, rights, now, works)
        for right in rights:
            since = now if not works else before.get(right, now)
            self._held_since[right] = since
            silent = now - max(since, self._heard.get(right.holder, since))
            if right.holder != self._dva and silent > SILENT_AFTER + PENDING_SLACK:
                right_text = f"{self._name(right.holder)} hold {self._name(right.robot)}"
                yield (
                    "S2",
                    f"lets {right_text}, of whom nothing is heard for {silent:.0f} s",
                )

    def _check_informed(
        self, before: Iterable[Right], rights: Sequence[Right], now: float, works: bool
    ) -> Iterator[Broken]:
        """Yield sessions that have ended without the robot having been told.

        Time in which the robot is not heard does not count, nor does that of a silenced DVA. A
        robot also learns of it by a new session for its holder, and from a report of its holder.
        """
        pairs = {(right.robot, right.holder) for right in rights}
        for right in before:
            if right.holder != self._dva and (right.robot, right.holder) not in pairs:
                self._uninformed.setdefault(right, now)
        for right, since in list(self._uninformed.items()):
            is_there = now - self._heard.get(right.robot, now) < SILENT_AFTER / 2
            is_told = right.session in self._informed or self._is_anothers(right.robot)
            if is_told or (right.robot, right.holder) in pairs:
                del self._uninformed[right]
            elif not works or not is_there:
                self._uninformed[right] = now
            elif now - since > INFORMED_WITHIN:
                del self._uninformed[right]
                robot = self._name(right.robot)
                holder = self._name(right.holder)
                yield "S2", f"has not told {robot} that it is {holder}'s no longer"

    def _of_event(
        self, event: Event, old: Seen | None, now: float, last: float
    ) -> Iterator[Broken]:
        """Yield the mistakes about an event; `last` is the time of the last check [s]."""
        new = self._look(event, old, now)
        rules = self._rules
        for step, when in event.times.items():
            is_noted = last == -math.inf or (old is not None and old.times.get(step) == when)
            if not is_noted and not last - STEP_SLACK <= when <= now + STEP_SLACK:
                yield "S7", f"event {event.number}: {step} is noted {now - when:.1f} s too late"
        self._seen[event.number] = new
        waits = event.waits_for is not None
        if waits and now - new.waits > rules.escalate_after + PENDING_SLACK:
            yield "S6", f"event {event.number} is {event.state} after {now - new.waits:.0f} s"
        if waits and last == -math.inf and old is not None and new.since == old.since:
            later = event.waiting_since - max(new.waits, old.began)
            if later > PENDING_SLACK:
                yield "S6", f"a restart gives event {event.number} {later:.0f} s more to wait"
        if event.severity < self._promised.get(event.number, 0.0):
            reported = self._promised[event.number]
            yield "S6", f"event {event.number} has lost its severity of {reported:g}"
        if new.hands and now - new.since > rules.order_limit + PENDING_SLACK:
            duration = now - new.since
            yield "S6", f"event {event.number} is in one pair of hands for {duration:.0f} s"
        yield from self._of_debt(event, new.debt, now)
        for finding in new.found - (old.found if old else frozenset()):
            if not self._is_found(event, finding, now):
                yield "S6", f"event {event.number} is {finding}, and nobody there has said so"
        if last > -math.inf:
            yield from self._of_arrivals(event, old)
        for steps in (STEPS, ACT_STEPS):
            times = [time for time in map(event.times.get, steps) if time is not None]
            if times != sorted(times):
                yield "S7", f"times of event {event.number} are out of order"

    def _of_arrivals(self, event: Event, old: Seen | None) -> Iterator[Broken]:
        """Yield a device that is noted as arrived, and has not been near the event."""
        reached = self._word(event.number).reached
        for step, device in ("arrived", event.responder), ("act_arrived", event.actor):
            when = event.times.get(step)
            if device is None or when is None or (old is not None and when == old.times.get(step)):
                continue
            if device not in reached and not self._is_near(device, event):
                yield (
                    "S7",
                    f"event {event.number}: {self._name(device)} has arrived, and is not there",
                )

    def _of_debt(self, event: Event, debt: Debt, now: float) -> Iterator[Broken]:
        """Yield a device that has not set out, or does not move, and still has the order."""
        rules = self._rules
        owed = now - debt.since
        # A creeping robot may just exceed the DVA's limit, which then starts again.
        still = 2 * rules.still_within + HEARD_LATE
        within = still if debt.step else rules.depart_within
        if debt.who is not None and owed > within + PENDING_SLACK:
            what = "has not moved" if debt.step else "has not set out"
            yield "S6", f"event {event.number}: {self._name(debt.who)} {what} for {owed:.0f} s"

    def _look(self, event: Event, old: Seen | None, now: float) -> Seen:
        """Track the wait: it ends when a device accepts the event, and restarts on confirmation."""
        conclusions = FOUND.intersection((*event.times, event.state.value))
        old = old or Seen(conclusions - FOUND, (), now, now, now)
        word = self._word(event.number)
        hands = _in_hand(event)
        step = "act_assigned" if hands[:1] == ("act",) else "assigned"
        if word.freed and hands == old.hands and event.times.get(step) != old.times.get(step):
            word.sent_again = True
        if word.sent_again or hands != old.hands:
            word.taken -= word.loose  # the new order may still wait in the DVA's queue
        # A restarted DVA knows which devices have set out; those that register again continue.
        act = "act_" if hands[:1] == ("act",) else ""
        under_way = any(act + step in event.times for step in ("departed", "arrived"))
        taken = bool(word.taken.intersection(hands)) or (bool(hands) and under_way)
        confirmed = "confirmed" in conclusions - old.found
        waits = now if taken or word.busy or confirmed else old.waits
        since = old.since if hands == old.hands and not word.sent_again else now
        debt = self._debt(event, hands, old.debt, now)
        goes = hands[-1] if hands else None
        if goes is not None and goes not in word.reached and self._is_near(goes, event):
            word.reached.add(goes)
        word.busy = word.sent_again = word.freed = False
        return Seen(
            conclusions,
            hands,
            since,
            waits,
            event.waiting_since,
            times=dict(event.times),
            debt=debt,
            is_over=not event.open,
        )

    def _debt(self, event: Event, hands: tuple[str | None, ...], old: Debt, now: float) -> Debt:
        """Return the next step that the device with an event owes, and since when [s]."""
        word = self._word(event.number)
        device = hands[1] if hands else None
        if device is None or device not in word.taken or self._has_others(device, event.number):
            return Debt(None, False, now)
        if ("act_arrived" if hands[0] == "act" else "arrived") in event.times:
            return Debt(None, False, now)
        goes = hands[-1] or device
        step = ("act_departed" if hands[0] == "act" else "departed") in event.times
        place = self._place_of(goes)
        is_same = (old.who, old.step) == (device, step) and not word.sent_again
        moved = step and (None in (place, old.place) or _far(place, old.place))
        return old if is_same and not moved else Debt(device, step, now, place)

    def _has_others(self, device: str, number: int) -> bool:
        numbers = (
            n for n, word in self._words.items() if device in word.ordered.keys() - word.ended
        )
        return any(other != number for other in numbers)

    def _is_found(self, event: Event, finding: str, now: float) -> bool:
        """Return True if a device sent there has said so, or a robot nearby may have sensed it."""
        if finding in self._word(event.number).found:
            return True
        lately = [robot for robot, when in self._felt.items() if now - when < FELT_LATELY]
        return finding == "confirmed" and any(self._is_near(r, event) for r in lately)


def _far(place: m.Position | None, other: m.Position | None) -> bool:
    return place is not None and other is not None and apart(place, other) >= STIRRED


def _keep_newest(table: dict[Any, Any]) -> None:
    if len(table) > MAX_KEPT:
        del table[next(iter(table))]


def _in_hand(event: Event) -> tuple[str | None, ...]:
    """Return the devices that have an unsettled event; a stand-by does not count."""
    if event.state in IN_HAND:
        return "look", event.holder, event.responder
    if event.open and event.state is State.CONFIRMED and event.actor is not None:
        return "act", event.actor
    return ()
