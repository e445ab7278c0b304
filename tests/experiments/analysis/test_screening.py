"""Screening of assumed numbers: what is run, what is found, and what is refused."""

import copy
import csv
import json

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.experiments.analysis.screening import TABLE
from dva_sim.experiments.execution.scheduling import run_job
from dva_sim.experiments.report.figures.screening import FIGURE, draw_screening
from dva_sim.experiments.study.factor_levels import runs_of
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.screening import (
    KEPT,
    MAIN,
    file_of,
    kept_effects,
    screened,
    screening_study,
)
from dva_sim.experiments.trials import screen

STUDY = """
question: Does it matter?
persons: 2
replications: 1
factors: {pattern: [req-rep, latest-wins], link.delay_s: [0, 1.0]}
parts:
  drive: {scenario: drive-to-event, changes: {horizon_s: 1}}
answer:
  part: drive
  measure: drive_time_s
  factor: pattern
  contrast: [req-rep, latest-wins]
  over: link.delay_s
screening:
  over: [operator.habits.waiting.s*, operator.habits.waiting.patience, phone.tremor_deg]
  trajectories: 2
  persons: 2
  seed: 5
"""
MADE: dict[str, list[dict[str, object]]] = {}  # of one run, as all others look alike
WAITING = "operator.habits.waiting."


def study(tmp_path, text=STUDY):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    return open_study(str(file))


def pretend(job):
    """A run whose drive takes 100 s a second of the shortest move longer under REQ/REP."""
    if not MADE:
        MADE.update(run_job(job))
    tables = copy.deepcopy(MADE)
    waiting = job.scenario.operator.habits.waiting
    extra = 100.0 * waiting.shortest_s - 2.0 * waiting.patience
    (row,) = tables["runs"]
    row["drive_time_s"] = 40.0 + extra * (job.scenario.pattern == "req-rep")
    return tables


def test_the_study_that_screens_varies_what_the_patterns_name_at_the_longest_delay(tmp_path):
    asked = study(tmp_path)
    keys = [each.key for each in screened(asked)]
    assert [key.startswith(WAITING) for key in keys] == [True] * 4 + [False]
    trials = screening_study(asked)
    assert trials.factors["link.delay_s"] == (1.0,)
    assert runs_of(trials) == 2 * (len(keys) + 1) * 2 * 2
    for each in screened(asked):
        values = [row[each.key] for row in trials.listed_rows]
        assert each.low <= min(values) < max(values) <= each.high, each.key


def test_what_moves_the_answer_is_found_drawn_and_written(tmp_path):
    asked, folder = study(tmp_path), tmp_path / "out"
    found = screen(asked, folder, jobs=1, episode=pretend)
    (first, most), (second, less) = found.most_moving
    assert (first.key, second.key) == (f"{WAITING}shortest_s", f"{WAITING}patience")
    assert most.mean.mean > 0 > less.mean.mean
    assert less.size == pytest.approx(2.0 * np.ptp([1.5, 6.0]), rel=0.6)
    text = " ".join(draw_screening(asked, found, folder))
    assert unnamed(text, "3 of the numbers do not", first.key, second.key, FIGURE) == []
    assert (folder / FIGURE).read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader(found.write(folder / TABLE).read_text().splitlines()))
    assert [row["key"] for row in rows[:2]] == [first.key, second.key]
    assert len(rows) == len(screened(asked))
    assert (folder / TABLE).is_file()

    again = screen(asked, folder, jobs=1, episode=refuse)  # nothing is left to run
    assert again == found
    assert json.loads((folder / "manifest.json").read_text())["runs"] == 2 * 6 * 2 * 2


def refuse(job):
    raise AssertionError("was run already")


def test_what_a_screening_found_is_kept_beside_its_study_for_the_reports_of_others(
    tmp_path, monkeypatch
):
    asked = study(tmp_path)
    found = screen(asked, tmp_path / "out", jobs=1, episode=pretend)
    assert file_of(asked) == tmp_path / "screened" / "mine.csv"
    monkeypatch.chdir(tmp_path)
    found.write(tmp_path / KEPT / f"{MAIN}.csv")
    (largest,) = kept_effects(1)
    assert largest.key == f"{WAITING}shortest_s"
    assert largest.is_clear == (
        found.numbers[0][1].mean.low > 0 or found.numbers[0][1].mean.high < 0
    )
    assert len(kept_effects(5)) == 2  # the others do not move it at all
