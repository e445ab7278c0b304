"""Measures of a run, each a sum over a sum in every batch, by the names that cases use.

A run is seen in columns: events in the order of their detection, and who was busy when. Queues are
computed here too, event by event, by other means than the simulation's.

A name may be narrowed: `wait_s@urgent` to the events of one stream; `utilisation/guard` to a
group, `utilisation/operators` to those who drive robots; `workload/guard-1`,
`share/guard-1/urgent` and `wait_beyond/30` need what is behind the stroke. Words mean the same
as in the formulas: `served` events are those that somebody went to and settled; `delayed` is a
share of all but those turned away at once.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.simulation.timed import TimedRecording
from dva_sim.simulation.timed.recording import OUTCOMES, TIMES
from dva_sim.simulation.timed.scenario import TimedScenario

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NOBODY = -1
_MOMENTS = ("detected", *TIMES)
_PLACES = ("stream", "responder", "actor", "outcome")


@dataclass(frozen=True)
class Sample:
    """One run. Times in [s]; nan where something never happened.

    Attributes:
        streams: Names of the classes of events.
        units: Names of the responders.
        groups: Name of the group of each responder.
        kinds: Kind of each responder, `guard` or `robot`.
        operators: Number of operators.
        sources: Number of sources, if finite.
        begins: Start of the measurement.
        ends: End of the measurement: no event after this.
        stream: Class of each event, a place in `streams` `(n,)`.
        unit: Index in `units` of the unit that served it; `NOBODY` if none `(n,)`.
        outcome: `confirmed`, `contained`, `refuted`, `escalated`, `expired` or `open` `(n,)`.
        detected: `(n,)`
        assigned: `(n,)`
        arrived: `(n,)`
        confirmed: Time at which the responder was sure, one way or the other `(n,)`.
        act_assigned: Time at which a unit was sent to contain it `(n,)`.
        act_arrived: `(n,)`
        closed: `(n,)`
        busy_unit: Busy unit, an index into `units` `(m,)`.
        busy_from: `(m,)`
        busy_until: `(m,)`
        waiting_area: Integral over the measured time of how many events wait, as the world
            itself has summed it up [s].
        served_area: Integral of the number of events with a responder on site [s].
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
        """Events that a unit went to and settled."""
        return np.isin(self.outcome, ("confirmed", "contained", "refuted"))


def occupied(starts: Floats, ends: Floats, edges: Floats) -> Floats:
    """Return the total length of the intervals within each window [s].

    Args:
        starts: Starts of the intervals `(n,)`.
        ends: nan for those that have not ended `(n,)`.
        edges: Edges of the windows, ascending `(b + 1,)`.

    Returns:
        `(b,)`
    """
    whole = np.where(np.isnan(ends), np.inf, ends)
    return np.asarray(np.diff(_since(starts, edges) - _since(whole, edges)))


def _since(moments: Floats, times: Floats) -> Floats:
    """Return the total age of all earlier moments at each time [s]."""
    ordered = np.sort(moments)
    ordered = ordered[np.isfinite(ordered)]
    upto = np.concatenate([[0.0], np.cumsum(ordered)])
    before = np.searchsorted(ordered, times)
    return np.asarray(before * times - upto[before])


