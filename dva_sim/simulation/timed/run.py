"""Run a timed scenario."""

from __future__ import annotations

from dva_sim.core.dispatch import Policy, load_policy
from dva_sim.simulation.timed.foresight import oracle_for
from dva_sim.simulation.timed.recording import TimedRecording
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.simulation import Shift


def simulate_timed(
    scenario: TimedScenario, seed: int, policy: Policy | None = None
) -> TimedRecording:
    """Run one scenario.

    Args:
        seed: Random seed; the events are the same for every policy.
        policy: Instead of the scenario's.

    Raises:
        ConfigError: the site cannot hold the team, or the policy cannot be made.
    """
    return Shift(scenario, seed, policy or policy_of(scenario, seed)).run()


def rehearse_timed(scenario: TimedScenario, seed: int) -> None:
    """Build a run without letting any time pass, to find what cannot work before it counts.

    Raises:
        ConfigError: see `simulate_timed`.
    """
    Shift(scenario, seed, policy_of(scenario, seed))


def policy_of(scenario: TimedScenario, seed: int) -> Policy:
    """The policy that a scenario names; the oracle knows the run's own future.

    Raises:
        ConfigError: it cannot be made.
    """
    if scenario.dispatch.policy == "oracle":
        return oracle_for(scenario, seed)
    return load_policy(scenario.dispatch.policy, scenario.dispatch.options)
