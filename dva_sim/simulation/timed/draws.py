"""Random numbers with an index: draw number `k` is the same for every caller, at any time.

Policies are compared on the same events. What befalls an event must therefore hang on its
place in its stream, never on the number of earlier draws. Draws are made in blocks, each
from a random stream of its own, so that any of them can be made again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from dva_sim.kernel.streams import Streams
from dva_sim.simulation.timed.distributions import Constant, Law

BLOCK = 256
KEPT_BLOCKS = 8  # blocks kept: events are queried roughly in their order

T = TypeVar("T")


class Draws(Generic[T]):
    """Random draws for one purpose, by index from 0.

    Args:
        streams: Random streams of the run.
        name: Name of the purpose, unique in the run.
        draw: Function that makes a number of draws from a generator.
    """

    def __init__(
        self,
        streams: Streams,
        name: str,
        draw: Callable[[np.random.Generator, int], list[T]],
    ) -> None:
        self._streams = streams
        self._name = name
        self._draw = draw
        self._blocks: dict[int, list[T]] = {}

    def __getitem__(self, index: int) -> T:
        """Draw number `index`."""
        block = self._blocks.get(index // BLOCK)
        if block is None:
            block = self._make(index // BLOCK)
        return block[index % BLOCK]

    def _make(self, number: int) -> list[T]:
        if len(self._blocks) >= KEPT_BLOCKS:
            del self._blocks[next(iter(self._blocks))]
        rng = self._streams.fresh(f"{self._name}/{number}")
        block = self._blocks[number] = self._draw(rng, BLOCK)
        return block


class Always(Draws[T]):
    """Constant in place of random draws."""

    def __init__(self, value: T) -> None:
        self._value = value

    def __getitem__(self, index: int) -> T:
        return self._value


def times(streams: Streams, name: str, law: Law) -> Draws[float]:
    """Return times by a law [s]."""
    if isinstance(law, Constant):
        return Always(law.mean_s)
    return Draws(streams, name, lambda rng, count: law.sample(rng, count).tolist())


def shares(streams: Streams, name: str) -> Draws[float]:
    """Return numbers between 0 and 1, all alike."""
    return Draws(streams, name, lambda rng, count: rng.random(count).tolist())
