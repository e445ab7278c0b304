"""How late: frames to the person, readings to the machine, and noise in the hand.

Both directions are the links of the network, so that delay, jitter and loss mean what they mean
everywhere else; a trial without any of them costs no event.

Drives with the delays and losses of a link as they were recorded, or simulated beforehand.

A recording says of each message of a regular stream when it was made and when it arrived. A drive
begins at any place of it and goes on from its beginning when it comes to its end.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.streams import Streams
from dva_sim.network.link import Link, make_serialiser
from dva_sim.simulation.task.scenario import OneWayDelay

T = TypeVar("T")
EARLY = 1e-9  # what is due now comes now, whatever the rounding [s]
SIZE = 100  # of a reading or frame [B]: the line is so fast that it does not matter


class Channel(Generic[T]):
    """One direction: what is put in at one end comes out late, in order, or not at all.

    Args:
        way: Delay, jitter, loss.
        extra: On top of them, always [s].
        streams: The luck of the trial.
        name: Of this direction, for its luck.
    """

    def __init__(self, way: OneWayDelay, extra: float, streams: Streams, name: str) -> None:
        config = way.link()
        self._link = Link(config, make_serialiser(config, "up", streams, name), streams, name)
        self._is_plain = not way.jitter_s and not way.loss
        self._extra, self._delay = extra, way.delay_s + extra
        self._queue: deque[tuple[float, T]] = deque()

    def put(self, now: float, item: T) -> None:
        """Send something at `now` [s]."""
        if self._is_plain:
            self._queue.append((now + self._delay, item))
            return
        arrival = self._link.carry(now, SIZE)
        if arrival is not None:
            self._queue.append((arrival + self._extra, item))

    def take(self, now: float) -> list[T]:
        """Everything that has arrived by `now` [s], oldest first."""
        queue, due = self._queue, now + EARLY
        if not queue or queue[0][0] > due:
            return []
        out = []
        while queue and queue[0][0] <= due:
            out.append(queue.popleft()[1])
        return out


def normals(rng: np.random.Generator, block: int = 512) -> Iterator[float]:
    """Standard normal numbers without end, drawn in blocks."""
    while True:
        yield from rng.normal(size=block).tolist()


def slow_noise(rng: np.random.Generator, keep: float) -> Iterator[float]:
    """Normal numbers of variance one, each keeping a share of the last one, without end."""
    fresh, draws = (1.0 - keep * keep) ** 0.5, normals(rng)
    value = next(draws)
    for draw in draws:
        value = keep * value + fresh * draw
        yield value


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FrameStream:
    """What became of the messages of one direction.

    Attributes:
        period: Between two messages [s].
        delays: Of each message, from when it was made until it was there [s], shape `(n,)`;
            infinity if it never was. Recorded from its first message on, without a gap.
    """

    period: float
    delays: Floats

    def delay_at(self, time: float) -> float:
        """Of the message made at `time` since the recording began, or just before [s]."""
        return float(self.delays[math.floor(time / self.period + EARLY) % len(self.delays)])


@dataclass(frozen=True)
class RecordedDelays:
    """Both directions of a link.

    Attributes:
        up: What became of commands.
        down: What became of frames.
    """

    up: FrameStream
    down: FrameStream

    @property
    def length(self) -> float:
        """How long the commands were recorded [s]."""
        return self.up.period * len(self.up.delays)


class RecordedChannel(Channel[T]):
    """One direction of a recording; what newer things have overtaken is thrown away.

    Args:
        stream: What became of its messages.
        begin: Where in the recording the trial begins [s].
        extra: On top of the delays, always [s].
    """

    def __init__(self, stream: FrameStream, begin: float, extra: float) -> None:
        self._stream, self._begin, self._extra = stream, begin, extra
        self._numbers, self._newest = count(), -1
        self._coming: list[tuple[float, int, T]] = []

    def put(self, now: float, item: T) -> None:
        """See `Channel`."""
        delay = self._stream.delay_at(self._begin + now)
        if math.isfinite(delay):
            arrival = now + delay + self._extra
            heapq.heappush(self._coming, (arrival, next(self._numbers), item))

    def take(self, now: float) -> list[T]:
        """See `Channel`."""
        out, due = [], now + EARLY
        while self._coming and self._coming[0][0] <= due:
            _, number, item = heapq.heappop(self._coming)
            if number > self._newest:
                self._newest = number
                out.append(item)
        return out
