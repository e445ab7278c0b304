"""The transports of commands in virtual time, as far as the model covers them.

ZeroMQ, WebSocket, MQTT and Zenoh over TCP ride on TCP segment by segment, a datagram on the link
alone. Sizes are those of the specifications; what a library does of its own beyond that (batches,
congestion control, retransmission) is not modelled, and its transports are refused by name.

References:
    RFC 6455 (WebSocket's frames); MQTT 5.0, OASIS 2019 (packets, receive maximum);
    ZMTP 3.1, rfc.zeromq.org/spec/37; RFC 768.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import Link, LinkConfig, make_link
from dva_sim.network.messaging import OnReply, Wire
from dva_sim.network.middleware import CommandTransport
from dva_sim.network.middleware.mqtt import COMMANDS, PICTURES, MqttTransport
from dva_sim.network.middleware.programs import TELE_OP
from dva_sim.network.middleware.udp import UdpTransport
from dva_sim.network.middleware.websocket import MAX_WAITING, WebSocketTransport
from dva_sim.network.middleware.zenoh import ZenohTransport
from dva_sim.network.middleware.zeromq import ZeroMqTransport
from dva_sim.network.tcp import OrderedMessages, TcpConnection, TcpOptions
from dva_sim.network.transports.interface import TransportMessage
from dva_sim.network.transports.message_parts import IP_UDP, Assembly, parts_of
from dva_sim.network.workload import UNBOUNDED, OperatorEnd, RequestEnd
from dva_sim.network.zmtp import ZmtpConnection, ZmtpOptions, framed

Act = Callable[[], object]


def _nothing(*_: object) -> None:
    return None


@dataclass(frozen=True)
class BetweenPrograms:
    """Context of a carrier: the two programs it connects.

    Attributes:
        clock: Virtual time.
        up: The link that commands take.
        down: The link from the robot.
        picture_bytes: Size of a picture [B].
        on_command: Callback for the number of a command at the robot, and a function that sends its
            reply.
        on_picture: Callback for the number of a picture at the operator.
    """

    clock: Clock
    up: Link
    down: Link
    picture_bytes: int
    on_command: Callable[[int, Act], object]
    on_picture: Callable[[int], object]


class Carrier(OperatorEnd):
    """One transport between an operator and a robot."""

    def __init__(self, between: BetweenPrograms) -> None:
        self.between = between
        self.clock = between.clock

    @abstractmethod
    def open(self, ready: Act) -> None:
        """Connect; `ready()` is called when the operator's program may continue."""

    @abstractmethod
    def picture(self, number: int) -> None:
        """Hand over a picture at the robot."""


class DatagramCarrier(Carrier):
    """UDP: a command each, nothing is sent again."""

    GREETING = 5 + IP_UDP
    AGAIN_S = 0.2
    _is_ready = _knows_peer = False

    @override
    def open(self, ready: Act) -> None:
        def greet() -> None:
            if not self._is_ready:
                self._carry(self.between.up, self.GREETING, greeted)
                self.clock.call_after(self.AGAIN_S, greet)

        def greeted() -> None:
            self._knows_peer = True
            self._carry(self.between.down, self.GREETING, answered)

        def answered() -> None:
            if not self._is_ready:
                self._is_ready = True
                ready()

        self._up = Assembly(lambda number: self.between.on_command(number, _nothing))
        self._down = Assembly(self.between.on_picture)
        greet()

    @override
    def send(self, number: int) -> bool:
        self._send(
            self.between.up, self._up, TransportMessage(number, len(TELE_OP.command(number)))
        )
        return True

    @override
    def picture(self, number: int) -> None:
        if self._knows_peer:
            size = self.between.picture_bytes
            self._send(self.between.down, self._down, TransportMessage(number, size))

    def _send(self, link: Link, assembly: Assembly, message: TransportMessage) -> None:
        for part in parts_of(message, 0):
            self._carry(link, part.size + IP_UDP, assembly.add, part)

    def _carry(self, link: Link, size: int, then: Callable[..., object], *what: object) -> None:
        arrival = link.carry(self.clock.now, size)
        if arrival is not None:
            self.clock.call_at(arrival, then, *what)


HELLO: Final = "hello"
Exchanges = Sequence[tuple[int, int]]  # sizes of handshake requests and replies [B]


