"""Percentiles of response over all events of a cell, where never is infinitely late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.dispatch.outcomes import Floats
from dva_sim.experiments.statistics import LEVEL

RESAMPLES = 1000


def pooled(
    events: Mapping[str, NDArray[Any]], quantiles: Sequence[float], follow: float
) -> tuple[Floats, Floats, Floats]:
    """Percentiles with the interval of drawing shifts anew: value, low, high, each `(q,)` [s].

    Infinite where the percentile is not reached by `follow`: for all of a cohort that is
    followed so long this is what the cumulative incidence of response crosses.

    Args:
        events: Columns `response_s` (nan: never) and `person`.
        quantiles: Shares of all events, each in (0, 1).
        follow: [s]
    """
    response = np.asarray(events["response_s"], dtype=float)
    response = np.where(np.isnan(response) | (response > follow), np.inf, response)
    shifts, owner = np.unique(events["person"], return_inverse=True)
    order = np.argsort(response, kind="stable")
    ranked, owner = response[order], owner[order]
    wanted = np.asarray(quantiles)
    if not len(ranked):
        return (np.full(len(wanted), np.nan),) * 3
    value = _crossed(ranked, np.ones((1, len(ranked))), wanted)[0]
    rng = np.random.Generator(np.random.PCG64(1))
    drawn = rng.multinomial(len(shifts), np.full(len(shifts), 1 / len(shifts)), size=RESAMPLES)
    found = _crossed(ranked, drawn[:, owner].astype(float), wanted)
    edges = [(1 - LEVEL) / 2, (1 + LEVEL) / 2]
    low, high = np.quantile(found, edges, axis=0, method="inverted_cdf")
    return value, low, high


def _crossed(ranked: Floats, weights: Floats, wanted: Floats) -> Floats:
    """The first value by which a share of the weight `(b, n)` is reached, `(b, q)`."""
    upto = np.cumsum(weights, axis=1)
    places = [(upto >= q * upto[:, -1:] - 1e-9).argmax(axis=1) for q in wanted]
    return np.stack([ranked[place] for place in places], axis=1)
