"""Output of `show` and `compare` as plain data for other programs; keys are stable.

Missing numbers are nan here, and null once printed. Levels are by factor, as in the study.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from dva_sim.experiments.analysis.compare import Comparison
from dva_sim.experiments.analysis.fail_conditions import GateVerdict
from dva_sim.experiments.analysis.matched_results import Difference, Levels
from dva_sim.experiments.analysis.study_view import interval_of, parts_of
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.units import unit_of

Data = dict[str, Any]


def shown(results: Results) -> Data:
    """Return the answer, what it rests on, and every cell."""
    status = status_of(results.manifest)
    reading = Reading(results)
    study = results.study
    return {
        "folder": str(results.folder),
        "question": results.question,
        "status": {"kind": status.kind, "why": list(status.why)},
        "partial": results.manifest.get("partial"),
        "answer": {
            "lead": reading.answer.lead,
            "notes": list(reading.answer.notes),
            "finding": _finding(reading),
        },
        "warnings": list(reading.warnings),
        "runs": results.runs.rows,
        "failed": len(results.failures),
        "persons": reading.persons,
        "replications": study.get("replications"),
        "seed": study.get("seed"),
        "cells": list(_cells(reading)),
        "tables": results.tables,
        "program": _program(results),
    }


def table(results: Results, name: str, most: int) -> Data:
    """Return the first rows of a table, and what its columns mean.

    Raises:
        ConfigError: no such table.
    """
    frame = results.table(name)
    return {
        "folder": str(results.folder),
        "table": name,
        "rows": frame.rows,
        "columns": _columns(results, name),
        "data": frame.where(slice(most)).to_rows(),
    }


def columns(results: Results, tables: Sequence[str]) -> Data:
    """Explain the columns of some tables, or of all.

    Raises:
        ConfigError: no such table.
    """
    values = {name: _columns(results, name) for name in tables or results.tables}
    return {"folder": str(results.folder), "tables": values}


def compared(
    comparison: Comparison,
    measures: Sequence[str],
    by: Sequence[str],
    verdicts: Sequence[GateVerdict],
) -> Data:
    """Return how two results differ, with the verdicts of a gate; differences are B minus A.

    Raises:
        ConfigError: no such measure or factor.
    """
    matched = comparison.matched
    pairs, runs = comparison.paired
    names: Sequence[str | None] = measures or [None]
    return {
        "a": _side(comparison.sides[0]),
        "b": _side(comparison.sides[1]),
        "cells": {
            "both": len(matched.pairs),
            "only_a": [_place(part, levels) for part, levels in matched.only_first],
            "only_b": [_place(part, levels) for part, levels in matched.only_second],
        },
        "runs_a": runs,
        "pairs": pairs,
        "measures": [_measure(comparison, measure, by) for measure in names],
        "changed": comparison.changed()[0] if pairs else [],
        "gates": [_gate(text, verdicts) for text in dict.fromkeys(v.gate.text for v in verdicts)],
    }


def _finding(reading: Reading) -> Data | None:
    finding = reading.finding
    if finding is None or reading.view is None:
        return None
    numbers = zip(finding.levels, finding.mean, finding.low, finding.high, strict=True)
    keys = ("measure", "unit", "factor", "first", "second", "over")
    return {key: getattr(finding, key) for key in keys} | {
        "within": dict(reading.view.panels[0]),
        "in_excess_of_reference": finding.in_excess,
        "differences": [
            {"level": level, "mean": float(mean), "low": float(low), "high": float(high)}
            for level, mean, low, high in numbers
        ],
    }


def _cells(reading: Reading) -> Iterator[Data]:
    """Return every cell with its mean of the answer's measure over persons and its interval."""
    view = reading.view
    if view is None:
        return
    for part in parts_of(reading.study, reading.runs):
        made = part.grid("seed")
        grid = part.grid(view.measure)
        for setting in part.settings():
            count = int((part.where(made, setting) == part.where(made, setting)).sum())
            interval = interval_of(part.where(grid, setting))
            mean, low, high = (
                (interval.mean, interval.low, interval.high) if interval else (None,) * 3
            )
            numbers = {"runs": count, "measure": view.measure, "mean": mean, "low": low}
            yield _place(part.name, tuple(setting.items())) | numbers | {"high": high}


def _columns(results: Results, name: str) -> list[Data]:
    keys = ("name", "unit", "meaning")
    return [{key: getattr(column, key) for key in keys} for column in results.columns(name)]


def _program(results: Results) -> Data:
    versions = results.manifest.get("versions", {})
    return {"version": versions.get("dva-sim"), "commit": versions.get("commit")}


def _side(results: Results) -> Data:
    return {
        "folder": str(results.folder),
        "question": results.question,
        "set": list(results.manifest.get("set", ())),
        "failed": len(results.failures),
        "program": _program(results),
    }


def _measure(comparison: Comparison, measure: str | None, by: Sequence[str]) -> Data:
    name, column = comparison.find(measure)
    rows = comparison.differences(f"{name}.{column}", by)
    return {
        "table": name,
        "measure": column,
        "unit": unit_of(column),
        "differences": [_difference(row) for row in rows],
    }


def _difference(row: Difference) -> Data:
    return _place(row.part, row.levels) | {
        "runs_a": row.runs[0],
        "runs_b": row.runs[1],
        "median_a": row.medians[0],
        "median_b": row.medians[1],
        "mean": row.interval.mean,
        "low": row.interval.low,
        "high": row.interval.high,
        "is_paired": row.is_paired,
        "is_identical": row.is_identical,
    }


def _gate(text: str, verdicts: Sequence[GateVerdict]) -> Data:
    matching = [verdict for verdict in verdicts if verdict.gate.text == text]
    return {
        "condition": text,
        "failed": any(verdict.holds for verdict in matching),
        "groups": [
            _place(v.part, v.levels)
            | {"a": v.first, "b": v.second, "bound": v.bound, "failed": v.holds}
            for v in matching
        ],
    }


def _place(part: str, levels: Levels) -> Data:
    return {"part": part, "levels": dict(levels)}
