"""Policies: who goes where. They only advise; the core enforces the rules."""

from dva_sim.core.dispatch.auction import Auction
from dva_sim.core.dispatch.coverage import Coverage
from dva_sim.core.dispatch.greedy import MinEta, NearestIdle, Preference, RandomChoice
from dva_sim.core.dispatch.loading import POLICIES, known_policies, load_policy
from dva_sim.core.dispatch.optimal import BatchOptimal, OperatorAware
from dva_sim.core.dispatch.oracle import Instance, Oracle, Plan, solve
from dva_sim.core.dispatch.situation import (
    Advice,
    Announcement,
    Assignment,
    Cover,
    Floats,
    Policy,
    Relocation,
    Responder,
    Situation,
    Task,
)
from dva_sim.core.dispatch.team import HazardTeam
from dva_sim.core.dispatch.urgency import Preemptive, PriorityEta

__all__ = [
    "POLICIES",
    "Advice",
    "Announcement",
    "Assignment",
    "Auction",
    "BatchOptimal",
    "Cover",
    "Coverage",
    "Floats",
    "HazardTeam",
    "Instance",
    "MinEta",
    "NearestIdle",
    "OperatorAware",
    "Oracle",
    "Plan",
    "Policy",
    "Preemptive",
    "Preference",
    "PriorityEta",
    "RandomChoice",
    "Relocation",
    "Responder",
    "Situation",
    "Task",
    "known_policies",
    "load_policy",
    "solve",
]
