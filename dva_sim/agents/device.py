"""What every agent has: an identity, a way to talk, and a place in the timeline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from dva_sim.clock import Clock
from dva_sim.network.patterns import Answer, Network, Requester
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.exchange import Outbox, ReplyCache
from dva_sim.recorder import Recorder
from dva_sim.worlds.geo import GeoFrame

CONTROL = "control"  # the acknowledged channel: everything but SetTeleOp
HEARTBEATS = "heartbeats"
HEARTBEAT_PERIOD = 2.0  # [s]
REGISTER_AGAIN = 2.0  # pause after a registration that was not answered [s]

Handler = Callable[[m.Message], m.Reply]


def do_nothing(*_: object) -> None:
    """For callers who need no answer."""


@dataclass
class Device:
    """An agent's share in the system.

    Attributes:
        id_tag: Its id on the wire.
        label: Its name for people, as in `robot-1`.
        device_type: As in its registration.
        address: As in its registration.
        dva: Id of the DVA.
        network: Where messages travel.
        recorder: Told what happens.
        frame: Between longitude/latitude on the wire and metres inside.
        timeout: Of a request on the acknowledged channel [s].
        attempts: Of the same.
        labels: Names of all devices by id, for the timeline.
    """

    id_tag: str
    label: str
    device_type: str
    address: str
    dva: str
    network: Network
    recorder: Recorder
    frame: GeoFrame
    timeout: float
    attempts: int
    labels: dict[str, str]
    outbox: Outbox = field(init=False)
    _requesters: dict[tuple[str, bool], Requester] = field(default_factory=dict)
    _replies: ReplyCache = field(default_factory=ReplyCache)

    def __post_init__(self) -> None:
        self.outbox = Outbox(self.id_tag)
        self.labels[self.id_tag] = self.label

    @property
    def clock(self) -> Clock:
        """The run's clock."""
        return self.network.clock

    def register(self, then: Callable[[], object] = do_nothing) -> None:
        """Make oneself known to the DVA, until it has answered, and begin to send heartbeats."""
        self._register(then)
        self.clock.every(HEARTBEAT_PERIOD, self._heartbeat)

    def _register(self, then: Callable[[], object]) -> None:
        body = m.Registration(self.label, self.device_type, self.address)

        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                then()
            else:
                self.tell(f"was not registered: {reply.text}", "link")

        again = lambda: self.clock.call_after(REGISTER_AGAIN, self._register, then)  # noqa: E731
        self.ask(self.dva, body, answered, again)

    def ask(
        self,
        peer: str,
        body: m.Body,
        on_reply: Callable[[m.Reply], object] = do_nothing,
        on_failure: Callable[[], object] = do_nothing,
        session: int = 0,
    ) -> None:
        """Send a request on the acknowledged channel; replies come in the order of requests.

        An emergency has a socket of its own, so that it never waits behind another request.
        """
        key = peer, isinstance(body, m.Emergency)
        requester = self._requesters.get(key)
        if requester is None:
            requester = self._requesters[key] = Requester(
                self.network, self.id_tag, peer, CONTROL, self.timeout, self.attempts
            )

        def answered(data: bytes) -> None:
            reply = self.read(data)
            if reply is not None and isinstance(reply.body, m.Reply):
                on_reply(reply.body)

        data = self.outbox.encode(peer, body, self.clock.now, session)
        requester.request(data, answered, on_failure)

    def serve(self, handler: Handler) -> None:
        """Let `handler` take the requests on the acknowledged channel."""

        def take(data: bytes, answer: Answer) -> None:
            answer(self.answer(data, handler))

        self.network.serve(self.id_tag, CONTROL, take)

    def answer(self, data: bytes, handler: Handler) -> bytes:
        """The reply to a request as bytes: an error reply to bad bytes, once per request."""
        try:
            message = decode(data)
        except ProtocolError as error:
            self.recorder.counters["refused"] += 1
            return self._bad_message(error)
        known = self._replies.get(message)
        if known is not None:
            return known
        body = handler(message)
        if body.code != m.OK:
            self.recorder.counters[f"refused: {m.CODE_NAMES[body.code]}"] += 1
        return self._replies.put(message, self.reply(message, body))

    def reply(self, message: m.Message, body: m.Reply) -> bytes:
        """A reply to `message` as bytes."""
        session = message.session or 0
        return self.outbox.encode(message.source, body, self.clock.now, session)

    def read(self, data: bytes) -> m.Message | None:
        """A message from bytes; None, and counted, if it is not valid."""
        try:
            return decode(data)
        except ProtocolError:
            self.recorder.counters["refused"] += 1
            return None

    def progress(self, event_id: int, state: str) -> None:
        """Tell the DVA how an order stands."""
        self.ask(self.dva, m.OrderProgress(event_id, state))

    def publish(self, service: str, topic: str, body: m.Body) -> None:
        """Publish a message to whoever has subscribed."""
        data = encode(self.outbox.message(self.dva, body, self.clock.now))
        self.network.publisher(self.id_tag, service).publish(topic, data, len(data))

    def tell(self, what: str, kind: str = "event") -> None:
        """Add a line to the timeline."""
        self.recorder.tell(self.clock.now, self.label, what, kind)

    def label_of(self, id_tag: str) -> str:
        """The name of a device for people."""
        return self.labels.get(id_tag, id_tag)

    def _heartbeat(self) -> None:
        self.publish(HEARTBEATS, "heartbeat|", m.Heartbeat())

    def _bad_message(self, error: ProtocolError) -> bytes:
        body = m.Reply(0, error.code, error.reason[:256])
        return self.outbox.encode(self.dva, body, self.clock.now)
