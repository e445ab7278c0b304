"""Exact answers by name: one queue, units with preferences, priorities, paths in a square.

Distinct units, each call with its own list of preferred units (the hypercube); a fixed
number of machines that need somebody from time to time, such as robots and their operators; the
more urgent first, but nobody is called back: class 1 is the most urgent, and measures are
`wait_1_s`, `wait_2_s`, ... of the classes, `wait_s` of all, `utilisation`. In a square all sides
are `side_m`, all places uniform and independent, all ways straight.

References:
    R. C. Larson, A hypercube queuing model for facility location and redistricting in urban
    emergency services, Comput. Oper. Res. 1 (1974) 67-95; R. C. Larson & A. R. Odoni, Urban
    Operations Research (1981), section 5.4; D. R. Olsen & M. A. Goodrich, Metrics for evaluating
    human-robot interactions, PerMIS (2003); D. R. Olsen & S. B. Wood, Fan-out: measuring human
    control of multiple robots, CHI (2004) 231-238.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from dva_sim.validation.dispatch.queues import (
    DurationLaw,
    Floats,
    LawMoments,
    Measures,
    Memoryless,
    birth_death,
    erlang_a,
    erlang_c,
    gm1,
    mg1,
    mgcc,
    mmc,
    mmck,
    require_stable,
    tandem,
)

Ints = NDArray[np.int64]

MAX_UNITS = 8


def hypercube(
    arrival_rates: Sequence[float],
    preferences: Sequence[Sequence[int]],
    mean_service_s: Memoryless | Sequence[Memoryless],
    queue: Literal["infinite", "none"] = "infinite",
) -> Measures:
    """Return workloads and shares of service, from the Markov chain of all sets of busy units.

    A call goes to the first free unit on its class's list, each list naming all units. If
    none is free it waits (first come, first served, whatever the class) or is lost.

    Args:
        arrival_rates: Arrival rate of each class of calls [1/s].
        preferences: Units of each class, best first, counted from 1.
        mean_service_s: Mean service time of all units, or of each unit.
        queue: `infinite`, or `none` for loss.

    Returns:
        `workload_n` of unit n; `share_n_k`, of all calls served those that are class k and
        served by unit n; `utilisation`; `delayed` and `wait_s`, or `lost`.

    References:
        R. C. Larson, Comput. Oper. Res. 1 (1974) 67-95, solved exactly as a Markov chain.
    """
    units = len(preferences[0])
    if not 1 <= units <= MAX_UNITS:
        raise ValueError(f"{units} units; from 1 to {MAX_UNITS} can be solved")
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
    """Return the unit that a call of each class gets in each set of busy units.

    A set is a number whose bit n says whether unit n is busy; -1 where all are.
    """
    chosen = np.full((len(orders), 2**units), -1)
    for k, order in enumerate(orders):
        for busy in range(2**units - 1):
            chosen[k, busy] = next(n for n in order if not busy >> n & 1)
    return chosen


def _stationary(calls: Floats, rates: Floats, chosen: Ints) -> Floats:
    """Return chances of the sets, all units being busy counted without a queue `(2^units,)`.

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
    """Return the probability of a queue relative to no queue; geometric, as all units serve it."""
    require_stable(load, "units")
    return float(chance[-1] * load / (1 - load))


def _measures(
    calls: Floats,
    rates: Floats,
    chosen: Ints,
    chance: Floats,
    waiting: float,
    queue: str,
) -> Measures:
    units = len(rates)
    sets = np.arange(len(chance))
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


def finite_source(
    sources: int, servers: int, mean_autonomous_s: Memoryless, mean_service_s: Memoryless
) -> Measures:
    """Return M/M/c//N: each source works alone for an exponential time, then waits for a server.

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
    """Return the number of robots one operator can serve in the deterministic case.

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


