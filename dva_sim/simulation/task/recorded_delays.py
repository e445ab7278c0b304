"""Drives with the delays and losses of a link as they were recorded, or simulated beforehand.

A recording says of each message of a regular stream when it was made and when it arrived. A drive
begins at any place of it and goes on from its beginning when it comes to its end.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.simulation.task.delays import ROUNDING_S, Channel, T

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FrameStream:
    """Fates of the messages of one direction.

    Attributes:
        period: Between two messages [s].
        delays: Delay of each message from creation to arrival [s], shape `(n,)`; infinity if it
            never arrived. Recorded from its first message on, without a gap.
    """

    period: float
    delays: Floats

    def delay_at(self, time: float) -> float:
        """Return the delay of the message made at `time` since the recording began [s]."""
        return float(self.delays[math.floor(time / self.period + ROUNDING_S) % len(self.delays)])


@dataclass(frozen=True)
class RecordedDelays:
    """Both directions of a link.

    Attributes:
        up: Fates of the commands.
        down: Fates of the frames.
    """

    up: FrameStream
    down: FrameStream

    @property
    def length(self) -> float:
        """Length of the recording of commands [s]."""
        return self.up.period * len(self.up.delays)


class RecordedChannel(Channel[T]):
    """One direction of a recording; what newer things have overtaken is thrown away.

    Args:
        stream: Fates of its messages.
        begin: Place in the recording at which the trial begins [s].
        extra: On top of the delays, always [s].
    """

    def __init__(self, stream: FrameStream, begin: float, extra: float) -> None:
        self._stream = stream
        self._begin = begin
        self._extra = extra
        self._numbers = count()
        self._newest = -1
        self._coming: list[tuple[float, int, T]] = []

    @override
    def put(self, now: float, item: T) -> None:
        delay = self._stream.delay_at(self._begin + now)
        if math.isfinite(delay):
            arrival = now + delay + self._extra
            heapq.heappush(self._coming, (arrival, next(self._numbers), item))

    @override
    def take(self, now: float) -> list[T]:
        out = []
        due = now + ROUNDING_S
        while self._coming and self._coming[0][0] <= due:
            _, number, item = heapq.heappop(self._coming)
            if number > self._newest:
                self._newest = number
                out.append(item)
        return out
