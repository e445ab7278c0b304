"""What an answer depends on, beside its numbers: the persons, the settings, the delays.

A number can be reproducible to the last digit and still hang on what was assumed. So each of
these is told beside the answer, with what was measured of it in the same study.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.answer import Finding, telling_stop
from dva_sim.experiments.answer_places import at, places
from dva_sim.experiments.asking import STRATEGY, TUNING
from dva_sim.experiments.conditions import get
from dva_sim.experiments.effects import Floats, Setting, View, present
from dva_sim.experiments.labels import (
    brief,
    capital,
    level_name,
    listing,
    number,
    percent,
    quantity,
    setting,
)
from dva_sim.experiments.reading import keys_of
from dva_sim.experiments.robustness import Robustness
from dva_sim.experiments.statistics import band

if TYPE_CHECKING:
    from dva_sim.experiments.summary import Reading

_WAITING = "move_and_wait_share"
_MOST_SETTINGS = 3  # told one by one
# What an answer about driving depends on most, if the study does not vary it.
_FIXED = ("pattern", "phone.profile", "control", "robot.profile")


def depends(reading: Reading) -> dict[str, str]:
    """By what each sentence is about; only what can be told of this study."""
    view, finding = reading.view, reading.finding
    if view is None or finding is None:
        return {}
    told = {
        _whom(reading): _persons(reading, view, finding),
        "Settings": " ".join(_settings(reading, view, finding)),
        "Delays": _beyond(view, finding),
    }
    return {about: words for about, words in told.items() if words}


def _whom(reading: Reading) -> str:
    return f"{capital(reading.cluster)}s"


# --- persons -------------------------------------------------------------------------------


def _persons(reading: Reading, view: View, finding: Finding) -> str:
    """How many, how they steer, and what other models of them say."""
    if reading.cluster == "shift":
        return f"{finding.persons} simulated, independent of each other."
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


def _how(view: View, finding: Finding) -> str:
    """Of the strategy that chooses: how much of the time they moved and waited."""
    stop = telling_stop(finding)
    if stop is None or not view.part.has(_WAITING):
        return ""
    grid, sides = view.part.grid(_WAITING), (finding.first, finding.second)
    shares = [_mean(view.curve(grid, view.panels[0], side)[stop]) for side in sides]
    if not all(0 <= share < 1 for share in shares) or not any(shares):
        return ""
    told = [
        f"{percent(share)} of the time under {level_name(finding.factor, side)}"
        for share, side in zip(shares, sides, strict=True)
    ]
    return f", here by moving and waiting for {listing(told)}"


def _mean(values: Floats) -> float:
    seen = present(values)
    return float(seen.mean()) if len(seen) else math.nan


def _under_others(found: Robustness) -> str:
    """At the last level at which it was repeated."""
    told = [stop for stop in found.stops if stop.others]
    if not told:
        return "No repeat under another model of them is complete."
    stop, unit = told[-1], found.unit
    means = [repeat.mean for repeat in stop.others]
    sign = f"{stop.same_sign} of {len(means)}"
    return (
        f"Under other models of them the sign is the same in {sign}, and the difference at "
        f"{level_name(found.over, stop.level)} runs from {number(min(means))} to "
        f"{quantity(max(means), unit)}."
    )


# --- settings ------------------------------------------------------------------------------


def _settings(reading: Reading, view: View, finding: Finding) -> Iterator[str]:
    """The answer under the other settings that were run, and what was not varied at all."""
    stop = telling_stop(finding)
    if finding.within and stop is not None and (others := view.panels[1:]):
        yield f"The answer is for {setting(finding.within)}. {_elsewhere(view, finding, others)}"
    fixed = _fixed(reading, finding.part)
    if fixed:
        yield f"Not varied: {setting(fixed)}."


def _elsewhere(view: View, finding: Finding, others: list[Setting]) -> str:
    """The same difference, at the place of which the answer speaks first."""
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
    told = [
        f"{quantity(mean, finding.unit)} ({number(low)} to {quantity(high, finding.unit)}) "
        f"with {_apart(panel, finding.within)}"
        for panel, mean, low, high in found
    ]
    return f"The difference{where} is {listing(told)}."


def _difference(
    view: View, finding: Finding, panel: Setting, stop: int
) -> tuple[float, float, float]:
    """Mean and band under other settings, within what is possible."""
    found = band(view.difference(panel, finding.first, finding.second))
    low, high = (
        float(np.clip(x[stop], -view.widest, view.widest)) for x in (found.low, found.high)
    )
    return float(found.mean[stop]), low, high


def _apart(panel: Setting, usual: Setting) -> str:
    """The levels of a panel that are not those of the answer."""
    other = {name: level for name, level in panel.items() if level != usual.get(name)}
    return brief(other) if TUNING in other else setting(other)


def _fixed(reading: Reading, part: str) -> dict[str, Any]:
    """Keys that matter and were not varied, with their values."""
    if any(s.get("model") in ("timed", "transports") for s in reading.scenarios.values()):
        return {}
    varied = {key.name for key in keys_of(reading.study)}
    values = {key: get(reading.scenario_of(part), key) for key in _FIXED if key not in varied}
    return {key: value for key, value in values.items() if isinstance(value, str)}


# --- delays --------------------------------------------------------------------------------


def _beyond(view: View, finding: Finding) -> str:
    """Where nobody was ever watched who could tell whether the simulated persons are right."""
    outside = view.stops_outside(view.panels[0], view.contrast)
    if not outside or view.over is None:
        return ""
    is_everywhere = len(outside) == len(view.stops)
    where = "Throughout" if is_everywhere else capital(places(finding, np.array(outside)))
    return (
        f"{where}, on one side or both, no published experiment covers the delay from picture "
        "to effect: extrapolated."
    )
