"""The DVA on the network: binds the desk, which knows no clock, to messages and time."""

from __future__ import annotations

from collections import Counter
from functools import partial

from dva_sim.agents.device import HEARTBEAT, STATUS, Device
from dva_sim.core.events import State
from dva_sim.core.registry import DETECTOR, GUARD, ROBOT
from dva_sim.core.send import Send
from dva_sim.core.service import Desk
from dva_sim.network.patterns import Subscription
from dva_sim.protocol import messages as m

TICK = 1.0  # how often the desk looks at deadlines [s]


class DvaAgent:
    """The DVA core node.

    Args:
        device: Its identity and ways to talk.
        desk: What decides.

    Attributes:
        beats: Heartbeats heard, by device.
    """

    def __init__(self, device: Device, desk: Desk) -> None:
        self.device, self.desk = device, desk
        self._known: dict[int, State] = {}
        self.beats: Counter[str] = Counter()
        self._heard: dict[tuple[str, str], tuple[str, Subscription]] = {}
        device.serve(self._on_request)

    def start(self) -> None:
        """Begin to look at deadlines."""
        self.device.clock.every(TICK, self._tick, start=TICK)

    def close(self) -> None:
        """End all sessions: nobody drives by a permission of a DVA that is no more."""
        self._carry_out(self.desk.close())

    def _on_request(self, message: m.Message) -> m.Reply:
        reply, sends = self.desk.handle(message, self.device.clock.now)
        if isinstance(message.body, m.Registration) and reply.code == m.OK:
            self.device.network.introduce(message.source, message.body.address)
            self._listen(message.source, message.body)
        self._carry_out(sends)
        return reply

    def _listen(self, source: str, body: m.Registration) -> None:
        """Subscribe to what a device publishes, anew when it has moved to another address.

        Detectors only speak when they have something to report.
        """
        topics = [] if body.device_type == DETECTOR else [HEARTBEAT]
        if body.device_type in (ROBOT, GUARD):
            topics.append(STATUS)
        for topic in topics:
            address, earlier = self._heard.get((source, topic), ("", None))
            if address == body.address:
                continue
            if earlier is not None:
                earlier.close()
            heard = self.device.network.subscribe(
                self.device.id_tag, source, topic, partial(self._on_published, source)
            )
            self._heard[source, topic] = body.address, heard

    def _on_published(self, source: str, data: bytes) -> None:
        message = self.device.read(data, source)
        if message is not None:
            self.beats[source] += isinstance(message.body, m.Heartbeat)
            self.desk.note(message, self.device.clock.now)

    def _tick(self) -> None:
        self._carry_out(self.desk.tick(self.device.clock.now))

    def _carry_out(self, sends: list[Send]) -> None:
        for send in sends:
            session = send.body.session if isinstance(send.body, m.PermissionGrant) else 0
            self.device.ask(
                send.to,
                send.body,
                lambda reply, send=send: self._answered(send, reply),  # type: ignore[misc]
                lambda send=send: self._undelivered(send),  # type: ignore[misc]
                session,
            )
        self._tell_changes()

    def _answered(self, send: Send, reply: m.Reply) -> None:
        # Whoever refuses to hear that a session is over has no such session.
        if reply.code != m.OK and not isinstance(send.body, m.PermissionRevocation):
            self._undelivered(send)

    def _undelivered(self, send: Send) -> None:
        self._carry_out(self.desk.undelivered(send, self.device.clock.now))

    def _tell_changes(self) -> None:
        """Put each change of an event on the timeline."""
        for event in self.desk.book.events.values():
            if self._known.get(event.number) is event.state:
                continue
            self._known[event.number] = event.state
            who = event.operator or event.responder
            told = f"event {event.number} ({event.kind}) is {event.state}"
            if event.state is State.ASSIGNED and who:
                told += f" to {self.device.label_of(who)}"
            self.device.tell(told)