class ClientConnection:
    """Both ends of a TCP connection that a client opens, with the handshake before messages.

    Args:
        clock: Virtual time.
        links: From the client, and back.
        tcp: TCP options of both ends.
        exchanges: Sizes of the handshake's requests and replies [B].

    Attributes:
        up: Messages of the client.
        down: Messages of the server.
        at_server: Callback for each message of the client.
        at_client: Callback for each message of the server.
        is_ready: True once the handshake is complete.
    """

    def __init__(
        self, clock: Clock, links: tuple[Link, Link], tcp: TcpOptions, exchanges: Exchanges
    ) -> None:
        self._tcp = TcpConnection(clock, *links, tcp, tcp)
        client = self._tcp.opener
        server = self._tcp.peer
        self.up = OrderedMessages(client, server, self._heard_by_server)
        self.down = OrderedMessages(server, client, self._heard_by_client)
        self.at_server: Callable[[Any], object] = _nothing
        self.at_client: Callable[[Any], object] = _nothing
        self._exchanges = deque(exchanges)
        self._ready: Act = _nothing
        self.is_ready = False

    def open(self, ready: Act) -> None:
        """Connect; `ready()` is called once the handshake is complete."""

        def opened() -> None:
            self.up.open()
            self.up.send(HELLO, self._exchanges[0][0])

        self._ready = ready
        self._tcp.open(opened, self.down.open)

    def _heard_by_server(self, what: Any) -> None:
        if what == HELLO:
            self.down.send(HELLO, self._exchanges[0][1])
        else:
            self.at_server(what)

    def _heard_by_client(self, what: Any) -> None:
        if what != HELLO:
            self.at_client(what)
            return
        self._exchanges.popleft()
        if self._exchanges:
            self.up.send(HELLO, self._exchanges[0][0])
        else:
            self.is_ready = True
            self._ready()


class StreamCarrier(Carrier):
    """Messages in frames over one TCP connection that the operator opens.

    Args:
        between: Both programs.
        tcp: TCP options of both ends.
        header: Function that gives the size of a message's frame [B] from the size of the message
            [B] and whether it goes to the robot.
        exchanges: Before the first message.
    """

    def __init__(
        self,
        between: BetweenPrograms,
        tcp: TcpOptions,
        header: Callable[[int, bool], int],
        exchanges: Exchanges,
    ) -> None:
        super().__init__(between)
        self._header = header
        self._connection = ClientConnection(self.clock, (between.up, between.down), tcp, exchanges)
        self._connection.at_server = lambda number: between.on_command(number, _nothing)
        self._connection.at_client = between.on_picture

    @override
    def open(self, ready: Act) -> None:
        self._connection.open(ready)

    @override
    def send(self, number: int) -> bool:
        return self._send(self._connection.up, number, len(TELE_OP.command(number)), True)

    @override
    def picture(self, number: int) -> None:
        if self._connection.is_ready:
            self._send(self._connection.down, number, self.between.picture_bytes, False)

    def _send(self, stream: OrderedMessages, number: int, size: int, up: bool) -> bool:
        if stream.waiting > MAX_WAITING:
            return False
        stream.send(number, size + self._header(size, up))
        return True


def websocket_header(size: int, masked: bool) -> int:
    """Return the RFC 6455, section 5.2: from a client with a mask [B]."""
    length = 0 if size < 126 else 2 if size < 65_536 else 8
    return 2 + length + 4 * masked


HTTP_UPGRADE: Final = (250, 200)  # a request and its response, about [B]
ZENOH_OPENING: Final = ((60, 90), (70, 30), (40, 40))  # INIT, OPEN, declarations; about [B]
ZENOH_HEADER: Final = 20  # length of a batch, FRAME and PUSH; about [B]

ACKNOWLEDGEMENT: Final = "acknowledged"
LOOPBACK: Final = LinkConfig(delay_s=20e-6, rate_bps=10e9, queue_bytes=10_000_000)
IN_FLIGHT: Final = 20  # messages not acknowledged, of clients and of the broker
MQTT_OPENING: Final = ((30, 12), (35, 30))  # CONNECT, CONNACK; SUBSCRIBE, SUBACK, `HERE`; about [B]
PUBACK: Final = 4


