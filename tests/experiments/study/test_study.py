from pathlib import Path

import pytest
from helpers.studies.small_study import STUDY, study_in, write_study
from helpers.wording import unnamed

from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import ConfigError


def complaint(folder: Path, old: str, new: str) -> str:
    path = write_study(folder, STUDY.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        cell_grid.jobs(load_study(path))
    return str(caught.value).replace(str(path), "study")


def test_a_study_keeps_its_factors_and_levels_in_order(tmp_path):
    study = study_in(tmp_path)
    assert list(study.factors) == ["pattern", "link.delay_s"]
    assert study.factors["pattern"] == ("req-rep", "latest-wins")
    assert study.folder == tmp_path


def test_a_mistyped_key_is_told_with_line_and_column(tmp_path):
    told = complaint(tmp_path, "persons", "person")
    assert unnamed(told, "study:3:1: ", "'person'", "'persons'") == []


def test_a_factor_that_no_scenario_knows_is_told_where_the_study_names_it(tmp_path):
    told = complaint(tmp_path, "link.delay_s: [", "link.dely_s: [0, 1]\n  link.delay_s: [")
    assert unnamed(told, "study:7:3: ", "'link.dely_s'", "'delay_s'") == []


def test_an_impossible_level_is_told_where_the_study_names_it(tmp_path):
    told = complaint(tmp_path, "0.25]", "-0.25]")
    assert told.startswith("study:7:3: link.delay_s: ")
    assert "-0.25" in told


def test_a_wrong_reference_is_told_where_the_study_makes_it(tmp_path):
    told = complaint(tmp_path, "strategy: oracle", "strategy: oracel")
    assert unnamed(told, "study:11:17: ", "'oracel'") == []


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("part: drive", "part: drove", "study:16:3"),
        ("factor: pattern", "factor: patern", "study:18:3"),
        ("contrast: [req-rep", "contrast: [req-req", "study:19:3"),
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


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("persons: 3", "persons: true", "study:3:1: persons: should be a whole number, not"),
        ("persons: 3", 'persons: "3"', "study:3:1: persons: should be a whole number, not"),
        (
            "persons: 3",
            "persons: 3.0",
            "study:3:1: persons: should be a whole number, without a point",
        ),
        ("fect_s: 2.0", 'fect_s: "2"', "study:21:3: answer.smallest_effect_s: should be a"),
        ("0.25]", ".nan]", "study:7:21: factors.link.delay_s.1: should be a finite number"),
        ("0.25]", "[1]]", "study:7:21: factors.link.delay_s.1: should be a number, text, or true"),
        ("[0, 0.25]", "[]", "study:7:3: factors.link.delay_s: should have at least 1 item"),
        ("[0, 0.25]", "0.25", "study:7:3: factors.link.delay_s: should be a list, not 0.25"),
        ("-rep, latest-wins]\n  over", "-rep]\n  over", "study:19:3: answer.contrast: should have"),
        ("scenario: one.yaml", "scenario: on.yaml", "study:10:5: scenario 'on.yaml' not found"),
    ],
)
def test_a_value_of_another_kind_is_refused_in_plain_words(tmp_path, old, new, told):
    assert complaint(tmp_path, old, new).startswith(told)


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
    assert {cell.scenario.robot.processing_s for cell in cell_grid.cells(study)} == {0.2}


@pytest.mark.parametrize(
    ("setting", "scenario_key", "value"),
    [
        ("parts.drive.changes.horizon_s=10", "horizon_s", 10),
        ("parts.drive.changes.link.loss=0.1", "link.loss", 0.1),
    ],
)
def test_a_setting_may_go_into_a_mapping_that_the_file_leaves_out(
    tmp_path, setting, scenario_key, value
):
    study = study_in(tmp_path, setting)
    assert study.parts["drive"].changes == {scenario_key: value}
    assert study.parts["story"].changes == {}


def test_a_setting_may_begin_a_key_that_the_file_leaves_out(tmp_path):
    study = study_in(tmp_path, "answer.within.link.delay_s=0.25", "answer.over=null")
    assert study.answer.within == {"link.delay_s": 0.25}
    told = "--set stop.half_width=1: missing key 'stop.batch_persons'"
    with pytest.raises(ConfigError, match=told):
        study_in(tmp_path, "stop.half_width=1", "stop.comparison=answer")


