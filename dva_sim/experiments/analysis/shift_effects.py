"""The runs of a study of dispatch, laid out as shift by policy by load.

Percentiles of response over all events of a cell, where never is infinitely late.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import RunGrid, Table, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.simulation.labels import setting
from dva_sim.simulation.measures.shifts import FOLLOW_S
from dva_sim.simulation.timed.bounds import Floats, share_of_the_way
from dva_sim.statistics import LEVEL, Band, band

POLICY = "dispatch.policy"
INTENSITY = "intensity"
FLOOR = "random"
BEST = "oracle"
CALIBRATED = "nearest_idle"


def is_dispatch(view: StudyView | None) -> bool:
    """Return True if a study compares policies on timed shifts, one series each."""
    if view is None or view.series_factor is None or view.series_factor.name != POLICY:
        return False
    return view.part.has("response_mean_s") and view.part.has("bound_mean_s")


class Shifts:
    """The part that the answer speaks of; a shift is what is called a person elsewhere.

    Args:
        view: Its series are policies, its stops arrival rates.
        events: Columns of the table `events`, if there is one.

    Attributes:
        events: The events in the grid of the runs; None where there is no such table.
    """

    def __init__(self, view: StudyView, events: Table | None = None) -> None:
        self.view = view
        self.policies = tuple(str(level) for level in view.series)
        self.stops = range(len(view.stops))
        self.events = RunGrid(events, view.part.name, view.part.factors) if events else None

    @property
    def baseline(self) -> str:
        """Policy that others are compared with: the contrast's second, else the first of all."""
        return str(self.view.contrast[1]) if self.view.contrast else self.policies[0]

    @property
    def follow(self) -> float:
        """For how long each event was followed [s]."""
        times = self.of("follow_s")
        return float(np.nanmax(times)) if np.isfinite(times).any() else FOLLOW_S

    def of(self, column: str) -> Floats:
        """Return values of a measure by run, `(shifts, policies, stops)`; nan for missing runs."""
        grid = self.view.part.grid(column)
        panel = self.view.panels[0]
        curves = [person_means(self.view.curve(grid, panel, p)) for p in self.view.series]
        return np.stack(curves, axis=1)

    def means(self, column: str) -> Floats:
        """Mean over shifts, `(policies, stops)`."""
        return nan_mean(self.of(column), axis=0)

    def against(self, column: str, baseline: str) -> Band:
        """Return each policy minus the baseline, paired by shift; entries `(policies * stops,)`.

        The band holds for all policies and loads at once.
        """
        values = self.of(column)
        base = values[:, [self.policies.index(baseline)], :]
        return band((values - base).reshape(len(values), -1))

    @property
    def calibrated(self) -> str:
        """Policy under which loads are measured."""
        return CALIBRATED if CALIBRATED in self.policies else self.policies[0]

    @property
    def loads(self) -> list[float | None]:
        """Load of each stop: use of the busiest people under the policy it was set with.

        None where something else was varied, and with the few alarms that an oracle can plan
        for: they come and are over, so that there is no steady load.
        """
        over = self.view.over
        if over is None or over.name != INTENSITY or BEST in self.policies:
            return [None for _ in self.stops]
        loads = self.means("load")[self.policies.index(self.calibrated)]
        return [float(load) if np.isfinite(load) else None for load in loads]

    @property
    def titles(self) -> list[str]:
        """Titles of the stops: the load where it was varied, else the setting."""
        over = self.view.over
        loads = self.loads
        return [
            f"load {load:.2f}" if load is not None else setting({over.name: stop} if over else {})
            for load, stop in zip(loads, self.view.stops, strict=True)
        ]

    @property
    def can_spare(self) -> bool:
        """True if people are exposed to danger and robots are available instead."""
        has = self.view.part.has
        return has("use_of_robots") and bool(np.nanmax(self.means("exposure_s"), initial=0.0) > 0)

    # --- how near to the best possible --------------------------------------------------

    @property
    def target(self) -> str | None:
        """Policy that bounds the achievable: the oracle if it took part, else `bound`."""
        if FLOOR not in self.policies:
            return None
        return BEST if BEST in self.policies else "bound"

    @property
    def travellers(self) -> tuple[str, ...]:
        """Policies on their way from the floor to the target."""
        return tuple(p for p in self.policies if p not in (FLOOR, BEST))

    def progress(self, stop: int) -> Band:
        """Share of the way from the floor to the target, for each of `travellers` at once."""
        response = self.of("response_mean_s")[:, :, stop]
        floor = response[:, self.policies.index(FLOOR)]
        if self.target == BEST:
            best = response[:, self.policies.index(BEST)]
        else:
            best = self.of("bound_mean_s")[:, self.policies.index(FLOOR), stop]
        columns = [self.policies.index(p) for p in self.travellers]
        return share_of_the_way(floor, response[:, columns], best)


RESAMPLES = 1000


def pooled(
    events: Mapping[str, NDArray[Any]], quantiles: Sequence[float], follow: float
) -> tuple[Floats, Floats, Floats]:
    """Return percentiles with their bootstrap interval over shifts.

    Value, low, high, each `(q,)` [s].

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
    ranked = response[order]
    owner = owner[order]
    levels = np.asarray(quantiles)
    if not len(ranked):
        return (np.full(len(levels), np.nan),) * 3
    value = _crossed(ranked, np.ones((1, len(ranked))), levels)[0]
    rng = np.random.Generator(np.random.PCG64(1))
    drawn = rng.multinomial(len(shifts), np.full(len(shifts), 1 / len(shifts)), size=RESAMPLES)
    crossings = _crossed(ranked, drawn[:, owner].astype(float), levels)
    edges = [(1 - LEVEL) / 2, (1 + LEVEL) / 2]
    low, high = np.quantile(crossings, edges, axis=0, method="inverted_cdf")
    return value, low, high


def _crossed(ranked: Floats, weights: Floats, levels: Floats) -> Floats:
    """Return the first value by which a share of the weight `(b, n)` is reached, `(b, q)`."""
    upto = np.cumsum(weights, axis=1)
    places = [(upto >= q * upto[:, -1:] - 1e-9).argmax(axis=1) for q in levels]
    return np.stack([ranked[index] for index in places], axis=1)
