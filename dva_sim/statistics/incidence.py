"""Competing risks: cumulative incidence of each cause over time and by a fixed time.

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
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.persons import Floats, Interval
from dva_sim.statistics.proportions import interval_of_share

Ints = NDArray[np.intp]

CUT = 0  # the cause of events that were no longer watched


@dataclass(frozen=True)
class Incidence:
    """Share of events that had met each cause by each time: steps, constant between them.

    Attributes:
        times: Times of changes, ascending, shape `(k,)` [s].
        shares: Share that had met each cause from then on, shape `(causes, k)`.
        events: Number of events.
    """

    times: Floats
    shares: Floats
    events: int

    def at(self, times: ArrayLike, cause: int = 1) -> Floats:
        """Return the share that had met a cause (1: the first) by each of some times [s]."""
        index = np.searchsorted(self.times, np.asarray(times, dtype=float), side="right")
        if not self.events:
            return np.full(index.shape, np.nan)
        share: Floats = np.r_[0.0, self.shares[cause - 1]][index]
        return share

    def restricted_mean(self, limit: float, cause: int = 1) -> float:
        """Return the mean of the smaller of `limit` [s] and the time to a cause.

        Without it, `limit`.

        It is the area above the curve. Where all are watched until the limit it is the plain
        mean of `min(time, limit)`, in which an event that never meets the cause counts `limit`.
        """
        if not self.events:
            return float("nan")
        inside = self.times < limit
        edges = np.r_[0.0, self.times[inside], limit]
        shares = np.r_[0.0, self.shares[cause - 1][inside]]
        return float(limit - (shares * np.diff(edges)).sum())

    def quantile(self, q: float, cause: int = 1) -> float:
        """Return when a share `q` of all events had met a cause [s]; nan if that never happens."""
        reached = np.flatnonzero(self.shares[cause - 1] >= q - 1e-12)
        return float(self.times[reached[0]]) if len(reached) else float("nan")


def first_of(causes: Sequence[ArrayLike], watched: ArrayLike) -> tuple[Floats, Ints]:
    """Return the first cause that each event met, and when.

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
    """Return the Aalen and Johansen's estimate of the cumulative incidence of each cause.

    At each time, of those that nothing has happened to so far, the share that meets a cause.
    What happens at the moment at which others are cut off happens before.

    Args:
        time: Time at which each event met its cause or was cut off, shape `(n,)` [s].
        cause: Number of the cause, from 1; `CUT` if it was cut off.
        causes: Number of causes.
    """
    when = np.asarray(time, dtype=float)
    what = np.asarray(cause, dtype=np.intp)
    times, index = np.unique(when[what != CUT], return_inverse=True)
    met = np.zeros((causes, len(times)))
    np.add.at(met, (what[what != CUT] - 1, index), 1.0)
    at_risk = len(when) - np.searchsorted(np.sort(when), times, side="left")
    step = met / np.maximum(at_risk, 1)
    left = np.cumprod(1.0 - step.sum(axis=0))  # Kaplan-Meier of all causes together
    before = np.r_[1.0, left[:-1]] if len(times) else left
    return Incidence(times, np.minimum(np.cumsum(before * step, axis=1), 1.0), len(when))


@dataclass(frozen=True)
class IncidenceAtHorizon:
    """Share of each cause that came first by a horizon; the shares sum to 1.

    Attributes:
        causes: Share of each cause, in the order of the causes' names.
        nothing: Share to which nothing has happened by then.
    """

    causes: dict[str, Interval]
    nothing: Interval


def cumulative_incidence(
    times: ArrayLike, causes: Sequence[Any], horizon: float, person: ArrayLike
) -> IncidenceAtHorizon:
    """Return Aalen and Johansen's cumulative incidence at a horizon, with intervals.

    A cause that comes first keeps others from being seen; the share of each is what is asked,
    and one minus Kaplan and Meier's estimate, which takes the others for chance, would be
    too large. If every run is followed to the horizon these are the plain shares.

    The intervals are those of shares, on as many runs as give the variance seen when each
    person in turn is left out.

    Args:
        times: Time of the outcome, or end of the follow-up `(n,)`; nan where missing.
        causes: Outcome `(n,)`; None or an empty string for none until then.
        horizon: Later does not count.
        person: Person of each run `(n,)`.

    References:
        Aalen & Johansen, Scand. J. Stat. 5 (1978) 141-150; Andersen, Klein & Rosthoj,
        Biometrika 90 (2003) 15-27 (leaving out units in turn).
    """
    moments = np.asarray(times, dtype=float)
    is_finite = np.isfinite(moments)
    what = np.array([str(c) if c is not None else "" for c in causes])[is_finite]
    moments = moments[is_finite]
    person_of_row = np.asarray(person)[is_finite]
    what[moments > horizon] = ""
    names = [str(name) for name in np.unique(what) if name]
    persons, owner = np.unique(person_of_row, return_inverse=True)
    codes = {name: number for number, name in enumerate(names, 1)}
    causes_met = np.array([codes.get(name, CUT) for name in what], dtype=np.intp)
    left_out = [owner != excluded for excluded in range(len(persons))]
    shares = np.transpose(
        [
            _shares(moments[chosen], causes_met[chosen], len(names), horizon)
            for chosen in (np.ones(len(owner), dtype=bool), *left_out)
        ]
    )
    intervals = [_interval(share, len(persons), len(owner)) for share in shares]
    return IncidenceAtHorizon(dict(zip(names, intervals[:-1], strict=True)), intervals[-1])


def _shares(times: Floats, causes: Ints, count: int, horizon: float) -> list[float]:
    """Return the share of each cause by the horizon, and of none: together exactly 1."""
    curve = incidence(times, causes, count)
    met = [float(curve.at(horizon, cause).round(12)) for cause in range(1, count + 1)]
    return [*met, round(1.0 - sum(met), 12)]


def _interval(share: Floats, persons: int, runs: int) -> Interval:
    """Return the interval of the share `[0]` by the shares without each person `[1:]`."""
    if persons < 2:
        estimate = float(share[0]) if persons else math.nan
        return Interval(estimate, math.nan, math.nan, persons)
    left_out = share[1:]
    variance = (persons - 1) / persons * float(((left_out - left_out.mean()) ** 2).sum())
    return interval_of_share(float(share[0]), variance, persons, runs)
