"""How the numbers of a report were made, as remarks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.study.parts import POINT
from dva_sim.kernel.wording import capital, number
from dva_sim.simulation.labels import measure_called
from dva_sim.statistics import VarianceReduction, variance_reduction

_FEW = 6  # persons: with fewer nothing can be drawn anew


def remarks(reading: Reading) -> list[str]:
    """How large it was, how it was judged, and by which program."""
    own = reading.page.method(reading.pair_correlation) if reading.view else None
    said = list(_usual(reading)) if own is None else own
    return [_size(reading), *said, *_tests(reading.study), _made_by(reading)]


def _size(reading: Reading) -> str:
    """Persons and trials as they were run, and what decided how many."""
    cluster = reading.cluster
    trials = "blocks of trials" if _is_task(reading) else "trials"
    name = "Simulated persons" if cluster == "person" else "Independent shifts"
    each = "" if cluster == "shift" else f"; {trials} of each: {_trials(reading)}"
    return f"{name}: {reading.persons}{_why_so_many(reading)}{each}."


def _trials(reading: Reading) -> str:
    """How many each person made; part by part where they differ."""
    usual = reading.study.get("replications")
    parts = reading.study.get("parts", {}).items()
    counts = {name: part.get("replications") or usual for name, part in parts}
    if len(set(counts.values())) < 2:
        return str(next(iter(counts.values()), usual))
    return ", ".join(f"{count} in {name}" for name, count in counts.items())


def _why_so_many(reading: Reading) -> str:
    """What ended a study that could end early."""
    stopped = reading.manifest.get("stopped") or {}
    if reading.study.get("stop") is None and reading.study.get("budget_s") is None:
        return ""
    batches = f"after {stopped.get('rounds')} of {stopped.get('of')} batches"
    why = stopped.get("why")
    if why == "enough":
        return (
            f" (stopped {batches}: every interval asked for was narrow enough; intervals at which "
            "one stops hold their 95 % in the long run, and a little less with few persons)"
        )
    if why == "budget":
        return f" (stopped {batches}: the time by the clock was spent, so it cannot be made again)"
    return f" (all {stopped.get('of')} batches, the most that was allowed)"


def _is_task(reading: Reading) -> bool:
    return any(s.get("model") == "task" for s in reading.scenarios.values())


def _tests(study: Mapping[str, Any]) -> Iterator[str]:
    """How claims were judged, where there are any."""
    if study.get("hypotheses"):
        yield (
            "Hypotheses are judged by a one-sided test against their margin, at 5 % (bootstrap-t "
            "over persons), those of sameness by two. The test of the opposite refutes them."
        )
    if study.get("comparisons"):
        yield (
            "Comparisons are tested two-sided by permutation: a person's two sides are swapped, "
            "all trials together (all ways with up to 14 persons, else 10,000)."
        )
    if study.get("hypotheses") or study.get("comparisons"):
        yield ("All tests of a family share a chance of 5 % that any is a false alarm (Holm).")


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


def _usual(reading: Reading) -> Iterator[str]:
    study, is_task = reading.study, _is_task(reading)
    block = "block" if is_task else "trial"
    luck = "" if is_task else "start, event, "
    yield (
        f"A {block} has the same random numbers in every configuration: {luck}noise of hand and "
        f"sensor, weather of the link. Differences are taken within person and {block} (common "
        f"random numbers){_alike(reading)}."
    )
    few = (
        " With as few persons as here it is Student's alone, and Bonferroni's t for bands."
        if reading.persons < _FEW
        else ""
    )
    yield (
        f"{capital(block)}s are averaged within a person, and intervals are over persons: as far "
        "as Student's or the bootstrap-t reaches, bands by max-t over a bootstrap of persons."
        f"{few} More persons narrow them, but do not make the model truer."
    )
    if POINT in study.get("factors", {}):
        yield (
            "Every person met each point of the ranges; levels are compared at each point, and "
            "the differences averaged."
        )
    if any(part.get("reference") for part in study.get("parts", {}).values()):
        yield (
            "Where there is a reference run, its value is subtracted from every run of the same "
            "person and trial."
        )
    awaited = measure_called(reading.view.measure).awaits if reading.view else ""
    if "confirmed" in reading.runs and awaited == "confirmation":
        yield "A run that was not confirmed is kept: it counts with all the time it was given."
    yield "Nobody learns: a person's last trial is like the first."
    yield _not_modelled(is_task)


def _not_modelled(is_task: bool) -> str:
    if is_task:
        return (
            "Not modelled: fatigue, video compression, and the radio itself (the link is delay, "
            "jitter and loss). Operators are control models."
        )
    return (
        "Not modelled: fatigue, cooperation between operators, video compression, uneven floors, "
        "and the radio itself (the link is a queue with rate, delay, jitter and loss, a recorded "
        "trace, or the Wi-Fi zones of a site). Operators are control models."
    )


def _alike(reading: Reading) -> str:
    """What pairing gave, where it was seen: nothing is claimed beyond that."""
    if reading.pair_correlation is None:
        return ""
    words = f"; at the last level the two sides correlate with {number(reading.pair_correlation)}"
    found = _reduction(reading)
    if found is None or not np.isfinite(found.ratio.mean):
        return words
    ratio = found.ratio
    told = f"{number(ratio.mean)} ({number(ratio.low)} to {number(ratio.high)})"
    if found.is_lower:
        return f"{words}, so the variance of the difference is {told} of that of unpaired runs"
    return f"{words}; that pairing lowers the variance is not shown (ratio {told})"


def _reduction(reading: Reading) -> VarianceReduction | None:
    """Of the contrast at its last stop."""
    view = reading.view
    if view is None or view.contrast is None:
        return None
    grid = view.part.grid(view.measure)
    first, second = (view.curve(grid, view.panels[0], level)[-1] for level in view.contrast)
    person = np.broadcast_to(view.part.persons[:, np.newaxis], first.shape)
    return variance_reduction(first.ravel(), second.ravel(), person.ravel())
