"""How operators steer: from what they see, or (the reference) from what is."""

from dva_sim.agents.operator.strategies.base import (
    Intent,
    PathView,
    PointView,
    Reach,
    Strategy,
    View,
)
from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity, gain_at
from dva_sim.agents.operator.strategies.guarded import Guarded
from dva_sim.agents.operator.strategies.loading import (
    Driver,
    known_strategies,
    load_strategy,
    try_strategy,
)
from dva_sim.agents.operator.strategies.oracle import Oracle, Truth
from dva_sim.agents.operator.strategies.pursuit import Pursuit

__all__ = [
    "Driver",
    "Guarded",
    "Intent",
    "Oracle",
    "PathView",
    "PointView",
    "Pursuit",
    "Reach",
    "Sighting",
    "Strategy",
    "Truth",
    "Velocity",
    "View",
    "gain_at",
    "known_strategies",
    "load_strategy",
    "try_strategy",
]
