"""The level of every factor in every cell of a study, and how many cells and runs that makes.

A design makes rows, each with a level for some of the factors. All other factors cross them: every
row meets every combination of their levels. Without a design there are no rows, and the cells are
the full grid.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

from dva_sim.experiments.study.designs import Row, ValueRange, keys_of, sample, value_at
from dva_sim.experiments.study.parts import POINT
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config import KeyPath


def levels_of_cells(study: Study) -> Iterator[Row]:
    """The level of every factor in every cell, in the order of the cells: last factor fastest."""
    return _crossed(study, rows_of(study))


def levels_at_ends(study: Study) -> Iterator[Row]:
    """The same with each range at each of its ends, and the others in their middle.

    Which points are drawn depends on the seed; whether the ends are valid does not.
    """
    return _crossed(study, _ends_of(study)) if _ranges_of(study) else iter(())


def _crossed(study: Study, rows: list[Row]) -> Iterator[Row]:
    for parts in itertools.product(*_axes(study, rows)):
        yield {key: level for part in parts for key, level in part.items()}


def _axes(study: Study, rows: list[Row]) -> Iterator[list[Row]]:
    """What is crossed: the rows where the first of their factors stands, and each other factor."""
    in_rows = factors_in_rows(study)
    for factor, levels in study.factors.items():
        if factor not in in_rows:
            yield [{factor: level} for level in levels]
        elif rows:
            yield rows
            rows = []


def rows_of(study: Study) -> list[Row]:
    """The rows of the study's design; none where all factors are crossed."""
    design = study.design
    if design is None:
        return []
    if design.zip is not None:
        columns = [study.factors[name] for name in design.zip]
        return [dict(zip(design.zip, levels, strict=True)) for levels in zip(*columns, strict=True)]
    if design.is_sampled:
        rows = sample(design, study.seed)
    else:
        rows = study.listed_rows
    return [{POINT: i, **row} for i, row in enumerate(rows)] if POINT in study.factors else rows


def _ends_of(study: Study) -> list[Row]:
    spans = _ranges_of(study)
    middle: Row = {key: value_at(span, 0.5) for key, span in spans.items()}
    return [{**middle, key: value_at(spans[key], end)} for key in spans for end in (0.0, 1.0)]


def _ranges_of(study: Study) -> Mapping[str, ValueRange]:
    return study.design.ranges if study.design is not None else {}


def size(study: Study) -> int:
    """How many cells each part has, without making them."""
    design, in_rows = study.design, factors_in_rows(study)
    crossed = math.prod(len(levels) for f, levels in study.factors.items() if f not in in_rows)
    if design is None:
        return crossed
    if design.zip is not None:
        return crossed * len(study.factors[design.zip[0]])
    return crossed * (design.points or len(study.listed_rows))


def runs_of(study: Study) -> int:
    """How many runs a study has at most, without making their list."""
    cells = size(study)
    trials = [part.replications or study.replications for part in study.parts.values()]
    has_reference = [part.reference is not None for part in study.parts.values()]
    each = sum((cells + more) * count for more, count in zip(has_reference, trials, strict=True))
    return each * study.most_persons + _runs_of_repeats(study)


def cells_of_repeats(study: Study) -> int:
    """How many cells the repeats of the answer have."""
    robustness, answer = study.robustness, study.answer
    if robustness is None or answer is None or answer.over is None:
        return 0
    levels = len(robustness.at or (None,)) * len(answer.contrast)
    return max(1, len(robustness.strategies)) * (robustness.sets + 1) * levels


def _runs_of_repeats(study: Study) -> int:
    if study.robustness is None:
        return 0
    persons = min(study.robustness.persons, study.persons)
    return cells_of_repeats(study) * persons * study.robustness.replications


def factors_in_rows(study: Study) -> set[str]:
    """The factors whose levels stand in rows, and so do not cross each other."""
    design = study.design
    if design is not None and design.zip is not None:
        return set(design.zip)
    number = {POINT} & study.factors.keys()
    return number | set(keys_of(design, study.listed_rows))


def path_in_design(study: Study, key: str, value: Any) -> KeyPath | None:
    """Where the design gives a key that value; None if it does not."""
    if study.design is not None and key in study.design.ranges:
        return "design", "ranges", key
    for index, row in enumerate(study.listed_rows):
        if key in row and row[key] == value:
            return "design", "rows", index, key
    return None
