"""Orders: which device has to do what, and how its progress changes the event."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from dva_sim.core.assignments import MOVE, SET_OUT, Assignments, Promise, Promises, Rules
from dva_sim.core.audit import AuditTrail
from dva_sim.core.emergencies import Emergencies
from dva_sim.core.events import (
    LOOKING,
    TRANSITIONS,
    Cause,
    Choice,
    Event,
    EventTable,
    OrderEnd,
    State,
    apart,
    applies,
    transition_of,
)
from dva_sim.core.registry import Registry
from dva_sim.core.sessions import Send, Sessions
from dva_sim.protocol import messages as m
from dva_sim.protocol.facts import Fact

ORDER_DONE = "done"  # sent by the DVA to a device with an order: the order is over, stop


@dataclass
class Orders:
    """Orders of the DVA, and the changes of events that follow from them.

    Attributes:
        engaged: Current task of each device.
        counters: Counters by name.
        trail: Trail of decisions.
        emergencies: Robots that cannot be sent, as an emergency holds them.
        unwatched: Devices that answer for others, and whose own moves say nothing.
    """

    rules: Rules
    registry: Registry
    events: EventTable
    sessions: Sessions
    engaged: Assignments = field(default_factory=Assignments)
    counters: Counter[str] = field(default_factory=Counter)
    trail: AuditTrail = field(default_factory=AuditTrail)
    emergencies: Emergencies = field(default_factory=Emergencies)
    unwatched: set[str] = field(default_factory=set)
    _pauses: list[float] = field(default_factory=list)
    # Arrivals reported while the last known position was too far away; see `arrived`.
    _from_afar: set[tuple[str, int]] = field(default_factory=set)  # (device, event number)
    _promises: Promises = field(init=False)

    def __post_init__(self) -> None:
        self._promises = Promises(self.rules)

    # --- given -------------------------------------------------------------------------

    def confirm(
        self, event: Event, responder: str, operator: str | None, now: float, award: bool = False
    ) -> Send:
        """Send somebody to look; an award goes to the bidder, and its operator hears later."""
        self.events.move(event, Cause.ORDERED, now)
        event.responder = responder
        event.operator = operator
        for name in (responder, operator):
            if name is not None:
                self.engaged.begin(name, event)
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
        event.act_taken_up = False
        for step in ("act_departed", "act_arrived"):
            event.times.pop(step, None)
        event.times["act_assigned"] = now
        event.sent.add(guard)
        self.engaged.begin(guard, event)
        self.events.touch(event)
        return self._order_to_act(event)

    def _order_to_act(self, event: Event) -> Send:
        assert event.actor is not None
        task = "contain" if event.state is State.CONFIRMED else "stand_by"
        return Send(event.actor, m.Order(event.number, event.kind, event.position, None, task))

    def redirect(self, event: Event, now: float) -> list[Send]:
        """Withdraw an order whose responder is needed elsewhere; does not count as an attempt."""
        event.preemptions += 1
        event.attempts -= event.taken_up  # counted when the order was taken up
        self.counters["preempted"] += 1
        return self.transition(event, Cause.REDIRECTED, now)

    def again(self) -> list[Send]:
        """Return all current orders, which a restarted DVA repeats."""
        sends = []
        for event in self.events.open.values():
            if event.state in LOOKING and event.responder is not None:
                sends.append(self._order_to_confirm(event))
            if event.actor is not None:
                sends.append(self._order_to_act(event))
        return sends

    # --- taken up, or not --------------------------------------------------------------

    def taken_up(self, send: Send) -> list[Send]:
        """Note that somebody has answered an order or an award with OK."""
        event = self._meant(send)
        if event is None:
            return []
        if isinstance(send.body, m.TaskAward) and send.to == event.responder and event.operator:
            if event.state in LOOKING:
                return [self._order_to_confirm(event)]
            self._release(event)  # settled meanwhile, and its operator has not heard of it
        elif _is_to_act(send.body):
            event.act_taken_up |= send.to == event.actor
            self.events.touch(event)
        elif send.to == event.holder and event.state in LOOKING:
            self._noted_as_taken_up(event)
        return []

    def _meant(self, send: Send) -> Event | None:
        """Return the event of an order that was sent, if its addressee still works on it."""
        body = send.body
        return self.engaged.find(send.to, body.event_id) if isinstance(body, _ORDERS) else None

    def _noted_as_taken_up(self, event: Event) -> None:
        if not event.taken_up:
            # Counted here and not when ordered, so that unanswered orders use up no attempts.
            event.taken_up = True
            event.attempts += 1
            self.events.touch(event)

    def not_taken_up(self, send: Send, now: float) -> list[Send]:
        """Handle an order declined or undelivered; does not count as an attempt."""
        event = self._meant(send)
        to_act = _is_to_act(send.body)
        looks = event is not None and event.state in LOOKING
        if event is not None and looks and not to_act and "departed" in event.times:
            return []  # only the answer was lost
        self._pause(send.to, now)
        if event is None or to_act != (send.to == event.actor):
            return []  # the order is another's by now
        if to_act:
            return self._actor_gone(event, now)
        if looks:
            return self.transition(event, Cause.DECLINED, now)
        self._free(event, event.responder, event.operator)
        return []

    # --- reports of the devices that have them -------------------------------------------

    def has_order(self, event: Event, device: str) -> bool:
        """Return True if a device may report on an order; a robot leaves that to its operator."""
        return self.engaged.is_at(device, event) and device in (event.holder, event.actor)

    def departed(self, event: Event, device: str, now: float) -> None:
        """Note that somebody has set out."""
        if device == event.actor:
            event.act_taken_up = True
            event.times.setdefault("act_departed", now)
        elif event.state is State.ASSIGNED:
            self._noted_as_taken_up(event)
            event.times.setdefault("departed", now)
        self.events.touch(event)

    def arrived(self, event: Event, device: str, now: float) -> None:
        """Note a reported arrival; it counts once the device's known position is near the event."""
        self.departed(event, device, now)
        goes = device if device == event.actor else event.responder
        if goes is None or self._is_near(event, goes):
            self._is_there(event, goes, now)
        else:
            self.counters["said from afar to have arrived"] += 1
            self._from_afar.add((goes, event.number))

    def moved(self, device: str, now: float) -> None:
        """Note a new position, which may confirm an arrival that was reported from afar."""
        for event in self.engaged.all(device) if self._from_afar else ():
            if (device, event.number) in self._from_afar and self._is_near(event, device):
                self._is_there(event, device, now)

    def _was_near(self, event: Event, device: str) -> bool:
        """Return True unless the finding is of an earlier order, carried out by another device.

        A DVA that has lost an order in a crash may have given the same operator another robot.
        """
        arrival_step = "act_arrived" if device == event.actor else "arrived"
        return arrival_step in event.times or self._is_near(event, device)

    def _is_near(self, event: Event, device: str) -> bool:
        within = self.rules.arrived_within
        entry = self.registry.entries.get(device)
        at = None if entry is None else entry.position
        return math.isinf(within) or (at is not None and apart(at, event.position) <= within)

    def _is_there(self, event: Event, device: str | None, now: float) -> None:
        if device is not None and device == event.actor:
            event.times.setdefault("act_arrived", now)
        elif event.state is State.ASSIGNED:
            self.transition(event, Cause.ARRIVED, now)
        if device is not None:
            self._from_afar.discard((device, event.number))
            self.events.touch(event)
            self.registry.locate(self.registry.entries[device], event.position)

    def found(self, event: Event, device: str, finding: str, now: float) -> list[Send]:
        """Handle the finding or result of a device that was sent."""
        if not event.open:
            return []
        goes = device if device == event.actor else event.responder
        if self.has_order(event, device) and (goes is None or self._was_near(event, goes)):
            # A finding implies both steps, whose own reports may have been lost.
            self.departed(event, device, now)
            self._is_there(event, goes, now)
        cause = _FINDINGS.get(finding)
        if cause is None or not applies(cause, event):
            return []  # too late, or too early
        return self.transition(event, cause, now, device)

    def ends(self, event: Event, device: str, state: str, now: float) -> list[Send]:
        """Free somebody; an event that could not be settled is open to others."""
        if state == "declined":
            self._pause(device, now)
        if device == event.actor:
            return self._act_ends(event, device, state != "declined", now)
        if event.state not in LOOKING:
            self._release(event)
            return []
        if event.responder is not None and state != "declined":
            self._noted_as_taken_up(event)
            event.failed.add(event.responder)
        return self.transition(event, Cause.GIVEN_BACK, now)

    def _act_ends(self, event: Event, device: str, tried: bool, now: float) -> list[Send]:
        if not event.open:
            self._free(event, device)
            return []
        if tried:
            event.act_taken_up = True
            event.failed.add(device)
        return self._actor_gone(event, now)

    # --- taken back --------------------------------------------------------------------

    def abandon(self, device: str, now: float) -> list[Send]:
        """Drop a device that has gone: what it was doing is open to others."""
        return [send for e in self.engaged.all(device) for send in self._abandon(e, device, now)]

    def _abandon(self, event: Event, device: str, now: float) -> list[Send]:
        if device == event.actor and event.open:
            return self._actor_gone(event, now)
        if event.state in LOOKING:
            return self.transition(event, Cause.ABANDONED, now)
        self._finished(event, device)
        return []

    def _finished(self, event: Event, device: str) -> None:
        """Free a device whose event was settled before it reported `done`."""
        self._free(event, device)
        if device in (event.responder, event.operator):
            self._release(event)

    def give_up(self, now: float) -> list[Send]:
        """Escalate events that have waited too long, and the newest of too many."""
        most = self.rules.most_waiting
        waiting = self.events.waiting
        late = {n: e for n, e in waiting.items() if self._wait_ends(e) <= now}
        if most is not None and len(waiting) - len(late) > most:
            left = sorted(waiting.keys() - late.keys())
            late |= {number: waiting[number] for number in left[most:]}
        return [
            send for event in late.values() for send in self.transition(event, Cause.WAITED, now)
        ]

    def take_back(self, now: float) -> list[Send]:
        """Take back orders that were not carried out in time, so that others can get them."""
        self._pauses = [until for until in self._pauses if until > now]
        late = [(d.device, d.event, f"did not {d.owes}") for d in self._overdue(now)]
        if math.isfinite(self.rules.order_limit):
            every = self.engaged.pairs()
            late += [
                (d, e, "order took too long") for d, e in every if self._order_ends(d, e) <= now
            ]
        sends: list[Send] = []
        for device, event, why in late:
            if self.engaged.is_at(device, event):  # a robot is free with its operator
                self.counters[why] += 1
                sends += self._take_back(device, event, now)
        return sends

    def _overdue(self, now: float) -> list[Promise]:
        """Return the devices that accepted an order and do not set out, or stopped on the way."""
        if math.isinf(min(self.rules.depart_within, self.rules.still_within)):
            return []
        late = self._promises.overdue(self._owed(), now)
        for promise in late:
            self._pause(promise.device, now)
        return late

    def _owed(self) -> Iterator[Promise]:
        """Yield the step that each device owes now; of several orders, for the first.

        A device with several orders owes no movement: while it deals with one event, the robot
        of another may stand.
        """
        for device in self.engaged:
            event, *other_events = self.engaged.all(device)
            owes = self._owes(device, event)
            if owes == MOVE and (other_events or device in self.unwatched):
                continue
            responder = device if device == event.actor else event.responder
            if owes and responder is not None:
                yield Promise(device, event, owes, self.registry.entries[responder].position)

    @staticmethod
    def _owes(device: str, event: Event) -> str:
        """Return the step owed: none if the device is there, stands by or has not answered yet."""
        if device == event.actor and event.open:
            taken_up = event.act_taken_up
            step = "act_"
            goes = event.state is State.CONFIRMED
        elif device == event.holder and event.state is State.ASSIGNED:
            taken_up = event.taken_up
            step = ""
            goes = True
        else:
            return ""
        if not taken_up or f"{step}arrived" in event.times:
            return ""
        departed = f"{step}departed" in event.times
        return (MOVE if goes else "") if departed else SET_OUT

    def next_deadline(self) -> float:
        """Return when the next order waits, or takes, too long [s]."""
        rules = self.rules
        waiting = self.events.waiting
        # The end of a pause matters only while an event waits for somebody to be free.
        ends = [min(self._pauses, default=math.inf) if waiting else math.inf]
        if math.isfinite(rules.escalate_after):
            ends += (self._wait_ends(e) for e in waiting.values())
        if math.isfinite(rules.order_limit):
            ends += (self._order_ends(d, e) for d, e in self.engaged.pairs())
        return min(*ends, self._promises.next_deadline())

    def _wait_ends(self, event: Event) -> float:
        return event.waiting_since + self.rules.escalate_after

    def _order_ends(self, device: str, event: Event) -> float:
        """Return when an order at a device counts as failed; standing by never does.

        A responder reports `done` soon after its finding; after this time the report was lost.
        """
        times = event.times
        if not event.open:
            begun = times["closed"]
        elif device == event.actor:
            begun = max(times["act_assigned"], times.get("confirmed", math.inf))
        else:
            begun = times.get("assigned" if event.state in LOOKING else "confirmed", math.inf)
        return begun + self.rules.order_limit

    def _take_back(self, device: str, event: Event, now: float) -> list[Send]:
        over = m.OrderProgress(event.number, ORDER_DONE)
        if event.open and device == event.actor:
            return [Send(device, over), *self._act_ends(event, device, True, now)]
        if event.state not in LOOKING:
            self._finished(event, device)  # its report of `done` must have been lost
            return []
        assert event.responder is not None
        event.failed.add(event.responder)
        return self.transition(event, Cause.OVERDUE, now)

    def may_preempt(self, event: Event, now: float) -> bool:
        """Return True if a responder may be recalled: not from a scene, nor past the deadline."""
        return applies(Cause.REDIRECTED, event) and (
            now - event.waiting_since < self.rules.escalate_after
        )

    def taken_away(self, robot: str, now: float) -> list[Send]:
        """Note a robot's new holder: others have to look at what it was sent to."""
        sends: list[Send] = []
        for event in self.engaged.all(robot):
            looks = event.state in LOOKING
            sends += (
                self.transition(event, Cause.TAKEN_AWAY, now) if looks else self._call_off(event)
            )
        return sends

    # --- decided by people -------------------------------------------------------------

    def recall(self, event: Event, device: str, now: float, replaced: bool = False) -> list[Send]:
        """Recall a device from an event; this is neither an attempt nor a failure.

        An event whose actor is replaced at once stays open, however long it has waited.
        """
        if device == event.actor:
            over = Send(device, m.OrderProgress(event.number, ORDER_DONE))
            if event.act_taken_up:
                event.act_taken_up = False
                event.waiting_since = now
            if replaced:
                self._free_actor(event)
                return [over]
            return [over, *self._actor_gone(event, now)]
        event.attempts -= event.taken_up  # counted when the order was taken up
        if event.taken_up:
            event.waiting_since = now
        return self.transition(event, Cause.RECALLED, now)

    # --- what becomes of the event -----------------------------------------------------

    def transition(self, event: Event, cause: Cause, now: float, device: str = "") -> list[Send]:
        """Change the state of an event as `TRANSITIONS` says; return the messages to send.

        Args:
            event: The event.
            cause: Cause of the change.
            now: Time [s].
            device: Device that reported the cause; it need not be told.

        Raises:
            ValueError: the table has no such transition.
        """
        transition = transition_of(event, cause)
        sends = self._end_order(event, transition.order) if event.state in LOOKING else []
        if transition.retries and not self._goes_on(event, event.taken_up, now):
            cause = Cause.EXHAUSTED
        self._log_rule(event, cause, now)
        self.events.move(event, cause, now)
        if event.state is State.CONFIRMED and event.open and event.actor is not None:
            return [*sends, self._order_to_act(event)]
        return sends + self._stand_down(event, device)

    def _end_order(self, event: Event, end: OrderEnd) -> list[Send]:
        """End the active order to look."""
        match end:
            case OrderEnd.FREED:
                self._free(event, event.responder, event.operator)
            case OrderEnd.RELEASED:
                self._release(event)
            case OrderEnd.RECALLED:
                return self._call_off(event)
        return []

    def _call_off(self, event: Event) -> list[Send]:
        """Recall the devices that look at an event, or are still finishing that."""
        holder = event.holder
        self._release(event)
        return [Send(holder, m.OrderProgress(event.number, ORDER_DONE))] if holder else []

    def decided(self, event: Event, fact: Fact) -> None:
        """Note a decision on an event, by whomever."""
        choice = Choice(
            fact.author,
            fact.label,
            fact.action,
            fact.time,
            reason=fact.cause,
            device=self.label_of(fact.device) if fact.device else "",
        )
        event.handling.decide(choice)
        self.events.touch(event)
        self.trail.note(fact)

    def label_of(self, device: str) -> str:
        """Return the label of a device, if it is known."""
        entry = self.registry.entries.get(device)
        return entry.device.label if entry else device

    def _log_rule(self, event: Event, cause: Cause, now: float) -> None:
        """Log a decision of the DVA's own rules."""
        transition = TRANSITIONS[cause]
        if transition.log and self.trail.keeps:
            fact = Fact(
                time=now,
                author=self.sessions.permissions.own,
                label="rule",
                action="expire" if transition.end is State.EXPIRED else "escalate",
                event=event.number,
                cause=transition.log,
                waited=now - event.times["detected"],
            )
            self.decided(event, fact)

    # --- helpers -----------------------------------------------------------------------

    def _pause(self, device: str, now: float) -> None:
        """Bar a device that did not take up an order from new orders for a while."""
        entry = self.registry.entries.get(device)
        until = now + self.rules.declined_pause
        if entry is not None:
            entry.free_from = until
            self._pauses.append(until)

    def _release(self, event: Event) -> None:
        """Release the order to confirm, and with it the right to drive there."""
        if event.operator is not None and event.responder is not None:
            self.sessions.take_back(event.operator, event.responder)
        self._free(event, event.responder, event.operator)

    def _free(self, event: Event, *names: str | None) -> None:
        for name in names:
            if name is not None and self.engaged.end(name, event):
                self._from_afar.discard((name, event.number))
                self.events.touch(event)

    def _goes_on(self, event: Event, taken_up: bool, now: float) -> bool:
        """Return True if an event may wait for another responder after an order failed.

        If nobody took the order up, the event has waited all along: a device that does not answer
        cannot postpone its deadline.
        """
        if not taken_up and now > self._wait_ends(event):
            return False
        if taken_up:
            event.waiting_since = now
        return event.attempts < self.rules.max_attempts

    def _actor_gone(self, event: Event, now: float) -> list[Send]:
        """Replace a device that should have contained an event and did not."""
        taken_up = event.act_taken_up
        self._free_actor(event)
        if event.state is State.CONFIRMED and event.open:
            event.attempts += taken_up
            if not self._goes_on(event, taken_up, now):
                return self.transition(event, Cause.EXHAUSTED, now)
        return []

    def _free_actor(self, event: Event) -> None:
        event.act_taken_up = False
        self._free(event, event.actor)
        event.actor = None
        self.events.touch(event)

    def _stand_down(self, event: Event, but: str) -> list[Send]:
        """Release devices that stood by at, or were to contain, an event that no longer needs them.

        A device also stands down when nobody looks any longer: it may be the next to look.
        """
        actor = event.actor
        needed = event.open and event.state is not State.PENDING
        if actor is None or needed or actor == but:
            return []
        self._free(event, actor)
        event.actor = None
        return [Send(actor, m.OrderProgress(event.number, ORDER_DONE))]


_ORDERS = (m.Order, m.TaskAward)
_FINDINGS = {
    "confirmed": Cause.CONFIRMED,
    "refuted": Cause.REFUTED,
    "contained": Cause.CONTAINED,
}


def _is_to_act(body: m.Body) -> bool:
    """Return True for an order to contain an event, or to stand by."""
    return isinstance(body, m.Order) and body.task != "confirm"
