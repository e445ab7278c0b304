"""Outcomes of runs in a few words: when all was confirmed, and how far ahead one run was."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from dva_sim.network.patterns import PATTERNS
from dva_sim.simulation.full import Playback

TIE_S = 0.05  # a shorter lead counts as none, given the resolution of times [s]


class RunVerdict(NamedTuple):
    """Outcome of a run.

    Attributes:
        time: From when on that is so [s].
        text: Text in words; empty if it is not known.
        good: True if every event was confirmed, and every false alarm refuted.
        ahead: Lead over the other of two runs [s]; infinite if the other never got there, negative
            if this one was later.
    """

    time: float
    text: str
    good: bool
    ahead: float = 0.0

    @property
    def full_text(self) -> str:
        """The outcome in words, with the lead if it has one."""
        if self.ahead == math.inf:
            return f"{self.text}, the other not at all"
        return f"{self.text}, {seconds(self.ahead)} ahead" if self.ahead > TIE_S else self.text


def verdicts(runs: Sequence[Playback]) -> list[RunVerdict]:
    """Return the outcome of each run; of two, the earlier one says by how much."""
    endings = [_verdict(run) for run in runs]
    if len(endings) != 2 or not all(verdict.text for verdict in endings):
        return endings
    times = [verdict.time if verdict.good else math.inf for verdict in endings]
    leads = _lead(*times), _lead(*reversed(times))
    return [v._replace(ahead=lead) for v, lead in zip(endings, leads, strict=True)]


def decided_at(endings: Sequence[RunVerdict]) -> float | None:
    """Return the moment that shows how runs differ: when the first had come to a good end."""
    return min((verdict.time for verdict in endings if verdict.good), default=None)


def story(runs: Sequence[Playback]) -> list[str]:
    """Describe the outcomes of runs under several patterns, one line each."""
    names = [pattern_name(run) for run in runs]
    width = max(map(len, names))
    return [
        f"{name:<{width}}  {v.full_text}" for name, v in zip(names, verdicts(runs), strict=True)
    ]


def pattern_name(run: Playback) -> str:
    """Return the messaging pattern of a run, as reports call it."""
    pattern = run.scenario.pattern
    shipped = PATTERNS.get(pattern)
    return shipped.title if shipped else pattern.rpartition(":")[2]


def seconds(time: float) -> str:
    """Return a span of time: whole seconds, but tenths of a short one."""
    return f"{time:.0f} s" if time >= 10.0 else f"{time:.1f} s"


def _lead(time: float, reference: float) -> float:
    return 0.0 if time == reference else reference - time


def _verdict(run: Playback) -> RunVerdict:
    """Return the outcome of a run by itself."""
    right = [
        ending.outcome == ("refuted" if incident.false_alarm else "confirmed")
        for incident, ending in zip(run.incidents, run.endings, strict=False)
    ]
    if not right:
        return RunVerdict(run.duration, "", False)
    good = all(right)
    last = max(ending.time for ending in run.endings)
    time = min(last, run.duration)
    if len(right) == 1:
        return RunVerdict(time, _of_one(run, good), good)
    word = "settled" if any(i.false_alarm for i in run.incidents) else "confirmed"
    if good:
        all_of = "both" if len(right) == 2 else f"all {len(right)}"
        return RunVerdict(time, f"{all_of} events {word} at {last:.1f} s", good)
    text = f"{sum(right)} of {len(right)} events {word} within {time:.0f} s"
    return RunVerdict(time, text, good)


def _of_one(run: Playback, good: bool) -> str:
    """Describe the outcome of the only event of a run."""
    ((outcome, time),) = run.endings
    if math.isinf(time):
        never = "reported" if outcome == "undetected" else "confirmed"
        return f"not {never} within {run.duration:.0f} s"
    wrong = {"confirmed": "wrongly confirmed", "refuted": "wrongly refuted"}
    what = outcome if good else wrong.get(outcome, f"not confirmed, {outcome}")
    return f"{what} at {time:.1f} s"
