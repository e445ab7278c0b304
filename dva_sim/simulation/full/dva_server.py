"""The DVA on the network: binds the core, which knows no clock, to messages and time."""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Final

from dva_sim.agents.device import (
    AUDIT,
    EVENT,
    HEARTBEAT,
    HEARTBEAT_PERIOD,
    PEER_STATUS,
    STATUS,
    AgentDevice,
    do_nothing,
)
from dva_sim.agents.robot.sensors import sensor_topic
from dva_sim.core.audit import MAX_KEPT
from dva_sim.core.dva import Dva
from dva_sim.core.events import Event, State
from dva_sim.core.registry import BURST, RATE, RegistrationLimit
from dva_sim.core.request_log import SHOWN_BYTES, KeptRequest, KeptRequests
from dva_sim.core.sessions import Send
from dva_sim.core.store import Store
from dva_sim.network.messaging import Request, Subscription
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, decode_if_valid
from dva_sim.protocol.devices import CONTROL_ROOM, DETECTOR, GUARD, PEER, ROBOT
from dva_sim.protocol.facts import Fact

MAX_REPORTED = 20_000  # maximum events whose last publication is remembered and not repeated
FIRST_BEAT = 1.27  # first heartbeat after the start, when hardly any other event coincides [s]
MAX_TURNED_AWAY = 1000  # maximum unregistered devices that are remembered as reported
TICK = 1.0  # interval at which the core checks deadlines [s]
NOTHING_TO_KEEP: Final = (
    *(m.Registration, m.TaskBid, m.GetGrant, m.GetDeviceList, m.GetSensorInfo, m.RobotEmergency),
    *(m.GetEventList, m.GetDispatch, m.GetProposal, m.GetRequestLog),
)
"""Requests that are answered with OK even while nothing can be written: a registration is renewed
every 10 s, and the others only ask."""


