import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.report.hypothesis_tables import registration_table
from dva_sim.experiments.study.hashing import fingerprint_of_judges

PATTERNS = ["req-rep", "latest-wins"]
COSTS = {"text": "Waiting costs.", "direction": "above", "margin": 2.0}
PLAN = {
    "persons": 4,
    "replications": 2,
    "factors": {"pattern": PATTERNS, "link.delay_s": [0.0, 1.0]},
    "answer": {"part": "drive", "measure": "drive_time_s", "factor": "pattern"}
    | {"contrast": PATTERNS, "over": "link.delay_s"},
    "hypotheses": {"costs": COSTS},
}


@pytest.fixture(scope="module")
def runs():
    """Request/reply costs 40 s more at 1 s of delay."""
    rows = synthetic_results.drive_rows(4, 2, effect_s=40.0, missed=0.0)
    return synthetic_results.columns([r for r in rows if r["profile"] == "default"])


def rows_of(runs, plan=PLAN, study=PLAN, persons=4, **found):
    registration = {
        "made_with": "0.7.0 abc",
        "judged_with": "0a1b",
        "hash": "0123456789abcdef" * 4,
        "plan": plan,
    }
    manifest = {
        "study": dict(study),
        "status": {"registration": registration | found},
        "versions": {"dva-sim": "0.7.1", "fingerprint": "def"},
    }
    table = registration_table(manifest, runs, persons)
    return {
        row[0]: tuple(cell.replace("\N{NO-BREAK SPACE}", " ") for cell in row[1:])
        for row in table.rows
    }


def test_what_was_registered_stands_beside_what_was_run(runs):
    rows = rows_of(runs)
    assert rows["persons x trials"] == ("4 x 2", "4 x 2")
    assert unnamed(rows["design"][0], "messaging pattern (2", "one-way delay (2") == []
    assert rows["made with"] == ("0.7.0 abc", "0.7.1 def")
    assert rows["judged with"] == ("0a1b", fingerprint_of_judges())
    assert rows["hash"][0] == "0123456789abcdef"
    assert rows["earlier registrations"][0] == "none told"


def test_each_hypothesis_has_its_margin_and_what_came_out(runs):
    bound, found = rows_of(runs)["hypothesis costs"]
    assert bound == "above 2.0 s"
    assert found.startswith("✓ held: ")
    assert found.endswith(" s, 90 %)")


def test_a_study_run_otherwise_is_held_against_what_was_registered(runs):
    other = PLAN | {
        "hypotheses": {"costs": COSTS | {"margin": 0.5}, "more": {"direction": "below"}}
    }
    rows = rows_of(runs, plan=PLAN | {"persons": 24}, study=other)
    assert rows["persons x trials"] == ("24 x 2", "4 x 2")
    assert rows["hypothesis costs"][0] == "above 2.0 s"
    assert "hypothesis more" not in rows


def test_earlier_registrations_are_told(runs):
    rows = rows_of(runs, earlier=["f" * 64, "e" * 64])
    assert rows["earlier registrations"][0] == f"2: {'f' * 16}, {'e' * 16}"


@pytest.mark.parametrize(
    ("design", "names"),
    [
        ({"saltelli": 64, "ranges": {"link.jitter_s": {"low": 0, "high": 1}}}, ["64", "Saltelli"]),
        ({"zip": ["pattern"]}, ["one after another"]),
        ({"csv": "rows.csv", "rows": "0a1b"}, ["rows of a list"]),
    ],
)
def test_the_design_is_told_in_words(runs, design, names):
    plan = PLAN | {"factors": {"pattern": PATTERNS}, "design": design}
    reported = rows_of(runs, plan=plan)["design"][0]
    assert unnamed(reported, *names, "messaging pattern (2 levels)") == []
    assert ("jitter" in reported) == ("ranges" in design)


def test_without_any_run_no_hypothesis_came_out():
    rows = rows_of({}, persons=0)
    assert rows["persons x trials"] == ("4 x 2", "0 x 2")
    assert "hypothesis costs" not in rows
