import re

import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.analysis.predictions import judge_all, verdict_of
from dva_sim.experiments.analysis.study_view import view_of
from dva_sim.statistics import Interval


def interval(low, high):
    return Interval((low + high) / 2, low, high, 24)


@pytest.mark.parametrize(
    ("direction", "low", "high", "verdict"),
    [
        ("above", 1, 5, "held"),
        ("above", -5, -1, "did not hold"),
        ("above", -1, 5, "open"),
        ("above", -1, 1.5, "did not hold"),  # what matters, 2 s, is ruled out
        ("below", -5, -1, "held"),
        ("below", 1, 5, "did not hold"),
        ("below", -5, 1, "open"),
        ("same", -1, 2, "held"),
        ("same", 2.1, 5, "did not hold"),
        ("same", -5, -2.1, "did not hold"),
        ("same", 1, 5, "open"),
    ],
)
def test_a_direction_is_judged_by_the_whole_interval(direction, low, high, verdict):
    assert verdict_of(direction, None, 2.0, interval(low, high)) == verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [(10, 20, "held"), (18, 28, "open"), (22, 30, "did not hold"), (2, 8, "did not hold")],
)
def test_a_range_is_judged_by_the_mean_and_fails_only_clear_of_the_interval(low, high, verdict):
    assert verdict_of("above", (10, 20), 2.0, interval(low, high)) == verdict


def judged(*predictions, effect_s=30.0):
    runs = synthetic_results.columns(synthetic_results.drive_rows(8, 2, effect_s, missed=0.0))
    study = synthetic_results.manifest(8, 2)["study"] | {"predictions": list(predictions)}
    return judge_all(study, view_of(study, runs))


def test_by_default_the_answers_contrast_is_judged_at_its_last_stop():
    (found,) = judged({"text": "Costs.", "direction": "above", "expects_s": [20, 40]})
    assert found.verdict == "held"
    assert unnamed(found.expected, "profile default", "delay 1\N{NO-BREAK SPACE}s") == []


def test_a_prediction_can_speak_of_another_place_and_another_contrast():
    small = {"text": "Nothing.", "direction": "same", "at": {"link.delay_s": 0.05}}
    other = {
        "text": "The old phone costs.",
        "direction": "above",
        "factor": "profile",
        "contrast": ["dissertation", "default"],
    }
    found = judged(small, other)
    assert [f.verdict for f in found] == ["held", "held"]
    parts = ("dissertation minus default", "part drive", "delay 1\N{NO-BREAK SPACE}s", "above zero")
    assert unnamed(found[1].expected, *parts, "pattern latest-wins PUB/SUB") == []


def test_a_prediction_that_fails_is_said_to_fail():
    (found,) = judged({"text": "Gains.", "direction": "below"})
    assert found.verdict == "did not hold"


def test_words_alone_are_shown_and_not_judged():
    (found,) = judged({"text": "Who knows."})
    assert (found.verdict, found.expected) == ("not judged", "")


def test_a_contrast_that_was_not_run_is_not_judged():
    (found,) = judged({"text": "Far.", "direction": "above", "at": {"link.delay_s": 9}})
    assert (found.verdict, found.found) == ("not judged", "not run")


def test_persons_who_are_all_alike_leave_no_doubt():
    same = {
        "text": "Queues do nothing here.",
        "direction": "below",
        "contrast": ["latest-wins", "latest-wins-too"],
    }
    runs = synthetic_results.drive_rows(4, 1, missed=0.0)
    runs += [r | {"pattern": "latest-wins-too"} for r in runs if r["pattern"] == "latest-wins"]
    study = synthetic_results.manifest(4, 1)["study"] | {"predictions": [same]}
    patterns = [*synthetic_results.PATTERNS, "latest-wins-too"]
    study["factors"] = study["factors"] | {"pattern": patterns}
    (found,) = judge_all(study, view_of(study, synthetic_results.columns(runs)))
    assert found.verdict == "did not hold"
    assert re.findall(r"[\d.]+", found.found) == ["0", "0", "0"]


def test_where_tuning_chose_the_value_there_was_nothing_is_judged():
    rows = synthetic_results.drive_rows(4, 1, missed=0.0)
    twice = [row | {"tuning": level} for row in rows for level in ("untuned", "tuned")]
    claim = {"text": "Helps.", "direction": "below", "factor": "tuning"}
    study = synthetic_results.manifest(4, 1)["study"]
    study["factors"] = study["factors"] | {"tuning": ["untuned", "tuned"]}
    study["predictions"] = [claim | {"contrast": ["tuned", "untuned"]}]
    study["answer"] = study["answer"] | {"within": {"profile": "default", "tuning": "tuned"}}
    view = view_of(study, synthetic_results.columns(twice))
    (found,) = judge_all(study, view)
    assert found.verdict == "not judged"
    assert found.found.startswith("the same runs")


@pytest.mark.parametrize(
    ("expected", "high", "verdict"),
    [
        ((0.0, 0.15), 0.02, "held"),
        ((1.0, 2.0), 0.02, "did not hold"),
        ((0.0, 0.15), -0.01, "did not hold"),
    ],
)
def test_a_small_effect_that_was_expected_is_not_refuted_by_being_small(expected, high, verdict):
    found = Interval(mean=high - 0.01, low=high - 0.02, high=high, n_persons=12)
    judged = verdict_of("above", expected, 1.0, found)
    assert (judged if judged != "open" else "held") == verdict
