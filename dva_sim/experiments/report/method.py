"""Remarks on method: how the numbers of a report were computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.conditions import waits
from dva_sim.experiments.report.prose import paragraphs, sentence
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.study.answerable import (
    OF_STOPPING,
    coverage_in_words,
    of_few_persons,
)
from dva_sim.experiments.study.parts import POINT, multiplied
from dva_sim.simulation.full.safety_checks import CHECKED_IN_SHORT
from dva_sim.simulation.labels import level_name, measure_called, measure_name
from dva_sim.statistics import VarianceReduction, band, variance_reduction

_MIN_RESAMPLED_PERSONS = 6  # persons: with fewer nothing can be drawn again


def remarks(reading: Reading) -> list[str]:
    """Return remarks on study size, statistics and program version."""
    remark_lines = reading.page.method(reading.pair_correlation) if reading.view else None
    lines = _usual(reading) if remark_lines is None else remark_lines
    study = {"hypotheses": None, "comparisons": None} | reading.study
    tests = paragraphs("tests", study=study)
    size = [] if reading.by_people else [_size(reading)]
    versions = reading.manifest.get("versions") or {}
    return [
        *size,
        *lines,
        *tests,
        sentence(
            "made_by",
            version=versions.get("dva-sim", "of unknown version"),
            fingerprint=versions.get("fingerprint"),
            commit=versions.get("commit"),
            dirty=versions.get("dirty"),
        ),
    ]


def _size(reading: Reading) -> str:
    """Return persons and trials as they were run, and what decided how many."""
    stopped = reading.manifest.get("stopped") or {}
    stop = reading.study.get("stop") or {}
    return sentence(
        "run_size",
        cluster=reading.cluster,
        persons=reading.persons,
        is_ended=bool(stop) or reading.study.get("budget_s") is not None,
        why=stopped.get("why"),
        rounds=stopped.get("rounds"),
        of=stopped.get("of"),
        is_doubled=stop.get("batch_persons") == "double",
        level="" if reading.view is None else f"{100 * reading.view.level:.3g}",
        coverage=coverage_in_words(OF_STOPPING),
        trials="" if reading.cluster in ("shift", "repeat") else _trials(reading),
        is_task=_is_task(reading),
        few=of_few_persons(reading.persons),
    )


def _trials(reading: Reading) -> str:
    """Return trials per person; by part where they differ."""
    usual = reading.study.get("replications")
    parts = reading.study.get("parts", {}).items()
    counts = {name: part.get("replications") or usual for name, part in parts}
    if len(set(counts.values())) < 2:
        return str(next(iter(counts.values()), usual))
    return ", ".join(f"{count} in {name}" for name, count in counts.items())


def _is_task(reading: Reading) -> bool:
    return any(s.get("model") == "task" for s in reading.scenarios.values())


def _usual(reading: Reading) -> list[str]:

    study = reading.study
    is_task = _is_task(reading)
    awaited = measure_called(reading.view.measure).awaits if reading.view else ""
    return paragraphs(
        "method",
        block="block" if is_task else "trial",
        is_task=is_task,
        checked=CHECKED_IN_SHORT,
        alike=_alike(reading),
        adjusted=_adjusted(reading),
        is_small=reading.persons < _MIN_RESAMPLED_PERSONS,
        has_points=POINT in study.get("factors", {}),
        has_reference=any(part.get("reference") for part in study.get("parts", {}).values()),
        awaits_confirmation="confirmed" in reading.runs and awaited == "confirmation",
    )


def _adjusted(reading: Reading) -> str:
    """Describe the covariates of the answer, and their gain at the last level."""
    view = reading.view
    if view is None or view.contrast is None or not view.covariates:
        return ""
    plain = replace(view, covariates=())
    ours, theirs = (
        band(each.difference(each.panels[0], *view.contrast)[:, -1:]) for each in (view, plain)
    )
    ratio = float((ours.high - ours.low)[0] / (theirs.high - theirs.low)[0])
    names = [" times ".join(_words(name)) for name in view.covariates]
    is_same = not np.isfinite(ratio) or np.array_equal(ours.mean, theirs.mean, equal_nan=True)
    return sentence("adjusted", names=names, ratio=None if is_same else ratio)


def _words(covariate: str) -> list[str]:
    return [measure_name(name) for name in multiplied(covariate)]


def _alike(reading: Reading) -> str:
    """Report the observed gain from pairing."""
    if reading.pair_correlation is None:
        return ""
    reduction = _reduction(reading)
    is_known = reduction is not None and np.isfinite(reduction.ratio.mean)
    return sentence(
        "alike",
        correlation=reading.pair_correlation,
        ratio=reduction.ratio if reduction is not None and is_known else None,
        is_lower=reduction is not None and reduction.is_lower,
    )


def _reduction(reading: Reading) -> VarianceReduction | None:
    """Return the variance reduction of the contrast at its last stop."""
    view = reading.view
    sides = reading.last_sides
    if view is None or sides is None:
        return None
    first, second = sides
    return variance_reduction(first.ravel(), second.ravel(), view.part.person)


def timeout_remark(scenarios: Mapping[str, Mapping[str, Any]], study: Mapping[str, Any]) -> str:
    """Say in which conditions a repeated request has no time for its reply; see `waits`."""
    found_waits = waits(scenarios, study)
    if not found_waits:
        return ""
    trips: dict[str, list[str]] = {}
    for timeout, trip in sorted({(w.timeout, w.round_trip) for w in found_waits if w.is_short}):
        where = trips.setdefault(level_name("command.timeout_s", timeout), [])
        where.append(level_name("link.delay_s", trip))
    return sentence(
        "time_out",
        short=[f"{timeout} with round trips of {', '.join(at)}" for timeout, at in trips.items()],
        needed=level_name("command.timeout_s", max(w.needed for w in found_waits)),
        is_all=all(w.is_short for w in found_waits),
    )
