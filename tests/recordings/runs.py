"""Short runs to record, one of each kind, made once."""

from functools import cache

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate


@cache
def run_of(name: str, horizon_s: float, seed: int = 3) -> Recording:
    """A run as it is kept for pictures and recordings."""
    scenario = scenarios.build(scenarios.load(name), {"horizon_s": horizon_s})
    return simulate(scenario, seed, keep_traffic=True)


def drive() -> Recording:
    """Half a minute: a robot is driven towards a fire."""
    return run_of("drive-to-event", 30)


def drill() -> Recording:
    """A minute and a half: a fire and a gas leak, robots, guards, smoke."""
    return run_of("fire-drill", 90)


def evacuation() -> Recording:
    """Thirty people, most of whom sit at first; one has left before the end."""
    return run_of("evacuation", 60)
