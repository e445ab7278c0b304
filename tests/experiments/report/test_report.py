import re

import pytest
from helpers.studies import synthetic_results
from helpers.studies.report_text import words

from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.experiments.report.answer_table import size_of
from dva_sim.experiments.report.report import _levels, write_report
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError

FIGURES = [
    "answer",
    "distributions",
    "differences",
    "levels",
    "factorial_effects",
    "robustness",
    "delay_budget",
    "command_age",
    "command_rate",
    "trajectories",
    "time_lapse_typical",
    "time_lapse_worst",
    "story_times",
    "story_outcomes",
]


def of_one_profile(rows):
    """One profile is enough for most promises, and half the panels to draw."""
    return [row for row in rows if row["profile"] != "dissertation"]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    tables = {
        "runs": of_one_profile(synthetic_results.drive_rows(6, 2, effect_s=30.0, missed=0.5)),
        "events": of_one_profile(synthetic_results.story_rows(6)),
        "tracks": of_one_profile(synthetic_results.track_rows()),
        "robustness": synthetic_results.repeat_rows(
            {("pursuit", 0): 20, ("pursuit", 1): 5, ("adaptive", 0): 1, ("adaptive", 1): -4}
        ),
    }
    facts = synthetic_results.manifest(6, 2)
    facts["study"]["factors"] |= {"profile": ["default"]}
    facts["study"] |= synthetic_results.CLAIMS
    facts["tuned"] = synthetic_results.TUNED
    facts["basis"] = {"persons": "these", "phones": "these"}
    return write_report(
        synthetic_results.write(tmp_path_factory.mktemp("study") / "results", tables, facts)
    )


def test_the_report_finds_the_effect_that_was_put_in(report):
    text = words(report)
    assert re.search(
        r"With profile default, REQ/REP takes [\d.]+ s longer than latest-wins PUB/SUB at a "
        r"one-way delay of 1 s \(95 % band [\d.]+ to",
        text,
    )


def test_the_report_says_how_many_events_were_missed(report):
    text = words(report)
    assert re.search(r"In part drive not confirmed at a one-way delay of 1 s: REQ/REP \d+ %", text)
    assert re.search(r"[Uu]p to 250 ms the question stays open: up to [\d.]+ s is not ruled", text)


def test_predictions_stand_beside_what_was_found(report):
    text = words(report)
    assert re.search(
        r"Waiting costs\. REQ/REP minus latest-wins PUB/SUB in driving time to confirmation of "
        r"part drive, profile default, one-way delay 1 s: above zero, 20.0 to 40.0 s [\d.]+ s "
        r"\([\d.]+ to [\d.]+ s\) (held|open|did not hold)",
        text,
    )
    assert "Nobody will notice. not judged" in text


def test_the_report_says_how_far_the_conclusion_survives_other_models(report):
    text = words(report)
    assert "each of pursuit and adaptive, with the usual parameters and one other set" in text
    assert "At one-way delay 1 s the sign holds in 3 of 4 (75 %) repeats" in text
    assert "in 2 of 4 (50 %) the effect exceeds the smallest that matters, in 1 it is below" in text


def test_the_report_splits_the_spread_and_shows_all_that_tuning_saw(report):
    text = words(report)
    assert "Between and within persons" in text
    assert "absolute 0.5 50.0 (40.0 to 60.0)" in text
    assert "absolute 1 48.0 (38.0 to 58.0) chosen" in text
    assert "tuned with another version of the program" in text
    warned = (
        "The gain of the phone was tuned with other persons than the study was run with: 'dva-sim "
    )
    assert f"{warned}tune synthetic' chooses anew." in text
    assert "Nobody learns" in text


def test_the_conditions_are_stated_and_the_time_out_is_checked(report):
    text = words(report)
    assert "processing time of a command at the robot 50 ms 50 ms" in text
    assert "one-way delay varied varied" in text
    assert "The time-out is above four round trips and the processing time" in text


