"""A fixed number of machines that need somebody from time to time: robots and their operators.

References:
    D. R. Olsen & M. A. Goodrich, Metrics for evaluating human-robot interactions, PerMIS
    (2003); D. R. Olsen & S. B. Wood, Fan-out: measuring human control of multiple robots,
    CHI (2004) 231-238.
"""

from __future__ import annotations

import numpy as np

from dva_sim.experiments.validation.dispatch.exact.queues import Measures, Memoryless, birth_death


def finite_source(
    sources: int, servers: int, mean_autonomous_s: Memoryless, mean_service_s: Memoryless
) -> Measures:
    """M/M/c//N: each source works alone for an exponential time, then waits for a server.

    Measures: `utilisation` of a server, `autonomous` (mean number of sources that work
    alone), `delayed`, `wait_s`, `stay_s`, `throughput` (services per second).

    References:
        Gross et al., Fundamentals of Queueing Theory, 4th ed. (2008), chapter 2 (finite source).
        Who asks for service sees the system as it is with one source less.
    """
    needy = np.arange(sources + 1)
    busy = np.minimum(needy, servers)
    chance = birth_death((sources - needy[:-1]) / mean_autonomous_s, busy[1:] / mean_service_s)
    alone = float(chance @ (sources - needy))
    throughput = alone / mean_autonomous_s
    wait = float(chance @ (needy - busy)) / throughput  # Little
    asking = (sources - needy) * chance / alone
    return {
        "utilisation": float(chance @ busy) / servers,
        "autonomous": alone,
        "delayed": float(asking[servers:].sum()),
        "wait_s": wait,
        "stay_s": wait + mean_service_s,
        "throughput": throughput,
    }


def fan_out(neglect_s: float, interaction_s: float, robots: int = 1) -> Measures:
    """How many robots one operator can serve if nothing is left to chance.

    `fan_out` is the number at which the operator has just no pause left; with fewer `robots`
    nobody waits, with more each waits until all the others have been served.

    References:
        Olsen & Goodrich (2003): fan-out = activity time / interaction time, where activity
        time = neglect time + interaction time.
    """
    cycle = max(neglect_s + interaction_s, robots * interaction_s)
    return {
        "fan_out": neglect_s / interaction_s + 1,
        "utilisation": robots * interaction_s / cycle,
        "autonomous": robots * neglect_s / cycle,
        "wait_s": cycle - neglect_s - interaction_s,
        "throughput": robots / cycle,
    }
