"""Laws of the one-way delay: the deviation of each packet's delay from the link's `delay_s`.

A law turns a uniform number into a deviation. The source of these numbers makes deviations
independent from packet to packet, or correlated in time.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from statistics import fmean, pstdev
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import override

from dva_sim.kernel.config import Config
from dva_sim.kernel.streams import Streams
from dva_sim.network.link.recorded import read_delays
from dva_sim.network.link.time_noise import (
    MakeNumbers,
    SlowNoise,
    UniformNumbers,
    normal_quantile,
)

Quantile = Callable[[float], float]
Seconds = Annotated[float, Field(ge=0, le=30)]
PositiveSeconds = Annotated[float, Field(gt=0, le=30)]
_SDS = 3.0  # minimum mean of a normal law, in standard deviations


Wobble = Callable[[float], float]
"""Extra delay of a packet sent at a time [s]; below 0 it arrives sooner than usual."""


def by_quantile(quantile: Quantile, uniforms: UniformNumbers) -> Wobble:
    """Draw from any law: the quantile of the deviation [s] at a random probability."""
    return lambda now: quantile(uniforms.draw(now))


class ConstantDelay(Config):
    """All packets take `delay_s`: what is meant where no law is named."""

    law: Literal["constant"]

    def check(self, delay: float) -> None:
        """Accept any delay."""

    def moments(self, delay: float) -> tuple[float, float]:
        """Implement `_Law`."""
        return delay, 0.0

    def play(self, delay: float, streams: Streams, name: str, make: MakeNumbers) -> None:
        """Return no deviation; see `_Law`."""


class _Law(Config):
    """Interface of all laws.

    Attributes:
        correlation_s: Time over which delays stay alike: the normal scores of two packets sent
            `t` apart have correlation exp(-t / correlation_s), which for the normal law is
            that of the delays. 0: packets are independent.
    """

    correlation_s: Annotated[float, Field(ge=0, le=1e5)] = 0.0

    @abstractmethod
    def check(self, delay: float) -> None:
        """Refuse a `delay_s` [s] that the law cannot have.

        Raises:
            ValueError: saying what would be right.
        """

    @abstractmethod
    def moments(self, delay: float) -> tuple[float, float]:
        """Return mean and standard deviation of the one-way delay [s]; `delay` is `delay_s`."""

    @abstractmethod
    def quantile(self, delay: float) -> Quantile:
        """Return deviations from `delay_s` [s] by probability."""

    def play(self, delay: float, streams: Streams, name: str, make: MakeNumbers) -> Wobble:
        """Return deviations from `delay_s` [s], from the random stream of that name.

        Args:
            delay: The link's `delay_s` [s].
            streams: The run's random streams.
            name: Name of this source.
            make: Function that makes the numbers of packets that are independent of one another.
        """
        if self.correlation_s:
            slow = SlowNoise(streams, name, self.correlation_s)
            return by_quantile(self.quantile(delay), slow)
        return by_quantile(self.quantile(delay), make(streams, name))


class Normal(_Law):
    """Symmetrical around `delay_s`; with a `correlation_s` an Ornstein-Uhlenbeck process."""

    law: Literal["normal"]
    sd_s: PositiveSeconds

    @override
    def check(self, delay: float) -> None:
        # The share of packets that would arrive before they are sent has to be negligible.
        if _SDS * self.sd_s > delay:
            raise ValueError(
                f"delay_law.sd_s {self.sd_s:g} of a normal law is above a third of delay_s "
                f"{delay:g}; gamma has no such limit"
            )

    @override
    def moments(self, delay: float) -> tuple[float, float]:
        return delay, self.sd_s

    @override
    def quantile(self, delay: float) -> Quantile:
        sd = self.sd_s
        return lambda u: max(-delay, sd * normal_quantile(u))


class GammaDelay(_Law):
    """Mean `delay_s`, never below `least_s`: skewed, the more the larger its spread."""

    law: Literal["gamma"]
    sd_s: PositiveSeconds
    least_s: Seconds = 0.0

    @override
    def check(self, delay: float) -> None:
        _above_least(self.least_s, delay)

    @override
    def moments(self, delay: float) -> tuple[float, float]:
        return delay, self.sd_s

    @override
    def quantile(self, delay: float) -> Quantile:
        from scipy.special import gammaincinv  # late: few runs need it, and it is slow to import

        above = delay - self.least_s
        shape = (above / self.sd_s) ** 2
        scale = self.sd_s**2 / above
        return lambda u: scale * float(gammaincinv(shape, u)) - above


class ShiftedExponential(_Law):
    """Mean `delay_s`, never below `least_s`; what is above it is exponential."""

    law: Literal["shifted_exponential"]
    least_s: Seconds

    @override
    def check(self, delay: float) -> None:
        _above_least(self.least_s, delay)

    @override
    def moments(self, delay: float) -> tuple[float, float]:
        return delay, delay - self.least_s

    @override
    def quantile(self, delay: float) -> Quantile:
        above = delay - self.least_s
        # The inverse of the exponential law, shifted so that its mean is zero.
        return lambda u: -above * (1.0 + math.log(max(1.0 - u, 1e-16)))


class Empirical(_Law):
    """One of the given delays each time; `delay_s` comes on top of them.

    Attributes:
        delays_s: The delays; or else
        file: names a file with one a line [ms].
    """

    law: Literal["empirical"]
    delays_s: tuple[Seconds, ...] = ()
    file: str | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Empirical:
        if bool(self.delays_s) == (self.file is not None):
            raise ValueError("an empirical law needs either delays_s or file")
        return self

    @override
    def check(self, delay: float) -> None:
        # Any will do.
        return

    @override
    def moments(self, delay: float) -> tuple[float, float]:
        delays = self._delays()
        return delay + fmean(delays), pstdev(delays)

    @override
    def quantile(self, delay: float) -> Quantile:
        delays = sorted(self._delays())
        count = len(delays)
        return lambda u: delays[min(count - 1, int(u * count))]

    def _delays(self) -> tuple[float, ...]:
        return self.delays_s if self.file is None else read_delays(self.file)


def _above_least(least: float, delay: float) -> None:
    if least >= delay:
        raise ValueError(f"delay_law.least_s {least:g} should be below delay_s {delay:g}")


def _constant_by_name(value: Any) -> Any:
    """Accept the name `constant` in place of a mapping: that law has no keys of its own."""
    if isinstance(value, str) and value != "constant":
        raise ValueError("a law is a mapping, such as {law: gamma, sd_s: 0.02}, or constant")
    return {"law": value} if isinstance(value, str) else value


_Any = Annotated[
    ConstantDelay | Normal | GammaDelay | ShiftedExponential | Empirical, Field(discriminator="law")
]
_ByName = Literal["constant"]
DelayLaw = Annotated[
    _Any, BeforeValidator(_constant_by_name, json_schema_input_type=_ByName | _Any)
]
"""A law in a configuration file: a mapping with the key `law`, or the name `constant`."""
