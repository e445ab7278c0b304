"""Evidence on operators: a line for each published number, and how they steered.

A line holds if the simulated value lies in the published band; the split says which shares of the
exact lines, and of those that no fit used, must.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

from dva_sim.agents.operator.published import (
    LineKind,
    RuleConfig,
    SplitFile,
    TargetLine,
    blind_lines,
    load_history,
)
from dva_sim.validation.evidence import RULE, Evidence, share_rule
from dva_sim.validation.evidence_page import ResultSheet, ValidationResult
from dva_sim.validation.operators.experiments import TRIED
from dva_sim.validation.operators.people_figures import draw_curves
from dva_sim.validation.operators.trials import Cells, LineValue, certain, mean

STANDARDS = "standards"  # the exact lines that have nothing to do with operators and phones
GROUPS: dict[tuple[LineKind, bool], str] = {
    ("exact", False): "Operators and phones: theory, the dissertation's app (exact)",
    ("not-fitted", False): "Operators: published experiments that no fit used (but seen before)",
    ("beside", False): "Operators: beside these, shown, never counted",
    ("fitted", False): "Operators: fitted to, shown, never counted",
    ("remembered", False): "Operators: from memory, shown, never counted",
    ("exact", True): "Fires, alarms and people on foot: standards and textbooks (exact)",
}
"""Headings, in their order, by kind and by whether the line is one of `STANDARDS`."""
LINES_OF: dict[LineKind, str] = {"exact": "exact lines", "not-fitted": "lines not fitted to"}
COUNTED: tuple[LineKind, ...] = ("exact", "not-fitted")
STEERING = (
    "In which share of the time the persons of each experiment moved and waited for what they had "
    "done; the rest of it they steered in a closed loop."
)
STEERED = "move_and_wait_share"
BY = {
    "lag": "lag [ms]",
    "tilt": "gain, selection",
    "waiting": "delay [s]",
    "excavator": "delay [s]",
    "frames": "frame rate [1/s], delay [s]",
    "moving": "added lag [s], speed of the target [m/s]",
    "click": "added lag [s]",
}
"""Meanings of cell names that do not explain themselves, by experiment."""


def evidence(
    lines: Sequence[TargetLine],
    simulated: Mapping[str, LineValue],
    split: SplitFile,
    *,
    played: Mapping[str, Cells],
    conditions: Mapping[str, str],
) -> ValidationResult:
    """Return the result of all lines.

    Args:
        lines: Published numbers.
        simulated: Simulated numbers by the line's id.
        split: Roles of the publications, and earlier comparisons.
        played: Trials of each experiment.
        conditions: Conditions of the runs, by name.
    """
    verdicts = judge(lines, simulated)
    return ValidationResult(
        [
            *sorted(verdicts, key=lambda line: list(GROUPS.values()).index(line.group)),
            *rule_of(lines, verdicts, split.rule, blind_lines(lines, split, load_history())),
        ],
        conditions=conditions,
        sheets=[
            ResultSheet("How they steered", ("experiment", "share"), steered(played), STEERING)
        ],
        tables={
            "steered": [
                {"experiment": name, "cell": cell, STEERED: mean(trials, STEERED)}
                for name, cells in _steering(played).items()
                for cell, trials in cells.items()
            ]
        },
        draw=partial(draw_curves, played),
    )


def judge(lines: Sequence[TargetLine], simulated: Mapping[str, LineValue]) -> list[Evidence]:
    """Return a verdict for each line; lines that were not simulated are nan and miss."""
    return [_judged(line, simulated.get(line.id, certain(math.nan))) for line in lines]


def _judged(line: TargetLine, simulated: LineValue) -> Evidence:
    inside = line.holds(simulated.value) and line.is_sure(simulated.low, simulated.high)
    is_counted = line.kind in COUNTED
    notes = []
    if not is_counted:
        notes = (
            ["inside its band" if inside else "outside its band"] if line.has_band else ["no band"]
        )
    for side, limit in (("above", line.above), ("below", line.below)):
        notes += [f"surely {side} {limit:g}"] if limit is not None else []
    if simulated.value in TRIED.get(line.id, ()):
        notes.append("at the edge of what was tried")
    return Evidence(
        "operators",
        GROUPS[line.kind, line.publication == STANDARDS],
        line.id,
        line.what,
        source=f"{line.metric}: {line.source} [{line.tag}]",
        unit=line.unit,
        measured=line.target,
        predicted=simulated.value,
        predicted_low=simulated.low if simulated.persons else None,
        predicted_high=simulated.high if simulated.persons else None,
        low=line.low,
        high=line.high,
        sample=simulated.persons,
        verdict=("holds" if inside else "misses") if is_counted else "shown only",
        note=", ".join(notes),
    )


def rule_of(
    lines: Sequence[TargetLine],
    verdicts: Sequence[Evidence],
    rule: RuleConfig,
    blind: Mapping[str, tuple[int, int]],
) -> list[Evidence]:
    """Return the shares of lines that must hold, and those that are only shown.

    These are publications that hold in all their lines, and lines that held when nobody had seen
    them yet (`blind`: as `blind_lines` returns them).
    """
    shares: dict[LineKind, float] = {"exact": rule.exact, "not-fitted": rule.not_fitted}
    rows = []
    for kind, least in shares.items():
        own = [v for line, v in zip(lines, verdicts, strict=True) if line.kind == kind]
        if own:
            held = sum(v.verdict == "holds" for v in own)
            rows.append(share_rule("operators", LINES_OF[kind], held, len(own), least=least))
    by_publication: dict[str, list[bool]] = {}
    for line, v in zip(lines, verdicts, strict=True):
        if line.kind == "not-fitted":
            by_publication.setdefault(line.publication, []).append(v.verdict == "holds")
    if by_publication:
        whole = sum(map(all, by_publication.values()))
        rows.append(
            Evidence(
                "operators",
                RULE,
                "publications not fitted to",
                "share that holds in all lines",
                predicted=whole / len(by_publication),
                sample=len(by_publication),
                note=f"{whole} of {len(by_publication)}",
            )
        )
    if blind:
        held = sum(held for held, _ in blind.values())
        count = sum(count for _, count in blind.values())
        each = ", ".join(f"{name} {held} of {count}" for name, (held, count) in blind.items())
        rows.append(
            Evidence(
                "operators",
                RULE,
                "blind lines",
                "share that held in its first comparison, with the persons of that day",
                predicted=held / count,
                sample=count,
                note=f"{held} of {count}: {each}",
            )
        )
    return rows


def steered(played: Mapping[str, Cells]) -> list[tuple[str, str]]:
    """Return the share of time in move-and-wait, by experiment and cell."""
    rows = []
    for name, cells in _steering(played).items():
        shares = {
            cell: f"{100 * mean(trials, STEERED):.0f}\N{NO-BREAK SPACE}%"
            for cell, trials in cells.items()
        }
        text = f"{name}, by {BY[name]}" if name in BY else name
        first, *others = dict.fromkeys(shares.values())
        each = ", ".join(f"{cell}: {share}" for cell, share in shares.items())
        rows.append((text, each if others else f"{first} everywhere"))
    return rows


def _steering(played: Mapping[str, Cells]) -> dict[str, Cells]:
    """Return the experiments in which something is steered."""
    return {
        name: cells
        for name, cells in played.items()
        if all(STEERED in trials.columns for trials in cells.values())
    }
