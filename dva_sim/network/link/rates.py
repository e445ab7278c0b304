"""Rates of links: a serial line or a recorded one, and the queue before it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

OPPORTUNITY_BYTES = 1500  # bytes that one line of a Mahimahi trace lets through [B]


class Serialiser(ABC):
    """Serialiser of a link: turns queued bytes into departures, in order.

    Attributes:
        rate_bps: Its rate [bit/s]; None where it varies.
    """

    rate_bps: float | None

    @abstractmethod
    def backlog_bytes(self, now: float) -> float:
        """Return bytes still waiting or under way onto the link at `now` [B]."""

    @abstractmethod
    def depart(self, now: float, size: int) -> float:
        """Return when the last byte of a packet of `size` bytes [B] offered at `now` leaves [s]."""

    @abstractmethod
    def last_departure(self) -> float:
        """Return when the last accepted byte leaves, or has left [s]."""

    def has_room(self, now: float, size: int, room: int) -> bool:
        """Return True if a queue with `room` for so many bytes [B] takes a packet at `now`."""
        return self.backlog_bytes(now) + size <= room

    def offer(self, now: float, size: int, room: int) -> float | None:
        """Like `depart`, or None if the queue does not take the packet."""
        return self.depart(now, size) if self.has_room(now, size, room) else None


class ConstantRate(Serialiser):
    """A serial line of fixed rate [bit/s]."""

    def __init__(self, rate_bps: float) -> None:
        self.rate_bps: float = rate_bps
        self._seconds_per_byte = 8.0 / rate_bps
        self._free_at = 0.0

    def change_rate(self, now: float, rate_bps: float) -> None:
        """Continue with the waiting bytes at another rate [bit/s]."""
        waiting = self.backlog_bytes(now)
        self.rate_bps = rate_bps
        self._seconds_per_byte = 8.0 / rate_bps
        self._free_at = now + waiting * self._seconds_per_byte

    @override
    def backlog_bytes(self, now: float) -> float:
        free_at = self._free_at
        return (free_at - now) / self._seconds_per_byte if free_at > now else 0.0

    @override
    def last_departure(self) -> float:
        return self._free_at

    @override
    def depart(self, now: float, size: int) -> float:
        start = now if now > self._free_at else self._free_at
        self._free_at = start + size * self._seconds_per_byte
        return self._free_at

    @override
    def offer(self, now: float, size: int, room: int) -> float | None:
        # Both steps in one, because every packet comes here.
        start = self._free_at
        seconds_per_byte = self._seconds_per_byte
        if start > now:
            if (start - now) / seconds_per_byte + size > room:
                return None
        elif size > room:
            return None
        else:
            start = now
        self._free_at = start = start + size * seconds_per_byte
        return start


class TraceRate(Serialiser):
    """A recorded link: each line of the trace lets 1500 bytes through at that millisecond.

    The trace repeats at its end. An opportunity that finds the queue empty is wasted, one
    that is only half used serves the next packet in the same millisecond.

    References:
        Winstein, Sivaraman, Balakrishnan: Stochastic forecasts achieve high throughput and
        low delay over cellular networks. NSDI 2013 (the form of the traces).
    """

    rate_bps = None

    def __init__(self, times_s: NDArray[np.float64], offset_s: float) -> None:
        self._times = times_s
        self._period = float(times_s[-1])
        self._offset = offset_s
        self._index = self._first_at(0.0)
        self._left = OPPORTUNITY_BYTES
        self._queued: deque[tuple[float, int]] = deque()
        self._backlog = 0

    def _first_at(self, now: float) -> int:
        """Return the running number of the first opportunity not before `now`."""
        laps, inside = divmod(now + self._offset, self._period)
        # A rounding error must not skip the opportunity of this very millisecond.
        inside -= 1e-9
        return int(laps) * len(self._times) + int(np.searchsorted(self._times, inside))

    def _time_of(self, index: int) -> float:
        laps, inside = divmod(index, len(self._times))
        return laps * self._period + float(self._times[inside]) - self._offset

    @override
    def backlog_bytes(self, now: float) -> float:
        queued = self._queued
        while queued and queued[0][0] <= now:
            self._backlog -= queued.popleft()[1]
        return float(self._backlog)

    @override
    def last_departure(self) -> float:
        # At the opportunity that was used last.
        return self._time_of(self._index)

    @override
    def depart(self, now: float, size: int) -> float:
        first = self._first_at(now)
        if first > self._index:
            self._index = first
            self._left = OPPORTUNITY_BYTES
        rest = size
        while rest > self._left:
            rest -= self._left
            self._index += 1
            self._left = OPPORTUNITY_BYTES
        self._left -= rest
        left_at = max(now, self._time_of(self._index))
        self._queued.append((left_at, size))
        self._backlog += size
        return left_at


class PacketQueue(Serialiser):
    """A line with room for so many packets, the one on its way onto the link among them.

    Args:
        line: Model of the line's rate.
        packets: Room; bytes do not count.
    """

    def __init__(self, line: Serialiser, packets: int) -> None:
        self._line = line
        self._room = packets
        self._leaving: deque[float] = deque()
        self.rate_bps = line.rate_bps

    @override
    def backlog_bytes(self, now: float) -> float:
        return self._line.backlog_bytes(now)

    @override
    def last_departure(self) -> float:
        return self._line.last_departure()

    @override
    def depart(self, now: float, size: int) -> float:
        left_at = self._line.depart(now, size)
        self._leaving.append(left_at)
        return left_at

    @override
    def has_room(self, now: float, size: int, room: int) -> bool:
        # Packets are counted instead of bytes.
        leaving = self._leaving
        while leaving and leaving[0] <= now:
            leaving.popleft()
        return len(leaving) < self._room
