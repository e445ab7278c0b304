"""Outcomes of all events of a study in one line; a mean over runs can hide a missed event."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.wording import listing

_SEEN = "confirmed", "contained"
_LEFT = {
    "escalated": "escalated",
    "expired": "expired",
    "open": "still open at the end",
    "undetected": "never detected",
}


class EventOutcomes(NamedTuple):
    """Counts of events by outcome.

    Attributes:
        real: Events that were no false alarms.
        confirmed: Real ones that were confirmed.
        missed: Real ones that were refuted, by kind and by who looked.
        left: Other real ones, by what became of them.
        false_alarms: Number of false alarms.
        believed: False alarms that were confirmed.
    """

    real: int
    confirmed: int
    missed: Counter[tuple[str, str]]
    left: Counter[str]
    false_alarms: int
    believed: int

    @property
    def warns(self) -> bool:
        """Return True if an event was missed or a false alarm was taken for real."""
        return bool(self.missed or self.believed)

    def __str__(self) -> str:
        """`Events: 288, of which 263 were confirmed, 23 missed (real but refuted: ...)`."""
        if self.real == self.confirmed:
            text = f"Events: {self._all_of(self.real)} confirmed"
        else:
            text = f"Events: {self.real}, of which {self.confirmed} were confirmed"
            if number := self.missed.total():
                ways = listing([_looked(*who, n) for who, n in self.missed.most_common()])
                text += f", {number} missed (real but refuted: {ways})"
            for outcome, n in self.left.most_common():
                text += f", {n} {_LEFT.get(outcome, outcome)}"
        if self.false_alarms:
            text += f"; of {self.false_alarms} false alarms {self.believed} were taken for real"
        return f"{text}."

    @staticmethod
    def _all_of(number: int) -> str:
        return {1: "the only one was", 2: "both were"}.get(number, f"all {number} were")


def _looked(kind: str, who: str, number: int) -> str:
    if number == 1:
        return f"1 {kind.replace('_', ' ')} inspected by a {who}"
    return f"{number} {kind.replace('_', ' ')}s inspected by {who}s"


def outcomes_of(events: Mapping[str, NDArray[Any]]) -> EventOutcomes | None:
    """Count the events of a table by outcome; None if it has no events or no outcomes."""
    if "outcome" not in events or "is_true" not in events or not len(events["outcome"]):
        return None
    real = np.asarray(events["is_true"]) == True  # noqa: E712  (True, False or missing)
    outcome = np.asarray(events["outcome"])
    seen = np.isin(outcome, _SEEN)
    missed = real & (outcome == "refuted")
    kinds, whose = np.asarray(events["kind"]), np.asarray(events["responder_kind"])
    return EventOutcomes(
        real=int(real.sum()),
        confirmed=int((real & seen).sum()),
        missed=Counter(zip(map(str, kinds[missed]), map(str, whose[missed]), strict=True)),
        left=Counter(map(str, outcome[real & ~seen & ~missed])),
        false_alarms=int((~real).sum()),
        believed=int((~real & seen).sum()),
    )
