"""What was claimed beside what came out: hypotheses, comparisons, a registration, as tables.

And what stayed open: how many persons it takes, and which few runs weigh much.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Finding, too_few
from dva_sim.experiments.analysis.hypothesis_tests import (
    Compared,
    Judgement,
    Tested,
    Verdict,
    judged,
)
from dva_sim.experiments.analysis.run_grid import Floats, Setting, Table
from dva_sim.experiments.analysis.sample_size import MOST_PERSONS, POWERS, Count, SizePlan
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note
from dva_sim.experiments.study.hashing import fingerprint_of_judges
from dva_sim.experiments.study.parts import POINT
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import listing, number, quantity
from dva_sim.simulation.labels import factor_name, level_name, measure_of, setting
from dva_sim.statistics import LEVEL, Interval, quantile_interval

# A mark beside the word: neither needs a colour.
_VERDICTS: dict[Verdict, str] = {
    "held": "✓ held",
    "did not hold": "✗ did not hold",
    "open": "? open",
    "not run": "– not run",
}
_LEAST_P = 0.001


def hypothesis_table(tested: Sequence[Tested], cluster: str = "person") -> CellTable:
    """Each hypothesis: the claim, what was found, the adjusted test, the verdict."""
    heads = ["hypothesis", "claim", "found (95 % interval)"]
    heads += ["p by Holm", "p of the opposite", "verdict"]
    rows = [
        [
            ": ".join(filter(None, (t.name, t.hypothesis.text))),
            _claim(t),
            _interval(t.difference, t.contrast.measure),
            _p(t.adjusted),
            _p(t.against),
            _verdict(t, cluster),
        ]
        for t in tested
    ]
    return CellTable("", heads, len(heads), rows, note=note("hypotheses"))


def _verdict(tested: Tested, cluster: str) -> str:
    """`? open: too few persons (4) to tell`, where they are."""
    return ": ".join(filter(None, (_VERDICTS[tested.verdict], _few(tested, cluster))))


def _few(tested: Tested, cluster: str) -> str:
    """Why it is open, where that is for want of persons."""
    found, least = tested.difference, tested.contrast.smallest or tested.hypothesis.margin or None
    is_few = tested.verdict == "open" and found is not None and _are_few(found, least)
    return too_few(found.n_persons, cluster) if is_few and found is not None else ""


def _are_few(found: Interval, smallest: float | None) -> bool:
    """Whether more persons are needed: for the test, or to rule out what was declared to matter."""
    if 2.0 ** (1 - found.n_persons) > 1 - LEVEL:  # the least p that a permutation test can give
        return True
    return smallest is not None and max(-found.low, found.high) > smallest


_SETTLED: dict[Verdict, str] = {
    "held": "held",
    "did not hold": "did not hold",
    "open": "stays open",
    "not run": "was not run",
}


def verdict_sentences(tested: Sequence[Tested], cluster: str = "person") -> list[str]:
    """One sentence with the verdict on each hypothesis, for the top of a report."""
    return [
        f"Registered hypothesis {t.name} "
        + ", ".join(filter(None, (_SETTLED[t.verdict], _few(t, cluster))))
        + f": {_claim(t)}"
        + (f"; found {_interval(t.difference, t.contrast.measure)}" if t.difference else "")
        + (f", p {_p(t.adjusted)} by Holm." if t.difference else ".")
        for t in tested
    ]


def comparison_table(found: Judgement, cluster: str = "person") -> CellTable:
    """Each comparison at each level it runs over."""
    compared = found.compared
    heads = ["comparison", "difference in", "at", "first minus second (95 % interval)"]
    heads += ["in standard deviations", "correlation of pairs", "p", "p by Holm", "apart?"]
    rows = [
        [
            f"{c.name}: {_sides(c)}",
            measure_of(c.contrast.measure, c.contrast.part),
            _place(c.at),
            _interval(c.difference, c.contrast.measure),
            _bare(c.size.average) if c.size else "–",
            number(c.correlation),
            _p(c.p),
            _p(c.adjusted),
            _apart(c, cluster),
        ]
        for c in compared
    ]
    families = Counter(c.contrast.family for c in compared)
    families.update(t.contrast.family for t in found.tested)
    persons = max((c.difference.n_persons for c in compared if c.difference), default=0)
    least = 2.0 ** (1 - persons) if persons else 0.0  # whatever the runs
    facts = {"families": list(families.items()), "persons": persons}
    told = note("comparisons", **facts, least_p=least if least > 1 - LEVEL else None)
    return CellTable("", heads, len(heads), rows, note=told)


def _sides(compared: Compared) -> str:
    first, second = (level_name(compared.contrast.factor, x) for x in compared.contrast.contrast)
    return f"{first} minus {second}"


def _claim(tested: Tested) -> str:
    """`A minus B in driving time, at delay 1 s: above 2 s`."""
    first, second = (level_name(tested.contrast.factor, x) for x in tested.contrast.contrast)
    where = f", {setting(tested.at)}" if tested.at else ""
    measure = measure_of(tested.contrast.measure, tested.contrast.part)
    return f"{first} minus {second} in {measure}{where}: {bound_of(tested)}"


def bound_of(tested: Tested) -> str:
    """`above 2.0 s`, `below −2.0 s` or `the same within 2.0 s`."""
    claim, unit = tested.hypothesis, unit_of(tested.contrast.measure)
    margin = quantity(claim.margin, unit) if claim.margin else "zero"
    return {
        "above": f"above {margin}",
        "below": f"below {'−' if claim.margin else ''}{margin}",
        "same": f"the same within {margin}",
    }[claim.direction]


def verdict_with_interval(tested: Tested) -> str:
    """`✓ held: 4.0 s (3.0 to 5.0 s)`."""
    if tested.difference is None:
        return _VERDICTS[tested.verdict]
    return f"{_VERDICTS[tested.verdict]}: {_interval(tested.difference, tested.contrast.measure)}"


def _place(at: Setting) -> str:
    return setting(at) or "on average"


def _interval(found: Interval | None, measure: str) -> str:
    if found is None:
        return "not run"
    unit = unit_of(measure)
    return f"{quantity(found.mean, unit)} ({number(found.low)} to {quantity(found.high, unit)})"


def _bare(found: Interval) -> str:
    return f"{number(found.mean)} ({number(found.low)} to {number(found.high)})"


def _p(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    return f"< {_LEAST_P:g}" if value < _LEAST_P else f"{value:.3f}"


def _apart(compared: Compared, cluster: str) -> str:
    found = compared.difference
    if not math.isfinite(compared.adjusted) or found is None:
        return "–"
    if compared.adjusted <= 1 - LEVEL:
        return "✓ yes"
    is_few = _are_few(found, compared.contrast.smallest)
    return f"? {too_few(found.n_persons, cluster)}" if is_few else "? not shown"


_DIGITS = 16
_DESIGNS = {
    "latin_hypercube": "points of a Latin hypercube",
    "sobol": "points of a Sobol' sequence",
    "saltelli": "points of Saltelli's sample, with what lies between them",
}
_CLAIMS = ("hypotheses", "answer", "comparisons")


def registration_table(manifest: Mapping[str, Any], runs: Table, persons: int) -> CellTable:
    """Line by line what was registered, beside what was run.

    The claims are those registered, also where the study as run has others.

    Args:
        manifest: Of the results, with a registration in its status.
        runs: The table of runs.
        persons: How many were simulated.
    """
    found, study = manifest["status"]["registration"], manifest["study"]
    plan, versions = found.get("plan") or {}, manifest.get("versions") or {}
    rows = [
        ["persons x trials", _size(plan, plan.get("persons")), _size(study, persons)],
        *_claims(dict(study) | {key: plan.get(key) for key in _CLAIMS}, runs),
        ["design", _design(plan), _design(study)],
        ["made with", found.get("made_with", "–"), _program(versions)],
        ["judged with", found.get("judged_with") or "–", fingerprint_of_judges()],
        ["hash", str(found.get("hash", ""))[:_DIGITS], ""],
        ["earlier registrations", *_earlier(found.get("earlier") or ())],
    ]
    return CellTable("", ["", "as registered", "as run"], 3, rows)


def _size(study: Mapping[str, Any], persons: int | None) -> str:
    return f"{persons} x {study.get('replications')}"


def _claims(study: Mapping[str, Any], runs: Table) -> Iterator[list[str]]:
    """The bound that each hypothesis was to be tested against, and what came out."""
    for tested in judged(study, runs).tested if runs else ():
        yield [f"hypothesis {tested.name}", bound_of(tested), verdict_with_interval(tested)]


def _design(study: Mapping[str, Any]) -> str:
    """Which levels meet, and of which factors how many."""
    design, factors = study.get("design") or {}, study.get("factors") or {}
    told = [f"{factor_name(f)} ({len(v)} levels)" for f, v in factors.items() if f != POINT]
    for kind, words in _DESIGNS.items():
        if design.get(kind):
            ranges = listing([factor_name(name) for name in design.get("ranges") or {}])
            return "; ".join([f"{design[kind]} {words} over {ranges}", *told])
    how = "one after another" if design.get("zip") else "every combination"
    if design.get("rows") or design.get("csv"):
        how = "rows of a list"
    return f"{how}: {', '.join(told)}"


def _program(versions: Mapping[str, Any]) -> str:
    """As a registration has it."""
    return f"{versions.get('dva-sim')} {versions.get('fingerprint')}"


def _earlier(hashes: Sequence[str]) -> tuple[str, str]:
    if not hashes:
        return "none told", ""
    return f"{len(hashes)}: {', '.join(h[:_DIGITS] for h in hashes)}", ""


def few_that_weigh(finding: Finding, view: StudyView) -> str:
    """Where runs that count with the whole horizon pull at the mean, and what the median is."""
    if finding.horizon is None or not view.part.has("confirmed"):
        return ""
    told = [_weight(finding, view, stop) for stop in range(len(view.stops))]
    if not any(told):
        return ""
    return (
        f"Where some runs count with {quantity(finding.horizon, 's')}, the mean hangs on them and "
        f"the median of the differences tells more: {'; '.join(filter(None, told))}."
    )


def _weight(finding: Finding, view: StudyView, stop: int) -> str:
    """`at 20 s 2 of 48 runs, median 4.0 s (3.1 to 4.9 s)`; empty where none or all count so."""
    grid, panel = view.part.grid("confirmed"), view.panels[0]
    sides = [view.curve(grid, panel, side)[stop] for side in (finding.first, finding.second)]
    runs = sum(int(np.isfinite(side).sum()) for side in sides)
    missed = sum(int((side < 1).sum()) for side in sides)
    if not 0 < missed < runs / 4:
        return ""
    found = quantile_interval(*_differences(finding, view, stop))
    ends = f" ({number(found.low)} to {quantity(found.high, finding.unit)})"
    where = f"at {level_name(finding.over, view.stops[stop])} " if view.over else ""
    return (
        f"{where}{missed} of {runs} runs, median {quantity(found.mean, finding.unit)}"
        f"{ends if np.isfinite(found.low) else ''}"
    )


def _differences(finding: Finding, view: StudyView, stop: int) -> tuple[Floats, NDArray[Any]]:
    """First minus second, run by run, and whose they are."""
    values, panel = view.values, view.panels[0]
    first, second = (
        view.curve(values, panel, side)[stop] for side in (finding.first, finding.second)
    )
    person = np.repeat(view.part.persons, len(view.part.trials))
    return (first - second).ravel(), person


def plan_table(found: Sequence[SizePlan], cluster: str) -> CellTable:
    """A line for each plan."""
    heads = ["to show", "if the true difference is"]
    heads += [f"{cluster}s for {100 * p:.0f} % power" for p in POWERS]
    rows = [
        [f"{p.name}: {p.what}", p.assumed, *(map(_told, p.counts) if p.counts else _NEVER)]
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
        f"{_told(count)} {cluster}s for {100 * wanted:.0f} % power"
        for count, wanted in zip(plan.counts, POWERS, strict=True)
    ]
    return ", ".join(needed)


def _told(count: Count) -> str:
    return f"{_persons(count.persons)} ({_persons(count.low)} to {_persons(count.high)})"


def _persons(count: float) -> str:
    return f"{count:.0f}" if math.isfinite(count) else f"more than {MOST_PERSONS:,}"


def _assumes(found: Sequence[SizePlan], cluster: str) -> str:
    counts = sorted({plan.known_from for plan in found})
    known = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return note("sample_size", cluster=cluster, known=known)
