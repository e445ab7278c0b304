"""What happened first, by a fixed time: competing risks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.experiments.analysis.statistics.persons import LEVEL, Floats, Interval
from dva_sim.experiments.analysis.statistics.shares import interval_of_share


@dataclass(frozen=True)
class Incidence:
    """How often each cause came first by the horizon; the shares sum to 1.

    Attributes:
        horizon: Until when [the unit of the times].
        causes: Share of each cause, in the order of the causes' names.
        nothing: Share to which nothing has happened by then.
    """

    horizon: float
    causes: dict[str, Interval]
    nothing: Interval


def cumulative_incidence(
    times: ArrayLike,
    causes: Sequence[Any],
    horizon: float,
    person: ArrayLike,
    level: float = LEVEL,
) -> Incidence:
    """Aalen and Johansen's cumulative incidence at a horizon, with intervals over persons.

    A cause that comes first keeps others from being seen; the share of each is what is asked,
    and one minus Kaplan and Meier's estimate, which takes the others for chance, would be
    too large. If every run is followed to the horizon these are the plain shares.

    The intervals are those of shares, on as many runs as give the variance seen when each
    person in turn is left out.

    Args:
        times: When it happened, or until when the run was followed `(n,)`; nan where missing.
        causes: What happened `(n,)`; None or an empty string where nothing did until then.
        horizon: Later does not count.
        person: Whose run it was `(n,)`.
        level: Confidence level.

    References:
        Aalen & Johansen, Scand. J. Stat. 5 (1978) 141-150; Andersen, Klein & Rosthoj,
        Biometrika 90 (2003) 15-27 (leaving out units in turn).
    """
    moments = np.asarray(times, dtype=float)
    there = np.isfinite(moments)
    what = np.array([str(c) if c is not None else "" for c in causes])[there]
    moments, who = moments[there], np.asarray(person)[there]
    what[moments > horizon] = ""
    names = [str(name) for name in np.unique(what) if name]
    persons, owner = np.unique(who, return_inverse=True)
    shares = _aalen_johansen(np.minimum(moments, horizon), what, names, owner)
    intervals = [_interval(share, len(persons), len(owner), level) for share in shares]
    return Incidence(horizon, dict(zip(names, intervals[:-1], strict=True)), intervals[-1])


def _aalen_johansen(
    times: Floats, what: NDArray[Any], names: Sequence[str], owner: NDArray[np.intp]
) -> Floats:
    """Shares of each cause and of none `(causes + 1, 1 + persons)`: of all, and without each."""
    steps, place = np.unique(times, return_inverse=True)
    shape = int(owner.max(initial=-1)) + 1, len(steps)

    def leaving(why: NDArray[np.bool_]) -> Floats:
        """How many leave at each step `(1 + persons, steps)`."""
        at = owner[why] * shape[1] + place[why]
        own = np.bincount(at, minlength=shape[0] * shape[1]).reshape(shape)
        return np.vstack([own.sum(axis=0), own.sum(axis=0) - own]).astype(float)

    gone = leaving(np.ones(len(times), dtype=bool))
    at_risk = np.maximum(np.cumsum(gone[:, ::-1], axis=1)[:, ::-1], 1)
    hazards = [leaving(what == name) / at_risk for name in names]
    alive = np.cumprod(1 - np.sum(hazards, axis=0) * np.ones_like(gone), axis=1)
    alive = np.hstack([np.ones((len(alive), 1)), alive])
    shares = [(hazard * alive[:, :-1]).sum(axis=1) for hazard in hazards]
    return np.array([*shares, alive[:, -1]]).round(12)  # all of them is 1, not a little less


def _interval(share: Floats, persons: int, runs: int, level: float) -> Interval:
    """From the share `[0]` and what it is without each person `[1:]`."""
    if persons < 2:
        estimate = float(share[0]) if persons else math.nan
        return Interval(estimate, math.nan, math.nan, persons)
    left_out = share[1:]
    variance = (persons - 1) / persons * float(((left_out - left_out.mean()) ** 2).sum())
    return interval_of_share(float(share[0]), variance, persons, runs, level)