def test_the_report_needs_nothing_but_itself(report):
    page = report.read_text(encoding="utf-8")
    sources = re.findall(r'src="([^"]{0,20})', page)
    assert len(sources) == len(FIGURES)
    assert all(link.startswith("#") for link in re.findall(r'href="([^"]*)', page))
    assert all(source.startswith("data:image/svg+xml") for source in sources)
    assert "<script" not in page
    assert "url(" not in page


def test_the_figures_come_in_order_and_as_files(report):
    page = report.read_text(encoding="utf-8")
    assert re.findall(r'<figure id="(\w+)"', page) == FIGURES
    files = {path.name for path in (report.parent / "figures").iterdir()}
    assert files == {f"{name}.{ending}" for name in FIGURES for ending in ("svg", "png", "csv")}


def test_the_report_made_again_has_the_same_bytes(report):
    files = [report, *sorted((report.parent / "figures").iterdir())]
    before = [path.read_bytes() for path in files]
    write_report(report.parent)
    assert [path.read_bytes() for path in files] == before


def test_the_question_and_the_answer_come_before_the_evidence_and_that_before_the_method(report):
    text = words(report)
    places = [
        text.index(word)
        for word in (
            "REQ/REP or PUB/SUB",
            "Declared: run as its file says",
            "REQ/REP takes",
            "Above zero REQ/REP takes longer",
            "What this depends on",
            "Below:",
            "Waiting costs.",
            "The answer in numbers one-way delay",
            "Driving time to confirmation of all",
            "Part drive: 18 configurations",
            "Nobody learns",
            "Manifest:",
        )
    ]
    assert places == sorted(places)


def test_figures_of_an_older_report_do_not_stay(tmp_path):
    facts = synthetic_results.manifest(2, 1, failures=[{"error": "no site"}])
    folder = synthetic_results.write(tmp_path / "r", {}, facts)
    (folder / "figures").mkdir()
    for name in ("old.svg", "old.csv", "mine.txt"):
        (folder / "figures" / name).touch()
    write_report(folder)
    assert [path.name for path in (folder / "figures").iterdir()] == ["mine.txt"]


def test_a_pdf_is_made_when_asked_for_and_kept_up_to_date(tmp_path):
    facts = synthetic_results.manifest(2, 1, failures=[{"error": "no site"}])
    folder = synthetic_results.write(tmp_path / "r", {}, facts)
    write_report(folder)
    assert not (folder / "report.pdf").exists()
    write_report(folder, pdf=True)
    made = (folder / "report.pdf").read_bytes()
    (folder / "report.pdf").write_bytes(b"old")
    write_report(folder)
    assert (folder / "report.pdf").read_bytes() == made


def test_a_registered_study_is_called_confirmatory_and_its_hypotheses_stand_beside_the_result(
    tmp_path,
):
    facts = synthetic_results.manifest(8, 1)
    facts["study"] |= {
        "factors": {"pattern": synthetic_results.PATTERNS, "link.delay_s": [1.0]},
        "hypotheses": {"waits": {"text": "It waits.", "direction": "above", "margin": 2.0}},
    }
    facts["study"]["answer"] |= {"within": {}}
    registration = {"made_with": "0.7.0 abc", "plan": dict(facts["study"]), "hash": "12345678" * 8}
    facts["status"] = {"kind": "confirmatory", "why": [], "registration": registration}
    rows = synthetic_results.drive_rows(8, 1, effect_s=30.0, missed=0.0)
    runs = [r for r in of_one_profile(rows) if r["link.delay_s"] == 1.0 or r["is_reference"]]
    text = words(write_report(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts)))
    assert "Confirmatory: run as registered beforehand" in text
    assert "persons x trials 8 x 1 8 x 1 hypothesis waits above 2.0 s ✓ held: " in text
    assert "hash 1234567812345678 earlier" in text
    assert "Registered hypotheses" in text
    assert "waits: It waits. REQ/REP minus latest-wins PUB/SUB" in text
    assert "✓ held" in text


