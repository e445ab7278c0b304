"""Sessions between operator and robot, one for each transport."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp import OrderedMessages, TcpConnection, TcpOptions
from dva_sim.network.transports.config import (
    Btp,
    Irtp,
    Rtnp,
    Tcp,
    TransportConfig,
    Trinomial,
    Zeromq,
)
from dva_sim.network.transports.datagrams import DatagramSender
from dva_sim.network.transports.feedback import Echo
from dva_sim.network.transports.interface import Deliver, Ends, TransportMessage, TransportSession
from dva_sim.network.transports.message_parts import IP_UDP, Assembly, parts_of
from dva_sim.network.transports.rate_control import Aimd, LeastRoundTrip, RateLaw, ThreeTerms
from dva_sim.network.zmtp import ZmtpConnection, ZmtpOptions, framed


def open_session(clock: Clock, config: TransportConfig, ends: Ends) -> TransportSession:
    """A session over a transport, as configured."""
    if isinstance(config, Tcp):
        return tcp_session(clock, ends, TcpOptions(send_buffer=config.send_buffer_bytes))
    if isinstance(config, Zeromq):
        return zeromq_session(clock, ends, config)
    if isinstance(config, Trinomial | Irtp | Btp):
        return rate_session(clock, ends, config)
    return plain_session(clock, ends, config.header_bytes if isinstance(config, Rtnp) else 0)


def plain_session(clock: Clock, ends: Ends, header: int) -> TransportSession:
    """Every datagram at once, none of them twice; the header [B] is besides IP and UDP."""

    def sends(link: Link, deliver: Deliver) -> Callable[[TransportMessage], object]:
        add = Assembly(deliver).add

        def send(message: TransportMessage) -> None:
            for part in parts_of(message, header):
                arrival = link.carry(clock.now, part.size + header + IP_UDP)
                if arrival is not None:
                    clock.call_at(arrival, add, part)

        return send

    return TransportSession(sends(ends.up, ends.on_command), sends(ends.down, ends.on_picture))


def rate_session(clock: Clock, ends: Ends, config: Trinomial | Irtp | Btp) -> TransportSession:
    """Two directions, each with a law of rate of its own."""
    header, repeats = config.header_bytes, isinstance(config, Irtp)
    up, down = (
        DatagramSender(clock, link, header, law_of(config), entry, repeats)
        for link, entry in ((ends.up, ends.on_command), (ends.down, ends.on_picture))
    )
    if isinstance(config, Btp):
        answer_each_other(up, down)
    else:
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


def law_of(config: Trinomial | Irtp | Btp) -> RateLaw:
    """The law of rate of a transport that has one."""
    if isinstance(config, Trinomial):
        return ThreeTerms(config.linear, config.square, config.decrease)
    if isinstance(config, Irtp):
        return Aimd(config.increase, config.decrease)
    return LeastRoundTrip(config.tolerance_s, config.widen, config.narrow, config.longest_gap_s)


def answer_each(clock: Clock, sender: DatagramSender, back: Link, header: int) -> None:
    """Let every datagram of a sender be acknowledged by one of its own on the way back."""

    def answer(_: Sequence[Echo]) -> None:
        arrival = back.carry(clock.now, header + IP_UDP)
        if arrival is not None:
            clock.call_at(arrival, sender.hear, sender.echoes())

    sender.on_arrival = answer


def answer_each_other(one: DatagramSender, other: DatagramSender) -> None:
    """Let the acknowledgements of two directions ride on each other's datagrams."""
    one.ride, other.ride = other.echoes, one.echoes
    one.on_arrival, other.on_arrival = other.hear, one.hear


def tcp_session(clock: Clock, ends: Ends, options: TcpOptions) -> TransportSession:
    """One connection for both directions, alike at both ends; nothing frames the messages."""
    connection = TcpConnection(clock, ends.up, ends.down, options, options)
    operator, robot = connection.opener, connection.peer
    up = OrderedMessages(operator, robot, ends.on_command)
    down = OrderedMessages(robot, operator, ends.on_picture)
    connection.open(up.open, down.open)
    return TransportSession(
        lambda message: up.send(message.number, message.size),
        lambda message: down.send(message.number, message.size),
    )
