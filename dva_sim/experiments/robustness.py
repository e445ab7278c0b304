"""Whether a conclusion survives other models of the persons: the contrast of every repeat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dva_sim.experiments.answer import Finding
from dva_sim.experiments.asking import REPEATS, STRATEGY, Level
from dva_sim.experiments.effects import Factor, Part, Table, View
from dva_sim.experiments.labels import (
    factor_name,
    level_name,
    listing,
    number,
    percent,
    quantity,
    unit_of,
)
from dva_sim.experiments.reading import interval_of
from dva_sim.experiments.repeats import PARAMETERS


@dataclass(frozen=True)
class Repeat:
    """The contrast under one model of the persons, at one stop.

    Attributes:
        strategy: Of the operators; empty where it was not varied.
        parameters: Which set; 0 is the usual one.
        mean: First minus second.
        low: Lower end of its own 95 % interval.
        high: Upper end.
    """

    strategy: str
    parameters: int
    mean: float
    low: float
    high: float


@dataclass(frozen=True)
class Stop:
    """All repeats at one level of the factor that the answer runs over.

    Attributes:
        level: That level.
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
    def same_sign(self) -> int:
        """In how many repeats the effect has the sign of the study's own."""
        return sum(r.mean * self.found > 0 for r in self.repeats)

    @property
    def clear(self) -> int:
        """In how many of them the whole interval has it."""
        return sum(r.low > 0 if self.found > 0 else r.high < 0 for r in self.repeats)

    @property
    def relevant(self) -> int:
        """In how many the effect has that sign and exceeds the smallest that matters."""
        sign, least = np.sign(self.found), self.smallest or 0.0
        return sum(bool(sign * r.mean > least) for r in self.repeats)

    @property
    def negligible(self) -> int:
        """In how many the effect, either way, is below the smallest that matters."""
        least = self.smallest or 0.0
        return sum(abs(r.mean) <= least for r in self.repeats)


@dataclass(frozen=True)
class Robustness:
    """The answer's contrast under every model it was repeated with.

    Attributes:
        stops: By level of the factor that the answer runs over.
        over: That factor.
        measure: What is compared.
        strategies: Tried; none where the scenario's own was kept.
        sets: How many sets of parameters besides the usual one.
        persons: In each repeat.
        trials: Of each.
    """

    stops: tuple[Stop, ...]
    over: str
    measure: str
    strategies: tuple[str, ...]
    sets: int
    persons: int
    trials: int


def robustness_of(
    study: Mapping[str, Any], table: Table, view: View, finding: Finding
) -> Robustness | None:
    """Read the table of repeats; None where none were declared.

    Args:
        study: As the manifest holds it.
        table: Of the repeats.
        view: How the study is read.
        finding: The study's own result.
    """
    declared = study.get("robustness")
    if not declared or view.over is None or view.line is None or view.contrast is None:
        return None
    strategies = tuple(declared["strategies"])
    at = tuple(declared["at"] or view.stops[-1:])
    factors = [
        *([Factor(STRATEGY, strategies)] if strategies else []),
        Factor(PARAMETERS, tuple(range(int(declared["sets"]) + 1))),
        Factor(view.line.name, view.contrast),
        Factor(view.over.name, at),
    ]
    part = Part(table, REPEATS, factors)
    stops = tuple(_stop(part, view, finding, level) for level in at)
    return Robustness(
        stops=stops,
        over=view.over.name,
        measure=view.measure,
        strategies=strategies,
        sets=int(declared["sets"]),
        persons=len(part.persons),
        trials=len(part.trials),
    )


def _stop(part: Part, view: View, finding: Finding, level: Level) -> Stop:
    assert view.over is not None
    at = view.stops.index(level)
    repeats = [
        repeat
        for model in part.settings(but=(str(finding.factor), view.over.name))
        if (repeat := _repeat(part, finding, model | {view.over.name: level})) is not None
    ]
    return Stop(
        level=level,
        found=float(finding.mean[at]),
        low=float(finding.low[at]),
        high=float(finding.high[at]),
        repeats=tuple(repeats),
        smallest=finding.smallest_effect,
    )


def _repeat(part: Part, finding: Finding, where: dict[str, Level]) -> Repeat | None:
    """The paired difference under one model; the reference run drops out of it."""
    grid = part.grid(finding.measure)
    first, second = (
        part.where(grid, where | {finding.factor: level})
        for level in (finding.first, finding.second)
    )
    found = interval_of(first - second)
    if found is None:
        return None
    return Repeat(
        strategy=str(where.get(STRATEGY, "")),
        parameters=int(str(where[PARAMETERS])),
        mean=found.mean,
        low=found.low,
        high=found.high,
    )


def sentences(robustness: Robustness) -> list[str]:
    """In how many repeats the conclusion holds, and how far effects reach."""
    return [_what_was_repeated(robustness), *(_told(robustness, s) for s in robustness.stops)]


def _what_was_repeated(r: Robustness) -> str:
    strategies = [level_name(STRATEGY, name) for name in r.strategies]
    under = f" under each of {listing(strategies)}," if strategies else ""
    others = "one other set" if r.sets == 1 else f"{r.sets} other sets"
    trials = "one trial" if r.trials == 1 else f"{r.trials} trials"
    return (
        f"Repeated{under} with the usual parameters and {others} within the bands that "
        f"calibration leaves open ({r.persons} persons, {trials} of each; the same "
        "persons and luck as above, so that only the model differs)."
    )


def _told(r: Robustness, stop: Stop) -> str:
    count = len(stop.repeats)
    where = f"At {factor_name(r.over)} {level_name(r.over, stop.level)}"
    if not count:
        return f"{where} no repeat is complete."
    unit, means = unit_of(r.measure), [x.mean for x in stop.repeats]
    told = f"{where} the sign holds in {_of(stop.same_sign, count)} repeats"
    told += f", in {stop.clear} of them with its whole interval"
    if stop.smallest is not None:
        told += f"; in {_of(stop.relevant, count)} the effect exceeds the smallest that matters"
        told += f", in {stop.negligible} it is below that either way"
    reach = f"{number(min(means))} to {quantity(max(means), unit)}"
    return f"{told}. Effects run from {reach}.{_where_it_fails(r, stop)}"


def _where_it_fails(r: Robustness, stop: Stop) -> str:
    """Under which strategies the sign is another."""
    failed = []
    for name in r.strategies:
        means = [x.mean for x in stop.repeats if x.strategy == name]
        others = sum(not mean * stop.found > 0 for mean in means)
        if others:
            failed.append(f"{level_name(STRATEGY, name)} ({others} of {len(means)})")
    return f" The sign is another under {listing(failed)}." if failed else ""


def _of(part: int, whole: int) -> str:
    return f"{part} of {whole} ({percent(part / whole)})"
