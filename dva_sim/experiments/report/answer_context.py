"""Facts that an answer depends on: other settings that were run, and models of the persons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dva_sim.experiments.analysis.answer import Finding, OtherRuns
from dva_sim.experiments.analysis.answer_sentences import telling_stop
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.robustness import RepeatedAnswer
from dva_sim.experiments.analysis.study_view import StudyView, keys_of
from dva_sim.experiments.report.results_reading import ResultsReading
from dva_sim.experiments.study.parts import STRATEGY
from dva_sim.simulation.labels import level_name


def in_context(reading: ResultsReading) -> Finding | None:
    """The finding with the range over other settings and over models of the persons."""
    view, finding = reading.view, reading.finding
    if view is None or finding is None or (stop := telling_stop(finding)) is None:
        return finding
    return replace(
        finding,
        models=_models(reading.robustness, finding, stop),
        elsewhere=_elsewhere(view, finding, stop),
        only_model=only_model(reading, finding.part),
    )


def only_model(reading: ResultsReading, part: str) -> str:
    """`strategy adaptive`, if the persons of a part steer by one strategy and no other was run."""
    strategy = get(reading.scenario_of(part), STRATEGY)
    if not strategy or reading.cluster != "person" or reading.robustness is not None:
        return ""
    if STRATEGY in {key.name for key in keys_of(reading.study)}:
        return ""
    return f"strategy {level_name(STRATEGY, strategy)}"


def _models(found: RepeatedAnswer | None, finding: Finding, at: int) -> OtherRuns | None:
    """The difference under other models of the persons, if it was repeated at this stop."""
    stops = found.stops if found is not None else ()
    others = [r for s in stops if s.level == finding.levels[at] for r in s.others]
    return _together(finding.mean[at], [(r.mean, r.low, r.high) for r in others])


def _elsewhere(view: StudyView, finding: Finding, at: int) -> OtherRuns | None:
    """The difference in the other settings that were run."""
    bands = [view.band_of(p, finding.first, finding.second) for p in view.panels[1:]]
    found = [(float(b.mean[at]), float(b.low[at]), float(b.high[at])) for b in bands]
    return _together(finding.mean[at], [each for each in found if np.isfinite(each[0])])


def _together(own: float, found: list[tuple[float, float, float]]) -> OtherRuns | None:
    """The range of means, each with its interval; None without any."""
    if not found:
        return None
    means = [mean for mean, _, _ in found]
    turns = any(high < 0 if own > 0 else low > 0 for _, low, high in found)
    return OtherRuns(min(means), max(means), len(found), turns)
