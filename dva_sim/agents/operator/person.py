"""Simulated persons: who they are does not depend on what they are asked to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from dva_sim.config import Config
from dva_sim.streams import Streams

Positive = Annotated[float, Field(gt=0)]
Spread = Annotated[float, Field(ge=0, le=1)]


class Trait(Config):
    """A log-normal trait: its median, and the standard deviation of its logarithm."""

    median: Positive
    spread: Spread = 0.0

    def draw(self, rng: np.random.Generator) -> float:
        """One person's value."""
        return float(self.median * np.exp(self.spread * rng.normal()))


class Population(Config):
    """Where persons are drawn from.

    Attributes:
        perceptual_delay_s: From a picture on the screen to a decision.
        hand_lag_s: Time constant of the hand.
        crossover_rad_s: Gain of turning towards a target.
        caution: Share of the look-ahead that the robot may cover during the whole delay.
        pace: Share of the robot's top speed that the person cares to drive.
        confirm_look_s: How long an event must stay in view to be sure.
        reading_s: From an order on the screen to acting on it.
        position_error_m: How well the robot's place is judged from the picture.
        heading_error_rad: The same for its heading.
    """

    description: str = ""
    perceptual_delay_s: Trait = Trait(median=0.22, spread=0.15)
    hand_lag_s: Trait = Trait(median=0.15, spread=0.15)
    crossover_rad_s: Trait = Trait(median=1.5, spread=0.15)
    caution: Trait = Trait(median=0.3, spread=0.15)
    pace: Trait = Trait(median=0.95, spread=0.05)
    confirm_look_s: Trait = Trait(median=1.5, spread=0.25)
    reading_s: Trait = Trait(median=2.0, spread=0.3)
    position_error_m: Trait = Trait(median=0.04, spread=0.3)
    heading_error_rad: Trait = Trait(median=0.02, spread=0.3)


@dataclass(frozen=True)
class Person:
    """One simulated person; fields as in `Population`, in SI units."""

    perceptual_delay: float
    hand_lag: float
    crossover: float
    caution: float
    pace: float
    confirm_look: float
    reading: float
    position_error: float
    heading_error: float


def draw_person(population: Population, seed: int, index: int) -> Person:
    """Person number `index` of the population that `seed` draws: always the same one."""
    rng = Streams(seed).fresh(f"person-{index}")
    return Person(
        perceptual_delay=population.perceptual_delay_s.draw(rng),
        hand_lag=population.hand_lag_s.draw(rng),
        crossover=population.crossover_rad_s.draw(rng),
        caution=population.caution.draw(rng),
        pace=min(1.0, population.pace.draw(rng)),
        confirm_look=population.confirm_look_s.draw(rng),
        reading=population.reading_s.draw(rng),
        position_error=population.position_error_m.draw(rng),
        heading_error=population.heading_error_rad.draw(rng),
    )
