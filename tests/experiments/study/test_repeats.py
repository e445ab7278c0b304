import itertools

import numpy as np
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study

from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.factor_levels import latin_hypercube, parameter_sets


def repeats(study):
    return [job for job in cell_grid.jobs(study) if job.is_repeat]


def test_each_slice_of_each_axis_holds_one_point():
    points = latin_hypercube(8, 3, np.random.default_rng(1))
    assert points.shape == (8, 3)
    for axis in points.T:
        assert sorted((8 * axis).astype(int)) == list(range(8))


def test_sets_lie_within_the_bands_and_the_usual_one_comes_first(tmp_path):
    sets = parameter_sets(kit.study_in(tmp_path, text=kit.REPEATED))
    assert sets[0] == {}
    assert len(sets) == 4
    for traits in sets[1:]:
        assert 1.0 <= traits["crossover_rad_s"] <= 2.0
        assert 0.1 <= traits["hand_lag_s"] <= 0.2


def test_sets_depend_on_the_seed_of_the_study_alone(tmp_path):
    first, again, other = (
        parameter_sets(kit.study_in(tmp_path, *changes, text=kit.REPEATED))
        for changes in ([], ["persons=9"], ["seed=4"])
    )
    assert first == again != other


def test_the_contrast_is_repeated_with_every_set_at_the_last_stop(tmp_path):
    jobs = repeats(kit.study_in(tmp_path, text=kit.REPEATED))
    levels = {job.cell: job.levels for job in jobs}
    assert list(levels.values()) == [
        {"parameters": number, "pattern": pattern, "link.delay_s": 0.25}
        for number, pattern in itertools.product(range(4), ("req-rep", "latest-wins"))
    ]
    assert len(jobs) == 4 * 2 * 2 * 2


def test_a_repeat_has_the_persons_and_the_random_numbers_of_the_study_and_its_own_traits(tmp_path):
    study = kit.study_in(tmp_path, text=kit.REPEATED)
    own = {(j.person, j.trial): j for j in cell_grid.jobs(study) if j.part == "drive"}
    sets = parameter_sets(study)
    for job in repeats(study):
        assert job.seed == own[job.person, job.trial].seed
        assert job.scenario.operator.person == job.person
        assert job.scenario.operator.traits == sets[job.levels["parameters"]]


def test_the_usual_model_is_not_run_a_second_time(tmp_path):
    jobs = cell_grid.jobs(kit.study_in(tmp_path, text=kit.REPEATED))
    assert len({job.key for job in jobs}) == kit.REPEATED_RUNS
    assert len(jobs) == kit.RUNS + 32


def test_strategies_are_crossed_with_the_sets(tmp_path):
    text = kit.REPEATED + "  strategies: [pursuit, oracle]\n  at: [0, 0.25]\n"
    levels = {job.cell: job.levels for job in repeats(kit.study_in(tmp_path, text=text))}
    assert len(levels) == 2 * 4 * 2 * 2
    assert {each["operator.strategy"] for each in levels.values()} == {"pursuit", "oracle"}


def test_repeats_fill_a_table_of_their_own(tmp_path):
    study = kit.study_in(tmp_path, text=kit.REPEATED)
    results = Results.load(run_study(study, tmp_path / "out", jobs=1, episode=kit.cheap))
    assert results.tables == ["robustness", "runs", "tracks"]
    assert "parameters" not in results.table("runs")
    assert len(results.table("runs")["seed"]) == kit.RUNS
    table = results.table("robustness")
    assert list(table)[:6] == ["part", "cell", "config", "parameters", "pattern", "link.delay_s"]
    assert len(table["seed"]) == 32
    assert results.manifest["parameter_sets"] == parameter_sets(study)


def test_repeats_can_be_left_out(tmp_path):
    study = kit.study_in(tmp_path, "robustness=null", text=kit.REPEATED)
    assert len(cell_grid.jobs(study)) == kit.RUNS


def test_a_setting_that_takes_the_contrast_away_leaves_no_repeats(tmp_path):
    assert not repeats(kit.study_in(tmp_path, "pattern=req-rep", text=kit.REPEATED))