def test_a_setting_that_takes_the_contrast_away_leaves_no_declared_answer(tmp_path):
    assert study_in(tmp_path, "link.delay_s=1").answer is not None
    assert study_in(tmp_path, "pattern=req-rep").answer is None


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("persons", "--set 'persons' should be key=value"),
        ("persons=none", "--set persons=none: should be a whole number"),
        ("parts.drve.replications=2", "--set parts.drve.replications=2: no 'drve' in the study"),
        ("operator.person=3", "'operator.person' is set by the study"),
        (
            "parts.drive.scenario=two.yaml",
            "scenario=two.yaml: scenario 'two.yaml' not found",
        ),
        ("persons.a=3", "--set persons.a=3: 'persons' holds no keys, so no 'a'"),
        (
            "robot.procesing_s=1",
            "--set robot.procesing_s=1: unknown key 'robot.procesing_s'; did you mean 'pro",
        ),
        ("link.delay_s=-1", "--set link.delay_s=-1: should be at least 0"),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused_in_one_line(tmp_path, setting, told):
    with pytest.raises(ConfigError) as caught:
        cell_grid.jobs(study_in(tmp_path, setting))
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
    cells = cell_grid.cells(study_in(tmp_path, text=TREATED + TREATMENTS))
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
        (
            "pattern: latest-wins",
            "pattern: latest-winz",
            "study:24:12: pattern 'latest-winz' is unknown",
        ),
    ],
)
def test_a_treatment_that_makes_no_sense_is_refused(tmp_path, old, new, told):
    path = write_study(tmp_path, (TREATED + TREATMENTS).replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        cell_grid.jobs(load_study(path))
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


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("person", "a treatment cannot be called 'person': a column of the design is"),
        ("config", "a treatment cannot be called 'config': a column of the design is"),
        ("drive_time_s", "a treatment cannot be called 'drive_time_s': a column of what is"),
        ("tuning", "a treatment cannot be called 'tuning': the tuning is"),
    ],
)
def test_a_treatment_cannot_be_called_as_another_column(tmp_path, name, told):
    path = write_study(tmp_path, (TREATED + TREATMENTS).replace("remedy", name))
    with pytest.raises(ConfigError) as caught:
        load_study(path)
    assert str(caught.value).startswith(f"{path}:23:3: {told}")


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


COMPARED = (
    STUDY
    + """\
comparisons:
  far: {part: drive, measure: contacts, factor: pattern, contrast: [req-rep, latest-wins],
    within: {link.delay_s: 0.25}, family: aside}
hypotheses:
  waiting-costs: {direction: above, margin: 1.5, at: {link.delay_s: 0.25}}
  contacts-alike: {comparison: far, direction: same, margin: 0.5}
"""
)


