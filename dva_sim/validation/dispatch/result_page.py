"""Result page of the dispatch validation: figures, text and the rule for passing.

A line agrees if it is within some standard errors, or a small share, of the exact value. All
must agree, and of a full run none may be too rough. The figures show how far off each check is, and
a whole distribution against theory.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.report.figures.style import Drawn, panels, styled
from dva_sim.validation.dispatch.checks import LOOK_AGAIN, Check
from dva_sim.validation.dispatch.estimation import ERRORS, PRECISION, TOLERANCE, expected_alarms
from dva_sim.validation.frame import ResultSheet, ValidationResult, captioned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_COLOURS = {"agrees": "#0072B2", "too rough": "#E69F00", "differs": "#D55E00"}
_ROW = 0.155  # [in], a line of small print
_LIMIT = 4.5  # standard errors shown; what is further off stands at the edge
_SHOWN = 0.95  # of the intervals fit in the picture of relative errors
_BEYOND = "wait_beyond/"
_LEAST_POINTS = 3


def draw_all(checks: Sequence[Check]) -> list[Drawn]:
    """Every figure there is something to draw for."""
    results = [c for c in checks if c.kind == "result"]
    drawn = []
    with styled():
        if results:
            drawn += [_deviations(results), _relative(results)]
        curves = _curves(results)
        if curves:
            drawn.append(_distributions(curves))
    return drawn


def _deviations(checks: Sequence[Check]) -> Drawn:
    """One mark per check, in standard errors."""
    figure, axes = _rows(checks)
    axes.axvspan(-ERRORS, ERRORS, color=FAINT, alpha=0.5, lw=0)
    axes.axvline(0, color=SOFT, lw=0.7)
    for verdict, colour in _COLOURS.items():
        marks = [(c.deviation, y) for y, c in enumerate(checks) if c.verdict == verdict]
        if marks:
            x, y = np.array(marks).T
            clipped = np.clip(x, -_LIMIT, _LIMIT)
            axes.plot(clipped, y, "o", color=colour, ms=4, label=verdict)
    axes.set(xlim=(-_LIMIT - 0.2, _LIMIT + 0.2), xlabel="simulated minus exact, in standard errors")
    _key(axes)
    return captioned(figure, "deviations", errors=ERRORS, tolerance=100 * TOLERANCE)


def _relative(checks: Sequence[Check]) -> Drawn:
    """Deviations as a share of the exact value, with intervals."""
    shown = [c for c in checks if c.exact != 0]
    figure, axes = _rows(shown)
    axes.axvspan(-100 * TOLERANCE, 100 * TOLERANCE, color=FAINT, alpha=0.5, lw=0)
    axes.axvline(0, color=SOFT, lw=0.7)
    for y, check in enumerate(shown):
        value = 100 * (check.found.value / check.exact - 1)
        half = 196 * check.found.error / abs(check.exact)
        colour = _COLOURS[check.verdict]
        axes.plot([value - half, value + half], [y, y], color=colour, lw=1.2)
        axes.plot([value], [y], "o", color=colour, ms=3.5)
    reach = [abs(c.found.value / c.exact - 1) + 1.96 * c.found.error / abs(c.exact) for c in shown]
    limit = 110 * float(np.quantile(reach, _SHOWN)) + 100 * TOLERANCE
    axes.set_xlim(-limit, limit)
    for verdict in dict.fromkeys(c.verdict for c in shown):
        axes.plot([], [], "o-", color=_COLOURS[verdict], ms=3.5, lw=1.2, label=verdict)
    axes.set_xlabel("simulated against exact [%]")
    _key(axes)
    return captioned(figure, "relative", tolerance=100 * TOLERANCE, wide=196 * PRECISION)


def _rows(checks: Sequence[Check]) -> tuple[Figure, Axes]:
    """Axes with a row for each check, first one on top, a line between cases."""
    figure, [[axes]] = panels(1, 1, 0.9 + _ROW * len(checks))
    labels = [_label(check, previous) for previous, check in _pairs(checks)]
    axes.set_yticks(range(len(checks)), labels, fontsize=7)
    axes.set_ylim(len(checks) - 0.3, -0.7)
    axes.grid(axis="x")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    for y, (previous, check) in enumerate(_pairs(checks)):
        if previous is not None and previous.case != check.case:
            axes.axhline(y - 0.5, color=FAINT, lw=0.6)
    return figure, axes


def _pairs(checks: Sequence[Check]) -> list[tuple[Check | None, Check]]:
    return list(zip([None, *checks[:-1]], checks, strict=True))


def _label(check: Check, previous: Check | None) -> str:
    """The case is named at its first check only."""
    first = previous is None or previous.case != check.case
    return f"{check.title}:  {check.measure}" if first else check.measure


def _key(axes: Axes) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, fontsize=8, borderpad=0)


def _curves(checks: Sequence[Check]) -> dict[str, list[Check]]:
    """Cases that compare the whole distribution of waits, with their points."""
    found: dict[str, list[Check]] = {}
    for check in checks:
        if check.measure.startswith(_BEYOND):
            found.setdefault(check.title, []).append(check)
    return {title: points for title, points in found.items() if len(points) >= _LEAST_POINTS}


def _distributions(curves: dict[str, list[Check]]) -> Drawn:
    """Share of waits beyond a time, on a logarithmic scale."""
    from matplotlib.ticker import LogLocator

    figure, rows = panels(1, len(curves), 3.0, sharey=True)
    for axes, (title, points) in zip(rows[0], curves.items(), strict=True):
        ordered = sorted(points, key=_time)
        times = [_time(point) for point in ordered]
        axes.plot(times, [p.exact for p in ordered], color=SOFT, lw=1.4, label="exact")
        low = [p.found.value - 1.96 * p.found.error for p in ordered]
        high = [p.found.value + 1.96 * p.found.error for p in ordered]
        axes.vlines(times, low, high, color=_COLOURS["agrees"], lw=1.2)
        found = [p.found.value for p in ordered]
        axes.plot(times, found, "o", color=_COLOURS["agrees"], ms=4, label="simulated")
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("")
        axes.set(title=title, xlabel="time [s]")
    rows[0][0].set_ylabel("share of events that wait longer")
    rows[0][0].legend(loc="upper right", labelcolor=INK)
    return captioned(figure, "waits")


def _time(check: Check) -> float:
    return float(check.measure.removeprefix(_BEYOND))


NAME = "dispatch"
HEADS = ("case", "measure", "exact", "simulated", "std. error", "deviation", "verdict")


def evidence(
    checks: Sequence[Check], conditions: Mapping[str, str], quick: bool
) -> ValidationResult:
    """Result of all checks.

    Args:
        checks: Line by line.
        conditions: Conditions of the runs, by name.
        quick: True if only few runs were made, which may be too rough.
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
        printed=[_sheet("", [[c.case, *words(c)] for c in notable])],
        draw=partial(draw_all, checks),
        tables={NAME: [_row(check) for check in checks]},
        rule=(ERRORS, 100 * TOLERANCE, 100 * PRECISION, LOOK_AGAIN),
    )