def priorities(
    arrival_rates: Sequence[float], mean_service_s: Memoryless, servers: int
) -> Measures:
    """Return M/M/c, several classes with the same law of service.

    References:
        R. H. Davis, Oper. Res. 14 (1966) 133-136; O. Kella & U. Yechiali, Stochastic
        Models 1 (1985) 257-262: `W_k = C / (c mu (1 - sigma_(k-1)) (1 - sigma_k))`, where C is
        Erlang's probability of waiting and sigma_k the load of classes 1 to k.
    """
    load = sum(arrival_rates) * mean_service_s
    ahead = erlang_c(servers, load) * mean_service_s / servers
    loads = [rate * mean_service_s / servers for rate in arrival_rates]
    return _by_class(ahead, arrival_rates, loads)


def cobham(arrival_rates: Sequence[float], services: Sequence[DurationLaw]) -> Measures:
    """Return M/G/1, each class with its own law of service.

    References:
        A. Cobham, Oper. Res. 2 (1954) 70-76: `W_k = W_0 / ((1 - sigma_(k-1)) (1 - sigma_k))`,
        where `W_0 = sum lambda_i E[S_i^2] / 2`.
    """
    pairs = list(zip(arrival_rates, services, strict=True))
    ahead = sum(rate * service.second for rate, service in pairs) / 2
    return _by_class(ahead, arrival_rates, [rate * service.mean for rate, service in pairs])


def _by_class(ahead: float, rates: Sequence[float], loads: Sequence[float]) -> Measures:
    """Return waits from the mean work that is in service when somebody comes [s]."""
    if not sum(loads) < 1:
        raise ValueError(f"the servers are offered {sum(loads):g} of what they can do")
    waits = []
    above = 0.0
    for load in loads:
        waits.append(ahead / ((1 - above) * (1 - above - load)))
        above += load
    measures = {f"wait_{k}_s": wait for k, wait in enumerate(waits, start=1)}
    overall = math.fsum(r * w for r, w in zip(rates, waits, strict=True)) / math.fsum(rates)
    return measures | {"wait_s": overall, "utilisation": above}


_NODES = 32  # Gauss-Legendre nodes per direction and piece; 48 change the ninth digit

# Mean distance from the centre of a unit square: (sqrt 2 + ln(1 + sqrt 2)) / 6.
CENTRE = (math.sqrt(2) + math.log(1 + math.sqrt(2))) / 6


def square_centre(side_m: float = 1.0) -> Measures:
    """Return the distance from the centre to a random place: mean and mean square.

    References:
        R. C. Larson & A. R. Odoni, Urban Operations Research (1981), chapter 3; the mean
        square is twice the variance of a uniform coordinate, `2 a^2 / 12`.
    """
    return {"distance_m": CENTRE * side_m, "square_m2": side_m**2 / 6}


def square_nearest(places: int, side_m: float = 1.0) -> Measures:
    """Mean distance from a random event to the nearest of `places` random responders.

    No closed form is known but for one responder, so it is integrated: nobody is nearer than
    r with probability `(1 - A)^k`, where A is the share of the square within r of the event.

    References:
        One responder: `(2 + sqrt 2 + 5 ln(1 + sqrt 2)) / 15 = 0.521405`, L. A. Santalo,
        Integral Geometry and Geometric Probability (1976).
    """
    # By symmetry the event lies in the lower left quarter, and not above its diagonal.
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    nodes = (nodes + 1) / 2
    weights = weights / 2
    total = 0.0
    for u, wu in zip(nodes, weights, strict=True):
        for v, wv in zip(nodes, weights, strict=True):
            x = u / 2
            y = u * v / 2
            total += wu * wv * u * _mean_nearest(x, y, places, nodes, weights)
    # The triangle has the area 1/8; its density in (u, v) is u/4, so that of 8 of them is 2u.
    return {"distance_m": float(2 * total * side_m)}


