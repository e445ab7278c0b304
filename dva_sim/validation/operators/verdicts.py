"""A verdict for each published line, and what they come to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from dva_sim.agents.operator.published import LineKind, RuleConfig, TargetLine
from dva_sim.validation.operators.trials import Found

LineWord = Literal["passes", "misses", "shown only"]
COUNTED: tuple[LineKind, ...] = ("exact", "held-out")
_ROUNDING = 1e-9  # what adding up the share may cost


@dataclass(frozen=True)
class LineVerdict:
    """One line, and what was simulated.

    Attributes:
        line: Target line.
        found: Simulated value.
    """

    line: TargetLine
    found: Found

    @property
    def inside(self) -> bool:
        """True if the simulated value lies in the band, for certain where the line asks for it."""
        found = self.found
        held = not math.isnan(found.value) and self.line.holds(found.value)
        return held and self.line.is_sure(found.low, found.high)

    @property
    def word(self) -> LineWord:
        """`shown only` where the line is not counted, wherever it lies."""
        if self.line.kind not in COUNTED:
            return "shown only"
        return "passes" if self.inside else "misses"


@dataclass(frozen=True)
class Tally:
    """Tally of all verdicts.

    Attributes:
        exact: Exact lines that pass, and all of them.
        held_out: Held-out lines that pass, and all of them.
        publications: Held-out publications that pass in all their lines, and all of them.
        rule: The shares that must pass.
    """

    exact: tuple[int, int]
    held_out: tuple[int, int]
    publications: tuple[int, int]
    rule: RuleConfig

    @property
    def passes(self) -> bool:
        """True if something is counted and both shares are reached."""
        is_counted = self.exact[1] + self.held_out[1] > 0
        exact = _reaches(self.exact, self.rule.exact)
        return is_counted and exact and _reaches(self.held_out, self.rule.held_out)


def judge(lines: Sequence[TargetLine], found: Mapping[str, Found]) -> list[LineVerdict]:
    """A verdict for each line; what was not simulated is nan, and misses."""
    missing = Found(math.nan, math.nan, math.nan)
    return [LineVerdict(line, found.get(line.id, missing)) for line in lines]


def outcome_of(verdicts: Sequence[LineVerdict], rule: RuleConfig) -> Tally:
    """Tally the verdicts by the rule of the split."""
    exact = _share(verdicts, "exact")
    held_out = _share(verdicts, "held-out")
    return Tally(exact, held_out, _whole(verdicts), rule)


def _share(verdicts: Sequence[LineVerdict], kind: LineKind) -> tuple[int, int]:
    counted = [v for v in verdicts if v.line.kind == kind]
    return sum(v.word == "passes" for v in counted), len(counted)


def _whole(verdicts: Sequence[LineVerdict]) -> tuple[int, int]:
    """Held-out publications without a miss, and all."""
    counted = [v for v in verdicts if v.line.kind == "held-out"]
    missed = {v.line.publication for v in counted if v.word == "misses"}
    every = {v.line.publication for v in counted}
    return len(every) - len(missed), len(every)


def _reaches(counts: tuple[int, int], share: float) -> bool:
    passed, of = counts
    return passed >= share * of - _ROUNDING
