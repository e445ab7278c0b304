"""The DVA: takes each message with the time, returns the reply and what else to send."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np

from dva_sim.core.assignments import Rules
from dva_sim.core.control_rooms import ControlRooms
from dva_sim.core.dispatch import Policy
from dva_sim.core.dispatcher import Dispatcher, Patrols
from dva_sim.core.event_status import by_whom
from dva_sim.core.events import EventTable
from dva_sim.core.handovers import Handovers
from dva_sim.core.orders import Orders
from dva_sim.core.permissions import Access
from dva_sim.core.registry import Registry
from dva_sim.core.reports import Reports
from dva_sim.core.robot_access import RobotAccess
from dva_sim.core.roles import Roles
from dva_sim.core.sensing import Sensing
from dva_sim.core.sessions import DvaAnswer, Send, Sessions
from dva_sim.core.severity import Grading
from dva_sim.core.travel_times import SiteKnowledge, Travel
from dva_sim.protocol import messages as m
from dva_sim.protocol.control_room import ControlRoomBody
from dva_sim.protocol.devices import ROBOT
from dva_sim.protocol.facts import Fact

Reaction = tuple[m.Reply, list[Send]]


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
        self.sessions = sessions
        self.access = access or Access()
        self.registry = Registry()
        self.events = EventTable(rules.merge_distance)
        self.orders = Orders(rules, self.registry, self.events, sessions)
        self.trail = self.orders.trail
        self.roles = roles or Roles()
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
        grading = Grading(self.orders)
        self._reports = Reports(
            self.dispatcher, self.events, self.sensing, self.control_rooms, grading
        )
        self._robot_access = RobotAccess(
            self.dispatcher,
            self.handovers,
            self.control_rooms,
            access=self.access,
            roles=self.roles,
        )
        self.counters: Counter[str] = self.orders.counters
        self.refused = 0
        self._patrols = patrols or Patrols()

    # --- what comes in -----------------------------------------------------------------

    def handle(self, message: m.Message, now: float) -> Reaction:
        """Take a request; the reply goes to the sender, the rest where it says."""
        answer = self._answer(message, now)
        self.refused += answer.code != m.OK
        reply = m.Reply(message.message_id, answer.code, answer.text[:256], answer.content)
        return reply, self._with_revocations(answer.sends)

    def note(self, message: m.Message, now: float) -> list[Send]:
        """Take a published message, which gets no reply; return the messages it causes."""
        entry = self.registry.heard(message.source, now)
        body = message.body
        if entry is None:
            self.refused += 1
            return []
        # Publications are read at the device's address, so unlike requests they prove it.
        self.registry.is_there(entry, now)
        if isinstance(body, m.RobotStatus | m.PersonStatus):
            self.registry.locate(entry, body.position)
            self.orders.moved(message.source, now)
        if isinstance(body, m.RobotStatus):
            entry.mode = body.mode
            self.handovers.seen(message.source, body, now)
        elif isinstance(body, m.SensorValue) and entry.position is not None:
            answer = self._reports.felt(message.source, body, entry.position, now)
            self.refused += answer.code != m.OK
            return self._with_revocations(answer.sends)
        return []

    def delivered(self, send: Send, now: float, content: object = None) -> list[Send]:
        """Handle the reply OK to a message, with its content."""
        self.sessions.heard(send)
        body = send.body
        sends = self._patrols.held(send, self.registry, self.sessions)
        if isinstance(body, m.GetSensorInfo):
            self.sensing.on_reply(send.to, content, now)
            sends = self.sensing.renew(self.registry, self.sessions, now)
        elif isinstance(body, m.HandoverRequest):
            sends = self.handovers.answered(send, True, now) + self.dispatcher.decide(now)
        elif isinstance(body, m.PermissionGrant) and body.holder == self.sessions.permissions.own:
            sends += self.sensing.permitted(send) if body.level == "sensors" else []
        return self._with_revocations(sends + self.orders.taken_up(send))

    def refused_grant(self, send: Send, reply: m.Reply, now: float) -> list[Send]:
        """Note that a robot refused a grant; its reply may state the session it needs."""
        floor = reply.content
        if reply.code == m.BAD_SESSION and isinstance(floor, m.SessionFloor):
            again = self.sessions.above(send, floor.session)
            if again is not None:
                self.counters["granted again above"] += 1
                return self._with_revocations([again])
        return self.undelivered(send, now)

    def undelivered(self, send: Send, now: float) -> list[Send]:
        """Handle a message that did not arrive or was declined: undo what it was to bring about."""
        body = send.body
        sends = list[Send]()
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
            self.sessions.permissions.end(send.session)  # the robot may have restarted without it
        elif isinstance(body, m.HandoverRequest):
            sends = self.handovers.answered(send, False, now)
        elif isinstance(body, m.Emergency):
            sends = [send] if self.emergencies.holds(send.to) and self._is_there(send.to) else []
        else:
            self.sessions.undelivered(send)
        return self._with_revocations(sends)

    def tick(self, now: float) -> list[Send]:
        """Handle the passage of time: silent devices, deadlines, newly free responders."""
        sends: list[Send] = []
        for entry in self.registry.fallen_silent(now):
            sends += self._gone(entry.device.id_tag, now)
        if now >= self._robot_access.next_end:
            self.check_access(now)
        sends += self.orders.take_back(now)
        self._forget_the_long_silent(now)
        self.sessions.remind(self._is_there)
        self.handovers.lapse(now)
        sends += self.sensing.renew(self.registry, self.sessions, now)
        sends += self.dispatcher.decide(now)
        sends += self._patrols.set_out(self.orders, now)
        self.emergencies.lapse(now, lambda robot: self.registry.entries[robot].last_heard)
        return self._with_revocations(sends)

    def next_deadline(self) -> float:
        """Return the latest time at which `tick` has work, if nothing else happens [s].

        Forgetting can wait.
        """
        return min(
            self.orders.next_deadline(),
            self.dispatcher.next_deadline(),
            self.registry.next_silence(),
            self._robot_access.next_end,
            self.sensing.next_due(),
            self.handovers.next_deadline(),
        )

    def go_on(self) -> list[Send]:
        """Return the messages to repeat after a restart."""
        return self._with_revocations(self.orders.again())

    def dismiss(self, device: str, now: float) -> list[Send]:
        """Drop a device: what it held is free, and it is forgotten at once."""
        if device not in self.registry.entries:
            return []
        sends = self._gone(device, now)
        self._forget(device)
        return self._with_revocations(sends)

    def close(self) -> list[Send]:
        """End all sessions, as the DVA closes."""
        self.sessions.take_back_everything()
        return self._with_revocations([])

    def check_access(self, now: float) -> None:
        """Revoke the permissions in use whose rule has ended."""
        self._robot_access.check(now)

    def _answer(self, message: m.Message, now: float) -> DvaAnswer:
        body = message.body
        source = message.source
        if isinstance(body, m.Registration):
            return self._register(message, body, now)
        entry = self.registry.heard(source, now)
        if entry is None:
            return DvaAnswer(m.NOT_REGISTERED, f"device {source} is not registered")
        match body:
            case m.EventReport(event_id=None):
                return self._reports.sighted(entry, body, now)
            case m.EventReport():
                return self._reports.found(source, body, now)
            case m.OrderProgress():
                return self._reports.progress(source, body, now)
            case m.TaskBid():
                return self.dispatcher.bid(source, body, now)
            case m.PermissionRequest():
                return self._robot_access.request(entry, body, now)
            case m.PermissionRevocation():
                return self._robot_access.give_back(entry.device, body, now)
            case m.GetGrant():
                return self._robot_access.grant_of(entry.device, body)
            case m.RobotEmergency():
                return self._emergency(entry.device, body, now)
            case m.GetDeviceList():
                return DvaAnswer(content=self.registry.device_list())
            case m.GetSensorInfo():
                return self.sensing.answer(self.registry, body.device)
            case _ if isinstance(body, ControlRoomBody):
                return self.control_rooms.answer(body, entry.device, now)
            case _:
                name = type(body).__name__
                return DvaAnswer(m.NOT_SUPPORTED, f"{name} is not for the DVA")

    def _with_revocations(self, sends: Iterable[Send]) -> list[Send]:
        """Return the messages, preceded by revocations of ended sessions."""
        return [*self.sessions.to_tell(), *sends]

    # --- registered devices --------------------------------------------------------------

    def _register(self, message: m.Message, body: m.Registration, now: float) -> DvaAnswer:
        registered = self.registry.entries.get(message.source)
        sends: list[Send] = []
        if registered is not None and registered.device.device_type != body.device_type:
            text = f"{message.source} is registered as {registered.device.device_type}"
            return DvaAnswer(m.NOT_PERMITTED, text)
        if registered is not None and self.registry.is_elsewhere(message.source, body.address, now):
            self.counters["registration of an id in use"] += 1
            text = (
                f"{registered.device.label} is heard at {registered.device.address} under this id; "
                "use another id, or wait until that device has been silent for "
                f"{self.registry.silent_after:g} s"
            )
            return DvaAnswer(m.BUSY, text)
        if registered is not None and registered.is_new_life(message.message_id, message.timestamp):
            sends = self._gone(message.source, now)  # a restarted device has forgotten what it held
            if self.emergencies.holds(message.source):
                sends.append(Send(message.source, m.Emergency()))  # and that it is stopped
            self.sessions.forget(message.source)  # and which orders of a session it has obeyed
        if registered is not None and registered.device.address != body.address:
            self.sessions.forget(message.source)  # its holder has to ask for the new address
        if registered is None and self.registry.is_full:
            sends = self._make_room(now)
        entry = self.registry.register(message.source, body, now)
        if entry is None:
            return DvaAnswer(m.BUSY, "the registry is full")
        entry.registrations.append((message.message_id, message.timestamp))
        if body.device_type == ROBOT:
            sends += self.sensing.met(message.source)
        return DvaAnswer(sends=sends)

    def _gone(self, device: str, now: float) -> list[Send]:
        """Drop a device: free what it held, and open its tasks to others."""
        self.sessions.take_back_all(device)
        self.sensing.forget(device)
        self.sessions.permissions.forget(self.sessions.permissions.own, device)
        self.dispatcher.situations.forget_move(device)
        return self.orders.abandon(device, now)

    def _is_there(self, device: str) -> bool:
        entry = self.registry.entries.get(device)
        return entry is not None and not entry.silent

    def _forget_the_long_silent(self, now: float) -> None:
        """Forget the devices that were silent for long and have nothing open."""
        late = list(self.registry.long_silent(now))
        for device in self._with_nothing_open(late) if late else ():
            self._forget(device)

    def _make_room(self, now: float) -> list[Send]:
        """Forget the longest silent device, preferably one that has nothing open."""
        silent = self.registry.silent
        device = next(chain(self._with_nothing_open(silent), silent), None)
        if device is None:
            return []
        self.counters["forgotten for want of room"] += 1
        sends = self._gone(device, now)
        self._forget(device)
        return sends

    def _with_nothing_open(self, devices: Iterable[str]) -> Iterator[str]:
        unfinished = self.with_something_open()
        engaged = self.orders.engaged
        return (d for d in devices if d not in unfinished and d not in engaged)

    def with_something_open(self) -> set[str]:
        """Return the robots that the DVA must not forget: held, not notified yet, or stopped."""
        return self.sessions.with_something_open() | self.emergencies.stopped().keys()

    def _forget(self, device: str) -> None:
        self.sessions.forget(device)
        self._patrols.forget(device)
        self.emergencies.forget(device)
        self.registry.forget(device)

    # --- emergencies -------------------------------------------------------------------

    def _emergency(self, robot: m.Device, body: m.RobotEmergency, now: float) -> DvaAnswer:
        """Tell a robot how its emergency ends, and send others where it was going."""
        if robot.device_type != ROBOT:
            return DvaAnswer(m.NOT_SUPPORTED, "only a robot reports its emergency")
        source = robot.id_tag
        sends = list[Send]()
        was_stopped = self.emergencies.holds(source)
        stop = self.emergencies.hear(source, body, now)
        if not was_stopped and stop.released is None:
            stopped_by = body.stopped_by or source
            label = self.orders.label_of(stopped_by)
            fact = Fact(time=now, author=stopped_by, label=label, action="emergency", device=source)
            self.trail.note(fact)
            sends = [*self.orders.abandon(source, now), *self.dispatcher.decide(now)]
        rule = self._release_rule
        if rule is None:
            rule = "person" if self.dispatcher.somebody_decides() else "drive"
        content = m.EmergencyRelease(body.tick, rule, by_whom(stop.released, now))
        return DvaAnswer(content=content, sends=sends)
