"""What makes no sense in a study although each of its keys does: told before anything runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from dva_sim.config import Path_
from dva_sim.experiments.asking import (
    REPEATS,
    STRATEGY,
    TUNED,
    TUNING,
    UNTUNED,
    Level,
    Prediction,
)

if TYPE_CHECKING:
    from dva_sim.experiments.study import Study

Fault = tuple[str, Path_]
"""What is wrong, and the key at which that is said."""


def of_factors(study: Study) -> Iterator[Fault]:
    """Names of treatments that do not exist, keys that two factors set, tuning without a rule."""
    setters: dict[str, str] = {}
    for factor, levels in study.factors.items():
        named = study.treatments.get(factor)
        if named is not None:
            for level in (level for level in levels if level not in named):
                known = ", ".join(named)
                yield f"{level!r} is not a treatment; named: {known}", ("factors", factor)
        keys = {key for changes in (named or {}).values() for key in changes} or {factor}
        for key in keys if factor != TUNING else ():
            if setters.setdefault(key, factor) != factor:
                yield f"{key!r} is set by two factors", ("factors", factor)
    yield from _faults_of_tuning(study)


def _faults_of_tuning(study: Study) -> Iterator[Fault]:
    levels, tuning = study.factors.get(TUNING, ()), study.tuning
    if TUNING in study.factors and tuning is None:
        yield "the factor 'tuning' needs a rule: the key 'tuning'", ("factors", TUNING)
    for level in (level for level in levels if level not in (UNTUNED, TUNED)):
        yield f"{level!r} is not a level of 'tuning': untuned, tuned", ("factors", TUNING)
    if tuning is None:
        return
    if tuning.seed == study.seed:
        yield "tuning needs a seed of its own: other persons, other luck", ("tuning", "seed")
    if tuning.part not in study.parts:
        yield f"tuning.part {tuning.part!r} is not a part", ("tuning", "part")
    for name in tuning.by:
        yield from _fault_of_level(study, ("tuning", "by"), name, ())
    for name, level in tuning.at.items():
        yield from _fault_of_level(study, ("tuning", "at", name), name, (level,))


def of_claims(study: Study) -> Iterator[Fault]:
    """What was declared about factors and levels that the study does not have."""
    yield from of_answer(study)
    yield from of_robustness(study)
    if study.predictions and study.answer is None:
        if any(p.direction for p in study.predictions):
            yield "a prediction is judged against the answer; declare one", ("predictions",)
        return
    for index, prediction in enumerate(study.predictions):
        yield from _faults_of_prediction(study, prediction, ("predictions", index))


def of_answer(study: Study) -> Iterator[Fault]:
    """Why the declared contrast cannot be computed."""
    answer = study.answer
    if answer is None:
        return
    if answer.part not in study.parts:
        known = ", ".join(study.parts)
        yield f"answer.part {answer.part!r} is not a part; parts: {known}", ("answer", "part")
    yield from _fault_of_level(study, ("answer", "factor"), answer.factor, answer.contrast)
    yield from _fault_of_level(study, ("answer", "over"), answer.over, ())
    for name, level in answer.within.items():
        yield from _fault_of_level(study, ("answer", "within", name), name, (level,))
    if answer.contrast[0] == answer.contrast[1]:
        yield "contrast compares a level with itself", ("answer", "contrast")


def _faults_of_prediction(study: Study, prediction: Prediction, path: Path_) -> Iterator[Fault]:
    assert study.answer is not None
    factor = prediction.factor or study.answer.factor
    contrast = prediction.contrast or ()
    yield from _fault_of_level(study, (*path, "contrast"), factor, contrast)
    for name, level in prediction.at.items():
        yield from _fault_of_level(study, (*path, "at", name), name, (level,))
    if contrast and contrast[0] == contrast[1]:
        yield "contrast compares a level with itself", (*path, "contrast")
    if prediction.direction == "same" and study.answer.smallest is None:
        yield "'same' needs the answer's smallest effect", (*path, "direction")


def of_robustness(study: Study) -> Iterator[Fault]:
    """Why the contrast cannot be repeated."""
    robustness = study.robustness
    if robustness is None:
        return
    if study.answer is None:
        yield "robustness repeats the answer's contrast; declare one", (REPEATS,)
        return
    over = study.answer.over
    yield from _fault_of_level(study, (REPEATS, "at"), over, robustness.at or ())
    if robustness.strategies and STRATEGY in study.factors:
        yield f"{STRATEGY!r} is a factor already", (REPEATS, "strategies")


def _fault_of_level(
    study: Study, path: Path_, factor: str, levels: Sequence[Level]
) -> Iterator[Fault]:
    if factor not in study.factors:
        known = ", ".join(study.factors)
        yield f"{factor!r} is not a factor; factors: {known}", path
        return
    for level in levels:
        if level not in study.factors[factor]:
            known = ", ".join(map(str, study.factors[factor]))
            yield f"{level!r} is not a level of {factor!r}; levels: {known}", path
