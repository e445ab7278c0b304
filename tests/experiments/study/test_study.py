import pytest
from helpers.studies.small_study import STUDY, complaint, study_in, write_study
from helpers.wording import unnamed

from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import ConfigError

TREATED = STUDY.replace("pattern: [req-rep, latest-wins]", "remedy: [none, both]").replace(
    "factor: pattern\n  contrast: [req-rep, latest-wins]",
    "factor: remedy\n  contrast: [none, both]",
)
TREATED += """\
treatments:
  remedy:
    none: {pattern: req-rep}
    both: {pattern: latest-wins, robot.processing_s: 0.01}
"""
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
FULL = STUDY + "full: {persons: 6, link.delay_s: [0, 0.25, 0.5], robot.processing_s: 0.1}\n"
QUICK = COMPARED + "quick: {persons: 2, link.delay_s: [0, 0.5]}\n"


def test_a_study_keeps_its_factors_and_levels_in_order(tmp_path):
    study = study_in(tmp_path)
    assert list(study.factors) == ["pattern", "link.delay_s"]
    assert study.factors["pattern"] == ("req-rep", "latest-wins")
    assert study.folder == tmp_path


REFUSED = {
    STUDY: [
        ("persons", "person", "3:1: ", ["'person'", "'persons'"]),
        ("link.delay_s: [", "link.dely_s: [0, 1]\n  link.delay_s: [", "7:3: ", ["'delay_s'"]),
        ("0.25]", "-0.25]", "7:3: link.delay_s: ", ["-0.25"]),
        ("strategy: oracle", "strategy: oracel", "11:17: ", ["'oracel'"]),
        ("part: drive", "part: drove", "16:3: ", []),
        ("factor: pattern", "factor: patern", "18:3: ", []),
        ("contrast: [req-rep", "contrast: [req-req", "19:3: ", []),
        ("contrast: [req-rep", "contrast: [latest-wins", "19:3: ", []),
        ("over: link.delay_s", "over: link.loss", "20:3: ", []),
        ("smallest", "within: {profile: default}\n  smallest", "21:12: ", []),
        ("pattern: [req-rep,", "pattern: [latest-wins, req-rep,", "6:3: ", []),
        ("pattern: [", "operator.person: [", "5:1: ", []),
        ("replications: 1", "replications: 0", "14:5: ", []),
        ("persons: 3", "persons: true", "3:1: persons: ", ["whole number"]),
        ("persons: 3", 'persons: "3"', "3:1: persons: ", ["whole number"]),
        ("persons: 3", "persons: 3.0", "3:1: persons: ", ["whole number", "point"]),
        ("fect_s: 2.0", 'fect_s: "2"', "21:3: answer.smallest_effect_s: ", []),
        ("0.25]", ".nan]", "7:21: factors.link.delay_s.1: ", ["finite"]),
        ("0.25]", "[1]]", "7:21: factors.link.delay_s.1: ", ["number, text"]),
        ("[0, 0.25]", "[]", "7:3: factors.link.delay_s: ", ["1 item"]),
        ("[0, 0.25]", "0.25", "7:3: factors.link.delay_s: ", ["list", "0.25"]),
        ("-rep, latest-wins]\n  over", "-rep]\n  over", "19:3: answer.contrast: ", []),
        ("scenario: one.yaml", "scenario: on.yaml", "10:5: file 'on.yaml'", []),
    ],
    TREATED: [
        ("[none, both]", "[none, all]", "6:3: 'all'", ["none, both"]),
        ("pattern: latest", "link.delay_s: 1, pattern: latest", "7:3: 'link.delay_s'", ["two"]),
        ("pattern: latest", "operator.person: 1, pattern: latest", "25:5: ", ["by the study"]),
        ("pattern: latest-wins", "pattern: latest-winz", "24:12: pattern 'latest-winz'", []),
    ],
    PREDICTED: [
        ("at: {link.delay_s: 0.25}", "at: {link.delay_s: 9}", "26:10: 9 ", []),
        ("direction: above", "direction: up", "24:5: predictions.0.direction", []),
        ("    direction: above\n", "", "23:5: ", ["needs a direction"]),
        ("[3, 9]", "[9, 3]", "25:5: ", ["ascend"]),
        ("direction: above", "direction: above\n    factor: pattern", "23:5: ", ["contrast"]),
    ],
    COMPARED: [
        ("measure: contacts", "measure: contact", "23:22: measure 'contact'", []),
        ("  far: {part: drive", "  far: {part: drove", "23:9: comparisons.far.part 'drove'", []),
        ("within: {link.delay_s: 0.25}, ", "", "23:3: ", ["run over 'link.delay_s'"]),
        ("  far:", "  answer:", "22:1: comparisons: ", ["'answer'"]),
        ("comparison: far", "comparison: near", "27:20: 'near'", ["far"]),
        ("direction: same, margin: 0.5", "direction: same", "27:3: ", ["'same'", "margin"]),
        ("at: {link.delay_s: 0.25}}", "at: {link.delay_s: 9}}", "26:55: 9 ", []),
        ("at: {link.delay_s: 0.25}}", "at: {pattern: req-rep}}", "26:55: 'pattern'", []),
        ("margin: 1.5", "margin: -1.5", "26:37: hypotheses.waiting-costs.margin", []),
        ("margin: 1.5", "margins: 1.5", "26:37: ", ["'hypotheses.waiting-costs.margins'"]),
    ],
    FULL: [
        ("persons: 6", "persons: none", "22:8: in the larger version: persons: ", []),
        ("persons: 6", "person: 6", "22:8: in the larger version: ", ["'person'"]),
        ("persons: 6", "parts.drve.replications: 2", "22:8: in the larger version: no 'drve'", []),
        ("persons: 6", "pattern: [pub-sub]", "22:8: in the larger version: 'req-rep'", []),
    ],
    QUICK: [("persons: 2", "pattern: [pub-sub]", "28:9: in the small version: 'req-rep'", [])],
}


