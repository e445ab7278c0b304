"""The study that screens another one: its answer again, with every assumed number within its band.

One assumed number after the other is changed along trajectories (Morris), and both sides of the
answer's contrast are run at each point, for the same persons and random numbers.
"""

from __future__ import annotations

import csv
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dva_sim.experiments.study.designs import Design, ValueRange, value_at
from dva_sim.experiments.study.parts import POINT, Contrast, Level, Levels, ScreeningRule
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import trials_of
from dva_sim.kernel import resources
from dva_sim.kernel.assumed import Assumption
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.scenario.assumptions import all_assumptions
from dva_sim.statistics import Floats
from dva_sim.statistics.morris import trajectories

_WIDE = 3.0  # from this ratio of its ends on, a band is divided by equal ratios


def rule_of(study: Study) -> tuple[ScreeningRule, Contrast]:
    """Return the screening rule of a study, and its answer.

    Raises:
        ConfigError: it has no screening, or nothing to screen.
    """
    if study.screening is None or study.answer is None:
        lacking = "screening" if study.screening is None else "answer"
        raise ConfigError(f"{study.file} has no key {lacking!r}, so nothing is screened")
    return study.screening, study.answer


def screened(study: Study) -> list[Assumption]:
    """Return the assumed numbers that are varied.

    All that the patterns name and the study does not set.

    Raises:
        ConfigError: a pattern names none.
    """
    rule, _ = rule_of(study)
    every = all_assumptions()
    for index, pattern in enumerate(rule.over):
        if not any(fnmatchcase(each.key, pattern) for each in every):
            problem = f"no assumed number is called {pattern!r}; 'dva-sim assumed' lists them"
            raise study.error(problem, ("screening", "over", index))
    return [
        each
        for each in every
        if each.key not in study.factors and any(fnmatchcase(each.key, p) for p in rule.over)
    ]


def walks_of(study: Study) -> Floats:
    """Return the trajectories `(count, numbers + 1, numbers)` in the unit cube."""
    rule, _ = rule_of(study)
    rng = Streams(rule.seed).fresh("screening")
    return trajectories(len(screened(study)), rule.trajectories, rng)


def screening_study(study: Study) -> Study:
    """Return the study of all points, with persons and random numbers of its own.

    Raises:
        ConfigError: see `rule_of` and `screened`.
    """
    rule, answer = rule_of(study)
    numbers = screened(study)
    rows: list[dict[str, Level]] = [
        {
            each.key: value_at(_range_of(each), float(np.clip(float(share), 0.0, 1.0)))
            for each, share in zip(numbers, point, strict=True)
        }
        for point in walks_of(study).reshape(-1, len(numbers))
    ]
    factors: dict[str, Levels] = {POINT: tuple(range(len(rows)))}
    factors |= {name: (level,) for name, level in answer.within.items()}
    if answer.over is not None:
        at = study.factors[answer.over][-1] if rule.at is None else rule.at
        factors[answer.over] = (at,)
    factors[answer.factor] = answer.contrast
    question = f"Which assumed numbers move the answer of {study.file.stem}?"
    design = Design(rows=tuple(rows))
    changes = {"question": question, "factors": factors, "design": design}
    return trials_of(study, "screening", rule, answer.part, **changes)


MAIN = "req-rep-vs-pub-sub"
"""The study whose screening speaks for all others about driving."""
KEPT = "experiments/screened"


def file_of(study: Study) -> Path:
    """File beside the study that keeps what a screening found."""
    return study.folder / "screened" / f"{study.file.stem}.csv"


class KeptEffect(NamedTuple):
    """Effect of an assumed number on the main study's answer.

    Attributes:
        key: Key of the number.
        is_clear: True if the 95 % interval of the mean effect lies on one side of zero.
    """

    key: str
    is_clear: bool


def kept_effects(most: int) -> list[KeptEffect]:
    """Return the largest effects on the main study's answer; none if it was not screened."""
    path = resources.available(KEPT, "*.csv").get(MAIN)
    if path is None:
        return []
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if float(row["size"]) > 0.0]
    return [
        KeptEffect(row["key"], float(row["mean_low"]) * float(row["mean_high"]) > 0.0)
        for row in rows[:most]
    ]


def folder_of_screening(name: str) -> Path:
    """Return the default results folder of a screening."""
    return Path("results") / f"{Path(name).stem}-screening"


@cache
def _range_of(number: Assumption) -> ValueRange:
    low = number.low
    high = number.high
    if number.is_whole:
        return ValueRange(low=low, high=high, scale="whole")
    return ValueRange(low=low, high=high, scale="log" if 0 < low * _WIDE < high else "linear")
