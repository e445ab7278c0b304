from pathlib import Path

import pytest
from small_study import STUDY, study_in, write_study

from dva_sim.errors import ConfigError
from dva_sim.experiments import design
from dva_sim.experiments.study import load_study


def complaint(folder: Path, old: str, new: str) -> str:
    path = write_study(folder, STUDY.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        design.jobs(load_study(path))
    return str(caught.value).replace(str(path), "study")


def test_a_study_keeps_its_factors_and_levels_in_order(tmp_path):
    study = study_in(tmp_path)
    assert list(study.factors) == ["pattern", "link.delay_s"]
    assert study.factors["pattern"] == ("req-rep", "latest-wins")
    assert study.folder == tmp_path


def test_a_mistyped_key_is_told_with_line_and_column(tmp_path):
    assert complaint(tmp_path, "persons", "person") == (
        "study:3:1: unknown key 'person'; did you mean 'persons'?"
    )


def test_a_factor_that_no_scenario_knows_is_told_where_the_study_names_it(tmp_path):
    told = complaint(tmp_path, "link.delay_s: [", "link.dely_s: [0, 1]\n  link.delay_s: [")
    assert told.startswith("study:7:3: unknown key 'link.dely_s'; did you mean 'delay_s'?")


def test_an_impossible_level_is_told_where_the_study_names_it(tmp_path):
    told = complaint(tmp_path, "0.25]", "-0.25]")
    assert told.startswith("study:7:3: link.delay_s: ")
    assert "-0.25" in told


def test_a_wrong_reference_is_told_where_the_study_makes_it(tmp_path):
    told = complaint(tmp_path, "strategy: oracle", "strategy: oracel")
    assert told.startswith("study:11:17: operator 'oracel' is unknown")


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("part: drive", "part: drove", "study:16:3"),
        ("factor: pattern", "factor: patern", "study:18:3"),
        ("contrast: [req-rep", "contrast: [req-req", "study:18:3"),
        ("contrast: [req-rep", "contrast: [latest-wins", "study:19:3"),
        ("over: link.delay_s", "over: link.loss", "study:20:3"),
        ("smallest", "within: {profile: default}\n  smallest", "study:21:12"),
        ("pattern: [req-rep,", "pattern: [latest-wins, req-rep,", "study:6:3"),
        ("pattern: [", "operator.person: [", "study:5:1"),
        ("replications: 1", "replications: 0", "study:14:5"),
    ],
)
def test_a_study_that_makes_no_sense_is_refused(tmp_path, old, new, place):
    assert complaint(tmp_path, old, new).startswith(place)


def test_settings_of_the_study_change_the_study(tmp_path):
    study = study_in(tmp_path, "seed=9", "persons=2", "parts.drive.replications=4")
    assert (study.seed, study.persons, study.replications) == (9, 2, 2)
    assert study.parts["drive"].replications == 4
    assert study.settings == ("seed=9", "persons=2", "parts.drive.replications=4")


@pytest.mark.parametrize("key", ["link.delay_s", "factors.link.delay_s"])
def test_a_setting_takes_the_place_of_a_factors_levels(tmp_path, key):
    assert study_in(tmp_path, f"{key}=0.5").factors["link.delay_s"] == (0.5,)
    assert study_in(tmp_path, f"{key}=[0.5, 1]").factors["link.delay_s"] == (0.5, 1)


def test_any_other_setting_changes_the_scenario_of_every_part(tmp_path):
    study = study_in(tmp_path, "robot.processing_s=0.2")
    assert {cell.scenario.robot.processing_s for cell in design.cells(study)} == {0.2}


def test_a_setting_that_takes_the_contrast_away_leaves_no_declared_answer(tmp_path):
    assert study_in(tmp_path, "link.delay_s=1").answer is not None
    assert study_in(tmp_path, "pattern=req-rep").answer is None


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("persons", "--set 'persons' should be key=value"),
        ("persons=none", "--set: persons: input should be a valid integer"),
        ("parts.drve.replications=2", "--set: no 'drve' in the study"),
        ("operator.person=3", "'operator.person' is set by the study"),
        ("robot.procesing_s=1", "unknown key 'robot.procesing_s'; did you mean 'processing_s'"),
        ("link.delay_s=-1", "link.delay_s: input should be greater than or equal to 0"),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused_in_one_line(tmp_path, setting, told):
    with pytest.raises(ConfigError) as caught:
        design.jobs(study_in(tmp_path, setting))
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.file is None


TREATED = STUDY.replace("pattern: [req-rep, latest-wins]", "remedy: [none, both]").replace(
    "factor: pattern\n  contrast: [req-rep, latest-wins]",
    "factor: remedy\n  contrast: [none, both]",
)
TREATMENTS = """\
treatments:
  remedy:
    none: {pattern: req-rep}
    both: {pattern: latest-wins, robot.processing_s: 0.01}
"""


def test_a_treatment_is_a_level_that_changes_several_keys(tmp_path):
    cells = design.cells(study_in(tmp_path, text=TREATED + TREATMENTS))
    seen = {
        (dict(cell.levels)["remedy"], cell.scenario.pattern, cell.scenario.robot.processing_s)
        for cell in cells
        if cell.levels
    }
    usual = cells[0].scenario.robot.processing_s
    assert seen == {("none", "req-rep", usual), ("both", "latest-wins", 0.01)}


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[none, both]", "[none, all]", "study:6:3: 'all' is not a treatment; named: none, both"),
        ("pattern: latest", "link.delay_s: 1, pattern: latest", "'link.delay_s' is set by two"),
        ("pattern: latest", "operator.person: 1, pattern: latest", "is set by the study"),
        ("pattern: latest-wins", "pattern: latest-winz", "study:24:12: pattern: "),
    ],
)
def test_a_treatment_that_makes_no_sense_is_refused(tmp_path, old, new, told):
    path = write_study(tmp_path, (TREATED + TREATMENTS).replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        design.jobs(load_study(path))
    assert told in str(caught.value).replace(str(path), "study")


PREDICTED = (
    STUDY
    + """\
predictions:
  - text: Waiting costs.
    direction: above
    expects_s: [3, 9]
    at: {link.delay_s: 0.25}
  - text: Nobody will notice.
"""
)


def test_predictions_are_kept_in_words_and_numbers(tmp_path):
    first, second = study_in(tmp_path, text=PREDICTED).predictions
    assert (first.direction, first.expected, first.at) == ("above", (3, 9), {"link.delay_s": 0.25})
    assert (second.text, second.direction, second.expected) == ("Nobody will notice.", None, None)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("at: {link.delay_s: 0.25}", "at: {link.delay_s: 9}", "study:26:10: 9 is not a level"),
        ("direction: above", "direction: up", "study:24:5: predictions.0.direction"),
        ("    direction: above\n", "", "needs a direction"),
        ("[3, 9]", "[9, 3]", "should ascend"),
        ("direction: above", "direction: above\n    factor: pattern", "needs its contrast"),
    ],
)
def test_predictions_that_make_no_sense_are_refused(tmp_path, old, new, told):
    path = write_study(tmp_path, PREDICTED.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        load_study(path)
    assert told in str(caught.value).replace(str(path), "study")
