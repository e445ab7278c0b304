"""Conditions of an answer, beside its numbers: the persons, the settings, the delays.

A number can be reproducible to the last digit and still depend on what was assumed. So each of
these is stated beside the answer, with its measurements from the same study.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pydantic import ValidationError

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.robustness import RepeatedAnswer, RepeatedStop
from dva_sim.experiments.analysis.run_grid import Setting, present
from dva_sim.experiments.analysis.study_view import StudyView, keys_of
from dva_sim.experiments.report.answer_sentences import other_levels, place, telling_stop
from dva_sim.experiments.report.prose import sentence
from dva_sim.experiments.report.results_reading import ResultsReading
from dva_sim.experiments.study.hashing import hashes_of, input_names
from dva_sim.experiments.study.parts import STRATEGY, TUNING
from dva_sim.experiments.study.screening import MAIN, kept_effects
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.wording import capital, listing, number, percent, quantity
from dva_sim.simulation.labels import brief, factor_name, level_name, setting
from dva_sim.simulation.scenario.assumptions import all_assumptions
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.travel import FOUND
from dva_sim.simulation.timed.unnoticed import Unnoticed, unnoticed

_WAITING = "move_and_wait_share"
_MAX_KEYS = 5


def depends(reading: ResultsReading) -> dict[str, str]:
    """Return the conditions of each sentence, as far as this study shows them."""
    view = reading.view
    finding = reading.finding
    if view is None or finding is None:
        return {}
    outside = view.stops_outside(view.panels[0], view.contrast) if view.over else []
    sentences = {
        f"{capital(reading.cluster)}s": _persons(reading, view, finding),
        "Settings": _settings(reading, view, finding),
        "Assumptions": _assumptions(reading, finding),
        "Delays": sentence("delays", place=place(finding, outside)) if outside else "",
    }
    return {about: words for about, words in sentences.items() if words}


def _persons(reading: ResultsReading, view: StudyView, finding: Finding) -> str:
    """Describe the simulated persons: number, strategy, and results for other models of them."""
    strategy = get(reading.scenario_of(finding.part), STRATEGY)
    repeats = reading.robustness
    stops = [stop for stop in repeats.stops if stop.others] if repeats is not None else []
    return sentence(
        "persons",
        cluster=reading.cluster,
        persons=finding.persons,
        trials=reading.trials_of(finding.part),
        strategy=level_name(STRATEGY, strategy) if strategy else "",
        is_varied=bool(strategy) and STRATEGY in {key.name for key in keys_of(reading.study)},
        waiting=list(_waiting(view, finding)),
        is_repeated=repeats is not None,
        stop=stops[-1] if stops else None,
        level=level_name(repeats.over, stops[-1].level) if repeats is not None and stops else "",
    )


def _waiting(view: StudyView, finding: Finding) -> Iterator[str]:
    """Yield the share of the time that either side's persons moved and waited, if they chose to."""
    stop = telling_stop(finding)
    if stop is None or not view.part.has(_WAITING):
        return
    grid = view.part.grid(_WAITING)
    sides = (finding.first, finding.second)
    runs = [present(view.curve(grid, view.panels[0], side)[stop]) for side in sides]
    shares = [float(values.mean()) for values in runs if len(values)]
    if len(shares) == len(sides) and all(share < 1 for share in shares) and any(shares):
        for share, side in zip(shares, sides, strict=True):
            yield f"{percent(share)} of the time under {level_name(finding.factor, side)}"


def _settings(reading: ResultsReading, view: StudyView, finding: Finding) -> str:
    """Return the answer under the other settings, and the settings that were not varied."""
    stop = telling_stop(finding)
    other_panels = view.panels[1:] if finding.within and stop is not None else []
    differences = [(panel, *_difference(view, finding, panel, stop or 0)) for panel in other_panels]
    apart = [entry for entry in differences if np.isfinite(entry[1])]
    where = place(finding, [stop or 0])
    varied = {key.name for key in keys_of(reading.study)}
    scenario = reading.scenario_of(finding.part)
    values = {key: get(scenario, key) for key in reading.page.assumed if key not in varied}
    return sentence(
        "settings",
        within=setting(finding.within) if other_panels else "",
        there=where and f" {where}",
        levels=other_levels(finding, len(apart)) if apart else "",
        means=[mean for _, mean, _, _ in apart],
        unit=finding.unit,
        apart=[
            f"{quantity(mean, finding.unit)} ({number(low)} to {quantity(high, finding.unit)}) "
            f"with {_apart(panel, finding.within)}"
            for panel, mean, low, high in apart
        ],
        fixed=setting({key: value for key, value in values.items() if isinstance(value, str)}),
    )


