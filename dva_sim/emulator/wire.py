"""One direction of the emulated link: decides when a packet that is offered now comes out.

Drop-tail queue, serialisation at the rate, loss, delay with jitter, in this order. It knows no
device and no clock: the forwarder asks it with real packets, tests with scripted ones.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from numpy.random import Generator

from dva_sim.network.condition import Condition
from dva_sim.streams import Streams

_BLOCK = 4096


@dataclass(frozen=True)
class WireConfig:
    """What one direction does to packets.

    Attributes:
        delay_s: Propagation delay [s].
        jitter_s: Half-width of a uniform law around the delay [s].
        loss: Share of the packets lost in the long run.
        burst_pkts: Mean length of a run of lost packets (Gilbert-Elliott: all is lost in the
            bad state, nothing in the good one); None is independent losses.
        rate_bps: Serialisation rate [bit/s].
        queue_pkts: Packets that find room, with the one that is being sent.
        reorder: A packet may come out before an earlier one.

    References:
        Gilbert, "Capacity of a burst-noise channel", Bell System Technical Journal 39 (1960).
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    loss: float = 0.0
    burst_pkts: float | None = None
    rate_bps: float = math.inf
    queue_pkts: int = 100
    reorder: bool = False

    @classmethod
    def of(cls, condition: Condition) -> WireConfig:
        """What a condition sets; both directions are alike."""
        delay_s = 1e-3 * condition.delay_ms
        return cls(
            delay_s=delay_s,
            jitter_s=condition.jitter_frac * delay_s,
            loss=condition.loss,
            burst_pkts=condition.burst_pkts,
            rate_bps=1e3 * condition.rate_kbit,
            queue_pkts=condition.queue_pkts,
            reorder=condition.reorder,
        )


@dataclass
class Counts:
    """What became of the packets.

    Attributes:
        offered: All of them.
        lost: By chance.
        tail: Because the queue was full.
    """

    offered: int = 0
    lost: int = 0
    tail: int = 0


class Wire:
    """One direction.

    Args:
        config: What it does.
        streams: All luck of the run.
        name: Of this direction, for its luck: losses and jitter have a stream each.
    """

    def __init__(self, config: WireConfig, streams: Streams, name: str) -> None:
        self.config = config
        self.counts = Counts()
        self._loss = Losses(config.loss, config.burst_pkts, streams[f"emulator/{name}/loss"])
        self._jitter = Uniform(streams[f"emulator/{name}/jitter"])
        self._departures: deque[float] = deque()  # of what is in the queue
        self._last_release = -math.inf

    def offer(self, now: float, size: int) -> float | None:
        """When a packet of `size` bytes [B] offered at `now` comes out [s]; None is never."""
        self.counts.offered += 1
        queue = self._departures
        while queue and queue[0] <= now:
            queue.popleft()
        if len(queue) >= self.config.queue_pkts:
            self.counts.tail += 1
            return None
        departure = (queue[-1] if queue else now) + 8 * size / self.config.rate_bps
        queue.append(departure)
        if self._loss.takes_next():
            self.counts.lost += 1
            return None
        return self._release(departure)

    def backlog(self, now: float) -> int:
        """Packets in the queue at `now`, with the one that is being sent."""
        return sum(departure > now for departure in self._departures)

    def _release(self, departure: float) -> float:
        config = self.config
        release = departure + config.delay_s + config.jitter_s * (2 * self._jitter.draw() - 1)
        if not config.reorder:
            release = max(release, self._last_release)
        self._last_release = release
        return release


class Uniform:
    """Numbers between 0 and 1, drawn in blocks."""

    def __init__(self, rng: Generator) -> None:
        self._rng = rng
        self._ahead: list[float] = []

    def draw(self) -> float:
        """The next one."""
        if not self._ahead:
            self._ahead = self._rng.random(_BLOCK).tolist()[::-1]
        return self._ahead.pop()


@dataclass
class Losses:
    """Which packets are lost: each by itself, or in runs.

    Attributes:
        share: Lost in the long run.
        burst: Mean length of a run [packets]; None is each packet by itself.
        rng: Luck: one number per packet.
    """

    share: float
    burst: float | None
    rng: Generator
    _bad: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self._luck = Uniform(self.rng)
        if self.burst is not None:
            self._leave = 1 / self.burst
            self._enter = self.share * self._leave / (1 - self.share)

    def takes_next(self) -> bool:
        """Whether the next packet is lost."""
        luck = self._luck.draw()
        if self.burst is None:
            return luck < self.share
        self._bad = luck >= self._leave if self._bad else luck < self._enter
        return self._bad
