"""Registered studies: new random numbers, no unseen change, and every liberty named."""

import re
from pathlib import Path

import pytest
from helpers.studies.small_study import REPEATED, STUDY, study_in, write_study
from helpers.wording import unnamed

from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.study import cell_grid, registration
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.registration import load_registration, plan_of, register
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.testing.files import check_file

CLAIMED = (
    STUDY
    + """\
hypotheses:
  waiting-costs: {direction: above, margin: 1.0, at: {link.delay_s: 0.25}}
"""
)


def registered(folder: Path, text: str = CLAIMED) -> Path:
    """The file of a study that has just been registered."""
    path = write_study(folder, text)
    register(load_study(path))
    return path


def beside(path: Path) -> Path:
    return path.with_name(f"{path.stem}.registration.yaml")


def test_what_is_declared_and_not_registered_is_called_so(tmp_path):
    status = study_in(tmp_path, text=CLAIMED).status
    assert (status.kind, status.why, status.registration) == ("declared", (), None)
    assert status.reproducible


def test_a_registered_study_run_unchanged_is_confirmatory(tmp_path):
    status = load_study(registered(tmp_path)).status
    assert (status.kind, status.why) == ("confirmatory", ())
    assert status.registration["plan"]["hypotheses"]["waiting-costs"]["margin"] == 1.0
    assert status.registration["plan"]["persons"] == 3


def test_its_persons_and_random_numbers_are_those_of_the_registration_alone(tmp_path):
    before = {job.seed for job in cell_grid.jobs(study_in(tmp_path, text=CLAIMED))}
    path = registered(tmp_path)
    study = load_study(path)
    after = cell_grid.jobs(study)
    assert before.isdisjoint(job.seed for job in after)
    assert {job.scenario.operator.population_seed for job in after} == {study.seed}
    assert study.seed == load_registration(load_yaml(beside(path))).seed
    path.write_text(CLAIMED.replace("seed: 3", "seed: 4"))
    assert [job.key for job in cell_grid.jobs(load_study(path))] == [job.key for job in after]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("margin: 1.0", "margin: 0.5", "other than registered: hypotheses"),
        ("direction: above", "direction: below", "other than registered: hypotheses"),
        ("  waiting-costs:", "  costs:", "other than registered: hypotheses"),
        ("persons: 3", "persons: 4", "3 persons were registered, not 4"),
        ("replications: 2", "replications: 3", "2 replications were registered, not 3"),
        ("measure: drive_time_s", "measure: path_m", "other than registered: answer"),
        ("[0, 0.25]", "[0, 0.1, 0.25]", "other than registered: factors, cells"),
        ("smallest_effect_s: 2.0", "smallest_effect_s: 3.0", "other than registered: answer"),
        ("persons: 3", "persons: 3\nbudget_s: 9", "depends on the clock, 9 s"),
    ],
)
def test_a_study_changed_after_its_registration_is_exploratory_and_says_in_what(
    tmp_path, old, new, expected
):
    path = registered(tmp_path)
    path.write_text(CLAIMED.replace(old, new))
    study = load_study(path)
    assert study.status.kind == "exploratory"
    assert any(expected in reason for reason in study.status.why)
    assert study.seed == 3


def test_a_scenario_changed_after_the_registration_is_found(tmp_path):
    path = registered(tmp_path)
    (tmp_path / "one.yaml").write_text("description: one robot\nhorizon_s: 61\n")
    assert unnamed(load_study(path).status.why, "scenarios", "cells") == []


def test_a_file_that_a_scenario_names_counts_by_its_content_wherever_it_lies(tmp_path):
    def plan_in(name: str, trace: str) -> object:
        folder = tmp_path / name
        folder.mkdir()
        (folder / "cell.up").write_text(trace)
        link = f"factors:\n  link.trace_up: [{folder / 'cell.up'}]"
        return plan_of(study_in(folder, text=CLAIMED.replace("factors:", link)))["inputs"]

    here, there, other = plan_in("a", "1\n2\n"), plan_in("b", "1\n2\n"), plan_in("c", "1\n3\n")
    assert here == there != other


