"""Strays: events of another DVA's region that this one has, and passes on once that one is there.

A DVA books reports while the DVA of the place is silent, and what robots of its own feel
beyond a border. It closes such an event when the other DVA has taken it, and not before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from dva_sim.core.events import LOOKING, Cause, Event, State
from dva_sim.core.orders import Orders
from dva_sim.core.regions.division import Division
from dva_sim.core.regions.help import MutualHelp
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m

RETRY_DELAY_S: Final = 10.0  # design: pause after a report that was not taken [s]


@dataclass
class Strays:
    """Passes events on to the DVAs of their places.

    Attributes:
        division: Division of the site, with the service of each region.
        orders: Current orders.
        help: Copies of events of others stay here.
    """

    division: Division
    orders: Orders
    help: MutualHelp
    _passed: dict[int, float] = field(default_factory=dict)  # when, by event [s]
    _sends: dict[Send, int] = field(default_factory=dict)

    def pass_on(self, now: float) -> list[Send]:
        """Return reports of strays whose DVA is there."""
        events = self.orders.events
        self._passed = {n: at for n, at in self._passed.items() if n in events.open}
        self._sends = {send: n for send, n in self._sends.items() if n in events.open}
        sends = []
        for event in self._strays():
            if now - self._passed.get(event.number, -RETRY_DELAY_S) >= RETRY_DELAY_S:
                self._passed[event.number] = now
                confidence = round(max(0.0, min(event.confidence, 1.0)), 6)
                what = event.kind, event.position, event.severity, confidence, "detected"
                report = m.EventReport(None, *what, origin=self.division.own)
                send = Send(self.division.dva_at(event.position), report)
                self._sends[send] = event.number
                sends.append(send)
        return sends

    def taken(self, send: Send, now: float) -> list[Send]:
        """Close a stray that the DVA of its region has accepted; recall its responders."""
        event = self.orders.events.open.get(self._sends.pop(send, 0))
        if event is None or not self._may_go(event):
            return []
        looks = event.state in LOOKING
        self.orders.counters["event passed on"] += 1
        self.orders.counters["event looked at twice"] += looks
        cause = Cause.SUPERSEDED if looks else Cause.WITHDRAWN
        return self.orders.transition(event, cause, now)

    def _strays(self) -> Iterator[Event]:
        for event in list(self.orders.events.in_state(State.PENDING, *LOOKING)):
            is_others = self.division.other_at(event.position, self.orders.registry) is not None
            if is_others and event.number not in self.help.copies:
                yield event

    @staticmethod
    def _may_go(event: Event) -> bool:
        return event.state is State.PENDING or event.state in LOOKING
