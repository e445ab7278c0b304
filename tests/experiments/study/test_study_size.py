"""A study that is larger than anybody means is refused at once; a large one says what it does."""

import pytest
from helpers.studies.small_study import REPEATED, STUDY, study_in, write_study

from dva_sim.cli import study_runs
from dva_sim.experiments.execution import dry_run
from dva_sim.experiments.execution.dry_run import DryRun
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.factor_levels import runs_of
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.tuning import tuning_study
from dva_sim.kernel.errors import ConfigError
from dva_sim.options.studies import RunOptions


@pytest.mark.parametrize("setting", ["persons=100000000", "replications=100000000"])
def test_more_runs_than_anybody_can_wait_for_are_refused_without_being_listed(
    tmp_path, monkeypatch, setting
):
    monkeypatch.setattr(cell_grid, "jobs", pytest.fail)
    text = rf"--set {setting}: there would be .* runs, more than 1,000,000; have fewer"
    with pytest.raises(ConfigError, match=text):
        study_in(tmp_path, setting)


def test_a_pilot_and_a_stopping_rule_and_a_tuning_are_no_way_round_it(tmp_path):
    with pytest.raises(ConfigError, match="pilot of 1000000 persons: "):
        load_study(write_study(tmp_path), pilot=1_000_000)
    stop = "stop: {half_width: 1, comparison: answer, batch_persons: 2, most_persons: 999999}\n"
    with pytest.raises(ConfigError, match=r"study\.yaml:22:\d+: there would be"):
        study_in(tmp_path, text=STUDY + stop)
    tuning = (
        "tuning:\n  {key: command.rate_hz, levels: [1, 2], by: [pattern], part: drive,"
        " measure: drive_time_s, seed: 9, persons: 99999999}\n"
    )
    with pytest.raises(ConfigError, match="tuning: there would be"):
        tuning_study(study_in(tmp_path, text=STUDY + tuning))


@pytest.mark.parametrize("text", [STUDY, REPEATED])
def test_the_number_of_runs_is_known_without_their_list(tmp_path, text):
    study = study_in(tmp_path, text=text)
    assert runs_of(study) == len(cell_grid.jobs(study))


def test_what_takes_a_while_is_told(tmp_path, monkeypatch, capsys):
    plan = DryRun(42, 0, 9, 1, 2, None, 0, "")
    monkeypatch.setattr(dry_run, "dry_run", lambda *_, **__: plan)
    monkeypatch.setattr(study_runs, "_MANY", 1)
    monkeypatch.setattr(study_runs, "_MANY_RUNS", 1)
    path = str(write_study(tmp_path))
    study_runs.plan(RunOptions(path, tmp_path / "out"))
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("Checking every configuration")
    assert lines[-5].startswith("9/9 configurations")
    assert "up to 42 runs" in lines[-4]
