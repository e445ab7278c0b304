"""Stopping rules: pure deciders on whole batches of persons, in the order of the design.

The order of finishing plays no part, so the same study stops after the same batch on every machine.
"""

from __future__ import annotations

import math

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Floats, RunGrid, Table
from dva_sim.experiments.analysis.study_view import adjusted_means, product_of
from dva_sim.experiments.study.factor_levels import factors_in_rows
from dva_sim.experiments.study.parts import Contrast, StopRule
from dva_sim.experiments.study.study import Study
from dva_sim.statistics import band, mean_interval


def widest(study: Study, stop: StopRule, runs: Table) -> float:
    """Return the half of the widest interval that the rule looks at.

    Infinite where there is none yet.

    Args:
        runs: The table of runs so far.
    """
    widths = half_widths(study, stop, runs)
    return float(widths.max()) if len(widths) and np.isfinite(widths).all() else math.inf


def half_widths(study: Study, stop: StopRule, runs: Table) -> Floats:
    """Return the half of each interval that the rule looks at; nan where there is none yet."""
    if not runs:
        return np.array([])
    if stop.comparison is None:
        cells = Factor("cell", tuple(np.unique(runs["cell"]).tolist()))
        part = RunGrid(runs, str(stop.part), [cells])
        values = part.outcome(str(stop.measure))[part.ran]
        return np.array([mean_interval(cell.ravel(), part.person).half_width for cell in values])
    return _of_contrast(study, study.contrasts[stop.comparison], runs, stop.level(study.persons))


def _of_contrast(study: Study, contrast: Contrast, runs: Table, level: float) -> Floats:
    """Return half-widths of the paired difference at each level of `over`; references cancel.

    The answer's is adjusted for the covariates. Factors that it does not name are at their first
    level, but for those of rows, which are averaged.
    """
    sides_at = {contrast.factor, contrast.over}
    together = (study.design.zip or ())[1:] if study.design is not None else ()
    alike = {*together} - {*sides_at, *contrast.within}  # as the first that is taken with them
    factors = [Factor(*each) for each in study.factors.items() if each[0] not in alike]
    part = RunGrid(runs, contrast.part, factors)
    free = sides_at | factors_in_rows(study)
    fixed = {f: levels[0] for f, levels in part.levels.items() if f not in free}
    fixed |= contrast.within
    axes = [name for name in part.levels if name not in (*fixed, contrast.factor)]
    over = axes.index(contrast.over) if contrast.over is not None else None

    def sides(grid: Floats) -> list[Floats]:
        """Return the first and second, `(stops, persons, trials)` each."""
        grids = []
        for side in contrast.contrast:
            values = part.where(grid, fixed | {contrast.factor: side})
            stops = values[np.newaxis] if over is None else np.moveaxis(values, over, 0)
            by_person = np.moveaxis(stops, -2, 1)
            grids.append(by_person.reshape(*by_person.shape[:2], -1))
        return grids

    covariates = study.covariates if contrast is study.answer else ()
    beside = [sides(product_of(part, name)) for name in covariates]
    means = adjusted_means(sides(part.grid(contrast.measure)), beside)
    ran = np.isfinite(sides(part.grid("cell"))[0]).any(axis=(1, 2))  # rows may leave stops out
    interval = band(means[:, ran], level)
    return np.asarray((interval.high - interval.low) / 2)
