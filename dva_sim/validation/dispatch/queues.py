"""One queue with one or more servers: exact results of queueing theory.

A server is a responder or an operator, a customer an event. Every formula takes rates per
second and times in seconds, and gives its measures by name:

- `utilisation`: share of time that a server is busy;
- `delayed`: share of the admitted customers that have to wait;
- `wait_s`: mean time from arrival to the beginning of service, of those who are served;
- `stay_s`: mean time from arrival to the end of service, of those who are served;
- `lost`: share of all customers who find no room.

References:
    L. Kleinrock, Queueing Systems, vol. 1 (1975); D. Gross et al., Fundamentals of Queueing
    Theory, 4th ed. (2008).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from dva_sim.simulation.timed import distributions
from dva_sim.validation.dispatch.transforms import laplace

Measures = dict[str, float]
Floats = NDArray[np.float64]


Memoryless = Annotated[float, "exponential"]
"""The mean of a time that must be exponential for the formula to hold [s]."""


class DurationLaw(Protocol):
    """Moments of a duration that most formulas need."""

    @property
    def mean(self) -> float:
        """Expected value [s]."""

    @property
    def second(self) -> float:
        """Expected square [s^2]."""


class LawMoments(NamedTuple):
    """Properties of a law that the formulas need; see `DurationLaw`."""

    mean: float
    second: float


def _usual(utilisation: float, delayed: float, wait_s: float, service_s: float) -> Measures:
    """Return the measures that most queues have."""
    stay_s = wait_s + service_s
    return {"utilisation": utilisation, "delayed": delayed, "wait_s": wait_s, "stay_s": stay_s}


def erlang_b(servers: int, load: float) -> float:
    """Return the probability that all servers are busy, without a queue.

    Args:
        servers: Number of servers.
        load: Arrivals during one mean service time.

    References:
        Gross et al. (2008), chapter 2 (Erlang's loss formula), by the usual recursion.
    """
    blocked = 1.0
    for n in range(1, servers + 1):
        blocked = load * blocked / (n + load * blocked)
    return blocked


def erlang_c(servers: int, load: float) -> float:
    """Return the probability of waiting with an unlimited queue; needs `load < servers`.

    References:
        Gross et al. (2008), chapter 2 (several servers).
    """
    require_stable(load / servers)
    blocked = erlang_b(servers, load)
    return servers * blocked / (servers - load * (1 - blocked))


def mmc(
    arrival_rate: float, mean_service_s: Memoryless, servers: int, at_s: Sequence[float] = ()
) -> Measures:
    """Return M/M/c: Poisson arrivals, exponential service, unlimited queue, order of arrival.

    Beside the usual measures: `wait_50_s`, `wait_90_s` and `wait_95_s`, quantiles of the wait
    of all customers (0 for those who need not wait), and `beyond_T`, the share that waits
    longer than each time T in `at_s`.

    References:
        Gross et al. (2008), chapter 2: a wait beyond `t` has the probability
        `C exp(-(c mu - lambda) t)`.
    """
    load = arrival_rate * mean_service_s
    delayed = erlang_c(servers, load)
    drain = servers / mean_service_s - arrival_rate
    measures = _usual(load / servers, delayed, delayed / drain, mean_service_s)
    for percent in (50, 90, 95):
        beyond = 1 - percent / 100
        measures[f"wait_{percent}_s"] = max(0.0, math.log(delayed / beyond) / drain)
    return measures | {f"beyond_{t:g}": delayed * math.exp(-drain * t) for t in at_s}


def mgcc(arrival_rate: float, mean_service_s: float, servers: int) -> Measures:
    """Return M/G/c/c: customers who find all servers busy are lost; only mean service matters.

    References:
        A. K. Erlang (1917); insensitivity: B. A. Sevastyanov, Theory Probab. Appl. 2 (1957)
        104-112.
    """
    load = arrival_rate * mean_service_s
    lost = erlang_b(servers, load)
    return {"lost": lost} | _usual(load * (1 - lost) / servers, 0.0, 0.0, mean_service_s)


def mmck(arrival_rate: float, mean_service_s: Memoryless, servers: int, places: int) -> Measures:
    """Return M/M/c/K: at most `places` customers wait (K = c + places); others are lost.

    References:
        Gross et al. (2008), chapter 2 (a limited queue).
    """
    room = servers + places
    inside = np.arange(room + 1)
    busy = np.minimum(inside, servers)
    chance = birth_death(np.full(room, arrival_rate), busy[1:] / mean_service_s)
    admitted = 1 - chance[-1]
    wait = float(chance @ (inside - busy)) / (arrival_rate * admitted)  # Little
    delayed = float(chance[servers:-1].sum()) / admitted
    measures = _usual(float(chance @ busy) / servers, delayed, wait, mean_service_s)
    return {"lost": float(chance[-1])} | measures


def mg1(arrival_rate: float, service: DurationLaw) -> Measures:
    """Return M/G/1: one server, any law of service, unlimited queue.

    References:
        F. Pollaczek (1930), A. Khinchine (1932); Kleinrock (1975), eq. (5.113).
    """
    load = arrival_rate * service.mean
    require_stable(load)
    return _usual(load, load, arrival_rate * service.second / (2 * (1 - load)), service.mean)


def gm1(between: distributions.Law, mean_service_s: Memoryless) -> Measures:
    """Return G/M/1: any law between arrivals, one server with exponential service.

    References:
        Kleinrock (1975), section 6.4: sigma is the root of `sigma = A*(mu - mu sigma)`
        in (0, 1), eq. (6.27); mean wait `sigma / (mu (1 - sigma))`, eq. (6.30).
    """
    from scipy.optimize import brentq

    require_stable(mean_service_s / between.mean)
    rate = 1 / mean_service_s
    # At sigma = 1 the equation always holds; the root sought lies below it.
    sigma = float(brentq(lambda x: laplace(between, rate * (1 - x)) - x, 0.0, 1 - 1e-9))
    wait = sigma * mean_service_s / (1 - sigma)
    return _usual(mean_service_s / between.mean, sigma, wait, mean_service_s)


def erlang_a(
    arrival_rate: float, mean_service_s: Memoryless, servers: int, mean_patience_s: Memoryless
) -> Measures:
    """Return M/M/c+M: waiting customers give up after an exponential time.

    Beside the usual measures: `abandoned`, share of all customers who give up, and
    `wait_all_s`, mean wait of all customers, who gave up included.

    References:
        C. Palm (1957); A. Mandelbaum & S. Zeltyn, Service engineering in action: the
        Palm/Erlang-A queue (2007). A customer with `j` places to go until it is served
        leaves each with rate `c mu + i theta` and is served with `c mu / (c mu + j theta)`.
    """
    rate = 1 / mean_service_s
    impatience = 1 / mean_patience_s
    # Longer queues have a negligible probability: customers leave much faster.
    balance = max(0.0, (arrival_rate - rate * servers) / impatience)
    most = int(balance + 40 * math.sqrt(arrival_rate / impatience + 1) + 100)
    inside = np.arange(servers + most + 1)
    busy = np.minimum(inside, servers)
    deaths = busy * rate + (inside - busy) * impatience
    chance = birth_death(np.full(len(inside) - 1, arrival_rate), deaths[1:])
    abandoned = float(chance @ (inside - busy)) * impatience / arrival_rate
    rank = np.arange(1, most + 2)  # position in the queue on arrival when all servers are busy
    served = servers * rate / (servers * rate + rank * impatience)
    until = np.cumsum(1 / (servers * rate + rank * impatience))
    wait = float(chance[servers:] @ (served * until)) / (1 - abandoned)
    delayed = float(chance[servers:].sum())
    measures = _usual(float(chance @ busy) / servers, delayed, wait, mean_service_s)
    return {"abandoned": abandoned, "wait_all_s": abandoned * mean_patience_s} | measures


def tandem(
    arrival_rate: float,
    first_service_s: Memoryless,
    first_servers: int,
    second_service_s: Memoryless,
    second_servers: int,
) -> Measures:
    """Return two M/M/c in a row: the second sees random arrivals, as if the first were not there.

    Measures carry the number of their station: `wait_1_s`, `wait_2_s`, `utilisation_1`, ...;
    `stay_s` is the time through all stations.

    References:
        P. J. Burke, Oper. Res. 4 (1956) 699-704; J. R. Jackson, Oper. Res. 5 (1957) 518-521.
    """
    first = mmc(arrival_rate, first_service_s, first_servers)
    second = mmc(arrival_rate, second_service_s, second_servers)
    measures = {"stay_s": first["stay_s"] + second["stay_s"]}
    for number, station in enumerate((first, second), start=1):
        measures |= {f"{name}_{number}": station[name] for name in ("utilisation", "delayed")}
        measures[f"wait_{number}_s"] = station["wait_s"]
    return measures


def birth_death(births: Floats, deaths: Floats) -> Floats:
    """Stationary probabilities of states 0 to n from the n rates up and the n rates down."""
    logs = np.concatenate([[0.0], np.cumsum(np.log(births) - np.log(deaths))])
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum())


def require_stable(load: float, who: str = "servers") -> None:
    """Reject a load [share of capacity] without a stationary state."""
    if not load < 1:
        raise ValueError(f"the {who} are offered {load:g} of what they can do; below 1 is stable")
