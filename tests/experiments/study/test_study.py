import pytest
from helpers.studies.small_study import (
    COMPARED,
    FULL,
    PREDICTED,
    STUDY,
    TREATED,
    study_in,
    write_study,
)

from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study

QUICK = COMPARED + "quick: {persons: 2, link.delay_s: [0, 0.5]}\n"


def test_a_study_keeps_its_factors_and_levels_in_order(tmp_path):
    study = study_in(tmp_path)
    assert list(study.factors) == ["pattern", "link.delay_s"]
    assert study.factors["pattern"] == ("req-rep", "latest-wins")
    assert study.folder == tmp_path


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


def test_a_setting_may_go_into_a_mapping_that_the_file_leaves_out(tmp_path):
    changes = {"horizon_s": 10, "link.loss": 0.1}
    settings = (f"parts.drive.changes.{key}={value}" for key, value in changes.items())
    study = study_in(tmp_path, *settings)
    assert study.parts["drive"].changes == changes
    assert study.parts["story"].changes == {}


def test_a_setting_may_begin_a_key_that_the_file_leaves_out(tmp_path):
    study = study_in(tmp_path, "answer.within.link.delay_s=0.25", "answer.over=null")
    assert study.answer.within == {"link.delay_s": 0.25}


def test_a_setting_that_takes_the_contrast_away_leaves_no_declared_answer(tmp_path):
    assert study_in(tmp_path, "link.delay_s=1").answer is not None
    assert study_in(tmp_path, "pattern=req-rep").answer is None


def test_a_treatment_is_a_level_that_changes_several_keys(tmp_path):
    cells = cell_grid.cells(study_in(tmp_path, text=TREATED))
    seen = {
        (dict(cell.levels)["remedy"], cell.scenario.pattern, cell.scenario.robot.processing_s)
        for cell in cells
        if cell.levels
    }
    usual = cells[0].scenario.robot.processing_s
    assert seen == {("none", "req-rep", usual), ("both", "latest-wins", 0.01)}


def test_predictions_are_kept_in_words_and_numbers(tmp_path):
    first, second = study_in(tmp_path, text=PREDICTED).predictions
    assert (first.direction, first.expected, first.at) == ("above", (3, 9), {"link.delay_s": 0.25})
    assert (second.text, second.direction, second.expected) == ("Nobody will notice.", None, None)


def test_comparisons_stand_beside_the_answer_and_hypotheses_name_one_of_them(tmp_path):
    study = study_in(tmp_path, text=COMPARED)
    assert list(study.contrasts) == ["answer", "far"]
    assert (study.contrasts["far"].over, study.contrasts["far"].family) == (None, "aside")
    assert study.hypotheses["waiting-costs"].comparison == "answer"
    assert study.hypotheses["contacts-alike"].margin == 0.5


def test_a_setting_takes_with_it_the_claims_about_what_is_gone(tmp_path):
    study = study_in(tmp_path, "link.delay_s=[0, 0.5]", text=COMPARED)
    assert list(study.contrasts) == ["answer"]
    assert study.hypotheses == {}


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


def test_the_small_version_leaves_out_what_was_claimed_of_levels_it_leaves_out(tmp_path):
    path = write_study(tmp_path, QUICK)
    study, quick = load_study(path), load_study(path, version="quick")
    assert (quick.persons, quick.factors["link.delay_s"]) == (2, (0, 0.5))
    assert (study.version, quick.version) == (None, "quick")
    assert list(quick.contrasts) == ["answer"]
    assert quick.status.kind == "declared"
    assert len(study.contrasts) > 1


def test_the_small_version_of_the_main_study_asks_the_same_of_the_same_persons():
    published, quick = (load_study("req-rep-vs-pub-sub", version=v) for v in (None, "quick"))
    assert quick.answer == published.answer
    assert (quick.seed, quick.persons) == (published.seed, published.persons)
    same = {job.key for job in cell_grid.jobs(published)}
    assert {job.key for job in cell_grid.jobs(quick) if not job.is_repeat} < same


def test_what_is_recorded_and_the_larger_version_do_not_change_what_is_asked(tmp_path):
    plain = study_in(tmp_path).asked()
    assert study_in(tmp_path, text=FULL + "record: worst\n").asked() == plain
    assert study_in(tmp_path, text=STUDY + "budget_s: 60\n").asked() != plain


def test_the_main_study_fits_on_one_screen():
    text = load_study("req-rep-vs-pub-sub").file.read_text()
    assert len(text.splitlines()) <= 40
