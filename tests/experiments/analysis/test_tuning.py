import math

import pytest
from helpers.studies import small_study as kit
from helpers.wording import unnamed

from dva_sim.cli import study_runs
from dva_sim.experiments.execution.dry_run import dry_run
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.tuning import choose, file_of, load_tuned, save_tuned, tuning_study
from dva_sim.experiments.trials import tune
from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.options.studies import TuneOptions

STUDY = """\
question: Which is quicker?
seed: 3
persons: 3
replications: 2
factors:
  pattern: [req-rep, latest-wins]
  link.delay_s: [0, 0.25]
  tuning: [untuned, tuned]
tuning:
  key: command.rate_hz
  levels: [1, 2, 4, 8]
  by: [pattern]
  at: {link.delay_s: 0.25}
  part: drive
  measure: drive_time_s
  persons: 2
  replications: 3
  seed: 7001
parts:
  drive: {scenario: one.yaml, replications: 1}
"""
BEST = {"req-rep": 2.0, "latest-wins": 8.0}


def bowl(job):
    """Least at the best rate of each pattern, the same distance up for half and double."""
    distance = math.log2(job.scenario.command.rate_hz / BEST[job.scenario.pattern])
    return {"runs": [{"drive_time_s": 10 + distance**2}]}


def study_in(folder, *settings, old="", new=""):
    return load_study(kit.write_study(folder, STUDY.replace(old, new)), settings)


def kept(folder):
    study = study_in(folder)
    save_tuned(study, tune(study, folder / "trials", jobs=1, episode=bowl))
    return study


def test_the_best_value_is_found_for_each_level_on_its_own(tmp_path):
    tuned = tune(study_in(tmp_path), tmp_path / "trials", jobs=1, episode=bowl)
    assert {c.when["pattern"]: c.value for c in tuned.chosen} == BEST
    assert len(tuned.seen) == 2 * 4
    means = {s.value: s.mean for s in tuned.seen if s.when == {"pattern": "req-rep"}}
    assert means == {1.0: 11.0, 2.0: 10.0, 4.0: 11.0, 8.0: 14.0}


def test_of_equal_values_the_nearest_to_one_is_chosen():
    assert choose({0.25: 5.0, 0.5: 5.0, 3.0: 5.0}) == 0.5
    assert choose({0.5: 5.0, 4.0: 4.9}) == 4.0


def test_every_level_gets_the_same_budget_on_other_persons(tmp_path):
    study = study_in(tmp_path)
    own = {job.seed for job in cell_grid.jobs(study_in(tmp_path, "tuning=untuned"))}
    trials = cell_grid.jobs(tuning_study(study))
    assert len(trials) == 2 * 4 * 2 * 3
    assert {job.scenario.operator.population_seed for job in trials} == {7001}
    assert not {job.seed for job in trials} & own
    assert {job.scenario.link.delay_s for job in trials} == {0.25}


def test_cells_take_the_tuned_value_or_the_scenarios_own(tmp_path):
    cells = cell_grid.cells(kept(tmp_path))
    rates = {
        (cell.scenario.pattern, dict(cell.levels)["tuning"]): cell.scenario.command.rate_hz
        for cell in cells
    }
    assert rates == {
        ("req-rep", "untuned"): 10.0,
        ("latest-wins", "untuned"): 10.0,
        ("req-rep", "tuned"): 2.0,
        ("latest-wins", "tuned"): 8.0,
    }


def test_what_was_tuned_is_kept_with_all_that_was_seen_and_the_same_bytes(tmp_path):
    study = kept(tmp_path)
    before = file_of(study).read_bytes()
    assert file_of(study) == tmp_path / "tuned" / "study.yaml"
    tuned = load_tuned(study)
    save_tuned(study, tuned)
    assert file_of(study).read_bytes() == before
    assert len(tuned.seen) == 8
    assert tuned.tuning == study.tuning


def test_other_persons_or_phones_are_told_and_their_descriptions_are_none_of_it(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    kept(tmp_path)

    def remark():
        return dry_run(study_in(tmp_path), tmp_path / "out", jobs=1).remark

    def edit(folder, name, old, new):
        path = tmp_path / "agents" / folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        text = resources.find(name, f"agents/{folder}").read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    assert remark() == ""
    edit("people", "operators.yaml", "Persons who drive", "Those who drive")
    edit("people", "operators.yaml", "margin:", "# less is calmer\nmargin:")
    assert remark() == ""
    edit(
        "people", "operators.yaml", "crossover_rad_s:", "crossover_rad_s: {median: 9, spread: 0} #"
    )
    assert unnamed(remark(), "other persons:", "'dva-sim tune study'") == []
    edit("phones", "default.yaml", "accelerometer:", "accelerometer: perfect #")
    assert unnamed(remark(), "other persons and phones:", "'dva-sim tune study'") == []
    assert dry_run(study_in(tmp_path, "tuning=untuned"), tmp_path / "out", jobs=1).remark == ""


def test_a_study_that_was_not_tuned_says_how(tmp_path):
    with pytest.raises(ConfigError, match="'dva-sim tune study' makes"):
        cell_grid.cells(study_in(tmp_path))
    assert cell_grid.cells(study_in(tmp_path, "tuning=untuned"))


def test_values_made_by_another_rule_and_a_level_that_was_not_tuned_are_refused(tmp_path):
    kept(tmp_path)
    with pytest.raises(ConfigError, match="tuned for pattern pub-sub"):
        cell_grid.cells(study_in(tmp_path, "pattern=pub-sub"))
    with pytest.raises(ConfigError, match="made by another rule"):
        cell_grid.cells(study_in(tmp_path, old="persons: 2", new="persons: 4"))


def test_nothing_is_chosen_from_runs_that_failed(tmp_path):
    def unlucky(job):
        if job.person == 1 and job.scenario.command.rate_hz == 8:
            raise RuntimeError("fell into a hole")
        return bowl(job)

    with pytest.raises(DvaSimError, match="6 runs failed"):
        tune(study_in(tmp_path), tmp_path / "trials", jobs=1, episode=unlucky)


def test_a_measure_that_no_run_has_is_refused(tmp_path):
    study = study_in(tmp_path, old="measure: drive_time_s", new="measure: mood")
    with pytest.raises(ConfigError, match="'mood' is unknown; known: "):
        tune(study, tmp_path / "trials", jobs=1, episode=bowl)


def test_the_command_tries_chooses_tells_and_keeps(tmp_path, capsys):
    rule = {"levels: [1, 2, 4, 8]": "levels: [5, 10]", "persons: 2\n": "persons: 1\n"}
    text = STUDY.replace("replications: 3", "replications: 1").replace("latest-wins]", "pipelined]")
    for old, new in rule.items():
        text = text.replace(old, new)
    path = kit.write_study(tmp_path, text)
    (tmp_path / "one.yaml").write_text("description: no time to arrive\nhorizon_s: 1\n")
    assert study_runs.tune(TuneOptions(path, tmp_path / "trials", jobs=1)) == 0
    output = capsys.readouterr().out
    assert unnamed(output, "command.rate_hz", "pattern", tmp_path / "tuned" / "study.yaml") == []
    assert [c.value for c in load_tuned(load_study(path)).chosen] == [5.0, 5.0]
