"""Bugs of a study's journal, planted: the kills that S9 is shown by find each of them."""

import json
import os
import random

import pytest
from helpers.studies import interrupted_study as interrupted
from helpers.studies import small_study as kit

from dva_sim.experiments.execution import checkpoint
from dva_sim.experiments.execution.checkpoint import Checkpoint, RunOutcome
from dva_sim.experiments.execution.session import StudySession

KILLS = 40


def written_early(monkeypatch):
    """A run is in the journal before it has ended; its tables come when it has."""
    run = StudySession.run

    def early(self, rest):
        self.journal.add([RunOutcome(job.key, json.dumps({"runs": []})) for job in rest])
        run(self, rest)

    monkeypatch.setattr(StudySession, "run", early)
    replaced = checkpoint._ADD.replace("WHERE tables IS NULL", "WHERE true")
    monkeypatch.setattr(checkpoint, "_ADD", replaced)


def done_again(monkeypatch):
    """A study that goes on does every run again, and adds a row for each."""
    schema = checkpoint._SCHEMA.replace("PRIMARY KEY (config, seed), ", "")
    monkeypatch.setattr(checkpoint, "_SCHEMA", schema)
    monkeypatch.setattr(checkpoint, "_ADD", "INSERT INTO runs VALUES (?, ?, ?, ?, ?)")
    monkeypatch.setattr(Checkpoint, "done", lambda self: set())


def found(folder, plant, monkeypatch, kills=KILLS):
    """The number of the kill after which the study ended otherwise, and what was wrong."""
    study, rng = kit.study_in(folder), random.Random(2)
    quiet = folder / "quiet"
    interrupted.run(quiet, study)
    whole = kit.files(quiet)
    calls = interrupted.calls_of(folder / "counted", study)
    plant(monkeypatch)
    for kill in range(1, kills + 1):
        out = folder / f"killed-{kill}"
        interrupted.ended(interrupted.killed_at_a_call(out, study, rng.randrange(1, calls)))
        assert interrupted.ended(interrupted.forked(lambda out=out: interrupted.run(out, study)))
        if interrupted.doubled(out):
            return kill, "doubled"
        if kit.files(out) != whole:
            return kill, "other tables"
    return None


@pytest.mark.system
@pytest.mark.invariant("S9")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize(
    ("plant", "wrong"), [(written_early, "other tables"), (done_again, "doubled")]
)
def test_kills_find_a_bug_of_the_journal(plant, wrong, tmp_path, monkeypatch):
    kill, what = found(tmp_path, plant, monkeypatch)
    assert (what, kill <= KILLS) == (wrong, True)


@pytest.mark.system
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_kills_find_nothing_where_no_bug_is_planted(tmp_path, monkeypatch):
    assert found(tmp_path, lambda _: None, monkeypatch, 8) is None
