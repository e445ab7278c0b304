"""A TCP connection over two links."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from dva_sim.clock import Clock
from dva_sim.network.tcp.endpoint import TcpEndpoint
from dva_sim.network.tcp.options import TcpOptions


class Carrier(Protocol):
    """One direction of a link, as far as TCP asks."""

    def carry(self, now: float, size: int) -> float | None:
        """When a packet of `size` bytes [B] offered at `now` [s] arrives [s], or None."""


class TcpConnection:
    """Two ends, joined by two links.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        opener: Options of the end that opens.
        peer: Options of the other end.

    Attributes:
        opener: The end that opens.
        peer: The other end.
    """

    def __init__(
        self,
        clock: Clock,
        out: Carrier,
        back: Carrier,
        opener: TcpOptions | None = None,
        peer: TcpOptions | None = None,
    ) -> None:
        self.opener, self.peer = TcpEndpoint(), TcpEndpoint()

    def open(
        self, then: Callable[[], object], accepted: Callable[[], object] | None = None
    ) -> None:
        """Shake hands: `then()` when the opener may write, `accepted()` when the peer may."""
        raise NotImplementedError

    def close(self) -> None:
        """Forget everything: nothing more is sent, delivered or called."""
        raise NotImplementedError
