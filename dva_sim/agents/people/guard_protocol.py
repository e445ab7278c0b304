"""Protocol of a guard with the DVA. Pure: takes messages and returns what to do now.

The newest order holds. It takes the place of an older one at once, also of work at an event: so
the guard and the DVA never disagree on what the guard does. The DVA itself knows whom it should
not recall.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from dva_sim.protocol import messages as m

AWARD_WITHIN = 60.0  # design: time after the last bid in which an award may arrive [s]
MAX_ANNOUNCED = 32  # design: announcements that are remembered; the oldest are forgotten first
ORDER_DONE = "done"  # the DVA's word that an order is over


@dataclass(frozen=True, eq=False)
class Errand:
    """Somewhere to go.

    Attributes:
        place: Destination.
        order: Order to carry out there; None: wait.
    """

    place: m.Position
    order: m.Order | None = None


class GuardDecision(NamedTuple):
    """Consequence of a message.

    Attributes:
        code: Reply code; anything but OK means that nothing has changed.
        text: Reason in words.
        changed: True if the errand has changed or ended.
        bid_on: Task to bid on.
    """

    code: int
    text: str = ""
    changed: bool = False
    bid_on: m.TaskAnnouncement | None = None


@dataclass
class GuardProtocol:
    """The decider of one guard.

    Attributes:
        dva: Id of the DVA: only its orders count.
        mobilisation: Time from an order to the first step [s], for a guard who was waiting.
        is_at: Predicate: True if the guard stands at a place.
        errand: Current errand; None while it waits.
        ready_at: Time at which the guard can set out, or could [s].
        unfit: Reason why the guard takes no orders now; empty while it does.
    """

    dva: str
    mobilisation: float
    is_at: Callable[[m.Position], bool] = lambda place: False
    errand: Errand | None = None
    ready_at: float = 0.0
    unfit: str = ""
    _at_event: int | None = None
    _announced: OrderedDict[int, tuple[m.TaskAnnouncement, float]] = field(
        default_factory=OrderedDict
    )

    def obey(self, dva: str) -> None:
        """Take orders of another DVA from now on; the present order continues."""
        self.dva = dva

    @property
    def order(self) -> m.Order | None:
        """The order that the guard has."""
        return None if self.errand is None else self.errand.order

    def handle(self, message: m.Message, now: float) -> GuardDecision:
        """Decide on a message that arrived at `now` [s]."""
        if message.source != self.dva:
            return GuardDecision(m.NOT_PERMITTED, "only the DVA gives orders")
        if self.unfit and not isinstance(message.body, m.OrderProgress):
            return GuardDecision(m.BUSY, self.unfit)
        match message.body:
            case m.Order(device=None) as order:
                return self._ordered(order, now)
            case m.OrderProgress(state=state) as word if state == ORDER_DONE:
                return self._stand_down(word)
            case m.Relocation(position=place):
                return self._relocated(place, now)
            case m.TaskAnnouncement() as announcement:
                return self._heard(announcement, now)
            case m.TaskAward(event_id=event):
                return self._awarded(event, now)
            case _:
                return GuardDecision(m.NOT_SUPPORTED, "a guard takes orders to walk")

    def is_over(self, at_event: bool = False) -> None:
        """End the errand; the guard waits where it is, which may be at the event."""
        self._at_event = self.order.event_id if at_event and self.order else None
        self.errand = None

    def _ordered(self, order: m.Order, now: float) -> GuardDecision:
        if order == self.order:
            return GuardDecision(m.OK, "has it already")
        return self._set_out(Errand(order.position, order), now)

    def _stand_down(self, word: m.OrderProgress) -> GuardDecision:
        if self.order is None or self.order.event_id != word.event_id:
            return GuardDecision(m.OK, "is over already")
        self.is_over()
        return GuardDecision(m.OK, changed=True)

    def _relocated(self, place: m.Position, now: float) -> GuardDecision:
        if self.order is not None:
            return GuardDecision(m.BUSY, "has an order")
        if self.errand is not None and self.errand.place == place:
            return GuardDecision(m.OK, "on the way there already")
        if self.errand is None and self.is_at(place):
            return GuardDecision(m.OK, "stands there already")
        return self._set_out(Errand(place), now)

    def _set_out(self, errand: Errand, now: float) -> GuardDecision:
        """Set out on an errand; a guard on the way or on scene needs no time to get ready."""
        order = errand.order
        if self.errand is None:
            is_there = order is not None and order.event_id == self._at_event
            self.ready_at = now if is_there else now + self.mobilisation
        self.errand = errand
        self._at_event = None
        return GuardDecision(m.OK, changed=True)

    # --- auctions ----------------------------------------------------------------------

    def _heard(self, announcement: m.TaskAnnouncement, now: float) -> GuardDecision:
        self._forget(now)
        until = now + announcement.bid_within + AWARD_WITHIN
        self._announced[announcement.event_id] = announcement, until
        self._announced.move_to_end(announcement.event_id)
        if len(self._announced) > MAX_ANNOUNCED:
            self._announced.popitem(last=False)
        return GuardDecision(m.OK, bid_on=announcement if self.order is None else None)

    def _awarded(self, event: int, now: float) -> GuardDecision:
        """Treat an award like an order to look; an order sent in between is newer."""
        held = self.order
        if held is not None and (held.event_id, held.task) == (event, "confirm"):
            return GuardDecision(m.OK, "has it already")
        self._forget(now)
        if event not in self._announced:
            return GuardDecision(m.UNKNOWN_EVENT, f"event {event} was not announced, or long ago")
        if held is not None:
            return GuardDecision(m.BUSY, "has an order")
        announced, _ = self._announced.pop(event)
        order = m.Order(event, announced.kind, announced.position, None)
        return self._set_out(Errand(order.position, order), now)

    def _forget(self, now: float) -> None:
        for event in [e for e, (_, until) in self._announced.items() if until < now]:
            del self._announced[event]
