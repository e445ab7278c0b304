"""Steering strategies of operators: by what they see, or, for the reference, by the truth.

A strategy stands on what persons, routes and observations are, and knows no robot. Begin with
`base.Strategy`, then `pursuit`; `loading` finds one by its name.
"""

from dva_sim.agents.operator.strategies.adaptive import Adaptive
from dva_sim.agents.operator.strategies.base import GuardedStrategy, PathView, PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity
from dva_sim.agents.operator.strategies.loading import (
    Driver,
    known_strategies,
    load_strategy,
    try_strategy,
)
from dva_sim.agents.operator.strategies.move_and_wait import MoveAndWait
from dva_sim.agents.operator.strategies.predictor import Oracle, Predictor, Truth
from dva_sim.agents.operator.strategies.pursuit import Pursuit, TwoPoint
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import SHORTEST, Intent, Reach, Route, View, gain_at

__all__ = [
    "SHORTEST",
    "Adaptive",
    "Driver",
    "GuardedStrategy",
    "Intent",
    "MoveAndWait",
    "Oracle",
    "PathView",
    "Person",
    "PointView",
    "Predictor",
    "Pursuit",
    "Reach",
    "Route",
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