def _sheet(title: str, rows: Sequence[Sequence[str]]) -> ResultSheet:
    return ResultSheet(title, HEADS, rows, words=frozenset({0, 1, 6}), merged=True)


def _events(checks: Sequence[Check]) -> int:
    return sum({c.case: c.events for c in checks}.values())


def _agreeing(checks: Sequence[Check]) -> list[str]:
    """Count the checks that agree, by kind, results excepted."""
    values = {
        "input": "checks of what the scenarios put in agree",
        "identity": "identities hold (Little's law, conservation, scaling, the oracle, ...)",
    }
    found = Counter(c.kind for c in checks if c.verdict == "agrees")
    return [f"{found[kind]} {words}." for kind, words in values.items()]


def headline(checks: Sequence[Check]) -> str:
    """The outcome in a sentence."""
    differs = [c for c in checks if c.verdict == "differs"]
    cases = len({c.case for c in checks})
    if differs:
        where = ", ".join(dict.fromkeys(c.case for c in differs))
        return f"{len(differs)} of {len(checks)} checks differ, in {where}."
    return f"All {len(checks)} checks of {cases} cases agree with the exact values."


def notes(checks: Sequence[Check], quick: bool) -> list[str]:
    """Notes on the outcome: rough estimates, and expected false alarms."""
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
    found = check.found
    exact = check.exact
    off = f"{check.deviation:+.2f} SE" if found.error > 0 else "-"
    return [
        check.measure,
        f"{exact:.6g}",
        f"{found.value:.6g}",
        f"{found.error:.2g}" if found.error > 0 else "0",
        off,
        check.verdict,
    ]
