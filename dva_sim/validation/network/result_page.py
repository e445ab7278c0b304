"""Result page of a comparison with real sockets: criteria, conditions and rows.

Without loss a prediction lies in its band, and a single run under loss in the model's interval;
pooled runs are scored together, and models that are too simple have to be found out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.frame import ResultSheet, Row, ValidationResult
from dva_sim.validation.frame import short_number as number
from dva_sim.validation.network.comparison import NetworkComparison
from dva_sim.validation.network.figures import draw_all
from dva_sim.validation.network.pooling import Pooled, bias_limit
from dva_sim.validation.network.prediction import depth_for
from dva_sim.validation.network.verdicts import (
    BY_NAME,
    KINDS,
    MIN_INSIDE,
    ComparedCell,
    ConditionGroup,
    ConditionKind,
    share_inside,
)

HEADS = (
    *("condition", "runs", "depth", "period [ms]", "age [ms]", "in force [ms]"),
    *("round trip [ms]", "delivered", "queue", "time-outs", "alerts", "verdict"),
)
_COLUMNS = (("age_p50", "age_p95"), ("stale_p50", "stale_p95"), ("rtt_p50", "rtt_p95"))
_ALONE = ("delivered", "queue", "timeouts", "alerts")


def table(comparison: NetworkComparison, kind: ConditionKind) -> list[list[str]]:
    """A row for each condition of a kind: measured, an arrow, predicted; and a verdict."""
    cells: dict[Condition, dict[str, ComparedCell]] = {}
    misses: dict[Condition, list[str]] = {}
    outside = comparison.outside
    for cell in comparison.cells:
        condition = cell.group.condition
        name = cell.measure.name
        cells.setdefault(condition, {})[name] = cell
        if id(cell) in outside:
            misses.setdefault(condition, []).append(name)
    return [
        _line(group, cells[group.condition], misses.get(group.condition, []))
        for group in comparison.groups
        if group.kind == kind
    ]


def _line(
    group: ConditionGroup, cells: Mapping[str, ComparedCell], misses: Sequence[str]
) -> list[str]:
    period = cells.get("applied_hz")
    shown = [_both(period, lambda rate: 1000 / rate if rate else math.inf)]
    for pair in _COLUMNS:
        shown.append(" | ".join(filter(None, (_both(cells.get(name)) for name in pair))))
    shown += [_both(cells.get(name)) for name in _ALONE]
    verdict = "passes" if not misses else f"misses {', '.join(misses)}"
    depth = depth_for(group.condition)
    return [group.condition.label, str(len(group.runs)), depth, *shown, verdict]


def _both(cell: ComparedCell | None, change: Any = lambda value: value) -> str:
    """`105 → 106`, measured and predicted; nothing where neither is defined."""
    if cell is None:
        return ""
    return f"{number(change(cell.real))} → {number(change(cell.model))}"


def rows_of(comparison: NetworkComparison) -> list[Row]:
    """A row for each measure of each condition."""
    outside = comparison.outside
    rows = [_row(v.cell, v.word, v.why, _known(v.low), _known(v.high)) for v in comparison.verdicts]
    for scored in comparison.pooled.scored:
        word = "outside" if id(scored.cell) in outside else "inside"
        rows.append(_row(scored.cell, word, z=scored.z, p=scored.p))
    return rows + [_row(cell, "shown only", "tells too little") for cell in comparison.rarely]


def _row(
    cell: ComparedCell,
    verdict: str,
    why: str = "",
    low: float | None = None,
    high: float | None = None,
    z: float | None = None,
    p: float | None = None,
) -> Row:
    group = cell.group
    return {
        "condition": group.condition.label,
        "cond_id": group.condition.hash,
        "kind": group.kind,
        "groups": " ".join(sorted({run.group for run in group.runs})),
        "source": " ".join(sorted({run.source for run in group.runs})),
        "depth": depth_for(group.condition),
        "measure": cell.measure.name,
        "unit": cell.measure.unit,
        "runs": len(cell.measured),
        "model_runs": len(cell.predicted),
        "measured": _known(cell.real),
        "predicted": _known(cell.model),
        "low": low,
        "high": high,
        "z": z,
        "p": p,
        "verdict": verdict,
        "why": why,
    }


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def variant_rows(comparison: NetworkComparison) -> list[Row]:
    """Root mean square of z of each variant, over all measures and for each."""
    return [
        {
            "left_out": name,
            "rms_z": pooled.rms,
            "expected_low": pooled.expected[0],
            "expected_high": pooled.expected[1],
            "significant": len(pooled.significant),
            "compared": len(pooled.scored),
            **{f"bias_{m}": pooled.biases.get(measure) for m, measure in BY_NAME.items()},
        }
        for name, pooled in comparison.variants.items()
    ]


NAME = "network"
FEW_SINGLES = 20
SUMMARY_HEADS = ("what", "found", "asked for", "verdict")
ABLATION_HEADS = ("left out, or instead", "RMS z", "expected", "significant")
WORST_HEADS = ("condition", "measured", "predicted", "z", "measure")
TITLES: dict[ConditionKind, str] = {
    "lossless": "Without loss, load below 0.95",
    "overload": "Overload without loss",
    "single": "Single runs under loss",
    "pooled": "Pooled runs under loss, at least six seeds each",
}
CONDITION_TEXTS: dict[ConditionKind, str] = {
    "lossless": "without loss, within the bands",
    "overload": "overload, within the bands",
    "single": "single runs under loss, within the model's 95 % intervals",
    "pooled": "pooled under loss, where runs hardly differ: within the bands",
}


READING = (
    "Measured → predicted; of times the median | the 95th percentile. The period is that of "
    "commands applied at the robot; the queue is the mean number of commands under way (Little's "
    "law). A name says pattern and rate, d delay [ms], j jitter [% of the delay], l loss [%], r "
    "rate [kbit/s, 0 without limit], p service time [ms], T time-out [ms]."
)
WORST = 12  # of the largest z that are named


def evidence(
    comparison: NetworkComparison, conditions: Mapping[str, str], causes: Mapping[str, str]
) -> ValidationResult:
    """Result of all conditions.

    Args:
        conditions: Conditions of the comparison, by name.
        causes: Known causes of misses, by the label of a condition.
    """
    criteria = _sheet("Criteria", SUMMARY_HEADS, summary(comparison))
    without = _sheet("What is left out", ABLATION_HEADS, ablation(comparison))
    by_kind = {kind: table(comparison, kind) for kind in KINDS}
    tables = [
        _sheet(f"{TITLES[kind]} (measured → predicted)", HEADS, rows, "" if number else READING)
        for number, (kind, rows) in enumerate((k, rows) for k, rows in by_kind.items() if rows)
    ]
    unjudged = _sheet("Not judged", ("why", "conditions"), left_out(comparison))
    reasons = ResultSheet(
        "Why conditions miss",
        ("condition", "misses", "cause"),
        reasons_of(comparison, causes),
        words=frozenset({0, 1, 2}),
        wraps=True,
        widths=(44, 22, None),
    )
    largest = _sheet("Largest deviations of pooled conditions", WORST_HEADS, worst(comparison))
    shown = criteria, reasons, without, *tables, unjudged, largest
    sheets = *tables, unjudged, largest, reasons, criteria, without
    kept = {NAME: rows_of(comparison)}
    if comparison.controls or comparison.ablated:
        kept["variants"] = variant_rows(comparison)
    return ValidationResult(
        name=NAME,
        headline=headline(comparison),
        passes=comparison.passes,
        notes=notes(comparison),
        conditions=conditions,
        sheets=[sheet for sheet in shown if sheet.rows],
        printed=[sheet for sheet in sheets if sheet.rows],
        draw=partial(draw_all, comparison),
        tables=kept,
    )


def _sheet(
    title: str, heads: tuple[str, ...], rows: Sequence[Sequence[str]], text: str = ""
) -> ResultSheet:
    left = frozenset({0, len(heads) - 1})
    return ResultSheet(title, heads, rows, words=left, text=text, wraps=len(heads) == 2)


def headline(comparison: NetworkComparison) -> str:
    """Headline of the result, in two sentences."""
    judged = comparison.judged
    counts = ", ".join(
        f"{sum(g.kind == kind for g in judged)} {words}"
        for kind, words in zip(
            KINDS, ("without loss", "overloaded", "single", "pooled"), strict=True
        )
    )
    verdict = "passes" if comparison.passes else "fails"
    return f"{len(judged)} conditions are judged ({counts}). The model {verdict}."


def notes(comparison: NetworkComparison) -> list[str]:
    """Notes on missing conditions and on findings."""
    found = []
    every, pooled = comparison.missing
    if every or pooled:
        found.append(
            f"Wanted beyond these: {every} more conditions, {pooled} more pooled under loss. "
            "`dva-sim validate network --measure FILE` makes them."
        )
    if comparison.pooled.scored:
        chance = 100 * comparison.pooled.false_alarms
        found.append(
            f"If the model were right, something would still be significant in {chance:.0f} % "
            "of such comparisons."
        )
    singles = sum(group.kind == "single" for group in comparison.judged)
    if 0 < singles < FEW_SINGLES:
        found.append(
            f"Of single runs under loss there are only {singles}: the measures of a run go "
            "together, so an unlucky one counts for many."
        )
    if comparison.rarely:
        found.append(
            f"{len(comparison.rarely)} measures of pooled conditions are left out: too rare, or "
            "not defined in most runs."
        )
    return found


def summary(comparison: NetworkComparison) -> list[tuple[str, str, str, str]]:
    """Each criterion: what, found, asked for, verdict."""
    rows = []
    for kind in KINDS:
        inside, judged = share_inside(comparison.of_kind(kind))
        if judged:
            least = f"{100 * MIN_INSIDE:.0f} %" if kind == "single" else "all"
            share = f"{inside} of {judged} ({100 * inside / judged:.1f} %)"
            rows.append(
                (CONDITION_TEXTS[kind], share, least, _passes(comparison.passes_bands(kind)))
            )
    if comparison.pooled.scored:
        rows += _pooled_rows(comparison.pooled)
    for name, pooled in comparison.controls.items():
        found = f"RMS z {pooled.rms:.1f}, {len(pooled.significant)} significant"
        verdict = "fooled us" if pooled.passes else "found out"
        rows.append((f"control: {name}", found, "to be found out", verdict))
    return rows


def _pooled_rows(pooled: Pooled) -> list[tuple[str, str, str, str]]:
    what = "pooled under loss, {}".format
    found = _significant(pooled)
    none = _passes(not pooled.significant)
    rms = f"{pooled.rms:.2f}"
    spread = _passes(pooled.spread_is_right)
    rows = [
        (what("significant after Holm"), found, "none", none),
        (what("root mean square of z"), rms, _expected(pooled), spread),
    ]
    if pooled.biases:
        worst = max(pooled.biases, key=lambda m: abs(pooled.biases[m]) / bias_limit(m))
        bias = f"{100 * pooled.biases[worst]:+.1f} % ({worst.words})"
        asked = f"below {100 * bias_limit(worst):.0f} %"
        rows.append((what("worst median bias"), bias, asked, _passes(not pooled.biased)))
    return rows


def ablation(comparison: NetworkComparison) -> list[tuple[str, str, str, str]]:
    """Root mean square of z with something left out, the worst first."""
    if not comparison.ablated:
        return []
    ordered = sorted(comparison.variants.items(), key=lambda item: -item[1].rms)
    return [(name, f"{p.rms:.2f}", _expected(p), _significant(p)) for name, p in ordered]


def _expected(pooled: Pooled) -> str:
    return f"{pooled.expected[0]:.2f} to {pooled.expected[1]:.2f}"


def _significant(pooled: Pooled) -> str:
    return f"{len(pooled.significant)} of {len(pooled.scored)}"


def left_out(comparison: NetworkComparison) -> list[tuple[str, str]]:
    """Reasons why conditions were not judged, with their labels."""
    reasons: dict[str, list[str]] = {}
    for group in comparison.left_out:
        reasons.setdefault(group.left_out, []).append(group.condition.label)
    return [(why, _some(labels)) for why, labels in reasons.items()]


def _some(labels: Sequence[str]) -> str:
    return f"{len(labels)} conditions" if len(labels) > 12 else ", ".join(labels)


def _passes(passes: bool) -> str:
    return "passes" if passes else "fails"


def reasons_of(
    comparison: NetworkComparison, causes: Mapping[str, str]
) -> list[tuple[str, str, str]]:
    """Each condition that misses where all have to hold: in which measures, and why."""
    singles = {id(verdict.cell) for verdict in comparison.of_kind("single")}
    misses: dict[str, list[str]] = {}
    for cell in comparison.cells:
        if id(cell) in comparison.outside - singles:
            misses.setdefault(cell.group.condition.label, []).append(cell.measure.name)
    return [
        (label, ", ".join(measures), causes.get(label, "not known"))
        for label, measures in misses.items()
    ]


def worst(comparison: NetworkComparison) -> list[list[str]]:
    """The largest z, the largest first."""
    ordered = sorted(comparison.pooled.scored, key=lambda s: -abs(s.z))[:WORST]
    cells = [(scored.cell, f"{scored.z:.1f}") for scored in ordered]
    return [
        [c.group.condition.label, number(c.real), number(c.model), z, c.measure.name]
        for c, z in cells
    ]
