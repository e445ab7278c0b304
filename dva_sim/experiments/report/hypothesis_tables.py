"""Hypotheses and named comparisons as tables: what was claimed beside what came out.

A registration as a table: what was fixed beforehand, beside what was run and what came out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dva_sim.experiments.analysis.hypothesis_tests import (
    Compared,
    Judgement,
    Tested,
    Verdict,
    judged,
)
from dva_sim.experiments.analysis.run_grid import Setting, Table
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.study.hashing import fingerprint_of_judges
from dva_sim.experiments.study.parts import POINT
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import listing, number, quantity
from dva_sim.simulation.labels import factor_name, level_name, measure_of, setting
from dva_sim.statistics import LEVEL, Interval

# A mark beside the word: neither needs a colour.
_VERDICTS: dict[Verdict, str] = {
    "held": "✓ held",
    "did not hold": "✗ did not hold",
    "open": "? open",
    "not run": "– not run",
}
_LEAST_P = 0.001


def hypothesis_table(tested: Sequence[Tested]) -> CellTable:
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
            _VERDICTS[t.verdict],
        ]
        for t in tested
    ]
    note = (
        "A claim held if p by Holm is below 5 %, and did not hold if p of the opposite is; else it "
        "is open, which is no evidence either way. Each interval is of its row alone."
    )
    return CellTable("", heads, len(heads), rows, note=note)


def comparison_table(found: Judgement) -> CellTable:
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
            _apart(c),
        ]
        for c in compared
    ]
    families = Counter(c.contrast.family for c in compared)
    families.update(t.contrast.family for t in found.tested)
    counted = "; ".join(f"{name}: {count}" for name, count in families.items())
    note = (
        "Each interval is of its row alone; p is of the two-sided permutation test, by Holm for "
        f"all tests of its family together (tests in each family: {counted}). Standard deviations "
        "are those of persons under the two levels, on average. Levels of factors that a "
        "comparison does not name are averaged."
        f"{_too_few(compared)}"
    )
    return CellTable("", heads, len(heads), rows, note=note)


def _too_few(compared: Sequence[Compared]) -> str:
    """Whether even one test cannot come out, whatever the runs."""
    persons = max((c.difference.n_persons for c in compared if c.difference), default=0)
    least = 2.0 ** (1 - persons)
    if not persons or least <= 1 - LEVEL:
        return ""
    return f" With {persons} persons p cannot be below {least:.2g}: this test needs six."


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


def _apart(compared: Compared) -> str:
    if not math.isfinite(compared.adjusted):
        return "–"
    return "✓ yes" if compared.adjusted <= 1 - LEVEL else "? not shown"


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