def test_words_may_be_mended_after_the_registration_and_are_told(tmp_path):
    path = registered(tmp_path)
    path.write_text(CLAIMED.replace("Which is quicker?", "Which one is quicker?"))
    status = load_study(path).status
    assert status.kind == "confirmatory"
    assert unnamed(status.why, "question", "Which is quicker?") == []


def test_the_registration_of_another_study_is_told(tmp_path):
    beside(registered(tmp_path)).rename(tmp_path / "other.registration.yaml")
    (tmp_path / "other.yaml").write_text(CLAIMED)
    status = load_study(tmp_path / "other.yaml").status
    assert status.kind == "confirmatory"
    assert "'study'" in status.why[0]


def test_settings_make_it_exploratory_with_the_random_numbers_of_the_study(tmp_path):
    study = load_study(registered(tmp_path), ["robot.processing_s=0.2"])
    assert study.status.kind == "exploratory"
    assert study.status.why[0] == "--set robot.processing_s=0.2"
    assert study.seed == 3


def test_a_pilot_is_exploratory_and_sees_nothing_of_the_study_or_its_confirmation(tmp_path):
    path = registered(tmp_path)
    pilot = load_study(path, pilot=2)
    assert pilot.status.kind == "exploratory"
    assert unnamed(pilot.status.why[0], "pilot", "2 persons") == []
    seeds = {job.seed for job in cell_grid.jobs(pilot)}
    assert seeds.isdisjoint(job.seed for job in cell_grid.jobs(load_study(path)))
    beside(path).unlink()
    assert seeds.isdisjoint(job.seed for job in cell_grid.jobs(load_study(path)))


STOPPING = "stop: {comparison: answer, half_width: 1, batch_persons: 1, most_persons: 9}\n"


@pytest.mark.parametrize(
    ("more", "reason", "reproducible"),
    [
        (STOPPING, "depends on the results", True),
        ("budget_s: 60\n", "depends on the clock, 60 s", False),
    ],
)
def test_a_size_left_open_is_exploratory(tmp_path, more, reason, reproducible):
    study = study_in(tmp_path, text=CLAIMED + more)
    assert study.status.kind == "exploratory"
    assert [reason in why for why in study.status.why] == [True]
    assert study.status.reproducible is reproducible


@pytest.mark.parametrize(
    ("old", "new", "kind", "names"),
    [
        ('"margin": 1.0', '"margin": 0.0', "exploratory", ["edited", "hash"]),
        (r'hash: "\w+"', f'hash: "{"0" * 64}"', "exploratory", []),
        ('study: "study"', 'study: "lucky"', "confirmatory", []),
    ],
)
def test_an_edited_registration_is_found_and_a_name_of_ones_own_buys_no_other_seed(
    tmp_path, old, new, kind, names
):
    path = registered(tmp_path)
    before, text = load_study(path).seed, beside(path).read_text()
    assert re.search(old, text)
    beside(path).write_text(re.sub(old, new, text))
    path.write_text(CLAIMED.replace("margin: 1.0", "margin: 0.0") if names else CLAIMED)
    study = load_study(path)
    assert (study.status.kind, unnamed(study.status.why, *names)) == (kind, [])
    assert study.seed == (before if kind == "confirmatory" else 3)


def test_what_was_registered_is_not_confirmed_by_fewer_runs(tmp_path):
    status = load_study(registered(tmp_path)).status.model_dump(mode="json")
    broken = {"status": status, "failures": [{"error": "ValueError: no"}]}
    found = status_of(broken)
    assert (found.kind, found.reproducible) == ("exploratory", True)
    assert unnamed(found.why[0], "1 of", "registered runs") == []
    assert status_of(broken | {"failures": []}).kind == "confirmatory"


