"""What the report of ten thousand runs costs, and whether more runs cost more."""

from __future__ import annotations

import time

import synthetic_study
from benchmarks.goals import goal

from dva_sim.experiments.report.report import write_report

PERSONS = 24
MANY, FEW = 12, 1  # trials of each person
MOST_S = 10.0  # of CPU, for the report of the many
MOST_RATIO = 1.5  # to that of a twelfth of the runs: what costs are the figures


def results(folder, trials):
    runs = synthetic_study.drive_rows(PERSONS, trials)
    tables = {
        "runs": runs,
        "events": synthetic_study.story_rows(PERSONS),
        "tracks": synthetic_study.track_rows(),
    }
    return synthetic_study.write(folder, tables, synthetic_study.manifest(PERSONS, trials)), len(
        runs
    )


def cost_of(folder):
    started = time.process_time()
    write_report(folder)
    return time.process_time() - started


def test_the_report_of_ten_thousand_runs_takes_seconds(benchmark, tmp_path):
    few, _ = results(tmp_path / "few", FEW)
    many, runs = results(tmp_path / "many", MANY)
    assert runs > 10_000
    write_report(few)  # imports and fonts are paid for
    least = cost_of(few)
    most = benchmark.pedantic(cost_of, args=(many,), rounds=1)
    print(
        f"\nreport of {runs:,} runs: {most:.1f} s of CPU, {most / least:.2f} of a twelfth of them"
    )
    goal("seconds of CPU", most, most=MOST_S)
    goal("many runs over few", most / least, most=MOST_RATIO)
