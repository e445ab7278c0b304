import math

import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed
from scipy import stats

from dva_sim.experiments.analysis.hypothesis_tests import judged
from dva_sim.experiments.analysis.sample_size import _of_answer, plans
from dva_sim.experiments.analysis.study_view import finding_of, view_of
from dva_sim.experiments.report.study_size import plan_lines, plan_table
from dva_sim.experiments.report.summary import few_that_weigh
from dva_sim.statistics import mean_interval

PATTERNS = ["req-rep", "latest-wins"]
CONTRAST = {"part": "drive", "measure": "drive_time_s", "factor": "pattern", "contrast": PATTERNS}
SPREAD_S = 2.0  # of persons' differences; `runs` has exactly this


def study(**claims):
    return {"factors": {"pattern": PATTERNS}, "answer": CONTRAST} | claims


def runs(persons=8, mean_s=3.0):
    """Differences between the patterns with a known mean and standard deviation."""
    scores = np.linspace(-1, 1, persons)
    differences = mean_s + SPREAD_S * scores / scores.std(ddof=1)
    rows = [
        {"part": "drive", "cell": cell, "person": person, "trial": 0, "seed": person}
        | {"pattern": pattern, "is_reference": False}
        | {"drive_time_s": 50.0 + (differences[person] if cell == 0 else 0.0)}
        for person in range(persons)
        for cell, pattern in enumerate(PATTERNS)
    ]
    return synthetic_results.columns(rows)


def fewest(wanted, distance_s, alpha, power):
    return next(n for n in range(2, 1000) if power(n, distance_s, alpha) >= wanted)


def persons_of(found):
    return [plan.counts[0].persons for plan in found]


def stretched(alpha, persons=8):
    """Power where the interval reaches beyond Student's as far as that of these persons does."""
    scores = np.linspace(-1, 1, persons)
    scores *= SPREAD_S / scores.std(ddof=1)
    shown = mean_interval(scores, range(persons), 1 - 2 * alpha)
    stretch = -shown.low / (stats.t.isf(alpha, persons - 1) * SPREAD_S / math.sqrt(persons))
    assert 1.0 <= stretch < 1.1

    def power(n, distance_s, alpha):
        shift = distance_s / SPREAD_S * math.sqrt(n)
        return stats.nct.sf(stretch * stats.t.isf(alpha, n - 1), n - 1, shift)

    return power


def test_a_claim_needs_what_a_one_sided_test_of_its_distance_to_the_margin_needs():
    claims = {"slow": {"direction": "above", "margin": 2.0}}
    (plan,) = plans(study(hypotheses=claims), runs())
    assert plan.assumed.endswith("as found")
    expected = [fewest(p, 1.0, 0.05, stretched(0.05)) for p in (0.8, 0.9)]
    assert [c.persons for c in plan.counts] == expected == [27, 37]  # 27 and 36 by Student's


def test_two_claims_of_a_family_share_the_five_percent():
    claims = {name: {"direction": "above", "margin": 2.0} for name in ("one", "two")}
    found = plans(study(hypotheses=claims), runs())
    assert found[0].counts[0].persons == fewest(0.8, 1.0, 0.025, stretched(0.025)) > 27


def test_sameness_takes_two_tests_one_at_each_end_of_the_margin():
    one_sided = stretched(0.05)

    def both(n, distance_s, alpha):
        return one_sided(n, 1.0 - distance_s, alpha) + one_sided(n, 1.0 + distance_s, alpha) - 1

    claims = {"same": {"direction": "same", "margin": 1.0}}
    (plan,) = plans(study(hypotheses=claims), runs(mean_s=0.25), decided={"answer"})
    assert plan.assumed.endswith("as found")
    assert plan.counts[0].persons == pytest.approx(fewest(0.8, 0.25, 0.05, both), abs=1)


@pytest.mark.parametrize(
    ("claim", "means"),
    [
        ({"direction": "above", "margin": 2.0}, (2.2, 2.6, 3.0)),
        ({"direction": "below", "margin": 2.0}, (-2.2, -2.6, -3.0)),
        ({"direction": "same", "margin": 2.0}, (-1.0, 0.9, 1.5)),
    ],
)
def test_a_claim_that_is_open_needs_more_persons_than_there_are(claim, means):
    declared = study(hypotheses={"claim": claim})
    for mean_s in means:
        (tested,) = judged(declared, runs(mean_s=mean_s)).tested
        assert tested.verdict == "open"
        found = plans(declared, runs(mean_s=mean_s), decided={"answer"})
        assert min(persons_of(found)) > 8


