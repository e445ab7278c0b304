"""Outcome of a storm: its size, and the rules that broke."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from dva_sim.kernel.recorder import Breach


@dataclass
class StormOutcome:
    """Outcome of a storm: its size, and the rules that broke.

    Attributes:
        seed: Seed of the storm.
        breaches: Breaches of rules, each by one agent; empty if all were held.
        error: Traceback of an exception that ended it; empty if it went to its end.
        faults: Number of faults by kind.
        messages: Number of messages that faults have touched, by kind.
        simulated_s: Simulated time [s].
        cpu_s: Cost [CPU s].
        digest: Hash of all messages: equal storms have equal ones.
    """

    seed: int
    breaches: list[Breach] = field(default_factory=list)
    error: str = ""
    faults: Counter[str] = field(default_factory=Counter)
    messages: Counter[str] = field(default_factory=Counter)
    simulated_s: float = 0.0
    cpu_s: float = 0.0
    digest: str = ""

    @property
    def signature(self) -> frozenset[str]:
        """Signature shared by equal failures: the broken rules, or the kind of exception."""
        if self.error:
            return frozenset({self.error.strip().rpartition("\n")[2].partition(":")[0]})
        return frozenset(breach.rule for breach in self.breaches)

    @property
    def is_clean(self) -> bool:
        """Return True if no rule was broken."""
        return not self.breaches and not self.error