def test_runs_that_took_too_long_are_others_on_another_machine():
    found = status_of({"status": {}, "failures": [{"error": "RunTooLong: took more than its 1 s"}]})
    assert (found.kind, found.reproducible) == ("declared", False)
    assert unnamed(found.why, "1 of the runs", "another machine") == []


def test_another_program_is_told_and_changes_nothing_else(tmp_path, monkeypatch):
    path = registered(tmp_path)
    monkeypatch.setattr(registration, "fingerprint", lambda: "another")
    status = load_study(path).status
    assert status.kind == "confirmatory"
    assert unnamed(*status.why, "program", "another)") == []


def test_other_code_that_judges_is_told_whenever_verdicts_are(tmp_path, monkeypatch):
    study = load_study(registered(tmp_path))
    manifest = {"status": study.status.model_dump(mode="json")}
    assert status_of(manifest).why == ()
    monkeypatch.setattr(
        "dva_sim.experiments.results.manifest.fingerprint_of_judges", lambda: "another"
    )
    reported = status_of(manifest)
    assert reported.kind == "confirmatory"
    assert unnamed(*reported.why, "judges", "now another)") == []


def test_registering_again_has_to_be_meant_and_is_told(tmp_path):
    path = registered(tmp_path)
    first = load_registration(load_yaml(beside(path)))
    with pytest.raises(ConfigError, match="--again"):
        register(load_study(path))
    path.write_text(CLAIMED.replace("margin: 1.0", "margin: 0.5"))
    register(load_study(path), again=True)
    second = load_registration(load_yaml(beside(path)))
    assert second.earlier == (first.hash,)
    assert second.seed != first.seed
    status = load_study(path).status
    assert status.kind == "confirmatory"
    assert "registered once before" in status.why[0]


def test_the_same_study_makes_the_same_registration(tmp_path):
    made = set()
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
        path = registered(tmp_path / name, REPEATED + CLAIMED[len(STUDY) :])
        made.add(beside(path).read_bytes())
    assert len(made) == 1


def test_the_larger_version_is_registered_on_its_own(tmp_path):
    path = write_study(tmp_path, CLAIMED + "full: {persons: 6}\n")
    register(load_study(path, version="full"))
    assert load_study(path, version="full").status.kind == "confirmatory"
    status = load_study(path).status
    assert status.kind == "exploratory"
    assert unnamed(status.why, "6 persons", "not 3") == []


def test_points_of_a_registered_design_follow_from_the_registration(tmp_path):
    text = CLAIMED + "design: {latin_hypercube: 4, ranges: {link.loss: [0, 0.1]}}\n"
    before = [dict(cell.levels) for cell in cell_grid.cells(study_in(tmp_path, text=text))]
    study = load_study(registered(tmp_path, text))
    assert study.status.kind == "confirmatory"
    assert [dict(cell.levels) for cell in cell_grid.cells(study)] != before


def test_a_registration_is_checked_with_the_study_beside_it(tmp_path):
    path = registered(tmp_path)
    assert (check_file(beside(path)).kind, check_file(beside(path)).problems) == (
        "registration",
        [],
    )
    path.write_text(CLAIMED.replace("margin: 1.0", "margin: 0.5"))
    (problem,) = check_file(beside(path)).problems
    assert (problem.line, problem.text) == (9, "other than registered: hypotheses")
    path.unlink()
    (problem,) = check_file(beside(path)).problems
    assert problem.text.startswith("study.yaml, ")


def test_a_registration_is_no_study_of_its_own(tmp_path, monkeypatch):
    from dva_sim.kernel import resources

    folder = tmp_path / "experiments"
    folder.mkdir()
    registered(folder)
    monkeypatch.chdir(tmp_path)
    assert "study" in resources.available("experiments")
    assert "study.registration" not in resources.available("experiments")
