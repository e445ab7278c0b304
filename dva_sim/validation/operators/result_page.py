"""What a validation of operators leaves behind: its rows, its words and its page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from dva_sim.agents.operator.published import Kind, Line
from dva_sim.validation.frame import Row, render, write_all
from dva_sim.validation.operators.experiments import TRIED
from dva_sim.validation.operators.figures import draw_all
from dva_sim.validation.operators.judging import Cells, Found, Outcome, Verdict, mean

NAME = "operators"
HEADS = ("line", "what", "published", "simulated", "verdict")
OTHER = "standards"  # the exact lines that have nothing to do with operators and phones
GROUPS: tuple[tuple[str, Kind, bool], ...] = (
    ("Operators and phones: theory, the dissertation's app (exact)", "exact", False),
    ("Operators: published experiments that nothing was fitted to (held out)", "held-out", False),
    ("Operators: beside these, shown, never counted", "beside", False),
    ("Operators: fitted to, shown, never counted", "fitted", False),
    ("Operators: from memory, shown, never counted", "remembered", False),
    ("Fires, alarms and people on foot: standards and textbooks (exact)", "exact", True),
)
STEERED = "move_and_wait_share"
BY = {
    "lag": "lag [ms]",
    "tilt": "gain, selection",
    "waiting": "delay [s]",
    "excavator": "delay [s]",
    "frames": "frame rate [1/s], delay [s]",
}
"""What the names of the cells of an experiment mean, where they do not say it."""


def write(
    folder: Path,
    verdicts: Sequence[Verdict],
    outcome: Outcome,
    played: Mapping[str, Cells],
    conditions: Mapping[str, str],
) -> Path:
    """Write everything; the page's path.

    Args:
        folder: Made if it is not there.
        verdicts: Line by line.
        outcome: What they come to.
        played: The trials of each experiment, for the figures.
        conditions: What the page says of how.

    Raises:
        DvaSimError: the folder cannot be written.
    """
    drawn = draw_all(verdicts, played)
    page = render(
        "validation-operators.html.j2",
        drawn,
        headline=headline(outcome),
        notes=notes(verdicts),
        fails=not outcome.passes,
        conditions=conditions,
        groups=[(title, _blocks(own)) for title, own in grouped(verdicts)],
        steered=steered(played),
        rule=(100 * outcome.rule.exact, 100 * outcome.rule.held_out),
    )
    tables = {NAME: [_row(v) for v in verdicts], "steered": _shares(played)}
    return write_all(folder, tables, drawn, page)


def grouped(verdicts: Sequence[Verdict]) -> Iterator[tuple[str, list[Verdict]]]:
    """The verdicts under their headings."""
    for title, kind, other in GROUPS:
        own = [v for v in verdicts if v.line.kind == kind]
        own = [v for v in own if (v.line.publication == OTHER) == other]
        if own:
            yield title, own


def steered(played: Mapping[str, Cells]) -> list[tuple[str, str]]:
    """Of each experiment and its cells, in which share of the time they moved and waited."""
    found = []
    for name, cells in played.items():
        shares = [
            f"{100 * mean(trials, STEERED):.0f}\N{NO-BREAK SPACE}%" for trials in cells.values()
        ]
        each = ", ".join(f"{cell}: {s}" for cell, s in zip(cells, shares, strict=True))
        told = f"{name}, by {BY[name]}" if name in BY else name
        found.append((told, f"{shares[0]} everywhere" if len(set(shares)) == 1 else each))
    return found


def headline(outcome: Outcome) -> str:
    """What it comes to, in three sentences."""
    (exact, exact_of), (held, held_of) = outcome.exact, outcome.held_out
    whole, whole_of = outcome.publications
    share = f"{100 * held / held_of:.0f} %" if held_of else "none"
    found = (
        f"{exact} of {exact_of} exact lines and {held} of {held_of} held-out lines ({share}) pass; "
        f"{whole} of {whole_of} held-out publications pass in all their lines."
    )
    asked = f"all exact ones and {100 * outcome.rule.held_out:.0f} % of the held-out ones"
    return f"{found} Asked for are {asked}: {'passed' if outcome.passes else 'failed'}."


def notes(verdicts: Sequence[Verdict]) -> list[str]:
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


def words(verdict: Verdict) -> list[str]:
    """A verdict in words: line, what, published, simulated, verdict."""
    line = verdict.line
    said: str = verdict.word
    if said == "shown only" and line.has_band:
        said += ", inside" if verdict.inside else ", outside"
    return [line.id, line.what, published(line), simulated(verdict), said]


def published(line: Line) -> str:
    """The target and its band, such as `0.39 (0.19 to 0.59)`."""
    unit = f" {line.unit}" if line.unit else ""
    if not line.has_band:
        return f"{number(line.target)}{unit}"
    if line.low is None:
        band = f"at most {number(line.high)}"
    elif line.high is None:
        band = f"at least {number(line.low)}"
    elif line.low == line.high:
        band = number(line.low)
    else:
        band = f"{number(line.low)} to {number(line.high)}"
    for side, limit in (("above", line.above), ("below", line.below)):
        band += f", surely {side} {number(limit)}" if limit is not None else ""
    return f"{band}{unit}" if line.target is None else f"{number(line.target)} ({band}){unit}"


def simulated(verdict: Verdict) -> str:
    """The value, with its interval where something is left to chance."""
    found, unit = verdict.found, f" {verdict.line.unit}" if verdict.line.unit else ""
    if math.isnan(found.value):
        return "nothing"
    if math.isinf(found.value):
        return "never"
    value = number(found.value)
    if found.persons:
        value += f" ({number(found.low)} to {number(found.high)})"
    edge = (
        ", at the edge of what was tried" if found.value in TRIED.get(verdict.line.id, ()) else ""
    )
    return value + unit + edge


def number(value: float | None) -> str:
    """Four digits that count, without an exponent."""
    return "" if value is None else f"{value:.4g}"


def _blocks(verdicts: Sequence[Verdict]) -> list[tuple[str, str, list[list[str]]]]:
    """Of each check: what it measured, its source, and its lines in words."""
    blocks: dict[str, tuple[str, str, list[list[str]]]] = {}
    for verdict in verdicts:
        line = verdict.line
        source = f"{line.source} [{line.tag}]"
        blocks.setdefault(line.check, (line.metric, source, []))[2].append(words(verdict))
    return list(blocks.values())


def _shares(played: Mapping[str, Cells]) -> list[Row]:
    return [
        {"experiment": name, "cell": cell, STEERED: mean(trials, STEERED)}
        for name, cells in played.items()
        for cell, trials in cells.items()
    ]


def _row(verdict: Verdict) -> Row:
    line, found = verdict.line, verdict.found
    row: dict[str, Any] = {"line": line.id, "metric": line.metric, "what": line.what}
    row |= {"source": line.source, "publication": line.publication, "tag": line.tag}
    row |= {"kind": line.kind, "unit": line.unit, "target": line.target}
    row |= {"band_low": line.low, "band_high": line.high}
    row |= {"surely_above": line.above, "surely_below": line.below}
    row |= _numbers(found)
    return row | {"persons": found.persons, "inside": verdict.inside, "verdict": verdict.word}


def _numbers(found: Found) -> dict[str, float]:
    return {"simulated": found.value, "simulated_low": found.low, "simulated_high": found.high}
