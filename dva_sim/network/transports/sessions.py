"""Sessions between operator and robot, one for each transport.

A sender of datagrams finishes the message that it has begun, because a part of a picture shows
nothing. Of the messages that come meanwhile it keeps only the newest.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp import OrderedMessages, TcpConnection, TcpOptions
from dva_sim.network.transports.config import Datagrams, Tcp, TransportConfig, Udp, Zeromq
from dva_sim.network.transports.feedback import REPEATED, Echo, Feedback
from dva_sim.network.transports.interface import Deliver, Ends, TransportMessage, TransportSession
from dva_sim.network.transports.message_parts import IP_UDP, Assembly, MessagePart, parts_of
from dva_sim.network.transports.pace import Aimd, Pace
from dva_sim.network.zmtp import ZmtpConnection, ZmtpOptions, framed

SLACK = 1e-6  # resolution of the clock [s]


class DatagramSender:
    """Sends messages as datagrams at the rate that a law sets; its other end puts them together.

    Args:
        clock: Virtual time.
        link: Link that carries the datagrams.
        header: Header of the transport in each datagram [B].
        law: Law that decides the rate.
        deliver: Callback for every message at the other end.
        repeats_crucial: True if crucial messages are sent at once, and again until they have
            arrived.

    Attributes:
        on_arrival: Callback at the other end for every datagram.
    """

    def __init__(
        self,
        clock: Clock,
        link: Link,
        header: int,
        law: Aimd,
        deliver: Deliver,
        repeats_crucial: bool = False,
    ) -> None:
        self._clock = clock
        self._link = link
        self._header = header
        self._repeats = repeats_crucial
        self._assembly = Assembly(deliver)
        self._feedback = Feedback()
        self._seen: deque[Echo] = deque(maxlen=REPEATED)  # what has arrived, and since when
        self._pace = Pace(law, self._feedback)
        self._waiting: TransportMessage | None = None
        self._parts: deque[MessagePart] = deque()
        self._crucial: deque[MessagePart] = deque()
        self._to_repeat: dict[int, MessagePart] = {}
        self._number = 0
        self._sent_at = -math.inf
        self._wake_at = self._watch_at = math.inf
        self.on_arrival: Callable[[], object] = lambda: None

    def offer(self, message: TransportMessage) -> None:
        """Offer a message; it replaces one whose sending has not begun."""
        if message.crucial and self._repeats:
            self._crucial += parts_of(message, self._header)
        else:
            self._waiting = message
        self._pump()

    def hear(self, echoes: Sequence[Echo]) -> None:
        """Take an acknowledgement from the other end."""
        now = self._clock.now
        self._lose(now, self._feedback.acknowledged(now, echoes))
        self._pace.heard(now)
        self._pump()

    def echoes(self) -> Sequence[Echo]:
        """Return the feedback of the receiver at the other end."""
        now = self._clock.now
        return [(number, now - since) for number, since in self._seen]

    def _lose(self, now: float, gone: Sequence[int]) -> None:
        """Take datagrams for lost: the law hears of it, and the crucial ones go again."""
        if gone:
            self._crucial += [self._to_repeat.pop(n) for n in gone if n in self._to_repeat]
            self._pace.lost(now)

    def _pump(self) -> None:
        """Send what may be sent now, and come back for the rest."""
        now = self._clock.now
        while self._crucial:
            part = self._crucial.popleft()
            self._to_repeat[self._send(now, part)] = part
        while self._parts or self._waiting is not None:
            ready = self._sent_at + self._pace.gap
            if now < ready - SLACK:
                self._pace.held = True
                if ready < self._wake_at - SLACK:
                    self._wake_at = ready
                    self._clock.call_at(ready, self._woken, ready)
                return
            if not self._parts and self._waiting is not None:
                self._parts += parts_of(self._waiting, self._header)
                self._waiting = None
            self._send(now, self._parts.popleft())
            self._pace.sent()
            self._sent_at = now

    def _woken(self, at: float) -> None:
        if at == self._wake_at:
            self._wake_at = math.inf
            self._pump()

    def _send(self, now: float, part: MessagePart) -> int:
        number = self._number
        self._number += 1
        self._feedback.sent(now, number)
        arrival = self._link.carry(now, part.size + self._header + IP_UDP)
        if arrival is not None:
            self._clock.call_at(arrival, self._arrive, number, part)
        self._watch()
        return number

    def _watch(self) -> None:
        """Be there when nothing has been heard for too long."""
        deadline = self._feedback.deadline
        if deadline < math.inf and self._watch_at == math.inf:
            self._watch_at = deadline
            self._clock.call_at(deadline, self._watched)

    def _watched(self) -> None:
        self._watch_at = math.inf
        now = self._clock.now
        if now >= self._feedback.deadline - SLACK:
            self._lose(now, self._feedback.give_up())
            self._pump()
        self._watch()

    def _arrive(self, number: int, part: MessagePart) -> None:
        """Arrive at the other end."""
        self._seen.append((number, self._clock.now))
        self._assembly.add(part)
        self.on_arrival()


def open_session(clock: Clock, config: TransportConfig, ends: Ends) -> TransportSession:
    """Return a session over a transport, as configured."""
    if isinstance(config, Tcp):
        return tcp_session(clock, ends, TcpOptions(send_buffer=config.send_buffer_bytes))
    if isinstance(config, Zeromq):
        return zeromq_session(clock, ends, config)
    if isinstance(config, Udp):
        return plain_session(clock, ends, 0)
    if config.increase is None or config.decrease is None:
        return plain_session(clock, ends, config.header_bytes)
    tolerance = math.inf if config.tolerance_s is None else config.tolerance_s
    law = partial(Aimd, config.increase, config.decrease, tolerance)
    return rate_session(clock, ends, config, law)


def plain_session(clock: Clock, ends: Ends, header: int) -> TransportSession:
    """Return every datagram at once, none of them twice; the header [B] is besides IP and UDP."""

    def sends(link: Link, deliver: Deliver) -> Callable[[TransportMessage], object]:
        add = Assembly(deliver).add

        def send(message: TransportMessage) -> None:
            for part in parts_of(message, header):
                arrival = link.carry(clock.now, part.size + header + IP_UDP)
                if arrival is not None:
                    clock.call_at(arrival, add, part)

        return send

    return TransportSession(sends(ends.up, ends.on_command), sends(ends.down, ends.on_picture))


def rate_session(
    clock: Clock, ends: Ends, config: Datagrams, law: Callable[[], Aimd]
) -> TransportSession:
    """Two directions, each with a law of rate of its own and acknowledged datagram by datagram."""
    header = config.header_bytes
    up, down = (
        DatagramSender(clock, link, header, law(), entry, config.repeats_crucial)
        for link, entry in ((ends.up, ends.on_command), (ends.down, ends.on_picture))
    )
    answer_each(clock, up, ends.down, header)
    answer_each(clock, down, ends.up, header)
    return TransportSession(up.offer, down.offer)


def zeromq_session(clock: Clock, ends: Ends, config: Zeromq) -> TransportSession:
    """Two publishers, each with one subscriber, on two connections that the operator opens."""
    tcp = TcpOptions(send_buffer=config.send_buffer_bytes)
    options = ZmtpOptions(conflate=config.conflate, tcp=tcp)
    callbacks = ends.on_command, ends.on_picture
    commands, pictures = (
        ZmtpConnection(clock, ends.up, ends.down, *callbacks, options, options) for _ in range(2)
    )
    for connection in (commands, pictures):
        connection.open(lambda: None)
    return TransportSession(
        lambda message: commands.opener.send(message.number, framed(message.size)),
        lambda message: pictures.peer.send(message.number, framed(message.size)),
    )


def answer_each(clock: Clock, sender: DatagramSender, back: Link, header: int) -> None:
    """Let every datagram of a sender be acknowledged by one of its own on the way back."""

    def answer() -> None:
        arrival = back.carry(clock.now, header + IP_UDP)
        if arrival is not None:
            clock.call_at(arrival, sender.hear, sender.echoes())

    sender.on_arrival = answer


def tcp_session(clock: Clock, ends: Ends, options: TcpOptions) -> TransportSession:
    """Return one connection for both directions, alike at both ends; messages have no frame."""
    connection = TcpConnection(clock, ends.up, ends.down, options, options)
    operator = connection.opener
    robot = connection.peer
    up = OrderedMessages(operator, robot, ends.on_command)
    down = OrderedMessages(robot, operator, ends.on_picture)
    connection.open(up.open, down.open)
    return TransportSession(
        lambda message: up.send(message.number, message.size),
        lambda message: down.send(message.number, message.size),
    )
