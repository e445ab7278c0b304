"""What a run shows, in columns: events in the order of their detection, and who was busy when.

Queues are computed here too, event by event, by other means than the simulation's.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dva_sim.simulation.shift import TimedRecording, TimedScenario
from dva_sim.simulation.shift.recording import OUTCOMES, TIMES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NOBODY = -1
_TIMES = ("detected", *TIMES)
_WHOLE = ("stream", "responder", "actor", "outcome")


@dataclass(frozen=True)
class Sample:
    """One run. Times in [s]; nan where something never happened.

    Attributes:
        streams: Names of the classes of events.
        units: Names of the responders.
        groups: Name of each responder's group.
        kinds: `guard` or `robot`, of each responder.
        operators: How many there are.
        sources: How many sources there are, if they are finite.
        begins: When measuring begins.
        ends: When it ends: no event after this.
        stream: Class of each event, a place in `streams` `(n,)`.
        unit: Who served it, a place in `units`; `NOBODY` if nobody did `(n,)`.
        outcome: `confirmed`, `contained`, `refuted`, `escalated`, `expired` or `open` `(n,)`.
        detected: `(n,)`
        assigned: `(n,)`
        arrived: `(n,)`
        confirmed: When who was sent was sure, one way or the other `(n,)`.
        act_assigned: When somebody was sent to contain it `(n,)`.
        act_arrived: `(n,)`
        closed: `(n,)`
        busy_unit: Who was busy, a place in `units` `(m,)`.
        busy_from: `(m,)`
        busy_until: `(m,)`
        waiting_area: Integral over the measured time of how many events wait, as the world
            itself has summed it up [s].
        served_area: The same of those that somebody is at.
        worked: Busy time of each unit in the measured time, as the unit itself has summed it
            up [s] `(k,)`.
        broken: Rules of the core that were broken, policies that failed or were overruled.
    """

    streams: tuple[str, ...]
    units: tuple[str, ...]
    groups: tuple[str, ...]
    kinds: tuple[str, ...]
    operators: int
    sources: int
    begins: float
    ends: float
    stream: Ints
    unit: Ints
    outcome: NDArray[np.str_]
    detected: Floats
    assigned: Floats
    arrived: Floats
    confirmed: Floats
    act_assigned: Floats
    act_arrived: Floats
    closed: Floats
    busy_unit: Ints
    busy_from: Floats
    busy_until: Floats
    waiting_area: float = 0.0
    served_area: float = 0.0
    worked: tuple[float, ...] = ()
    broken: int = 0

    @property
    def served(self) -> NDArray[np.bool_]:
        """Events that somebody went to and settled."""
        return np.isin(self.outcome, ("confirmed", "contained", "refuted"))


def occupied(starts: Floats, ends: Floats, edges: Floats) -> Floats:
    """How much of many intervals lies in each window, in total [s].

    Args:
        starts: Of the intervals `(n,)`.
        ends: nan for those that have not ended `(n,)`.
        edges: Of the windows, ascending `(b + 1,)`.

    Returns:
        `(b,)`
    """
    whole = np.where(np.isnan(ends), np.inf, ends)
    return np.asarray(np.diff(_since(starts, edges) - _since(whole, edges)))


def _since(moments: Floats, times: Floats) -> Floats:
    """How long ago all moments before each time were, in total [s]."""
    ordered = np.sort(moments)
    ordered = ordered[np.isfinite(ordered)]
    upto = np.concatenate([[0.0], np.cumsum(ordered)])
    before = np.searchsorted(ordered, times)
    return np.asarray(before * times - upto[before])


def sample_of(recording: TimedRecording) -> Sample:
    """What a recorded run shows."""
    scenario, columns = recording.scenario, recording.columns
    order = np.argsort(columns["detected"], kind="stable")
    order = order[np.isfinite(columns["detected"][order])]
    row = {name: np.asarray(columns[name][order], dtype=float) for name in _TIMES}
    who = {name: np.asarray(columns[name][order], dtype=np.int64) for name in _WHOLE}
    outcome = np.array(OUTCOMES)[who["outcome"]]
    closed = np.isin(outcome, ("confirmed", "contained", "refuted", "escalated", "expired"))
    unit, busy_from, busy_until = _busy(scenario, row, who)
    return Sample(
        streams=tuple(recording.streams),
        units=tuple(recording.responders),
        groups=tuple(g.name for g in scenario.responders for _ in range(g.count)),
        kinds=tuple(g.kind for g in scenario.responders for _ in range(g.count)),
        operators=scenario.operators.count,
        sources=sum(s.sources.count for s in scenario.demand if s.sources),
        begins=scenario.warm_up_s,
        ends=scenario.horizon_s,
        stream=who["stream"],
        unit=who["responder"],
        outcome=np.where(closed, outcome, "open"),
        detected=row["detected"],
        assigned=row["assigned"],
        arrived=row["arrived"],
        confirmed=np.where(outcome == "refuted", row["closed"], row["confirmed"]),
        act_assigned=row["act_assigned"],
        act_arrived=row["act_arrived"],
        closed=row["closed"],
        busy_unit=unit,
        busy_from=busy_from,
        busy_until=busy_until,
        waiting_area=float(recording.waiting.sum()),
        served_area=float(recording.served.sum()),
        worked=tuple(unit.busy for unit in recording.units),
        broken=sum(recording.violations.values())
        + recording.counters["policy failed"]
        + recording.counters["overruled"],
    )


def _busy(
    scenario: TimedScenario, row: dict[str, Floats], who: dict[str, Ints]
) -> tuple[Ints, Floats, Floats]:
    """Who had an order from when to when: to look, with the way back, and to act."""
    returns = np.array([g.after == "return" for g in scenario.responders for _ in range(g.count)])
    looked, acted = who["responder"] != NOBODY, who["actor"] != NOBODY
    ended = np.where(np.isfinite(row["confirmed"]), row["confirmed"], row["closed"])
    back = np.where(returns[who["responder"]], row["arrived"] - row["departed"], 0.0)
    unit = np.concatenate([who["responder"][looked], who["actor"][acted]])
    busy_from = np.concatenate([row["assigned"][looked], row["act_assigned"][acted]])
    busy_until = np.concatenate([(ended + back)[looked], row["contained"][acted]])
    return unit, busy_from, busy_until


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
