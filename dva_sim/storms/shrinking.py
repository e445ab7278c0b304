"""Reduction of a storm that breaks a rule to fewer faults, fewer agents and a plainer link."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.storms.outcome import StormOutcome
from dva_sim.storms.plan import Fault, StormPlan
from dva_sim.storms.storm import play

TRIES: Final = 120
"""Maximum number of smaller storms that are tried."""
_PLAINER: Final[tuple[tuple[str, Any], ...]] = (
    ("link", {"delay_s": 0.05}),
    ("site", {"name": "caparica"}),
    ("control", "direct"),
    ("pattern", "latest-wins"),
    ("dva", {}),
)
"""Parts of a scenario, and the plainest value of each."""


class Shrinker:
    """Search for the smallest storm that fails in the same way as another.

    Args:
        plan: Storm that fails.
        outcome: Its failure.
        before: Callback with each storm before it begins.
        tries: Maximum number of storms to run.

    Attributes:
        plan: The smallest so far.
        outcome: Its outcome.
        left: Number of storms that may still be run.
    """

    def __init__(
        self,
        plan: StormPlan,
        outcome: StormOutcome,
        before: Callable[[Any], object] = lambda _: None,
        tries: int = TRIES,
    ) -> None:
        self.plan = plan
        self.outcome = outcome
        self.left = tries
        self._before = before
        self._wanted = outcome.signature

    def shrink(self) -> StormPlan:
        """Return the smallest storm that still breaks one of the same rules."""
        broken = [b.time for b in self.outcome.breaches if b.rule in self._wanted]
        before = (f for f in self.plan.faults if f.at_s <= min(broken, default=math.inf))
        self._try(self.plan.with_faults(tuple(before)))
        self._drop_faults()
        for smaller in self._simpler():
            self._try(smaller)
        self._drop_faults()
        return self.plan

    def _try(self, plan: StormPlan) -> bool:
        """Play a smaller storm; keep it if it fails in the same way."""
        if self.left <= 0 or plan == self.plan:
            return False
        self.left -= 1
        try:
            outcome = self._play(plan)
        except ConfigError:
            return False  # for example, no device is left to act
        if not outcome.signature & self._wanted:
            return False
        self.plan = plan
        self.outcome = outcome
        return True

    def _play(self, plan: StormPlan) -> StormOutcome:
        """Play a storm until one of the rules is broken."""
        storms = list[Any]()

        def begins(storm: Any) -> None:
            storms.append(storm)
            self._before(storm)

        def is_broken() -> bool:
            broken = storms[0].recorder.broken.values()
            return any(breach.rule in self._wanted for breach in broken)

        return play(plan, begins, is_broken)

    def _drop_faults(self) -> None:
        """Drop halves, then quarters, down to single faults, as long as the failure remains."""
        size = -(-len(self.plan.faults) // 2)
        while size and self.left > 0:
            if not any(self._try(self.plan.with_faults(f)) for f in _without(self.plan, size)):
                size = size // 2 if size > 1 else 0

    def _simpler(self) -> Iterator[StormPlan]:
        """Yield storms with fewer events and agents, and a plainer scenario, one step each."""
        while len(self.plan.scenario["events"]) > 1:
            before = self.plan
            for number in range(len(before.scenario["events"])):
                events = self.plan.scenario["events"]
                yield self._with("events", events[:number] + events[number + 1 :])
                if self.plan is not before:
                    break
            else:
                break
        for kind in ("robot", "guard", "operator"):
            named = [f.target for f in self.plan.faults] + [f.source for f in self.plan.faults]
            numbers = [int(n[len(kind) + 1 :]) for n in named if re.fullmatch(rf"{kind}-\d+", n)]
            for count in range(max([1, *numbers]), self.plan.scenario[kind]["count"]):
                before = self.plan
                yield self._with(kind, {**self.plan.scenario[kind], "count": count})
                if self.plan is not before:
                    break
        for count in range(self.plan.drivers):
            if count < self.plan.drivers:
                yield replace(self.plan, drivers=count)
        several = bool(self.plan.scenario.get("dva", {}).get("regions"))
        for key, plain in _PLAINER:
            if not (several and key in ("site", "dva")):  # its regions are of that site
                yield self._with(key, plain)

    def _with(self, key: str, value: Any) -> StormPlan:
        return replace(self.plan, scenario={**self.plan.scenario, key: value})


def _without(plan: StormPlan, size: int) -> Iterator[tuple[Fault, ...]]:
    """Yield the faults without `size` neighbours, for each block of them."""
    for first in range(0, len(plan.faults), size):
        yield plan.faults[:first] + plan.faults[first + size :]
