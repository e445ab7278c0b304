"""Result page of the operator validation: its lines, and what remains open.

A line passes if the simulated value lies in the published band; the split says which shares of
the exact and of the held-out lines must.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from dva_sim.agents.operator.published import LineKind, TargetLine
from dva_sim.validation.frame import ResultSheet, Row, ValidationResult, short_number
from dva_sim.validation.operators.experiments import TRIED
from dva_sim.validation.operators.figures import draw_all
from dva_sim.validation.operators.trials import Cells, mean
from dva_sim.validation.operators.verdicts import LineVerdict, Tally

NAME = "operators"
HEADS = ("line", "what", "published (band)", "simulated (95 % interval)", "verdict")
OTHER = "standards"  # the exact lines that have nothing to do with operators and phones
GROUPS: tuple[tuple[str, LineKind, bool], ...] = (
    ("Operators and phones: theory, the dissertation's app (exact)", "exact", False),
    ("Operators: published experiments that no fit used (held out, not unseen)", "held-out", False),
    ("Operators: beside these, shown, never counted", "beside", False),
    ("Operators: fitted to, shown, never counted", "fitted", False),
    ("Operators: from memory, shown, never counted", "remembered", False),
    ("Fires, alarms and people on foot: standards and textbooks (exact)", "exact", True),
)
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
    verdicts: Sequence[LineVerdict],
    outcome: Tally,
    played: Mapping[str, Cells],
    conditions: Mapping[str, str],
) -> ValidationResult:
    """Result of all lines.

    Args:
        verdicts: Line by line.
        outcome: Tally of the verdicts.
        played: The trials of each experiment.
        conditions: Conditions of the runs, by name.
    """
    groups = list(grouped(verdicts))
    return ValidationResult(
        name=NAME,
        headline=headline(outcome),
        passes=outcome.passes,
        notes=notes(verdicts),
        conditions=conditions,
        sheets=[*(_sheet(title, _with_sources(own)) for title, own in groups), _steered(played)],
        printed=[
            *(_sheet(title, list(map(words, own))) for title, own in groups),
            _steered(played),
        ],
        draw=partial(draw_all, verdicts, played),
        tables={NAME: [_row(v) for v in verdicts], "steered": _shares(played)},
        rule=(100 * outcome.rule.exact, 100 * outcome.rule.held_out),
    )


def _sheet(title: str, rows: Sequence[Sequence[str]]) -> ResultSheet:
    left = frozenset({0, 1, 4})
    return ResultSheet(
        title, HEADS, rows, words=left, wraps=True, widths=(17, None, None, None, 19)
    )


def _steered(played: Mapping[str, Cells]) -> ResultSheet:
    heads = "experiment", "moved and waited, by condition"
    return ResultSheet(
        "How they steered", heads, steered(played), frozenset({0, 1}), STEERING, wraps=True
    )


def grouped(verdicts: Sequence[LineVerdict]) -> Iterator[tuple[str, list[LineVerdict]]]:
    """The verdicts under their headings."""
    for title, kind, other in GROUPS:
        own = [v for v in verdicts if v.line.kind == kind]
        own = [v for v in own if (v.line.publication == OTHER) == other]
        if own:
            yield title, own


def steered(played: Mapping[str, Cells]) -> list[tuple[str, str]]:
    """Share of time in move-and-wait, by experiment and cell."""
    found = []
    for name, cells in by_strategy(played).items():
        shares = [
            f"{100 * mean(trials, STEERED):.0f}\N{NO-BREAK SPACE}%" for trials in cells.values()
        ]
        each = ", ".join(f"{cell}: {s}" for cell, s in zip(cells, shares, strict=True))
        text = f"{name}, by {BY[name]}" if name in BY else name
        found.append((text, f"{shares[0]} everywhere" if len(set(shares)) == 1 else each))
    return found


def by_strategy(played: Mapping[str, Cells]) -> dict[str, Cells]:
    """The experiments in which something is steered."""
    return {
        name: cells
        for name, cells in played.items()
        if all(STEERED in trials.columns for trials in cells.values())
    }


def headline(outcome: Tally) -> str:
    """Headline of the result, in three sentences."""
    (exact, exact_of) = outcome.exact
    (held, held_of) = outcome.held_out
    whole, whole_of = outcome.publications
    share = f"{100 * held / held_of:.0f} %" if held_of else "none"
    found = (
        f"{exact} of {exact_of} exact lines and {held} of {held_of} held-out lines ({share}) pass; "
        f"{whole} of {whole_of} held-out publications pass in all their lines."
    )
    asked = f"all exact ones and {100 * outcome.rule.held_out:.0f} % of the held-out ones"
    return f"{found} Asked for are {asked}: {'passed' if outcome.passes else 'failed'}."


def notes(verdicts: Sequence[LineVerdict]) -> list[str]:
    """Every miss by name, and what is shown but not counted."""
    missed = [v for v in verdicts if v.word == "misses"]
    found = [
        f"{v.line.id} misses: {v.line.what}, published {published(v.line)}, "
        f"simulated {simulated(v)}."
        for v in missed
    ]
    shown = [v for v in verdicts if v.word == "shown only" and v.line.has_band]
    if shown:
        inside = sum(v.inside for v in shown)
        found.append(
            f"{len(shown)} lines are shown only, fitted to or from memory; {inside} of them lie in "
            "their band."
        )
    return found


def words(verdict: LineVerdict) -> list[str]:
    """A verdict in words: line, what, published, simulated, verdict."""
    line = verdict.line
    text: str = verdict.word
    if text == "shown only" and line.has_band:
        text += ", inside" if verdict.inside else ", outside"
    return [line.id, line.what, published(line), simulated(verdict), text]


def published(line: TargetLine) -> str:
    """The target and its band, such as `0.39 (0.19 to 0.59)`."""
    unit = f" {line.unit}" if line.unit else ""
    if not line.has_band:
        return f"{short_number(line.target)}{unit}"
    if line.low is None:
        band = f"at most {short_number(line.high)}"
    elif line.high is None:
        band = f"at least {short_number(line.low)}"
    elif line.low == line.high:
        band = short_number(line.low)
    else:
        band = f"{short_number(line.low)} to {short_number(line.high)}"
    for side, limit in (("above", line.above), ("below", line.below)):
        band += f", surely {side} {short_number(limit)}" if limit is not None else ""
    return f"{band}{unit}" if line.target is None else f"{short_number(line.target)} ({band}){unit}"


def simulated(verdict: LineVerdict) -> str:
    """The value, with its interval where something is left to chance."""
    found = verdict.found
    unit = f" {verdict.line.unit}" if verdict.line.unit else ""
    if math.isnan(found.value):
        return "nothing"
    if math.isinf(found.value):
        return "never"
    value = short_number(found.value)
    if found.persons:
        value += f" ({short_number(found.low)} to {short_number(found.high)})"
    edge = (
        ", at the edge of what was tried" if found.value in TRIED.get(verdict.line.id, ()) else ""
    )
    return value + unit + edge


def _with_sources(verdicts: Sequence[LineVerdict]) -> list[Sequence[str]]:
    """Table rows: measure and source of each check, followed by its lines."""
    rows: dict[str, list[Sequence[str]]] = {}
    for verdict in verdicts:
        line = verdict.line
        head = line.metric, f"{line.source} [{line.tag}]"
        rows.setdefault(line.check, [head]).append(words(verdict))
    return [row for own in rows.values() for row in own]


def _shares(played: Mapping[str, Cells]) -> list[Row]:
    return [
        {"experiment": name, "cell": cell, STEERED: mean(trials, STEERED)}
        for name, cells in by_strategy(played).items()
        for cell, trials in cells.items()
    ]


def _row(verdict: LineVerdict) -> Row:
    line = verdict.line
    found = verdict.found
    row: dict[str, Any] = {"line": line.id, "metric": line.metric, "what": line.what}
    row |= {"source": line.source, "publication": line.publication, "tag": line.tag}
    row |= {"kind": line.kind, "unit": line.unit, "target": line.target}
    row |= {"band_low": line.low, "band_high": line.high}
    row |= {"surely_above": line.above, "surely_below": line.below}
    row |= {"simulated": found.value, "simulated_low": found.low, "simulated_high": found.high}
    return row | {"persons": found.persons, "inside": verdict.inside, "verdict": verdict.word}
