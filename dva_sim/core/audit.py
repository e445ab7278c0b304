"""Facts for recorders: the DVA hands out each fact once, and bases no decision on them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from dva_sim.protocol.facts import Fact

MAX_KEPT = 10_000  # maximum facts that nobody has taken yet; older ones are dropped and counted


@dataclass
class AuditTrail:
    """The facts that nobody has taken yet, oldest first.

    Attributes:
        keeps: True to keep facts at all.
        lost: Number of facts dropped because nobody took them in time.
    """

    keeps: bool = True
    lost: int = 0
    _facts: deque[Fact] = field(default_factory=lambda: deque(maxlen=MAX_KEPT))

    def note(self, fact: Fact) -> None:
        """Note a decision."""
        self.lost += len(self._facts) == MAX_KEPT
        self._facts.append(fact)

    def take(self) -> list[Fact]:
        """Return the decisions since the last call."""
        facts = list(self._facts)
        self._facts.clear()
        return facts
