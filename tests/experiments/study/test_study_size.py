"""A study that is larger than anybody means is refused at once; a large one says what it does."""

import pytest
from helpers.studies.small_study import REPEATED, STUDY, study_in, write_study

from dva_sim.cli import study_runs
from dva_sim.experiments.execution import dry_run
from dva_sim.experiments.execution.dry_run import DryRun
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.factor_levels import runs_of
from dva_sim.options.studies import RunOptions


@pytest.mark.parametrize("text", [STUDY, REPEATED])
def test_the_number_of_runs_is_known_without_their_list(tmp_path, text):
    study = study_in(tmp_path, text=text)
    assert runs_of(study) == len(cell_grid.jobs(study))


def test_what_takes_a_while_is_told(tmp_path, monkeypatch, capsys):
    plan = DryRun(42, 0, 9, 1, 2, None, 0, "")
    monkeypatch.setattr(dry_run, "dry_run", lambda *_, **__: plan)
    monkeypatch.setattr(study_runs, "_SLOW_TO_CHECK", 1)
    monkeypatch.setattr(study_runs, "_MANY_RUNS", 1)
    path = str(write_study(tmp_path))
    study_runs.plan(RunOptions(path, tmp_path / "out"))
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("Checking every configuration")
    assert lines[-5].startswith("9/9 configurations")
    assert "up to 42 runs" in lines[-4]
