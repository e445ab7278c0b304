"""Tuning: the value of a key that suits each treatment best, from trials of all values."""

from __future__ import annotations

from dva_sim import __version__
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Setting
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import basis_of_tuning
from dva_sim.experiments.study.hashing import fingerprint
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.parts import Tuning
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import (
    ChosenValue,
    TriedValue,
    TunedValues,
    choose,
    rule_of,
)
from dva_sim.kernel.errors import ConfigError
from dva_sim.statistics import mean_interval

_DIGITS = 6  # of what was seen, in the file


def chosen_of(study: Study, results: Results) -> TunedValues:
    """Choose the values of a study's tuned key by its rule, from the runs of all trials.

    Raises:
        ConfigError: none of the runs has a value of the measure.
    """
    rule = rule_of(study)
    factors = [Factor(name, tuple(levels)) for name, levels in results.factors.items()]
    part = RunGrid(results.table("runs"), rule.part, factors)
    if not part.has(rule.measure):
        raise ConfigError(f"tuning.measure {rule.measure!r} has no value in any of these runs")
    whens = list(part.settings(but=[f.name for f in part.factors if f.name not in rule.by]))
    seen = [_tried(part, rule, when, value) for when in whens for value in rule.levels]
    return TunedValues(
        study=study.file.stem,
        made_with=f"{__version__} {fingerprint()}",
        basis=basis_of_tuning(StudyInputs(study)),
        tuning=rule,
        chosen=tuple(_choice(seen, when) for when in whens),
        seen=tuple(seen),
    )


def _tried(part: RunGrid, rule: Tuning, when: Setting, value: float) -> TriedValue:
    """One value, judged by `(persons, trials)` of the measure."""
    cell = part.where(part.grid(rule.measure), {**rule.at, **when, rule.key: value})
    found = mean_interval(cell.ravel(), part.persons.repeat(len(part.trials)))
    low, high = (found.low, found.high) if found.n_persons > 1 else (found.mean, found.mean)
    mean, low, high = (round(x, _DIGITS) for x in (found.mean, low, high))
    return TriedValue(when=when, value=value, mean=mean, low=low, high=high)


def _choice(seen: list[TriedValue], when: Setting) -> ChosenValue:
    return ChosenValue(when=when, value=choose({s.value: s.mean for s in seen if s.when == when}))
