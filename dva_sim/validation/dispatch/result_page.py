"""What a validation of dispatch found, in words: by which rule it passes, and what it leaves.

A line agrees if it is within some standard errors, or a small share, of the exact value. All
must agree, and of a full run none may be too rough.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from functools import partial
from typing import Any

from dva_sim.validation.dispatch.checks import LOOK_AGAIN, Check
from dva_sim.validation.dispatch.estimation import ERRORS, PRECISION, TOLERANCE, expected_alarms
from dva_sim.validation.dispatch.figures import draw_all
from dva_sim.validation.frame import ResultSheet, ValidationResult

NAME = "dispatch"
HEADS = ("case", "measure", "exact", "simulated", "std. error", "deviation", "verdict")


def evidence(
    checks: Sequence[Check], conditions: Mapping[str, str], quick: bool
) -> ValidationResult:
    """What all checks come to.

    Args:
        checks: Line by line.
        conditions: How they were played, by name.
        quick: Whether few runs were made, which may be too rough.
    """
    notable = [c for c in checks if c.kind == "result" or c.verdict != "agrees"]
    wrong = ("differs",) if quick else ("differs", "too rough")
    return ValidationResult(
        name=NAME,
        headline=headline(checks),
        passes=not any(check.verdict in wrong for check in checks),
        notes=[*_agreeing(checks), *notes(checks, quick)],
        conditions={**conditions, "events played": f"{_events(checks):,}"},
        sheets=[_sheet("Every check", [[c.title, *words(c)] for c in checks])],
        told=[_sheet("", [[c.case, *words(c)] for c in notable])],
        draw=partial(draw_all, checks),
        tables={NAME: [_row(check) for check in checks]},
        rule=(ERRORS, 100 * TOLERANCE, 100 * PRECISION, LOOK_AGAIN),
    )


def _sheet(title: str, rows: Sequence[Sequence[str]]) -> ResultSheet:
    return ResultSheet(title, HEADS, rows, words=frozenset({0, 1, 6}), merged=True)


def _events(checks: Sequence[Check]) -> int:
    return sum({c.case: c.events for c in checks}.values())


def _agreeing(checks: Sequence[Check]) -> list[str]:
    """How many agree of those that are not results themselves."""
    told = {
        "input": "checks of what the scenarios put in agree",
        "identity": "identities hold (Little's law, conservation, scaling, the oracle, ...)",
    }
    found = Counter(c.kind for c in checks if c.verdict == "agrees")
    return [f"{found[kind]} {words}." for kind, words in told.items()]


def headline(checks: Sequence[Check]) -> str:
    """The outcome in a sentence."""
    differs = [c for c in checks if c.verdict == "differs"]
    cases = len({c.case for c in checks})
    if differs:
        where = ", ".join(dict.fromkeys(c.case for c in differs))
        return f"{len(differs)} of {len(checks)} checks differ, in {where}."
    return f"All {len(checks)} checks of {cases} cases agree with the exact values."


def notes(checks: Sequence[Check], quick: bool) -> list[str]:
    """What belongs to the outcome: what is too rough, and what chance would do."""
    by_chance = [c for c in checks if c.found.error > 0]
    off = sum(abs(c.deviation) > ERRORS for c in by_chance)
    found = [
        f"{len(by_chance)} of the checks leave something to chance; if everything is right, up to "
        f"{expected_alarms(len(by_chance)):.1f} of them differ all the same, on average. "
        f"Here {off} lie beyond {ERRORS:g} standard errors."
    ]
    again = {c.case: c.again for c in checks if c.again}
    if again:
        shown = "; ".join(f"{case} ({why})" for case, why in again.items())
        found.append(
            f"Differed at first, so played again, {LOOK_AGAIN} times as long in all, and judged "
            f"by all runs together: {shown}."
        )
    rough = Counter(c.verdict for c in checks)["too rough"]
    if rough:
        why = "as is to be expected of a quick run" if quick else "so more runs are needed"
        found.append(
            f"{rough} checks agree, but their standard error is above "
            f"{100 * PRECISION:g} % of the exact value, {why}."
        )
    return found


def _row(check: Check) -> dict[str, Any]:
    found = asdict(check.found)
    row = {f.name: getattr(check, f.name) for f in fields(check) if f.name != "found"}
    row |= {"simulated": found["value"], "standard_error": found["error"]}
    row |= {"plain": found["plain"], "plain_standard_error": found["plain_error"]}
    row |= {"batches": found["batches"], "deviation": check.deviation}
    return row


def words(check: Check) -> list[str]:
    """A check in words: measure, exact, simulated, standard error, deviation, verdict."""
    found, exact = check.found, check.exact
    off = f"{check.deviation:+.2f} SE" if found.error > 0 else "-"
    return [
        check.measure,
        f"{exact:.6g}",
        f"{found.value:.6g}",
        f"{found.error:.2g}" if found.error > 0 else "0",
        off,
        check.verdict,
    ]