@pytest.mark.parametrize(
    ("text", "old", "new", "place", "names"),
    [(text, *row) for text, rows in REFUSED.items() for row in rows],
)
def test_a_study_that_makes_no_sense_is_refused_where_it_stands(
    tmp_path, text, old, new, place, names
):
    line = complaint(tmp_path, text.replace(old, new, 1), version="full" if text == FULL else None)
    assert line.startswith(f"study.yaml:{place}")
    assert unnamed(line, *names) == []


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
    line = complaint(tmp_path, STUDY, "stop.half_width=1", "stop.comparison=answer")
    assert unnamed(line, "--set stop.half_width=1: ", "'stop.batch_persons'") == []


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


@pytest.mark.parametrize(
    ("name", "whose"),
    [
        ("person", "of the design"),
        ("config", "of the design"),
        ("drive_time_s", "of what"),
        ("tuning", "the tuning"),
    ],
)
def test_a_treatment_cannot_be_called_as_another_column(tmp_path, name, whose):
    line = complaint(tmp_path, TREATED.replace("remedy", name))
    assert unnamed(line, "study.yaml:23:3: ", f"'{name}'", whose) == []


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


def test_a_study_without_a_larger_version_says_so(tmp_path):
    with pytest.raises(ConfigError, match=r"study\.yaml:1:1: .* 'full'"):
        load_study(write_study(tmp_path), version="full")


def test_what_is_recorded_and_the_larger_version_do_not_change_what_is_asked(tmp_path):
    plain = study_in(tmp_path).asked()
    assert study_in(tmp_path, text=FULL + "record: worst\n").asked() == plain
    assert study_in(tmp_path, text=STUDY + "budget_s: 60\n").asked() != plain


def test_the_main_study_fits_on_one_screen():
    text = load_study("req-rep-vs-pub-sub").file.read_text()
    assert len(text.splitlines()) <= 40


def test_factors_that_would_undo_each_other_are_refused(tmp_path):
    text = TREATED.replace("robot.processing_s: 0.01", "link: {loss: 0.02}")
    assert unnamed(complaint(tmp_path, text), "'link'", "'link.delay_s'", "undo") == []
