"""Cases played through the real core and policies, spread over processes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel.streams import derive_seed
from dva_sim.simulation.models import Tables
from dva_sim.simulation.timed import simulate_timed
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.validation.dispatch.batch_measures import (
    Batches,
    Floats,
    Sample,
    extract_sample,
    occupied,
    sums,
)
from dva_sim.validation.dispatch.cases import Case
from dva_sim.validation.dispatch.estimation import (
    ERRORS,
    PRECISION,
    TOLERANCE,
    Estimate,
    certain,
    controls,
    estimate,
    expected_alarms,
    half_band,
    inputs,
    verdict,
)
from dva_sim.validation.dispatch.identities import IDENTITIES, check_identity
from dva_sim.validation.evidence import NORMAL_95, Evidence, share_rule
from dva_sim.validation.evidence_page import ValidationResult
from dva_sim.validation.frame import Key, Progress, Row, make_job, play_jobs

Columns = dict[str, Floats]
FAILED = "a run of case {!r} failed"
LOOK_AGAIN = 4  # times as many runs, in all, for a case that seems to differ
GROUPS = {"input": "What the scenarios put in", "identity": "Identities"}
"""Headings of checks that are alike in all cases."""


def check_cases(
    cases: Sequence[Case],
    seed: int,
    quick: bool,
    workers: int,
    progress: Progress = lambda done: None,
) -> list[Evidence]:
    """Play all cases and compare.

    A case that differs by more than chance easily explains is played again, longer, and judged
    by all its runs together: what was chance goes away, and what is wrong shows more clearly.

    Args:
        seed: Random seed.
        quick: Play as little as the cases say for that.
        workers: Processes.
        progress: Callback with the number of finished runs.

    Raises:
        RunsFailed: a run failed.
    """
    everything = [job for case in cases for job in _jobs(case, seed, _runs(case, quick))]
    rows = play_jobs(everything, play, workers, FAILED, progress)
    checks = []
    for case in cases:
        runs = _runs(case, quick)
        lines = _compare(case, _columns(_jobs(case, seed, runs), rows))
        off = [e for e in lines if e.verdict == "misses" and e.predicted_low is not None]
        if off:
            again = _jobs(case, seed, LOOK_AGAIN * runs)
            rows |= play_jobs(again[runs:], play, workers, FAILED)
            why = f"{LOOK_AGAIN} times as long, for {', '.join(f'{e.claim} {e.note}' for e in off)}"
            longer = _compare(case, _columns(again, rows))
            lines = [replace(e, note="; ".join(filter(None, (e.note, why)))) for e in longer]
        checks += lines
    return checks


def play(job: StudyJob) -> Tables:
    """Play one run; return numerator and denominator of each measure, and controls, by batch."""
    scenario = cast(TimedScenario, job.scenario)
    levels = job.levels
    sample = extract_sample(simulate_timed(scenario, job.seed))
    batches = Batches(sample, int(str(levels["batches"])))
    columns: Columns = {"events": batches.count(np.ones(len(sample.stream), dtype=bool))}
    columns["broken"] = np.full(len(batches.lengths), float(sample.broken))
    columns["open"] = batches.count(sample.outcome == "open")
    share = batches.lengths / batches.lengths.sum()
    columns["worked"] = sum(sample.worked) * share
    columns["had work"] = occupied(sample.busy_from, sample.busy_until, batches.edges)
    for name, (area, by_event) in _little(sample, batches).items():
        columns[f"area {name}"] = area
        columns[f"times {name}"] = by_event
    for number, name in enumerate(json.loads(str(levels["measures"]))):
        columns[f"top {number}"], columns[f"bottom {number}"] = sums(name, batches)
    for name, (top, bottom) in inputs(batches, scenario).items():
        columns[f"in {name}"] = top
        columns[f"expected {name}"] = bottom
    for name, values in controls(batches, scenario).items():
        columns[f"control {name}"] = values
    names = list(columns)
    rows = np.column_stack(list(columns.values()))
    return {"rows": [dict(zip(names, row.tolist(), strict=True)) for row in rows]}


def check_identities(seed: int, progress: Progress = lambda done: None) -> list[Evidence]:
    """Look at everything that must hold exactly, in any world.

    Args:
        seed: Random seed of the checks.
        progress: Callback with the number of finished checks.
    """
    lines = []
    for done, name in enumerate(IDENTITIES, start=1):
        for claim, off in check_identity(name, seed):
            lines.append(_line(name, GROUPS["identity"], claim, 0.0, certain(off)))
        progress(done)
    return lines


def runs_of(cases: Sequence[Case], quick: bool) -> int:
    """Return the number of runs needed to check all cases."""
    return sum(_runs(case, quick) for case in cases)


def _runs(case: Case, quick: bool) -> int:
    return case.quick_runs if quick else case.runs


def _jobs(case: Case, seed: int, runs: int) -> list[StudyJob]:
    measures = json.dumps(list(case.exact))
    seeds = [derive_seed("validation", case.name, seed, trial) for trial in range(runs)]
    return [
        make_job(case.name, own, case.scenario, batches=case.batches, measures=measures)
        for own in seeds
    ]


def _little(sample: Sample, batches: Batches) -> dict[str, tuple[Floats, Floats]]:
    """Return the number waiting and in service.

    Integrated by the model, and from the events' times.

    The first follows what happens as it happens, the second is who came and went when. Their
    ratio is 1 in every run, not only on average: Little's law, path by path.
    """
    sent = np.where(np.isnan(sample.assigned), sample.closed, sample.assigned)
    acts = np.isfinite(sample.act_assigned)
    until = np.maximum(sample.confirmed, sample.act_assigned)[acts]
    waits = occupied(sample.detected, sent, batches.edges)
    waits += occupied(sample.confirmed[acts], until, batches.edges)
    stays = occupied(sample.detected, sample.closed, batches.edges)
    share = batches.lengths / batches.lengths.sum()
    return {
        "waiting": (sample.waiting_area * share, waits),
        "served": (sample.served_area * share, stays - waits),
    }


def _columns(jobs: Sequence[StudyJob], rows: Mapping[Key, list[Row]]) -> Columns:
    """Return the batches of all runs of a case, run after run."""
    batches = [row for job in jobs for row in rows[job.key]]
    return {name: np.array([row[name] for row in batches], dtype=float) for name in batches[0]}


def _compare(case: Case, columns: Columns) -> list[Evidence]:
    """Return all lines that judge a case: its results, its inputs, and general identities."""
    variates = [values for name, values in columns.items() if name.startswith("control ")]
    controls = np.column_stack(variates) if variates else None
    comparisons = [
        ("result", measure, exact, estimate(columns[f"top {n}"], columns[f"bottom {n}"], controls))
        for n, (measure, exact) in enumerate(case.exact.items())
    ]
    for name in (name.removeprefix("in ") for name in columns if name.startswith("in ")):
        share = estimate(columns[f"in {name}"], columns[f"expected {name}"])
        comparisons.append(("input", f"{name}, share of the expected", 1.0, share))
    for name in ("waiting", "served"):
        area = columns[f"area {name}"].sum()
        times = columns[f"times {name}"].sum()
        law = "identity", f"Little's law, {name}", 1.0, certain(area / times if times else 1.0)
        comparisons.append(law)
    worked = columns["worked"].sum()
    had = columns["had work"].sum()
    same = certain(worked / had if had else 1.0)
    comparisons.append(("identity", "work by the units over work by the events", 1.0, same))
    lost = columns["open"].sum() + columns["broken"].max()
    comparisons.append(("identity", "events lost, rules broken", 0.0, certain(lost)))
    lines = []
    for kind, measure, exact, value in comparisons:
        is_strict = kind == "result" and measure not in case.loosely
        precision = PRECISION if is_strict else None
        line = _line(case.name, GROUPS.get(kind, case.title), measure, exact, value, precision)
        lines.append(replace(line, source=case.source, sample=int(columns["events"].sum())))
    return lines


def _line(
    case: str,
    group: str,
    claim: str,
    exact: float,
    estimated: Estimate,
    precision: float | None = None,
) -> Evidence:
    """Return the line of a comparison; its note gives the deviation in standard errors."""
    half = half_band(estimated.error, exact, estimated.batches)
    spread = NORMAL_95 * estimated.error if estimated.error > 0 else None
    note = ""
    if spread is not None:
        note = f"{(estimated.value - exact) / estimated.error:+.2f} SE"
        if estimated.plain != estimated.value:
            note += f", {(estimated.plain - exact) / estimated.plain_error:+.2f} without controls"
    return Evidence(
        "dispatch",
        group,
        f"{case} {claim}",
        claim,
        measured=exact,
        predicted=estimated.value,
        predicted_low=None if spread is None else estimated.value - spread,
        predicted_high=None if spread is None else estimated.value + spread,
        low=exact - half,
        high=exact + half,
        verdict=verdict(estimated, exact, precision),
        note=note,
    )


def evidence(
    lines: Sequence[Evidence], conditions: Mapping[str, str], quick: bool
) -> ValidationResult:
    """Return the result of all checks: all must agree, and of a full run none may be too rough.

    Args:
        lines: The checks.
        conditions: Conditions of the runs, by name.
        quick: True if only few runs were made, which may be too rough.
    """
    events = sum({e.line.split()[0]: e.sample for e in lines}.values())
    rough = sum(e.verdict == "too rough" for e in lines)
    rule = share_rule(
        "dispatch",
        "all checks",
        sum(e.verdict != "misses" for e in lines),
        len(lines),
        note=f"within {ERRORS:g} standard errors or {100 * TOLERANCE:g} %",
    )
    precise = share_rule(
        "dispatch",
        "precision",
        len(lines) - rough,
        len(lines),
        note=f"standard errors up to {100 * PRECISION:g} % of the exact value",
    )
    if quick:
        precise = replace(
            precise, verdict="shown only", note=f"{precise.note}, no rule of a quick run"
        )
    return ValidationResult(
        [*sorted(lines, key=lambda line: line.group in GROUPS.values()), rule, precise],
        notes=[_chance(lines)],
        conditions={**conditions, "events played": f"{events:,}"},
    )


def _chance(lines: Sequence[Evidence]) -> str:
    """Say how many right checks would miss on average, and how many are far off."""
    errors = [
        (e.predicted, e.measured, (e.predicted_high - e.predicted_low) / (2 * NORMAL_95))
        for e in lines
        if e.predicted_low is not None and e.predicted_high is not None
    ]
    off = sum(
        abs(value - exact) > ERRORS * error
        for value, exact, error in errors
        if value is not None and exact is not None
    )
    return (
        f"{len(errors)} of the checks leave something to chance; if everything is right, up to "
        f"{expected_alarms(len(errors)):.1f} of them miss all the same, on average. "
        f"Here {off} lie beyond {ERRORS:g} standard errors."
    )