def test_every_cell_has_its_row(report):
    rows = re.findall(r"<tr.*?</tr>", report.read_text(encoding="utf-8"))
    cells = [row for row in rows if row.count("<td") > 5]
    assert len(cells) == 3 * 6


def test_a_study_that_went_as_declared_is_not_called_exploratory(report):
    assert "Exploratory" not in words(report)
    assert "Declared: run as its file says" in words(report)


def test_a_poor_study_is_reported_for_what_it_is(tmp_path):
    runs = [r for r in synthetic_results.drive_rows(1, 1) if r["link.delay_s"] != 0.5]
    runs[1]["violations"] = 2
    facts = synthetic_results.manifest(
        1,
        1,
        set=["replications=1", "robot.count=1"],
        failures=[{"part": "drive", "error": "robot-1 left the world"}],
    )
    text = words(write_report(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts)))
    assert "Exploratory" in text
    assert "Why: changed on the command line: replications=1, robot.count=1." in text
    assert "Too few persons to answer" in text
    assert "Runs that failed and are missing below: 1 (robot-1 left the world)" in text
    assert "Safety rules were broken in 1 run of part drive." in text
    assert "6 of 36 configurations have no run" in text


def test_a_study_of_other_factors_and_without_an_answer_is_shown_all_the_same(tmp_path):
    runs = [
        {"part": "walk", "person": person, "trial": 0, "seed": person, "is_reference": False}
        | {"guard.count": guards, "dispatch.policy": policy, "response_s": 60 / guards + person}
        for person in range(3)
        for guards in (1, 2, 4)
        for policy in ("nearest", "min_eta")
    ]
    facts = {
        "study": {
            "question": "How many guards?",
            "persons": 3,
            "replications": 1,
            "factors": {"dispatch.policy": ["nearest", "min_eta"], "guard.count": [1, 2, 4]},
        }
    }
    report = write_report(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts))
    text = words(report)
    assert "not declared or not run" in text
    assert "Response time under each dispatch policy" in text
    assert "guards" in text.replace("How many guards?", "")
    assert 'id="command_rate"' not in report.read_text(encoding="utf-8")


def test_a_study_of_which_no_run_was_completed_says_so(tmp_path):
    facts = synthetic_results.manifest(2, 1, failures=[{"error": "no site"}])
    text = words(write_report(synthetic_results.write(tmp_path / "r", {}, facts)))
    assert "No run was completed" in text


def test_a_folder_without_results_is_refused_in_one_line(tmp_path):
    with pytest.raises(ConfigError, match="holds no finished results"):
        write_report(tmp_path)


def test_what_a_treatment_changes_is_said_and_counts_as_varied(tmp_path):
    runs = [r for r in synthetic_results.drive_rows(2, 1) if r["link.delay_s"] in (0.0, 1.0)]
    for run in runs:
        run["way"] = "far" if run.pop("link.delay_s") else "near"
    facts = synthetic_results.manifest(2, 1)
    treatments = {"way": {"near": {}, "far": {"link.delay_s": 1.0}}}
    factors = {"pattern": synthetic_results.PATTERNS, "way": ["near", "far"]}
    factors |= {"profile": synthetic_results.PROFILES}
    facts["study"] |= {"treatments": treatments, "factors": factors, "answer": None}
    text = words(write_report(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts)))
    assert "near: nothing far: one-way delay 1 s" in text
    assert "one-way delay varied varied" in text
    assert "The time-out is above four round trips and the processing time" in text