def _difference(
    view: StudyView, finding: Finding, panel: Setting, stop: int
) -> tuple[float, float, float]:
    """Mean and band under other settings, within what is possible."""
    bands = view.band_of(panel, finding.first, finding.second)
    low, high = (
        float(np.clip(x[stop], -view.widest, view.widest)) for x in (bands.low, bands.high)
    )
    return float(bands.mean[stop]), low, high


def _apart(panel: Setting, usual: Setting) -> str:
    """Return the levels of a panel that are not those of the answer."""
    deviations = {name: level for name, level in panel.items() if level != usual.get(name)}
    return brief(deviations) if TUNING in deviations else setting(deviations)


def _assumptions(reading: ResultsReading, finding: Finding) -> str:
    """Say how many numbers about persons are assumed, and which of them move an answer.

    Of the timed model, which has no persons, say which times are.
    """
    scenario: dict[str, Any] = dict(reading.scenario_of(finding.part))
    if scenario.get("model") == "timed":
        return assumed_times(scenario, reading.manifest.get("inputs", {}))
    if not get(scenario, STRATEGY):
        return ""
    effects = kept_effects(_MAX_KEYS)
    clear = [effect.key for effect in effects if effect.is_clear]
    count = len(all_assumptions())
    return sentence("assumptions", count=count, effects=len(effects), clear=clear, study=MAIN)


def repeated(robustness: RepeatedAnswer) -> list[str]:
    """Say in how many repeats under other models the answer holds, and how far effects reach."""
    strategies = [level_name(STRATEGY, name) for name in robustness.strategies]
    what = sentence("repeated", r=robustness, strategies=strategies)
    return [what, *(_repeated_stop(robustness, stop) for stop in robustness.stops)]


def _repeated_stop(robustness: RepeatedAnswer, stop: RepeatedStop) -> str:
    failed = []
    for name in robustness.strategies:
        means = [repeat.mean for repeat in stop.others if repeat.strategy == name]
        opposed = sum(not mean * stop.found > 0 for mean in means)
        if opposed:
            failed.append(f"{level_name(STRATEGY, name)} ({opposed} of {len(means)})")
    return sentence(
        "repeated_stop",
        stop=stop,
        level=f"{factor_name(robustness.over)} {level_name(robustness.over, stop.level)}",
        means=[repeat.mean for repeat in stop.others],
        unit=robustness.unit,
        failed=failed,
        beyond=sum(repeat.is_beyond for repeat in stop.others),
    )


_TIMES = {"mobilisation": "to set out", "look": "to look", "act": "to contain"}


def assumed_times(scenario: Mapping[str, Any], inputs: Mapping[str, str]) -> str:
    """Name the durations that no run measures, and how many events an assumption finds.

    Args:
        scenario: Scenario of the timed model, as the manifest has it.
        inputs: Hashes of the files of the study: a site that has changed since is not looked at.
    """
    contains = bool(scenario["dispatch"]["containment"])
    is_noticed = any(s.get("notice") == "detectors" for s in scenario.get("demand", []))
    return sentence(
        "assumed_times",
        teams=list(filter(None, (_of_team(g, contains) for g in scenario["responders"]))),
        by_detectors=is_noticed,
        hidden=[
            f"{each.kind.replace('_', ' ')} at {each.places} of {each.of} places"
            for each in (_hidden(scenario, inputs) if is_noticed else ())
        ],
        found_s=f"{FOUND:,.0f}",
    )


def _of_team(group: Mapping[str, Any], contains: bool) -> str:
    """Return `guard 45 s to set out, 3 s to look (typical times)`; empty where all take no time."""
    times = {name: _typical(group.get(name) or {}) for name in _TIMES}
    if group.get("kind") == "robot" or not contains:
        del times["act"]
    said = [f"{time:g} s {_TIMES[name]}" for name, time in times.items() if time]
    return f"{group.get('name') or group.get('kind')} typically {listing(said)}" if said else ""


def _typical(law: Mapping[str, Any]) -> float:
    """Return the median of a law if it has one, else its mean, else its middle [s]."""
    middles = [law[key] for key in ("median_s", "mean_s") if law.get(key)]
    return float(middles[0] if middles else (law.get("low_s", 0) + law.get("high_s", 0)) / 2)


def _hidden(scenario: Mapping[str, Any], inputs: Mapping[str, str]) -> list[Unnoticed]:
    """Return hidden effects; nothing if the scenario or its site has changed."""
    streams = [{k: v for k, v in stream.items() if v != ""} for stream in scenario["demand"]]
    try:
        scenario_model = TimedScenario.model_validate(dict(scenario) | {"demand": streams})
        now = hashes_of(input_names([scenario_model]))
        return list(unnoticed(scenario_model)) if now.items() <= inputs.items() else []
    except (ConfigError, ValidationError):
        return []
