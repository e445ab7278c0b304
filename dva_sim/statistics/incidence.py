"""Competing risks: cumulative incidence of each cause over time and by a fixed time.

An escalated event will never be confirmed. Treating it as censored would answer another question:
how soon it would have been confirmed if escalation were impossible. So outcomes are competing
causes here, and only the end of the follow-up censors an event.

All measures derive from the cumulative incidence, the share of events that a cause has ended by
a time: a probability is its value at the end of the follow-up, a restricted mean the area above
it, and a percentile the time at which it crosses a level.

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

CUT = 0  # cause number of censored events, whose follow-up has ended


@dataclass(frozen=True)
class Incidence:
    """Share of events ended by each cause over time: a step function.

    Attributes:
        times: Times of changes, ascending, shape `(k,)` [s].
        shares: Share ended by each cause from that time on, shape `(causes, k)`.
        events: Number of events.
    """

    times: Floats
    shares: Floats
    events: int

    def at(self, times: ArrayLike, cause: int = 1) -> Floats:
        """Return the share of events ended by a cause (1: the first) by each time [s]."""
        index = np.searchsorted(self.times, np.asarray(times, dtype=float), side="right")
        if not self.events:
            return np.full(index.shape, np.nan)
        share: Floats = np.r_[0.0, self.shares[cause - 1]][index]
        return share

    def restricted_mean(self, limit: float, cause: int = 1) -> float:
        """Return the mean time to a cause, restricted to `limit` [s].

        It is the area above the curve. If all events are followed to the limit, it equals the
        mean of `min(time, limit)`, in which an event that the cause never ends counts `limit`.
        """
        if not self.events:
            return float("nan")
        inside = self.times < limit
        edges = np.r_[0.0, self.times[inside], limit]
        shares = np.r_[0.0, self.shares[cause - 1][inside]]
        return float(limit - (shares * np.diff(edges)).sum())

    def quantile(self, q: float, cause: int = 1) -> float:
        """Return the time at which a cause has ended a share `q` of events [s]; nan if never."""
        reached = np.flatnonzero(self.shares[cause - 1] >= q - 1e-12)
        return float(self.times[reached[0]]) if len(reached) else float("nan")


def first_of(causes: Sequence[ArrayLike], watched: ArrayLike) -> tuple[Floats, Ints]:
    """Return the time and the cause of each event's end.

    Args:
        causes: For each cause, its time for each event [s]; nan or infinite: never. Of two causes
            at the same time, the first in the list counts.
        watched: End of the follow-up of each event [s].

    Returns:
        Times `(n,)` and causes `(n,)`, from 1; `CUT` where none occurred during the follow-up.
    """
    until = np.asarray(watched, dtype=float)
    table = np.array([np.broadcast_to(np.asarray(c, dtype=float), until.shape) for c in causes])
    table = np.where(np.isnan(table), np.inf, table)
    first = table.argmin(axis=0)
    time = table.min(axis=0)
    has_ended = time <= until
    return np.where(has_ended, time, until), np.where(has_ended, first + 1, CUT).astype(np.intp)


def incidence(time: ArrayLike, cause: ArrayLike, causes: int) -> Incidence:
    """Return Aalen and Johansen's estimate of the cumulative incidence of each cause.

    Each cause adds, at each time, its share of the events that are still at risk. Events that end
    at the same time as others are censored count as having ended before.

    Args:
        time: Time at which each event ended or was censored, shape `(n,)` [s].
        cause: Number of the cause, from 1; `CUT` if censored, shape `(n,)`.
        causes: Number of causes.
    """
    when = np.asarray(time, dtype=float)
    what = np.asarray(cause, dtype=np.intp)
    times, index = np.unique(when[what != CUT], return_inverse=True)
    endings = np.zeros((causes, len(times)))
    np.add.at(endings, (what[what != CUT] - 1, index), 1.0)
    at_risk = len(when) - np.searchsorted(np.sort(when), times, side="left")
    step = endings / np.maximum(at_risk, 1)
    left = np.cumprod(1.0 - step.sum(axis=0))  # Kaplan-Meier of all causes together
    before = np.r_[1.0, left[:-1]] if len(times) else left
    return Incidence(times, np.minimum(np.cumsum(before * step, axis=1), 1.0), len(when))


@dataclass(frozen=True)
class IncidenceAtHorizon:
    """Shares of the outcomes by a horizon, which sum to 1.

    Attributes:
        causes: Share of each cause, in the order of the causes' names.
        nothing: Share of events without an outcome by then.
    """

    causes: dict[str, Interval]
    nothing: Interval


def cumulative_incidence(
    times: ArrayLike, causes: Sequence[Any], horizon: float, person: ArrayLike
) -> IncidenceAtHorizon:
    """Return Aalen and Johansen's cumulative incidence at a horizon, with intervals.

    The first cause prevents all others. One minus Kaplan and Meier's estimate would be too large,
    as it treats the other causes as censoring. If every run is followed to the horizon, the result
    is the plain share of each cause.

    The intervals are those of shares with the effective number of runs that corresponds to the
    jackknife variance over persons.

    Args:
        times: Time of the outcome, or end of the follow-up `(n,)`; nan where missing.
        causes: Outcome `(n,)`; None or an empty string if there was none until then.
        horizon: Time after which outcomes do not count [s].
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
    """Return the shares of all causes by the horizon and of no cause, with a sum of exactly 1."""
    curve = incidence(times, causes, count)
    shares = [float(curve.at(horizon, cause).round(12)) for cause in range(1, count + 1)]
    return [*shares, round(1.0 - sum(shares), 12)]


def _interval(share: Floats, persons: int, runs: int) -> Interval:
    """Return the interval of the share `[0]`, from the shares without each person `[1:]`."""
    if persons < 2:
        estimate = float(share[0]) if persons else math.nan
        return Interval(estimate, math.nan, math.nan, persons)
    left_out = share[1:]
    variance = (persons - 1) / persons * float(((left_out - left_out.mean()) ** 2).sum())
    return interval_of_share(float(share[0]), variance, persons, runs)
