"""Questions that the policy asks a person before it acts, and their deadlines."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from dva_sim.core.events import Choice, Event


@dataclass(slots=True)
class Question:
    """Proposal about an event that waits for an answer.

    Attributes:
        device: Id of the guard or robot that it would send.
        task: `confirm`, `contain` or `stand_by`.
        expected: Expected arrival of the proposed device [s].
        until: Time at which it is carried out, if nobody has decided [s].
    """

    event: Event
    device: str
    task: str
    expected: float
    until: float


@dataclass
class Questions:
    """Open questions, one for each event and stage.

    The policy's proposal may change while it waits; the time left does not.

    Attributes:
        within: Time that a question waits [s].
        asks: True if the policy asks first.
        switched: Latest change of the mode.
    """

    within: float
    asks: bool = False
    switched: Choice | None = None
    _open: dict[tuple[int, str], Question] = field(default_factory=dict)
    _now: dict[tuple[int, str], Question] = field(default_factory=dict)

    def ask(self, event: Event, task: str, device: str, eta: float, now: float) -> bool:
        """Ask a question, or ask it again; return False if nobody has answered in time."""
        key = event.number, "confirm" if task == "confirm" else "contain"
        question = self._open.get(key)
        until = now + self.within if question is None else question.until
        if now >= until:
            return False
        self._now[key] = Question(event, device, task, now + eta, until)
        return True

    def settle(self) -> list[Event]:
        """Drop questions that were not asked again; return the events whose question changed."""
        before = self._open
        self._open = self._now
        self._now = {}
        gone = [q.event for key, q in before.items() if key not in self._open]
        new = (q for key, q in self._open.items() if not _same(before.get(key), q))
        return gone + [q.event for q in new]

    def of(self, number: int) -> Question | None:
        """Return an event's question: the one about looking before the one about containing it."""
        return self._open.get((number, "confirm")) or self._open.get((number, "contain"))

    def next_deadline(self) -> float:
        """Return when the next question expires [s]."""
        return min((q.until for q in self._open.values()), default=math.inf)


def _same(old: Question | None, new: Question) -> bool:
    return old is not None and (old.device, old.task) == (new.device, new.task)
