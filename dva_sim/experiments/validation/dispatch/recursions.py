"""Queues computed event by event, by other means than the simulation's."""

from __future__ import annotations

import heapq

import numpy as np

from dva_sim.experiments.validation.dispatch.sample import Floats, Ints


def many_servers(times: Floats, services: Floats, servers: int) -> Floats:
    """Waits at several servers, first come first served.

    Args:
        times: Of arrival, ascending `(n,)`.
        services: `(n,)`
        servers: How many.

    References:
        J. Kiefer & J. Wolfowitz, Trans. Am. Math. Soc. 78 (1955) 1-18.
    """
    free = [-np.inf] * servers
    waits = []
    for came, takes in zip(times.tolist(), services.tolist(), strict=True):
        start = max(came, heapq.heappop(free))
        heapq.heappush(free, start + takes)
        waits.append(start - came)
    return np.array(waits)


def one_server(times: Floats, services: Floats, ranks: Ints) -> Floats:
    """Waits at one server that goes by rank, and within a rank by who came first.

    Args:
        times: Of arrival, ascending `(n,)`.
        services: `(n,)`
        ranks: The lowest is served first; nobody is interrupted `(n,)`.
    """
    came, takes, rank = times.tolist(), services.tolist(), ranks.tolist()
    waits = np.zeros(len(came))
    queue: list[tuple[int, int]] = []
    free, following = -np.inf, 0
    while following < len(came) or queue:
        if not queue:
            free = max(free, came[following])
        while following < len(came) and came[following] <= free:
            heapq.heappush(queue, (rank[following], following))
            following += 1
        who = heapq.heappop(queue)[1]
        waits[who] = free - came[who]
        free += takes[who]
    return waits