def test_no_number_of_persons_shows_what_is_not_so():
    claims = {"fast": {"direction": "below"}, "slower": {"direction": "above", "margin": 3.5}}
    found = plans(study(hypotheses=claims), runs())
    assert [plan.counts for plan in found] == [(), ()]
    assert "no number of them" in plan_lines(found, "person")[0]
    assert plan_table(found, "person").rows[0][2].startswith("no number")


def test_without_claims_the_answer_needs_what_shows_the_effect_that_matters():
    declared = study()
    declared["answer"] = CONTRAST | {"smallest_effect_s": 1.5}
    found, smallest = plans(declared, runs())
    assert (found.name, found.known_from) == ("answer", 8)
    assert "3.0\N{NO-BREAK SPACE}s, the largest found" in found.assumed
    assert "1.5\N{NO-BREAK SPACE}s, the smallest" in smallest.assumed
    n, power = smallest.counts[0].persons, stretched(0.025)
    assert power(n - 1, 1.5, 0.025) < 0.8 <= power(n, 1.5, 0.025)


def test_a_test_by_swapping_labels_takes_six_persons_however_large_the_effect():
    (plan,) = plans(study(comparisons={"c": CONTRAST}), runs(mean_s=1000.0))
    assert plan.counts[0].persons == 6


def test_a_spread_known_from_three_persons_leaves_the_number_wide_open():
    """The 95 % interval of a variance from 3 persons: 0.27 to 39 times what was seen."""
    claims = {"slow": {"direction": "above", "margin": 2.0}}
    plan = plans(study(hypotheses=claims), runs(persons=3))[-1]
    count = plan.counts[0]
    assert count.low / count.persons == pytest.approx(2 / stats.chi2.ppf(0.975, 2), rel=0.1)
    assert count.high / count.persons == pytest.approx(2 / stats.chi2.ppf(0.025, 2), rel=0.01)


def test_more_than_ten_thousand_persons_are_not_counted():
    claims = {"slow": {"direction": "above", "margin": 2.99}}
    found = plans(study(hypotheses=claims), runs())
    assert math.isinf(found[0].counts[0].persons)
    assert "more than 10,000 (" in plan_table(found, "person").rows[0][2]


def test_one_person_plans_nothing():
    assert plans(study(), runs(persons=2)) != []
    one = {key: values[:2] for key, values in runs(persons=2).items()}
    assert plans(study(), one) == []


def test_the_answer_needs_persons_only_where_its_question_is_open():
    declared = study(hypotheses={"slow": {"direction": "above", "margin": 2.0}})
    declared["answer"] = CONTRAST | {"smallest_effect_s": 0.5}
    assert [p.name for p in plans(declared, runs(mean_s=3.0))] == ["slow"]
    found = plans(declared, runs(mean_s=1.1))
    assert [p.name for p in found] == ["answer", "answer", "slow"]
    assert "1.1\N{NO-BREAK SPACE}s, the largest found" in found[0].assumed
    assert "0.50\N{NO-BREAK SPACE}s, the smallest" in found[1].assumed


def test_an_effect_that_seems_not_to_matter_is_not_asked_about():
    """Only the smallest that matters is: with that many persons a smaller one is excluded."""
    declared = study()
    declared["answer"] = CONTRAST | {"smallest_effect_s": 1.5}
    (plan,) = plans(declared, runs(mean_s=0.6), decided=())
    assert "1.5\N{NO-BREAK SPACE}s, the smallest" in plan.assumed
    assert plan.counts[0].persons > 8


DELAYS = [0.0, 0.5, 1.0]


def along_delays(means, spreads, persons=8):
    """Runs whose difference has these means and standard deviations at three delays."""
    scores = np.linspace(-1, 1, persons)
    scores /= scores.std(ddof=1)
    rows = [
        {"part": "drive", "cell": 3 * cell + at, "person": person, "trial": 0, "seed": person}
        | {"pattern": pattern, "link.delay_s": delay, "is_reference": False}
        | {"drive_time_s": 50.0 + (cell == 0) * (means[at] + spreads[at] * scores[person])}
        for person in range(persons)
        for cell, pattern in enumerate(PATTERNS)
        for at, delay in enumerate(DELAYS)
    ]
    answer = CONTRAST | {"over": "link.delay_s"}
    factors = {"pattern": PATTERNS, "link.delay_s": DELAYS}
    return {"factors": factors, "answer": answer}, synthetic_results.columns(rows)


