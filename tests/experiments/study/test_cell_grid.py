import hashlib
from collections import defaultdict

from helpers.studies.small_study import REPEATED, RUNS, STUDY, study_in

from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.hashing import inputs


def test_every_person_drives_every_trial_in_every_cell_and_once_in_the_reference(tmp_path):
    jobs = cell_grid.jobs(study_in(tmp_path))
    assert len(jobs) == RUNS
    assert sum(job.is_reference for job in jobs) == 3 * 2
    assert len({job.key for job in jobs}) == RUNS


def test_jobs_come_by_part_cell_person_and_trial(tmp_path):
    jobs = cell_grid.jobs(study_in(tmp_path))
    order = [(job.part, job.cell, job.person, job.trial) for job in jobs]
    assert order == sorted(order)


def test_the_seed_depends_on_part_person_and_trial_but_not_on_the_cell(tmp_path):
    seeds = defaultdict(set)
    for job in cell_grid.jobs(study_in(tmp_path)):
        seeds[job.part, job.person, job.trial].add(job.seed)
    assert all(len(found) == 1 for found in seeds.values())
    assert len(set().union(*seeds.values())) == len(seeds)


def test_more_persons_or_levels_leave_the_runs_there_are_unchanged(tmp_path):
    few = {job.key for job in cell_grid.jobs(study_in(tmp_path))}
    many = {job.key for job in cell_grid.jobs(study_in(tmp_path, "persons=5"))}
    wide = {job.key for job in cell_grid.jobs(study_in(tmp_path, "link.delay_s=[0, 0.1, 0.25]"))}
    assert few < many
    assert few < wide


def test_the_scenario_knows_its_levels_its_person_and_its_population(tmp_path):
    for job in cell_grid.jobs(study_in(tmp_path)):
        assert job.scenario.operator.person == job.person
        assert job.scenario.operator.population_seed == 3
        if not job.is_reference:
            assert job.scenario.pattern == job.levels["pattern"]
            assert job.scenario.link.delay_s == job.levels["link.delay_s"]


def test_the_reference_is_the_base_scenario_with_its_own_changes(tmp_path):
    cell = cell_grid.cells(study_in(tmp_path))[0]
    assert cell.cell == cell_grid.REFERENCE
    assert cell.levels == {}
    assert cell.scenario.operator.strategy == "oracle"
    assert cell.scenario.link.delay_s == 0


def test_no_two_clusters_share_an_operator(tmp_path):
    first = {}
    for job in cell_grid.jobs(study_in(tmp_path, "operator.count=2")):
        first[job.person] = job.scenario.operator.person
    assert first == {0: 0, 1: 2, 2: 4}


def test_a_configurations_hash_is_the_same_for_equal_scenarios_only(tmp_path):
    cells = cell_grid.cells(study_in(tmp_path, "parts.drive.scenario=one.yaml"))
    by_part = defaultdict(list)
    for cell in cells:
        by_part[cell.part].append(cell.config)
    assert by_part["drive"][1:] == by_part["story"]
    assert len(set(by_part["drive"])) == 5


def test_a_study_without_factors_has_one_cell(tmp_path):
    text = STUDY.split("factors:")[0] + "parts: {only: {scenario: one.yaml}}\n"
    jobs = cell_grid.jobs(study_in(tmp_path, text=text))
    assert [(job.cell, job.levels) for job in jobs] == [(0, {})] * 6


def test_a_level_changes_options_in_its_own_cell_alone(tmp_path):
    text = (
        STUDY.split("factors:")[0]
        + "factors: {pattern_options.every: [2, 7]}\n"
        + "parts: {only: {scenario: one.yaml, changes: {pattern_options: {every: 5},"
        + " pattern: 'acknowledged_pub_sub.py:AcknowledgedPubSub'}}}\n"
    )
    study = study_in(tmp_path, text=text)
    options = [cell.scenario.pattern_options for cell in cell_grid.cells(study)]
    assert options == [{"every": 2}, {"every": 7}]
    assert study.parts["only"].changes["pattern_options"] == {"every": 5}


def inputs_of(study):
    return inputs(cell.scenario for cell in cell_grid.cells(study))


def test_files_of_one_name_in_two_folders_are_both_known_by_their_contents(tmp_path):
    names = []
    for folder in "ab":
        (tmp_path / folder).mkdir()
        file = tmp_path / folder / "cell.up"
        file.write_text(folder)
        names.append(str(file))
    before = inputs((), names)
    file.write_text("c")
    assert list(before) == ["cell.up"]
    assert inputs((), names) != before


def test_files_that_a_scenario_names_are_known_by_their_contents(tmp_path):
    trace = tmp_path / "cell.up"
    study = study_in(tmp_path, f"link.trace_up={trace}")
    assert inputs_of(study) == {}
    found = []
    for text in ("1\n2\n", "1\n3\n"):
        trace.write_text(text)
        found.append(inputs_of(study)[trace.name])
    assert found[0] != found[1]


def test_so_is_a_shipped_trace_and_what_a_named_file_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert list(inputs_of(study_in(tmp_path, "link.trace_up=cellular.up"))) == ["cellular.up"]
    (tmp_path / "plan.yaml").write_text("image: plan.png\nresolution: 0.05\n")
    found = []
    for image in (b"white", b"black"):
        (tmp_path / "plan.png").write_bytes(image)
        found.append(inputs((), ["plan.yaml"]))
    assert found[0].keys() == {"plan.yaml", "plan.yaml: plan.png"}
    assert found[0] != found[1]

    (tmp_path / "robot.yaml").write_text("drive: motors.py:Mine\n")
    (tmp_path / "motors.py").write_text("class Mine: pass\n")
    assert list(inputs((), ["robot.yaml"])) == ["robot.yaml", "robot.yaml: motors.py"]


def test_seeds_are_what_they_always_were(tmp_path):
    """Results that were begun with an older program go on, and old answers can be run again."""
    jobs = cell_grid.jobs(study_in(tmp_path, text=REPEATED))
    assert [job.seed for job in jobs[:2]] == [1289764452063391784, 6791902960423926731]
    seeds = [
        (job.part, job.cell, *job.levels.items(), job.person, job.trial, job.seed) for job in jobs
    ]
    assert hashlib.sha256(repr(seeds).encode()).hexdigest()[:16] == "d04fb4f22a6c0684"


def test_repeats_have_the_persons_of_the_part_they_repeat(tmp_path):
    study = study_in(tmp_path, "operator.count=2", text=REPEATED)
    persons = defaultdict(set)
    for job in cell_grid.jobs(study):
        persons[job.is_repeat].add((job.person, job.scenario.operator.person))
    assert persons[True] <= persons[False]


def test_a_trait_that_the_study_sets_is_left_by_its_repeats(tmp_path):
    study = study_in(tmp_path, "operator.traits.hand_lag_s=0.15", text=REPEATED)
    traits = [
        cell.scenario.operator.traits
        for cell in cell_grid.cells(study)
        if cell.part == "robustness"
    ]
    assert {each["hand_lag_s"] for each in traits} == {0.15}
    assert len({each.get("crossover_rad_s") for each in traits}) == 4
