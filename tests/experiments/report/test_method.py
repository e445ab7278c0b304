import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.report.method import remarks

PERSONS = 4
STOP = {"stop": {"comparison": "answer", "half_width": 1.0, "batch_persons": 1, "most_persons": 6}}


def reading(tmp_path, study=None, **facts):
    """Reading of a study with four persons, although its file says six."""
    whole = synthetic_results.manifest(6, 2, **facts)
    whole["study"] |= study or {}
    rows = [r for r in synthetic_results.drive_rows(PERSONS, 2) if r["profile"] != "dissertation"]
    return synthetic_results.reading(tmp_path / "r", rows, whole)


def test_the_persons_are_those_that_were_run(tmp_path):
    assert unnamed(remarks(reading(tmp_path))[0], "persons: 4", "each: 2") == []


@pytest.mark.parametrize(
    ("study", "why", "names"),
    [
        (STOP, "enough", ["4;", "2 of 6 batches", "interval"]),
        ({"budget_s": 60.0}, "budget", ["4;", "2 of 6 batches", "time"]),
        (STOP, None, ["4;", "All 6 batches"]),
    ],
)
def test_what_decided_the_number_of_persons_is_told(tmp_path, study, why, names):
    stopped = {"rounds": 2, "of": 6, "why": why}
    reported = remarks(reading(tmp_path, study, stopped=stopped))[0]
    assert unnamed(reported, *names) == []


def test_parts_with_trials_of_their_own_are_told_apart(tmp_path):
    trials = {"drive": 5, "story": None}
    parts = {name: {"scenario": name, "replications": count} for name, count in trials.items()}
    reported = remarks(reading(tmp_path, {"parts": parts}))[0]
    assert unnamed(reported, "5 in drive", "2 in story") == []


@pytest.mark.parametrize(
    ("versions", "names"),
    [
        ({"fingerprint": "ab12", "commit": "0123456789abcdef"}, ["ab12", "commit 0123456789ab."]),
        ({"commit": "0123456789abcdef", "dirty": True}, ["0123456789ab ", "not committed"]),
        ({"commit": None, "dirty": None}, ["commit is not known"]),
    ],
)
def test_the_program_is_told_and_what_is_not_known_of_it(tmp_path, versions, names):
    reported = remarks(reading(tmp_path, versions={"dva-sim": "0.7.0"} | versions))[-1]
    assert unnamed(reported, "dva-sim 0.7.0", *names) == []


def test_tests_are_told_where_there_are_any(tmp_path):
    claims = {"hypotheses": {"h": {"direction": "above"}}}
    claims["comparisons"] = {"c": synthetic_results.manifest(6, 2)["study"]["answer"]}
    text = " ".join(remarks(reading(tmp_path, claims)))
    assert unnamed(text, "one-sided", "permutation") == []


def test_without_claims_no_test_is_told(tmp_path):
    text = " ".join(remarks(reading(tmp_path)))
    assert "one-sided" not in text
    assert "permutation" not in text


def test_with_fewer_than_six_persons_nothing_is_drawn_again(tmp_path):
    assert "Student's alone" in " ".join(remarks(reading(tmp_path)))
