import math

import numpy as np
import pytest
import synthetic_study
from scipy import stats

from dva_sim.experiments.needed import plans
from dva_sim.experiments.needed_told import few_that_weigh, plan_lines, plan_table, precision
from dva_sim.experiments.reading import finding_of, view_of

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
    return synthetic_study.columns(rows)


def power_of(n, distance_s, alpha):
    """Of a one-sided t-test."""
    shift = distance_s / SPREAD_S * math.sqrt(n)
    return stats.nct.sf(stats.t.isf(alpha, n - 1), n - 1, shift)


def fewest(wanted, distance_s, alpha, power=power_of):
    return next(n for n in range(2, 1000) if power(n, distance_s, alpha) >= wanted)


def test_a_claim_needs_what_a_one_sided_t_test_of_its_distance_to_the_margin_needs():
    claims = {"slow": {"direction": "above", "margin": 2.0}}
    (plan,) = plans(study(hypotheses=claims), runs())
    assert plan.assumed.endswith("as found")
    assert (
        [c.persons for c in plan.counts] == [fewest(p, 1.0, 0.05) for p in (0.8, 0.9)] == [27, 36]
    )


def test_two_claims_of_a_family_share_the_five_percent():
    claims = {name: {"direction": "above", "margin": 2.0} for name in ("one", "two")}
    found = plans(study(hypotheses=claims), runs())
    assert found[0].counts[0].persons == fewest(0.8, 1.0, 0.025) > 27


def test_sameness_takes_two_tests_and_counts_on_no_difference():
    def both(n, distance_s, alpha):
        return 2 * power_of(n, distance_s, alpha) - 1

    (plan,) = plans(study(hypotheses={"same": {"direction": "same", "margin": 1.0}}), runs())
    assert plan.assumed == "none at all"
    assert plan.counts[0].persons == fewest(0.8, 1.0, 0.05, both)


def test_no_number_of_persons_shows_what_is_not_so():
    claims = {"fast": {"direction": "below"}, "slower": {"direction": "above", "margin": 3.5}}
    found = plans(study(hypotheses=claims), runs())
    assert [plan.counts for plan in found] == [(), ()]
    assert "no number, for then it is not true" in plan_lines(found, "person")[0]
    assert plan_table(found, "person").rows[0][2:] == ["not under this assumption"] * 2


def test_without_claims_the_answer_is_to_be_told_from_zero_by_the_effect_that_matters():
    declared = study()
    declared["answer"] = CONTRAST | {"smallest_effect_s": 1.5}
    (plan,) = plans(declared, runs())
    assert (plan.name, plan.known_from) == ("answer", 8)
    assert "1.5\N{NO-BREAK SPACE}s, the smallest that matters" in plan.assumed
    n = plan.counts[0].persons
    two_sided = [power_of(k, 1.5, 0.025) for k in (n - 1, n)]
    assert two_sided[0] < 0.8 <= two_sided[1]


def test_a_test_by_swapping_labels_takes_six_persons_however_large_the_effect():
    (plan,) = plans(study(comparisons={"c": CONTRAST}), runs(mean_s=1000.0))
    assert plan.counts[0].persons == 6


def test_a_spread_known_from_three_persons_leaves_the_number_wide_open():
    """The 95 % interval of a variance from 3 persons: 0.27 to 39 times what was seen."""
    claims = {"slow": {"direction": "above", "margin": 2.0}}
    (plan,) = plans(study(hypotheses=claims), runs(persons=3))
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


def test_the_answer_says_how_wide_its_interval_is_and_what_half_of_it_takes():
    view = view_of(study(), runs(persons=12))
    told = precision(finding_of(view), view, "person").replace("\N{NO-BREAK SPACE}", " ")
    half_s = stats.t.isf(0.025, 11) * SPREAD_S / math.sqrt(12)
    assert half_s == pytest.approx(1.27, abs=0.01)
    assert "The 95 % interval of the difference throughout is ±1.3 s with 12 persons" in told
    assert "half as wide would take about 4" in told  # 41 by Student's alone


def test_where_the_question_is_open_it_says_what_the_effect_that_matters_takes():
    declared = study()
    declared["answer"] = CONTRAST | {"smallest_effect_s": 0.5}
    view = view_of(declared, runs(persons=12, mean_s=0.1))
    told = precision(finding_of(view), view, "person").replace("\N{NO-BREAK SPACE}", " ")
    found = finding_of(view)
    half_s = max(found.high[0] - found.mean[0], found.mean[0] - found.low[0])
    assert half_s == pytest.approx(1.3, abs=0.1)
    persons = math.ceil(12 * (half_s / 0.5) ** 2)
    assert f"stays open, about {persons} would narrow the band to ±500 ms" in told
    declared["answer"]["smallest_effect_s"] = 1.4  # the band is that narrow, and off its middle
    shifted = view_of(declared, runs(persons=12, mean_s=1.2))
    assert "stays open" not in precision(finding_of(shifted), shifted, "person")


def test_an_answer_without_an_interval_has_no_precision():
    view = view_of(study(), {key: values[:2] for key, values in runs(persons=2).items()})
    assert precision(finding_of(view), view, "person") == ""


def test_a_mean_that_hangs_on_a_run_with_the_whole_horizon_is_told_with_the_median():
    """11 persons differ by 2 s; the twelfth was not confirmed and counts with 600 s."""
    rows = runs(persons=12)
    rows["drive_time_s"] = np.where(rows["cell"] == 0, 52.0, 50.0)
    rows["confirmed"] = np.ones(24)
    rows["confirmed"][0], rows["drive_time_s"][0] = 0.0, 600.0
    view = view_of(study(), rows)
    told = few_that_weigh(finding_of(view), view).replace("\N{NO-BREAK SPACE}", " ")
    assert told.startswith("Where some runs count with 600 s, the mean hangs on them")
    assert "1 of 24 runs, median 2.0 s (2.0 to 2.0 s)" in told


def test_where_all_were_confirmed_no_run_weighs_more_than_another():
    rows = runs(persons=12) | {"confirmed": np.ones(24)}
    view = view_of(study(), rows)
    assert few_that_weigh(finding_of(view), view) == ""