class MqttLeg:
    """One direction between a client and the broker; with QoS 1 the other end acknowledges.

    Args:
        out: Connection for published messages.
        qos: 0 or 1.
    """

    def __init__(self, out: OrderedMessages, qos: int) -> None:
        self._out = out
        self._qos = qos
        self._in_flight = 0
        self._waiting: deque[tuple[Any, int]] = deque()

    def publish(self, what: Any, size: int) -> None:
        """Send, or wait until fewer are in flight."""
        if self._qos and self._in_flight >= IN_FLIGHT:
            self._waiting.append((what, size))
            return
        self._in_flight += self._qos
        self._out.send(what, size)

    def acknowledged(self) -> None:
        """Note that one fewer is in flight."""
        self._in_flight -= 1
        if self._waiting:
            self.publish(*self._waiting.popleft())


class MqttClient(ClientConnection):
    """Both ends of a client's connection to the broker.

    Args:
        clock: Virtual time.
        links: From the client, and back.
        options: Options of the transport.
        take: Callback for messages from the broker.
        at_broker: Callback for messages from the client.
    """

    def __init__(
        self,
        clock: Clock,
        links: tuple[Link, Link],
        options: MqttTransport,
        take: Callable[[int], object],
        at_broker: Callable[[int], object],
    ) -> None:
        super().__init__(clock, links, TcpOptions(nodelay=options.nodelay), MQTT_OPENING)
        publish, forward = (MqttLeg(stream, options.qos) for stream in (self.up, self.down))
        self.publish = publish.publish
        self.forward = forward.publish
        self.at_server = partial(self._heard, forward, self.down, at_broker)
        self.at_client = partial(self._heard, publish, self.up, take)
        self._qos = options.qos

    def _heard(
        self, back: MqttLeg, stream: OrderedMessages, take: Callable[[int], object], what: Any
    ) -> None:
        """Handle a message, which is acknowledged, or an acknowledgement."""
        if what == ACKNOWLEDGEMENT:
            back.acknowledged()
            return
        take(what)
        if self._qos:
            stream.send(ACKNOWLEDGEMENT, PUBACK)


class MqttCarrier(Carrier):
    """Two clients and a broker, one of them across the link, the other on the broker's machine."""

    def __init__(self, between: BetweenPrograms, options: MqttTransport) -> None:
        super().__init__(between)
        out, back = (make_link(LOOPBACK, "up", Streams(0), name) for name in ("out", "back"))
        up = between.up
        down = between.down
        is_far = options.broker == "far"
        self._qos = options.qos
        local_links = out, back
        operators, robots = ((up, down), local_links) if is_far else (local_links, (down, up))
        self._operator = MqttClient(
            self.clock, operators, options, between.on_picture, self._to_robot
        )
        self._robot = MqttClient(
            self.clock,
            robots,
            options,
            lambda number: between.on_command(number, _nothing),
            self._to_operator,
        )

    @override
    def open(self, ready: Act) -> None:
        self._robot.open(lambda: self._operator.open(ready))

    @override
    def send(self, number: int) -> bool:
        self._operator.publish(number, self._size(COMMANDS, len(TELE_OP.command(number))))
        return True

    @override
    def picture(self, number: int) -> None:
        self._robot.publish(number, self._size(PICTURES, self.between.picture_bytes))

    def _to_robot(self, number: int) -> None:
        self._robot.forward(number, self._size(COMMANDS, len(TELE_OP.command(number))))

    def _to_operator(self, number: int) -> None:
        self._operator.forward(number, self._size(PICTURES, self.between.picture_bytes))

    def _size(self, topic: str, payload: int) -> int:
        """Return the MQTT 5.0, section 3.3: a PUBLISH without properties [B]."""
        rest = 2 + len(topic) + 2 * (self._qos > 0) + 1 + payload
        return 1 + (1 if rest < 128 else 2 if rest < 16_384 else 3) + rest


class ZeroMqCarrier(Carrier):
    """ZeroMQ: each pair of sockets over its own connection, one pair of them for pictures."""

    def __init__(self, between: BetweenPrograms, options: ZeroMqTransport) -> None:
        super().__init__(between)
        conflates = options.pattern == "conflate"
        self._options = ZmtpOptions(mark=options.high_water_mark, conflate=conflates)
        self._pictures = self._connection(self._watched, self.between.on_picture)
        self._is_watched = False

    def _connection(
        self, at_robot: Callable[[Any], object], at_operator: Callable[[Any], object]
    ) -> ZmtpConnection:
        """Return a connection that the operator opens."""
        links = (self.between.up, self.between.down)
        both = self._options
        return ZmtpConnection(self.clock, *links, at_robot, at_operator, both, both)

    @override
    def open(self, ready: Act) -> None:
        self._pictures.open(lambda: self._pictures.opener.send(None, framed(1)))

    def _watched(self, _: Any) -> None:
        self._is_watched = True

    @override
    def picture(self, number: int) -> None:
        if self._is_watched:
            self._pictures.peer.send(number, framed(self.between.picture_bytes))


