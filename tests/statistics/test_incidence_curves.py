import numpy as np
import pytest

from dva_sim.simulation.timed.bounds import evenness
from dva_sim.statistics import CUT, first_of, incidence

CONFIRMED, ESCALATED = 1, 2


def test_freireich_patients_on_6_mp_relapse_as_the_textbooks_say():
    # Weeks to relapse of 21 patients: E. J. Freireich et al., Blood 21 (1963), 699-716.
    relapsed = [6, 6, 6, 7, 10, 13, 16, 22, 23]
    cut = [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35]
    curve = incidence(relapsed + cut, [1] * 9 + [CUT] * 12, 1)
    left = 1 - curve.at([6, 10, 23])
    np.testing.assert_allclose(left, [0.857, 0.753, 0.448], atol=0.0005)


def test_without_cuts_the_incidence_of_each_cause_is_its_share_of_all_events():
    curve = incidence([10, 20, 20, 30], [CONFIRMED, ESCALATED, CONFIRMED, CONFIRMED], 2)
    np.testing.assert_allclose(curve.at([9.9, 10, 20, 30], CONFIRMED), [0, 0.25, 0.5, 0.75])
    np.testing.assert_allclose(curve.at([10, 20, 30], ESCALATED), [0, 0.25, 0.25])


def test_a_competing_outcome_is_not_treated_as_a_cut():
    # One of two escalates at 10 s. By Kaplan-Meier all would be confirmed by 20 s.
    curve = incidence([10, 20], [ESCALATED, CONFIRMED], 2)
    assert curve.at(20, CONFIRMED) == pytest.approx(0.5)
    assert incidence([10, 20], [CUT, CONFIRMED], 2).at(20, CONFIRMED) == pytest.approx(1.0)


def test_with_cuts_two_causes_add_up_as_computed_by_hand():
    # 4 at risk at 10 s: 1/4 confirmed. Cut at 15 s. 2 at risk at 20 s: 3/4 * 1/2 escalated.
    # 1 at risk at 30 s: 3/8 * 1/1 confirmed.
    curve = incidence([10, 15, 20, 30], [CONFIRMED, CUT, ESCALATED, CONFIRMED], 2)
    np.testing.assert_allclose(curve.shares[0], [1 / 4, 1 / 4, 5 / 8])
    np.testing.assert_allclose(curve.shares[1], [0, 3 / 8, 3 / 8])


def test_the_restricted_mean_counts_the_limit_for_who_never_comes():
    curve = incidence([10, 50, 30, 100], [1, 1, 2, CUT], 2)
    assert curve.restricted_mean(100) == pytest.approx((10 + 50 + 100 + 100) / 4)
    assert curve.restricted_mean(40) == pytest.approx((10 + 40 + 40 + 40) / 4)


def test_percentiles_are_of_all_events_and_not_there_if_too_few_are_reached():
    curve = incidence([10, 20, 30, 40], [1, 1, 1, 2], 2)
    assert curve.quantile(0.5) == 20
    assert curve.quantile(0.75) == 30
    assert np.isnan(curve.quantile(0.9))


def test_of_no_events_nothing_is_said():
    nothing = incidence([], [], 2)
    assert np.isnan(nothing.at(10))
    assert np.isnan(nothing.restricted_mean(10))
    assert np.isnan(nothing.quantile(0.5))


def test_the_first_cause_counts_and_none_after_the_watching_ended():
    time, cause = first_of([[5, np.nan, 90], [7, 8, np.inf]], [60, 60, 60])
    assert time.tolist() == [5, 8, 60]
    assert cause.tolist() == [1, 2, CUT]


def test_evenness_is_one_for_equal_shares_and_one_nth_for_one_who_does_all():
    assert evenness([3, 3, 3]) == pytest.approx(1.0)
    assert evenness([9, 0, 0]) == pytest.approx(1 / 3)
    assert np.isnan(evenness([0, 0]))
