"""What a validation of operators leaves behind: its rows, its words and its page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dva_sim.experiments.validation.operators.judging import Outcome, Verdict
from dva_sim.experiments.validation.operators.pictures import draw_all
from dva_sim.experiments.validation.operators.targets import Kind, Line
from dva_sim.experiments.validation.operators.trials import Cells, Found
from dva_sim.experiments.validation.writing import Row, render, write_all

NAME = "operators"
HEADS = ("line", "what", "published", "simulated", "verdict")
TITLES: dict[Kind, str] = {
    "exact": "Exact: theory, the dissertation's app, standards",
    "held-out": "Held out: published experiments that nothing was fitted to",
    "fitted": "Fitted to: shown, never counted",
    "remembered": "From memory: shown, never counted",
}


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
        groups=[(TITLES[k], _blocks(verdicts, k)) for k in TITLES if _blocks(verdicts, k)],
        rule=(100 * outcome.rule.exact, 100 * outcome.rule.held_out),
    )
    return write_all(folder, {NAME: [_row(v) for v in verdicts]}, drawn, page)


def headline(outcome: Outcome) -> str:
    """What it comes to, in two sentences."""
    (exact, exact_of), (held, held_of) = outcome.exact, outcome.held_out
    share = f"{100 * held / held_of:.0f} %" if held_of else "none"
    found = (
        f"{exact} of {exact_of} exact lines and {held} of {held_of} held-out lines ({share}) pass."
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
    shown = [v for v in verdicts if v.word == "shown only"]
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
    if said == "shown only":
        said += ", inside" if verdict.inside else ", outside"
    return [line.id, line.what, published(line), simulated(verdict), said]


def published(line: Line) -> str:
    """The target and its band, such as `0.39 (0.19 to 0.59)`."""
    if line.low is None:
        band = f"at most {number(line.high)}"
    elif line.high is None:
        band = f"at least {number(line.low)}"
    elif line.low == line.high:
        band = number(line.low)
    else:
        band = f"{number(line.low)} to {number(line.high)}"
    unit = f" {line.unit}" if line.unit else ""
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
    return value + unit


def number(value: float | None) -> str:
    """Four digits that count, without an exponent."""
    return "" if value is None else f"{value:.4g}"


def _blocks(verdicts: Sequence[Verdict], kind: Kind) -> list[tuple[str, str, list[list[str]]]]:
    """Of each check of a kind: what it measured, its source, and its lines in words."""
    blocks: dict[str, tuple[str, str, list[list[str]]]] = {}
    for verdict in verdicts:
        line = verdict.line
        if line.kind == kind:
            source = f"{line.source} [{line.tag}]"
            blocks.setdefault(line.check, (line.metric, source, []))[2].append(words(verdict))
    return list(blocks.values())


def _row(verdict: Verdict) -> Row:
    line, found = verdict.line, verdict.found
    row: dict[str, Any] = {"line": line.id, "metric": line.metric, "what": line.what}
    row |= {"source": line.source, "tag": line.tag, "kind": line.kind, "unit": line.unit}
    row |= {"target": line.target, "band_low": line.low, "band_high": line.high}
    row |= _numbers(found)
    return row | {"persons": found.persons, "inside": verdict.inside, "verdict": verdict.word}


def _numbers(found: Found) -> dict[str, float]:
    return {"simulated": found.value, "simulated_low": found.low, "simulated_high": found.high}