class DvaAgent:
    """The DVA core node.

    Args:
        device: Its identity and ways to talk.
        core: Core that makes the decisions.
        memory: State that survives it.
        keep_events: True to keep all past events, for a recording.
        is_public: True if devices may join that the scenario does not know: any of them may listen
            to what it publishes.

    Attributes:
        beats: Heartbeats heard, by device.
        leave_after: Time that a silent device is still listened to before it leaves [s].
        events: Every event there ever was, by number, where `keep_events`.
        copies: Numbers of those that it looked at for another DVA.
        facts: Decisions; only the latest ones, unless `keep_events`.
        on_fact: Callback for each fact as it is taken from the core.
        is_gone: True once it has crashed; another one may take its place.
        stopwatch: Time by which the log of requests measures answers [s]; default: the run's clock.
    """

    def __init__(
        self,
        device: AgentDevice,
        core: Dva,
        memory: Store | None = None,
        keep_events: bool = True,
        is_public: bool = False,
    ) -> None:
        self.device = device
        self.core = core
        self.events: dict[int, Event] = {}
        self.copies: set[int] = set()
        self.facts: deque[Fact] = deque(maxlen=None if keep_events else MAX_KEPT)
        self.on_fact: Callable[[Fact], object] = do_nothing
        self._asks = core.dispatcher.questions.asks
        self._memory = memory
        self._keep_events = keep_events
        self._is_public = is_public
        self._last_reported: dict[int, State] = {}
        self._policy_failures = 0
        self.leave_after = device.timeout
        self.is_gone = False
        self._problem: str | None = None
        self._turned_away: OrderedDict[tuple[str, str], None] = OrderedDict()
        self.beats: Counter[str] = Counter()
        self._heard: dict[str, tuple[str, list[Subscription]]] = {}  # address, at which heard
        self._attended = 0
        self._registrations = RegistrationLimit()
        self._requests = KeptRequests()
        self.stopwatch: Callable[[], float] = lambda: device.clock.now
        device.network.serve(device.id_tag, self._on_arrival)

    def start(self) -> None:
        """Begin to check deadlines, after restoring the state from memory."""
        clock = self.device.clock
        if self._memory is not None and self._memory.recall(self.core, clock.now):
            count = len(self.core.events.open)
            self.device.tell(f"remembers {count} open event{'s' * (count != 1)}")
            self._attend()
            self._carry_out(self.core.go_on())
        clock.every(TICK, self._tick, start=clock.now + TICK)
        clock.every(HEARTBEAT_PERIOD, self._beat, start=clock.now + FIRST_BEAT)

    def crash(self) -> None:
        """Die: from now on nothing is sent, kept or decided, and the memory is closed."""
        self.is_gone = True
        self.device.silent = True
        self.device.crash()
        for source in list(self._heard):
            self._leave(source)
        if self._memory is not None:
            self._memory.close()
            self._memory = None

    def _beat(self) -> bool:
        self.device.publish(HEARTBEAT, m.Heartbeat())
        return not self.is_gone

    def close(self) -> None:
        """End all sessions: permissions of a DVA that has ended are void."""
        self._carry_out(self.core.close())

    def silence(self, silent: bool) -> None:
        """Stop sending and deciding for a while, though devices are still heard; or resume."""
        self.device.silent = silent

    def dismiss(self, device: str) -> None:
        """Forget a device at once, as if it had been silent for long."""
        self._carry_out(self.core.dismiss(device, self.device.clock.now))
        self._attend()

    def revoke(self, robot: str, takes: str | None, notify_holder: bool) -> None:
        """End the permission for a robot while it is in use, as a scenario wants.

        Args:
            robot: Its id.
            takes: Device that gets it next, if any.
            notify_holder: True if the notice reaches the previous holder.
        """
        sessions = self.core.sessions
        entries = self.core.registry.entries
        grant = sessions.permissions.grants.get(robot)
        if grant is None:
            return
        sessions.revoke(grant)
        sends = [s for s in sessions.to_tell() if notify_holder or s.to != grant.holder]
        if takes in entries:
            wish = m.PermissionRequest(robot, grant.level)
            granted = sessions.grant(entries[robot].device, entries[takes].device, wish)
            sends += granted[1] if granted is not None else []
        self._carry_out(sends)

    def keep_requests(self) -> None:
        """Keep requests from now on, for a reader that will follow."""
        self._requests.want(self.device.clock.now)

    def _on_arrival(self, request: Request) -> None:
        """Take a request, and log it if a control room wants to see it."""
        log = self._requests
        if _reads_log(request.data):  # else each look at the log would add to it
            self._take(request)
        elif log.is_wanted(self.device.clock.now):
            self._take_logged(request)
        else:
            log.count()
            self._take(request)

    def _take_logged(self, request: Request) -> None:
        """Take a request; all are answered within that, or never."""
        number = self._requests.count()
        arrived = self.device.clock.now
        begun = self.stopwatch()
        answered: list[tuple[float, bytes]] = []

        def answer(data: bytes) -> None:
            answered.append((self.stopwatch() - begun, data))
            request.answer(data)

        self._take(request._replace(answer=answer))
        took, data = answered[0] if answered else (None, b"")
        reply = decode(data).body if data else None
        self._requests.keep(
            KeptRequest(
                number=number,
                arrived=arrived,
                size=len(request.data),
                data=request.data[:SHOWN_BYTES],
                service_time=took,
                reply=reply if isinstance(reply, m.Reply) else None,
                answer=data,
            )
        )

    def _take(self, request: Request) -> None:
        """Take a request, unless its peer registers too many devices at once."""
        registers = request.origin is not None and b"<RegMsg>" in request.data
        now = self.device.clock.now
        if registers and not self._registrations.takes(request.origin or "", now):
            message = self.device.admit(request)
            if message is not None:
                text = f"too many registrations: at most {BURST} at once and {RATE:g} a second"
                reply = m.Reply(message.message_id, m.BUSY, text)
                self.device.turn_away(request, message, reply)
        else:
            self.device.take(request, self._on_request)

    def _on_request(self, message: m.Message) -> m.Reply | None:
        reply, sends = self.core.handle(message, self.device.clock.now)
        if isinstance(message.body, m.Registration) and reply.code != m.OK:
            self._tell_refused(message.source, message.body, reply.text)
        if isinstance(message.body, m.GetRequestLog) and reply.code == m.OK:
            above = message.body.request_number or 0
            reply = replace(reply, content=self._requests.above(above, self.device.clock.now))
        self._attend()
        self._carry_out(sends)
        return self._confirmed(message, reply)

    def _confirmed(self, message: m.Message, reply: m.Reply) -> m.Reply:
        """Return the reply, or a refusal if it would confirm what was not saved.

        Requests other than for permissions are carried out all the same, and written as soon as
        possible: a report is acted on, and a session ends.
        """
        if not self._problem or isinstance(message.body, NOTHING_TO_KEEP):
            return reply
        content = reply.content
        ends = isinstance(message.body, m.PermissionRevocation)
        if isinstance(content, m.Permission) and self._is_kept(content.session):
            return reply
        if reply.code != m.OK and not ends:
            return reply
        text = "the DVA cannot write to its memory now; ask again"
        return m.Reply(message.message_id, m.BUSY, text)

    def _is_kept(self, session: int) -> bool:
        return self._memory is None or not self._problem or self._memory.knows(session)

    def _tell_refused(self, source: str, wish: m.Registration, why: str) -> None:
        """Report each unregistered device only once, though it asks repeatedly."""
        key = source, wish.address
        if key not in self._turned_away:
            self._turned_away[key] = None
            self.device.tell(f"does not register {source} at {wish.address}: {why}", "link")
        if len(self._turned_away) > MAX_TURNED_AWAY:
            self._turned_away.popitem(last=False)

    def _attend(self) -> None:
        """Subscribe to present devices, not to silent ones, and drop forgotten ones."""
        registry = self.core.registry
        if registry.version == self._attended:
            return
        self._attended = registry.version
        for id_tag, entry in registry.moves().items():
            if entry is not None and entry.silent:
                # Over a long link its first heartbeat takes longer than it may be silent.
                self.device.clock.call_after(self.leave_after, self._leave_the_silent, id_tag)
            elif entry is not None:
                self._meet(entry.device)
            else:
                self._leave(id_tag)
                del self.beats[id_tag]
                self.device.forget(id_tag)

    def _leave_the_silent(self, id_tag: str) -> None:
        entry = self.core.registry.entries.get(id_tag)
        if entry is not None and entry.silent:
            self._leave(id_tag)

    def _leave(self, source: str) -> None:
        for subscription in self._heard.pop(source, ("", []))[1]:
            subscription.close()

    def _meet(self, device: m.Device) -> None:
        """Subscribe to a device, again when its address has changed.

        Detectors only speak when they have something to report.
        """
        source = device.id_tag
        network = self.device.network
        self.device.introduce(source, device.address)
        if self._heard.get(source, ("", []))[0] == device.address:
            return
        self._leave(source)
        topics = [] if device.device_type == DETECTOR else [HEARTBEAT]
        if device.device_type == PEER:
            topics.append(PEER_STATUS)
        if device.device_type in (ROBOT, GUARD):
            topics.append(STATUS)
        if device.device_type == ROBOT:
            me = self.device.id_tag
            topics += [sensor_topic(name, me) for name in self.core.sensing.alarms]
        heard = partial(self._on_published, source)
        listening = [network.subscribe(self.device.id_tag, source, t, heard) for t in topics]
        self._heard[source] = device.address, listening

    def _on_published(self, source: str, data: bytes) -> None:
        message = self.device.read(data, source)
        if message is not None and self.device.silent:
            self.core.registry.heard(source, self.device.clock.now)
        elif message is not None:
            self.beats[source] += isinstance(message.body, m.Heartbeat)
            sends = self.core.note(message, self.device.clock.now)
            if sends or isinstance(message.body, m.SensorValue):
                self._carry_out(sends)

    def _tick(self) -> bool:
        if not self.device.silent:
            self._carry_out(self.core.tick(self.device.clock.now))
            self._attend()
        return not self.is_gone

    def _carry_out(self, sends: list[Send]) -> None:
        """Save changes, then publish them: nothing published may be lost in a crash."""
        self._keep_changes()
        self._count_failures()
        for send in sends:
            if isinstance(send.body, m.PermissionGrant) and not self._is_kept(send.session):
                continue
            if send.to not in self.core.registry.entries:
                self.device.clock.call_after(0.0, self._undelivered, send)
                continue
            self.device.ask(
                send.to,
                send.body,
                lambda reply, send=send: self._answered(send, reply),  # type: ignore[misc]
                lambda send=send: self._undelivered(send),  # type: ignore[misc]
                send.session,
            )

    def _answered(self, send: Send, reply: m.Reply) -> None:
        # Whoever refuses to hear that something is over knows nothing of it: it is over there.
        # What arrived unreadable was not heard at all.
        is_end = isinstance(send.body, m.PermissionRevocation | m.OrderProgress)
        is_end = is_end or (isinstance(send.body, m.EventReport) and send.body.event_id is not None)
        if reply.code == m.OK or (is_end and reply.code != m.BAD_MESSAGE):
            now = self.device.clock.now
            self._carry_out(self.core.delivered(send, now, reply.content))
        elif isinstance(send.body, m.PermissionGrant):
            self._carry_out(self.core.refused_grant(send, reply, self.device.clock.now))
        else:
            self._undelivered(send)

    def _undelivered(self, send: Send) -> None:
        if self.is_gone:
            return
        self._carry_out(self.core.undelivered(send, self.device.clock.now))

    def _keep_changes(self) -> None:
        """Put each change of an event on the timeline, and all that changed into the memory."""
        changed = self.core.events.changes()
        if self._memory is not None:
            self._complain(self._memory.keep(self.core, changed, self.device.clock.now))
        for event in changed:
            if self._keep_events:
                self.events[event.number] = event
            self._tell(event)
        self._publish_news(changed)

    def _publish_news(self, changed: Iterable[Event]) -> None:
        """Publish news if there may be listeners; facts are kept anyway."""
        core = self.core
        now = self.device.clock.now
        facts = self.core.trail.take()
        for fact in facts:
            self.facts.append(fact)
            self.on_fact(fact)
        if not self._is_public and not any(core.registry.of_type(CONTROL_ROOM)):
            return
        for event in changed:
            self.device.publish(EVENT, core.control_rooms.event_status(event, now))
        for fact in facts:
            self.device.publish(AUDIT, fact.record())
        if self._asks != core.dispatcher.questions.asks:
            self._asks = core.dispatcher.questions.asks
            self.device.publish(EVENT, core.control_rooms.status(now))

    def _count_failures(self) -> None:
        """Count a policy's failures, and report the first one."""
        failures = self.core.counters["policy failed"]
        counted = self._policy_failures
        if failures > counted:
            self.device.recorder.counters["failed: an answer of a policy"] += failures - counted
            self._policy_failures = failures
            if not counted:
                why = self.core.dispatcher.last_failure
                self.device.tell(f"its policy failed, so min_eta decides: {why}", "order")

    def _complain(self, problem: str | None) -> None:
        """Report once that the memory cannot be written, and once that it can be again."""
        if problem and not self._problem:
            text = f"{problem}; until it can, it gives no permission and confirms no report"
            self.device.tell(text, "link")
        elif self._problem and not problem:
            self.device.tell("keeps its memory again", "link")
        self._problem = problem

    def _tell(self, event: Event) -> None:
        if self._last_reported.get(event.number) is event.state:
            return
        self._last_reported[event.number] = event.state
        if len(self._last_reported) > MAX_REPORTED:
            del self._last_reported[next(iter(self._last_reported))]
        text = f"event {event.number} ({event.kind}) is {event.state}"
        if event.state is State.ASSIGNED and event.holder:
            text += f" to {self.device.label_of(event.holder)}"
        self.device.tell(text)


def _reads_log(data: bytes) -> bool:
    if b"<GetRequestLog" not in data:
        return False
    message = decode_if_valid(data)
    return message is not None and isinstance(message.body, m.GetRequestLog)
