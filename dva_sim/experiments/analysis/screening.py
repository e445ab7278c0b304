"""Screening: the assumed numbers that move an answer, from the runs of every point."""

from __future__ import annotations

import csv
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.parts import POINT
from dva_sim.experiments.study.screening import rule_of, screened, walks_of
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.assumed import Assumption
from dva_sim.statistics.morris import ElementaryEffects, elementary_effects

MAX_MOVING = 5  # that figures and texts show
TABLE = "screening.csv"


@dataclass(frozen=True)
class Screening:
    """Result of a screening.

    Attributes:
        numbers: Each assumed number with its effects on the answer over its whole band, in the
            measure's unit; the one that moves it most first.
        usual: The answer over all points, mean of the persons' differences.
        points: Number of points run.
        persons: Simulated persons at each.
    """

    numbers: tuple[tuple[Assumption, ElementaryEffects], ...]
    usual: float
    points: int
    persons: int

    @property
    def most_moving(self) -> tuple[tuple[Assumption, ElementaryEffects], ...]:
        """The few that move the answer most; none that does not move it at all."""
        return tuple(each for each in self.numbers[:MAX_MOVING] if each[1].size > 0.0)

    def write(self, path: Path) -> Path:
        """Write all numbers as a table; the same bytes for the same numbers."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            names = "key,default,low,high,unit,size,mean,mean_low,mean_high,spread"
            table.writerow(names.split(","))
            for each, effect in self.numbers:
                about = each.key, each.default, each.low, each.high, each.unit
                ends = effect.mean.mean, effect.mean.low, effect.mean.high
                effects = [f"{value:.6g}" for value in (effect.size, *ends, effect.spread)]
                table.writerow([*about, *effects])
        return path


def judged(study: Study, results: Results) -> Screening:
    """Return the effects of all assumed numbers, from the runs of every point."""
    _, answer = rule_of(study)
    walks = walks_of(study)
    numbers = screened(study)
    count = walks.shape[0]
    points = walks.shape[0] * walks.shape[1]
    factors = [Factor(POINT, tuple(range(points))), Factor(answer.factor, answer.contrast)]
    part = RunGrid(results.table("runs"), answer.part, factors)
    values = part.grid(answer.measure)  # (points, contrast, persons, trials)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a person without a value is left out
        outcome = np.nanmean(values[:, 0] - values[:, 1], axis=(1, 2)).reshape(count, -1)
    effects = zip(numbers, elementary_effects(walks, outcome), strict=True)
    ranked = sorted(effects, key=lambda each: (-np.nan_to_num(each[1].size), each[0].key))
    return Screening(tuple(ranked), float(np.nanmean(outcome)), points, len(part.persons))
