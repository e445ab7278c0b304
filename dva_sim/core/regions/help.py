"""Help between DVAs: an order to another DVA, which sends somebody of its own.

The DVA that needs help sends an `Order` as to a guard, and hears the same words in return. The DVA
that gives it books a copy of the event, and lets its own dispatcher find somebody: so all rules
about orders hold on both sides, and who was lent is free again with the end of the copy.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

from dva_sim.core.dispatcher import Dispatcher
from dva_sim.core.events import LOOKING, Cause, Event, State
from dva_sim.core.regions.division import Division
from dva_sim.core.sessions import DvaAnswer, Send
from dva_sim.protocol import messages as m

ASK_AFTER: Final = 5.0  # design: an event for which nobody was free for so long needs help [s]
KNOWN_FOR: Final = 5.0  # design: a DVA is asked that has said what it serves since then [s]
ORPHANED_AFTER: Final = 10.0  # design: time in which a restarted DVA can ask for help again [s]
SEVERITY: Final = 0.5  # of a copy: an order does not say it
_FINDINGS: Final = {State.CONFIRMED: "confirmed", State.REFUTED: "refuted"}


class Lent(NamedTuple):
    """A copy of an event of another DVA: who asked for help, and its number there."""

    asker: str
    number: int


def event_told(body: m.Body) -> int | None:
    """Return the number of the event whose order a message tells something of, if it does."""
    return body.event_id if isinstance(body, m.OrderProgress | m.EventReport) else None


@dataclass
class MutualHelp:
    """Help that a DVA asks for and gives.

    Attributes:
        division: Division of the site, with the service of each region.
        dispatcher: Dispatcher with all orders.
        copies: Events of others that this DVA looks at for them, by its own number.
        adopted: Copies that have become events of this DVA's own.
        lent: Devices that have worked for others and may still be away.
        told: Time at which each other DVA last said what it serves [s].
        unheard: Words about orders that have not reached another DVA, by that DVA.
        on_the_way: Words about orders that have been sent, and not been answered yet.
    """

    division: Division
    dispatcher: Dispatcher
    copies: dict[int, Lent] = field(default_factory=dict)
    adopted: set[int] = field(default_factory=set)
    lent: set[str] = field(default_factory=set)
    told: dict[str, float] = field(default_factory=dict)
    unheard: dict[str, list[Send]] = field(default_factory=dict)
    on_the_way: set[Send] = field(default_factory=set)
    _news: dict[int, list[str]] = field(default_factory=dict)
    _forgotten: dict[int, float] = field(default_factory=dict)  # restart of the asker, by copy [s]

    # --- asked for -----------------------------------------------------------------------

    def ask(self, now: float) -> list[Send]:
        """Ask other DVAs for help with waiting events for which nobody here is free."""
        orders = self.dispatcher.orders
        waiting = [e for e in orders.events.waiting.values() if self._needs_help(e, now)]
        if not waiting or self.dispatcher.situations.idle(now):
            return []
        sends = []
        for event in waiting:
            helper = next((d for d in self.division.peers if self._may_help(d, event, now)), None)
            if helper is not None:
                orders.counters["help asked for"] += 1
                sends.append(orders.confirm(event, helper, None, now))
        return sends

    def _needs_help(self, event: Event, now: float) -> bool:
        serves = self.division.dva_at(event.position) == self.division.own
        is_own = serves and event.number not in self.copies
        return is_own and event.state is State.PENDING and now - event.waiting_since >= ASK_AFTER

    def _may_help(self, dva: str, event: Event, now: float) -> bool:
        registry = self.dispatcher.orders.registry
        if not self.division.is_there(dva, registry) or dva in event.failed:
            return False
        if now - self.told.get(dva, -KNOWN_FOR) >= KNOWN_FOR:
            return False  # who was parted from it may not know yet whose event it is
        return registry.entries[dva].free_from <= now and dva not in event.handling.taken_off

    # --- given ---------------------------------------------------------------------------

    def give(self, asker: str, order: m.Order, now: float) -> DvaAnswer:
        """Take an order of another DVA, if somebody is free."""
        if order.task != "confirm" or order.device is not None:
            return DvaAnswer(m.NOT_SUPPORTED, "a DVA helps to look, by whom it chooses")
        known = next((n for n, lent in self.copies.items() if lent.number == order.event_id), None)
        if known is not None:  # the asker may have taken the event over
            self.copies[known] = Lent(asker, order.event_id)
            self._forgotten.pop(known, None)
        if self.copy_of(asker, order.event_id) is not None:
            return DvaAnswer()
        if self._owes_word(asker, order.event_id):
            return DvaAnswer(m.BUSY, "the end of an earlier order is still being reported")
        if not self.dispatcher.situations.idle(now):
            return DvaAnswer(m.BUSY, "nobody is free here")
        orders = self.dispatcher.orders
        if orders.events.full:
            return DvaAnswer(m.BUSY, "too many events are open here")
        event = orders.events.add(order.kind, order.position, SEVERITY, now)
        event.attempts = orders.rules.max_attempts - 1  # after one the asker may do better
        self.copies[event.number] = Lent(asker, order.event_id)
        orders.counters["help given"] += 1
        return DvaAnswer(sends=self.dispatcher.decide(now))

    def _owes_word(self, asker: str, number: int) -> bool:
        """Return True while the asker has not heard how an earlier order for an event ended.

        That news would end a new order there, and the people sent would not be called off.
        """
        untold = self.on_the_way.union(self.unheard.get(asker, ()))
        return any(s.to == asker and event_told(s.body) == number for s in untold)

    def copy_of(self, peer: str, number: int) -> Event | None:
        """Return the open copy of an event of another DVA."""
        orders = self.dispatcher.orders
        copy = next((n for n, lent in self.copies.items() if lent == Lent(peer, number)), 0)
        return orders.events.open.get(copy)

    def end(self, copy: Event, now: float) -> list[Send]:
        """Let those go who were lent: the asker needs no help any longer."""
        self._drop(copy.number)
        cause = Cause.SUPERSEDED if copy.state in LOOKING else Cause.WITHDRAWN
        return self.dispatcher.orders.transition(copy, cause, now)

    def adopt(self, number: int) -> None:
        """Keep a copy as an event of this DVA: the one that asked for help is gone."""
        self.adopted.add(number)
        self._drop(number)

    def forgotten_by(self, asker: str, now: float) -> None:
        """Note that a DVA has restarted, and may not remember what it asked for."""
        self._forgotten |= {n: now for n, lent in self.copies.items() if lent.asker == asker}

    def adopt_orphans(self, now: float) -> None:
        """Make events of the copies for which nobody has asked again; they go to their own DVA."""
        for number in [n for n, at in self._forgotten.items() if now - at > ORPHANED_AFTER]:
            self.adopt(number)

    def _drop(self, number: int) -> None:
        self._forgotten.pop(number, None)
        del self.copies[number]
        self._news.pop(number, None)

    def claim(self, kind: str, place: m.Position) -> list[Send]:
        """Make a copy an event of one's own, as it is reported here; return the word to its asker.

        The asker may close its event, now that this DVA has the report.
        """
        event = self.dispatcher.orders.events.near(kind, place)
        if event is None or event.number not in self.copies:
            return []
        lent = self.copies[event.number]
        self.adopt(event.number)
        return [Send(lent.asker, m.OrderProgress(lent.number, "failed"))]

    def news(self) -> list[Send]:
        """Return the news of events handled for other DVAs that those have not received yet."""
        orders = self.dispatcher.orders
        sends = []
        for number, lent in list(self.copies.items()):
            event = orders.events.get(number)
            if event is not None and event.responder is not None:
                self.lent.add(event.responder)
            steps = (
                [] if event is None else [s for s in ("departed", "arrived") if s in event.times]
            )
            told = self._news.setdefault(number, [])
            news: list[m.Body] = [
                m.OrderProgress(lent.number, step) for step in steps if step not in told
            ]
            told += [step for step in steps if step not in told]
            if event is None or not event.open:
                news += self._ends(event, lent)
                self._drop(number)
            sends += [Send(lent.asker, body) for body in news]
        return sends

    @staticmethod
    def _ends(event: Event | None, lent: Lent) -> list[m.Body]:
        finding = None if event is None else _FINDINGS.get(event.state)
        if event is None or finding is None:
            return [m.OrderProgress(lent.number, "failed")]
        report = m.EventReport(
            lent.number,
            event.kind,
            event.position,
            event.severity,
            round(max(0.0, min(event.confidence, 1.0)), 6),
            finding,
        )
        return [report, m.OrderProgress(lent.number, "done")]
