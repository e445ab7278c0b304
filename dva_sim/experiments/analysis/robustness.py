"""Robustness of a conclusion to other models of persons and other delays.

The contrast of every repeat under other models of the persons; and which cells lie beyond the
delays at which people were watched: extrapolations, marked so. What counts there is the delay of
the loop as measured in the cell without the person's own share, not the delay of the link: that is
what published experiments report. Marked are cells and repeats whose runs tell that delay
(`loop_delay_mean_s`), which is those of scenarios with robots. Tasks do not tell it, so that
nothing of theirs is marked, however long their links are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.operator.published import ranges, read_supports
from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.run_grid import Factor, Floats, RunGrid, Table, nan_mean
from dva_sim.experiments.analysis.study_view import StudyView, interval_of
from dva_sim.experiments.study.factor_levels import PARAMETERS
from dva_sim.experiments.study.parts import REPEATS, STRATEGY, Level
from dva_sim.kernel.units import unit_of
from dva_sim.statistics import Interval

LOOP = "loop_delay_mean_s"


PERSONAL = ("delay_human_s", "delay_hand_s")
LEGS = ("picture_age_mean_s", "age_in_force_mean_s")  # of a loop that is not measured as a whole
WAITING = "move_and_wait_share"
RARE_SHARE = 0.05  # a way of steering that takes less of the driving time does not count


Marks = NDArray[np.bool_]


@dataclass(frozen=True)
class Support:
    """Delays of a part's cells, and those that no published data cover.

    Attributes:
        delays: Delay of the loop without the person, by cell `(levels of factor 1, ...)` [s]; nan
            where nobody drives.
        outside: True for delays that are not covered.
        words: Description of the range covered, for each strategy.
    """

    delays: Floats
    outside: Marks
    words: str


def support_of_part(part: RunGrid, scenario: Mapping[str, Any]) -> Support | None:
    """Return the coverage of a part by published data; None if no control loop has a delay.

    Args:
        part: The runs.
        scenario: The part's before any factor changed it, for the strategy.
    """
    names = part.levels.get(STRATEGY, (get(scenario, STRATEGY),))
    strategies = tuple(str(name) for name in names if name is not None)
    runs = _loop_delays(part)
    if runs is None or not strategies:
        return None
    of_cells = runs.reshape(*runs.shape[:-2], -1)
    delays = np.where(np.isinf(of_cells).any(axis=-1), math.inf, nan_mean(of_cells, axis=-1))
    strategy = str(get(scenario, STRATEGY))
    waits = _waiting(part, strategy, delays)
    outside = ~np.isnan(delays)
    for name in strategies:
        covered = np.full(delays.shape, bool(ranges(name)))
        for steering, share in (("closed", 1.0 - waits), ("waiting", waits)):
            covered &= (share <= RARE_SHARE) | _watched(delays, ranges(name, steering))
        outside &= ~(_has(part, name, strategy) & covered)
    return Support(delays, outside, "; ".join(map(_coverage, strategies)))


def _loop_delays(part: RunGrid) -> Floats | None:
    """Return the delay of each run's loop without the person [s].

    None where no part of it is measured.

    Nan where nobody drives; infinite where no command or no picture arrives.
    """
    if part.has(LOOP):
        return part.grid(LOOP) - sum(np.nan_to_num(part.grid(column)) for column in PERSONAL)
    if all(map(part.has, LEGS)):
        legs = sum((part.grid(leg) for leg in LEGS), start=np.zeros(1))
        return np.where(np.isnan(legs), math.inf, legs)
    return None


def _waiting(part: RunGrid, default: str, delays: Floats) -> Floats:
    """Return the share of the driving time that each cell's persons moved and waited.

    Where it is not measured, only persons of the strategy `move_and_wait` count as waiting. That
    marks too many cells rather than too few.
    """
    if part.has(WAITING):
        shares = part.grid(WAITING)
        return np.nan_to_num(nan_mean(shares.reshape(*shares.shape[:-2], -1), axis=-1))
    return np.where(_has(part, "move_and_wait", default), 1.0, np.zeros(delays.shape))


def _watched(delays: Floats, bands: Sequence[tuple[float, float]]) -> Marks:
    """Mark the delays that lie within any of the ranges."""
    watched = np.zeros(delays.shape, dtype=bool)
    for low, high in bands:
        watched |= (delays >= low) & (delays <= high)
    return watched


def _has(part: RunGrid, strategy: str, default: str) -> Marks:
    """Mark the cells driven by a strategy; `default` is that of cells that set none."""
    has = [setting.get(STRATEGY, default) == strategy for setting in part.settings()]
    return np.array(has).reshape([len(f.levels) for f in part.factors])


def _coverage(strategy: str) -> str:
    lines = [
        f"{support.low_s:g} to {support.high_s:g} s, {' '.join(support.why.split())}"
        for support in read_supports(strategy)
    ]
    return f"{strategy}: {', and '.join(lines) or 'no published data'}"


@dataclass(frozen=True)
class Repeat:
    """The contrast under one model of the persons, at one stop.

    Attributes:
        strategy: Strategy of the operators; empty if it was not varied.
        parameters: Number of the parameter set; 0 is the usual one.
        mean: First minus second: the study's own result, and what this model changes of it. Where
            the study's own model was not repeated, the difference in the repeat itself.
        low: Lower end of its 95 % interval: of that result and of the change, in quadrature.
        high: Upper end.
        is_own: True for the study's own model, which is no independent evidence.
        is_beyond: True if people were never watched with that strategy at these delays.
    """

    strategy: str
    parameters: int
    mean: float
    low: float
    high: float
    is_own: bool = False
    is_beyond: bool = False


@dataclass(frozen=True)
class RepeatedStop:
    """All repeats at one level of the factor that the answer runs over.

    Attributes:
        found: The study's own result there.
        low: Lower edge of its band.
        high: Upper edge.
        repeats: With a result; those without are left out.
        smallest: Smallest effect that matters.
    """

    level: Level
    found: float
    low: float
    high: float
    repeats: tuple[Repeat, ...]
    smallest: float | None

    @property
    def others(self) -> list[Repeat]:
        """Those that count: under another model than the study's own."""
        return [r for r in self.repeats if not r.is_own]

    @property
    def same_sign(self) -> int:
        """Number of other repeats in which the effect has the sign of the study's own."""
        return sum(r.mean * self.found > 0 for r in self.others)

    @property
    def clear(self) -> int:
        """In how many of them the whole interval has it."""
        return sum(r.low > 0 if self.found > 0 else r.high < 0 for r in self.others)

    @property
    def relevant(self) -> int:
        """In how many the effect has that sign and exceeds the smallest that matters."""
        sign = np.sign(self.found)
        least = self.smallest or 0.0
        return sum(bool(sign * r.mean > least) for r in self.others)

    @property
    def negligible(self) -> int:
        """In how many the effect, either way, is below the smallest that matters."""
        least = self.smallest or 0.0
        return sum(abs(r.mean) <= least for r in self.others)


