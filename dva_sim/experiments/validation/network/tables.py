"""The comparison in rows: one for each condition to be read, one for each measure to be kept."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from dva_sim.experiments.validation.network.comparing import Comparison
from dva_sim.experiments.validation.network.judging import Verdict
from dva_sim.experiments.validation.network.kinds import Group, Kind
from dva_sim.experiments.validation.network.pooling import Scored
from dva_sim.experiments.validation.network.predict import depth_for
from dva_sim.experiments.validation.network.samples import BY_NAME, Cell
from dva_sim.experiments.validation.writing import Row
from dva_sim.network.condition import Condition

HEADS = (
    *("condition", "runs", "depth", "period [ms]", "age [ms]", "in force [ms]"),
    *("round trip [ms]", "delivered", "queue", "time-outs", "alerts", "verdict"),
)
_COLUMNS = (("age_p50", "age_p95"), ("stale_p50", "stale_p95"), ("rtt_p50", "rtt_p95"))
_ALONE = ("delivered", "queue", "timeouts", "alerts")


def table(comparison: Comparison, kind: Kind) -> list[list[str]]:
    """A row for each condition of a kind: measured, an arrow, predicted; and a verdict."""
    cells = _by_condition(comparison)
    misses = _misses(comparison)
    return [
        _line(group, cells[group.condition], misses.get(group.condition, []))
        for group in comparison.groups
        if group.kind == kind
    ]


def _line(group: Group, cells: Mapping[str, Cell], misses: Sequence[str]) -> list[str]:
    period = cells.get("applied_hz")
    shown = [_both(period, lambda rate: 1000 / rate if rate else math.inf)]
    for pair in _COLUMNS:
        shown.append(" | ".join(filter(None, (_both(cells.get(name)) for name in pair))))
    shown += [_both(cells.get(name)) for name in _ALONE]
    verdict = "passes" if not misses else f"misses {', '.join(misses)}"
    depth = depth_for(group.condition)
    return [group.condition.label, str(len(group.runs)), depth, *shown, verdict]


def _both(cell: Cell | None, change: Any = lambda value: value) -> str:
    """`105 → 106`, measured and predicted; nothing where neither is defined."""
    if cell is None:
        return ""
    return f"{number(change(cell.real))} → {number(change(cell.model))}"


def _by_condition(comparison: Comparison) -> dict[Condition, dict[str, Cell]]:
    found: dict[Condition, dict[str, Cell]] = {}
    for cell in _all_cells(comparison):
        found.setdefault(cell.group.condition, {})[cell.measure.name] = cell
    return found


def _all_cells(comparison: Comparison) -> list[Cell]:
    pooled = [scored.cell for scored in comparison.pooled.scored]
    return [*(v.cell for v in comparison.verdicts), *pooled, *comparison.rarely]


def _misses(comparison: Comparison) -> dict[Condition, list[str]]:
    """The measures of each condition that lie outside, or are significantly off."""
    found: dict[Condition, list[str]] = {}
    for cell in _outside(comparison):
        found.setdefault(cell.group.condition, []).append(cell.measure.name)
    return found


def _outside(comparison: Comparison) -> list[Cell]:
    outside = [v.cell for v in comparison.verdicts if v.word == "outside"]
    return outside + [scored.cell for scored in comparison.pooled.significant]


def number(value: float) -> str:
    """Four digits that count, without an exponent."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def rows_of(comparison: Comparison) -> list[Row]:
    """A row for each measure of each condition."""
    rows = [_row(v.cell) | _judged(v) for v in comparison.verdicts]
    significant = {id(scored) for scored in comparison.pooled.significant}
    rows += [_row(s.cell) | _scored(s, id(s) in significant) for s in comparison.pooled.scored]
    return rows + [_row(cell) | _untold() for cell in comparison.rarely]


def _row(cell: Cell) -> Row:
    group = cell.group
    row: Row = {"condition": group.condition.label, "cond_id": group.condition.hash}
    row |= {"kind": group.kind, "groups": " ".join(sorted({run.group for run in group.runs}))}
    row |= {"source": " ".join(sorted({run.source for run in group.runs}))}
    row |= {"depth": depth_for(group.condition), "measure": cell.measure.name}
    row |= {"unit": cell.measure.unit, "runs": len(cell.measured)}
    row |= {"model_runs": len(cell.predicted)}
    return row | {"measured": _known(cell.real), "predicted": _known(cell.model)}


def _judged(verdict: Verdict) -> Row:
    low, high = _known(verdict.low), _known(verdict.high)
    row: Row = {"low": low, "high": high, "z": None, "p": None}
    return row | {"verdict": verdict.word, "why": verdict.why}


def _scored(scored: Scored, significant: bool) -> Row:
    row: Row = {"low": None, "high": None, "z": scored.z, "p": scored.p}
    return row | {"verdict": "outside" if significant else "inside", "why": ""}


def _untold() -> Row:
    row: Row = {"low": None, "high": None, "z": None, "p": None}
    return row | {"verdict": "shown only", "why": "tells too little"}


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def variant_rows(comparison: Comparison) -> list[Row]:
    """Root mean square of z of each variant, over all measures and for each."""
    found = {"nothing": comparison.pooled, **comparison.controls, **comparison.ablated}
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
        for name, pooled in found.items()
    ]
