"""Tables of hypotheses, comparisons and registration: claim beside result."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dva_sim.experiments.analysis.answer import too_few
from dva_sim.experiments.analysis.hypothesis_tests import (
    Compared,
    Judgement,
    Tested,
    Verdict,
    judged,
)
from dva_sim.experiments.analysis.run_grid import Table
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note, sentence
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
_MIN_P = 0.001


def hypothesis_table(tested: Sequence[Tested], cluster: str = "person") -> CellTable:
    """Return each hypothesis: the claim, the result, the adjusted test, the verdict."""
    heads = ["hypothesis", "claim", "found (interval at the level of the verdict)"]
    heads += ["p by Holm", "p of the opposite", "verdict"]
    rows = [
        [
            ": ".join(filter(None, (t.name, t.hypothesis.text))),
            _claim(t),
            _found(t),
            _p(t.adjusted),
            _p(t.against),
            ": ".join(filter(None, (_VERDICTS[t.verdict], _few(t, cluster)))),
        ]
        for t in tested
    ]
    return CellTable("", heads, len(heads), rows, note=note("hypotheses"))


def _few(tested: Tested, cluster: str) -> str:
    """Say that a hypothesis stayed open for want of persons; else an empty text."""
    difference = tested.difference
    least = tested.contrast.smallest or tested.hypothesis.margin or None
    is_few = tested.verdict == "open" and difference is not None and _are_few(difference, least)
    return too_few(difference.n_persons, cluster) if is_few and difference is not None else ""


def _are_few(interval: Interval, smallest: float | None, tests: int = 1) -> bool:
    """Return True if the test, or ruling out the declared difference, needs more persons."""
    if _least_p(interval.n_persons, tests) > 1 - LEVEL:
        return True
    return smallest is not None and max(-interval.low, interval.high) > smallest


def _least_p(persons: int, tests: int) -> float:
    """Return the least p that a permutation test can give by Holm, first of a family."""
    return min(1.0, tests * 2.0 ** (1 - persons))


_SETTLED: dict[Verdict, str] = {
    "did not hold": "refuted",
    "open": "undecided",
    "not run": "not run",
    "held": "held",
}
"""Verdicts in the lead, in their order there."""


def verdict_lead(
    tested: Sequence[Tested], cluster: str, *, is_extrapolated: bool, only_model: str
) -> str:
    """Name the verdicts on registered hypotheses, refuted ones first.

    Args:
        tested: The hypotheses as they came out; at least one.
        cluster: Unit of resampling.
        is_extrapolated: True if any lies beyond the delays at which people were watched.
        only_model: The one model of the persons that was tried; empty if several were.
    """
    counts = Counter(t.verdict for t in tested)
    first, *rest = [verdict for verdict in _SETTLED if counts[verdict]]
    return sentence(
        "verdicts",
        count=len(tested),
        verdict=_SETTLED[first],
        is_extrapolated=is_extrapolated,
        claims=[
            (
                t.name,
                (t.hypothesis.text or _claim(t)).strip().removesuffix("."),
                _found(t),
                bound_of(t),
                _few(t, cluster),
            )
            for t in tested
            if t.verdict == first
        ],
        others=[f"{counts[verdict]} {_SETTLED[verdict]}" for verdict in rest],
        only_model=only_model,
    )


def comparison_table(judgement: Judgement, cluster: str = "person") -> CellTable:
    """Return each comparison at each level it runs over."""
    compared = judgement.compared
    families = Counter(c.contrast.family for c in compared)
    families.update(t.contrast.family for t in judgement.tested)
    heads = ["comparison", "difference in", "at", "first minus second (95 % interval)"]
    heads += ["in standard deviations", "correlation of pairs", "p", "p by Holm", "apart?"]
    rows = [
        [
            f"{c.name}: {_sides(c)}",
            measure_of(c.contrast.measure, c.contrast.part),
            setting(c.at) or "on average",
            _interval(c.difference, c.contrast.measure),
            _bare(c.size.average) if c.size else "–",
            number(c.correlation),
            _p(c.p),
            _p(c.adjusted),
            _apart(c, cluster, families[c.contrast.family]),
        ]
        for c in compared
    ]
    persons = max((c.difference.n_persons for c in compared if c.difference), default=0)
    tests = max((families[c.contrast.family] for c in compared), default=1)
    least = _least_p(persons, tests) if persons else 0.0  # whatever the runs
    counts = "; ".join(f"{name}: {count}" for name, count in families.items())
    least_p = f"{least:.2g}" if least > 1 - LEVEL else ""
    needed = math.ceil(math.log2(2 * tests / (1 - LEVEL)))
    text = note("comparisons", families=counts, persons=persons, least_p=least_p, needed=needed)
    return CellTable("", heads, len(heads), rows, note=text)


def _sides(compared: Compared) -> str:
    first, second = (level_name(compared.contrast.factor, x) for x in compared.contrast.contrast)
    return f"{first} minus {second}"


def _claim(tested: Tested) -> str:
    """Return `A minus B in driving time, at delay 1 s: above 2 s`."""
    first, second = (level_name(tested.contrast.factor, x) for x in tested.contrast.contrast)
    where = f", {setting(tested.at)}" if tested.at else ""
    measure = measure_of(tested.contrast.measure, tested.contrast.part)
    return f"{first} minus {second} in {measure}{where}: {bound_of(tested)}"


def bound_of(tested: Tested) -> str:
    """Return `above 2.0 s`, `below −2.0 s` or `the same within 2.0 s`."""
    claim = tested.hypothesis
    unit = unit_of(tested.contrast.measure)
    margin = quantity(claim.margin, unit) if claim.margin else "zero"
    return {
        "above": f"above {margin}",
        "below": f"below {'−' if claim.margin else ''}{margin}",
        "same": f"the same within {margin}",
    }[claim.direction]


def verdict_of_name(tested: Tested) -> str:
    """Return `✓ held: waiting`, in two lines."""
    return f"{_VERDICTS[tested.verdict]}\n{tested.name}"


def verdict_with_interval(tested: Tested) -> str:
    """Return `✓ held: 4.0 s (3.0 to 5.0 s, 90 %)`."""
    if tested.difference is None:
        return _VERDICTS[tested.verdict]
    return f"{_VERDICTS[tested.verdict]}: {_found(tested)}"


def _found(tested: Tested) -> str:
    """Return `4.0 s (3.0 to 5.0 s, 90 %)`: the difference with the interval that decides."""
    text = _interval(tested.difference, tested.contrast.measure)
    return text if tested.difference is None else f"{text[:-1]}, {100 * tested.level:.3g} %)"


def _interval(interval: Interval | None, measure: str) -> str:
    if interval is None:
        return "not run"
    unit = unit_of(measure)
    mean, high = quantity(interval.mean, unit), quantity(interval.high, unit)
    return f"{mean} ({number(interval.low)} to {high})"


def _p(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    return f"< {_MIN_P:g}" if value < _MIN_P else f"{value:.3f}"


def _apart(compared: Compared, cluster: str, tests: int) -> str:
    difference = compared.difference
    if not math.isfinite(compared.adjusted) or difference is None:
        return "–"
    if compared.adjusted <= 1 - LEVEL:
        return "✓ yes"
    is_few = _are_few(difference, compared.contrast.smallest, tests)
    return f"? {too_few(difference.n_persons, cluster)}" if is_few else "? not shown"


_DIGITS = 16


_DESIGNS = {
    "latin_hypercube": "points of a Latin hypercube",
    "sobol": "points of a Sobol' sequence",
    "saltelli": "points of Saltelli's sample, with what lies between them",
}


_CLAIMS = ("hypotheses", "answer", "comparisons")


def registration_table(manifest: Mapping[str, Any], runs: Table, persons: int) -> CellTable:
    """Return the registration line by line, beside the study that was run.

    The claims are those registered, also where the study as run has others.

    Args:
        manifest: Manifest of the results, with a registration in its status.
        runs: The table of runs.
        persons: Number of persons simulated.
    """
    registration = manifest["status"]["registration"]
    study = manifest["study"]
    plan = registration.get("plan") or {}
    versions = manifest.get("versions") or {}
    rows = [
        ["persons x trials", _size(plan, plan.get("persons")), _size(study, persons)],
        *_claims(dict(study) | {key: plan.get(key) for key in _CLAIMS}, runs),
        ["design", _design(plan), _design(study)],
        [
            "made with",
            registration.get("made_with", "–"),
            f"{versions.get('dva-sim')} {versions.get('fingerprint')}",
        ],
        ["judged with", registration.get("judged_with") or "–", fingerprint_of_judges()],
        ["hash", str(registration.get("hash", ""))[:_DIGITS], ""],
        ["earlier registrations", *_earlier(registration.get("earlier") or ())],
    ]
    return CellTable("", ["", "as registered", "as run"], 3, rows)


def _size(study: Mapping[str, Any], persons: int | None) -> str:
    return f"{persons} x {study.get('replications')}"


def _claims(study: Mapping[str, Any], runs: Table) -> Iterator[list[str]]:
    """Yield the bound of each hypothesis, and its result."""
    for tested in judged(study, runs).tested if runs else ():
        yield [f"hypothesis {tested.name}", bound_of(tested), verdict_with_interval(tested)]


def _design(study: Mapping[str, Any]) -> str:
    """Describe how levels are combined, and the number of levels of each factor."""
    design = study.get("design") or {}
    factors = study.get("factors") or {}
    lines = [f"{factor_name(f)} ({len(v)} levels)" for f, v in factors.items() if f != POINT]
    for kind, words in _DESIGNS.items():
        if design.get(kind):
            ranges = listing([factor_name(name) for name in design.get("ranges") or {}])
            return "; ".join([f"{design[kind]} {words} over {ranges}", *lines])
    how = "one after another" if design.get("zip") else "every combination"
    if design.get("rows") or design.get("csv"):
        how = "rows of a list"
    return f"{how}: {', '.join(lines)}"


def _earlier(hashes: Sequence[str]) -> tuple[str, str]:
    if not hashes:
        return "none told", ""
    return f"{len(hashes)}: {', '.join(h[:_DIGITS] for h in hashes)}", ""


def _bare(interval: Interval) -> str:
    return f"{number(interval.mean)} ({number(interval.low)} to {number(interval.high)})"
