"""Run a timed scenario."""

from __future__ import annotations

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch import Policy, load_policy
from dva_sim.core.dispatch.oracle import Instance, OraclePolicy, solve
from dva_sim.core.dispatch.situation import Advice, Situation
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.timed.incidents import Incident
from dva_sim.simulation.timed.recording import TimedRecording
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.simulation import Shift

MAX_EVENTS = 12  # an exact plan for more takes too long
MAX_UNITS = 4  # an exact plan for more takes too long


class _Nobody(Policy):
    """Sends no responder, so that all events happen unhandled."""

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> list[Advice]:
        return []


def oracle_for(scenario: TimedScenario, seed: int) -> OraclePolicy:
    """Return the best plan for a run, followed.

    Raises:
        ConfigError: the run is not of the small kind that can be solved exactly.
    """
    shift, incidents = _foresee(scenario, seed)
    plan = solve(make_instance(shift, incidents))
    return OraclePolicy(plan, [unit.device for unit in shift.units])


def make_instance(shift: Shift, incidents: list[Incident]) -> Instance:
    """Convert a run's random draws to an instance for the solver."""
    arrival = np.array(
        [
            [shift.mobilisation(u, i) + shift.trip(u, u.base, i.place) for u in shift.units]
            for i in incidents
        ]
    )
    on_scene = np.array(
        [
            [
                shift.look(u, i) + shift.terrain.length(i.place, u.base) / u.speed
                for u in shift.units
            ]
            for i in incidents
        ]
    )
    return Instance(np.array([i.noticed for i in incidents]), arrival, arrival + on_scene)


def _foresee(scenario: TimedScenario, seed: int) -> tuple[Shift, list[Incident]]:
    """Return a run and its events, in the order in which they are reported."""
    _check_small(scenario)
    patient = scenario.dispatch.model_copy(
        update={"escalate_after_s": None, "most_waiting": None, "policy": "min_eta", "options": {}}
    )
    watched = scenario.model_copy(update={"dispatch": patient, "drain": False})
    shift = Shift(watched, seed, _Nobody())
    shift.run()
    incidents = [each for events in shift.events.values() for each in events]
    if not 0 < len(incidents) <= MAX_EVENTS:
        raise ConfigError(
            f"the oracle plans for 1 to {MAX_EVENTS} events; this run has {len(incidents)}: "
            "give max_events, or a shorter horizon_s"
        )
    return shift, incidents


def _check_small(scenario: TimedScenario) -> None:
    """Refuse what a plan of tours from the base does not describe."""
    alike = all(g.kind == "guard" and g.after == "return" for g in scenario.responders)
    plain = all(s.sources is None and s.patience is None for s in scenario.demand)
    together = all(g.from_s == 0.0 for g in scenario.responders)
    few = len(scenario.names) <= MAX_UNITS and not scenario.dispatch.containment
    if not (alike and plain and together and few):
        raise ConfigError(
            f"the oracle plans for up to {MAX_UNITS} guards that look and return (after: "
            "return), without containment, patience, finite sources or later shifts"
        )
    if scenario.merge_distance:
        raise ConfigError("the oracle needs dispatch.merge_distance_m 0: each report an event")


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
    """Return the policy that a scenario names; the oracle knows the run's own future.

    Raises:
        ConfigError: it cannot be made.
    """
    if scenario.dispatch.policy == "oracle":
        return oracle_for(scenario, seed)
    return load_policy(scenario.dispatch.policy, scenario.dispatch.options)
