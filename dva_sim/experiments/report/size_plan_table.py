"""Persons needed to settle what stayed open, as a table and in lines."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dva_sim.experiments.analysis.sample_size import MOST_PERSONS, POWERS, Count, SizePlan
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note


def plan_table(found: Sequence[SizePlan], cluster: str) -> CellTable:
    """A line for each plan."""
    heads = ["to show", "if the true difference is"]
    heads += [f"{cluster}s for {100 * p:.0f} % power" for p in POWERS]
    rows = [
        [f"{p.name}: {p.what}", p.assumed, *(map(_count_text, p.counts) if p.counts else _NEVER)]
        for p in found
    ]
    return CellTable("", heads, len(heads), rows, note=_assumes(found, cluster))


def plan_lines(found: Sequence[SizePlan], cluster: str) -> list[str]:
    """A line for each plan, and what they assume."""
    lines = [
        f"To show {p.name} ({p.what}), if the true difference is {p.assumed}: {_line(p, cluster)}."
        for p in found
    ]
    return [*lines, _assumes(found, cluster)] if found else []


_NEVER = ["no number: it is not true then"] * len(POWERS)


def _line(plan: SizePlan, cluster: str) -> str:
    if not plan.counts:
        return "no number of them, for it is not true then"
    needed = [
        f"{_count_text(count)} {cluster}s for {100 * wanted:.0f} % power"
        for count, wanted in zip(plan.counts, POWERS, strict=True)
    ]
    return ", ".join(needed)


def _count_text(count: Count) -> str:
    return f"{_persons(count.persons)} ({_persons(count.low)} to {_persons(count.high)})"


def _persons(count: float) -> str:
    return f"{count:.0f}" if math.isfinite(count) else f"more than {MOST_PERSONS:,}"


def _assumes(found: Sequence[SizePlan], cluster: str) -> str:
    counts = sorted({plan.known_from for plan in found})
    known = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return note("sample_size", cluster=cluster, known=known)
