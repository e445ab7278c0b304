"""Laws of chance for times: each is drawn from, and knows its first two moments exactly."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import override

from dva_sim.kernel.config import Config

Floats = NDArray[np.float64]
Seconds = Annotated[float, Field(ge=0, le=1e12)]
PositiveSeconds = Annotated[float, Field(gt=0, le=1e12)]
Shape = Annotated[float, Field(gt=0, le=1e6)]


class _Law(Config):
    """Interface of all laws; every draw scales with the law's scale."""

    @property
    @abstractmethod
    def mean(self) -> float:
        """First moment [s]."""

    @property
    @abstractmethod
    def second(self) -> float:
        """Second moment [s^2]."""

    @property
    def variance(self) -> float:
        """[s^2]"""
        return max(0.0, self.second - self.mean**2)

    @abstractmethod
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        """Draw `count` times [s], shape `(count,)`."""


class Constant(_Law):
    """Always the same; a bare number means this."""

    law: Literal["constant"] = "constant"
    mean_s: Seconds

    @property
    @override
    def mean(self) -> float:
        return self.mean_s

    @property
    @override
    def second(self) -> float:
        return self.mean_s**2

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return np.full(count, self.mean_s)


class _OfMean(_Law):
    """A law that is given by its mean."""

    law: str
    mean_s: PositiveSeconds

    @property
    @override
    def mean(self) -> float:
        return self.mean_s


class Exponential(_OfMean):
    """Without memory."""

    law: Literal["exponential"]

    @property
    @override
    def second(self) -> float:
        return 2.0 * self.mean_s**2

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return self.mean_s * rng.standard_exponential(count)


class Uniform(_Law):
    """Anything between two bounds."""

    law: Literal["uniform"]
    low_s: Seconds
    high_s: Seconds

    @model_validator(mode="after")
    def _in_order(self) -> Uniform:
        if self.high_s < self.low_s:
            raise ValueError(f"high_s {self.high_s:g} is below low_s {self.low_s:g}")
        return self

    @property
    @override
    def mean(self) -> float:
        return 0.5 * (self.low_s + self.high_s)

    @property
    @override
    def second(self) -> float:
        return (self.low_s**2 + self.low_s * self.high_s + self.high_s**2) / 3.0

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return self.low_s + (self.high_s - self.low_s) * rng.random(count)


class Erlang(_OfMean):
    """The sum of a number of equal exponential phases."""

    law: Literal["erlang"]
    phases: Annotated[int, Field(ge=1, le=1000)]

    @property
    @override
    def second(self) -> float:
        return self.mean_s**2 * (1.0 + 1.0 / self.phases)

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return self.mean_s / self.phases * rng.standard_gamma(float(self.phases), count)


class Hyperexponential(_OfMean):
    """One of two exponential laws, each with the same part in the mean ("balanced means").

    Attributes:
        cv2: Squared coefficient of variation, above 1.
    """

    law: Literal["hyperexponential"]
    squared_cv: Annotated[float, Field(gt=1, le=1e4)]

    @property
    def share(self) -> float:
        """Probability of the faster of the two."""
        return 0.5 * (1.0 + math.sqrt((self.squared_cv - 1.0) / (self.squared_cv + 1.0)))

    @property
    @override
    def second(self) -> float:
        return self.mean_s**2 * (1.0 + self.squared_cv)

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        fast = rng.random(count) < self.share
        means = np.where(fast, 0.5 / self.share, 0.5 / (1.0 - self.share))
        return np.asarray(self.mean_s * means * rng.standard_exponential(count))


class Lognormal(_Law):
    """A product of many small influences.

    Attributes:
        mean_s: Its mean; or give `median_s`.
        median_s: Half of all draws are below.
        spread: Standard deviation of the natural logarithm.
    """

    law: Literal["lognormal"]
    mean_s: PositiveSeconds | None = None
    median_s: PositiveSeconds | None = None
    spread: Annotated[float, Field(ge=0, le=5)]

    @model_validator(mode="after")
    def _one_scale(self) -> Lognormal:
        if (self.mean_s is None) == (self.median_s is None):
            raise ValueError("a lognormal law needs mean_s or median_s, and not both")
        return self

    @property
    def median(self) -> float:
        """[s]"""
        if self.median_s is not None:
            return self.median_s
        assert self.mean_s is not None
        return self.mean_s * math.exp(-0.5 * self.spread**2)

    @property
    @override
    def mean(self) -> float:
        return self.median * math.exp(0.5 * self.spread**2)

    @property
    @override
    def second(self) -> float:
        return self.median**2 * math.exp(2.0 * self.spread**2)

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return np.asarray(self.median * np.exp(self.spread * rng.standard_normal(count)))


class Gamma(_OfMean):
    """Erlang's law with any number of phases, whole or not."""

    law: Literal["gamma"]
    shape: Shape

    @property
    @override
    def second(self) -> float:
        return self.mean_s**2 * (1.0 + 1.0 / self.shape)

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return self.mean_s / self.shape * rng.standard_gamma(self.shape, count)


class Weibull(_OfMean):
    """A hazard rate that grows (shape above 1) or falls (below 1) with age."""

    law: Literal["weibull"]
    shape: Annotated[float, Field(ge=0.1, le=1e3)]

    @property
    def _scale(self) -> float:
        return self.mean_s / math.gamma(1.0 + 1.0 / self.shape)

    @property
    @override
    def second(self) -> float:
        return self._scale**2 * math.gamma(1.0 + 2.0 / self.shape)

    @override
    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        return self._scale * rng.weibull(self.shape, count)


def _number_is_constant(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"law": "constant", "mean_s": value}
    return value


_Any = Annotated[
    Constant | Exponential | Uniform | Erlang | Hyperexponential | Lognormal | Gamma | Weibull,
    Field(discriminator="law"),
]
Law = Annotated[_Any, BeforeValidator(_number_is_constant, json_schema_input_type=float | _Any)]
"""A law in a configuration file: a mapping with the key `law`, or a bare number of seconds."""

ZERO = Constant(mean_s=0.0)
