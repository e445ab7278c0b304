"""The more urgent first, but nobody is called back: waits of each class.

Class 1 is the most urgent. Measures: `wait_1_s`, `wait_2_s`, ... of the classes, `wait_s` of
all customers, `utilisation`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from dva_sim.experiments.validation.dispatch.exact.queues import Law, Measures, Memoryless, erlang_c


def priorities(
    arrival_rates: Sequence[float], mean_service_s: Memoryless, servers: int
) -> Measures:
    """M/M/c, several classes with the same law of service.

    References:
        R. H. Davis, Oper. Res. 14 (1966) 133-136; O. Kella & U. Yechiali, Stochastic
        Models 1 (1985) 257-262: `W_k = C / (c mu (1 - sigma_(k-1)) (1 - sigma_k))`, where C is
        Erlang's probability of waiting and sigma_k the load of classes 1 to k.
    """
    load = sum(arrival_rates) * mean_service_s
    ahead = erlang_c(servers, load) * mean_service_s / servers
    loads = [rate * mean_service_s / servers for rate in arrival_rates]
    return _by_class(ahead, arrival_rates, loads)


def cobham(arrival_rates: Sequence[float], services: Sequence[Law]) -> Measures:
    """M/G/1, each class with its own law of service.

    References:
        A. Cobham, Oper. Res. 2 (1954) 70-76: `W_k = W_0 / ((1 - sigma_(k-1)) (1 - sigma_k))`,
        where `W_0 = sum lambda_i E[S_i^2] / 2`.
    """
    pairs = list(zip(arrival_rates, services, strict=True))
    ahead = sum(rate * service.second for rate, service in pairs) / 2
    return _by_class(ahead, arrival_rates, [rate * service.mean for rate, service in pairs])


def _by_class(ahead: float, rates: Sequence[float], loads: Sequence[float]) -> Measures:
    """Waits from the mean work that is in service when somebody comes [s]."""
    if not sum(loads) < 1:
        raise ValueError(f"the servers are offered {sum(loads):g} of what they can do")
    waits, above = [], 0.0
    for load in loads:
        waits.append(ahead / ((1 - above) * (1 - above - load)))
        above += load
    measures = {f"wait_{k}_s": wait for k, wait in enumerate(waits, start=1)}
    overall = math.fsum(r * w for r, w in zip(rates, waits, strict=True)) / math.fsum(rates)
    return measures | {"wait_s": overall, "utilisation": above}
