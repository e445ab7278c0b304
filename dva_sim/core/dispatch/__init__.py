"""Policies: who goes where. They only advise; the core enforces the rules.

A policy is shown a `Situation` and returns advice: it imports `situation`, the parts in `greedy`
and `options`, and nothing else of the core. Begin with `situation`, then `greedy.MinEta`; the
shipped ones stand in `POLICIES` below.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

from dva_sim.core.dispatch.auction import Auction
from dva_sim.core.dispatch.coverage import Coverage
from dva_sim.core.dispatch.greedy import MinEta, NearestIdle, Preference, RandomChoice
from dva_sim.core.dispatch.optimal import BatchOptimal, OperatorAware
from dva_sim.core.dispatch.oracle import Instance, OraclePlan, OraclePolicy, solve
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
from dva_sim.kernel.plugins import Plugins

POLICIES: dict[str, Callable[..., Policy]] = {
    "auction": Auction,
    "batch_optimal": BatchOptimal,
    "coverage": Coverage,
    "hazard_team": HazardTeam,
    "min_eta": MinEta,
    "nearest_idle": NearestIdle,
    "operator_aware": OperatorAware,
    "oracle": OraclePolicy,
    "preemptive": Preemptive,
    "preference": Preference,
    "priority_eta": PriorityEta,
    "random": RandomChoice,
}

PLUGINS: Final = Plugins(
    "policy",
    Policy,
    POLICIES,
    folder="agents/policies",
    group="dva_sim.policies",
    key="dispatch.policy",
    needs="advise(situation, rng)",
    public="dva_sim.core.dispatch.Policy",
    hidden=frozenset({"oracle"}),  # that one needs to know the future
)

known_policies = PLUGINS.known


def load_policy(
    name: str | Callable[..., Policy], options: Mapping[str, Any] | None = None, base: Any = None
) -> Policy:
    """Make the policy that a name means; arguments as of `Plugins.load`.

    Raises:
        ConfigError: it cannot be found, or not be made. The line says what would be right.
    """
    return PLUGINS.load(name, options, base)()


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
    "OraclePlan",
    "OraclePolicy",
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
