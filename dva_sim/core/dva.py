"""The DVA: takes each message with the time, returns the reply and what else to send."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np

from dva_sim.core.assignments import Rules
from dva_sim.core.audit import Fact
from dva_sim.core.control_rooms import ControlRooms
from dva_sim.core.device_list import DeviceLister
from dva_sim.core.dispatch import Policy
from dva_sim.core.dispatcher import Dispatcher, Patrols
from dva_sim.core.event_status import by_whom
from dva_sim.core.events import Event, EventTable, State, apart
from dva_sim.core.handovers import Handovers
from dva_sim.core.orders import Orders
from dva_sim.core.permissions import Access
from dva_sim.core.registry import (
    CONTROL_ROOM,
    ROBOT,
    DeviceEntry,
    Registry,
)
from dva_sim.core.roles import ControlRoomRole, Roles
from dva_sim.core.sensing import CONFIDENCE, SEVERITY, Sensing, is_no_news, only_felt, within_reach
from dva_sim.core.sessions import Send, Sessions
from dva_sim.core.travel_times import SiteKnowledge, Travel
from dva_sim.protocol import messages as m
from dva_sim.protocol.control_room import ControlRoomBody

Reaction = tuple[m.Reply, list[Send]]
FOUND_WITHIN = 20.0  # of its event a finding has to be [m]


class Dva:
    """The DVA core.

    Args:
        policy: Advises who goes where.
        travel: Travel times and distances.
        rules: Rules that hold for any policy.
        rng: Random generator passed to policies.
        sessions: Permissions, and pending notices about their end.
        ground: Knowledge of the site.
        access: Rules of access to robots.
        patrols: Patrols of idle robots.
        sensing: Robot sensors that the DVA uses.
        supervisors: Ids of the operators that may take a robot from its holder.
        roles: Roles of the control rooms.
        ask_first: True if the policy asks a person before it sends anybody.
        policy_name: Name of the policy.
        audit: True to keep facts about decisions.
        release: Rule after an emergency: `person` or `drive`; None: a person if one who may is
            registered, else a new start by its driver.

    Attributes:
        registry: Registered devices.
        events: Events.
        orders: Current orders.
        emergencies: Robots that an emergency holds.
        dispatcher: Dispatcher that chooses responders.
        control_rooms: Answers those where people decide.
        trail: Decisions, to be taken by a recorder.
        counters: Counters by name.
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
        sensing: Sensing | None = None,
        supervisors: frozenset[str] = frozenset(),
        roles: Roles | None = None,
        ask_first: bool = False,
        policy_name: str = "",
        audit: bool = True,
        release: m.ReleasedBy | None = None,
    ) -> None:
        self.sessions, self.access = sessions, access or Access()
        self.registry, self.events = Registry(), EventTable(rules.merge_distance)
        self.orders = Orders(rules, self.registry, self.events, sessions)
        self.trail, self.roles = self.orders.trail, roles or Roles()
        self.emergencies = self.orders.emergencies
        self._release_rule = release
        self.trail.keeps = audit
        self.dispatcher = Dispatcher(
            policy=policy,
            travel=travel,
            orders=self.orders,
            rng=rng,
            ground=ground or SiteKnowledge(),
            roles=self.roles,
            name=policy_name,
        )
        self.dispatcher.questions.asks = ask_first
        self.sensing = sensing or Sensing()
        self.handovers = Handovers(self.orders, supervisors)
        self.control_rooms = ControlRooms(self.dispatcher, self.handovers, self.roles, self.access)
        self.counters: Counter[str] = self.orders.counters
        self.refused = 0
        self._rules, self._patrols = rules, patrols or Patrols()
        self._devices = DeviceLister(self.registry)
        self._access_ends = self.access.next_end(-1.0)

    # --- what comes in -----------------------------------------------------------------

    def handle(self, message: m.Message, now: float) -> Reaction:
        """Take a request; the reply goes to the sender, the rest where it says."""
        reply, sends = self._handle(message, now)
        return reply, self._and_revocations(sends)

    def note(self, message: m.Message, now: float) -> list[Send]:
        """Take a published message; nobody waits for an answer, but it may be one to act on."""
        entry, body = self.registry.heard(message.source, now), message.body
        if entry is None:
            self.refused += 1
            return []
        self.registry.is_there(entry, now)
        if isinstance(body, m.RobotStatus):
            self.registry.locate(entry, body.position)
            entry.mode = body.mode
            self.orders.moved(message.source, now)
            self.handovers.seen(message.source, body, now)
        elif isinstance(body, m.PersonStatus):
            self.registry.locate(entry, body.position)
            self.orders.moved(message.source, now)
        elif isinstance(body, m.SensorValue) and entry.position is not None:
            return self._and_revocations(self._felt(message, body, entry.position, now))
        return []

    def delivered(self, send: Send, now: float, content: object = None) -> list[Send]:
        """Handle the reply OK to a message, with its content."""
        self.sessions.heard(send)
        body, sends = send.body, self._patrols.held(send, self.registry, self.sessions)
        if isinstance(body, m.GetSensorInfo):
            self.sensing.on_reply(send.to, content, now)
            sends = self.sensing.renew(self.registry, self.sessions, now)
        elif isinstance(body, m.HandoverRequest):
            sends = self.handovers.answered(send, True, now) + self.dispatcher.decide(now)
        elif isinstance(body, m.PermissionGrant) and body.holder == self.sessions.permissions.own:
            sends += self.sensing.permitted(send) if body.level == "sensors" else []
        return self._and_revocations(sends + self.orders.taken_up(send))

    def refused_grant(self, send: Send, reply: m.Reply, now: float) -> list[Send]:
        """A robot did not take a grant; it may have said which session would do."""
        floor = reply.content
        if reply.code == m.BAD_SESSION and isinstance(floor, m.SessionFloor):
            again = self.sessions.above(send, floor.session)
            if again is not None:
                self.counters["granted again above"] += 1
                return self._and_revocations([again])
        return self.undelivered(send, now)

    def undelivered(self, send: Send, now: float) -> list[Send]:
        """Handle a message that did not arrive, or was declined: take it back."""
        body, sends = send.body, list[Send]()
        if isinstance(body, m.Order | m.TaskAward):
            sends = self.orders.not_taken_up(send, now)
        elif isinstance(body, m.TaskAnnouncement):
            self.dispatcher.auctions.no_bid(body.event_id, send.to)
            sends = self.dispatcher.decide(now)
        elif isinstance(body, m.Relocation):
            self.dispatcher.situations.forget_move(send.to)
        elif isinstance(body, m.GetSensorInfo):
            self.sensing.on_reply(send.to, None, now)
        elif isinstance(body, m.DevSub):
            self.sessions.permissions.end(send.session)  # it may have restarted
        elif isinstance(body, m.HandoverRequest):
            sends = self.handovers.answered(send, False, now)
        elif isinstance(body, m.Emergency):
            sends = [send] if self.emergencies.holds(send.to) and self._is_there(send.to) else []
        else:
            self.sessions.undelivered(send)
        return self._and_revocations(sends)

    def tick(self, now: float) -> list[Send]:
        """Handle the passing of time: silent devices, deadlines, newly free responders."""
        sends: list[Send] = []
        for entry in self.registry.fallen_silent(now):
            sends += self._gone(entry.device.id_tag, now)
        if now >= self._access_ends:
            self.check_access(now)
        sends += self.orders.take_back(now)
        self._forget_the_long_silent(now)
        self.sessions.remind(self._is_there)
        self.handovers.lapse(now)
        sends += self.sensing.renew(self.registry, self.sessions, now)
        sends += self.dispatcher.decide(now)
        sends += self._patrols.set_out(self.orders, now)
        self.emergencies.lapse(now, lambda robot: self.registry.entries[robot].last_heard)
        return self._and_revocations(sends)

    def next_deadline(self) -> float:
        """Return the latest time at which `tick` has work, if nothing else happens [s].

        Forgetting can wait.
        """
        return min(
            self.orders.next_deadline(),
            self.dispatcher.next_deadline(),
            self.registry.next_silence(),
            self._access_ends,
            self.sensing.next_due(),
            self.handovers.next_deadline(),
        )

    def go_on(self) -> list[Send]:
        """Return the messages to repeat after a restart."""
        return self._and_revocations(self.orders.again())

    def dismiss(self, device: str, now: float) -> list[Send]:
        """A device is to be there no more: what it held is free, and it is forgotten at once."""
        if device not in self.registry.entries:
            return []
        sends = self._gone(device, now)
        self._forget(device)
        return self._and_revocations(sends)

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
                return self._report(message, entry, body, now)
            case m.OrderProgress():
                return self._progress(message, body, now)
            case m.TaskBid():
                return self._bid(message, body, now)
            case m.PermissionRequest():
                return self._permission(message, entry, body, now)
            case m.PermissionRevocation():
                return self._give_back(message, entry, body, now)
            case m.GetGrant():
                return self._grant_of(message, entry, body)
            case m.RobotEmergency():
                return self._emergency(message, entry, body, now)
            case m.GetDeviceList():
                return self._ok(message, [], self._devices.listed())
            case m.GetSensorInfo():
                return self._sensors(message, body)
            case _ if isinstance(body, ControlRoomBody):
                return self._dispatch(message, entry, body, now)
            case _:
                name = type(body).__name__
                return self._refuse(message, m.NOT_SUPPORTED, f"{name} is not for the DVA")

    def _dispatch(
        self, message: m.Message, entry: DeviceEntry, body: ControlRoomBody, now: float
    ) -> Reaction:
        """Handle a request or decision of a control room."""
        answer = self.control_rooms.answer(body, entry.device, now)
        self.refused += answer.code != m.OK
        text = answer.text[:256]
        return m.Reply(message.message_id, answer.code, text, answer.content), list(answer.sends)

    def _and_revocations(self, sends: list[Send]) -> list[Send]:
        """Return the messages, preceded by revocations of ended sessions."""
        return self.sessions.to_tell() + sends

    # --- who is there ------------------------------------------------------------------

    def _register(self, message: m.Message, body: m.Registration, now: float) -> Reaction:
        known = self.registry.entries.get(message.source)
        sends: list[Send] = []
        if known is not None and known.device.device_type != body.device_type:
            text = f"{message.source} is registered as {known.device.device_type}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        if known is not None and self.registry.is_elsewhere(message.source, body.address, now):
            self.counters["registration of an id in use"] += 1
            text = (
                f"{known.device.label} is heard at {known.device.address} under this id; use "
                "another id, or wait until that device has been silent for "
                f"{self.registry.silent_after:g} s"
            )
            return self._refuse(message, m.BUSY, text)
        if known is not None and known.is_new_life(message.message_id, message.timestamp):
            sends = self._gone(message.source, now)  # it knows nothing of what it held
            if self.emergencies.holds(message.source):
                sends.append(Send(message.source, m.Emergency()))  # nor that it is stopped
            self.sessions.forget(message.source)  # nor which orders of a session it has obeyed
        if known is not None and known.device.address != body.address:
            self.sessions.forget(message.source)  # its holder has to ask for the new address
        if known is None and self.registry.is_full:
            sends = self._make_room(now)
        entry = self.registry.register(message.source, body, now)
        if entry is None:
            return self._refuse(message, m.BUSY, "the registry is full")
        entry.registrations.append((message.message_id, message.timestamp))
        if body.device_type == ROBOT:
            sends = sends + self.sensing.met(message.source)
        return self._ok(message, sends)

    def _gone(self, device: str, now: float) -> list[Send]:
        """A device is there no more: what it held is free, what it did is open to others."""
        self.sessions.take_back_all(device)
        self.sensing.forget(device)
        self.sessions.permissions.forget(self.sessions.permissions.own, device)
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
        kept, engaged = self.with_something_open(), self.orders.engaged
        return (d for d in devices if d not in kept and d not in engaged)

    def with_something_open(self) -> set[str]:
        """Return the robots that the DVA must not forget: held, to be told, or stopped."""
        return self.sessions.with_something_open() | self.emergencies.stopped().keys()

    def _forget(self, device: str) -> None:
        self.sessions.forget(device)
        self._patrols.forget(device)
        self.emergencies.forget(device)
        self.registry.forget(device)

    # --- who may do what ---------------------------------------------------------------

    def _permission(
        self, message: m.Message, asker: DeviceEntry, body: m.PermissionRequest, now: float
    ) -> Reaction:
        reply, sends = self._permitted(message, asker, body, now)
        in_use = body.takeover == "force" or asker.device.device_type == CONTROL_ROOM
        if in_use and body.level != "sensors":
            self.control_rooms.asked_for_robot(asker.device, body, reply, now)
        return reply, sends

    def _permitted(
        self, message: m.Message, asker: DeviceEntry, body: m.PermissionRequest, now: float
    ) -> Reaction:
        robot = self.registry.entries.get(body.device)
        if robot is None or robot.device.device_type != ROBOT:
            return self._refuse(message, m.UNKNOWN_DEVICE, f"no robot {body.device}")
        if asker.device.device_type == CONTROL_ROOM and body.level != "sensors":
            need = ControlRoomRole.DRIVE
            if (text := self.control_rooms.may(asker.device, need, "take a robot")) is not None:
                return self._refuse(message, m.NOT_PERMITTED, text)
        if not self.access.allows(asker.device, robot.device, body.level, now):
            text = f"{asker.device.label} may not have {body.level} of {robot.device.label}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        sensors = self.access.sensors(asker.device, robot.device, body.sensors, now)
        if body.level == "sensors" and body.sensors and not sensors:
            text = f"{asker.device.label} may read none of these of {robot.device.label}"
            return self._refuse(message, m.NOT_PERMITTED, text)
        if body.level != "sensors":
            holder = self.handovers.holder(body.device, message.source, now)
            if holder is not None:
                return self._held(message, asker.device, body, holder, now)
            if wait := self.handovers.waits(body.device, message.source):
                return self._refuse(message, m.BUSY, wait)
        wish = m.PermissionRequest(body.device, body.level, sensors)
        granted = self.sessions.grant(robot.device, asker.device, wish)
        if granted is None:
            return self._refuse(message, m.BUSY, f"robot {body.device} is held by another")
        content, sends = granted
        if body.level != "sensors":
            self.handovers.granted(body.device, content.session, now)
        return self._ok(message, sends, content)

    def _held(
        self,
        message: m.Message,
        asker: m.Device,
        body: m.PermissionRequest,
        holder: m.Holder,
        now: float,
    ) -> Reaction:
        """Refuse a robot that is taken: name its driver, and accept a request for handover."""
        if body.takeover == "force" and not self._may_force(asker):
            text = f"{asker.label} is no supervisor"
            return self._refuse(message, m.NOT_PERMITTED, text)
        step, sends = self.handovers.wish(body, asker, holder, now)
        text = f"held by {holder.label} for {holder.held_for:.0f} s" + (step and f"; {step}")
        content = holder if body.takeover is not None else None  # 1.3 does not know it
        sends = sends + self.dispatcher.decide(now) if body.takeover == "force" else sends
        self.refused += 1
        return m.Reply(message.message_id, m.BUSY, text, content), sends

    def _may_force(self, asker: m.Device) -> bool:
        """Return True if a device may take a robot from its holder."""
        if asker.device_type == CONTROL_ROOM:
            return self.roles.of(asker.id_tag).includes(ControlRoomRole.SUPERVISE)
        return asker.id_tag in self.handovers.supervisors

    def _sensors(self, message: m.Message, body: m.GetSensorInfo) -> Reaction:
        """List the sensors of one or all robots; the robots are asked on the first request."""
        robot = self.registry.entries.get(body.device or "")
        if body.device and (robot is None or robot.device.device_type != ROBOT or robot.silent):
            return self._refuse(message, m.UNKNOWN_DEVICE, f"no robot {body.device}")
        sends = self.sensing.ask_all(self.registry, body.device)
        content = self.sensing.listed(self.registry, body.device)
        if content is None:
            text = "the robots are being asked; ask again"
            return m.Reply(message.message_id, m.BUSY, text), sends
        return self._ok(message, sends, content)

    def _give_back(
        self, message: m.Message, entry: DeviceEntry, body: m.PermissionRevocation, now: float
    ) -> Reaction:
        """A holder needs its permission no longer; only its own."""
        if body.holder != message.source or not self.sessions.give_back(body):
            return self._refuse(message, m.BAD_SESSION, "that session is not yours, or is over")
        if entry.device.device_type == CONTROL_ROOM:
            self.control_rooms.gave_back(entry.device, body.device, now)
        return self._ok(message, [])

    def _grant_of(self, message: m.Message, asker: DeviceEntry, body: m.GetGrant) -> Reaction:
        """Tell a robot who may act on it: its holder, or what another device may read."""
        grant = self.sessions.held(message.source, body.holder, body.level == "sensors")
        if asker.device.device_type != ROBOT or grant is None:
            text = "nobody holds the robot now"
            if body.holder:
                text = f"{body.holder} holds no such robot"
            return self._refuse(message, m.NOT_PERMITTED, text)
        permission = m.Permission(
            grant.holder, grant.level, grant.session, grant.address, grant.sensors
        )
        return self._ok(message, [], permission)

    def _emergency(
        self, message: m.Message, robot: DeviceEntry, body: m.RobotEmergency, now: float
    ) -> Reaction:
        """Tell a robot how its emergency ends, and send others where it was going."""
        if robot.device.device_type != ROBOT:
            return self._refuse(message, m.NOT_SUPPORTED, "only a robot reports its emergency")
        source, sends = message.source, list[Send]()
        was_stopped = self.emergencies.holds(source)
        stop = self.emergencies.hear(source, body, now)
        if not was_stopped and stop.released is None:
            stopped_by = body.stopped_by or source
            label = self.orders.label_of(stopped_by)
            fact = Fact(time=now, author=stopped_by, label=label, action="emergency", device=source)
            self.trail.note(fact)
            sends = self.dispatcher.stopped(source, now)
        rule = self._release_rule
        if rule is None:
            rule = "person" if self.dispatcher.somebody_decides() else "drive"
        content = m.EmergencyRelease(body.tick, rule, by_whom(stop.released, now))
        return self._ok(message, sends, content)

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

    def _report(
        self, message: m.Message, entry: DeviceEntry, body: m.EventReport, now: float
    ) -> Reaction:
        if body.event_id is None:
            return self._raised(message, entry, body, now)
        event = self.events.get(body.event_id)
        if event is None:
            return self._refuse(message, m.UNKNOWN_EVENT, f"no event {body.event_id}")
        if message.source not in event.sent:
            return self._refuse(message, m.NOT_PERMITTED, f"was not sent to event {event.number}")
        if body.kind != event.kind or apart(body.position, event.position) > FOUND_WITHIN:
            # A life of the DVA that could keep nothing may have given its number to another event.
            text = f"event {event.number} is another one, a {event.kind} elsewhere"
            return self._refuse(message, m.UNKNOWN_EVENT, text)
        sends = self.orders.found(event, message.source, body.finding, now)
        if event.waits_for is not None:
            sends = sends + self.dispatcher.decide(now)
        return self._ok(message, sends)

    def _raised(
        self, message: m.Message, entry: DeviceEntry, body: m.EventReport, now: float
    ) -> Reaction:
        """Somebody reports what has no number yet; a control room as its role allows."""
        if entry.device.device_type != CONTROL_ROOM:
            return self._sighting(message, body, now)
        need = ControlRoomRole.DRIVE
        if (text := self.control_rooms.may(entry.device, need, "report an event")) is not None:
            return self._refuse(message, m.NOT_PERMITTED, text)
        reply, sends = self._sighting(message, body, now)
        if (event := self.events.near(body.kind, body.position)) is not None:
            self.control_rooms.raised(event, entry.device, now)
        return reply, sends

    def _sighting(self, message: m.Message, body: m.EventReport, now: float) -> Reaction:
        """Somebody who was not sent sees something, or sees it no longer."""
        if body.finding == "refuted":
            return self._withdrawal(message, body, now)
        event = self.events.near(body.kind, body.position)
        sends: list[Send] = []
        if event is None:
            event, sends = self._corrected(message.source, body, now)
        if event is None and self.events.full:
            return self._refuse(message, m.BUSY, "too many events are open; no more are accepted")
        if event is None:
            contain = self._rules.containment
            event = self.events.add(body.kind, body.position, body.severity, now, contain)
        else:
            self.events.merge(event, body.severity)
        self.events.note_source(event, message.source, body.confidence)
        return self._ok(message, sends + self.dispatcher.decide(now))

    def _felt(
        self, message: m.Message, body: m.SensorValue, place: m.Position, now: float
    ) -> list[Send]:
        """Handle a sensor value of a robot: it may be a new event, or support a known one."""
        alarm, robot = self.sensing.crossed(message.source, body), message.source
        if alarm is None:
            return []
        event = within_reach(self.events.open.values(), alarm.kind, place)
        if event is None:
            if is_no_news(self.events, alarm.kind, place, now):
                return []
            self.counters["event raised by a sensor"] += 1
            report = m.EventReport(None, alarm.kind, place, SEVERITY, CONFIDENCE, "detected")
            return self._sighting(message._replace(body=report), report, now)[1]
        others = event.sources.keys() - {robot}
        self.events.merge(event, 0.0)
        self.events.note_source(event, robot, CONFIDENCE)
        there = apart(event.position, place) < self._rules.merge_distance
        if not (there and others) or event.state is State.CONFIRMED:
            return []
        self.counters["event confirmed by a sensor"] += 1
        return self.orders.confirmed_by_another(event, now) + self.dispatcher.decide(now)

    def _corrected(
        self, source: str, body: m.EventReport, now: float
    ) -> tuple[Event | None, list[Send]]:
        """Correct the position of an event that only sensors felt, by a report of somebody on site.

        The event is moved there, or ends, if somebody is on the way to where it was felt.
        """
        if not self.sensing.alarms:
            return None, []
        felt = (e for e in self.events.open.values() if only_felt(e, self.registry))
        event = within_reach(felt, body.kind, body.position)
        if event is None or source in event.sources:
            return None, []
        if event.state is State.PENDING:
            event.position = body.position
            return event, []
        if event.state is State.CONFIRMED:
            return None, []  # people are at it: what was reported may be something else
        return None, self.orders.supersede(event, now)

    def _withdrawal(self, message: m.Message, body: m.EventReport, now: float) -> Reaction:
        """Close an event that all its reporters have withdrawn before anybody was sent."""
        source, sends = message.source, list[Send]()
        for event in self.events.reported_by(source, body.kind, body.position):
            self.events.take_back(event, source)
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

    @staticmethod
    def _ok(
        message: m.Message,
        sends: list[Send],
        content: m.DeviceList | m.Permission | m.SensorList | m.EmergencyRelease | None = None,
    ) -> Reaction:
        return m.Reply(message.message_id, m.OK, "", content), sends

    def _refuse(self, message: m.Message, code: int, text: str) -> Reaction:
        self.refused += 1
        return m.Reply(message.message_id, code, text), []
