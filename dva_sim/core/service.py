"""The DVA's desk: takes each message with the time, returns the reply and what else to send."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.dispatch import Policy, Responder, Situation
from dva_sim.core.events import Event, EventBook, State
from dva_sim.core.registry import GUARD, OPERATOR, ROBOT, Entry, Registry
from dva_sim.core.send import Send
from dva_sim.core.sessions import Sessions
from dva_sim.protocol import messages as m

LIST_BYTES = 7000  # of a device list, the rest of the message apart [B]
DEVICE_BYTES = 175  # of one device without its label, at most [B]
CONSIDERED = 200  # oldest pending events that one decision looks at
MOST_EVENTS = 10_000
DECLINED_PAUSE = 10.0  # who declines an order, or is not reached, is not asked again for [s]
MAX_ATTEMPTS = 4  # orders given for one event before it is escalated


@dataclass(frozen=True)
class Pace:
    """What the DVA expects of a kind of responder: travel speed [m/s], mobilisation [s]."""

    speed: float
    mobilisation: float


@dataclass
class Desk:
    """The DVA core.

    Attributes:
        policy: Advises who goes where.
        distance: Path length between two positions [m]; infinite if there is no way.
        paces: Expected pace of `guard` and `robot`.
        escalate_after: An event that is left without a responder for so long is escalated [s].
        rng: Luck of policies that use it.
        sessions: Who may act on what, and who has to be told.
    """

    policy: Policy
    distance: Callable[[m.Position, m.Position], float]
    paces: dict[str, Pace]
    escalate_after: float
    rng: np.random.Generator
    sessions: Sessions
    registry: Registry = field(default_factory=Registry)
    book: EventBook = field(default_factory=EventBook)
    refused: int = 0

    def handle(self, message: m.Message, now: float) -> tuple[m.Reply, list[Send]]:
        """Take a request; the reply goes to the sender, the rest where it says."""
        reply, sends = self._handle(message, now)
        return reply, self._and_revocations(sends)

    def _handle(self, message: m.Message, now: float) -> tuple[m.Reply, list[Send]]:
        body, source = message.body, message.source
        if isinstance(body, m.Registration):
            return self._register(message, body, now)
        entry = self.registry.heard(source, now)
        if entry is None:
            text = f"device {source} is not registered"
            return self._refuse(message, m.NOT_REGISTERED, text)
        match body:
            case m.PermissionRequest():
                return self._permission(message, body)
            case m.PermissionRevocation():
                return self._give_back(message, body)
            case m.EventReport():
                return self._report(message, body, now)
            case m.OrderProgress():
                return self._progress(message, entry, body, now)
            case m.GetDeviceList():
                return self._device_list(message)
            case _:
                name = type(body).__name__
                return self._refuse(message, m.NOT_SUPPORTED, f"{name} is not for the DVA")

    def note(self, message: m.Message, now: float) -> None:
        """Take a published message: heartbeat or status; nobody waits for an answer."""
        entry = self.registry.heard(message.source, now)
        if entry is None:
            self.refused += 1
        elif isinstance(message.body, m.RobotStatus):
            entry.position, entry.mode = message.body.position, message.body.mode
        elif isinstance(message.body, m.PersonStatus):
            entry.position = message.body.position

    def tick(self, now: float) -> list[Send]:
        """What time brings: silent devices, deadlines, and another look at who is free."""
        for entry in self.registry.fallen_silent(now):
            self._abandon(entry.device.id_tag, now)
        for event in list(self.book.in_state(State.PENDING)):
            if now - event.pending_since >= self.escalate_after:
                self.book.move(event, State.ESCALATED, now)
        self.sessions.remind()
        return self._and_revocations(self._assign(now))

    def undelivered(self, send: Send, now: float) -> list[Send]:
        """What was sent did not arrive or was declined: take it back.

        Nobody set out, so it does not count as an attempt on the event.
        """
        if isinstance(send.body, m.Order):
            event = self.book.events[send.body.event_id]
            self.registry.entries[send.to].free_from = now + DECLINED_PAUSE
            if self._holder(event) != send.to:
                return self._and_revocations([])  # the order is another's by now
            self._release_order(event)
            if event.state in (State.ASSIGNED, State.ON_SCENE):
                event.attempts -= 1
                self._reopen(event, now)
        else:
            self.sessions.undelivered(send)
        return self._and_revocations([])

    def close(self) -> list[Send]:
        """The desk closes: all sessions are over."""
        self.sessions.take_back_everything()
        return self._and_revocations([])

    def _and_revocations(self, sends: list[Send]) -> list[Send]:
        """What to send, after the word that sessions are over."""
        return self.sessions.to_tell() + sends

    def _register(
        self, message: m.Message, body: m.Registration, now: float
    ) -> tuple[m.Reply, list[Send]]:
        known = self.registry.entries.get(message.source)
        if known is not None and known.device.device_type != body.device_type:
            text = f"{message.source} is registered as {known.device.device_type}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        if known is not None and known.is_new_life(message.message_id, message.timestamp):
            self._abandon(message.source, now)  # it knows nothing of what it held
        entry = self.registry.register(message.source, body, now)
        if entry is None:
            return self._refuse(message, m.BUSY, "the registry is full")
        entry.registrations.append((message.message_id, message.timestamp))
        return m.Reply(message.message_id, m.OK, ""), []

    def _permission(
        self, message: m.Message, body: m.PermissionRequest
    ) -> tuple[m.Reply, list[Send]]:
        robot = self.registry.entries.get(body.device)
        if robot is None or robot.device.device_type != ROBOT:
            return self._refuse(message, m.UNKNOWN_DEVICE, f"no robot {body.device}")
        asker = self.registry.entries[message.source]
        if body.level == "sensors":
            return self._grant(message, robot, body)
        if asker.device.device_type != OPERATOR:
            return self._refuse(message, m.NOT_PERMITTED, "only operators drive robots")
        if robot.order is not None and robot.order != asker.order:
            return self._refuse(message, m.BUSY, f"robot {body.device} serves another order")
        return self._grant(message, robot, body)

    def _grant(
        self, message: m.Message, robot: Entry, body: m.PermissionRequest
    ) -> tuple[m.Reply, list[Send]]:
        """Introduce holder and robot to each other: each is told the other's address."""
        holder = self.registry.entries[message.source].device
        granted = self.sessions.grant(robot.device, holder, body)
        if granted is None:
            return self._refuse(message, m.BUSY, f"robot {body.device} is held by another")
        content, sends = granted
        return m.Reply(message.message_id, m.OK, "", content), sends

    def _give_back(
        self, message: m.Message, body: m.PermissionRevocation
    ) -> tuple[m.Reply, list[Send]]:
        """A holder needs its permission no longer; only its own."""
        if body.holder != message.source or not self.sessions.give_back(body):
            return self._refuse(message, m.BAD_SESSION, "that session is not yours, or is over")
        return m.Reply(message.message_id, m.OK, ""), []

    def _report(
        self, message: m.Message, body: m.EventReport, now: float
    ) -> tuple[m.Reply, list[Send]]:
        if body.event_id is None:
            if len(self.book.events) >= MOST_EVENTS:
                return self._refuse(message, m.BUSY, f"{MOST_EVENTS} events are all that fit")
            self.book.report(body.kind, body.position, body.severity, now)
            return m.Reply(message.message_id, m.OK, ""), self._assign(now)
        event = self.book.events.get(body.event_id)
        if event is None:
            return self._refuse(message, m.UNKNOWN_EVENT, f"no event {body.event_id}")
        if message.source not in event.sent:
            return self._refuse(message, m.NOT_PERMITTED, f"was not sent to event {event.number}")
        if self._holder(event) == message.source:
            self._arrived(event, now)
        if event.open and body.finding == "confirmed":
            self.book.move(event, State.CONFIRMED, now)
        elif body.finding == "refuted" and event.state is State.ON_SCENE:
            self.book.move(event, State.REFUTED, now)
        return m.Reply(message.message_id, m.OK, ""), []

    def _progress(
        self, message: m.Message, entry: Entry, body: m.OrderProgress, now: float
    ) -> tuple[m.Reply, list[Send]]:
        event = self.book.events.get(body.event_id)
        if event is None or entry.order != body.event_id:
            text = f"device {message.source} has no order for event {body.event_id}"
            return self._refuse(message, m.UNKNOWN_EVENT, text)
        send: list[Send] = []
        if body.state == "departed":
            event.times.setdefault("departed", now)
        elif body.state == "arrived" and event.open:
            self._arrived(event, now)
        elif body.state in ("done", "failed", "declined"):
            send = self._order_ends(event, entry, body.state, now)
        return m.Reply(message.message_id, m.OK, ""), send

    @staticmethod
    def _holder(event: Event) -> str | None:
        """Who was given the order for an event: the operator of a robot, or a guard."""
        return event.operator or event.responder

    def _arrived(self, event: Event, now: float) -> None:
        if event.state is State.ASSIGNED:
            event.times.setdefault("departed", now)
            event.times["arrived"] = now
            self.book.move(event, State.ON_SCENE, now)
        if event.responder is not None:
            self.registry.entries[event.responder].position = event.position

    def _order_ends(self, event: Event, entry: Entry, state: str, now: float) -> list[Send]:
        """The responder is free again; an event it could not settle is open to others."""
        self._release(entry.device.id_tag, event)
        if state != "done" and event.state in (State.ASSIGNED, State.ON_SCENE):
            if event.responder is not None:
                event.failed.add(event.responder)
            self._reopen(event, now)
        return self._assign(now)

    def _release(self, device: str, event: Event) -> None:
        """The order for an event is over, and with it the right to drive to it."""
        if event.responder is not None:
            self.sessions.take_back(device, event.responder)
        self._release_order(event)

    def _release_order(self, event: Event) -> None:
        for name in (event.responder, event.operator):
            if name is not None and self.registry.entries[name].order == event.number:
                self.registry.entries[name].order = None

    def _reopen(self, event: Event, now: float) -> None:
        out_of_tries = event.attempts >= MAX_ATTEMPTS
        self.book.move(event, State.ESCALATED if out_of_tries else State.PENDING, now)

    def _abandon(self, device: str, now: float) -> None:
        """A device is gone: what it held is free, what it was doing is open to others."""
        self.sessions.take_back_all(device)
        for event in self.book.in_state(State.ASSIGNED, State.ON_SCENE):
            if device in (event.responder, event.operator):
                self._release(event.operator or device, event)
                self._reopen(event, now)
                return

    def _assign(self, now: float) -> list[Send]:
        """Ask the policy, keep what the rules allow, and give the orders."""
        pending = tuple(islice(self.book.in_state(State.PENDING), CONSIDERED))
        operators = self._free(OPERATOR, now)
        responders = self._idle_responders(bool(operators), now)
        if not pending or not responders:
            return []
        situation = self._situation(pending, responders)
        orders: list[Send] = []
        taken: set[str] = set()
        for choice in self.policy.assign(situation, self.rng):
            if not (0 <= choice.event < len(pending) and 0 <= choice.responder < len(responders)):
                continue
            event, responder = pending[choice.event], responders[choice.responder]
            if event.state is not State.PENDING or responder.device in taken:
                continue
            if responder.kind == "robot" and not operators:
                continue
            taken.add(responder.device)
            operator = operators.pop(0).device.id_tag if responder.kind == "robot" else None
            orders.append(self._order(event, responder.device, operator, now))
        return orders

    def _order(self, event: Event, responder: str, operator: str | None, now: float) -> Send:
        self.book.move(event, State.ASSIGNED, now)
        event.responder, event.operator = responder, operator
        event.sent.add(operator or responder)
        self.registry.entries[responder].order = event.number
        body = m.Order(event.number, event.kind, event.position, responder if operator else None)
        if operator is None:
            return Send(responder, body)
        self.registry.entries[operator].order = event.number
        return Send(operator, body)

    def _idle_responders(self, operator_free: bool, now: float) -> tuple[Responder, ...]:
        placed = [e for kind in (GUARD, ROBOT) for e in self._free(kind, now) if e.position]
        kinds = {GUARD: "guard", ROBOT: "robot"}
        return tuple(
            Responder(e.device.id_tag, kinds[e.device.device_type])
            for e in placed
            if operator_free or e.device.device_type == GUARD
        )

    def _free(self, device_type: str, now: float) -> list[Entry]:
        """Devices of a type that may be given an order."""
        entries = self.registry.of_type(device_type)
        held = self.sessions.permissions.grants
        return [
            e
            for e in entries
            if e.order is None and e.free_from <= now and e.device.id_tag not in held
        ]

    def _situation(
        self, pending: tuple[Event, ...], responders: tuple[Responder, ...]
    ) -> Situation:
        distance = np.full((len(pending), len(responders)), np.inf)
        eta = distance.copy()
        for column, responder in enumerate(responders):
            where = self.registry.entries[responder.device].position
            pace = self.paces[responder.kind]
            for row, event in enumerate(pending):
                assert where is not None
                distance[row, column] = self.distance(where, event.position)
                eta[row, column] = pace.mobilisation + distance[row, column] / pace.speed
        for row, event in enumerate(pending):
            _leave_out_who_failed(event, responders, distance[row], eta[row])
        return Situation(pending, responders, distance, eta)

    def _device_list(self, message: m.Message) -> tuple[m.Reply, list[Send]]:
        return m.Reply(message.message_id, m.OK, "", m.DeviceList(self._shown())), []

    def _shown(self) -> tuple[m.Device, ...]:
        """Devices one can do something with, robots first, as many as fit into a message."""
        known = [e for e in self.registry.entries.values() if not e.silent]
        shown: list[m.Device] = []
        room = LIST_BYTES
        for device_type in (ROBOT, OPERATOR, GUARD):
            for device in (e.device for e in known if e.device.device_type == device_type):
                room -= DEVICE_BYTES + len(device.label.encode()) + 4 * _escaped(device.label)
                if room < 0 or len(shown) == 64:
                    return tuple(shown)
                shown.append(device)
        return tuple(shown)

    def _refuse(self, message: m.Message, code: int, text: str) -> tuple[m.Reply, list[Send]]:
        self.refused += 1
        return m.Reply(message.message_id, code, text), []


def _escaped(text: str) -> int:
    """How many characters take more room in XML, up to four bytes each."""
    return sum(text.count(sign) for sign in "&<>")


def _leave_out_who_failed(
    event: Event,
    responders: tuple[Responder, ...],
    distance: NDArray[np.float64],
    eta: NDArray[np.float64],
) -> None:
    """A responder that gave an event back goes again only if nobody else can."""
    failed = np.array([r.device in event.failed for r in responders])
    if np.isfinite(distance[~failed]).any():
        distance[failed] = eta[failed] = np.inf
