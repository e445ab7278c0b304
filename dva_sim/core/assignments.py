"""Who is at what, and the rules that hold whatever a policy advises.

A guard or a robot is at one event, an operator at as many as it has robots.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from dva_sim.core.events import Event


@dataclass
class Assignments:
    """What each device works on, also while it still winds up a closed event.

    How many events a device may be at is for those who give orders; here none is lost.
    """

    _events: dict[str, dict[int, Event]] = field(default_factory=dict)

    def begin(self, device: str, event: Event) -> None:
        """A device is at an event from now on, beside what it is at already."""
        self._events.setdefault(device, {})[event.number] = event

    def end(self, device: str, event: Event) -> bool:
        """A device is at an event no longer; False if it was not."""
        if not self.is_at(device, event):
            return False
        del self._events[device][event.number]
        if not self._events[device]:
            del self._events[device]
        return True

    def is_at(self, device: str, event: Event) -> bool:
        """Whether a device is at just this event."""
        return self._events.get(device, {}).get(event.number) is event

    def find(self, device: str, number: int) -> Event | None:
        """The event of that number, if a device is at it."""
        return self._events.get(device, {}).get(number)

    def all(self, device: str) -> tuple[Event, ...]:
        """All that a device is at, begun longest ago first."""
        return tuple(self._events.get(device, {}).values())

    def count(self, device: str) -> int:
        """At how many events a device is."""
        return len(self._events.get(device, ()))

    def pairs(self) -> list[tuple[str, Event]]:
        """Every device with every event it is at."""
        return [(device, event) for device in self._events for event in self.all(device)]

    def __contains__(self, device: object) -> bool:
        return device in self._events

    def __iter__(self) -> Iterator[str]:
        return iter(self._events)

    def __len__(self) -> int:
        return len(self._events)


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What the DVA insists on.

    Attributes:
        escalate_after: An event that has waited so long for somebody is escalated [s]. 0: at
            once if nobody is free; infinite: never.
        containment: Whether a confirmed event also needs a person who deals with it.
        most_waiting: More events than that do not wait: the newest is escalated at once.
        merge_distance: Reports of one kind nearer than this are one event [m]; 0: never.
        max_attempts: Orders given for one event before it is escalated.
        order_limit: Who has not settled an event so long after the order gives it back [s].
        bid_within: How long bids are taken [s].
        operator_span: How many robots one operator may have in hand at once.
        declined_pause: Who declines an order, or is not reached, is not asked again for [s].
    """

    escalate_after: float = 120.0
    containment: bool = False
    most_waiting: int | None = None
    merge_distance: float = 8.0
    max_attempts: int = 4
    order_limit: float = 900.0
    bid_within: float = 2.0
    operator_span: int = 1
    declined_pause: float = 10.0
