"""Policies: who goes where. They only advise; the service enforces the rules."""

from dva_sim.core.dispatch.policies import (
    POLICIES,
    Assignment,
    MinEta,
    NearestIdle,
    Policy,
    RandomChoice,
    Responder,
    Situation,
)

__all__ = [
    "POLICIES",
    "Assignment",
    "MinEta",
    "NearestIdle",
    "Policy",
    "RandomChoice",
    "Responder",
    "Situation",
]
