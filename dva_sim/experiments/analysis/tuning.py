"""Tuning: every value of a key is tried alike for all, on persons who take no part in the study."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dva_sim import __version__
from dva_sim.experiments.analysis.paired_effects import Factor, Floats, Part
from dva_sim.experiments.execution.runner import Progress, run_study
from dva_sim.experiments.execution.scheduling import LIMIT_S, Episode
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study import validation
from dva_sim.experiments.study.cell_grid import basis_of_tuning, refuse_unknown_measures
from dva_sim.experiments.study.hashing import fingerprint
from dva_sim.experiments.study.labels import (
    factor_name,
    level_name,
    listing,
    measure_name,
    number,
    setting,
)
from dva_sim.experiments.study.schema import Level, Levels, Tuning
from dva_sim.experiments.study.status import Status
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuned_values import Basis, Chosen, Seen, Tuned, choose
from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError, RunsFailed
from dva_sim.statistics import mean_interval

_DIGITS = 6  # of what was seen, in the file


def tuning_study(study: Study) -> Study:
    """The study that tries every value: its own persons and luck, the same budget for all.

    Raises:
        ConfigError: the study tunes nothing.
    """
    rule = _rule_of(study)
    factors: dict[str, Levels] = {name: (level,) for name, level in rule.at.items()}
    factors |= {name: study.factors[name] for name in rule.by}
    factors[rule.key] = rule.levels
    part = study.parts[rule.part]
    trials = study.model_copy(
        update={
            "question": f"Which {rule.key} for each {', '.join(rule.by)}?",
            "predictions": (),
            "seed": rule.seed,
            "persons": rule.persons,
            "replications": rule.replications,
            "factors": factors,
            "design": None,
            "parts": {rule.part: part.model_copy(update={"reference": None, "replications": None})},
            "answer": None,
            "comparisons": {},
            "hypotheses": {},
            "tuning": None,
            "robustness": None,
            "stop": None,
            "budget_s": None,
            "record": None,
        }
    )
    for problem, _ in validation.of_size(trials):
        raise study.error(f"tuning: {problem}", ("tuning",))
    trials._status, trials._table = Status(), None
    return trials


def tune(
    study: Study,
    out: str | Path,
    *,
    jobs: int | None = None,
    episode: Episode | None = None,
    progress: Progress | None = None,
    limit_s: float = LIMIT_S,
) -> Tuned:
    """Try every value, or go on with trying, and choose by the rule.

    Args:
        study: What is asked.
        out: Results folder of the trials.
        jobs: Processes; by default one for each core.
        episode: Makes the tables of one run; by default a simulation.
        progress: Called with the number of runs done and of all runs, as they finish.
        limit_s: A run that takes longer, by the wall clock, has failed.

    Raises:
        ConfigError: the study tunes nothing, or asks for a measure that there is none of.
        RunsFailed: some did, so that values would be judged by different persons.
    """
    rule, trials = _rule_of(study), tuning_study(study)
    refuse_unknown_measures(study)
    run_study(trials, out, jobs=jobs, episode=episode, progress=progress, limit_s=limit_s)
    results = Results.load(out)
    if results.failures:
        error = str(results.failures[0]["error"])
        raise RunsFailed(f"{len(results.failures)} runs failed, so nothing is chosen: {error}")
    factors = [Factor(name, levels) for name, levels in trials.factors.items()]
    part = Part(results.table("runs"), rule.part, factors)
    if not part.has(rule.measure):
        raise ConfigError(f"tuning.measure {rule.measure!r} has no value in any of these runs")
    seen = _seen(part, rule)
    return Tuned(
        study=study.file.stem,
        made_with=f"{__version__} {fingerprint()}",
        basis=basis_of_tuning(study),
        tuning=rule,
        chosen=tuple(_choice(seen, when) for when in _whens(part, rule)),
        seen=tuple(seen),
    )


def tuned_table(manifest: Mapping[str, Any]) -> CellTable | None:
    """All that a tuning saw, as a report prints it; None where nothing was tuned."""
    if not manifest.get("tuned"):
        return None
    tuned = validate(Tuned, manifest["tuned"])
    rule, chosen = tuned.tuning, {(str(c.when), c.value) for c in tuned.chosen}
    rows = [
        [
            *(level_name(name, level) for name, level in seen.when.items()),
            f"{seen.value:g}",
            f"{number(seen.mean)} ({number(seen.low)} to {number(seen.high)})",
            "chosen" if (str(seen.when), seen.value) in chosen else "",
        ]
        for seen in tuned.seen
    ]
    heads = [*(factor_name(name) for name in rule.by), factor_name(rule.key)]
    heads += [f"{measure_name(rule.measure)}, mean (95 % interval)", ""]
    at = f", at {setting(rule.at)}" if rule.at else ""
    note = (
        f"Rule: the least mean, of equal ones the nearest to 1; {rule.persons} persons who take "
        f"no part in the study, {rule.replications} trials of each{at}."
    )
    if str(manifest["versions"].get("fingerprint")) not in tuned.made_with:
        note += " It was tuned with another version of the program than the study was run with."
    return CellTable(rule.part, heads, len(rule.by), rows, note=note)


def tuning_warning(manifest: Mapping[str, Any]) -> str:
    """That values were tuned with other persons or phones than the study was run with."""
    if not manifest.get("tuned"):
        return ""
    tuned = validate(Tuned, manifest["tuned"])
    others = listing(tuned.basis.unlike(validate(Basis, manifest["basis"])))
    if not others:
        return ""
    return (
        f"The {factor_name(tuned.tuning.key)} was tuned with other {others} than the study was run "
        f"with: 'dva-sim tune {tuned.study}' chooses anew."
    )


def _rule_of(study: Study) -> Tuning:
    if study.tuning is None:
        raise ConfigError(f"{study.file} tunes nothing: it has no key 'tuning'")
    return study.tuning


def _whens(part: Part, rule: Tuning) -> list[dict[str, Level]]:
    levels = {f.name: f.levels for f in part.factors if f.name in rule.by}
    return [
        dict(zip(levels, chosen, strict=True)) for chosen in itertools.product(*levels.values())
    ]


def _seen(part: Part, rule: Tuning) -> list[Seen]:
    grid = part.grid(rule.measure)
    return [
        _tried(part, part.where(grid, {**rule.at, **when, rule.key: value}), when, value)
        for when in _whens(part, rule)
        for value in rule.levels
    ]


def _tried(part: Part, cell: Floats, when: dict[str, Level], value: float) -> Seen:
    """One value, judged by `(persons, trials)` of the measure."""
    found = mean_interval(cell.ravel(), part.persons.repeat(len(part.trials)))
    low, high = (found.low, found.high) if found.n_persons > 1 else (found.mean, found.mean)
    mean, low, high = (round(x, _DIGITS) for x in (found.mean, low, high))
    return Seen(when=when, value=value, mean=mean, low=low, high=high)


def _choice(seen: list[Seen], when: dict[str, Level]) -> Chosen:
    return Chosen(when=when, value=choose({s.value: s.mean for s in seen if s.when == when}))
