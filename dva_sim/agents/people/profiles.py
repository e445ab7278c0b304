"""Who people on foot are: guards and bystanders, drawn from profiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from dva_sim.agents.population import Trait
from dva_sim.kernel.config import Config

SLOWEST, FASTEST = 0.6, 2.2  # walking [m/s]


class PaceProfile(Config):
    """How fast people of some kind walk.

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
        """One person's free walking speed [m/s]: normal, no slower or faster than walking is."""
        speed = rng.normal(self.walking_mean_mps, self.walking_sd_mps)
        return float(np.clip(speed, SLOWEST, FASTEST))


class GuardProfile(PaceProfile):
    """How guards are drawn.

    Attributes:
        mobilisation_s: From the order to the first step.
        confirm_look_s: From arrival to being sure.
        contain_s: From arrival until a leak or flood is over: a valve found and shut. Assumed.
        extinguish_s: From arrival until a young fire is put out. Assumed, as of some discharges
            of a hand-held extinguisher.

    References:
        Turnout within 80 s in 90 % of all cases: NFPA 1710.
    """

    mobilisation_s: Trait = Trait(median=45.0, spread=0.45)
    confirm_look_s: Trait = Trait(median=3.0, spread=0.3)
    contain_s: Trait = Trait(median=120.0, spread=0.5)
    extinguish_s: Trait = Trait(median=30.0, spread=0.5)


@dataclass(frozen=True)
class Walker:
    """One guard.

    Attributes:
        speed: Walking [m/s].
        mobilisation: From an order to the first step [s].
        look: From arrival to being sure [s].
        contain: From arrival until a leak or flood is over [s].
        extinguish: From arrival until a fire is out [s].
        usual_mobilisation: What the guard itself expects of getting ready [s]: as long as
            guards usually need. How long it takes this time shows when it is over.
    """

    speed: float
    mobilisation: float
    look: float
    contain: float = 60.0
    extinguish: float = 30.0
    usual_mobilisation: float = 45.0

    @classmethod
    def draw(cls, profile: GuardProfile, rng: np.random.Generator) -> Walker:
        """One guard of a profile."""
        return cls(
            speed=profile.draw_speed(rng),
            mobilisation=profile.mobilisation_s.draw(rng),
            look=profile.confirm_look_s.draw(rng),
            contain=profile.contain_s.draw(rng),
            extinguish=profile.extinguish_s.draw(rng),
            usual_mobilisation=profile.mobilisation_s.median,
        )


class BystanderProfile(PaceProfile):
    """How people are drawn who work at a site and have no part in its surveillance.

    Attributes:
        premovement_s: From the alarm, or from noticing the danger, to the first step outwards.
        moving_share: Share of the people who change their place now and then. Assumed.
        stay_s: How long those stay at a place. Assumed.

    References:
        Pre-movement times are log-normal in most evacuations: M. Forssberg, J. Kjellstroem,
        H. Frantzich, A. Mossberg, D. Nilsson: The variation of pre-movement time in building
        evacuation. Fire Technology 55, 2019. A minute in the median is assumed, as of people
        who are awake, know the building and hear a bell.
    """

    premovement_s: Trait = Trait(median=60.0, spread=0.6)
    moving_share: Annotated[float, Field(ge=0, le=1)] = 0.3
    stay_s: Trait = Trait(median=180.0, spread=0.8)


@dataclass(frozen=True)
class Occupant:
    """One bystander.

    Attributes:
        speed: Walking [m/s].
        premovement: From the alarm to the first step [s].
        moves: Whether it changes its place now and then.
        stay: How long it then stays at a place [s].
    """

    speed: float
    premovement: float
    moves: bool
    stay: Trait

    @classmethod
    def draw(cls, profile: BystanderProfile, rng: np.random.Generator) -> Occupant:
        """One bystander of a profile."""
        return cls(
            speed=profile.draw_speed(rng),
            premovement=profile.premovement_s.draw(rng),
            moves=bool(rng.random() < profile.moving_share),
            stay=profile.stay_s,
        )
