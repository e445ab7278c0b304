"""One direction of a link: drop-tail queue, serialisation, loss, delay with jitter.

A packet's fate is known when it is sent, because the queue is first-in-first-out:
no event is spent inside the link. Luck is a function of virtual time, so that two
patterns that send at different moments still meet the same weather.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dva_sim.config import Config
from dva_sim.errors import ConfigError
from dva_sim.streams import Streams

OPPORTUNITY_BYTES = 1500  # what one line of a Mahimahi trace lets through
_SLOT_S = 0.001
_BLOCK = 8192
_GOLDEN = 0.6180339887498949


class LinkConfig(Config):
    """What lies between a robot and everybody else; the same in both directions.

    Attributes:
        delay_s: One-way propagation delay.
        jitter_s: Half-width of a uniform law around the delay; packets never overtake.
        loss: Probability that a packet is lost, each way.
        rate_bps: Serialisation rate; without effect where a trace gives it.
        queue_bytes: Room in the drop-tail queue before the link.
        trace_up: Recorded packet opportunities towards the robot (Mahimahi form).
        trace_down: The same from the robot.
    """

    delay_s: Annotated[float, Field(ge=0, le=30)] = 0.0
    jitter_s: Annotated[float, Field(ge=0, le=30)] = 0.0
    loss: Annotated[float, Field(ge=0, le=0.9)] = 0.0
    rate_bps: Annotated[float, Field(ge=1e3)] = 20e6
    queue_bytes: Annotated[int, Field(ge=3_000)] = 150_000
    trace_up: str | None = None
    trace_down: str | None = None

    @model_validator(mode="after")
    def _causal(self) -> LinkConfig:
        if self.jitter_s > self.delay_s:
            raise ValueError(f"jitter_s {self.jitter_s:g} is above delay_s {self.delay_s:g}")
        return self


class Serialiser(Protocol):
    """Turns queued bytes into departures, in order."""

    def backlog_bytes(self, now: float) -> float:
        """Bytes still waiting or under way onto the link at `now` [B]."""

    def depart(self, now: float, size: int) -> float:
        """When the last byte of a packet of `size` bytes [B] offered at `now` has left [s]."""


class ConstantRate:
    """A serial line of fixed rate [bit/s]."""

    def __init__(self, rate_bps: float) -> None:
        self._seconds_per_byte = 8.0 / rate_bps
        self._free_at = 0.0

    def change_rate(self, now: float, rate_bps: float) -> None:
        """Go on at another rate [bit/s] with the bytes that wait."""
        waiting = self.backlog_bytes(now)
        self._seconds_per_byte = 8.0 / rate_bps
        self._free_at = now + waiting * self._seconds_per_byte

    def backlog_bytes(self, now: float) -> float:
        """See `Serialiser`."""
        return max(0.0, self._free_at - now) / self._seconds_per_byte

    def depart(self, now: float, size: int) -> float:
        """See `Serialiser`."""
        start = now if now > self._free_at else self._free_at
        self._free_at = start + size * self._seconds_per_byte
        return self._free_at


class TraceRate:
    """A recorded link: each line of the trace lets 1500 bytes through at that millisecond.

    The trace repeats at its end. An opportunity that finds the queue empty is wasted, one
    that is only half used serves the next packet in the same millisecond.

    References:
        Winstein, Sivaraman, Balakrishnan: Stochastic forecasts achieve high throughput and
        low delay over cellular networks. NSDI 2013 (the form of the traces).
    """

    def __init__(self, times_s: NDArray[np.float64], offset_s: float) -> None:
        self._times = times_s
        self._period = float(times_s[-1])
        self._offset = offset_s
        self._index = self._first_at(0.0)
        self._left = OPPORTUNITY_BYTES
        self._queued: list[tuple[float, int]] = []

    def _first_at(self, now: float) -> int:
        """Running number of the first opportunity not before `now`."""
        laps, inside = divmod(now + self._offset, self._period)
        inside -= 1e-9
        return int(laps) * len(self._times) + int(np.searchsorted(self._times, inside))

    def _time_of(self, index: int) -> float:
        laps, inside = divmod(index, len(self._times))
        return laps * self._period + float(self._times[inside]) - self._offset

    def backlog_bytes(self, now: float) -> float:
        """See `Serialiser`."""
        self._queued = [(t, size) for t, size in self._queued if t > now]
        return float(sum(size for _, size in self._queued))

    def depart(self, now: float, size: int) -> float:
        """See `Serialiser`."""
        first = self._first_at(now)
        if first > self._index:
            self._index, self._left = first, OPPORTUNITY_BYTES
        rest = size
        while rest > self._left:
            rest -= self._left
            self._index, self._left = self._index + 1, OPPORTUNITY_BYTES
        self._left -= rest
        left_at = max(now, self._time_of(self._index))
        self._queued.append((left_at, size))
        return left_at


class Weather:
    """Uniform luck as a function of virtual time, drawn in blocks when first looked at.

    Packets of the same millisecond get different luck by stepping with the golden ratio,
    which keeps each packet's own law uniform.
    """

    def __init__(self, streams: Streams, name: str) -> None:
        self._streams, self._name = streams, name
        self._blocks: dict[int, NDArray[np.float64]] = {}
        self._slot, self._count = -1, 0

    def draw(self, now: float) -> float:
        """The next uniform number in [0, 1) for a packet sent at `now` [s]."""
        slot = int(now / _SLOT_S)
        self._count = self._count + 1 if slot == self._slot else 0
        self._slot = slot
        number, inside = divmod(slot, _BLOCK)
        block = self._blocks.get(number)
        if block is None:
            self._blocks.pop(number - 2, None)  # time only goes forward
            luck = self._streams.fresh(f"{self._name}/{number}")
            block = self._blocks[number] = luck.random(_BLOCK)
        return (float(block[inside]) + self._count * _GOLDEN) % 1.0


class Link:
    """One direction of a link.

    Args:
        config: Delay, loss, queue.
        serialiser: What gives the rate.
        streams: The run's luck.
        name: Name of this direction, for its luck.
    """

    def __init__(
        self, config: LinkConfig, serialiser: Serialiser, streams: Streams, name: str
    ) -> None:
        self.name, self.delay = name, config.delay_s
        self._jitter, self._loss, self._room = config.jitter_s, config.loss, config.queue_bytes
        self._serialiser = serialiser
        self._loss_luck = Weather(streams, f"{name}/loss")
        self._jitter_luck = Weather(streams, f"{name}/jitter")
        self._last_arrival = 0.0
        self.offered = self.lost = self.dropped = self.bytes = 0

    def carry(self, now: float, size: int) -> float | None:
        """Send one packet.

        Args:
            now: When it is offered [s].
            size: Its size with all headers [B].

        Returns:
            When it arrives [s], or None if it is lost or the queue is full.
        """
        self.offered += 1
        if self._serialiser.backlog_bytes(now) + size > self._room:
            self.dropped += 1
            return None
        self.bytes += size
        left_at = self._serialiser.depart(now, size)
        if self._loss and self._loss_luck.draw(now) < self._loss:
            self.lost += 1
            return None
        arrival = left_at + self.delay
        if self._jitter:
            arrival += self._jitter * (2.0 * self._jitter_luck.draw(now) - 1.0)
            arrival = max(arrival, self._last_arrival)
            self._last_arrival = arrival
        return arrival

    def carry_train(self, now: float, packets: int, size: int) -> float | None:
        """Send packets back to back as one, where that makes no difference.

        Args:
            now: When they are offered [s].
            packets: How many.
            size: Of all together, with all headers [B].

        Returns:
            When the last of them arrives [s]; None, and nothing is sent, where each must
            be looked at by itself: with loss, jitter, or a queue that they do not fit into.
        """
        if self._loss or self._jitter:
            return None
        if self._serialiser.backlog_bytes(now) + size > self._room:
            return None
        self.offered += packets
        self.bytes += size
        return self._serialiser.depart(now, size) + self.delay

    def backlog_bytes(self, now: float) -> float:
        """Bytes that wait before the link at `now` [B]."""
        return self._serialiser.backlog_bytes(now)


def make_serialiser(config: LinkConfig, direction: str, streams: Streams, name: str) -> Serialiser:
    """What gives the rate of the `up` or `down` direction of a configured link.

    Raises:
        ConfigError: the trace cannot be read.
    """
    trace = config.trace_up if direction == "up" else config.trace_down
    if trace is None:
        return ConstantRate(config.rate_bps)
    times = read_trace(trace)
    offset = float(streams[f"{name}/trace-offset"].uniform(0.0, times[-1]))
    return TraceRate(times, offset)


_TRACES: dict[str, NDArray[np.float64]] = {}


def read_trace(path: str) -> NDArray[np.float64]:
    """Packet opportunities [s], shape `(n,)`, of a Mahimahi trace; read once per process.

    Raises:
        ConfigError: not readable, not whole milliseconds, not ascending, or too short.
    """
    if path not in _TRACES:
        _TRACES[path] = _parse_trace(path)
    return _TRACES[path]


def _parse_trace(path: str) -> NDArray[np.float64]:
    try:
        lines = Path(path).read_text(encoding="ascii").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not text"
        raise ConfigError(f"trace cannot be read: {reason}", path) from error
    times: list[int] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text:
            continue
        if not text.isdigit():
            raise ConfigError(f"should be a whole millisecond, not {text[:20]!r}", path, number, 1)
        if times and int(text) < times[-1]:
            raise ConfigError(f"{text} ms comes after {times[-1]} ms", path, number, 1)
        times.append(int(text))
    if not times or times[-1] <= 0:
        raise ConfigError("holds no packet opportunity after 0 ms", path)
    return np.array(times, dtype=np.float64) / 1000.0
