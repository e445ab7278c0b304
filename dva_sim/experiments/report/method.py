"""Remarks on method: how the numbers of a report were computed."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from dva_sim.experiments.report.prose import paragraphs
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.study import coverage
from dva_sim.experiments.study.parts import POINT, multiplied
from dva_sim.kernel.wording import capital, listing, number
from dva_sim.simulation.full.safety_checks import CHECKED_IN_SHORT
from dva_sim.simulation.labels import measure_called, measure_name
from dva_sim.statistics import VarianceReduction, band, variance_reduction

_FEW = 6  # persons: with fewer nothing can be drawn again


def remarks(reading: Reading) -> list[str]:
    """Remarks on study size, statistics and program version."""
    own = reading.page.method(reading.pair_correlation) if reading.view else None
    lines = _usual(reading) if own is None else own
    study = {"hypotheses": None, "comparisons": None} | reading.study
    tests = paragraphs("tests", study=study)
    size = [] if reading.by_people else [_size(reading)]
    return [*size, *lines, *tests, _made_by(reading)]


_SAMPLES: Final = {"shift": "Independent shifts", "repeat": "Repeats of each configuration"}


def _size(reading: Reading) -> str:
    """Persons and trials as they were run, and what decided how many."""
    cluster = reading.cluster
    trials = "blocks of trials" if _is_task(reading) else "trials"
    name = _SAMPLES.get(cluster, "Simulated persons")
    each = "" if cluster in _SAMPLES else f"; {trials} of each: {_trials(reading)}"
    few = coverage.of_few_persons(reading.persons)
    told = f" {capital(few)}." if few else ""
    return f"{name}: {reading.persons}{_why_so_many(reading)}{each}.{told}"


def _trials(reading: Reading) -> str:
    """Trials per person; by part where they differ."""
    usual = reading.study.get("replications")
    parts = reading.study.get("parts", {}).items()
    counts = {name: part.get("replications") or usual for name, part in parts}
    if len(set(counts.values())) < 2:
        return str(next(iter(counts.values()), usual))
    return ", ".join(f"{count} in {name}" for name, count in counts.items())


def _why_so_many(reading: Reading) -> str:
    """Say why a study with a stopping rule or a budget ended."""
    stopped = reading.manifest.get("stopped") or {}
    if reading.study.get("stop") is None and reading.study.get("budget_s") is None:
        return ""
    batches = f"after {stopped.get('rounds')} of {stopped.get('of')} batches"
    why, stop = stopped.get("why"), reading.study.get("stop") or {}
    if why == "enough" and stop.get("batch_persons") == "double":
        level = "" if reading.view is None else f" at {100 * reading.view.level:.3g} %"
        return (
            f" (stopped {batches}: every interval asked for was narrow enough; each look has "
            f"intervals{level}, so that 95 % hold whichever look ends the study)"
        )
    if why == "enough":
        return (
            f" (stopped {batches}: every interval asked for was narrow enough; a 95 % interval "
            f"that ends a study by its width holds {coverage.in_words(coverage.OF_STOPPING)})"
        )
    if why == "budget":
        return f" (stopped {batches}: the time limit was reached, so it cannot be reproduced)"
    asked = "; not every interval became as narrow as was asked" if why == "limit" else ""
    return f" (all {stopped.get('of')} batches, the most that was allowed{asked})"


def _is_task(reading: Reading) -> bool:
    return any(s.get("model") == "task" for s in reading.scenarios.values())


def _made_by(reading: Reading) -> str:
    """The program, and whether it can be had again."""
    versions = reading.manifest.get("versions") or {}
    program = f"Made with dva-sim {versions.get('dva-sim', 'of unknown version')}"
    if fingerprint := versions.get("fingerprint"):
        program += f", simulating code {fingerprint}"
    commit = versions.get("commit")
    if not commit:
        return f"{program}; its commit is not known: it did not run from a checkout."
    state = " with changes that are not committed" if versions.get("dirty") else ""
    return f"{program}, commit {commit[:12]}{state}."


def _usual(reading: Reading) -> list[str]:

    study, is_task = reading.study, _is_task(reading)
    awaited = measure_called(reading.view.measure).awaits if reading.view else ""
    return paragraphs(
        "method",
        block="block" if is_task else "trial",
        is_task=is_task,
        checked=CHECKED_IN_SHORT,
        alike=_alike(reading),
        adjusted=_adjusted(reading),
        is_small=reading.persons < _FEW,
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
    names = listing([" times ".join(_words(name)) for name in view.covariates])
    if not np.isfinite(ratio) or np.array_equal(ours.mean, theirs.mean, equal_nan=True):
        return f"{names}, but for too few persons"
    return f"{names}; at the last level its interval is {number(ratio)} times as long as without"


def _words(covariate: str) -> list[str]:
    return [measure_name(name) for name in multiplied(covariate)]


def _alike(reading: Reading) -> str:
    """Report the observed gain from pairing."""
    if reading.pair_correlation is None:
        return ""
    words = f"; at the last level the two sides correlate with {number(reading.pair_correlation)}"
    found = _reduction(reading)
    if found is None or not np.isfinite(found.ratio.mean):
        return words
    ratio = found.ratio
    text = f"{number(ratio.mean)} ({number(ratio.low)} to {number(ratio.high)})"
    if found.is_lower:
        return f"{words}, so the variance of the difference is {text} of that of unpaired runs"
    return f"{words}; that pairing lowers the variance is not shown (ratio {text})"


def _reduction(reading: Reading) -> VarianceReduction | None:
    """Variance reduction of the contrast at its last stop."""
    view, sides = reading.view, reading.last_sides
    if view is None or sides is None:
        return None
    first, second = sides
    person = np.broadcast_to(view.part.persons[:, np.newaxis], first.shape)
    return variance_reduction(first.ravel(), second.ravel(), person.ravel())
