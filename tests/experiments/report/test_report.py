import re

import pytest
from helpers.studies import synthetic_results
from helpers.studies.report_text import blank_pictures, visible_words, words, words_of
from helpers.wording import unnamed

from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.experiments.report.report import _levels, write_report
from dva_sim.experiments.report.study_size import size_of

pytestmark = pytest.mark.system

FIGURES = [
    "answer",
    "distributions",
    "differences",
    "delay_budget",
    "command_age",
]


DELAYS = [0.0, 0.25, 1.0]


def fewer(rows, delays=DELAYS):
    """One profile and three delays are enough for most promises, and fewer panels to draw."""
    return [
        row
        for row in rows
        if row["profile"] != "dissertation" and row["link.delay_s"] in {0.0, *delays}
    ]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    tables = {
        "runs": fewer(synthetic_results.drive_rows(6, 2, effect_s=30.0, missed=0.5)),
        "events": fewer(synthetic_results.story_rows(6)),
        "tracks": fewer(synthetic_results.track_rows()),
        "robustness": synthetic_results.repeat_rows(
            {("pursuit", 0): 20, ("pursuit", 1): 5, ("adaptive", 0): 1, ("adaptive", 1): -4}
        ),
    }
    facts = synthetic_results.manifest(6, 2)
    facts["study"]["factors"] |= {"profile": ["default"], "link.delay_s": DELAYS}
    facts["study"] |= synthetic_results.CLAIMS
    facts["tuned"] = synthetic_results.TUNED
    facts["basis"] = {"persons": "these", "phones": "these"}
    return write_report(
        synthetic_results.write(tmp_path_factory.mktemp("study") / "results", tables, facts)
    )


@pytest.fixture(scope="module")
def page(report):
    return report.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def text(report):
    return words(report)


def test_the_report_finds_the_effect_that_was_put_in(text):
    (found,) = re.findall(r"delay 1 s.{0,200} own persons it is \+([\d.]+) s", text)
    assert float(found) > 30


def test_the_report_says_how_many_events_were_missed(text):
    assert re.search(r"without confirmation .{0,30} 1 s: REQ/REP \d+ %", text)
    assert re.search(r"250 ms.{0,60} [\d.]+ s are not", text)


def test_predictions_stand_beside_what_was_found(text):
    claim, _, found = text.partition("above zero, 20.0 to 40.0 s ")
    assert unnamed(claim[-150:], "Waiting costs.", "REQ/REP minus", "profile default", "1 s") == []
    assert re.match(r"[\d.]+ s \(.{,20}\) (held|open|did)", found)
    assert "not judged" in text.partition("Nobody will notice. ")[2][:10]


def test_the_report_says_how_far_the_conclusion_survives_other_models(text):
    counted = ("pursuit and adaptive", "3 of 4 (75 %)", "2 of 4 (50 %)", "in 1 it is below")
    assert unnamed(text, *counted) == []


def test_the_report_splits_the_spread_and_shows_all_that_tuning_saw(text):
    seen = ("absolute 0.5 50.0 (40.0 to 60.0)", "absolute 1 48.0 (38.0 to 58.0) chosen")
    warned = ("Between and within persons", "another version", "'dva-sim tune synthetic'")
    assert unnamed(text, *seen, *warned, "Nobody learns") == []


def test_the_conditions_are_stated_and_the_time_out_is_checked(text):
    assert unnamed(text, "50 ms 50 ms", "delay varied varied", "above four round trips") == []


def test_the_report_needs_nothing_but_itself(page):
    sources = re.findall(r'src="([^"]{0,20})', page)
    assert len(sources) == len(FIGURES)
    assert all(link.startswith("#") for link in re.findall(r'href="([^"]*)', page))
    assert all(source.startswith("data:image/svg+xml") for source in sources)
    assert "<script" not in page
    assert "url(" not in page


def test_the_figures_come_in_order_and_as_files(report, page):
    assert re.findall(r'<figure id="(\w+)"', page) == FIGURES
    files = {path.name for path in (report.parent / "figures").iterdir()}
    assert files == {f"{name}.{ending}" for name in FIGURES for ending in ("svg", "png", "csv")}


def test_the_question_and_the_answer_come_before_the_evidence_and_that_before_the_method(text):
    places = [
        text.index(word)
        for word in (
            "REQ/REP or PUB/SUB",
            "Declared in",
            "Whether the driving time",
            "Above zero",
            "What this depends on",
            "Below:",
            "Waiting costs.",
            "in numbers one-way delay",
            "Part drive: 9 configurations",
            "Nobody learns",
            "Manifest:",
        )
    ]
    assert places == sorted(places)


