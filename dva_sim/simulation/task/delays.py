"""Delays of a task: frames to the person, readings to the machine; and noise in the hand.

Both directions are the links of the network, so that delay, jitter and loss mean what they mean
everywhere else; a trial without any of them costs no event.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

import numpy as np

from dva_sim.kernel.streams import Streams
from dva_sim.network.link import Link, make_serialiser
from dva_sim.simulation.task.scenario import OneWayDelay

T = TypeVar("T")
ROUNDING_S = 1e-9  # tolerance by which an item counts as due [s]
SIZE = 100  # size of a reading or frame; the line is so fast that it does not matter [B]


class Channel(Generic[T]):
    """A link in one direction: items arrive late but in order, or are lost.

    Args:
        delay: Delay, jitter and loss.
        extra: Constant delay added to it [s].
        streams: Random streams of the trial.
        name: Name of this direction, which selects its random stream.
    """

    def __init__(self, delay: OneWayDelay, extra: float, streams: Streams, name: str) -> None:
        config = delay.link()
        self._link = Link(config, make_serialiser(config, "up", streams, name), streams, name)
        self._is_plain = not delay.jitter_s and not delay.loss
        self._extra = extra
        self._delay = delay.delay_s + extra
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
        """Return everything that has arrived by `now` [s], oldest first."""
        queue = self._queue
        due = now + ROUNDING_S
        if not queue or queue[0][0] > due:
            return []
        out = []
        while queue and queue[0][0] <= due:
            out.append(queue.popleft()[1])
        return out


def normals(rng: np.random.Generator, block: int = 512) -> Iterator[float]:
    """Yield standard normal numbers without end, drawn in blocks."""
    while True:
        yield from rng.normal(size=block).tolist()


def slow_noise(rng: np.random.Generator, keep: float) -> Iterator[float]:
    """Normal numbers of variance one, each keeping a share of the last one, without end."""
    fresh = (1.0 - keep * keep) ** 0.5
    draws = normals(rng)
    value = next(draws)
    for draw in draws:
        value = keep * value + fresh * draw
        yield value
