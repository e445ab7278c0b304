"""Configured links, with or without a last hop through the air: what reception costs there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from dva_sim.kernel.streams import Streams
from dva_sim.network.link.config import Direction, LinkConfig
from dva_sim.network.link.link import Link, make_serialiser
from dva_sim.network.link.rates import ConstantRate, Serialiser
from dva_sim.network.link.time_noise import Weather
from dva_sim.network.link.delays import Wobble


class Reception(Protocol):
    """The quality of a radio link at one place, on top of what the link is like anyway."""

    @property
    def loss(self) -> float:
        """Probability that a packet is lost, each way; 1: there is no reception."""

    @property
    def rate_bps(self) -> float:
        """Upper bound of the rate [bit/s]."""

    @property
    def extra_delay_s(self) -> float:
        """One-way delay added [s]."""


class RadioLink(Link):
    """A link whose quality depends on where the robot is.

    Packets keep their order when reception changes, unless the link may reorder them. While there
    is none every packet is lost, and what rides on the link has to send again. The queue before
    the air counts bytes.

    Args:
        config: Delay, loss, queue of the link as such.
        serialiser: What gives its rate.
        streams: The run's luck.
        name: Name of this direction, for its luck.
        direction: Which it is.
        reception: The quality where the robot is now; None: nothing is added.
    """

    def __init__(
        self,
        config: LinkConfig,
        serialiser: Serialiser,
        streams: Streams,
        name: str,
        direction: Direction,
        reception: Callable[[], Reception | None],
    ) -> None:
        super().__init__(config, serialiser, streams, name, direction)
        way = config.toward(direction)
        self._reception = reception
        self._luck = Weather(streams, f"{name}/radio")
        self._air, self._air_room = ConstantRate(way.rate_bps), way.queue_bytes
        self._newest = 0.0
        self._noted = _Noted(self._wobble) if self._wobble and not way.jitter_s else None
        self._wobble = self._noted or self._wobble

    def is_ideal(self) -> bool:
        """See `Link`: the next place may have no reception."""
        return False

    def carry(self, now: float, size: int) -> float | None:
        """See `Link`."""
        here = self._reception()
        if here is not None and self._full(now, size, here.rate_bps):
            self.offered += 1
            self.dropped += 1
            return None
        arrival = super().carry(now, size)
        if arrival is None:
            return None
        if here is not None:
            if here.loss and self._luck.draw(now) < here.loss:
                self.lost += 1
                return None
            arrival = max(arrival, self._air.depart(now, size) + self._lag()) + here.extra_delay_s
        if self._may_overtake:
            return arrival
        self._newest = max(self._newest, arrival)
        return self._newest

    def carry_train(self, now: float, packets: int, size: int) -> float | None:
        """See `Link`: in the air each packet has a fate of its own."""
        return None

    def backlog_bytes(self, now: float) -> float:
        """See `Link`."""
        return max(super().backlog_bytes(now), self._air.backlog_bytes(now))

    def _lag(self) -> float:
        """From leaving the air to arriving [s]: what the link's own law gave the last packet.

        Uniform jitter is the exception, a packet that the air holds up takes its mean: what was
        found out with it stays as it was.
        """
        return self.delay if self._noted is None else self._base + self._noted.last

    def _full(self, now: float, size: int, rate_bps: float) -> bool:
        """Whether the queue before the air is full; the air takes up the rate of the place."""
        if rate_bps != self._air.rate_bps:
            self._air.change_rate(now, rate_bps)
        return self._air.backlog_bytes(now) + size > self._air_room


class _Noted:
    """Deviations of a link's delay; the last one is remembered."""

    def __init__(self, wobble: Wobble) -> None:
        self._wobble, self.last = wobble, 0.0

    def deviation(self, now: float) -> float:
        """See `Wobble`."""
        self.last = self._wobble.deviation(now)
        return self.last


def make_link(
    config: LinkConfig,
    direction: Direction,
    streams: Streams,
    name: str,
    reception: Callable[[], Reception | None] | None = None,
) -> Link:
    """The `up` or `down` direction of a configured link.

    Args:
        config: What it is like.
        direction: `up` or `down`.
        streams: The run's luck.
        name: Of the link, for its luck.
        reception: The quality of its radio hop now, if it has one.

    Raises:
        ConfigError: a file that it names cannot be read.
    """
    serialiser, own_name = make_serialiser(config, direction, streams, name), f"{name}/{direction}"
    if reception is None:
        return Link(config, serialiser, streams, own_name, direction)
    return RadioLink(config, serialiser, streams, own_name, direction, reception)
