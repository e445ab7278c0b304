"""The constants of a TCP connection, and what can be set on one end of it.

References:
    The sysctl names in brackets are those of the Linux kernel's administration guide
    (Documentation/networking/ip-sysctl), whose documented defaults are used.
"""

from __future__ import annotations

from dataclasses import dataclass

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown

CONGESTION = ("cubic", "reno")
MSS = 1448  # payload of a full Ethernet segment with TCP time stamps [B]
HEADERS = 52  # IPv4 + TCP with time stamps, on every segment [B]
# Retransmission time-out: floor of its variance part, before a sample (RFC 6298), and longest [s].
MIN_RTO, FIRST_RTO, MAX_RTO = 0.2, 1.0, 120.0


@dataclass(frozen=True, slots=True)
class TcpOptions:
    """One end of a connection.

    Attributes:
        send_buffer: SO_SNDBUF as the program sets it [B] (the kernel doubles it);
            None = tuned by the kernel as the congestion window grows.
        receive_buffer: SO_RCVBUF as the program sets it [B] (doubled likewise); None = tuned.
        congestion: `cubic` or `reno`.
        initial_window: Congestion window at the start [segments] (RFC 6928).
        delayed_ack: How long an acknowledgement waits for data to ride on [s];
            0 acknowledges every segment at once.
        retries: Time-outs in a row after which the connection is given up [tcp_retries2].
        tick: Granularity of the kernel's timers [s]; 0 = exact.
        hystart: Whether slow start ends when the round trip grows (cubic).
        tail_probe: Whether a tail-loss probe goes before the time-out.
    """

    send_buffer: int | None = None
    receive_buffer: int | None = None
    congestion: str = "cubic"
    initial_window: int = 10
    delayed_ack: float = 0.04
    retries: int = 15
    tick: float = 0.004
    hystart: bool = True
    tail_probe: bool = True

    def __post_init__(self) -> None:
        if self.congestion not in CONGESTION:
            raise ConfigError(unknown("congestion control", self.congestion, CONGESTION))