def test_comparisons_stand_beside_the_answer_and_hypotheses_name_one_of_them(tmp_path):
    study = study_in(tmp_path, text=COMPARED)
    assert list(study.contrasts) == ["answer", "far"]
    assert (study.contrasts["far"].over, study.contrasts["far"].family) == (None, "aside")
    assert study.hypotheses["waiting-costs"].comparison == "answer"
    assert study.hypotheses["contacts-alike"].margin == 0.5


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("measure: contacts", "measure: contact", "study:23:22: measure 'contact' is unknown"),
        ("  far: {part: drive", "  far: {part: drove", "study:23:9: comparisons.far.part 'drove'"),
        ("within: {link.delay_s: 0.25}, ", "", "study:23:3: should run over 'link.delay_s' or"),
        ("  far:", "  answer:", "study:22:1: comparisons: a comparison cannot be called 'answer'"),
        ("comparison: far", "comparison: near", "study:27:20: 'near' is not a comparison; there"),
        ("direction: same, margin: 0.5", "direction: same", "'same' needs a margin"),
        ("at: {link.delay_s: 0.25}}", "at: {link.delay_s: 9}}", "study:26:55: 9 is not a level"),
        ("at: {link.delay_s: 0.25}}", "at: {pattern: req-rep}}", "study:26:55: 'pattern' is what"),
        ("margin: 1.5", "margin: -1.5", "study:26:37: hypotheses.waiting-costs.margin"),
        ("margin: 1.5", "margins: 1.5", "unknown key 'hypotheses.waiting-costs.margins'; did you"),
    ],
)
def test_claims_that_make_no_sense_are_refused_where_they_stand(tmp_path, old, new, told):
    path = write_study(tmp_path, COMPARED.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        cell_grid.cells(load_study(path))
    assert told in str(caught.value).replace(str(path), "study")


def test_a_setting_takes_with_it_the_claims_about_what_is_gone(tmp_path):
    study = study_in(tmp_path, "link.delay_s=[0, 0.5]", text=COMPARED)
    assert list(study.contrasts) == ["answer"]
    assert study.hypotheses == {}


FULL = STUDY + "full: {persons: 6, link.delay_s: [0, 0.25, 0.5], robot.processing_s: 0.1}\n"


def test_the_larger_version_has_its_own_keys_levels_and_scenario_keys(tmp_path):
    path = write_study(tmp_path, FULL)
    small, full = load_study(path), load_study(path, version="full")
    assert (small.persons, small.factors["link.delay_s"], small.changes) == (3, (0, 0.25), {})
    assert (full.persons, full.factors["link.delay_s"]) == (6, (0, 0.25, 0.5))
    assert {cell.scenario.robot.processing_s for cell in cell_grid.cells(full)} == {0.1}
    assert (small.status.kind, full.status.kind) == ("declared", "declared")


def test_the_larger_version_holds_all_runs_of_the_smaller(tmp_path):
    path = write_study(tmp_path, STUDY + "full: {persons: 6, replications: 3}\n")
    small, full = (
        {j.key for j in cell_grid.jobs(load_study(path, version=f))} for f in (None, "full")
    )
    assert small < full


def test_a_larger_version_can_be_changed_by_settings_too(tmp_path):
    full = load_study(write_study(tmp_path, FULL), ["persons=7"], version="full")
    assert (full.persons, full.factors["link.delay_s"]) == (7, (0, 0.25, 0.5))


@pytest.mark.parametrize(
    ("full", "told"),
    [
        ("{persons: none}", "study:22:8: in the larger version: persons: should be a whole number"),
        ("{person: 6}", "study:22:8: in the larger version: unknown key 'person'"),
        ("{parts.drve.replications: 2}", "study:22:8: in the larger version: no 'drve' in the"),
        ("{pattern: [pub-sub]}", "study:22:8: in the larger version: 'req-rep' is not a level"),
    ],
)
def test_a_larger_version_that_makes_no_sense_is_refused_with_the_study(tmp_path, full, told):
    path = write_study(tmp_path, STUDY + f"full: {full}\n")
    with pytest.raises(ConfigError) as caught:
        cell_grid.cells(load_study(path, version="full"))
    assert told in str(caught.value).replace(str(path), "study")


QUICK = COMPARED + "quick: {persons: 2, link.delay_s: [0, 0.5]}\n"


def test_the_small_version_leaves_out_what_was_claimed_of_levels_it_leaves_out(tmp_path):
    path = write_study(tmp_path, QUICK)
    study, quick = load_study(path), load_study(path, version="quick")
    assert (quick.persons, quick.factors["link.delay_s"]) == (2, (0, 0.5))
    assert (study.version, quick.version) == (None, "quick")
    assert list(quick.contrasts) == ["answer"]
    assert quick.status.kind == "declared"
    assert len(study.contrasts) > 1


def test_a_small_version_must_keep_the_answer(tmp_path):
    path = write_study(tmp_path, STUDY + "quick: {pattern: [pub-sub]}\n")
    with pytest.raises(ConfigError, match="small version: 'req-rep'"):
        load_study(path)


def test_the_small_version_of_the_main_study_asks_the_same_of_the_same_persons():
    published, quick = (load_study("req-rep-vs-pub-sub", version=v) for v in (None, "quick"))
    assert quick.answer == published.answer
    assert (quick.seed, quick.persons) == (published.seed, published.persons)
    same = {job.key for job in cell_grid.jobs(published)}
    assert {job.key for job in cell_grid.jobs(quick) if not job.is_repeat} < same


def test_a_study_without_a_larger_version_says_so(tmp_path):
    with pytest.raises(ConfigError, match=r"study\.yaml:1:1: .* 'full'"):
        load_study(write_study(tmp_path), version="full")


def test_what_is_recorded_and_the_larger_version_do_not_change_what_is_asked(tmp_path):
    plain = study_in(tmp_path).asked()
    assert study_in(tmp_path, text=STUDY + "record: worst\nfull: {persons: 9}\n").asked() == plain
    assert study_in(tmp_path, text=STUDY + "budget_s: 60\n").asked() != plain


def test_the_main_study_fits_on_one_screen():
    text = load_study("req-rep-vs-pub-sub").file.read_text()
    assert len(text.splitlines()) <= 40
