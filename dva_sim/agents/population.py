"""Simulated persons, whose traits do not depend on the task.

References:
    D. T. McRuer, H. R. Jex: A review of quasi-linear pilot models. IEEE Trans. Human Factors in
    Electronics HFE-8 (1967): gain and margin of who closes a loop.
    C. M. Harris, D. M. Wolpert: Signal-dependent noise determines motor planning. Nature 394
    (1998): the standard deviation of what a hand does grows with what it does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field

from dva_sim.agents.habits import OperatorHabits
from dva_sim.kernel.assumed import Assumed
from dva_sim.kernel.config import Config
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import unknown

Positive = Annotated[float, Field(gt=0)]
Spread = Annotated[float, Field(ge=0, le=1)]


class Trait(Config):
    """A log-normal trait: its median, and the standard deviation of its logarithm."""

    median: Positive
    spread: Spread = 0.0

    def draw(self, rng: np.random.Generator) -> float:
        """Return one person's value."""
        return float(self.median * np.exp(self.spread * rng.normal()))


class Population(Config):
    """Population from which persons are drawn.

    Attributes:
        perceptual_delay_s: Time from a picture on the screen to a decision.
        hand_lag_s: Time constant of the hand.
        crossover_rad_s: Gain of turning towards a target.
        caution: Share of the look-ahead that the robot may cover during the whole delay.
        pace: Share of the robot's top speed that the person cares to drive.
        confirm_look_s: Mean time for which an event in plain view is looked at until the person is
            sure: its criterion. A hasty person takes less, and is wrong more often.
        reading_s: Time from an order on the screen to acting on it.
        position_error_m: Error of the robot's position, as judged from the picture.
        heading_error_rad: Error of the robot's heading, as judged from the picture.
        reaction_s: Time from the sight of a new goal to the first movement, perceptual delay
            included.
        margin: Gain x delay of the loops that the person closes stays below this; pi/2 is the
            limit of stability.
        motor_noise: Standard deviation of the hand's motion, as a share of it.
        pointing_rad_s: Gain of bringing a cursor to its target, however short the delay.
        sensitivity: Discrimination of an event from none per second in plain view, in standard
            deviations [1/sqrt(s)].
        search_s: Time that the person looks around at a place before reporting that nothing is
            there.
        patience_s: Time that it continues without progress, or without seeing anything.
        switch_s: Time from turning to another robot's picture to understanding it.
        tempo: Time that everything takes which the person does itself, against the median person.
        waits_from_s: New delay at which half of its movements are followed by a wait.
        compensates: Share of a delay beyond the usual one for which it takes what it asked for to
            be under way still; at most all of it.
        tracks: Gain x delay of following something all the time, where no place is aimed at.
        habits: Numbers that are the same for all persons, none of them measured.
    """

    description: str = ""
    perceptual_delay_s: Trait = Trait(median=0.22, spread=0.15)
    hand_lag_s: Trait = Trait(median=0.15, spread=0.15)
    crossover_rad_s: Trait = Trait(median=1.5, spread=0.15)
    caution: Annotated[
        Trait,
        Assumed(0.2, 0.4, "stable up to 0.52 of the look-ahead; people keep away from it"),
    ] = Trait(median=0.3, spread=0.15)
    pace: Annotated[
        Trait, Assumed(0.85, 1.0, "driving by tilt, most hold the phone near its limit")
    ] = Trait(median=0.95, spread=0.05)
    confirm_look_s: Annotated[
        Trait, Assumed(0.8, 3.0, "from a few fixations to a careful look")
    ] = Trait(median=1.5, spread=0.25)
    reading_s: Annotated[Trait, Assumed(1.0, 5.0, "an order of ten to thirty words")] = Trait(
        median=2.0, spread=0.3
    )
    position_error_m: Annotated[
        Trait, Assumed(0.02, 0.15, "from a hand to a forearm, judged from a picture at 1 to 3 m")
    ] = Trait(median=0.04, spread=0.3)
    heading_error_rad: Annotated[
        Trait, Assumed(0.01, 0.06, "1 to 3 degrees, judged from a picture")
    ] = Trait(median=0.02, spread=0.3)
    reaction_s: Trait = Trait(median=0.30, spread=0.15)
    margin: Trait = Trait(median=0.5, spread=0.15)
    motor_noise: Trait = Trait(median=0.05, spread=0.3)
    pointing_rad_s: Annotated[
        Trait, Assumed(3.0, 5.5, "of the order found for the simplest things to steer")
    ] = Trait(median=4.0, spread=0.15)
    sensitivity: Annotated[
        Trait, Assumed(3.0, 6.0, "errors are rare with good pictures and do happen")
    ] = Trait(median=4.5, spread=0.15)
    search_s: Annotated[
        Trait, Assumed(10.0, 60.0, "from one turn of the robot to a thorough search of a room")
    ] = Trait(median=25.0, spread=0.2)
    patience_s: Annotated[Trait, Assumed(30.0, 240.0, "from half a minute to a few")] = Trait(
        median=90.0, spread=0.25
    )
    switch_s: Annotated[
        Trait, Assumed(0.5, 3.0, "costs of switching a task, with a scene to be understood")
    ] = Trait(median=1.0, spread=0.3)
    tempo: Annotated[Trait, Assumed(0.8, 1.25, "what a hurry, or care, makes of it")] = Trait(
        median=1.0, spread=0.4
    )
    waits_from_s: Annotated[
        Trait, Assumed(0.4, 1.5, "hardly anybody waits at 0.2 s, nearly all at 2 to 3 s")
    ] = Trait(median=0.7, spread=0.4)
    compensates: Annotated[
        Trait, Assumed(0.2, 0.8, "adaptation to late pictures is partial: Foulkes, Miall 2000")
    ] = Trait(median=0.45, spread=0.3)
    tracks: Annotated[
        Trait, Assumed(0.7, 1.2, "phase margins of 20 to 50 deg in following: McRuer, Jex 1967")
    ] = Trait(median=0.95, spread=0.15)
    habits: OperatorHabits = Field(default_factory=OperatorHabits)

    @property
    def traits(self) -> dict[str, Trait]:
        """All of them by name, in the order of the fields of `Person`."""
        return {name: value for name, value in self if isinstance(value, Trait)}

    def with_medians(self, medians: Mapping[str, float]) -> Population:
        """Return the population with other medians; see `with_medians`."""
        return with_medians(self, medians, "operator")


