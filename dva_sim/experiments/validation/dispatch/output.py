"""What a validation of dispatch leaves behind: its rows, its words and its page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from dva_sim.experiments.validation.dispatch.estimation import (
    ERRORS,
    PRECISION,
    TOLERANCE,
    expected_alarms,
)
from dva_sim.experiments.validation.dispatch.pictures import draw_all
from dva_sim.experiments.validation.dispatch.play import LOOK_AGAIN, Check
from dva_sim.experiments.validation.writing import render, write_all

NAME = "dispatch"


def write(folder: Path, checks: Sequence[Check], conditions: dict[str, str]) -> Path:
    """Write everything; the page's path.

    Args:
        folder: Made if it is not there.
        checks: What was compared.
        conditions: What the page says of how: seed, cases, quick or not.

    Raises:
        DvaSimError: the folder cannot be written.
    """
    drawn = draw_all(checks)
    page = render(
        "validation-dispatch.html.j2",
        drawn,
        headline=headline(checks),
        notes=notes(checks, conditions.get("length") == "quick"),
        fails=any(c.verdict == "differs" for c in checks),
        conditions=conditions,
        groups=_groups(checks),
        rule=(ERRORS, 100 * TOLERANCE, 100 * PRECISION, LOOK_AGAIN),
    )
    return write_all(folder, {NAME: [_row(check) for check in checks]}, drawn, page)


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


def _groups(checks: Sequence[Check]) -> list[tuple[str, list[list[str]]]]:
    """Checks case by case, as the words of a table."""
    groups: dict[str, list[list[str]]] = {}
    for check in checks:
        groups.setdefault(check.title, []).append(words(check))
    return list(groups.items())


HEADS = ("measure", "exact", "simulated", "std. error", "deviation", "verdict")


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