def sqm(
    arrival_rate: float, service: DurationLaw, side_m: float = 1.0, speed_mps: float = 1.0
) -> Measures:
    """Return one responder that starts from the centre of a square and comes back after each event.

    M/G/1 whose service is the way there, the time on scene, and the way back. `response_s`
    is from detection to arrival.

    References:
        O. Berman, R. C. Larson & S. S. Chiu, Optimal server location on a network operating
        as an M/G/1 queue, Oper. Res. 33 (1985) 746-771 (the stochastic queue median).
    """
    travel_s = CENTRE * side_m / speed_mps
    square = side_m**2 / 6 / speed_mps**2
    second = 4 * square + 4 * travel_s * service.mean + service.second
    measures = mg1(arrival_rate, LawMoments(2 * travel_s + service.mean, second))
    return measures | {"travel_s": travel_s, "response_s": measures["wait_s"] + travel_s}


def _mean_nearest(x: float, y: float, places: int, nodes: Floats, weights: Floats) -> float:
    """Return the integral of `(1 - A)^k` over r for an event at (x, y), piece by piece.

    The area within r has kinks where the circle first reaches a side or a corner.
    """
    sides = [x, y, 1 - x, 1 - y]
    corners = [math.hypot(a, b) for a in (x, 1 - x) for b in (y, 1 - y)]
    edges = np.unique(np.concatenate([[0.0], sides, corners]))
    r = edges[:-1, None] + np.diff(edges)[:, None] * nodes
    area = sum(_quarter(r, a, b) for a in (x, 1 - x) for b in (y, 1 - y))
    free = np.clip(1 - area, 0.0, 1.0) ** places
    return float(np.diff(edges) @ (free @ weights))


def _quarter(r: Floats, a: float, b: float) -> Floats:
    """Area of a quarter disc of radius r around a corner of an `a` by `b` rectangle, inside it."""
    across = np.minimum(r, a)
    up = np.minimum(r, b)
    inside = r**2 >= a**2 + b**2
    # From where the circle leaves the top edge to where it ends: the area under the circle.
    start = np.sqrt(np.maximum(r**2 - up**2, 0.0))
    under = _under_circle(across, r) - _under_circle(np.minimum(start, across), r)
    return np.where(inside, a * b, up * np.minimum(start, across) + under)


def _under_circle(x: Floats, r: Floats) -> Floats:
    """Return the integral of `sqrt(r^2 - t^2)` from 0 to x."""
    ratio = np.clip(x / np.maximum(r, 1e-300), 0.0, 1.0)
    return (x * np.sqrt(np.maximum(r**2 - x**2, 0.0)) + r**2 * np.arcsin(ratio)) / 2


def assignment(events: int, responders: int, mean_s: float = 1.0) -> Measures:
    """Return the total travel time if each pair's is exponential and independent of all others'.

    Every event gets a responder, or every responder an event, whatever there is less of.
    `optimal_s` is the least total; `greedy_s` the one of always taking the nearest pair, or
    of serving the events one by one with the nearest responder left (where there is one for
    each event, both have the same mean).

    References:
        G. Parisi (1998), D. Coppersmith & G. B. Sorkin, Random Struct. Alg. 15 (1999)
        113-144, proved by S. Linusson & J. Wästlund and by C. Nair, B. Prabhakar & M. Sharma
        (2003-05): sum of `1 / ((m - i)(n - j))` over `i + j < k`. Greedy: the least of `q`
        unit exponentials has the mean `1 / q`, and what is above it is again exponential.
    """
    few = min(events, responders)
    pairs = [(i, j) for i in range(few) for j in range(few - i)]
    optimal = sum(1 / ((events - i) * (responders - j)) for i, j in pairs)
    greedy = sum((few - i) / ((events - i) * (responders - i)) for i in range(few))
    return {
        "optimal_s": optimal * mean_s,
        "greedy_s": greedy * mean_s,
        "optimal_each_s": optimal * mean_s / few,
        "greedy_each_s": greedy * mean_s / few,
    }


FORMULAS: Final[dict[str, Callable[..., Measures]]] = {
    formula.__name__: formula
    for formula in (
        *(mmc, mgcc, mmck, mg1, gm1, erlang_a, tandem, priorities, cobham, hypercube),
        *(finite_source, fan_out, square_centre, square_nearest, sqm, assignment),
    )
}
