"""Predictions beside findings; fixed rules decide whether each held.

A direction holds when the 95 % interval lies on that side of zero, and fails when it lies on the
other side or rules out every effect that matters, unless a smaller one was expected. `same` holds
when the interval lies within the smallest effect that matters, and fails when it lies wholly
outside. A range holds when it contains the mean, and fails when the interval does not touch it. All
else is open. Nothing is judged where tuning has chosen the value there was, so that both sides are
the same runs.

What arithmetic predicts of lock-step messaging: its rate, and from which delay on it binds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from dva_sim.experiments.analysis.run_grid import Setting
from dva_sim.experiments.analysis.study_view import StudyView, interval_of
from dva_sim.experiments.study.parts import TUNING, Level, Prediction, Range
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import number, quantity
from dva_sim.simulation.labels import level_name, measure_of, setting
from dva_sim.statistics import Interval

Verdict = Literal["held", "did not hold", "open", "not judged"]
_SAME_RUNS = "the same runs: tuning chose the value it had"
_NAMES = ("cell", "config", TUNING)  # columns of a run that tell nothing of how it went
_SIDES = {"above": "above zero", "below": "below zero", "same": "the same"}


@dataclass(frozen=True)
class Judged:
    """One prediction and what became of it.

    Attributes:
        text: Text as it was written down.
        expected: Predicted contrast; empty if there is none.
        found: Measured contrast; empty if not run.
        persons: Number of persons behind the finding.
    """

    text: str
    expected: str
    found: str
    verdict: Verdict
    persons: int = 0


def judge_all(study: Mapping[str, Any], view: StudyView | None) -> list[Judged]:
    """Return every prediction of a study, as its manifest holds it."""
    predictions = [Prediction.model_validate(p) for p in study.get("predictions") or ()]
    return [_judge(prediction, view) for prediction in predictions]


def verdict_of(
    direction: str | None, expected: Range | None, smallest: float | None, interval: Interval
) -> Verdict:
    """Judge a prediction by the interval of the finding."""
    least = min(map(abs, expected)) if expected is not None else math.inf
    verdicts = [_of_direction(direction, smallest, interval, is_small=least < (smallest or 0.0))]
    if expected is not None:
        verdicts.append(_of_range(expected, interval))
    if "did not hold" in verdicts:
        return "did not hold"
    return "held" if all(v == "held" for v in verdicts) else "open"


def _of_direction(
    direction: str | None, smallest: float | None, interval: Interval, is_small: bool
) -> Verdict:
    low, high = (
        (interval.low, interval.high) if direction != "below" else (-interval.high, -interval.low)
    )
    matters = smallest or 0.0
    if direction == "same":
        if -matters <= low and high <= matters:
            return "held"
        return "did not hold" if low > matters or high < -matters else "open"
    if low > 0:
        return "held"
    return "did not hold" if high <= 0 or (high < matters and not is_small) else "open"


def _of_range(expected: Range, interval: Interval) -> Verdict:
    if expected[0] <= interval.mean <= expected[1]:
        return "held"
    apart = interval.low > expected[1] or interval.high < expected[0]
    return "did not hold" if apart else "open"


def _judge(prediction: Prediction, view: StudyView | None) -> Judged:
    text = prediction.text
    if prediction.direction is None:
        return Judged(text, "", "", "not judged")
    question = _asked(prediction, view) if view is not None else None
    if view is None or question is None:
        return Judged(text, "", "not run", "not judged")
    factor, (first, second), where = question
    unit = unit_of(view.measure)
    names = f"{level_name(factor, first)} minus {level_name(factor, second)}"
    expected = f"{names} in {measure_of(view.measure, view.part.name)}, {setting(where)}: "
    expected += _SIDES[prediction.direction]
    if (range_ := prediction.expected) is not None:
        expected += f", {number(range_[0])} to {quantity(range_[1], unit)}"
    if factor == TUNING and _chose_what_was(view, (first, second), where):
        return Judged(text, expected, _SAME_RUNS, "not judged")
    interval = _measured(view, factor, (first, second), where)
    if interval is None:
        return Judged(text, expected, "not run", "not judged")
    verdict = verdict_of(prediction.direction, prediction.expected, view.smallest_effect, interval)
    low = max(interval.low, -view.widest)
    high = min(interval.high, view.widest)
    words = f"{quantity(interval.mean, unit)} ({number(low)} to {quantity(high, unit)})"
    return Judged(text, expected, words, verdict, interval.n_persons)


def _asked(
    prediction: Prediction, view: StudyView
) -> tuple[str, tuple[Level, Level], Setting] | None:
    """Return the factor, levels and place of the contrast; None where they were not run."""
    if view.series_factor is None:
        return None
    factor = prediction.factor or view.series_factor.name
    contrast = prediction.contrast or view.contrast
    where = dict(view.panels[0]) | ({view.over.name: view.stops[-1]} if view.over else {})
    where |= prediction.at
    levels = view.part.levels
    if factor != view.series_factor.name and view.contrast is not None:
        where.setdefault(view.series_factor.name, view.contrast[1])
    where.pop(factor, None)
    needed: list[tuple[str, Sequence[Level]]] = [(name, (level,)) for name, level in where.items()]
    if contrast is None or factor not in levels:
        return None
    needed.append((factor, contrast))
    ran = all(name in levels and set(some) <= set(levels[name]) for name, some in needed)
    return (factor, contrast, where) if ran else None


def _chose_what_was(view: StudyView, contrast: tuple[Level, Level], where: Setting) -> bool:
    """Return True if tuned and untuned runs agree in everything measured."""
    columns = [view.part.grid(name) for name in view.part.treated if name not in _NAMES]
    pairs = [[view.part.where(c, where | {TUNING: level}) for level in contrast] for c in columns]
    return all(np.array_equal(first, second, equal_nan=True) for first, second in pairs)


def _measured(
    view: StudyView, factor: str, contrast: tuple[Level, Level], where: Setting
) -> Interval | None:
    """Return the paired difference at one place."""
    first, second = (view.part.where(view.values, where | {factor: level}) for level in contrast)
    interval = interval_of(first - second, view.level)
    return interval if interval is not None and interval.n_persons > 1 else None
