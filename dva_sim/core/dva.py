"""The DVA: takes each message with the time, returns the reply and what else to send."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import Policy
from dva_sim.core.dispatcher import Dispatcher, Patrols
from dva_sim.core.events import EventBook, State
from dva_sim.core.orders import Orders
from dva_sim.core.permissions import Access
from dva_sim.core.registry import GUARD, OPERATOR, ROBOT, DeviceEntry, Registry
from dva_sim.core.sessions import Send, Sessions
from dva_sim.core.travel_times import SiteKnowledge, Travel
from dva_sim.protocol import messages as m

LIST_BYTES = 7000  # of a device list, the rest of the message apart [B]
DEVICE_BYTES = 175  # of one device without its label, at most [B]
MOST_LISTED = 64

Reaction = tuple[m.Reply, list[Send]]


class Dva:
    """The DVA core.

    Args:
        policy: Advises who goes where.
        travel: How far it is, and how long it takes.
        rules: What holds whatever the policy says.
        rng: Luck of policies that use it.
        sessions: Who may act on what, and who has to be told.
        ground: What is known of the place.
        access: Who may ask for what.
        patrols: Which robots go round while nothing happens.

    Attributes:
        registry: Who is there.
        book: What happens.
        orders: Who has to do what.
        dispatcher: Decides who goes.
        counters: How often what happened.
        refused: Messages that were refused.
    """

    def __init__(
        self,
        policy: Policy,
        travel: Travel,
        rules: Rules,
        *,
        rng: np.random.Generator,
        sessions: Sessions,
        ground: SiteKnowledge | None = None,
        access: Access | None = None,
        patrols: Patrols | None = None,
    ) -> None:
        self.sessions, self.access = sessions, access or Access()
        self.registry, self.book = Registry(), EventBook(rules.merge_distance)
        self.orders = Orders(rules, self.registry, self.book, sessions)
        self.dispatcher = Dispatcher(policy, travel, self.orders, rng, ground or SiteKnowledge())
        self.counters: Counter[str] = self.orders.counters
        self.refused = 0
        self._rules, self._patrols = rules, patrols or Patrols()
        self._list: tuple[int, tuple[m.Device, ...]] = (-1, ())
        self._access_ends = self.access.next_end(-1.0)

    # --- what comes in -----------------------------------------------------------------

    def handle(self, message: m.Message, now: float) -> Reaction:
        """Take a request; the reply goes to the sender, the rest where it says."""
        reply, sends = self._handle(message, now)
        return reply, self._and_revocations(sends)

    def note(self, message: m.Message, now: float) -> None:
        """Take a published message: heartbeat or status; nobody waits for an answer."""
        entry = self.registry.heard(message.source, now)
        if entry is None:
            self.refused += 1
        elif isinstance(message.body, m.RobotStatus):
            self.registry.locate(entry, message.body.position)
            entry.mode = message.body.mode
        elif isinstance(message.body, m.PersonStatus):
            self.registry.locate(entry, message.body.position)

    def delivered(self, send: Send, now: float) -> list[Send]:
        """What was sent was answered with OK."""
        self.sessions.heard(send)
        sends = self._patrols.held(send, self.registry, self.sessions)
        return self._and_revocations(sends + self.orders.taken_up(send))

    def undelivered(self, send: Send, now: float) -> list[Send]:
        """What was sent did not arrive, or was declined: take it back."""
        body, sends = send.body, list[Send]()
        if isinstance(body, m.Order | m.TaskAward):
            sends = self.orders.not_taken_up(send, now)
        elif isinstance(body, m.TaskAnnouncement):
            self.dispatcher.auctions.no_bid(body.event_id, send.to)
            sends = self.dispatcher.decide(now)
        elif isinstance(body, m.Relocation):
            self.dispatcher.situations.forget_move(send.to)
        else:
            self.sessions.undelivered(send)
        return self._and_revocations(sends)

    def tick(self, now: float) -> list[Send]:
        """What time brings: silent devices, deadlines, and another look at who is free."""
        sends: list[Send] = []
        for entry in self.registry.fallen_silent(now):
            sends += self._gone(entry.device.id_tag, now)
        if now >= self._access_ends:
            self.check_access(now)
        sends += self.orders.take_back(now)
        self._forget_the_long_silent(now)
        self.sessions.remind(self._is_there)
        sends += self.dispatcher.decide(now)
        sends += self._patrols.set_out(self.registry, self.sessions, self.orders.engaged, now)
        return self._and_revocations(sends)

    def next_deadline(self) -> float:
        """When `tick` has something to do at the latest, if nothing else happens [s].

        Forgetting can wait.
        """
        return min(
            self.orders.next_deadline(),
            self.dispatcher.auctions.next_deadline(),
            self.registry.next_silence(),
            self._access_ends,
        )

    def go_on(self) -> list[Send]:
        """What to say again after what an earlier life knew was recalled."""
        return self._and_revocations(self.orders.again())

    def close(self) -> list[Send]:
        """The DVA closes: all sessions are over."""
        self.sessions.take_back_everything()
        return self._and_revocations([])

    def _handle(self, message: m.Message, now: float) -> Reaction:
        body, source = message.body, message.source
        if isinstance(body, m.Registration):
            return self._register(message, body, now)
        entry = self.registry.heard(source, now)
        if entry is None:
            text = f"device {source} is not registered"
            return self._refuse(message, m.NOT_REGISTERED, text)
        match body:
            case m.EventReport():
                return self._report(message, body, now)
            case m.OrderProgress():
                return self._progress(message, body, now)
            case m.TaskBid():
                return self._bid(message, body, now)
            case m.PermissionRequest():
                return self._permission(message, entry, body, now)
            case m.PermissionRevocation():
                return self._give_back(message, body)
            case m.GetDeviceList():
                return self._ok(message, [], m.DeviceList(self._shown()))
            case _:
                name = type(body).__name__
                return self._refuse(message, m.NOT_SUPPORTED, f"{name} is not for the DVA")

    def _and_revocations(self, sends: list[Send]) -> list[Send]:
        """What to send, after the word that sessions are over."""
        return self.sessions.to_tell() + sends

    # --- who is there ------------------------------------------------------------------

    def _register(self, message: m.Message, body: m.Registration, now: float) -> Reaction:
        known = self.registry.entries.get(message.source)
        sends: list[Send] = []
        if known is not None and known.device.device_type != body.device_type:
            text = f"{message.source} is registered as {known.device.device_type}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        if known is not None and known.is_new_life(message.message_id, message.timestamp):
            sends = self._gone(message.source, now)  # it knows nothing of what it held
        if known is None and self.registry.is_full:
            sends = self._make_room(now)
        entry = self.registry.register(message.source, body, now)
        if entry is None:
            return self._refuse(message, m.BUSY, "the registry is full")
        entry.registrations.append((message.message_id, message.timestamp))
        return self._ok(message, sends)

    def _gone(self, device: str, now: float) -> list[Send]:
        """A device is there no more: what it held is free, what it did is open to others."""
        self.sessions.take_back_all(device)
        self.dispatcher.situations.forget_move(device)
        return self.orders.abandon(device, now)

    def _is_there(self, device: str) -> bool:
        entry = self.registry.entries.get(device)
        return entry is not None and not entry.silent

    def _forget_the_long_silent(self, now: float) -> None:
        """Those of whom nothing is open; the others last."""
        late = list(self.registry.long_silent(now))
        for device in self._with_nothing_open(late) if late else ():
            self._forget(device)

    def _make_room(self, now: float) -> list[Send]:
        """Forget the longest silent: one of whom nothing is open, if there is such."""
        silent = self.registry.silent
        device = next(chain(self._with_nothing_open(silent), silent), None)
        if device is None:
            return []
        self.counters["forgotten for want of room"] += 1
        sends = self._gone(device, now)
        self._forget(device)
        return sends

    def _with_nothing_open(self, devices: Iterable[str]) -> Iterator[str]:
        kept, engaged = self.sessions.with_something_open(), self.orders.engaged
        return (d for d in devices if d not in kept and d not in engaged)

    def _forget(self, device: str) -> None:
        self.sessions.forget(device)
        self._patrols.forget(device)
        self.registry.forget(device)

    # --- who may do what ---------------------------------------------------------------

    def _permission(
        self, message: m.Message, asker: DeviceEntry, body: m.PermissionRequest, now: float
    ) -> Reaction:
        robot = self.registry.entries.get(body.device)
        if robot is None or robot.device.device_type != ROBOT:
            return self._refuse(message, m.UNKNOWN_DEVICE, f"no robot {body.device}")
        if not self.access.allows(asker.device, robot.device, body.level, now):
            text = f"{asker.device.label} may not have {body.level} of {robot.device.label}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        sensors = self.access.sensors(asker.device, robot.device, body.sensors, now)
        if body.level == "sensors" and body.sensors and not sensors:
            text = f"{asker.device.label} may read none of these of {robot.device.label}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        if body.level != "sensors" and self._serves_another(body.device, message.source):
            return self._refuse(message, m.BUSY, f"robot {body.device} serves another order")
        wish = m.PermissionRequest(body.device, body.level, sensors)
        granted = self.sessions.grant(robot.device, asker.device, wish)
        if granted is None:
            return self._refuse(message, m.BUSY, f"robot {body.device} is held by another")
        content, sends = granted
        return self._ok(message, sends, content)

    def _serves_another(self, robot: str, asker: str) -> bool:
        engaged = self.orders.engaged
        return any(not engaged.is_at(asker, event) for event in engaged.all(robot))

    def _give_back(self, message: m.Message, body: m.PermissionRevocation) -> Reaction:
        """A holder needs its permission no longer; only its own."""
        if body.holder != message.source or not self.sessions.give_back(body):
            return self._refuse(message, m.BAD_SESSION, "that session is not yours, or is over")
        return self._ok(message, [])

    def check_access(self, now: float) -> None:
        """Permissions in use end with the rule that allowed them."""
        entries = self.registry.entries
        for grant in self.sessions.permissions.all():
            holder, robot = entries.get(grant.holder), entries.get(grant.robot)
            if holder is None or robot is None:
                continue
            kept = self.access.sensors(holder.device, robot.device, grant.sensors, now)
            allowed = self.access.allows(holder.device, robot.device, grant.level, now)
            if not allowed or kept != grant.sensors:
                self.counters["permission revoked"] += 1
                self.sessions.revoke(grant)
        self._access_ends = self.access.next_end(now)

    # --- what happens ------------------------------------------------------------------

    def _report(self, message: m.Message, body: m.EventReport, now: float) -> Reaction:
        if body.event_id is None:
            return self._sighting(message, body, now)
        event = self.book.get(body.event_id)
        if event is None:
            return self._refuse(message, m.UNKNOWN_EVENT, f"no event {body.event_id}")
        if message.source not in event.sent:
            return self._refuse(message, m.NOT_PERMITTED, f"was not sent to event {event.number}")
        sends = self.orders.found(event, message.source, body.finding, now)
        if event.waits_for is not None:
            sends = sends + self.dispatcher.decide(now)
        return self._ok(message, sends)

    def _sighting(self, message: m.Message, body: m.EventReport, now: float) -> Reaction:
        """Somebody who was not sent sees something, or sees it no longer."""
        if body.finding == "refuted":
            return self._withdrawal(message, body, now)
        event = self.book.near(body.kind, body.position)
        if event is None and self.book.full:
            return self._refuse(message, m.BUSY, "so many events are open that no more fit")
        if event is None:
            contain = self._rules.containment
            event = self.book.add(body.kind, body.position, body.severity, now, contain)
        else:
            self.book.merge(event, body.severity)
        self.book.note_source(event, message.source, body.confidence)
        return self._ok(message, self.dispatcher.decide(now))

    def _withdrawal(self, message: m.Message, body: m.EventReport, now: float) -> Reaction:
        """What all who reported it have taken back, before anybody was sent, is over."""
        source, sends = message.source, list[Send]()
        for event in self.book.reported_by(source, body.kind, body.position):
            self.book.take_back(event, source)
            if event.state is State.PENDING and not event.sources:
                sends += self.orders.expire(event, now)
        return self._ok(message, sends)

    def _progress(self, message: m.Message, body: m.OrderProgress, now: float) -> Reaction:
        event = self.orders.engaged.find(message.source, body.event_id)
        if event is None or not self.orders.has_order(event, message.source):
            text = f"device {message.source} has no order for event {body.event_id}"
            return self._refuse(message, m.UNKNOWN_EVENT, text)
        sends: list[Send] = []
        if body.state == "departed":
            self.orders.departed(event, message.source, now)
        elif body.state == "arrived":
            self.orders.arrived(event, message.source, now)
        elif body.state in ("done", "failed", "declined"):
            sends = self.orders.ends(event, message.source, body.state, now)
            sends += self.dispatcher.decide(now)
        return self._ok(message, sends)

    def _bid(self, message: m.Message, body: m.TaskBid, now: float) -> Reaction:
        auctions = self.dispatcher.auctions
        if not auctions.bid(body.event_id, message.source, body.arrival_in, now):
            text = f"no bid was asked for on event {body.event_id}, or it comes too late"
            return self._refuse(message, m.UNKNOWN_EVENT, text)
        return self._ok(message, self.dispatcher.decide(now))

    # --- answers -----------------------------------------------------------------------

    def _shown(self) -> tuple[m.Device, ...]:
        """Devices one can do something with, robots first, as many as fit into a message."""
        version, shown = self._list
        if version != self.registry.version:
            shown = self._as_many_as_fit()
            self._list = self.registry.version, shown
        return shown

    def _as_many_as_fit(self) -> tuple[m.Device, ...]:
        shown: list[m.Device] = []
        room = LIST_BYTES
        for device in self._listed():
            room -= DEVICE_BYTES + len(device.label.encode()) + 4 * _escaped(device.label)
            if room < 0 or len(shown) == MOST_LISTED:
                break
            shown.append(device)
        return tuple(shown)

    def _listed(self) -> Iterable[m.Device]:
        for device_type in (ROBOT, OPERATOR, GUARD):
            for entry in self.registry.of_type(device_type):
                yield entry.device

    @staticmethod
    def _ok(
        message: m.Message,
        sends: list[Send],
        content: m.DeviceList | m.Permission | None = None,
    ) -> Reaction:
        return m.Reply(message.message_id, m.OK, "", content), sends

    def _refuse(self, message: m.Message, code: int, text: str) -> Reaction:
        self.refused += 1
        return m.Reply(message.message_id, code, text), []


def _escaped(text: str) -> int:
    """How many characters take more room in XML, up to four bytes each."""
    return sum(text.count(sign) for sign in "&<>")
