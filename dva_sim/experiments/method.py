"""How the numbers of a report were made, as remarks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dva_sim.experiments.asking import POINT
from dva_sim.experiments.dispatch import page as dispatch_page
from dva_sim.experiments.labels import number
from dva_sim.experiments.statistics import VarianceReduction, variance_reduction
from dva_sim.experiments.summary import Reading
from dva_sim.experiments.transports import page as transport_page


def remarks(reading: Reading) -> list[str]:
    """Those of a dispatch or transport study, or the usual ones."""
    if reading.shifts is not None:
        return dispatch_page.method(reading.shifts, reading.pair_correlation)
    if reading.is_contest:
        return transport_page.method(reading.pair_correlation)
    return list(_usual(reading))


def _usual(reading: Reading) -> Iterator[str]:
    study = reading.study
    is_task = any(s.get("model") == "task" for s in reading.scenarios.values())
    block = "block" if is_task else "trial"
    luck = "" if is_task else "start, event, "
    yield (
        f"Simulated persons: {study.get('persons')}; {'blocks of trials' if is_task else 'trials'} "
        f"of each: {study.get('replications')}. A {block} meets the same luck in every cell: "
        f"{luck}noise of hand and sensor, weather of the link. Differences are taken within person "
        f"and {block} (common random numbers){_alike(reading)}."
    )
    yield (
        f"The person is the cluster: {block}s are averaged within a person first, and intervals "
        "are taken over persons. Intervals of one level reach as far as Student's or the "
        "bootstrap-t over persons does; bands cover all levels of a line at once (max-t over a "
        "bootstrap of persons). Both are Monte Carlo intervals, given the model."
    )
    if POINT in study.get("factors", {}):
        yield (
            "Each point of the ranges was played by every person; where levels are compared, they "
            "are compared at each point and averaged over all of them."
        )
    if any(part.get("reference") for part in study.get("parts", {}).values()):
        yield (
            "Where a reference is declared, every run is judged in excess of the reference run of "
            "the same person and trial: an oracle that sees the true state without delay, on the "
            "same way."
        )
    if "confirmed" in reading.runs:
        yield (
            "A run that was not confirmed counts with all the time it was given and is shown as "
            "such; it is not dropped."
        )
    yield (
        "No learning is modelled: the last trial of a person is like the first, so trials may come "
        "in any order and no treatment gains from practice."
    )
    yield _not_modelled(is_task)


def _not_modelled(is_task: bool) -> str:
    if is_task:
        return (
            "Not modelled either: fatigue of persons, artefacts of video compression, and the "
            "radio itself (the link is delay, jitter and loss). Operators are control models; no "
            "human took part."
        )
    return (
        "Not modelled either: fatigue of persons, cooperation between operators, artefacts of "
        "video compression, uneven floors, and the radio itself (the link is a queue with rate, "
        "delay, jitter and loss, a recorded trace, or what the Wi-Fi zones of the site say). "
        "Operators are control models; no human took part."
    )


def _alike(reading: Reading) -> str:
    """What pairing gave, where it was seen: nothing is claimed beyond that."""
    if reading.pair_correlation is None:
        return ""
    words = (
        f"; the two sides of the contrast correlate with {reading.pair_correlation:.2f} at the "
        "last level"
    )
    found = _reduction(reading)
    if found is None or not np.isfinite(found.ratio.mean):
        return words
    ratio = found.ratio
    told = f"{number(ratio.mean)} ({number(ratio.low)} to {number(ratio.high)})"
    if found.is_lower:
        return (
            f"{words}, so that the variance of the difference is {told} of what unpaired runs give"
        )
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
