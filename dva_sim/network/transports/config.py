"""Transport of commands and pictures, and its options.

No option of a transport that is only in the manner of its paper has a default: its numbers are not
the paper's, so who uses it sets them and says so.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dva_sim.kernel.config import Config

Header = Annotated[int, Field(ge=0, le=200)]
Share = Annotated[float, Field(gt=0, lt=1)]
Positive = Annotated[float, Field(gt=0, le=1e3)]
Buffer = Annotated[int, Field(ge=1_000)] | None


class Udp(Config):
    """Every message at once, and nothing is sent again."""

    kind: Literal["udp"] = "udp"


class Datagrams(Config):
    """Datagrams over UDP, with a rate, repeats and priority as configured.

    Four published transports are configurations of it, **in the manner of** their papers, of which
    only abstracts and descriptions by others could be read. Aims are the papers', laws and numbers
    are not: the additive law stands in for each law of rate.

    ========= =========================================== =====================================
    name      what could be read                          configuration
    ========= =========================================== =====================================
    RTNP      priority for real-time data, end to end     `priority`
    IRTP      error control for crucial messages, rate    `increase`, `decrease`,
              control for the rest                        `repeats_crucial`
    Trinomial a rate with three terms, TCP-friendly       `increase`, `decrease`
    BTP       least round trip and gap between arrivals   `increase`, `decrease`, `tolerance_s`
    ========= =========================================== =====================================

    Attributes:
        header_bytes: Header besides IP and UDP, in each datagram and acknowledgement.
        increase: Datagrams per round trip, with each round trip; None: every message at once.
        decrease: Share of the rate that a loss costs.
        tolerance_s: Queueing in the round trip beyond which it counts as a loss; None: any.
        repeats_crucial: True to send crucial messages again until they have arrived.
        priority: True if the end hosts send its packets first. A queue in the network knows nothing
            of it.

    References:
        Y. Uchimura, T. Yakoh: Bilateral robot system on the real-time network structure. IEEE
        Transactions on Industrial Electronics 51(5), 2004 (from memory).
        Transport layer protocol reconfiguration for network-based robot control system. IEEE
        Networking, Sensing and Control 2005 (IRTP, from memory).
        P. X. Liu, M. Meng, X. Ye, J. Gu: An UDP-based protocol for Internet robots. World Congress
        on Intelligent Control and Automation 2002, DOI 10.1109/WCICA.2002.1022068.
        R. Wirz, R. Marin, M. Ferre, J. Barrio, J. M. Claver, J. Ortego: Bidirectional transport
        protocol for teleoperated robots. IEEE Transactions on Industrial Electronics 56(9), 2009,
        DOI 10.1109/TIE.2009.2025291.
    """

    kind: Literal["datagrams"]
    header_bytes: Header
    increase: Positive | None = None
    decrease: Share | None = None
    tolerance_s: Positive | None = None
    repeats_crucial: bool = False
    priority: bool = False

    @model_validator(mode="after")
    def _has_a_whole_law(self) -> Datagrams:
        if (self.increase is None) != (self.decrease is None):
            raise ValueError("should have both increase and decrease, or neither")
        if self.increase is None and (self.repeats_crucial or self.tolerance_s is not None):
            raise ValueError("repeats_crucial and tolerance_s need increase and decrease")
        return self


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


TransportConfig = Annotated[Udp | Datagrams | Tcp | Zeromq, Field(discriminator="kind")]
"""Called with the number of a message once all of it has arrived."""
