import math

import numpy as np
import pytest
from scipy import stats

from dva_sim.statistics import cumulative_incidence, share_interval


def test_a_case_worked_by_hand():
    """At 1 s one of 5 is done; at 2 s one of 4 is lost; one leaves at 3 s; at 4 s one of 2 is done.

    Done: 1/5 + 3/5 x 1/2 = 0.5; lost: 4/5 x 1/4 = 0.2; the rest 0.3.
    """
    found = cumulative_incidence([1, 2, 3, 4, 9], ["done", "lost", None, "done", ""], 5, range(5))
    assert found.causes["done"].mean == pytest.approx(0.5)
    assert found.causes["lost"].mean == pytest.approx(0.2)
    assert found.nothing.mean == pytest.approx(0.3)


def test_followed_to_the_horizon_it_is_the_plain_share_with_its_interval():
    rng = np.random.default_rng(1)
    person = np.repeat(np.arange(24), 5)
    times = rng.exponential(60, 120) * np.repeat(rng.gamma(2, 0.5, 24), 5)
    causes = np.where(rng.random(120) < 0.7, "done", "lost")
    found = cumulative_incidence(times, causes, 90.0, person)
    for cause in ("done", "lost"):
        plain = share_interval((times <= 90) & (causes == cause), person)
        assert found.causes[cause].mean == pytest.approx(plain.mean)
        assert found.causes[cause].low == pytest.approx(plain.low)
        assert found.causes[cause].high == pytest.approx(plain.high)
    assert found.nothing.mean == pytest.approx((times > 90).mean())


def test_with_one_cause_it_is_one_less_kaplan_and_meier_of_scipy():
    rng = np.random.default_rng(2)
    times, left = rng.exponential(50, 200), rng.exponential(80, 200)
    seen, censored = np.minimum(times, left), left < times
    data = stats.CensoredData(uncensored=seen[~censored], right=seen[censored])
    exact = stats.ecdf(data).cdf.evaluate(60.0)
    found = cumulative_incidence(seen, np.where(censored, "", "done"), 60.0, range(200))
    assert found.causes["done"].mean == pytest.approx(float(exact))


@pytest.mark.system
def test_censored_runs_bias_nothing_and_the_intervals_hold():
    """Two constant hazards, 0.012/s and 0.004/s: by 120 s, 3/4 and 1/4 of 1 - exp(-1.92)."""
    rng = np.random.default_rng(3)
    person, gone = np.repeat(np.arange(24), 5), 1 - math.exp(-0.016 * 120)
    truth = np.array([0.75 * gone, 0.25 * gone, 1 - gone])
    held, means = np.zeros(3), np.zeros(3)
    for _ in range(200):
        done, lost, left = rng.exponential([1 / 0.012, 1 / 0.004, 150], (120, 3)).T
        times = np.minimum(np.minimum(done, lost), left)
        causes = np.where(times == left, "", np.where(done < lost, "done", "lost"))
        found = cumulative_incidence(times, causes, 120, person)
        shares = found.causes["done"], found.causes["lost"], found.nothing
        held += [s.low <= true <= s.high for s, true in zip(shares, truth, strict=True)]
        means += [s.mean for s in shares]
    assert means / 200 == pytest.approx(truth, abs=0.012)
    assert np.all(held / 200 >= 0.92)


def test_its_interval_rests_on_leaving_out_each_person_in_turn():
    rng = np.random.default_rng(4)
    person, left = np.repeat(np.arange(8), 5), rng.exponential(60, 40)
    times = np.minimum(rng.exponential(40, 40), left)
    causes = np.where(times == left, "", rng.choice(["done", "lost"], 40))
    found = cumulative_incidence(times, causes, 50, person).causes["done"]
    alone = [
        cumulative_incidence(times[person != i], causes[person != i], 50, person[person != i])
        for i in range(8)
    ]
    variance = 7 * np.var([each.causes["done"].mean for each in alone])
    worth = found.mean * (1 - found.mean) / variance
    worth = min(max(worth, 8), 40) * (stats.t.isf(0.025, 39) / stats.t.isf(0.025, 7)) ** 2
    seen = found.mean * worth
    assert found.low == pytest.approx(stats.beta.ppf(0.025, seen, worth - seen + 1))
    assert found.high == pytest.approx(stats.beta.ppf(0.975, seen + 1, worth - seen))


def test_shares_add_up_to_one_and_an_event_at_the_horizon_counts():
    found = cumulative_incidence([5, 7, 5, 5.1], ["a", "", "b", "c"], 5, [0, 0, 1, 1])
    assert set(found.causes) == {"a", "b"}
    assert sum(s.mean for s in (*found.causes.values(), found.nothing)) == pytest.approx(1)


def test_nobody_and_one_person_have_no_interval():
    assert math.isnan(cumulative_incidence([np.nan], ["a"], 5, [0]).nothing.mean)
    found = cumulative_incidence([1, 2], ["a", "a"], 5, [0, 0]).causes["a"]
    assert found.mean == 1
    assert math.isnan(found.low)
