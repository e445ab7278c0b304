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


@dataclass(frozen=True, slots=True)
class TcpOptions:
    """One end of a connection.

    The switches in the second half leave a mechanism out, to show what it is worth.

    Attributes:
        send_buffer: SO_SNDBUF as the program sets it [B] (the kernel doubles it);
            None = tuned by the kernel as the congestion window grows.
        receive_buffer: SO_RCVBUF as the program sets it [B] (doubled likewise); None = tuned.
        mss: Payload of a full segment [B]: Ethernet with TCP time stamps.
        headers: IPv4 + TCP with time stamps, on every segment [B].
        nodelay: TCP_NODELAY; without it a small segment waits for the acknowledgement of the
            last small one (RFC 896, as draft-minshall-nagle-01 amends it).
        congestion: `cubic` or `reno`.
        initial_window: Congestion window at the start [segments] (RFC 6928).
        delayed_ack: Time that an acknowledgement waits for data to travel with [s]; 0 acknowledges
            every segment at once.
        min_rto: Floor of the variance part of the retransmission time-out [s].
        first_rto: Time-out before there is a round-trip sample [s] (RFC 6298).
        max_rto: Longest time-out [s].
        retries: Time-outs in a row after which the connection is given up [tcp_retries2].
        syn_retries: Time-outs in a row after which opening is given up [tcp_syn_retries].
        syn_linear: Openings repeated at a fixed interval before doubling
            [tcp_syn_linear_timeouts].
        tick: Granularity of the kernel's timers [s]; 0 = exact.
        handshake: True if opening takes a round trip.
        congestion_window: True to limit sending by a congestion window.
        hystart: True if slow start ends when the round trip grows (cubic).
        idle_restart: True if the window shrinks after a time-out without sending
            [tcp_slow_start_after_idle].
        rtt_variance: True if the time-out follows the variance of the round trip.
        tail_probe: True if a tail-loss probe precedes the time-out.
        rack: True if loss is judged by time; otherwise by three later segments acknowledged.
        collapse: True if small neighbours are sent again as one segment [tcp_retrans_collapse].
        undo: True if a needless recovery is undone (by time stamps).
    """

    send_buffer: int | None = None
    receive_buffer: int | None = None
    mss: int = 1448
    headers: int = 52
    nodelay: bool = True
    congestion: str = "cubic"
    initial_window: int = 10
    delayed_ack: float = 0.04
    min_rto: float = 0.2
    first_rto: float = 1.0
    max_rto: float = 120.0
    retries: int = 15
    syn_retries: int = 6
    syn_linear: int = 4
    tick: float = 0.004
    handshake: bool = True
    congestion_window: bool = True
    hystart: bool = True
    idle_restart: bool = True
    rtt_variance: bool = True
    tail_probe: bool = True
    rack: bool = True
    collapse: bool = True
    undo: bool = True

    def __post_init__(self) -> None:
        if self.congestion not in CONGESTION:
            raise ConfigError(unknown("congestion control", self.congestion, CONGESTION))
