"""Policies by name: the shipped ones, a class in a file of the user, or an installed package's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from dva_sim.core.dispatch.auction import Auction
from dva_sim.core.dispatch.coverage import Coverage
from dva_sim.core.dispatch.greedy import MinEta, NearestIdle, Preference, RandomChoice
from dva_sim.core.dispatch.optimal import BatchOptimal, OperatorAware
from dva_sim.core.dispatch.oracle import Oracle
from dva_sim.core.dispatch.situation import Policy
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
    "oracle": Oracle,
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


def known_policies() -> list[str]:
    """Names that a configuration can use: shipped and installed ones; files come on top."""
    return PLUGINS.known()


def load_policy(
    name: str, options: Mapping[str, Any] | None = None, base: Path | None = None
) -> Policy:
    """Make the policy that `name` means.

    Args:
        name: A shipped policy such as `min_eta`, a class in a file such as `mine.py:Mine`, or
            the name under which an installed package offers one (entry point, `dva_sim.policies`).
        options: Keyword arguments of its constructor.
        base: Folder that a file is looked for in first; then the working folder, and
            `agents/policies`.

    Raises:
        ConfigError: there is none of that name, its file or package cannot be loaded, it is not
            a policy, or an option is unknown or bad. The line says what would be right.
    """
    return PLUGINS.make(name, PLUGINS.find(name, base), options or {})