def extract_sample(recording: TimedRecording) -> Sample:
    """Extract the sample from a recorded run."""
    scenario = recording.scenario
    columns = recording.columns
    order = np.argsort(columns["detected"], kind="stable")
    order = order[np.isfinite(columns["detected"][order])]
    row = {name: np.asarray(columns[name][order], dtype=float) for name in _MOMENTS}
    places = {name: np.asarray(columns[name][order], dtype=np.int64) for name in _PLACES}
    outcome = np.array(OUTCOMES)[places["outcome"]]
    closed = np.isin(outcome, ("confirmed", "contained", "refuted", "escalated", "expired"))
    unit, busy_from, busy_until = _busy_times(scenario, row, places)
    return Sample(
        streams=tuple(recording.streams),
        units=tuple(recording.responders),
        groups=tuple(g.name for g in scenario.responders for _ in range(g.count)),
        kinds=tuple(g.kind for g in scenario.responders for _ in range(g.count)),
        operators=scenario.operators.count,
        sources=sum(s.sources.count for s in scenario.demand if s.sources),
        begins=scenario.warm_up_s,
        ends=scenario.horizon_s,
        stream=places["stream"],
        unit=places["responder"],
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


def _busy_times(
    scenario: TimedScenario, row: dict[str, Floats], places: dict[str, Ints]
) -> tuple[Ints, Floats, Floats]:
    """Return the units' busy times: looking, with the way back, and acting."""
    returns = np.array([g.after == "return" for g in scenario.responders for _ in range(g.count)])
    looked = places["responder"] != NOBODY
    acted = places["actor"] != NOBODY
    ended = np.where(np.isfinite(row["confirmed"]), row["confirmed"], row["closed"])
    back = np.where(returns[places["responder"]], row["arrived"] - row["departed"], 0.0)
    unit = np.concatenate([places["responder"][looked], places["actor"][acted]])
    busy_from = np.concatenate([row["assigned"][looked], row["act_assigned"][acted]])
    busy_until = np.concatenate([(ended + back)[looked], row["contained"][acted]])
    return unit, busy_from, busy_until


def many_servers(times: Floats, services: Floats, servers: int) -> Floats:
    """Return waits at several servers, first come first served.

    Args:
        times: Arrival times, ascending `(n,)`.
        services: `(n,)`
        servers: Number of servers.

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
    """Return waits at one server that serves by rank, and within a rank in order of arrival.

    Args:
        times: Arrival times, ascending `(n,)`.
        services: `(n,)`
        ranks: Ranks, of which the lowest is served first, without interruption `(n,)`.
    """
    came = times.tolist()
    takes = services.tolist()
    rank = ranks.tolist()
    waits = np.zeros(len(came))
    queue: list[tuple[int, int]] = []
    free = -np.inf
    following = 0
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


Sums = tuple[Floats, Floats]  # tops and bottoms, one for each batch

OPERATORS = "operators"  # group of operators, one for each robot on an errand
_ROUNDING = 1e-9  # a wait shorter than this counts as zero [s]


class Batches:
    """A run cut into parts of equal length; an event belongs to the part it was detected in.

    Args:
        sample: The run.
        count: Number of parts.
    """

    def __init__(self, sample: Sample, count: int) -> None:
        self.sample = sample
        self.edges = np.linspace(sample.begins, sample.ends, count + 1)
        self.lengths = np.diff(self.edges)
        index = np.searchsorted(self.edges, sample.detected, side="right") - 1
        last = sample.detected == sample.ends
        self.place = np.where(last, count - 1, index)
        self.inside = (self.place >= 0) & (self.place < count)

    def total(self, values: Floats, which: NDArray[np.bool_]) -> Floats:
        """Sum of a value over some events, in each batch."""
        chosen = which & self.inside
        sums = np.bincount(self.place[chosen], values[chosen], minlength=len(self.lengths))
        return np.asarray(sums, dtype=np.float64)

    def count(self, which: NDArray[np.bool_]) -> Floats:
        """Return the number of selected events in each batch."""
        return self.total(np.ones(len(which)), which)


Events = NDArray[np.bool_]


def sums(name: str, batches: Batches) -> Sums:
    """Return tops and bottoms of a measure."""
    word, stroke, detail = name.partition("/")
    if stroke:
        return _DETAILED[word](batches, detail)
    word, at, stream = name.partition("@")
    sample = batches.sample
    among = np.ones(len(sample.stream), dtype=bool)
    if at:
        among = sample.stream == sample.streams.index(stream)
    if word in _TIMES:
        values, whose = _TIMES[word](sample)
        return batches.total(values, whose & among), batches.count(whose & among)
    if word in _SHARES:
        which, of = _SHARES[word](sample)
        return batches.count(which & of & among), batches.count(of & among)
    return _WHOLE[word](batches)


def check_name(name: str, scenario: TimedScenario) -> None:
    """Refuse the name of a measure that there is not, or not in this scenario.

    Raises:
        ConfigError: the name is unknown.
    """
    word, stroke, detail = name.partition("/")
    if stroke:
        _known(word, list(_DETAILED), "measure")
        _check_detail(word, detail, scenario)
        return
    word, at, stream = name.partition("@")
    if at:
        _known(stream, scenario.stream_names, "stream")
        _known(word, [*_TIMES, *_SHARES], "measure of a stream")
    details = [f"{word}/..." for word in _DETAILED]
    if word not in {*_TIMES, *_SHARES, *_WHOLE}:
        _known(word, [*_TIMES, *_SHARES, *_WHOLE, *details], "measure")


def _check_detail(word: str, detail: str, scenario: TimedScenario) -> None:
    if word == "wait_beyond":
        try:
            float(detail)
        except ValueError:
            raise ConfigError(f"wait_beyond/{detail} should end in a number of seconds") from None
    elif word == "utilisation":
        _known(detail, [OPERATORS, *(group.name for group in scenario.responders)], "group")
    else:
        unit, _, stream = detail.partition("/")
        _known(unit, scenario.names, "responder")
        if word == "share":
            _known(stream, scenario.stream_names, "stream")


def _known(word: str, valid: list[str], what: str) -> None:
    if word not in valid:
        raise ConfigError(unknown(what, word, valid))


# --- of each event ---------------------------------------------------------------------
def _between(first: str, second: str) -> Callable[[Sample], tuple[Floats, Events]]:
    """Return the time from one step to another, of the events served."""

    def values(sample: Sample) -> tuple[Floats, Events]:
        return getattr(sample, second) - getattr(sample, first), sample.served

    return values


def _wait_of_all(sample: Sample) -> tuple[Floats, Events]:
    """Return the wait for a unit, or until none was needed."""
    gone = np.where(np.isnan(sample.assigned), sample.closed, sample.assigned)
    return gone - sample.detected, np.ones(len(gone), dtype=bool)


_TIMES: dict[str, Callable[[Sample], tuple[Floats, Events]]] = {
    "wait_s": _between("detected", "assigned"),
    "travel_s": _between("assigned", "arrived"),
    "response_s": _between("detected", "arrived"),
    "stay_s": _between("detected", "closed"),
    "act_wait_s": _between("confirmed", "act_assigned"),
    "wait_all_s": _wait_of_all,
}


def _delayed(sample: Sample) -> tuple[Events, Events]:
    wait = _wait_of_all(sample)[0]
    turned_away = (sample.outcome == "escalated") & (wait <= _ROUNDING)
    return wait > _ROUNDING, ~turned_away


def _act_delayed(sample: Sample) -> tuple[Events, Events]:
    return sample.act_assigned - sample.confirmed > _ROUNDING, sample.served


def _ended(outcome: str) -> Callable[[Sample], tuple[Events, Events]]:
    def which(sample: Sample) -> tuple[Events, Events]:
        return sample.outcome == outcome, np.ones(len(sample.stream), dtype=bool)

    return which


_SHARES: dict[str, Callable[[Sample], tuple[Events, Events]]] = {
    "delayed": _delayed,
    "act_delayed": _act_delayed,
    "lost": _ended("escalated"),
    "abandoned": _ended("expired"),
}


# --- of the whole ----------------------------------------------------------------------
def _busy(batches: Batches, units: list[int]) -> Sums:
    sample = batches.sample
    which = np.isin(sample.busy_unit, units)
    top = occupied(sample.busy_from[which], sample.busy_until[which], batches.edges)
    return top, batches.lengths * len(units)


def _utilisation(batches: Batches) -> Sums:
    return _busy(batches, list(range(len(batches.sample.units))))


def _open(batches: Batches) -> Sums:
    sample = batches.sample
    return occupied(sample.detected, sample.closed, batches.edges), batches.lengths


def _resting(batches: Batches) -> Sums:
    """Return the number of finite sources without an open event."""
    area, lengths = _open(batches)
    return batches.sample.sources * lengths - area, lengths


def _total(batches: Batches) -> Sums:
    """Return the sum of the path lengths to events that were detected at the same time."""
    sample = batches.sample
    first = np.diff(sample.detected, prepend=-np.inf) > 0
    return batches.total(sample.arrived - sample.assigned, sample.served), batches.count(first)


def _throughput(batches: Batches) -> Sums:
    return batches.count(batches.sample.served), batches.lengths


_WHOLE: dict[str, Callable[[Batches], Sums]] = {
    "utilisation": _utilisation,
    "open": _open,
    "resting": _resting,
    "total_s": _total,
    "throughput": _throughput,
}


# --- with a detail ---------------------------------------------------------------------
def _workload(batches: Batches, unit: str) -> Sums:
    return _busy(batches, [batches.sample.units.index(unit)])


def _group(batches: Batches, group: str) -> Sums:
    sample = batches.sample
    if group == OPERATORS:
        robots = [i for i, kind in enumerate(sample.kinds) if kind == "robot"]
        return _busy(batches, robots)[0], batches.lengths * sample.operators
    return _busy(batches, [i for i, g in enumerate(sample.groups) if g == group])


def _share(batches: Batches, detail: str) -> Sums:
    """Return the share of served events that are of one stream and were served by one unit."""
    sample = batches.sample
    unit, _, stream = detail.partition("/")
    which = sample.unit == sample.units.index(unit)
    which &= sample.stream == sample.streams.index(stream)
    return batches.count(which & sample.served), batches.count(sample.served)


def _wait_beyond(batches: Batches, seconds: str) -> Sums:
    sample = batches.sample
    longer = sample.assigned - sample.detected > float(seconds)
    return batches.count(longer & sample.served), batches.count(sample.served)


_DETAILED: dict[str, Callable[[Batches, str], Sums]] = {
    "workload": _workload,
    "utilisation": _group,
    "share": _share,
    "wait_beyond": _wait_beyond,
}
