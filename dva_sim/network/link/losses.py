"""Random packet losses, one by one or in bursts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from dva_sim.kernel.config import Config
from dva_sim.kernel.streams import Streams
from dva_sim.network.link.time_noise import Spells, UniformNumbers

Seconds = Annotated[float, Field(ge=0, le=1e7)]
PositiveSeconds = Annotated[float, Field(gt=0, le=1e7)]

Fate = Callable[[float, float], bool]
"""True if a packet is lost, given when it was sent and when it left the queue [s]."""


class Bursts(Config):
    """Losses that come in bursts; `loss` of the link stays the share lost in the long run.

    Attributes:
        mean_s: Mean length of a burst. Bursts are functions of virtual time, so all who send at
            that time meet them.
        mean_packets: Mean number of packets in a burst, in place of a time. Each packet then
            advances the state of the link, which so depends on how often one sends.
        loss: Probability that a packet is lost in a burst; outside none is.

    References:
        Gilbert: Capacity of a burst-noise channel. Bell System Technical Journal 39 (1960).
        Elliott: Estimates of error rates for codes on burst-noise channels. Bell System
        Technical Journal 42 (1963).
    """

    mean_s: Annotated[float, Field(ge=0.001, le=1e5)] | None = None
    mean_packets: Annotated[float, Field(ge=1, le=1e6)] | None = None
    loss: Annotated[float, Field(gt=0, le=1)] = 1.0

    @model_validator(mode="after")
    def _one_measure(self) -> Bursts:
        if (self.mean_s is None) == (self.mean_packets is None):
            raise ValueError("bursts need either mean_s or mean_packets")
        return self

    def check(self, loss: float) -> None:
        """Refuse a `loss` that such bursts cannot make.

        Raises:
            ValueError: saying what would be right.
        """
        if loss >= self.loss:
            raise ValueError(f"loss {loss:g} should be below bursts.loss {self.loss:g}")
        least = loss / (self.loss - loss)
        if self.mean_packets is not None and self.mean_packets < least:
            raise ValueError(
                f"bursts.mean_packets {self.mean_packets:g} is too short for a loss of {loss:g}: "
                f"at least {least:g}"
            )

    def play(self, loss: float, streams: Streams, name: str, uniforms: UniformNumbers) -> Fate:
        """Return a fate that loses a share `loss` of all packets, from the named random stream.

        Args:
            loss: Share of packets lost in the long run.
            streams: Random streams of the run.
            name: Name of the bursts' random stream.
            uniforms: Random numbers that decide packet by packet within a burst.
        """
        share = loss / self.loss  # of time, or of packets, that is in a burst
        if self.mean_s is not None:
            spells = Spells(streams, name, self.mean_s * (1.0 - share) / share, self.mean_s)
            return timed_bursts(spells, self.loss, uniforms)
        assert self.mean_packets is not None
        return counted_bursts(streams.fresh(name), share, self.mean_packets, self.loss, uniforms)


def chance(loss: float, uniforms: UniformNumbers) -> Fate:
    """Return the independent losses with a fixed probability; one random number per packet."""
    return lambda now, left_at: uniforms.draw(now) < loss


def timed_bursts(spells: Spells, loss: float, uniforms: UniformNumbers) -> Fate:
    """Return losses of packets sent in bad times, with the probability then."""
    return lambda now, left_at: spells.is_on(now) and uniforms.draw(now) < loss


def counted_bursts(
    rng: np.random.Generator, share: float, length: float, loss: float, uniforms: UniformNumbers
) -> Fate:
    """Return losses in bursts counted in packets, independent of their times.

    Args:
        rng: Random generator of the bursts.
        share: Share of all packets that are in a burst.
        length: Mean length of a burst, in packets.
        loss: Probability in a burst.
        uniforms: Random number of each packet.
    """
    ends = 1.0 / length
    begins = share / (1.0 - share) / length
    steps = _uniform(rng)
    is_on = next(steps) < share

    def takes(now: float, left_at: float) -> bool:
        nonlocal is_on
        if next(steps) < (ends if is_on else begins):
            is_on = not is_on
        return is_on and uniforms.draw(now) < loss

    return takes


def _uniform(rng: np.random.Generator) -> Iterator[float]:
    while True:
        yield from rng.random(1024).tolist()
