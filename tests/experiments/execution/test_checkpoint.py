import math
import random
import sqlite3

import pytest
from helpers.studies.small_study import study_in

from dva_sim.experiments.execution import scheduling
from dva_sim.experiments.execution.checkpoint import Checkpoint, NotBegun, RunOutcome
from dva_sim.experiments.execution.dry_run import dry_run
from dva_sim.experiments.results.results import JOURNAL
from dva_sim.experiments.study import cell_grid
from dva_sim.kernel.errors import DvaSimError


def outcome(seed: int, tables: str | None = "{}", error: str | None = None) -> RunOutcome:
    return RunOutcome(("abc", seed), tables, 0.5, error)


def test_a_run_kept_twice_is_kept_once_and_as_it_was_first(tmp_path):
    with Checkpoint(tmp_path, "me") as one, Checkpoint(tmp_path, "me") as two:
        one.add([outcome(1, '{"runs":[]}')])
        two.add([outcome(1, '{"late":[]}'), outcome(2)])
        assert one.done() == {("abc", 1), ("abc", 2)}
        assert one.tables(("abc", 1)) == {"runs": []}
        assert two.costs() == {("abc", 1): 0.5, ("abc", 2): 0.5}


def test_a_journal_that_was_killed_as_it_was_created_is_begun_anew(tmp_path):
    (tmp_path / JOURNAL).touch()
    with pytest.raises(NotBegun, match="run the study again"):
        Checkpoint(tmp_path, "me", must_exist=True)
    assert dry_run(study_in(tmp_path), tmp_path).done == 0
    with Checkpoint(tmp_path, "me") as journal:
        assert journal.done() == set()


def test_floats_come_back_to_the_last_bit(tmp_path):
    job = cell_grid.jobs(study_in(tmp_path))[0]
    rng = random.Random(1)
    values = [rng.uniform(-1, 1) * 10.0 ** rng.randint(-300, 300) for _ in range(200)]
    values += [math.inf, -0.0, 5e-324]
    with Checkpoint(tmp_path, "me") as journal:
        journal.add([scheduling.perform(job, lambda _: {"runs": [{"x": v} for v in values]})])
        found = [row["x"] for row in journal.tables(job.key)["runs"]]
    assert list(map(repr, found)) == list(map(repr, values))


def test_a_success_takes_the_place_of_a_failure_but_not_the_reverse(tmp_path):
    with Checkpoint(tmp_path, "me") as journal:
        journal.add([outcome(1, None, "fell"), outcome(2, None, "sank")])
        journal.add([outcome(1)])
        journal.add([outcome(1, None, "fell again")])
        assert journal.failures() == {("abc", 2): "sank"}
        assert journal.done() == {("abc", 1)}


def test_a_full_disk_is_told_in_one_line_and_loses_nothing(tmp_path):
    with Checkpoint(tmp_path, "me") as journal:
        journal.add([outcome(1)])
        journal._db.execute("PRAGMA max_page_count = 1")
        with pytest.raises(DvaSimError, match="disk is full"):
            journal.add([outcome(2, '"' + "x" * 100_000 + '"')])
    with Checkpoint(tmp_path, "me") as journal:
        assert journal.done() == {("abc", 1)}


def test_a_journal_held_by_another_program_is_told_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("dva_sim.experiments.execution.checkpoint._PATIENCE_S", 0)
    with Checkpoint(tmp_path, "me") as journal:
        journal._db.execute("PRAGMA busy_timeout = 0")
        other = sqlite3.connect(tmp_path / JOURNAL, isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(DvaSimError, match="held by another program"):
            journal.add([outcome(1)])
        other.execute("ROLLBACK")
        other.close()
        journal.add([outcome(1)])
        assert journal.done() == {("abc", 1)}
