"""Transport of commands and pictures, and its options.

No option of a transport that is only in the manner of its paper has a default: its numbers are not
the paper's, so who uses it sets them and says so.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dva_sim.kernel.config import Config

Header = Annotated[int, Field(ge=0, le=200)]
Share = Annotated[float, Field(gt=0, lt=1)]
Positive = Annotated[float, Field(gt=0, le=1e3)]
Buffer = Annotated[int, Field(ge=1_000)] | None


class Udp(Config):
    """Every message at once, and nothing is sent again."""

    kind: Literal["udp"] = "udp"


class Rtnp(Config):
    """In the manner of RTNP: every message at once, with priority at the end hosts.

    **What could be read**: that it is a transport for teleoperation which gives real-time data
    priority from end to end (the dissertation); of a network for bilateral robot control by the
    same authors, that it is made for hard real time, with a device and message handler of its own.
    **The gap**: its formats, its priorities, and what processing at its hosts costs.
    **Simplification**: one priority, strict but not preemptive, in the queue of the end hosts; a
    queue in the network knows nothing of it.

    Attributes:
        header_bytes: Header besides IP and UDP, in each datagram.

    References:
        Y. Uchimura, T. Yakoh: Bilateral robot system on the real-time network structure. IEEE
        Transactions on Industrial Electronics 51(5), 2004 (from memory, not read).
        Y. Uchimura, N. Yamasaki, T. Yakoh, K. Ohnishi: Real-time network system by responsive
        processor and its application to bilateral robot control. Transactions of the SICE E-4(1),
        2005 (only its beginning could be read).
        J. Lee, S. Payandeh, L. Trajkovic: Performance evaluation of transport protocols for
        Internet-based teleoperation systems (names RTNP, IRTP and ETP; only its beginning read).
    """

    kind: Literal["rtnp"]
    header_bytes: Header


class Trinomial(Config):
    """In the manner of the trinomial protocol: see `laws.ThreeTerms`.

    Each direction is a flow of its own, and each of its datagrams is acknowledged by one.

    Attributes:
        header_bytes: Header besides IP and UDP, in each datagram and acknowledgement.
        linear: Datagrams per round trip, with each round trip since the last loss.
        square: Datagrams per round trip, with the square of that number.
        decrease: Share of the rate that a loss costs.
    """

    kind: Literal["trinomial"]
    header_bytes: Header
    linear: Annotated[float, Field(ge=0, le=100)]
    square: Annotated[float, Field(ge=0, le=100)]
    decrease: Share


class Irtp(Config):
    """In the manner of IRTP: error control for crucial data, rate control for the rest.

    Crucial messages go at once, and again until they have arrived; the others are sent as often as
    a law of additive increase and multiplicative decrease lets them, and never again.

    **What could be read**: that data of a teleoperation are either crucial, for which loss must be
    low, or real-time, for which delay and jitter must be; that one protocol reconfigures itself for
    both; that it is connection-oriented over IP, with error control for the crucial, rate control
    for the real-time data, and small headers (the dissertation).
    **The gap**: its law of rate (that of `laws.Aimd` stands in), its way of error control (TCP's
    time-out and reordering threshold stand in), and the size of its header.
    **Simplifications**: no handshake; it runs over UDP here, not over IP.

    Attributes:
        header_bytes: Header besides IP and UDP, in each datagram and acknowledgement.
        increase: Datagrams per round trip, with each round trip.
        decrease: Share of the rate that a loss costs.

    References:
        Transport layer protocol reconfiguration for network-based robot control system. IEEE
        Networking, Sensing and Control 2005 (only the abstract could be read, in which IRTP is not
        named; that it is this paper is from memory).
    """

    kind: Literal["irtp"]
    header_bytes: Header
    increase: Positive
    decrease: Share


class Btp(Config):
    """In the manner of BTP: see `laws.LeastRoundTrip`.

    Both directions are one session: acknowledgements ride on the datagrams of the other.

    Attributes:
        header_bytes: Header besides IP and UDP, in each datagram, with the acknowledgements.
        tolerance_s: Queueing in the round trip that is taken for none.
        widen: Factor of the gap where there is more, or something is lost.
        narrow: Divisor of the gap where there is not.
        longest_gap_s: Between two datagrams.
    """

    kind: Literal["btp"]
    header_bytes: Header
    tolerance_s: Positive
    widen: Annotated[float, Field(gt=1, le=10)]
    narrow: Annotated[float, Field(gt=1, le=10)]
    longest_gap_s: Positive


class Tcp(Config):
    """One TCP connection; whatever was written arrives, in order.

    Attributes:
        send_buffer_bytes: Size of the send buffer; by default the kernel tunes it.
    """

    kind: Literal["tcp"]
    send_buffer_bytes: Buffer = None


class Zeromq(Config):
    """A publisher and a subscriber of ZeroMQ in each direction, each pair on its own connection.

    Attributes:
        conflate: True if the publisher keeps only the newest message in ZeroMQ's queue.
        send_buffer_bytes: Size of the send buffer; by default the kernel tunes it.
    """

    kind: Literal["zeromq"]
    conflate: bool = True
    send_buffer_bytes: Buffer = None


TransportConfig = Annotated[
    Udp | Rtnp | Trinomial | Irtp | Btp | Tcp | Zeromq, Field(discriminator="kind")
]
"""Called with the number of a message once all of it has arrived."""
