"""Safety rules of several DVAs: one is obeyed at a time, none takes events or help with it.

It believes nobody, as `SafetyAudit`, which lets it see the same facts. `CHECKED` says what is held
against them.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from dva_sim.core.events import Event, State, apart
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode_if_valid
from dva_sim.simulation.full.event_ledger import SIMULTANEOUS_S, UNREPLICATED
from dva_sim.simulation.full.observations import Page, SafetyTerms

OBEYS_WITHIN: Final = 5.0  # delay allowed between an order and its first effect [s]
HEALS_WITHIN: Final = 30.0  # time in which two DVAs that hear each other have to agree [s]
HEARD_WITHIN: Final = 6.0  # a DVA heard within this time counts as reachable now [s]
SHOWN_WITHIN: Final = 5.0  # a DVA whose table was not seen for this long is dead [s]
PASSED_WITHIN: Final = 0.9  # an event from another DVA is in the table within this time [s]
GOES_ON_WITHIN: Final = (
    15.0  # time after a takeover in which a dead DVA's events are open again [s]
)
COMES_BACK_WITHIN: Final = 15.0  # time after an event in which lent responders are free [s]
MAX_MOVE_M: Final = 25.0  # maximum distance by which an event is moved to where it is seen [m]
MAX_KEPT: Final = 1000

CHECKED: Final = {
    "S12": "a device answers OK only to orders of the DVA that confirmed its newest registration; "
    "a DVA that has heard of a higher epoch of a region sends nobody to an event there; slack: "
    f"{OBEYS_WITHIN:g} s",
    "S13": "an open event of a report that was answered without `unreplicated` is in the book of "
    f"the DVA that takes the region over, {GOES_ON_WITHIN:g} s later; an event that a DVA has let "
    f"go of, as its place is another's, is in the other's book {PASSED_WITHIN:g} s later",
    "S14": "DVAs that hear each other do not both serve one region, nor both look at one event "
    f"of a region; slack: {HEALS_WITHIN:g} s",
    "S15": "nobody looks at an event for a DVA whose event is over, or that has sent somebody "
    f"else; slack: {COMES_BACK_WITHIN:g} s; a DVA that has promised help has the event in its "
    f"book {PASSED_WITHIN:g} s later",
}
"""Checks of each rule, made at every message and twice a second."""

ORDERS: Final = (
    *(m.Order, m.OrderProgress, m.TaskAnnouncement, m.TaskAward, m.Relocation, m.HandOver),
    *(m.HandoverRequest, m.PermissionGrant, m.PermissionRevocation, m.ReleaseEmergency),
)
_MARKS: Final = (b"<RegMsg>", b"<PeerStatus>", b"<reply>", b"<Event>", b"<HBMsg>")
_LOOKED_AT: Final = State.PENDING, State.ASSIGNED, State.ON_SCENE

Broken = tuple[str, str]
Key = tuple[str, str, int]  # who was asked by whom, and the number of the request


class Asked(NamedTuple):
    """An order that has reached a device: when it was sent, and whom the device obeyed then."""

    timestamp: str
    obeyed: str | None


class KeptReport(NamedTuple):
    """A report that a DVA has answered as kept by its deputy, too."""

    dva: str
    report: m.EventReport


@dataclass
class RegionalRules:
    """Holds the facts of a run with several DVAs against S12 to S15.

    Attributes:
        terms: Limits that the run is held to.
        region_at: Function that returns the region of a place.
    """

    terms: SafetyTerms
    region_at: Callable[[m.Position], str]
    _registers: OrderedDict[Key, None] = field(default_factory=OrderedDict)
    _obeys: dict[str, str] = field(default_factory=dict)
    _ordered: OrderedDict[Key, Asked] = field(default_factory=OrderedDict)
    _epochs: dict[tuple[str, str], tuple[int, float]] = field(default_factory=dict)
    _heard: dict[tuple[str, str], float] = field(default_factory=dict)
    _reported: OrderedDict[Key, m.EventReport] = field(default_factory=OrderedDict)
    _promises: list[KeptReport] = field(default_factory=list)
    _claimed: dict[str, tuple[str, float]] = field(default_factory=dict)  # by region
    _sends: list[tuple[str, m.Order, float]] = field(default_factory=list)
    _requests: OrderedDict[Key, m.Order] = field(default_factory=OrderedDict)
    _promised_help: list[tuple[str, m.Order, float]] = field(default_factory=list)
    _pages: dict[str, Page] = field(default_factory=dict)
    _died: dict[str, float] = field(default_factory=dict)  # of those that are dead
    _down: dict[str, float] = field(default_factory=dict)  # when each was last seen dead
    _shown: dict[str, float] = field(default_factory=dict)  # when each book was last seen
    _since: dict[tuple[Any, ...], float] = field(default_factory=dict)

    # --- messages --------------------------------------------------------------------------

    def delivered(self, now: float, source: str, to: str, payload: bytes) -> None:
        """Take a message that has arrived."""
        if not any(mark in payload for mark in _MARKS) and source not in self.terms.dvas:
            return
        message = decode_if_valid(payload)
        if message is None or message.source != source:
            return
        body = message.body
        if to in self.terms.dvas:
            self._heard[to, source] = now
            if isinstance(body, m.Registration):
                self._registers[source, to, message.message_id] = None
            elif isinstance(body, m.EventReport) and body.event_id is None:
                self._reported[source, to, message.message_id] = body
            elif isinstance(body, m.PeerStatus):
                for each in body.regions:
                    newest, _ = self._epochs.get((to, each.region), (0, now))
                    if each.epoch > newest:
                        self._epochs[to, each.region] = each.epoch, now
        elif source in self.terms.dvas and isinstance(body, m.Reply):
            if self._registers.pop((to, source, body.answers), ()) is None and body.code == m.OK:
                self._obeys[to] = source
        elif source in self.terms.dvas and isinstance(body, ORDERS):
            key = to, source, message.message_id
            order = self._ordered.get(key)
            if order is None or order.timestamp != message.timestamp:  # else it is a repetition
                self._ordered[key] = Asked(message.timestamp, self._obeys.get(to))
        for table in (self._registers, self._ordered, self._reported, self._requests):
            if len(table) > MAX_KEPT:
                table.popitem(last=False)

    def sent(self, now: float, source: str, to: str, payload: bytes) -> Iterator[Broken]:
        """Take a message that was sent; yield the rules that it breaks."""
        if source in self.terms.dvas:
            self._said(now, source, to, payload)
        elif to in self.terms.dvas and b"<reply>" in payload and self._ordered:
            message = decode_if_valid(payload)
            if message is not None and isinstance(message.body, m.Reply):
                order = self._ordered.get((source, to, message.body.answers))
                candidates = [] if order is None else [order.obeyed, self._obeys.get(source)]
                obeyed = [dva for dva in candidates if dva is not None]
                if message.body.code == m.OK and obeyed and to not in obeyed:
                    yield "S12", f"obeys {to}, and is registered with {obeyed[-1]}"

    def _said(self, now: float, dva: str, to: str, payload: bytes) -> None:
        """Take a message of a DVA."""
        if not any(mark in payload for mark in (*_MARKS, b"<Replicate>")):
            return
        message = decode_if_valid(payload)
        match message.body if message is not None else None:
            case m.Order() as order if to not in self.terms.dvas:
                self._sends.append((dva, order, now))
            case m.Order() as request if message is not None:
                self._requests[dva, to, message.message_id] = request
            case m.Reply(code=m.OK, answers=number, text=text):
                if (to, dva, number) in self._requests:
                    requested = self._requests.pop((to, dva, number))
                    self._promised_help.append((dva, requested, now))
                report = self._reported.pop((to, dva, number), None)
                is_kept = report is not None and text != UNREPLICATED
                if report is not None and is_kept and report.finding == "detected":
                    self._promises.append(KeptReport(dva, report))
                    del self._promises[:-MAX_KEPT]
            case m.Replicate(event=event) if event.closed_for is not None:
                self._promises = [p for p in self._promises if not _is_about(p.report, event)]

    def _of_orders(self, page: Page) -> Iterator[Broken]:
        """Yield orders for events in a region of which the DVA knows a higher epoch."""
        mine = [each for each in self._sends if each[0] == page.dva]
        self._sends = [each for each in self._sends if each[0] != page.dva]
        for dva, order, when in mine:
            region = self.region_at(order.position)
            epoch, since = self._epochs.get((dva, region), (0, when))
            is_help = order.event_id in page.copies
            served = page.served.get(region, 0)
            if epoch > served > 0 and when - since > OBEYS_WITHIN and not is_help:
                yield "S12", f"sends somebody in {region} by epoch {served}, and knows of {epoch}"

    # --- what the books show ---------------------------------------------------------------

    def shows(self, now: float, page: Page) -> Iterator[Broken]:
        """Take the present page of a DVA's book; yield the rules that it breaks."""
        before = self._pages.get(page.dva, page)
        for region in page.served.keys() - before.served.keys():
            self._claimed[region] = page.dva, now
        self._note_dead(now, page)
        self._pages[page.dva] = page
        self._shown[page.dva] = now
        if page.works:
            yield from self._of_orders(page)
            yield from self._of_the_dead(page, now)
            yield from self._of_passed_on(page, now)
            yield from self._of_others(page, now)
            yield from self._of_help(page, now)
            yield from self._of_promised_help(page, now)

    def _note_dead(self, now: float, page: Page) -> None:
        """Note the DVAs that decide nothing, or whose book nobody has seen for a while."""
        dead = [dva for dva, at in self._shown.items() if now - at > SHOWN_WITHIN]
        for dva in dead if page.works else [*dead, page.dva]:
            self._died.setdefault(dva, now)
            self._down[dva] = now
        if page.works:
            self._died.pop(page.dva, None)
        else:  # it forgets what it heard, and starts afresh
            self._epochs = {key: at for key, at in self._epochs.items() if key[0] != page.dva}
            self._promised_help = [p for p in self._promised_help if p[0] != page.dva]
            for key in [key for key in self._requests if page.dva in key]:
                del self._requests[key]  # a restarted DVA uses the numbers again
            over = {("S14", page.dva), ("S15", page.dva)}
            self._since = {key: at for key, at in self._since.items() if key[:2] not in over}

    def _of_the_dead(self, page: Page, now: float) -> Iterator[Broken]:
        """Yield promises of a dead DVA that the one which has taken over does not keep."""
        for promise in list(self._promises):
            region = self.region_at(promise.report.position)
            by, since = self._claimed.get(region, ("", now))
            dead = self._pages.get(promise.dva)
            if by != page.dva or promise.dva == by or dead is None or promise.dva not in self._died:
                continue
            if now - since <= GOES_ON_WITHIN or region not in page.served:
                continue
            self._promises.remove(promise)
            died = self._died.get(promise.dva, now) - SIMULTANEOUS_S
            if any(at > died for dva, at in self._down.items() if dva != promise.dva):
                continue  # two deaths at once are not promised to be harmless
            fits = (e for e in dead.events.open.values() if _fits(e, promise.report, self._near))
            was_open = any(event.state in _LOOKED_AT for event in fits)
            books = (*page.events.open.values(), *page.events.closed.values())
            if was_open and not any(_fits(e, promise.report, self._near) for e in books):
                what = f"a {promise.report.kind} was reported to {promise.dva}"
                yield "S13", f"{what} and kept, but is not in this book after its death"

    def _of_passed_on(self, page: Page, now: float) -> Iterator[Broken]:
        """Yield events that a DVA has passed on and no DVA has."""
        for number, event in page.events.closed.items():
            by = self._server_of(self.region_at(event.position))
            other = self._pages.get(by or "")
            if event.state is not State.EXPIRED or other is None or other.dva == page.dva:
                continue
            key = "S13", page.dva, number
            if now - self._since.setdefault(key, now) <= PASSED_WITHIN or not other.works:
                continue
            if self._since[key] < math.inf:
                self._since[key] = math.inf  # it is judged once
                near = self._near_elsewhere(page, event)
                if number not in page.copies and all(e.state is State.EXPIRED for e in near):
                    yield "S13", f"has let go of event {number}, which {by} does not have"

    def _near_elsewhere(self, page: Page, event: Event) -> Iterator[Event]:
        """Yield the same event in the books of other DVAs, which may pass it on in turn."""
        for other in self._pages.values():
            events = (*other.events.open.values(), *other.events.closed.values())
            same = (e for e in events if e.kind == event.kind and e.number not in other.copies)
            if other is not page and other.dva not in self._died:
                yield from (e for e in same if apart(e.position, event.position) < self._near)

    def _server_of(self, region: str) -> str | None:
        """Return the DVA with the highest epoch of a region, by the statuses of DVAs."""
        claims = ((page.served.get(region, 0), page.dva) for page in self._pages.values())
        epoch, dva = max(claims, default=(0, ""))
        return dva if epoch else None

    @property
    def _near(self) -> float:
        return max(self.terms.rules.merge_distance, 0.001)

    def _of_others(self, page: Page, now: float) -> Iterator[Broken]:
        """Yield regions that two DVAs in contact both serve, and events that both handle."""
        lasting: set[tuple[Any, ...]] = set()
        for other in self._pages.values():
            if other.dva <= page.dva or not other.works or not self._hear(page.dva, other.dva, now):
                continue
            both = page.served.keys() & other.served.keys()
            lasting |= {("region", page.dva, other.dva, region) for region in both}
            lasting |= {
                ("event", page.dva, other.dva, event.number, twin.number)
                for event in self._looked_at(page)
                for twin in self._looked_at(other)
                if event.kind == twin.kind and apart(event.position, twin.position) < self._near
                if self.region_at(event.position) == self.region_at(twin.position)
            }
        for key, since in self._lasting("S14", page.dva, lasting, now):
            if now - since > HEALS_WITHIN:
                what = "serve " + key[3] if key[0] == "region" else f"look at event {key[3]}"
                yield "S14", f"{key[1]} and {key[2]} both {what}, and hear each other"

    @staticmethod
    def _looked_at(page: Page) -> Iterator[Event]:
        for event in page.events.open.values():
            if event.state in _LOOKED_AT and event.number not in page.copies:
                yield event

    def _hear(self, one: str, other: str, now: float) -> bool:
        pairs = (one, other), (other, one)
        return all(now - self._heard.get(pair, -math.inf) <= HEARD_WITHIN for pair in pairs)

    def _of_help(self, page: Page, now: float) -> Iterator[Broken]:
        """Yield copies of events that nobody has to look at any longer."""
        useless = set[tuple[Any, ...]]()
        for number, (asker, original) in page.copies.items():
            book = self._pages.get(asker)
            event = book.events.open.get(original) if book is not None else None
            is_judged = (
                book is not None and book.works and number in page.events.open
            ) and self._hear(page.dva, asker, now)
            if is_judged and (event is None or event.responder != page.dva):
                useless.add(("copy", page.dva, number, asker))
        for key, since in self._lasting("S15", page.dva, useless, now):
            if now - since > COMES_BACK_WITHIN:
                what = f"still looks at event {key[2]} for {key[3]}"
                yield "S15", f"{what}, which needs that no longer"

    def _of_promised_help(self, page: Page, now: float) -> Iterator[Broken]:
        """Yield promises of help for which nothing is in the book."""
        due = [p for p in self._promised_help if p[0] == page.dva and now - p[2] > PASSED_WITHIN]
        self._promised_help = [each for each in self._promised_help if each not in due]
        events = (*page.events.open.values(), *page.events.closed.values())
        for _, order, _ in due:
            fits = (e for e in events if e.kind == order.kind)
            if all(apart(event.position, order.position) >= self._near for event in fits):
                yield "S15", f"has promised to look at event {order.event_id}, and has none there"

    def _lasting(
        self, rule: str, dva: str, conditions: set[tuple[Any, ...]], now: float
    ) -> Iterator[tuple[tuple[Any, ...], float]]:
        """Yield the findings at every table so far, and when each began [s]."""
        for key in [key for key in self._since if key[:2] == (rule, dva)]:
            if key[2:] not in conditions:
                del self._since[key]
        for each in sorted(conditions, key=str):
            yield each, self._since.setdefault((rule, dva, *each), now)


def _fits(event: Event, report: m.EventReport, near: float) -> bool:
    return event.kind == report.kind and apart(event.position, report.position) < near


def _is_about(report: m.EventReport, event: m.EventStatus) -> bool:
    is_near = apart(report.position, event.position) < MAX_MOVE_M
    return is_near and report.kind == event.kind
