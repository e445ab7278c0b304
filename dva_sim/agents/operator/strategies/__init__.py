"""How operators steer: from what they see, or (the reference) from what is."""

from dva_sim.agents.operator.strategies.adaptive import Adaptive
from dva_sim.agents.operator.strategies.base import (
    Guarded,
    Intent,
    PathView,
    PointView,
    Reach,
    Strategy,
    View,
)
from dva_sim.agents.operator.strategies.cursor import SHORTEST, Sighting, Velocity, gain_at
from dva_sim.agents.operator.strategies.loading import (
    Driver,
    known_strategies,
    load_strategy,
    try_strategy,
)
from dva_sim.agents.operator.strategies.move_and_wait import MoveAndWait
from dva_sim.agents.operator.strategies.predictor import Oracle, Predictor, Truth
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.operator.strategies.two_point import TwoPoint

__all__ = [
    "SHORTEST",
    "Adaptive",
    "Driver",
    "Guarded",
    "Intent",
    "MoveAndWait",
    "Oracle",
    "PathView",
    "PointView",
    "Predictor",
    "Pursuit",
    "Reach",
    "Sighting",
    "Strategy",
    "Truth",
    "TwoPoint",
    "Velocity",
    "View",
    "gain_at",
    "known_strategies",
    "load_strategy",
    "try_strategy",
]
