"""Named comparisons and hypotheses as they came out: each contrast with interval, size and test.

Levels of factors that a contrast does not name are averaged within each person. A hypothesis holds
when its own test says so after Holm's adjustment within its family; it does not hold when the test
of the opposite does; all else is open.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, Setting, Table
from dva_sim.experiments.analysis.study_view import part_of
from dva_sim.experiments.study.parts import ANSWER, POINT, Contrast, Hypothesis, Level
from dva_sim.statistics import (
    LEVEL,
    EffectSize,
    Interval,
    effect_size,
    equivalence,
    holm,
    holm_levels,
    one_sided_test,
    pair_correlation,
    paired_difference,
    permutation_test,
)

Verdict = Literal["held", "did not hold", "open", "not run"]
_ALPHA = 1 - LEVEL


class PairedRuns(NamedTuple):
    """Both sides of a contrast, run by run `(n,)`, and whose run it was."""

    first: Floats
    second: Floats
    person: Floats


@dataclass(frozen=True)
class Compared:
    """One contrast at one place.

    Attributes:
        name: Name of the comparison.
        contrast: Declared contrast.
        at: Levels at which it was taken.
        difference: First minus second, with its own 95 % interval; None if not run.
        size: Difference in standard deviations.
        correlation: Correlation of the two sides over runs.
        p: p-value of the permutation test.
        adjusted: p-value after Holm's correction within the family.
    """

    name: str
    contrast: Contrast
    at: Setting
    difference: Interval | None = None
    size: EffectSize | None = None
    correlation: float = math.nan
    p: float = math.nan
    adjusted: float = math.nan


@dataclass(frozen=True)
class Tested:
    """Hypothesis with its result.

    Attributes:
        name: Name of the hypothesis.
        contrast: Contrast that the hypothesis is about.
        at: Place of the contrast.
        difference: Measured difference with the interval that decides; None if not run.
        level: Level of that interval: it lies where the hypothesis, or its opposite, claims if and
            only if the verdict is that this holds.
        p: p-value of the hypothesis: one-sided, or of equivalence within the margin.
        adjusted: `p` after Holm's correction within the family.
        p_against: p-value of the opposite: the other direction, or beyond the margin.
        against: `p_against` after Holm's correction within the family.
    """

    name: str
    hypothesis: Hypothesis
    contrast: Contrast
    at: Setting
    difference: Interval | None = None
    level: float = LEVEL
    p: float = math.nan
    adjusted: float = math.nan
    p_against: float = math.nan
    against: float = math.nan
    verdict: Verdict = "not run"


class Judgement(NamedTuple):
    """All comparisons and hypotheses of a study, as they came out."""

    compared: list[Compared]
    tested: list[Tested]


def judged(study: Mapping[str, Any], runs: Table) -> Judgement:
    """Return the comparisons and hypotheses of the manifest, with their results.

    All tests of a family share its chance of a false alarm, comparisons and hypotheses alike;
    what speaks against hypotheses is adjusted among its own.
    """
    compared = [
        _compared(study, runs, name, contrast, at)
        for name, contrast in contrasts_of(study).items()
        if name != ANSWER
        for at in places_of(study, contrast)
    ]
    named = contrasts_of(study)
    tested = [
        _tested(study, runs, name, claim, named[claim.comparison])
        for name, claim in claims_of(study).items()
    ]
    claimed = [t.contrast.family for t in tested]
    families = [*(c.contrast.family for c in compared), *claimed]
    values = [*(c.p for c in compared), *(t.p for t in tested)]
    opposite = [t.p_against for t in tested]
    adjusted = holm(values, families)
    against = holm(opposite, claimed)
    alphas = holm_levels(values, families)[len(compared) :], holm_levels(opposite, claimed)
    of_claims = zip(tested, adjusted[len(compared) :], against, strict=True)
    verdicts = [replace(t, adjusted=float(p), against=float(q)) for t, p, q in of_claims]
    return Judgement(
        [replace(c, adjusted=float(p)) for c, p in zip(compared, adjusted, strict=False)],
        [
            _with_interval(study, runs, replace(t, verdict=verdict_of(t)), alpha)
            for t, *alpha in zip(verdicts, *alphas, strict=True)
        ],
    )


def _with_interval(
    study: Mapping[str, Any], runs: Table, tested: Tested, alphas: Sequence[float]
) -> Tested:
    """Give a verdict the interval that decides it.

    Args:
        study: Study as the manifest has it.
        runs: The table of runs.
        tested: The verdict.
        alphas: Levels of the one-sided tests of the hypothesis and of its opposite.
    """
    pairs = pairs_of(study, runs, tested.contrast, tested.at)
    if tested.difference is None or pairs is None or not np.isfinite(alphas).all():
        return tested
    own, opposite = alphas
    if tested.hypothesis.direction == "same":
        opposite = opposite / 2  # the opposite lies beyond either end of the margin
    by_verdict = {"held": own, "did not hold": opposite}
    level = 1 - 2 * by_verdict.get(tested.verdict, min(own, opposite))
    return replace(tested, difference=paired_difference(*pairs, level), level=level)


def verdict_of(tested: Tested) -> Verdict:
    """Return the verdict, from the adjusted p of the hypothesis and of its opposite."""
    if tested.difference is None:
        return "not run"
    if tested.adjusted <= _ALPHA:
        return "held"
    return "did not hold" if tested.against <= _ALPHA else "open"


def pairs_of(
    study: Mapping[str, Any], runs: Table, contrast: Contrast, at: Setting
) -> PairedRuns | None:
    """Return both sides of a contrast at one place; None where it was not run."""
    part = part_of(study, runs, contrast.part)
    needed = [*at.items(), *((contrast.factor, level) for level in contrast.contrast)]
    if not all(level in part.levels.get(name, ()) for name, level in needed):
        return None
    grid = part.outcome(contrast.measure)
    sides = [part.where(grid, dict(at) | {contrast.factor: level}) for level in contrast.contrast]
    person = np.broadcast_to(part.persons[:, np.newaxis], sides[0].shape)
    return PairedRuns(sides[0].ravel(), sides[1].ravel(), person.ravel())


def contrasts_of(study: Mapping[str, Any]) -> dict[str, Contrast]:
    """Return the answer's contrast and the named ones."""
    named: dict[str, Contrast] = {}
    if study.get("answer"):
        named[ANSWER] = Contrast.model_validate(study["answer"])
    for name, declared in (study.get("comparisons") or {}).items():
        named[name] = Contrast.model_validate(declared)
    return named


