"""Orders: who has to do what. Given, taken up, given back, taken back; the book tells the rest."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

from dva_sim.core.events import NEXT, Event, EventBook, State
from dva_sim.core.registry import Registry
from dva_sim.core.rules import Rules
from dva_sim.core.send import Send
from dva_sim.core.sessions import Sessions
from dva_sim.protocol import messages as m

OVER = "done"  # said by the DVA to who has an order: it is over, stop


@dataclass
class Orders:
    """All orders of a desk.

    Attributes:
        engaged: What each device is working on, also while it still winds up a closed event.
        counters: How often what happened.
    """

    rules: Rules
    registry: Registry
    book: EventBook
    sessions: Sessions
    engaged: dict[str, Event] = field(default_factory=dict)
    counters: Counter[str] = field(default_factory=Counter)
    _pauses: list[float] = field(default_factory=list)

    # --- given -------------------------------------------------------------------------

    def confirm(
        self, event: Event, responder: str, operator: str | None, now: float, award: bool = False
    ) -> Send:
        """Send somebody to look; an award goes to who has bid, its operator hears later."""
        self.book.move(event, State.ASSIGNED, now)
        event.responder, event.operator = responder, operator
        for name in (responder, operator):
            if name is not None:
                self.engaged[name] = event
        event.sent.add(operator or responder)
        if award:
            return Send(responder, m.TaskAward(event.number))
        return self._order_to_confirm(event)

    def _order_to_confirm(self, event: Event) -> Send:
        assert event.responder is not None
        device = event.responder if event.operator else None
        body = m.Order(event.number, event.kind, event.position, device)
        return Send(event.operator or event.responder, body)

    def act(self, event: Event, guard: str, now: float) -> Send:
        """Send a person to deal with an event, or to stand by until it is confirmed."""
        event.actor = guard
        event.times["act_assigned"] = now
        event.sent.add(guard)
        self.engaged[guard] = event
        self.book.touch(event)
        return self._order_to_act(event)

    def _order_to_act(self, event: Event) -> Send:
        assert event.actor is not None
        task = "contain" if event.state is State.CONFIRMED else "stand_by"
        return Send(event.actor, m.Order(event.number, event.kind, event.position, None, task))

    def redirect(self, event: Event, now: float) -> None:
        """Take back an order because its responder has to go elsewhere; that is no attempt."""
        self._free(event, event.responder, event.operator)
        event.preemptions += 1
        self.counters["preempted"] += 1
        since = event.waiting_since
        self.book.move(event, State.PENDING, now)
        event.waiting_since = since

    def again(self) -> list[Send]:
        """Every order that stands, to be said again by a desk that was started anew."""
        sends = []
        for event in self.book.open.values():
            if event.state in (State.ASSIGNED, State.ON_SCENE) and event.responder is not None:
                sends.append(self._order_to_confirm(event))
            if event.actor is not None:
                sends.append(self._order_to_act(event))
        return sends

    # --- taken up, or not --------------------------------------------------------------

    def taken_up(self, send: Send) -> list[Send]:
        """Somebody has answered an order or an award with OK."""
        body = send.body
        event = self.book.open.get(body.event_id) if isinstance(body, _ORDERS) else None
        if event is None:
            return []
        if isinstance(body, m.TaskAward) and send.to == event.responder and event.operator:
            return [self._order_to_confirm(event)]
        if send.to == event.holder:
            self._noted_as_taken_up(event)
        return []

    def _noted_as_taken_up(self, event: Event) -> None:
        if not event.taken_up:
            event.taken_up = True
            event.attempts += 1
            self.book.touch(event)

    def not_taken_up(self, send: Send, now: float) -> list[Send]:
        """An order was declined, or did not arrive: nobody set out, so it is no attempt."""
        body = send.body
        assert isinstance(body, _ORDERS)
        self._pause(send.to, now)
        event = self.book.open.get(body.event_id)
        if event is None:
            return []
        if send.to == event.actor and not isinstance(body, m.TaskAward):
            return self._actor_gone(event)
        stands = event.state in (State.ASSIGNED, State.ON_SCENE)
        if not stands or send.to not in (event.holder, event.responder):
            return []  # the order is another's by now
        since = event.waiting_since
        self._free(event, event.responder, event.operator)
        self._reopen(event, now)
        event.waiting_since = since
        return []

    # --- what those who have them say ---------------------------------------------------

    def departed(self, event: Event, device: str, now: float) -> None:
        """Somebody has set out."""
        if device == event.actor:
            event.times.setdefault("act_departed", now)
        elif event.state is State.ASSIGNED:
            self._noted_as_taken_up(event)
            event.times.setdefault("departed", now)

    def arrived(self, event: Event, device: str, now: float) -> None:
        """Somebody is there."""
        if device == event.actor:
            event.times.setdefault("act_arrived", now)
        elif event.state is State.ASSIGNED:
            self._noted_as_taken_up(event)
            event.times.setdefault("departed", now)
            event.times["arrived"] = now
            self.book.move(event, State.ON_SCENE, now)
        name = device if device == event.actor else event.responder
        if name is not None:
            self.registry.entries[name].position = event.position

    def found(self, event: Event, device: str, finding: str, now: float) -> list[Send]:
        """What somebody who was sent has found, or done."""
        if device in (event.holder, event.actor):
            self.arrived(event, device, now)
        if not event.open:
            return []
        if finding == "contained" and event.state is State.CONFIRMED:
            self.book.move(event, State.CONTAINED, now)
        elif finding == "confirmed" and event.state is not State.CONFIRMED:
            self.book.move(event, State.CONFIRMED, now)
            if event.open and event.actor is not None:
                return [self._order_to_act(event)]
            return self._stand_down(event)
        elif finding == "refuted" and State.REFUTED in NEXT[event.state]:
            self.book.move(event, State.REFUTED, now)
            return self._stand_down(event, but=device)
        return []

    def ends(self, event: Event, device: str, state: str, now: float) -> None:
        """Somebody is free again; an event it could not settle is open to others."""
        if device == event.actor:
            self._free(event, device)
            if event.open:
                self._actor_failed(event, now)
            return
        if device != event.holder:
            self._free(event, device)
            return
        self._release(event)
        if event.state in (State.ASSIGNED, State.ON_SCENE):
            if event.responder is not None and state != "declined":
                self._noted_as_taken_up(event)
                event.failed.add(event.responder)
            self._reopen(event, now)

    # --- taken back --------------------------------------------------------------------

    def abandon(self, device: str, now: float) -> list[Send]:
        """A device is gone: what it was doing is open to others."""
        event = self.engaged.get(device)
        if event is None:
            return []
        if device == event.actor:
            return self._actor_gone(event)
        if device not in (event.responder, event.operator):
            self._free(event, device)
            return []
        self._release(event)
        if event.state in (State.ASSIGNED, State.ON_SCENE):
            self._reopen(event, now)
        return []

    def give_up(self, now: float) -> list[Send]:
        """Escalate what has waited too long, and the newest of more than may wait."""
        rules, waiting = self.rules, self.book.waiting
        late: list[Event] = []
        if waiting and now >= rules.escalate_after:
            late = [e for e in waiting.values() if self._wait_ends(e) <= now]
        if rules.most_waiting is not None and len(waiting) - len(late) > rules.most_waiting:
            left = [e for e in waiting.values() if e not in late]
            late += left[rules.most_waiting :]
        return [send for event in late for send in self.escalate(event, now)]

    def take_back(self, now: float) -> list[Send]:
        """Orders that were not carried out in time are open to others."""
        if math.isinf(self.rules.order_limit):
            return []
        late = {e.number: e for e in self.engaged.values() if self._order_ends(e) <= now}
        sends = [send for event in late.values() for send in self._take_back(event, now)]
        self._pauses = [until for until in self._pauses if until > now]
        return sends

    def next_deadline(self) -> float:
        """When something will have waited, or taken, too long [s]."""
        rules, waiting = self.rules, self.book.waiting
        ends = min(self._pauses, default=math.inf) if waiting else math.inf
        if math.isfinite(rules.escalate_after):
            ends = min([ends, *(self._wait_ends(e) for e in waiting.values())])
        if math.isfinite(rules.order_limit):
            ends = min([ends, *(self._order_ends(e) for e in self.engaged.values())])
        return ends

    def _wait_ends(self, event: Event) -> float:
        if event.waits_for is None:
            return math.inf
        return event.waiting_since + self.rules.escalate_after

    def _order_ends(self, event: Event) -> float:
        """When whoever is at it counts as having failed; standing by is no work."""
        if event.state in (State.ASSIGNED, State.ON_SCENE):
            return event.times["assigned"] + self.rules.order_limit
        if event.state is State.CONFIRMED and event.actor is not None:
            begun = max(event.times["act_assigned"], event.times["confirmed"])
            return begun + self.rules.order_limit
        return math.inf if event.open else event.times["closed"] + self.rules.order_limit

    def _take_back(self, event: Event, now: float) -> list[Send]:
        self.counters["order took too long"] += 1
        if not event.open:  # its last word must have been lost
            self._release(event)
            self._free(event, event.actor)
            return []
        over = m.OrderProgress(event.number, OVER)
        if event.state is State.CONFIRMED:
            assert event.actor is not None
            sends = [Send(event.actor, over)]
            self._free(event, event.actor)
            self._actor_failed(event, now)
            return sends
        assert event.responder is not None
        sends = [Send(event.holder or event.responder, over)]
        event.failed.add(event.responder)
        self._release(event)
        self._reopen(event, now)
        return sends

    def may_preempt(self, event: Event, now: float) -> bool:
        """Whether a responder may be called away: not from a scene, nor past the deadline."""
        within = now - event.waiting_since < self.rules.escalate_after
        return event.state is State.ASSIGNED and within

    def escalate(self, event: Event, now: float) -> list[Send]:
        """Nobody has come in time: others than the DVA's own have to."""
        self.book.move(event, State.ESCALATED, now)
        return self._stand_down(event)

    def expire(self, event: Event, now: float) -> list[Send]:
        """Nobody says any longer that there is something."""
        self.book.move(event, State.EXPIRED, now)
        return self._stand_down(event)

    # --- the small print ---------------------------------------------------------------

    def _pause(self, device: str, now: float) -> None:
        """Who did not take an order up is not asked again for a while."""
        until = now + self.rules.declined_pause
        self.registry.entries[device].free_from = until
        self._pauses.append(until)

    def _release(self, event: Event) -> None:
        """The order to confirm is over, and with it the right to drive there."""
        if event.operator is not None and event.responder is not None:
            self.sessions.take_back(event.operator, event.responder)
        self._free(event, event.responder, event.operator)

    def _free(self, event: Event, *names: str | None) -> None:
        for name in names:
            if name is not None and self.engaged.get(name) is event:
                del self.engaged[name]
                self.book.touch(event)

    def _reopen(self, event: Event, now: float) -> None:
        event.waiting_since = now
        if event.attempts < self.rules.max_attempts:
            self.book.move(event, State.PENDING, now)
        else:
            self.book.move(event, State.ESCALATED, now)

    def _actor_gone(self, event: Event) -> list[Send]:
        """Who should have dealt with it is not there: somebody else has to."""
        self._free(event, event.actor)
        event.actor = None
        if event.open:
            self.book.touch(event)
        return []

    def _actor_failed(self, event: Event, now: float) -> None:
        event.actor = None
        event.attempts += 1
        event.waiting_since = now
        if event.state is State.CONFIRMED and event.attempts >= self.rules.max_attempts:
            self.book.move(event, State.ESCALATED, now)
        else:
            self.book.touch(event)

    def _stand_down(self, event: Event, but: str | None = None) -> list[Send]:
        """Who stands by, or was to deal with an event that is over, is free again."""
        actor = event.actor
        if actor is None or event.open or actor == but:
            return []
        self._free(event, actor)
        event.actor = None
        return [Send(actor, m.OrderProgress(event.number, OVER))]


_ORDERS = (m.Order, m.TaskAward)
