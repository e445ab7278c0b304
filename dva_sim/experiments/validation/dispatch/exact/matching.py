"""Several events at once, several responders, and travel times that are pure chance."""

from __future__ import annotations

from dva_sim.experiments.validation.dispatch.exact.queues import Measures


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
