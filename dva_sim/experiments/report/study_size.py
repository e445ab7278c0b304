"""The size of a study as it was run, and the persons needed to settle what stayed open."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.analysis.sample_size import MAX_PERSONS, POWERS, Count, SizePlan
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note, sentence
from dva_sim.experiments.study.parts import POINT
from dva_sim.kernel.units import unit_of
from dva_sim.simulation.labels import factor_name

if TYPE_CHECKING:
    from dva_sim.experiments.report.summary import Reading


def size_of(reading: Reading) -> str:
    """Return `A smaller version of X: 4 persons × 2 trials, 440 runs ... Its usual size: ...`."""
    study = reading.study
    usual = reading.manifest.get("usual") or {}
    return sentence(
        "size",
        usual=usual,
        weight=_weight(study) / _weight(usual) if usual else 0.0,
        by_people=reading.by_people,
        here=_people(reading.persons, study.get("replications"), reading.cluster),
        runs=f"{runs_of(reading):,}",
        cells=f"{cells:,}" if (cells := len(reading.manifest.get("cells", []))) else "",
        seed=study.get("seed"),
        usually=_usually(reading, usual) if usual else [],
    )


def not_reached(reading: Reading) -> str:
    """Say what half-width a stopping rule asked for and the study did not reach; else empty."""
    stop = reading.study.get("stop")
    stopped = reading.manifest.get("stopped") or {}
    if not stop or stopped.get("why") not in ("limit", "budget"):
        return ""
    reached = stopped.get("half_width")  # older results do not say how far a study had come
    if reached is not None and reached <= stop["half_width"]:
        return ""
    return sentence(
        "not_reached",
        half_width=stop["half_width"],
        unit=unit_of(_measure_of(reading.study, stop)),
        persons=reading.persons,
        cluster=reading.cluster,
        why=stopped["why"],
        reached=reached,
    )


def _measure_of(study: Mapping[str, Any], stop: Mapping[str, Any]) -> str:
    """Return the column that a stopping rule looks at."""
    if stop.get("measure"):
        return str(stop["measure"])
    contrasts = {**study.get("comparisons", {}), "answer": study.get("answer")}
    return str((contrasts.get(stop["comparison"]) or {}).get("measure", ""))


def runs_of(reading: Reading) -> int:
    """Return the number of runs, with those under other models of the persons."""
    tables = (name for name in ("runs", "robustness") if reading.results.has(name))
    return sum(reading.results.table(name).rows for name in tables)


def _people(persons: int, trials: int | None, cluster: str) -> str:
    counted = f"{persons} {cluster}{'' if persons == 1 else 's'}"
    if cluster != "person":
        return counted
    return f"{counted} × {trials} trial{'' if trials == 1 else 's'}"


def _weight(size: Mapping[str, Any]) -> float:
    """Return the number of runs in one part."""
    count = float(size.get("persons") or 1) * float(size.get("replications") or 1)
    for levels in (size.get("factors") or {}).values():
        count *= len(levels)
    return count


def _usually(reading: Reading, usual: Mapping[str, Any]) -> list[str]:
    """Return settings of the study's own file that this run changed."""
    here = reading.study.get("factors") or {}
    levels = [
        f"{len(levels)} levels of {factor_name(name)} (here {len(here.get(name, ()))})"
        for name, levels in (usual.get("factors") or {}).items()
        if name != POINT and len(levels) != len(here.get(name, ()))
    ]
    return [_people(usual["persons"], usual["replications"], reading.cluster), *levels]


def plan_table(plans: Sequence[SizePlan], cluster: str) -> CellTable:
    """Return a line for each plan."""
    heads = ["to show", "if the true difference is"]
    heads += [f"{cluster}s for {100 * p:.0f} % power" for p in POWERS]
    rows = [
        [
            f"{p.name}: {p.what}",
            p.assumed,
            *(map(_count_text, p.counts) if p.counts else _NO_NUMBER),
        ]
        for p in plans
    ]
    return CellTable("", heads, len(heads), rows, note=_assumes(plans, cluster))


def plan_lines(plans: Sequence[SizePlan], cluster: str) -> list[str]:
    """Return a line for each plan, and what they assume."""
    lines = [
        f"To show {p.name} ({p.what}), if the true difference is {p.assumed}: {_line(p, cluster)}."
        for p in plans
    ]
    return [*lines, _assumes(plans, cluster)] if plans else []


_NO_NUMBER = ["no number: it is not true then"] * len(POWERS)


def _line(plan: SizePlan, cluster: str) -> str:
    if not plan.counts:
        return "no number of them, for it is not true then"
    needed = [
        f"{_count_text(count)} {cluster}s for {100 * power:.0f} % power"
        for count, power in zip(plan.counts, POWERS, strict=True)
    ]
    return ", ".join(needed)


def _count_text(count: Count) -> str:
    return f"{_persons(count.persons)} ({_persons(count.low)} to {_persons(count.high)})"


def _persons(count: float) -> str:
    return f"{count:.0f}" if math.isfinite(count) else f"more than {MAX_PERSONS:,}"


def _assumes(plans: Sequence[SizePlan], cluster: str) -> str:
    counts = sorted({plan.known_from for plan in plans})
    counted = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return note("sample_size", cluster=cluster, known=counted)
