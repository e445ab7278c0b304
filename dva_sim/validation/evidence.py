"""One table of evidence: values known independently of the simulation, and predictions of a model.

Each subject of a validation fills the same columns: dispatch is compared with theory, operators
with people, the network with real sockets, and middleware with real programs. The overall criteria
of a subject are lines of their own, in the group `RULE`.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, get_args

from dva_sim.kernel.errors import ConfigError

Subject = Literal["dispatch", "operators", "network", "middleware"]
Verdict = Literal["holds", "misses", "too rough", "shown only"]

SUBJECTS: Final[tuple[Subject, ...]] = get_args(Subject)
RULE: Final = "Rule"
HEADS: Final = ("line", "claim", "measured", "predicted", "band", "verdict")
NORMAL_95: Final = 1.96  # standard errors of half a 95 % interval
MAX_NAMED: Final = 20  # lines that miss, in a head; more would hide whether the rule holds


@dataclass(frozen=True)
class Evidence:
    """One prediction of a model, and the known value.

    Attributes:
        subject: Part of the simulation that makes the claim.
        group: Heading that the line stands under.
        line: Name of the line; conditions of the network that differ by their duration alone share
            theirs.
        claim: Quantity that is compared.
        source: Source of the value from outside.
        unit: Unit of all numbers; empty for a plain number.
        measured: Value from outside: measured, published, or exact by theory; None if only a
            band is known.
        predicted: Value of the model; None if it makes no prediction.
        predicted_low: Lower end of the 95 % interval of the prediction; None without chance.
        predicted_high: Upper end of that interval.
        low: Lower end of the band; None for no end.
        high: Upper end of the band; None for no end.
        holds_measured: True if the band surrounds the prediction and has to hold the measured
            value; False if it has to hold the prediction.
        sample: Number of events, persons or runs that the line rests on.
        verdict: Verdict; a line that is shown only is not counted.
        note: Reason for the verdict, and further facts.
    """

    subject: Subject
    group: str
    line: str
    claim: str
    source: str = ""
    unit: str = ""
    measured: float | None = None
    predicted: float | None = None
    predicted_low: float | None = None
    predicted_high: float | None = None
    low: float | None = None
    high: float | None = None
    holds_measured: bool = False
    sample: int = 0
    verdict: Verdict = "shown only"
    note: str = ""

    @property
    def words(self) -> tuple[str, ...]:
        """The line in words, a cell for each of `HEADS`."""
        predicted = short_number(self.predicted)
        if self.predicted_low is not None:
            predicted += f" ({_range(self.predicted_low, self.predicted_high)})"
        claim = f"{self.claim} [{self.unit}]" if self.unit else self.claim
        band = _range(self.low, self.high)
        verdict = f"{self.verdict}: {self.note}" if self.note else self.verdict
        return self.line, claim, short_number(self.measured), predicted, band, verdict


def short_number(value: float | None) -> str:
    """Return a value with four significant digits and no exponent; a dash without a value."""
    if value is None or value != value:
        return "–"
    if abs(value) == float("inf"):
        return "∞"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def _range(low: float | None, high: float | None) -> str:
    """Return a band in words, which may have one end or none."""
    if low is None or high is None:
        end = short_number(high if low is None else low)
        return end if low is high else f"at {'most' if low is None else 'least'} {end}"
    ends = dict.fromkeys((short_number(low), short_number(high)))
    return " to ".join(ends)


def of_rule(lines: Iterable[Evidence]) -> list[Evidence]:
    """Return the lines that decide whether a subject passes."""
    return [line for line in lines if line.group == RULE]


def judged(lines: Iterable[Evidence]) -> list[Evidence]:
    """Return the claims that have a verdict."""
    return [line for line in lines if line.group != RULE and line.verdict != "shown only"]


def passes(lines: Iterable[Evidence]) -> bool:
    """Return True if a rule is applied, and holds in each of its lines."""
    rule = of_rule(lines)
    return bool(rule) and all(line.verdict != "misses" for line in rule)


def share_rule(
    subject: Subject, line: str, held: int, of: int, *, least: float = 1.0, note: str = ""
) -> Evidence:
    """Require a share of some lines.

    Args:
        line: Name of the lines.
        held: Number of lines that hold.
        of: Number of lines that are judged.
        least: Share that has to hold.
        note: Further note.
    """
    holds = held >= least * of - 1e-9  # rounding of the product
    return Evidence(
        subject,
        RULE,
        line,
        "share that holds",
        predicted=held / of,
        low=least,
        sample=of,
        verdict="holds" if holds else "misses",
        note=", ".join(filter(None, (f"{held} of {of}", note))),
    )


def headline(lines: Sequence[Evidence]) -> str:
    """Return the present state of a subject.

    How many lines hold, which do not, and whether its rule holds.
    """
    misses = names_of_misses(lines)
    missed = ""
    if sum(line.verdict == "misses" for line in judged(lines)) > MAX_NAMED:
        missed = f"; those that do not, of {len(misses)} conditions, are in the tables"
    elif misses:
        missed = f"; these do not: {'; '.join(misses)}"
    return f"{describe_count(lines)}{missed}. {state_of_rule(lines)}"


def describe_count(lines: Iterable[Evidence]) -> str:
    """Return the number of lines that hold, and the number of lines with a verdict."""
    verdicts = [line.verdict for line in judged(lines)]
    rough = verdicts.count("too rough")
    more = f", {rough} are too rough to say" if rough else ""
    return f"{verdicts.count('holds')} of {len(verdicts)} lines hold{more}"


def names_of_misses(lines: Iterable[Evidence]) -> list[str]:
    """Return the names of all lines that miss, with the measures of a condition together."""
    names: dict[str, list[str]] = {}
    for line in judged(lines):
        if line.verdict == "misses":
            condition, _, measure = line.line.rpartition(" ")
            names.setdefault(condition, []).append(measure)
    return [f"{key} {', '.join(own)}".strip() for key, own in names.items()]


def state_of_rule(lines: Iterable[Evidence]) -> str:
    """Say whether the rule holds; if not, also its values and limits."""
    rule = of_rule(lines)
    misses = [line for line in rule if line.verdict == "misses"]
    if misses:
        return f"The rule fails in: {'; '.join(map(_shortfall, misses))}."
    return "The rule holds." if rule else "No rule was applied, which fails."


def _shortfall(line: Evidence) -> str:
    remark = f", {line.note}" if line.note else ""
    target = _range(line.low, line.high)
    return f"{line.line} ({short_number(line.predicted)}{remark}; asked for: {target})"


def read_evidence(path: Path) -> list[Evidence]:
    """Return the lines of a table that was written.

    Raises:
        ConfigError: it cannot be read, or is another table.
    """
    from pydantic import TypeAdapter  # late: start-up

    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [
                {key: text for key, text in row.items() if text} for row in csv.DictReader(file)
            ]
        return TypeAdapter(list[Evidence]).validate_python(rows)
    except (OSError, ValueError, csv.Error) as error:
        raise ConfigError(f"cannot be read as a table of evidence: {error}", path) from None