def claims_of(study: Mapping[str, Any]) -> dict[str, Hypothesis]:
    """Return the hypotheses, but for those about a contrast that is not declared."""
    declared = (study.get("hypotheses") or {}).items()
    claims = {name: Hypothesis.model_validate(claim) for name, claim in declared}
    named = contrasts_of(study)
    return {name: claim for name, claim in claims.items() if claim.comparison in named}


def places_of(study: Mapping[str, Any], contrast: Contrast) -> list[Setting]:
    """Return each level that a contrast runs over, or the one place it is taken at."""
    at: Setting = dict(contrast.within)
    levels: Sequence[Level] = study.get("factors", {}).get(contrast.over, ())
    if contrast.over == POINT or not levels:  # points in ranges are like trials
        return [at]
    return [at | {str(contrast.over): level} for level in levels]


def _compared(
    study: Mapping[str, Any], runs: Table, name: str, contrast: Contrast, at: Setting
) -> Compared:
    pairs = pairs_of(study, runs, contrast, at)
    difference = paired_difference(*pairs) if pairs is not None else None
    if pairs is None or difference is None or not difference.n_persons:
        return Compared(name, contrast, at)
    return Compared(
        name=name,
        contrast=contrast,
        at=at,
        difference=difference,
        size=effect_size(*pairs),
        correlation=pair_correlation(pairs.first, pairs.second),
        p=permutation_test(*pairs),
    )


def _tested(
    study: Mapping[str, Any], runs: Table, name: str, claim: Hypothesis, contrast: Contrast
) -> Tested:
    at = places_of(study, contrast)[-1] | claim.at
    pairs = pairs_of(study, runs, contrast, at)
    difference = paired_difference(*pairs) if pairs is not None else None
    if pairs is None or difference is None or not difference.n_persons:
        return Tested(name, claim, contrast, at)
    p = _p(claim, pairs)
    against = _p_against(claim, pairs)
    return Tested(name, claim, contrast, at, difference, p=p, p_against=against)


def _p(claim: Hypothesis, pairs: PairedRuns) -> float:
    """Return the p-value of the claim."""
    if claim.direction == "same":
        return equivalence(*pairs, claim.margin)
    margin = claim.margin if claim.direction == "above" else -claim.margin
    return one_sided_test(*pairs, margin, claim.direction)


def _p_against(claim: Hypothesis, pairs: PairedRuns) -> float:
    """Return the p-value of the opposite: beyond the margin, or beyond either end of it."""
    if claim.direction == "above":
        return one_sided_test(*pairs, claim.margin, "below")
    if claim.direction == "below":
        return one_sided_test(*pairs, -claim.margin, "above")
    above = one_sided_test(*pairs, claim.margin, "above")
    return min(1.0, 2 * min(above, one_sided_test(*pairs, -claim.margin, "below")))
