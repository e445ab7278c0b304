"""Conditions of an answer, beside its numbers: the persons, the settings, the delays.

A number can be reproducible to the last digit and still hang on what was assumed. So each of
these is stated beside the answer, with its measurements from the same study.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.answer_sentences import telling_stop
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.level_phrases import at, places
from dva_sim.experiments.analysis.robustness import RepeatedAnswer
from dva_sim.experiments.analysis.run_grid import (
    Floats,
    Setting,
    present,
)
from dva_sim.experiments.analysis.study_view import (
    StudyView,
    keys_of,
)
from dva_sim.experiments.report.results_reading import ResultsReading
from dva_sim.experiments.study.parts import STRATEGY, TUNING
from dva_sim.experiments.study.screening import MAIN, kept_effects
from dva_sim.kernel.wording import capital, listing, number, percent, quantity
from dva_sim.simulation.labels import brief, level_name, setting
from dva_sim.simulation.scenario.assumptions import all_assumptions

_WAITING = "move_and_wait_share"


_MOST_SETTINGS = 3  # told one by one
_MOST_KEYS = 5


def depends(reading: ResultsReading) -> dict[str, str]:
    """By what each sentence is about; only what can be told of this study."""
    view, finding = reading.view, reading.finding
    if view is None or finding is None:
        return {}
    sentences = {
        _whom(reading): _persons(reading, view, finding),
        "Settings": " ".join(_settings(reading, view, finding)),
        "Assumptions": _assumptions(reading, finding),
        "Delays": _beyond(view, finding),
    }
    return {about: words for about, words in sentences.items() if words}


def _whom(reading: ResultsReading) -> str:
    return f"{capital(reading.cluster)}s"


def _persons(reading: ResultsReading, view: StudyView, finding: Finding) -> str:
    """Describe the simulated persons: number, strategy, and results for other models of them."""
    if reading.cluster == "shift":
        return f"{finding.persons} simulated, independent of each other."
    if reading.cluster == "repeat":
        return f"{finding.persons} of each configuration, in real time, one run at a time."
    trials = reading.trials_of(finding.part)
    each = f", {trials} trial{'s' if trials > 1 else ''} each" if trials else ""
    who = f"{finding.persons} simulated{each}; no human took part."
    strategy = get(reading.scenario_of(finding.part), STRATEGY)
    if not strategy:
        return who
    if STRATEGY in {key.name for key in keys_of(reading.study)}:
        return f"{who} How they steer is varied."
    steer = f"They steer by the strategy {level_name(STRATEGY, strategy)}{_how(view, finding)}"
    if reading.robustness is not None:
        return f"{who} {steer}. {_under_others(reading.robustness)}"
    return f"{who} {steer}; with another, not tried here, the difference may be smaller or larger."


def _assumptions(reading: ResultsReading, finding: Finding) -> str:
    """Say how many numbers about persons are assumed, and which of them move an answer."""
    if not get(reading.scenario_of(finding.part), STRATEGY):
        return ""
    count = len(all_assumptions())
    text = f"{count} numbers about people and phones are assumed (dva-sim assumed)."
    effects = kept_effects(_MOST_KEYS)
    if not effects:
        return f"{text} To see which of them move such an answer: dva-sim screen {MAIN}."
    clear = [effect.key for effect in effects if effect.is_clear]
    found = f"{listing(clear)}" if clear else f"none of the {len(effects)} largest effects"
    verb = "are" if len(clear) > 1 else "is"
    return f"{text} Screened for {MAIN} only: {found} {verb} clear of chance."


def _how(view: StudyView, finding: Finding) -> str:
    """Say how much of the time an adaptive strategy used move-and-wait."""
    stop = telling_stop(finding)
    if stop is None or not view.part.has(_WAITING):
        return ""
    grid, sides = view.part.grid(_WAITING), (finding.first, finding.second)
    shares = [_mean(view.curve(grid, view.panels[0], side)[stop]) for side in sides]
    if not all(0 <= share < 1 for share in shares) or not any(shares):
        return ""
    clauses = [
        f"{percent(share)} of the time under {level_name(finding.factor, side)}"
        for share, side in zip(shares, sides, strict=True)
    ]
    return f", here by moving and waiting for {listing(clauses)}"


def _mean(values: Floats) -> float:
    seen = present(values)
    return float(seen.mean()) if len(seen) else math.nan


def _under_others(found: RepeatedAnswer) -> str:
    """At the last level at which it was repeated."""
    stops = [stop for stop in found.stops if stop.others]
    if not stops:
        return "No repeat under another model of them is complete."
    stop, unit = stops[-1], found.unit
    means = [repeat.mean for repeat in stop.others]
    sign = f"{stop.same_sign} of {len(means)}"
    return (
        f"Under other models of them the sign is the same in {sign}, and the difference at "
        f"{level_name(found.over, stop.level)} runs from {number(min(means))} to "
        f"{quantity(max(means), unit)}."
    )


def _settings(reading: ResultsReading, view: StudyView, finding: Finding) -> Iterator[str]:
    """The answer under the other settings that were run, and what was not varied at all."""
    stop = telling_stop(finding)
    if finding.within and stop is not None and (others := view.panels[1:]):
        yield f"The answer is for {setting(finding.within)}. {_elsewhere(view, finding, others)}"
    fixed = _fixed(reading, finding.part)
    if fixed:
        yield f"Not varied: {setting(fixed)}."


def _elsewhere(view: StudyView, finding: Finding, others: list[Setting]) -> str:
    """Give the same difference in the other settings, at the stop the answer leads with."""
    stop = telling_stop(finding) or 0
    where = f" {there}" if (there := at(finding, [stop])) else ""
    found = [(panel, *_difference(view, finding, panel, stop)) for panel in others]
    found = [entry for entry in found if np.isfinite(entry[1])]
    if not found:
        return ""
    if len(found) > _MOST_SETTINGS:
        means = [mean for _, mean, _, _ in found]
        reach = f"{number(min(means))} to {quantity(max(means), finding.unit)}"
        return f"Under the {len(found)} other settings the difference{where} is {reach}."
    clauses = [
        f"{quantity(mean, finding.unit)} ({number(low)} to {quantity(high, finding.unit)}) "
        f"with {_apart(panel, finding.within)}"
        for panel, mean, low, high in found
    ]
    return f"The difference{where} is {listing(clauses)}."


def _difference(
    view: StudyView, finding: Finding, panel: Setting, stop: int
) -> tuple[float, float, float]:
    """Mean and band under other settings, within what is possible."""
    found = view.band_of(panel, finding.first, finding.second)
    low, high = (
        float(np.clip(x[stop], -view.widest, view.widest)) for x in (found.low, found.high)
    )
    return float(found.mean[stop]), low, high


def _apart(panel: Setting, usual: Setting) -> str:
    """The levels of a panel that are not those of the answer."""
    other = {name: level for name, level in panel.items() if level != usual.get(name)}
    return brief(other) if TUNING in other else setting(other)


def _fixed(reading: ResultsReading, part: str) -> dict[str, Any]:
    """Keys that matter and were not varied, with their values."""
    varied = {key.name for key in keys_of(reading.study)}
    values = {
        key: get(reading.scenario_of(part), key)
        for key in reading.page.assumed
        if key not in varied
    }
    return {key: value for key, value in values.items() if isinstance(value, str)}


def _beyond(view: StudyView, finding: Finding) -> str:
    """Say at which delays no published experiment covers the simulated persons."""
    outside = view.stops_outside(view.panels[0], view.contrast)
    if not outside or view.over is None:
        return ""
    is_everywhere = len(outside) == len(view.stops)
    where = "at any level" if is_everywhere else places(finding, np.array(outside))
    return (
        f"Extrapolated: no published experiment covers the delay from picture to effect {where}, "
        "on one side or both."
    )
