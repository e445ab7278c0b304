"""Checks, before the first run, that a study can answer its question."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from dva_sim.experiments.study.factor_levels import levels_of_cells
from dva_sim.experiments.study.parts import POINT, Contrast, Level
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.wording import listing

_SIDES = 2


class PossibleContrast(NamedTuple):
    """Two levels of one factor that can be compared, and the factor that this runs over."""

    factor: str
    contrast: tuple[Level, Level]
    over: str | None


def only_contrast(factors: Mapping[str, Sequence[Level]]) -> PossibleContrast | None:
    """Return the contrast of a grid in which no other is possible; None if several or none are.

    It compares the only factor with two levels. One other factor may have more levels.
    """
    several = {name: levels for name, levels in factors.items() if len(levels) > 1}
    pairs = [name for name, levels in several.items() if len(levels) == _SIDES]
    if len(pairs) != 1 or len(several) > _SIDES:
        return None
    first, second = several[pairs[0]]
    over = next((name for name in several if name != pairs[0]), None)
    return PossibleContrast(pairs[0], (first, second), over)


def compared_factors(study: Study) -> dict[str, Sequence[Level]]:
    """Factors as the analysis lays them out: points are trials, a zip is one factor."""
    design = study.design
    zipped = tuple(design.zip or ()) if design is not None else ()
    aside = {POINT, *zipped[1:]}
    kept: dict[str, Sequence[Level]] = {
        name: levels for name, levels in study.factors.items() if name not in aside
    }
    rows = len(study.listed_rows)
    grid = math.prod(map(len, kept.values()))
    return {"row": range(rows)} if 2 * rows < grid and rows else kept


def why_unanswered(study: Study) -> Iterator[str]:
    """Yield why the runs of a valid study cannot answer its question, a sentence each."""
    answer = study.answer
    if answer is None and not study.lost:
        yield from _why_no_contrast(compared_factors(study))
    if answer is not None and not _meet(study, answer):
        first, second = answer.contrast
        yield (
            f"the answer will not be computed: {answer.factor} {first} and {second} are never run "
            "at the same levels of the other factors"
        )
    if study.most_persons < _SIDES:
        yield "nothing will have an interval, since that takes 2 persons; persons is 1"


def _why_no_contrast(factors: Mapping[str, Sequence[Level]]) -> Iterator[str]:
    several = [name for name, levels in factors.items() if len(levels) > 1]
    if only_contrast(factors) is not None:
        return
    if not several:
        yield "nothing will be compared, since no factor has two levels"
    else:
        which = f"{listing(several)} allow{'s' * (len(several) == 1)} several contrasts"
        yield f"the question will not be answered, since {which}; declare one under 'answer'"


def _meet(study: Study, answer: Contrast) -> bool:
    """Return True if both sides of a contrast are run under the same levels of other factors."""
    zipped = tuple(study.design.zip or ()) if study.design is not None else ()
    moved = {answer.factor, *(zipped if answer.factor in zipped else ())}
    sides: list[set[tuple[tuple[str, Level], ...]]] = [set(), set()]
    for levels in levels_of_cells(study):
        if any(levels.get(name) != level for name, level in answer.within.items()):
            continue
        rest = tuple(item for item in levels.items() if item[0] not in moved)
        for side, level in zip(sides, answer.contrast, strict=True):
            if levels.get(answer.factor) == level:
                side.add(rest)
    return bool(sides[0] & sides[1])
