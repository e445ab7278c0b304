"""Filters between the accelerometer and the command, one kind per name.

All take samples one by one and are asked for a value when a command is due.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

Sample = tuple[float, float]
BATCH = 20  # size of the dissertation's buffer


class Filter(Protocol):
    """What a phone needs of a filter; samples are (speed level, turn [deg])."""

    def add(self, sample: Sample) -> None:
        """Take the next sample."""

    def value(self) -> Sample:
        """The filtered value now; a filter that works in batches starts the next one."""

    @property
    def span(self) -> int:
        """How many fresh samples the value rests on."""


class BatchMedian:
    """The dissertation's filter: the median over a buffer of which only a part is fresh.

    When the time runs out before the buffer is full, the slots not yet refreshed keep what
    they held: with few fresh samples the median of a sorted copy stays frozen at the old
    values, and sorting in place (the fresh samples then overwrite the smallest) ratchets up.

    Args:
        slots: Size of the buffer.
        in_place: Sort the buffer itself rather than a copy of it.
    """

    def __init__(self, slots: int = BATCH, in_place: bool = False) -> None:
        self._slots, self._in_place, self._filled = slots, in_place, 0
        self._speed, self._turn = [0.0] * slots, [0.0] * slots

    def add(self, sample: Sample) -> None:
        """See `Filter`."""
        if self._filled < self._slots:
            self._speed[self._filled], self._turn[self._filled] = sample
            self._filled += 1

    @property
    def span(self) -> int:
        """See `Filter`."""
        return self._filled

    def value(self) -> Sample:
        """See `Filter`."""
        self._filled = 0
        if self._in_place:
            self._speed.sort()
            self._turn.sort()
        return _median(self._speed), _median(self._turn)


class MovingMedian:
    """The median of the newest samples: the mended filter.

    Args:
        window: How many samples it covers.
    """

    def __init__(self, window: int = 5) -> None:
        self._speed: deque[float] = deque(maxlen=window)
        self._turn: deque[float] = deque(maxlen=window)

    def add(self, sample: Sample) -> None:
        """See `Filter`."""
        self._speed.append(sample[0])
        self._turn.append(sample[1])

    @property
    def span(self) -> int:
        """See `Filter`."""
        return len(self._speed)

    def value(self) -> Sample:
        """See `Filter`."""
        if not self._speed:
            return 0.0, 0.0
        return _median(self._speed), _median(self._turn)


class Last:
    """No filter: the newest sample as it is."""

    def __init__(self) -> None:
        self._sample: Sample = (0.0, 0.0)

    def add(self, sample: Sample) -> None:
        """See `Filter`."""
        self._sample = sample

    @property
    def span(self) -> int:
        """See `Filter`."""
        return 1

    def value(self) -> Sample:
        """See `Filter`."""
        return self._sample


def _median(values: Iterable[float]) -> float:
    """Of a short list: `sorted` is many times faster than `numpy.median` here."""
    ordered = sorted(values)
    middle = len(ordered) // 2
    if len(ordered) % 2:
        return ordered[middle]
    return 0.5 * (ordered[middle - 1] + ordered[middle])


FILTERS: dict[str, Callable[[], Filter]] = {
    "median20-copy": BatchMedian,
    "median20-inplace": lambda: BatchMedian(in_place=True),
    "median5": MovingMedian,
    "none": Last,
}
