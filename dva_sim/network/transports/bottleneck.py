"""One congested link that several flows share: each has a link of its own onto the same line.

The line is first-in-first-out with a drop-tail queue. If the queue is that of the end hosts
themselves, packets of a flow with priority pass those of the others in it.
"""

from __future__ import annotations

from collections import deque
from typing import Annotated, Literal

from pydantic import Field

from dva_sim.config import Config
from dva_sim.network.link import ConstantRate, Direction, Link, LinkConfig, Serialiser
from dva_sim.streams import Streams

WAYS: tuple[Direction, Direction] = ("up", "down")


class BottleneckConfig(Config):
    """The congested link; both directions are alike.

    Attributes:
        rate_bps: Of the line.
        queue_bytes: Room in its drop-tail queue.
        delay_s: One way, besides queue and line.
        loss: Probability that a packet is lost on the way, besides those that find no room.
        place: Where its queue is: in the `network`, or in the end `hosts` whose own line it is.
    """

    rate_bps: Annotated[float, Field(ge=1e4)] = 1e6
    queue_bytes: Annotated[int, Field(ge=3_000)] = 25_000
    delay_s: Annotated[float, Field(ge=0, le=10)] = 0.02
    loss: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    place: Literal["network", "hosts"] = "network"


class Bottleneck:
    """Both directions of the congested link.

    Args:
        config: Of the link.
        streams: The run's luck.
    """

    def __init__(self, config: BottleneckConfig, streams: Streams) -> None:
        self._config, self._streams = config, streams
        self._link = LinkConfig(
            delay_s=config.delay_s,
            loss=config.loss,
            rate_bps=config.rate_bps,
            queue_bytes=config.queue_bytes,
        )
        self._lines = {way: Line(config.rate_bps) for way in WAYS}

    def link(self, flow: str, way: Direction, priority: bool = False) -> Link:
        """The way of a flow over the link; it counts only what is the flow's own.

        Args:
            flow: Its name, for its luck.
            way: Which direction.
            priority: Whether the end hosts prefer its packets, which matters in their queue only.
        """
        line: Serialiser = self._lines[way]
        if priority and self._config.place == "hosts":
            line = Passing(self._lines[way], self._config.rate_bps)
        return Link(self._link, line, self._streams, f"{flow}/{way}", way)


class Line(Serialiser):
    """A serial line that knows when the packet under way has left it.

    Args:
        rate_bps: [bit/s]
    """

    def __init__(self, rate_bps: float) -> None:
        self.rate_bps, self._line = rate_bps, ConstantRate(rate_bps)
        self._ends: deque[float] = deque()

    def backlog_bytes(self, now: float) -> float:
        """See `Serialiser`."""
        return self._line.backlog_bytes(now)

    def depart(self, now: float, size: int) -> float:
        """See `Serialiser`."""
        self.next_end(now)
        end = self._line.depart(now, size)
        self._ends.append(end)
        return end

    def next_end(self, now: float) -> float:
        """When the packet under way has left [s]; `now` if there is none."""
        while self._ends and self._ends[0] <= now:
            self._ends.popleft()
        return self._ends[0] if self._ends else now


class Passing(Serialiser):
    """A line for packets with priority: they wait only for the one under way, and for each other.

    The time that they take is taken from the line. Simplification: packets that already wait are
    not delayed by one that passes them; those that come later are.

    Args:
        line: Where the others are.
        rate_bps: Of the line [bit/s].
    """

    def __init__(self, line: Line, rate_bps: float) -> None:
        self.rate_bps, self._line = rate_bps, line
        self._seconds_per_byte, self._free_at = 8.0 / rate_bps, 0.0

    def backlog_bytes(self, now: float) -> float:
        """See `Serialiser`; packets without priority make way, so only these count."""
        return max(0.0, self._free_at - now) / self._seconds_per_byte

    def depart(self, now: float, size: int) -> float:
        """See `Serialiser`."""
        start = self._free_at if self._free_at > now else self._line.next_end(now)
        self._line.depart(now, size)
        self._free_at = start + size * self._seconds_per_byte
        return self._free_at
