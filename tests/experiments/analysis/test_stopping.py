"""Stopping rule of a study: whole batches, in seed order, on measured values."""

import math

import numpy as np
import pytest
from helpers.studies.small_study import REPEATED, STUDY, study_in

from dva_sim.experiments.analysis import stopping
from dva_sim.experiments.results.results import frame_of
from dva_sim.experiments.results.tables import design_row
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.addresses import REFERENCE
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.statistics import mean_interval

STOP = (
    "stop: {half_width: 1.0, measure: drive_time_s, part: drive, batch_persons: 4, "
    "most_persons: 10}\n"
)
ON_ANSWER = "stop: {half_width: 1.0, comparison: answer, batch_persons: 2, most_persons: 8}\n"


def persons_of(batches):
    return [sorted({job.person for job in batch}) for batch in batches]


def rounds_of(study):
    return StudyPlan.of(study).rounds


def rows_of(study, time_of, persons):
    """Rows as the runs of some persons would leave them."""
    return [
        design_row(job) | {"drive_time_s": time_of(job)}
        for job in cell_grid.jobs(study)
        if job.person < persons and not job.is_repeat
    ]


def half_widths(study, rows):
    return stopping.half_widths(study, study.stop, frame_of(rows))


def is_enough(study, rows):
    return stopping.widest(study, study.stop, frame_of(rows)) <= study.stop.half_width


def test_a_study_that_nothing_stops_is_one_batch(tmp_path):
    plan = StudyPlan.of(study_in(tmp_path))
    assert plan.rounds == [plan.jobs]


def test_the_first_batch_is_the_studys_persons_and_others_follow_up_to_the_most(tmp_path):
    study = study_in(tmp_path, text=STUDY + STOP)
    batches = rounds_of(study)
    assert persons_of(batches) == [[0, 1, 2], [3, 4, 5, 6], [7, 8, 9]]


def test_batches_hold_every_job_once_and_repeats_come_with_their_persons(tmp_path):
    study = study_in(tmp_path, text=REPEATED + STOP)
    batches = rounds_of(study)
    every = sorted(job.key for job in cell_grid.jobs(study))
    assert sorted(job.key for batch in batches for job in batch) == every
    assert {job.person for job in batches[0] if job.is_repeat} == {0, 1}


def test_what_is_run_first_is_what_a_study_of_so_many_persons_runs(tmp_path):
    few = cell_grid.jobs(study_in(tmp_path))
    study = study_in(tmp_path, text=STUDY + STOP)
    first = rounds_of(study)[0]
    assert [job.key for job in first] == [job.key for job in few]


def test_a_budget_alone_makes_small_batches(tmp_path):
    study = study_in(tmp_path, "persons=5", text=STUDY + "budget_s: 60\n")
    assert persons_of(rounds_of(study)) == [[0, 1], [2, 3], [4]]


def noisy(job):
    """Persons differ by a second or so, trials by less."""
    rng = np.random.default_rng([job.person, job.trial, job.cell + 1])
    return 40 + rng.normal(0, 1.5)


def test_the_width_is_that_of_the_mean_in_every_cell_over_the_reference(tmp_path):
    study = study_in(tmp_path, text=STUDY + STOP)
    rows = rows_of(study, noisy, 6)
    found = half_widths(study, rows)
    aside = {
        (row["person"], row["trial"]): row["drive_time_s"]
        for row in rows
        if row["part"] == "drive" and row["cell"] == REFERENCE
    }
    cell = [row for row in rows if row["part"] == "drive" and row["cell"] == 2]
    excess = [row["drive_time_s"] - aside[row["person"], row["trial"]] for row in cell]
    expected = mean_interval(excess, [row["person"] for row in cell])
    assert len(found) == 4
    assert found[2] == pytest.approx((expected.high - expected.low) / 2)


def test_it_is_enough_once_every_width_is_below_the_bound(tmp_path):
    def spread(scale):
        return lambda job: 40 + scale * (noisy(job) - 40)

    study = study_in(tmp_path, text=STUDY + STOP)
    assert is_enough(study, rows_of(study, spread(0.1), 6))
    assert not is_enough(study, rows_of(study, spread(3), 6))

    def one_wide_cell(job):
        return spread(3 if job.part == "drive" and job.cell == 3 else 0.1)(job)

    assert not is_enough(study, rows_of(study, one_wide_cell, 6))


@pytest.mark.parametrize("text", [STUDY + STOP, STUDY + ON_ANSWER])
def test_where_all_persons_are_alike_the_first_batch_is_enough(tmp_path, text):
    study = study_in(tmp_path, text=text)
    rows = rows_of(study, lambda job: 40.0 + job.cell, 3)
    assert (half_widths(study, rows) == 0).all()
    assert is_enough(study, rows)


def test_a_contrast_is_paired_so_what_a_person_brings_along_does_not_count(tmp_path):
    study = study_in(tmp_path, text=STUDY + ON_ANSWER)

    def persons_differ_patterns_hardly(job):
        effect = 5 if job.levels.get("pattern") == "req-rep" else 0
        return 100 * job.person + 10 * job.trial + effect + 0.01 * noisy(job)

    rows = rows_of(study, persons_differ_patterns_hardly, 6)
    found = half_widths(study, rows)
    assert found.shape == (2,)  # at every level that the contrast runs over
    assert (found < 0.1).all()
    assert is_enough(study, rows)


def test_with_one_person_or_without_values_nothing_is_enough(tmp_path):
    study = study_in(tmp_path, text=STUDY + STOP)
    assert not is_enough(study, rows_of(study, lambda _: 40.0, 1))
    assert not is_enough(study, rows_of(study, lambda _: math.nan, 6))
    assert not is_enough(study, [])


def test_failed_runs_are_left_out(tmp_path):
    study = study_in(tmp_path, text=STUDY + ON_ANSWER)
    rows = [row for row in rows_of(study, noisy, 8) if (row["person"], row["cell"]) != (3, 1)]
    assert np.isfinite(half_widths(study, rows)).all()


def test_a_stop_on_a_schedule_doubles_and_shares_the_chance_to_err(tmp_path):
    scheduled = ON_ANSWER.replace("batch_persons: 2", "batch_persons: double")
    study = study_in(tmp_path, text=STUDY + scheduled)
    assert persons_of(rounds_of(study)) == [
        [0, 1, 2],
        [3, 4, 5],
        [6, 7],
    ]
    assert study.stop.level(study.persons) == pytest.approx(1 - 0.05 / 3)
    plain = study_in(tmp_path, text=STUDY + ON_ANSWER)
    assert plain.stop.level(plain.persons) == 0.95
    rows = rows_of(study, noisy, 8)
    wide, narrow = (half_widths(s, rows) for s in (study, plain))
    assert (wide > 1.05 * narrow).all()
