"""Random numbers keyed by virtual time, so that all senders meet the same conditions.

Time only goes forward here: what was drawn for long ago is forgotten.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import accumulate
from statistics import NormalDist
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.streams import Streams

SLOT_S = 0.001  # resolution of the noise in time [s]
_BLOCK = 8192  # random numbers drawn at once
_STEP = int(0.6180339887498949 * 2.0**64) | 1  # golden ratio of 2**64, odd: visits every number
_MASK = 2**64 - 1
_NORMAL = NormalDist()
_EDGE = 1e-12  # quantiles are limited to (edge, 1 - edge): unbounded laws are infinite beyond


class UniformNumbers(Protocol):
    """A source of uniform numbers, one for each packet."""

    def draw(self, now: float) -> float:
        """Return a number in [0, 1) for a packet sent at `now` [s]."""


MakeNumbers = Callable[[Streams, str], UniformNumbers]
"""Makes the source of a name from the run's random streams."""


class FastNoise:
    """Random numbers that are new in each millisecond, drawn in blocks on demand.

    Packets of the same millisecond have numbers of their own, which follow from that one.

    Args:
        streams: Random streams of the run.
        name: Name of this source.
    """

    def __init__(self, streams: Streams, name: str) -> None:
        self._streams = streams
        self._name = name
        self._blocks: dict[int, NDArray[np.float64]] = {}
        self._slot = -1
        self._count = 0

    def draw(self, now: float) -> float:
        """Implement `UniformNumbers`."""
        slot = int(now / SLOT_S)
        self._count = self._count + 1 if slot == self._slot else 0
        self._slot = slot
        number, inside = divmod(slot, _BLOCK)
        block = self._blocks.get(number)
        if block is None:
            self._blocks.pop(number - 2, None)  # time only goes forward
            rng = self._streams.fresh(f"{self._name}/{number}")
            block = self._blocks[number] = rng.random(_BLOCK)
        first = float(block[inside])
        return _scrambled(first, self._count) if self._count else first


class PacketNumbers:
    """Uniform numbers by the number of the packet: the same ones, whenever it is sent.

    Real packets never leave at the same moment twice, so a function of time would give each run
    losses of its own.

    Args:
        streams: The run's random streams.
        name: Name of this source.
        number: Returns the number of the packet that is being sent.
    """

    def __init__(self, streams: Streams, name: str, number: Callable[[], int]) -> None:
        self._streams = streams
        self._name = name
        self._number = number
        self._place = -1
        self._block = np.empty(0)

    def draw(self, now: float) -> float:
        """Implement `UniformNumbers`."""
        block, inside = divmod(self._number(), _BLOCK)
        if block != self._place:
            self._place = block
            self._block = self._streams.fresh(f"{self._name}/{block}").random(_BLOCK)
        return float(self._block[inside])


def _scrambled(seed: float, count: int) -> float:
    """Return the `count`-th of independent uniform numbers that follow from one.

    References:
        Steele, Lea, Flood: Fast splittable pseudorandom number generators. OOPSLA 2014: a
        counter in golden steps, its bits mixed by shifts and odd factors.
    """
    bits = (int(seed * 2.0**64) + count * _STEP) & _MASK
    bits = ((bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    bits = ((bits ^ (bits >> 27)) * 0x94D049BB133111EB) & _MASK
    return ((bits ^ (bits >> 31)) >> 11) * 2.0**-53


class SlowNoise:
    """Random numbers that change slowly: packets sent close together get similar ones.

    An Ornstein-Uhlenbeck process, exact at each millisecond, seen through the normal law's
    distribution function. The correlation of the process at a distance `t` is exp(-t / time).

    Args:
        streams: Random streams of the run.
        name: Name of this source.
        time: Correlation time [s].

    References:
        Gillespie: Exact numerical simulation of the Ornstein-Uhlenbeck process and its
        integral. Physical Review E 54 (1996), 2084.
    """

    def __init__(self, streams: Streams, name: str, time: float) -> None:
        self._rng = streams.fresh(name)
        self._keep = math.exp(-SLOT_S / time)
        self._fresh = math.sqrt(1.0 - self._keep**2)
        self._number = -1
        self._last = float(self._rng.standard_normal())
        self._block: list[float] = []

    def draw(self, now: float) -> float:
        """Implement `UniformNumbers`."""
        number, inside = divmod(int(now / SLOT_S), _BLOCK)
        while self._number < number:
            self._go_on()
        return _NORMAL.cdf(self._block[inside])

    def _go_on(self) -> None:
        """Draw the next block, even if it is not read: the process continues from it."""
        steps = self._fresh * self._rng.standard_normal(_BLOCK)
        keep = self._keep
        chain = accumulate(steps.tolist(), lambda x, step: keep * x + step, initial=self._last)
        self._block = list(chain)[1:]
        self._number += 1
        self._last = self._block[-1]


class Spells:
    """Two states by turns, each left without memory of how long it has lasted.

    Args:
        streams: Random streams of the run.
        name: Name of this source.
        mean_off: Mean length of a spell of the normal state [s].
        mean_on: Mean length of a spell of the other state [s].
    """

    def __init__(self, streams: Streams, name: str, mean_off: float, mean_on: float) -> None:
        rng = streams.fresh(name)
        self._is_on = bool(rng.random() < mean_on / (mean_off + mean_on))
        self._lengths = _lengths(
            rng, *((mean_on, mean_off) if self._is_on else (mean_off, mean_on))
        )
        self._until = next(self._lengths)

    def is_on(self, now: float) -> bool:
        """Return True if the other state holds at `now` [s]."""
        while now >= self._until:
            self._is_on = not self._is_on
            self._until += next(self._lengths)
        return self._is_on


def _lengths(rng: np.random.Generator, first: float, second: float) -> Iterator[float]:
    """Yield the exponential lengths of two means by turns, without end."""
    while True:
        yield from (rng.standard_exponential((128, 2)) * (first, second)).ravel().tolist()


def normal_quantile(u: float) -> float:
    """Return the quantile of the standard normal distribution at probability `u`."""
    return _NORMAL.inv_cdf(min(max(u, _EDGE), 1.0 - _EDGE))
