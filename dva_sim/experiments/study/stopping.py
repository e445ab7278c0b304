"""Stopping rules: pure deciders on whole batches of persons, in the order of the design.

The order of finishing plays no part, so the same study stops after the same batch on every machine.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.factor_levels import factors_in_rows
from dva_sim.experiments.study.parts import Contrast, Level, StopRule, multiplied
from dva_sim.experiments.study.study import Study
from dva_sim.statistics import Floats, adjusted, band, mean_interval

_BATCH_IN_BUDGET = 2  # persons, where a budget alone ends a study

Row = Mapping[str, Any]
_Run = tuple[int, int]  # person, trial


def rounds(study: Study, jobs: Sequence[StudyJob]) -> list[list[StudyJob]]:
    """The jobs in batches of persons; a study that nothing can stop early is one batch."""
    edges = _edges(study)
    batches: list[list[StudyJob]] = [[] for _ in edges]
    for job in jobs:
        batches[int(np.searchsorted(edges, job.person, side="right"))].append(job)
    return [batch for batch in batches if batch]


def is_enough(study: Study, rows: Sequence[Row]) -> bool:
    """True if every interval of the stopping rule is narrow enough.

    Args:
        rows: Rows of the table `runs` so far, in the order of the design.
    """
    return study.stop is not None and widest(study, study.stop, rows) <= study.stop.half_width


def widest(study: Study, stop: StopRule, rows: Sequence[Row]) -> float:
    """Half of the widest interval that the rule looks at; infinite where there is none yet."""
    found = half_widths(study, stop, rows)
    return float(found.max()) if len(found) and np.isfinite(found).all() else math.inf


def half_widths(study: Study, stop: StopRule, rows: Sequence[Row]) -> Floats:
    """Half of each interval that the rule looks at; nan where there is none yet."""
    if stop.comparison is not None:
        level = stop.level(study.persons)
        return _of_contrast(study, study.contrasts[stop.comparison], rows, level)
    return _of_measure(str(stop.measure), [row for row in rows if row["part"] == stop.part])


def _edges(study: Study) -> list[int]:
    """Number of persons after each batch."""
    if study.stop is not None:
        return study.stop.looks(study.persons)
    if study.budget_s is not None:
        return [*range(_BATCH_IN_BUDGET, study.persons, _BATCH_IN_BUDGET), study.persons]
    return [study.persons]


def _of_measure(measure: str, rows: Iterable[Row]) -> Floats:
    """Half-widths of each cell's mean, in excess of the reference run if there is one."""
    cells: dict[int, dict[_Run, float]] = defaultdict(dict)
    aside: dict[_Run, float] = {}
    for row in rows:
        kept = aside if row["is_reference"] else cells[row["cell"]]
        kept[row["person"], row["trial"]] = _number(row.get(measure))
    widths = []
    for runs in cells.values():
        values = [value - aside.get(who, np.nan if aside else 0.0) for who, value in runs.items()]
        found = mean_interval(values, [person for person, _ in runs])
        widths.append(found.half_width)
    return np.array(widths)


def _of_contrast(study: Study, asked: Contrast, rows: Iterable[Row], level: float) -> Floats:
    """Half-widths of the paired difference at each level of `over`; references cancel.

    The answer's is adjusted for the covariates.
    """
    wanted = study.covariates if asked is study.answer else ()
    sides: tuple[dict[Any, Row], dict[Any, Row]] = ({}, {})
    names = {asked.factor, asked.over, *factors_in_rows(study)}
    free = {f: levels[0] for f, levels in study.factors.items() if f not in names}
    fixed = free | dict(asked.within)
    ranges = study.design.ranges if study.design is not None else ()
    keys = [name for name in (*study.factors, *ranges) if name != asked.factor]
    for row in rows:
        is_there = row["part"] == asked.part and not row["is_reference"]
        if not is_there or any(row.get(factor) != there for factor, there in fixed.items()):
            continue
        for side, compared in zip(sides, asked.contrast, strict=True):
            if row[asked.factor] == compared:
                place = tuple(row.get(key) for key in keys)
                side[place, row["person"], row["trial"]] = row
    at = keys.index(asked.over) if asked.over is not None else None
    pairs = {run: (row, sides[1].get(run, {})) for run, row in sides[0].items()}
    if not pairs:
        return np.array([])
    found = {run: _minus(asked.measure, *rows) for run, rows in pairs.items()}
    beside = [
        _means({run: _middle(c, *pairs[run]) + 0 * value for run, value in found.items()}, at)
        for c in wanted
    ]
    means = _means(found, at)
    seen = band(adjusted(means, beside) if beside else means, level)
    return np.asarray((seen.high - seen.low) / 2)


def _minus(measure: str, first: Row, second: Row) -> float:
    return _number(first.get(measure)) - _number(second.get(measure))


def _middle(covariate: str, first: Row, second: Row) -> float:
    """Mean of a covariate over a pair of runs."""
    names = multiplied(covariate)
    return sum(math.prod(_number(row.get(name)) for name in names) for row in (first, second)) / 2


def _means(found: Mapping[Any, float], at: int | None) -> Floats:
    """Means `(persons, levels of over)` over the runs in which something is known."""
    pairs: dict[tuple[int, Level], list[float]] = defaultdict(list)
    for (place, person, _), value in found.items():
        pairs[person, None if at is None else place[at]].append(value)
    persons = {who: i for i, who in enumerate(dict.fromkeys(who for who, _ in pairs))}
    levels = {level: i for i, level in enumerate(dict.fromkeys(level for _, level in pairs))}
    means = np.full((len(persons), len(levels)), np.nan)
    for (who, level), values in pairs.items():
        there = [value for value in values if np.isfinite(value)]
        means[persons[who], levels[level]] = np.mean(there) if there else np.nan
    return means


def _number(value: Any) -> float:
    return float(value) if value is not None else np.nan
