"""What becomes of events in time, where one outcome rules out the others.

An event that was escalated will not be confirmed any more. Who takes it for one that "was not
watched long enough" answers another question: how soon it would have been confirmed if nobody
could escalate. So the outcomes compete here, and only the end of watching cuts an event off.

One definition serves all: the share of events that had met a cause by a time. Its value at the
end of the follow-up is a probability, the area above it a restricted mean, and the time at which
it crosses a level a percentile.

References:
    O. O. Aalen and S. Johansen, An empirical transition matrix for non-homogeneous Markov chains
    based on censored observations, Scandinavian Journal of Statistics 5, 1978.
    P. K. Andersen, Decomposition of number of life years lost according to causes of death,
    Statistics in Medicine 32, 2013: the area under a cumulative incidence.

How soon somebody could have been there at all, and how far of the way to that a policy gets.

**The bound of an event** is the response if the best unit for it stood idle at its base, or at a
station, at the moment of the report: no queue, no limit of operators, nothing to wait for; with
the event's own luck. No policy beats it with units that set out from a base or a station.

It is *not* a bound for who is out already: walking back, redirected on the way, or going on from
one event to the next, one may be nearer than any base and needs no time to get ready. Nor where
two reports are one event to the DVA, and somebody is there already. How often that happens is
counted in every run (`beats_bound_share`), so that a reader sees what the bound is worth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.core.dispatch import load_policy
from dva_sim.simulation.shift.demand import Incident
from dva_sim.simulation.shift.recording import TimedRecording
from dva_sim.simulation.shift.responders import Unit
from dva_sim.simulation.shift.simulation import Shift
from dva_sim.simulation.shift.travel import Place
from dva_sim.statistics import Band, band

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

CUT = 0  # the cause of events that were no longer watched


@dataclass(frozen=True)
class Incidence:
    """Share of events that had met each cause by each time: steps, constant between them.

    Attributes:
        times: When something happened, ascending, shape `(k,)` [s].
        shares: Share that had met each cause from then on, shape `(causes, k)`.
        events: How many events it rests on.
    """

    times: Floats
    shares: Floats
    events: int

    def at(self, times: ArrayLike, cause: int = 1) -> Floats:
        """Share that had met a cause (1: the first) by each of some times [s]."""
        place = np.searchsorted(self.times, np.asarray(times, dtype=float), side="right")
        if not self.events:
            return np.full(place.shape, np.nan)
        found: Floats = np.r_[0.0, self.shares[cause - 1]][place]
        return found

    def restricted_mean(self, limit: float, cause: int = 1) -> float:
        """Mean of the smaller of `limit` [s] and the time to a cause; without it, `limit`.

        It is the area above the curve. Where all are watched until the limit it is the plain
        mean of `min(time, limit)`, in which whoever never meets the cause counts `limit`.
        """
        if not self.events:
            return float("nan")
        inside = self.times < limit
        edges = np.r_[0.0, self.times[inside], limit]
        shares = np.r_[0.0, self.shares[cause - 1][inside]]
        return float(limit - (shares * np.diff(edges)).sum())

    def quantile(self, q: float, cause: int = 1) -> float:
        """When a share `q` of all events had met a cause [s]; nan if that never happens."""
        reached = np.flatnonzero(self.shares[cause - 1] >= q - 1e-12)
        return float(self.times[reached[0]]) if len(reached) else float("nan")


def first_of(causes: Sequence[ArrayLike], watched: ArrayLike) -> tuple[Floats, Ints]:
    """What each event met first, and when.

    Args:
        causes: For each cause the time at which each event met it [s]; nan or infinite: never.
            Of two at the same time the earlier in the list counts.
        watched: Until when each event was watched [s].

    Returns:
        Times `(n,)` and causes `(n,)`, from 1; `CUT` where nothing happened while watched.
    """
    until = np.asarray(watched, dtype=float)
    table = np.array([np.broadcast_to(np.asarray(c, dtype=float), until.shape) for c in causes])
    table = np.where(np.isnan(table), np.inf, table)
    first = table.argmin(axis=0)
    time = table.min(axis=0)
    met = time <= until
    return np.where(met, time, until), np.where(met, first + 1, CUT).astype(np.intp)


def incidence(time: ArrayLike, cause: ArrayLike, causes: int) -> Incidence:
    """Aalen and Johansen's estimate of the cumulative incidence of each cause.

    At each time, of those that nothing has happened to so far, the share that meets a cause.
    What happens at the moment at which others are cut off happens before.

    Args:
        time: When each event met its cause, or was cut off, shape `(n,)` [s].
        cause: Which, from 1; `CUT` if it was cut off.
        causes: How many causes there are.
    """
    when, what = np.asarray(time, dtype=float), np.asarray(cause, dtype=np.intp)
    times, place = np.unique(when[what != CUT], return_inverse=True)
    met = np.zeros((causes, len(times)))
    np.add.at(met, (what[what != CUT] - 1, place), 1.0)
    at_risk = len(when) - np.searchsorted(np.sort(when), times, side="left")
    step = met / np.maximum(at_risk, 1)
    left = np.cumprod(1.0 - step.sum(axis=0))  # Kaplan-Meier of all causes together
    before = np.r_[1.0, left[:-1]] if len(times) else left
    return Incidence(times, np.minimum(np.cumsum(before * step, axis=1), 1.0), len(when))


def evenness(amounts: ArrayLike) -> float:
    """Jain's index of fairness: 1 if all have the same, 1 / n if one has everything.

    Nan where there is nothing to share, or nobody.

    References:
        R. Jain, D. Chiu and W. Hawe, A quantitative measure of fairness and discrimination for
        resource allocation in shared computer systems, DEC-TR-301, 1984.
    """
    shares = np.asarray(amounts, dtype=float)
    squares = float((shares**2).sum())
    return float(shares.sum() ** 2 / (len(shares) * squares)) if squares > 0 else float("nan")


def response_bounds(recording: TimedRecording) -> Floats:
    """The bound of each event of a run [s], in the order of its rows, shape `(n,)`."""
    scenario = recording.scenario
    shift = Shift(scenario, recording.seed, load_policy("min_eta"))
    stations = list(shift.stations.values())
    streams, indices = recording.columns["stream"], recording.columns["index"]
    incidents = [
        _incident(shift, int(stream), int(index))
        for stream, index in zip(streams, indices, strict=True)
    ]
    return np.array([_best(shift, incident, stations) for incident in incidents], dtype=float)


def _incident(shift: Shift, stream: int, index: int) -> Incident:
    """An incident again, as far as its way matters."""
    luck, kind = shift.demand.luck[stream], shift.scenario.demand[stream].kind
    place = luck.place(index)
    return Incident(stream, index, 0, kind, place, True, 0.5, 0.5, 0.0)


def _best(shift: Shift, incident: Incident, stations: list[Place]) -> float:
    return min(
        shift.mobilisation(unit, incident) + shift.trip(unit, start, incident.place)
        for unit in shift.units
        for start in _starts(unit, stations)
    )


def _starts(unit: Unit, stations: list[Place]) -> list[Place]:
    """Where a unit may wait: guards at stations, too."""
    return [unit.base, *stations] if unit.kind == "guard" else [unit.base]


def share_of_the_way(floor: Floats, reached: Floats, bound: Floats) -> Band:
    """How far of the way from a floor to a bound some policies get: 0 at the floor, 1 at the bound.

    The share is `mean(floor - reached) / mean(floor - bound)` over shifts, each paired with itself.
    Its interval is that of a ratio of means by linearisation; the band holds for all columns at
    once.

    Args:
        floor: Of the policy that the others must beat, by shift, shape `(shifts,)` or as `reached`.
        reached: Of each policy, shape `(shifts, k)`.
        bound: The best possible, shape as of `floor`.

    References:
        W. G. Cochran, Sampling Techniques, 3rd ed., 1977, section 6.3: the ratio estimator and
        its variance.
    """
    floor, bound = (np.broadcast_to(np.atleast_2d(x.T).T, reached.shape) for x in (floor, bound))
    there = np.isfinite(floor) & np.isfinite(reached) & np.isfinite(bound)
    gained = np.where(there, floor - reached, np.nan)
    whole = np.where(there, floor - bound, np.nan)
    count = np.maximum(there.sum(axis=0), 1)
    mean_gained, mean_whole = (np.nansum(x, axis=0) / count for x in (gained, whole))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(mean_whole > 0, mean_gained / mean_whole, np.nan)
        return band(share + (gained - share * whole) / mean_whole)