P = TypeVar("P", bound=Config)


def with_medians(profile: P, medians: Mapping[str, float], whose: str) -> P:
    """Return the profile with other medians; the spreads between persons stay.

    Args:
        profile: Profile whose fields are traits, or numbers that all persons share.
        medians: Medians by trait, such as `{"margin": 0.4}`.
        whose: Part of a scenario that defines the persons.

    Raises:
        ConfigError: there is no such trait, or its median is not above 0.
    """
    traits = {name: value for name, value in profile if isinstance(value, Trait | float)}
    changed: dict[str, Trait | float] = {}
    for name, median in medians.items():
        if name not in traits:
            raise ConfigError(unknown(f"{whose}.traits", name, traits))
        trait = traits[name]
        if not isinstance(trait, Trait):
            changed[name] = median
        elif median > 0:
            changed[name] = Trait(median=median, spread=trait.spread)
        else:
            raise ConfigError(f"{whose}.traits {name!r} is {median!r}; should be above 0")
    return profile.model_copy(update=changed) if changed else profile


@dataclass(frozen=True)
class Person:
    """One simulated person; fields as in `Population` and in its order, in SI units; see there."""

    perceptual_delay: float
    hand_lag: float
    crossover: float
    caution: float
    pace: float
    confirm_look: float
    reading: float
    position_error: float
    heading_error: float
    reaction: float
    margin: float
    motor_noise: float
    pointing: float
    sensitivity: float
    search: float
    patience: float
    switch: float
    tempo: float
    waits_from: float
    compensates: float
    tracks: float
    habits: OperatorHabits = field(default_factory=OperatorHabits, kw_only=True)

    @property
    def usual_delay(self) -> float:
        """The delay that it is used to: its own, and that of machines it uses every day [s]."""
        return self.perceptual_delay + self.hand_lag + self.habits.delay.usual_s


def draw_person(population: Population, seed: int, index: int) -> Person:
    """Return the person number `index` of the population that `seed` draws: always the same one."""
    rng = Streams(seed).fresh(f"person-{index}")
    drawn = {name: trait.draw(rng) for name, trait in population.traits.items()}
    drawn["pace"] = min(1.0, drawn["pace"])
    drawn["compensates"] = min(1.0, drawn["compensates"])
    return Person(*drawn.values(), habits=population.habits)


def median_person(population: Population) -> Person:
    """Return the person in the middle of a population: every trait at its median."""
    still = {name: Trait(median=trait.median) for name, trait in population.traits.items()}
    return draw_person(population.model_copy(update=still), 0, 0)
