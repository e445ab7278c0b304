"""Checks, before the first run, that a study can answer its question and how well it covers.

With more persons than in these tables, or a normal law, 95 % intervals cover what they promise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

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
    """Return factors as the analysis lays them out: points are trials, a zip is one factor."""
    design = study.design
    zipped = tuple(design.zip or ()) if design is not None else ()
    aside = {POINT, *zipped[1:]}
    compared: dict[str, Sequence[Level]] = {
        name: levels for name, levels in study.factors.items() if name not in aside
    }
    rows = len(study.listed_rows)
    grid = math.prod(map(len, compared.values()))
    return {"row": range(rows)} if 2 * rows < grid and rows else compared


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


Coverage = tuple[float, float]
"""Share of studies in which everything is covered, at skewness 2 (exponential differences between
persons) and at 6 (log-normal), measured in 2,000 studies each."""

OF_BANDS: Final[dict[int, Coverage]] = {
    4: (0.772, 0.644),
    8: (0.889, 0.753),
    12: (0.905, 0.804),
    24: (0.932, 0.859),
    48: (0.949, 0.889),
}
"""Coverage of a band over six independent levels, by number of persons."""
OF_STOPPING: Final[Coverage] = (0.932, 0.893)
"""Coverage of an interval that ends a study by its width, with looks every 12 persons to 240."""
WELL_COVERED_PERSONS: Final = 24  # with as many persons, a band loses no coverage worth a remark


def coverage_remarks(study: Study) -> Iterator[str]:
    """Yield where a study's intervals cover less than 95 %, and what to choose instead."""
    stop = study.stop
    if stop is not None and not stop.is_scheduled:
        covered = coverage_in_words(OF_STOPPING)
        yield (
            f"a 95 % interval that ends a study by its width holds {covered}; "
            "with 48 persons or more, fixed beforehand, or batch_persons: double, in 95 %"
        )
    few = of_few_persons(study.most_persons)
    if few and study.most_persons > 1:
        yield few


def of_few_persons(persons: int) -> str:
    """Describe the coverage of a band of a few persons; empty with enough."""
    if persons >= WELL_COVERED_PERSONS:
        return ""
    tabulated = max((count for count in OF_BANDS if count <= persons), default=min(OF_BANDS))
    beyond = min(count for count in OF_BANDS if count > tabulated)
    return (
        f"with {tabulated} to {beyond - 1} persons a 95 % band over six levels holds "
        f"{coverage_in_words(OF_BANDS[tabulated])}"
    )


def coverage_in_words(coverage: Coverage) -> str:
    """Return `in 93 % of studies if differences have skewness 2, and in 89 % at skewness 6`."""
    mild, strong = (f"{100 * share:.0f} %" for share in coverage)
    return f"in {mild} of studies if differences have skewness 2, and in {strong} at skewness 6"