class PublishCarrier(ZeroMqCarrier):
    """Commands by PUB and SUB, whose subscription takes half a round trip more."""

    def __init__(self, between: BetweenPrograms, options: ZeroMqTransport) -> None:
        super().__init__(between, options)
        self._is_joined = False

    @override
    def open(self, ready: Act) -> None:
        def heard(number: int) -> None:
            self.between.on_command(number, _nothing)

        def joined(_: Any) -> None:
            self._is_joined = True

        super().open(_nothing)
        connection = self._commands = self._connection(heard, joined)
        connection.open(ready, lambda: connection.peer.send(None, framed(1)))

    @override
    def send(self, number: int) -> bool:
        if self._is_joined:
            self._commands.opener.send(number, framed(len(TELE_OP.command(number))))
        return True  # PUB drops messages without subscribers


class RequestCarrier(ZeroMqCarrier):
    """Commands by REQ and REP, one at a time; over a new connection after a time-out."""

    def __init__(self, between: BetweenPrograms, options: ZeroMqTransport) -> None:
        super().__init__(between, options)
        self._timeout_s = options.timeout_s
        self._ready: Act = _nothing
        self._replies = 0

    @override
    def open(self, ready: Act) -> None:
        super().open(_nothing)
        self._ready = ready
        self._end = RequestEnd(self, TELE_OP, timeout=self._timeout_s, attempts=UNBOUNDED)
        self._end.on_free = self.on_free

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> Wire:
        """Open a connection of a REQ socket."""

        def answer(tag: int) -> None:
            self._replies += 1
            size = len(TELE_OP.reply(tag, self._replies))
            connection.peer.send(tag, framed(0) + framed(size))

        connection = self._connection(
            lambda tag: self.between.on_command(tag, partial(answer, tag)),
            lambda tag: on_reply(tag, b""),
        )
        connection.open(self._ready)
        self._ready = _nothing  # only the first connection is waited for
        return RequestWire(connection)

    @override
    def send(self, number: int) -> bool:
        return self._end.send(number)


@dataclass(frozen=True)
class RequestWire(Wire):
    """Connection of a REQ socket; the tag of a request is the number of its command."""

    connection: ZmtpConnection

    @override
    def send(self, tag: int, data: bytes) -> None:
        self.connection.opener.send(tag, framed(0) + framed(len(data)))

    @override
    def close(self) -> None:
        self.connection.close()


def why_not(transport: CommandTransport) -> str:
    """Return the reason why the model does not cover a transport; empty if it does."""
    if isinstance(transport, MqttTransport):
        if transport.qos > 1:
            return "MQTT's quality of service 2 is not modelled"
        return "the broker's queue of expiring messages is not modelled" * (
            transport.expiry_s is not None
        )
    if isinstance(transport, ZenohTransport) and transport.carrier == "udp":
        return "Zenoh's own fragments and losses over UDP are not modelled"
    if isinstance(transport, ZenohTransport) and transport.congestion == "block":
        return "a sender that Zenoh blocks is not modelled"
    if isinstance(
        transport,
        UdpTransport | WebSocketTransport | ZenohTransport | ZeroMqTransport | MqttTransport,
    ):
        return ""
    return f"{transport.title or type(transport).__name__} is not modelled"


def make_carrier(transport: CommandTransport, between: BetweenPrograms) -> Carrier:
    """Return the carrier of a transport for which `why_not` has no objection."""
    if isinstance(transport, ZeroMqTransport):
        kind = RequestCarrier if transport.pattern == "req-rep" else PublishCarrier
        return kind(between, transport)
    if isinstance(transport, MqttTransport):
        return MqttCarrier(between, transport)
    if isinstance(transport, WebSocketTransport):
        tcp = TcpOptions(nodelay=transport.nodelay)
        return StreamCarrier(between, tcp, websocket_header, [HTTP_UPGRADE])
    if isinstance(transport, ZenohTransport):
        return StreamCarrier(between, TcpOptions(), lambda *_: ZENOH_HEADER, ZENOH_OPENING)
    return DatagramCarrier(between)