@dataclass(frozen=True)
class RepeatedAnswer:
    """The answer's contrast under every model it was repeated with.

    Attributes:
        stops: By level of the factor that the answer runs over.
        over: Factor along which the repeats run.
        strategies: Tried; none where the scenario's own was kept.
        sets: Number of parameter sets besides the usual one.
        persons: In each repeat.
        trials: Trials per person.
    """

    stops: tuple[RepeatedStop, ...]
    over: str
    measure: str
    strategies: tuple[str, ...]
    sets: int
    persons: int
    trials: int

    @property
    def unit(self) -> str:
        """Unit of what is compared."""
        return unit_of(self.measure)


def robustness_of(
    study: Mapping[str, Any],
    table: Table,
    view: StudyView,
    finding: Finding,
    scenario: Mapping[str, Any],
) -> RepeatedAnswer | None:
    """Read the table of repeats; None where none were declared.

    Args:
        study: Study as the manifest holds it.
        table: Table of the repeats.
        finding: The study's own result.
        scenario: Scenario of the answer's part before any factor changed it, for the study's own
            strategy.
    """
    declared = study.get("robustness")
    if not declared or view.over is None or view.series_factor is None or view.contrast is None:
        return None
    strategies = tuple(declared["strategies"])
    at = tuple(declared["at"] or view.stops[-1:])
    factors = [
        *([Factor(STRATEGY, strategies)] if strategies else []),
        Factor(PARAMETERS, tuple(range(int(declared["sets"]) + 1))),
        Factor(view.series_factor.name, view.contrast),
        Factor(view.over.name, at),
    ]
    part = RunGrid(table, REPEATS, factors)
    read = _Reading(part, finding, scenario)
    stops = tuple(_stop(read, view, level) for level in at)
    return RepeatedAnswer(
        stops=stops,
        over=view.over.name,
        measure=view.measure,
        strategies=strategies,
        sets=int(declared["sets"]),
        persons=len(part.persons),
        trials=len(part.trials),
    )