def test_conditions_name_what_a_study_changed_and_a_class_with_its_file():
    scenario = {"pattern": "latest-wins", "operator": {"traits": {"crossover_rad_s": 1.2}}}
    rows = dict(conditions({"drive": scenario}, [], also=["pattern", "operator.traits"]))
    assert rows["messaging pattern"] == ["latest-wins"]
    assert rows["operator traits"] == ["crossover_rad_s 1.2"]
    levels = _levels("phone.filter", ("none", "/some/where/mine.py:Mine"))
    assert levels == "none and Mine (/some/where/mine.py)"


# --- the first screen and the way through the page ---------------------------------------------


def page_of(report):
    return report.read_text(encoding="utf-8")


def test_the_first_screen_holds_the_answer_its_figure_and_what_it_depends_on(report):
    screen, _, below = page_of(report).partition("</section>")
    assert screen.index('<p class="lead">') < screen.index('<figure id="answer">')
    assert screen.count("<figure") == 1
    assert "<table" not in screen
    assert below.lstrip().startswith("<nav")
    said = words(report)
    assert "Persons: 6 simulated, 2 trials each; no human took part." in said
    assert "Measured: In part drive, the driving time to confirmation" in said


def test_the_contents_lead_to_every_section(report):
    page = page_of(report)
    (nav,) = re.findall(r"<nav.*?</nav>", page, flags=re.S)
    links, sections = re.findall(r'href="#([^"]+)"', nav), re.findall(r'<h2 id="([^"]+)"', page)
    assert links == sections
    assert len(sections) > 5


def test_a_word_is_explained_once_where_it_first_stands(report):
    page = page_of(report)
    links = re.findall(r'<dfn><a href="#(word-[^"]+)" title="([^"]+)">([^<]+)</a></dfn>', page)
    explained = re.findall(r'<dt id="(word-[^"]+)">', page)
    assert sorted(key for key, _, _ in links) == sorted(explained)
    said = [text for _, _, text in links]
    for word in ("REQ/REP", "latest-wins PUB/SUB", "95 % band", "part", "configurations"):
        assert word in said
    first = page[: page.index("95 % band")]
    assert first.endswith('">')  # the very first time it stands is in a link


def test_no_reader_meets_a_cell(report):
    before, _, _ = words(report).partition("Manifest:")
    assert not re.search(r"\b[Cc]ells?\b", before)


def test_wide_tables_scroll_by_themselves(report):
    page = page_of(report)
    assert page.count("<table") == page.count('<div class="scroll" tabindex="0"><table')


def test_what_does_not_vary_is_said_below_a_table_and_not_in_each_row(report):
    said = words(report)
    assert "The same in all configurations: runs 12, " in said
    assert "contacts per run 0, violations 0." in said


@pytest.mark.parametrize(
    ("persons", "factors", "told"),
    [
        (6, {}, "Study synthetic: 6 persons × 2 trials, "),
        (3, {}, "A smaller version of synthetic: 3 persons × 2 trials, "),
        (12, {}, "A larger version of synthetic: 12 persons × 2 trials, "),
        (6, {"link.delay_s": [0.0, 1.0]}, "A smaller version of synthetic: 6 persons × 2 trials, "),
    ],
)
def test_the_version_that_was_run_is_told_beside_the_usual_size(tmp_path, persons, factors, told):
    facts = synthetic_results.manifest(
        persons, 2, usual=dict(synthetic_results.manifest(6, 2)["study"])
    )
    facts["usual"]["name"] = "synthetic"
    facts["study"]["factors"] |= factors
    kept = facts["study"]["factors"]["link.delay_s"]
    rows = [r for r in synthetic_results.drive_rows(persons, 2) if r["link.delay_s"] in kept]
    reading = Reading(Results.load(synthetic_results.write(tmp_path / "r", {"runs": rows}, facts)))
    said = size_of(reading)
    assert said.startswith(told)
    if persons != 6:
        assert said.endswith("Its usual size: 6 persons × 2 trials.")
    if factors:
        assert said.endswith("6 persons × 2 trials, 6 levels of one-way delay (here 2).")
