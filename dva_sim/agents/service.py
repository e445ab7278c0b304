"""How long a robot's computer takes for a message: always the same, or by a law of chance."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, model_validator

from dva_sim.config import Config

BLOCK = 256  # draws made at once


class ServiceLaw(Config):
    """A law of service times.

    Attributes:
        law: `constant`, `exponential`, `lognormal` or `gamma`.
        mean_s: Of all messages but the first.
        cv: Standard deviation over mean; of a lognormal or gamma law only.
        first_s: What the first message takes (a cold start); left out: as the others.
    """

    law: Literal["constant", "exponential", "lognormal", "gamma"]
    mean_s: Annotated[float, Field(gt=0, le=10)]
    cv: Annotated[float, Field(ge=0.001, le=10)] | None = None
    first_s: Annotated[float, Field(ge=0, le=60)] | None = None

    @model_validator(mode="after")
    def _spread(self) -> ServiceLaw:
        spreads = self.law in ("lognormal", "gamma")
        if spreads and self.cv is None:
            raise ValueError(f"the {self.law} law needs cv")
        if not spreads and self.cv is not None:
            raise ValueError(f"the {self.law} law has no cv of its own")
        return self

    def sample(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """That many draws [s], shape `(count,)`."""
        if self.law == "exponential":
            return self.mean_s * rng.standard_exponential(count)
        if self.cv is None:
            return np.full(count, self.mean_s)
        if self.law == "gamma":
            shape = self.cv**-2
            return self.mean_s / shape * rng.standard_gamma(shape, count)
        spread = math.sqrt(math.log1p(self.cv**2))
        draws = np.exp(spread * rng.standard_normal(count) - 0.5 * spread**2)
        return np.asarray(self.mean_s * draws)


def _form(value: object) -> str:
    return "a law" if isinstance(value, Mapping | ServiceLaw) else "seconds"


Service = Annotated[
    Annotated[float, Field(ge=0, le=10), Tag("seconds")] | Annotated[ServiceLaw, Tag("a law")],
    Discriminator(_form),
]
"""In a configuration file: a number of seconds, or a law."""


def mean_of(service: float | ServiceLaw) -> float:
    """Mean service time of all messages but the first [s]."""
    return service.mean_s if isinstance(service, ServiceLaw) else service


def service_times(service: float | ServiceLaw, rng: np.random.Generator) -> Callable[[], float]:
    """What gives the service time of each message [s], one after the other."""
    if isinstance(service, ServiceLaw):
        return _draws(service, rng).__next__
    return lambda: service


def _draws(law: ServiceLaw, rng: np.random.Generator) -> Iterator[float]:
    if law.first_s is not None:
        yield law.first_s
    while True:
        yield from law.sample(rng, BLOCK).tolist()