@pytest.fixture
def failed(tmp_path):
    """Results of which no run was completed."""
    facts = synthetic_results.manifest(2, 1, failures=[{"error": "no site"}])
    return synthetic_results.write(tmp_path / "r", {}, facts)


def test_figures_of_an_older_report_do_not_stay(failed):
    (failed / "figures").mkdir()
    for name in ("old.svg", "old.csv", "mine.txt"):
        (failed / "figures" / name).touch()
    write_report(failed)
    assert [path.name for path in (failed / "figures").iterdir()] == ["mine.txt"]


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
    runs = [r for r in fewer(rows, [1.0]) if r["link.delay_s"] == 1.0 or r["is_reference"]]
    text = words_of(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts))
    page = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert page.index('<figure id="claims"') < page.index("</section>") < page.index('id="answer"')
    assert unnamed(text, "Confirmatory:", "hash 1234567812345678", "Registered hypotheses") == []
    size, _, rest = text.partition("persons x trials ")[2].partition(" hypothesis ")
    assert size.split() == ["8", "x", "1"] * 2
    assert unnamed(rest, "waits above 2.0 s", "✓ held: ") == []
    assert "waits: It waits." in text
    beside = text.index("Not registered, over all levels")
    assert text.index("Registered hypothesis held: waits") < beside
    assert text.index("The answer in numbers") < beside


MOST_WORDS = 1200  # that a reader sees before unfolding anything


def test_the_report_of_a_large_registered_study_is_read_in_minutes(tmp_path):
    facts = synthetic_results.manifest(8, 1)
    texts = [f"At {delay:g} s each way waiting for replies costs time." for delay in DELAYS] * 2
    claims = {f"claim-{n}": {"text": text, "direction": "above"} for n, text in enumerate(texts)}
    predictions = [{"text": f"Number {n}, in a sentence of its own."} for n in range(12)]
    treatments = {"way": {f"way {n}": {"link.delay_s": 0.1 * n} for n in range(12)}}
    facts["study"] |= {"hypotheses": claims, "predictions": predictions, "treatments": treatments}
    facts["status"] = {"kind": "confirmatory", "why": [], "registration": None}
    tables = {"runs": synthetic_results.drive_rows(8, 1, effect_s=30.0)}
    tables |= {"events": synthetic_results.story_rows(8), "tracks": synthetic_results.track_rows()}
    with blank_pictures():
        report = write_report(synthetic_results.write(tmp_path / "r", tables, facts))
    assert "6 registered hypotheses" in words(report)
    assert 300 < visible_words(report) <= MOST_WORDS


def test_every_cell_has_its_row(page):
    rows = re.findall(r"<tr.*?</tr>", page)
    assert len([row for row in rows if row.count("<td") > 5]) == 3 * 3


def test_a_study_that_went_as_declared_is_not_called_exploratory(text):
    assert "Exploratory" not in text
    assert "Declared in" in text


def test_a_poor_study_is_reported_for_what_it_is(tmp_path):
    runs = fewer(synthetic_results.drive_rows(1, 1), [0.25])
    runs[1]["violations"] = 2
    facts = synthetic_results.manifest(
        1,
        1,
        set=["replications=1", "robot.count=1"],
        failures=[{"part": "drive", "error": "robot-1 left the world"}],
    )
    facts["study"]["factors"] |= {"link.delay_s": DELAYS}
    text = words_of(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts))
    why = ("Exploratory", "command line: replications=1, robot.count=1.", "too small")
    lost = ("missing below: 1 (robot-1 left the world)", "in 1 run of part drive", "12 of 18")
    assert unnamed(text, *why, *lost) == []


def test_a_study_of_other_factors_and_without_an_answer_is_shown_all_the_same(tmp_path):
    runs = [
        {"part": "walk", "person": person, "trial": 0, "seed": person, "is_reference": False}
        | {"guard.count": guards, "dispatch.policy": policy, "response_s": 60 / guards + person}
        for person in range(3)
        for guards in (1, 2, 4)
        for policy in ("nearest", "min_eta", "random")
    ]
    policies = ["nearest", "min_eta", "random"]
    facts = {
        "study": {
            "question": "How many guards?",
            "parts": {"walk": {"scenario": "fire-drill"}},
            "persons": 3,
            "replications": 1,
            "factors": {"dispatch.policy": policies, "guard.count": [1, 2, 4]},
        }
    }
    text = words_of(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts))
    assert unnamed(text, "not declared", "dispatch policy") == []
    assert "guards" in text.replace("How many guards?", "")
    page = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert 'id="distributions"' in page
    assert 'id="command_rate"' not in page