@pytest.mark.parametrize("decided", [None, ()])
def test_the_largest_difference_found_is_asked_about_and_not_a_tiny_one(decided):
    """At delay 0 nobody differs by more than a little; that is not the question."""
    declared, rows = along_delays((0.07, 0.5, 2.0), (1.0, 1.0, 4.0))
    (plan,) = plans(declared, rows, decided=decided)
    assert "delay 1\N{NO-BREAK SPACE}s" in plan.what
    assert "2.0\N{NO-BREAK SPACE}s, the largest found" in plan.assumed
    assert plan.counts[0].persons < 100


def test_where_the_largest_difference_is_shown_nothing_is_left_to_plan():
    declared, rows = along_delays((0.07, 0.5, 20.0), (1.0, 1.0, 4.0))
    assert plans(declared, rows, decided=()) == []
    declared["answer"] |= {"smallest_effect_s": 0.5}
    (plan,) = plans(declared, rows, decided=())
    assert "0.50\N{NO-BREAK SPACE}s, the smallest" in plan.assumed


def test_a_comparison_is_planned_where_its_difference_is_largest():
    declared, rows = along_delays((2.0, 0.5, 0.07), (4.0, 1.0, 1.0))
    declared["comparisons"] = {"c": declared.pop("answer")}
    (plan,) = [plan for plan in plans(declared, rows) if plan.name == "c"]
    assert "2.0\N{NO-BREAK SPACE}s, the largest found" in plan.assumed


@pytest.mark.parametrize("mean_s", [-1.6, -0.9, 0.0, 0.3, 0.8, 1.2, 1.6])
def test_where_the_question_is_open_more_persons_are_needed_than_there_are(mean_s):
    declared = study()
    declared["answer"] = CONTRAST | {"smallest_effect_s": 1.0}
    found = plans(declared, runs(mean_s=mean_s), decided=())
    assert found
    assert min(persons_of(found)) > 8


def test_an_answer_that_is_not_open_counts_in_a_pilot_only():
    assert plans(study(), runs(mean_s=3.0), decided=()) == []
    assert [plan.name for plan in plans(study(), runs(mean_s=3.0))] == ["answer"]


def test_an_answer_and_a_claim_about_the_same_contrast_need_about_as_many():
    """Both follow one law: the interval shown has to narrow by the same factor."""
    declared = study(hypotheses={"slow": {"direction": "above"}})
    outlier = runs(persons=8, mean_s=0.0)
    outlier["drive_time_s"][0] += 20.0  # one person waits much longer than all others
    answer, claim = plans(declared, outlier)
    assert (answer.name, claim.name) == ("answer", "slow")
    assert answer.assumed.partition(",")[0] == claim.assumed.partition(",")[0]
    two_sided, one_sided = answer.counts[0].persons, claim.counts[0].persons
    assert one_sided <= two_sided <= 2 * one_sided


def test_with_the_persons_that_it_has_a_study_would_reach_as_far_as_it_shows():
    """The law begins at the very interval of the answer that the report prints."""
    for mean_s in (0.1, 1.0, 1.5):
        view = view_of(study(), runs(persons=12, mean_s=mean_s))
        finding = finding_of(view)
        (test,) = _of_answer(view, in_any_case=True)
        assert test.law.reach(12) == pytest.approx(finding.mean[0] - finding.low[0])


def test_what_is_decided_needs_no_more_persons():
    claims = {name: {"direction": "above", "margin": 2.0} for name in ("one", "two")}
    found = plans(study(hypotheses=claims), runs(), decided={"one"})
    assert [plan.name for plan in found] == ["two"]
    assert found[0].counts[0].persons == persons_of(plans(study(hypotheses=claims), runs()))[1]


def test_a_mean_that_hangs_on_a_run_with_the_whole_horizon_is_told_with_the_median():
    """11 persons differ by 2 s; the twelfth was not confirmed and counts with 600 s."""
    rows = runs(persons=12)
    rows["drive_time_s"] = np.where(rows["cell"] == 0, 52.0, 50.0)
    rows["confirmed"] = np.ones(24)
    rows["confirmed"][0], rows["drive_time_s"][0] = 0.0, 600.0
    view = view_of(study(), rows)
    text = few_that_weigh(finding_of(view), view).replace("\N{NO-BREAK SPACE}", " ")
    assert unnamed(text, "600 s", "1 of 24 runs", "median 2.0 s", "2.0 to 2.0 s") == []


def test_where_all_were_confirmed_no_run_weighs_more_than_another():
    rows = runs(persons=12) | {"confirmed": np.ones(24)}
    view = view_of(study(), rows)
    assert few_that_weigh(finding_of(view), view) == ""
