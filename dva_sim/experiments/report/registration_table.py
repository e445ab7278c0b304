"""The registration beside the run, line by line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dva_sim.experiments.analysis.hypothesis_tests import judged
from dva_sim.experiments.analysis.run_grid import Table
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.hypothesis_tables import bound_of, verdict_with_interval
from dva_sim.experiments.study.hashing import fingerprint_of_judges
from dva_sim.experiments.study.parts import POINT
from dva_sim.kernel.wording import listing
from dva_sim.simulation.labels import factor_name

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
        manifest: Manifest of the results, with a registration in its status.
        runs: The table of runs.
        persons: Number of persons simulated.
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
    """Describe how levels are combined, and the number of levels of each factor."""
    design, factors = study.get("design") or {}, study.get("factors") or {}
    lines = [f"{factor_name(f)} ({len(v)} levels)" for f, v in factors.items() if f != POINT]
    for kind, words in _DESIGNS.items():
        if design.get(kind):
            ranges = listing([factor_name(name) for name in design.get("ranges") or {}])
            return "; ".join([f"{design[kind]} {words} over {ranges}", *lines])
    how = "one after another" if design.get("zip") else "every combination"
    if design.get("rows") or design.get("csv"):
        how = "rows of a list"
    return f"{how}: {', '.join(lines)}"


def _program(versions: Mapping[str, Any]) -> str:
    """Program version and fingerprint, as a registration states them."""
    return f"{versions.get('dva-sim')} {versions.get('fingerprint')}"


def _earlier(hashes: Sequence[str]) -> tuple[str, str]:
    if not hashes:
        return "none told", ""
    return f"{len(hashes)}: {', '.join(h[:_DIGITS] for h in hashes)}", ""
