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
    found = [Prediction.model_validate(p) for p in study.get("predictions") or ()]
    return [_judge(prediction, view) for prediction in found]


def verdict_of(
    direction: str | None, expected: Range | None, smallest: float | None, found: Interval
) -> Verdict:
    """Judge a prediction by the interval of the finding."""
    least = min(map(abs, expected)) if expected is not None else math.inf
    verdicts = [_of_direction(direction, smallest, found, is_small=least < (smallest or 0.0))]
    if expected is not None:
        verdicts.append(_of_range(expected, found))
    if "did not hold" in verdicts:
        return "did not hold"
    return "held" if all(v == "held" for v in verdicts) else "open"


def _of_direction(
    direction: str | None, smallest: float | None, found: Interval, is_small: bool
) -> Verdict:
    low, high = (found.low, found.high) if direction != "below" else (-found.high, -found.low)
    matters = smallest or 0.0
    if direction == "same":
        if -matters <= low and high <= matters:
            return "held"
        return "did not hold" if low > matters or high < -matters else "open"
    if low > 0:
        return "held"
    return "did not hold" if high <= 0 or (high < matters and not is_small) else "open"


def _of_range(expected: Range, found: Interval) -> Verdict:
    if expected[0] <= found.mean <= expected[1]:
        return "held"
    apart = found.low > expected[1] or found.high < expected[0]
    return "did not hold" if apart else "open"


def _judge(prediction: Prediction, view: StudyView | None) -> Judged:
    text = prediction.text
    if prediction.direction is None:
        return Judged(text, "", "", "not judged")
    asked = _asked(prediction, view) if view is not None else None
    if view is None or asked is None:
        return Judged(text, "", "not run", "not judged")
    factor, (first, second), where = asked
    unit = unit_of(view.measure)
    names = f"{level_name(factor, first)} minus {level_name(factor, second)}"
    expected = f"{names} in {measure_of(view.measure, view.part.name)}, {setting(where)}: "
    expected += _SIDES[prediction.direction]
    if (range_ := prediction.expected) is not None:
        expected += f", {number(range_[0])} to {quantity(range_[1], unit)}"
    if factor == TUNING and _chose_what_was(view, (first, second), where):
        return Judged(text, expected, _SAME_RUNS, "not judged")
    found = _measured(view, factor, (first, second), where)
    if found is None:
        return Judged(text, expected, "not run", "not judged")
    verdict = verdict_of(prediction.direction, prediction.expected, view.smallest_effect, found)
    low = max(found.low, -view.widest)
    high = min(found.high, view.widest)
    words = f"{quantity(found.mean, unit)} ({number(low)} to {quantity(high, unit)})"
    return Judged(text, expected, words, verdict, found.n_persons)


def _asked(
    prediction: Prediction, view: StudyView
) -> tuple[str, tuple[Level, Level], Setting] | None:
    """Return the factor, levels and place of the contrast; None where they were not run."""
    if view.line is None:
        return None
    factor = prediction.factor or view.line.name
    contrast = prediction.contrast or view.contrast
    where = dict(view.panels[0]) | ({view.over.name: view.stops[-1]} if view.over else {})
    where |= prediction.at
    levels = view.part.levels
    if factor != view.line.name and view.contrast is not None:
        where.setdefault(view.line.name, view.contrast[1])
    where.pop(factor, None)
    wanted: list[tuple[str, Sequence[Level]]] = [(name, (level,)) for name, level in where.items()]
    if contrast is None or factor not in levels:
        return None
    wanted.append((factor, contrast))
    ran = all(name in levels and set(some) <= set(levels[name]) for name, some in wanted)
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
    found = interval_of(first - second, view.level)
    return found if found is not None and found.n_persons > 1 else None