class _Reading:
    """Repeats of a study, with the properties of each besides its effect."""

    def __init__(self, part: RunGrid, finding: Finding, scenario: Mapping[str, Any]) -> None:
        self.part = part
        self.finding = finding
        self._own = get(scenario, STRATEGY)
        support = support_of_part(part, scenario)
        self._outside = None if support is None else support.outside.astype(float)

    def own(self, where: dict[str, Level]) -> Floats | None:
        """Return the difference under the study's own model; None if that was not repeated."""
        tried = self.part.levels.get(STRATEGY, (self._own,))
        if self._own not in tried:
            return None
        strategy = {STRATEGY: self._own} if STRATEGY in where else {}
        return self.difference(where | strategy | {PARAMETERS: 0})

    def difference(self, where: dict[str, Level]) -> Floats:
        """Return the first minus second under a model, `(persons, trials)`."""
        grid = self.part.grid(self.finding.measure)
        first, second = (
            self.part.where(grid, where | {self.finding.factor: level})
            for level in (self.finding.first, self.finding.second)
        )
        return first - second

    def is_own(self, where: dict[str, Level]) -> bool:
        """Return True if these are the strategy and parameters of the study itself."""
        return where[PARAMETERS] == 0 and where.get(STRATEGY, self._own) == self._own

    def is_beyond(self, where: dict[str, Level]) -> bool:
        """Return True if either side of the contrast is an extrapolation."""
        if self._outside is None:
            return False
        sides = (self.finding.first, self.finding.second)
        return any(
            self.part.where(self._outside, where | {self.finding.factor: side}) > 0
            for side in sides
        )


def _stop(read: _Reading, view: StudyView, level: Level) -> RepeatedStop:
    assert view.over is not None
    finding = read.finding
    at = view.stops.index(level)
    repeats = [
        repeat
        for model in read.part.settings(but=(str(finding.factor), view.over.name))
        if (repeat := _repeat(read, model | {view.over.name: level}, at)) is not None
    ]
    return RepeatedStop(
        level=level,
        found=float(finding.mean[at]),
        low=float(finding.low[at]),
        high=float(finding.high[at]),
        repeats=tuple(repeats),
        smallest=finding.smallest_effect,
    )


def _repeat(read: _Reading, where: dict[str, Level], at: int) -> Repeat | None:
    """Return the paired difference under one model; the reference run drops out of it."""
    mean = read.own(where)
    difference = read.difference(where)
    interval = (
        interval_of(difference) if mean is None else _beside(read.finding, at, difference - mean)
    )
    if interval is None:
        return None
    return Repeat(
        strategy=str(where.get(STRATEGY, "")),
        parameters=int(str(where[PARAMETERS])),
        mean=interval.mean,
        low=interval.low,
        high=interval.high,
        is_own=read.is_own(where),
        is_beyond=read.is_beyond(where),
    )


def _beside(finding: Finding, at: int, change: Floats) -> Interval | None:
    """Return the study's own result and a model's change of it, `(persons, trials)`."""
    changed = interval_of(change)
    if changed is None or not np.isfinite(changed.low):
        return None
    mean, low, high = (float(edge[at]) for edge in (finding.mean, finding.low, finding.high))
    return replace(
        changed,
        mean=mean + changed.mean,
        low=mean + changed.mean - math.hypot(mean - low, changed.mean - changed.low),
        high=mean + changed.mean + math.hypot(high - mean, changed.high - changed.mean),
    )
