"""Profiles of people on foot: guards and bystanders."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydantic import Field

from dva_sim.agents.habits import BystanderHabits, GuardHabits
from dva_sim.agents.population import Trait
from dva_sim.kernel.assumed import Assumed
from dva_sim.kernel.config import Config

SLOWEST = 0.6  # design: lower bound of walking speeds [m/s]
FASTEST = 2.2  # design: upper bound of walking speeds [m/s]


class PaceProfile(Config):
    """Walking speeds of a kind of people.

    Attributes:
        walking_mean_mps: Mean over persons.
        walking_sd_mps: Standard deviation between persons.

    References:
        1.34 m/s (SD 0.26): U. Weidmann, Transporttechnik der Fussgaenger, ETH Zuerich, 1993.
    """

    description: str = ""
    walking_mean_mps: Annotated[float, Field(gt=0)] = 1.34
    walking_sd_mps: Annotated[float, Field(ge=0)] = 0.26

    def draw_speed(self, rng: np.random.Generator) -> float:
        """Return one person's free walking speed [m/s].

        Normal, no slower or faster than walking is.
        """
        speed = rng.normal(self.walking_mean_mps, self.walking_sd_mps)
        return float(np.clip(speed, SLOWEST, FASTEST))


class GuardProfile(PaceProfile):
    """Profile from which guards are drawn.

    Attributes:
        mobilisation_s: Time from the order to the first step.
        confirm_look_s: Time from arrival to certainty.
        contain_s: Time from arrival until a leak or flood is over: a valve found and shut.
        extinguish_s: Time from arrival until a young fire is put out.
        habits: Numbers that are the same for all guards, none of them measured.

    References:
        Turnout within 80 s in 90 % of all cases: NFPA 1710.
    """

    mobilisation_s: Trait = Trait(median=45.0, spread=0.45)
    confirm_look_s: Annotated[
        Trait, Assumed(1.0, 10.0, "from a glance to a look around a room")
    ] = Trait(median=3.0, spread=0.3)
    contain_s: Annotated[
        Trait, Assumed(30.0, 600.0, "from a valve at hand to one that must be found")
    ] = Trait(median=120.0, spread=0.5)
    extinguish_s: Annotated[
        Trait, Assumed(10.0, 90.0, "one to some discharges of a hand-held extinguisher")
    ] = Trait(median=30.0, spread=0.5)
    habits: GuardHabits = Field(default_factory=GuardHabits)


@dataclass(frozen=True)
class Walker:
    """One guard.

    Attributes:
        speed: Walking [m/s].
        mobilisation: Time from an order to the first step [s].
        look: Time from arrival to certainty [s].
        contain: Time from arrival until a leak or flood is over [s].
        extinguish: Time from arrival until a fire is out [s].
        usual_mobilisation: Time that the guard expects for getting ready [s], which is the usual
            one. The actual time shows only when it is over.
        habits: Habits of all guards.
    """

    speed: float
    mobilisation: float
    look: float
    contain: float = 60.0
    extinguish: float = 30.0
    usual_mobilisation: float = 45.0
    habits: GuardHabits = field(default_factory=GuardHabits, kw_only=True)

    @classmethod
    def draw(cls, profile: GuardProfile, rng: np.random.Generator) -> Walker:
        """Return one guard of a profile."""
        return cls(
            speed=profile.draw_speed(rng),
            mobilisation=profile.mobilisation_s.draw(rng),
            look=profile.confirm_look_s.draw(rng),
            contain=profile.contain_s.draw(rng),
            extinguish=profile.extinguish_s.draw(rng),
            usual_mobilisation=profile.mobilisation_s.median,
            habits=profile.habits,
        )


class BystanderProfile(PaceProfile):
    """Profile of people who work at a site and have no part in its surveillance.

    Attributes:
        premovement_s: Time from the alarm, or from noticing the danger, to the first step outwards.
        moving_share: Share of the people who change their place now and then.
        stay_s: Length of a stay at a place.
        habits: Numbers that are the same for all bystanders, none of them measured.

    References:
        Pre-movement times are log-normal in most evacuations: M. Forssberg, J. Kjellstroem,
        H. Frantzich, A. Mossberg, D. Nilsson: The variation of pre-movement time in building
        evacuation. Fire Technology 55, 2019.
    """

    premovement_s: Annotated[
        Trait, Assumed(20.0, 180.0, "people awake who know the building and hear a bell")
    ] = Trait(median=60.0, spread=0.6)
    moving_share: Annotated[
        float, Field(le=1), Assumed(0.0, 0.7, "from an office to a workshop")
    ] = 0.3
    stay_s: Annotated[Trait, Assumed(60.0, 900.0, "one to fifteen minutes")] = Trait(
        median=180.0, spread=0.8
    )
    habits: BystanderHabits = Field(default_factory=BystanderHabits)


@dataclass(frozen=True)
class Occupant:
    """One bystander.

    Attributes:
        speed: Walking [m/s].
        premovement: Time from the alarm to the first step [s].
        moves: True if it changes its place now and then.
        stay: Length of a stay at a place [s].
        habits: Habits of all bystanders.
    """

    speed: float
    premovement: float
    moves: bool
    stay: Trait
    habits: BystanderHabits = field(default_factory=BystanderHabits, kw_only=True)

    @classmethod
    def draw(cls, profile: BystanderProfile, rng: np.random.Generator) -> Occupant:
        """Return one bystander of a profile."""
        return cls(
            speed=profile.draw_speed(rng),
            premovement=profile.premovement_s.draw(rng),
            moves=bool(rng.random() < profile.moving_share),
            stay=profile.stay_s,
            habits=profile.habits,
        )
