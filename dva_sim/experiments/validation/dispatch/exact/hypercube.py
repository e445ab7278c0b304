"""Units that are told apart, and calls that each have their own list of preferred units.

References:
    R. C. Larson, A hypercube queuing model for facility location and redistricting in urban
    emergency services, Comput. Oper. Res. 1 (1974) 67-95; R. C. Larson & A. R. Odoni, Urban
    Operations Research (1981), section 5.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.validation.dispatch.exact.queues import Floats, Measures, Memoryless

Ints = NDArray[np.int64]

MOST_UNITS = 8


def hypercube(
    arrival_rates: Sequence[float],
    preferences: Sequence[Sequence[int]],
    mean_service_s: Memoryless | Sequence[Memoryless],
    queue: Literal["infinite", "none"] = "infinite",
) -> Measures:
    """Workloads and who serves whom, from the Markov chain of all sets of busy units.

    A call goes to the first free unit on its class's list, each list naming all units. If
    none is free it waits (first come, first served, whatever the class) or is lost.

    Args:
        arrival_rates: Of each class of calls [1/s].
        preferences: For each class its units, best first, counted from 1.
        mean_service_s: Of all units, or of each unit.
        queue: `infinite`, or `none` for loss.

    Returns:
        `workload_n` of unit n; `share_n_k`, of all calls served those that are class k and
        served by unit n; `utilisation`; `delayed` and `wait_s`, or `lost`.

    References:
        R. C. Larson, Comput. Oper. Res. 1 (1974) 67-95, solved exactly as a Markov chain.
    """
    units = len(preferences[0])
    if not 1 <= units <= MOST_UNITS:
        raise ValueError(f"{units} units; from 1 to {MOST_UNITS} can be solved")
    if any(sorted(order) != list(range(1, units + 1)) for order in preferences):
        raise ValueError(f"each list of preferences should name the units 1 to {units} once")
    calls = np.asarray(arrival_rates, dtype=float)
    rates = 1 / np.broadcast_to(np.asarray(mean_service_s, dtype=float), (units,))
    chosen = _first_free(np.asarray(preferences) - 1, units)
    chance = _stationary(calls, rates, chosen)
    tail = _queued(calls.sum() / rates.sum(), chance) if queue == "infinite" else 0.0
    chance = chance / (1 + tail)  # the tail, relative to the sets without a queue
    waiting = tail / (1 + tail)
    return _measures(calls, rates, chosen, chance, waiting, queue)


def _first_free(orders: Ints, units: int) -> Ints:
    """Unit that a call of each class gets in each set of busy units `(classes, 2^units)`.

    A set is a number whose bit n says whether unit n is busy; -1 where all are.
    """
    chosen = np.full((len(orders), 2**units), -1)
    for k, order in enumerate(orders):
        for busy in range(2**units - 1):
            chosen[k, busy] = next(n for n in order if not busy >> n & 1)
    return chosen


def _stationary(calls: Floats, rates: Floats, chosen: Ints) -> Floats:
    """Chances of the sets, all units being busy counted without a queue `(2^units,)`.

    With a queue this is the same, up to its sum: as many calls begin to wait as cease to,
    and whenever there is a queue all units are busy.
    """
    sets = chosen.shape[1]
    flow = np.zeros((sets, sets))
    for busy in range(sets):
        for n, rate in enumerate(rates):
            if busy >> n & 1:
                flow[busy, busy & ~(1 << n)] += rate
        for k, rate in enumerate(calls):
            if chosen[k, busy] >= 0:
                flow[busy, busy | 1 << int(chosen[k, busy])] += rate
    balance = (flow - np.diag(flow.sum(axis=1))).T
    balance[-1] = 1.0  # one equation follows from the others; the sum takes its place
    return np.asarray(np.linalg.solve(balance, np.eye(sets)[-1]))


def _queued(load: float, chance: Floats) -> float:
    """How likely a queue is, relative to no queue: all units serve it, so it is geometric."""
    if not load < 1:
        raise ValueError(f"the units are offered {load:g} of what they can do; below 1 is stable")
    return float(chance[-1] * load / (1 - load))


def _measures(
    calls: Floats,
    rates: Floats,
    chosen: Ints,
    chance: Floats,
    waiting: float,
    queue: str,
) -> Measures:
    units, sets = len(rates), np.arange(len(chance))
    saturated = float(chance[-1]) + waiting
    served = 1.0 if queue == "infinite" else 1 - saturated
    workloads = [float(chance[(sets >> n & 1) == 1].sum()) + waiting for n in range(units)]
    measures = {f"workload_{n + 1}": workload for n, workload in enumerate(workloads)}
    for n in range(units):
        for k in range(len(calls)):
            at_once = float(chance[chosen[k] == n].sum())
            later = saturated * rates[n] / rates.sum() if queue == "infinite" else 0.0
            share = calls[k] / calls.sum() * (at_once + later) / served
            measures[f"share_{n + 1}_{k + 1}"] = float(share)
    measures["utilisation"] = sum(workloads) / units
    if queue == "none":
        return measures | {"lost": saturated}
    wait = saturated / float(rates.sum() - calls.sum())  # as in an M/M/c
    return measures | {"delayed": saturated, "wait_s": wait}
