"""Time that storms need to find a planted bug."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dva_sim.storms.drawing import draw
from dva_sim.storms.mutants import MUTANTS, planted
from dva_sim.storms.storm import play


@dataclass(frozen=True)
class Hunt:
    """Result of a hunt for a planted bug.

    Attributes:
        mutant: Its name.
        storms: Number of storms played.
        rules: Rules that were broken when it was found; none: it was not.
        acts: Number of wrong actions.
        first: Description of the first time.
    """

    mutant: str
    storms: int
    rules: tuple[str, ...]
    acts: int
    first: str

    def __str__(self) -> str:
        planted_for = MUTANTS[self.mutant].rule
        acted = f"acted {self.acts} times ({self.first[:80]})" if self.acts else "did not act"
        if self.rules:
            found = f"found in storm {self.storms} by {', '.join(self.rules)}"
        else:
            found = f"not found in {self.storms} storms"
        return f"{self.mutant} ({planted_for}): {found}; {acted}"


def table(hunts: Iterable[Hunt]) -> str:
    """Return hunts as a table in Markdown: which storm has found each bug, by which rules."""
    lines = ["| rule | mutant | found in storm | by | acted |", "|---|---|---|---|---|"]
    for each in hunts:
        found = str(each.storms) if each.rules else f"not in {each.storms}"
        rule, by = MUTANTS[each.mutant].rule, ", ".join(each.rules)
        lines.append(f"| {rule} | {each.mutant} | {found} | {by} | {each.acts} |")
    return "\n".join(lines) + "\n"


def hunt(mutant: str, seeds: Iterable[int], profile: str) -> Hunt:
    """Play storms with a planted bug until a rule breaks.

    A rule that breaks before the bug has acted does not count.

    Raises:
        RuntimeError: the program does not run with the bug, which so is none.
    """
    acts, first, count = 0, "", 0
    for count, seed in enumerate(seeds, 1):
        with planted(mutant) as bug:
            outcome = play(draw(seed, profile), enough=lambda bug=bug: bug.acts > 0)  # type: ignore[misc]
        if outcome.error and not bug.acts:
            raise RuntimeError(f"{mutant}: {outcome.error}")
        acts, first = acts + bug.acts, first or bug.first
        if bug.acts and not outcome.is_clean:
            return Hunt(mutant, count, tuple(sorted(outcome.signature)), acts, first)
    return Hunt(mutant, count, (), acts, first)