def test_what_a_treatment_changes_is_said_and_counts_as_varied(tmp_path):
    runs = fewer(synthetic_results.drive_rows(2, 1), [1.0])
    for run in runs:
        run["way"] = "far" if run.pop("link.delay_s") else "near"
    facts = synthetic_results.manifest(2, 1)
    treatments = {"way": {"near": {}, "far": {"link.delay_s": 1.0}}}
    factors = {"pattern": synthetic_results.PATTERNS, "way": ["near", "far"]}
    factors |= {"profile": ["default"]}
    facts["study"] |= {"treatments": treatments, "factors": factors, "answer": None}
    text = words_of(synthetic_results.write(tmp_path / "r", {"runs": runs}, facts))
    expected = (
        "near: nothing far: one-way delay 1 s",
        "delay varied varied",
        "above four round trips",
    )
    assert unnamed(text, *expected) == []


def test_conditions_name_what_a_study_changed_and_a_class_with_its_file():
    scenario = {"pattern": "latest-wins", "operator": {"traits": {"crossover_rad_s": 1.2}}}
    rows = dict(conditions({"drive": scenario}, [], also=["pattern", "operator.traits"]))
    assert rows["messaging pattern"] == ["latest-wins"]
    assert rows["operator traits"] == ["crossover_rad_s 1.2"]
    levels = _levels("phone.filter", ("none", "/some/where/mine.py:Mine"))
    assert levels == "none and Mine (/some/where/mine.py)"


# --- the first screen and the way through the page ---------------------------------------------


def test_the_first_screen_holds_the_answer_its_figure_and_what_it_depends_on(page, text):
    screen, _, below = page.partition("</section>")
    assert screen.index('<p class="lead">') < screen.index('<figure id="answer">')
    assert screen.count("<figure") == 1
    assert "<table" not in screen
    assert below.lstrip().startswith("<nav")
    assert unnamed(text, "Persons: 6 simulated", "Measured: In part drive") == []


def test_the_contents_lead_to_every_section(page):
    (nav,) = re.findall(r"<nav.*?</nav>", page, flags=re.S)
    links, sections = re.findall(r'href="#([^"]+)"', nav), re.findall(r'<h2 id="([^"]+)"', page)
    assert links == sections
    assert len(sections) > 5


def test_the_words_that_occur_are_explained_at_the_foot(page):
    explained = re.findall(r"<dt>([^<]+)</dt>", page)
    assert unnamed(explained, "REQ/REP", "latest-wins PUB/SUB", "95 % band", "configuration") == []
    assert len(set(explained)) == len(explained)


def test_no_reader_meets_a_cell(text):
    assert not re.search(r"\b[Cc]ells?\b", text.partition("Manifest:")[0])


def test_wide_tables_scroll_by_themselves(page):
    assert page.count("<table") == page.count('<div class="scroll" tabindex="0"><table')


def test_what_does_not_vary_is_said_below_a_table_and_not_in_each_row(text):
    assert unnamed(text, "configurations: runs 12, ", "violations 0.") == []


@pytest.mark.parametrize(
    ("persons", "factors", "expected"),
    [
        (6, {}, "Study synthetic: 6 persons"),
        (3, {}, "A smaller version of synthetic: 3 persons"),
        (12, {}, "A larger version of synthetic: 12 persons"),
        (6, {"link.delay_s": [0.0, 1.0]}, "A smaller version of synthetic: 6 persons"),
    ],
)
def test_the_version_that_was_run_is_told_beside_the_usual_size(
    tmp_path, persons, factors, expected
):
    facts = synthetic_results.manifest(
        persons, 2, usual=dict(synthetic_results.manifest(6, 2)["study"])
    )
    facts["usual"]["name"] = "synthetic"
    facts["study"]["factors"] |= factors
    kept = facts["study"]["factors"]["link.delay_s"]
    rows = [r for r in synthetic_results.drive_rows(persons, 2) if r["link.delay_s"] in kept]
    reported = size_of(synthetic_results.reading(tmp_path / "r", rows, facts))
    assert reported.startswith(expected)
    if persons != 6:
        assert "6 persons × 2 trials" in reported[len(expected) + 10 :]
    if factors:
        assert unnamed(reported, "6 levels of one-way", "(here 2)") == []
