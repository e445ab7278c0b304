"""Ways in a square: how far to a random place from the centre, or from the nearest of some.

All sides are `side_m`, all places uniform and independent, all ways straight.

Several events at once, several responders, and travel times that are pure chance.
"""

from __future__ import annotations

import math

import numpy as np

from dva_sim.validation.dispatch.exact.queues import DurationLaw, Floats, Measures, require_stable

_NODES = 32  # of Gauss-Legendre in each direction and piece; 48 change the ninth digit

# Mean distance from the centre of a unit square: (sqrt 2 + ln(1 + sqrt 2)) / 6.
CENTRE = (math.sqrt(2) + math.log(1 + math.sqrt(2))) / 6


def square_centre(side_m: float = 1.0) -> Measures:
    """Distance from the centre to a random place: mean and mean square.

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
    nodes, weights = (nodes + 1) / 2, weights / 2
    total = 0.0
    for u, wu in zip(nodes, weights, strict=True):
        for v, wv in zip(nodes, weights, strict=True):
            x, y = u / 2, u * v / 2
            total += wu * wv * u * _mean_nearest(x, y, places, nodes, weights)
    # The triangle has the area 1/8; its density in (u, v) is u/4, so that of 8 of them is 2u.
    return {"distance_m": float(2 * total * side_m)}


def sqm(
    arrival_rate: float, service: DurationLaw, side_m: float = 1.0, speed_mps: float = 1.0
) -> Measures:
    """One responder that starts from the centre of a square and comes back after each event.

    M/G/1 whose service is the way there, the time on scene, and the way back. `response_s`
    is from detection to arrival.

    References:
        O. Berman, R. C. Larson & S. S. Chiu, Optimal server location on a network operating
        as an M/G/1 queue, Oper. Res. 33 (1985) 746-771 (the stochastic queue median).
    """
    way, square = CENTRE * side_m / speed_mps, side_m**2 / 6 / speed_mps**2
    load = arrival_rate * (2 * way + service.mean)
    require_stable(load)
    second = 4 * square + 4 * way * service.mean + service.second
    wait = arrival_rate * second / (2 * (1 - load))
    return {
        "utilisation": load,
        "delayed": load,
        "wait_s": wait,
        "travel_s": way,
        "response_s": wait + way,
    }


def _mean_nearest(x: float, y: float, places: int, nodes: Floats, weights: Floats) -> float:
    """Integral of `(1 - A)^k` over r for an event at (x, y), piece by piece.

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
    across, up = np.minimum(r, a), np.minimum(r, b)
    inside = r**2 >= a**2 + b**2
    # From where the circle leaves the top edge to where it ends: the area under the circle.
    start = np.sqrt(np.maximum(r**2 - up**2, 0.0))
    under = _under_circle(across, r) - _under_circle(np.minimum(start, across), r)
    return np.where(inside, a * b, up * np.minimum(start, across) + under)


def _under_circle(x: Floats, r: Floats) -> Floats:
    """Integral of `sqrt(r^2 - t^2)` from 0 to x."""
    ratio = np.clip(x / np.maximum(r, 1e-300), 0.0, 1.0)
    return (x * np.sqrt(np.maximum(r**2 - x**2, 0.0)) + r**2 * np.arcsin(ratio)) / 2


def assignment(events: int, responders: int, mean_s: float = 1.0) -> Measures:
    """Total travel time if each pair's is exponential and independent of all others'.

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
