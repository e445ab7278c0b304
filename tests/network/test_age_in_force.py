"""The age of the command in force, beside what a look at every moment finds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.network.age_in_force import AgeInForce, AgesOverTime, is_applied

START, SINCE, UNTIL = 0.0, 2.0, 6.0


def times(*values: float) -> np.ndarray:
    return np.array(values)


@st.composite
def arrivals(draw):
    """Times at which commands were made and applied, in order; some before the window."""
    steps = st.lists(st.floats(0.01, 2.0), min_size=0, max_size=12)
    made = np.cumsum(draw(steps))
    late = np.array(draw(st.lists(st.floats(0.01, 3.0), min_size=len(made), max_size=len(made))))
    return made, np.maximum.accumulate(made + late)


@given(arrivals())
def test_age_in_force_is_what_one_finds_at_every_moment(found):
    made, applied = found
    moments = np.linspace(SINCE, UNTIL, 4001)[:-1] + 0.0005
    newest = np.searchsorted(applied, moments, side="right")
    seen = moments - np.concatenate([[START], made])[newest]

    force = AgeInForce(made, applied, START)
    assert np.allclose(force.at(moments), seen, rtol=1e-6)
    ages = force.over(SINCE, UNTIL)
    assert ages.mean == pytest.approx(seen.mean(), abs=0.01)
    assert ages.share_above(1.0) == pytest.approx((seen > 1.0).mean(), abs=0.01)
    for share in (0.05, 0.5, 0.95):
        at = ages.quantile(share)
        assert (seen < at - 0.002).mean() <= share + 0.01
        assert (seen < at + 0.002).mean() >= share - 0.01


def test_a_command_that_arrives_after_a_newer_one_or_again_is_not_applied():
    assert is_applied([1, 3, 2, 3, 4]).tolist() == [True, True, False, False, True]


def test_an_outdated_command_leaves_the_newer_one_in_force():
    in_order = AgeInForce(times(1.0, 2.0), times(2.5, 3.0), START)
    late = AgeInForce(times(2.0, 1.0), times(3.0, 4.0), START)
    assert late.at(times(5.0)) == in_order.at(times(5.0)) == 3.0


def test_a_command_a_second_late_by_a_tenth_is_six_tenths_old_on_average():
    made = np.arange(0.0, 12.0)
    assert AgeInForce(made, made + 0.1, START).over(2.0, 10.0).mean == pytest.approx(0.1 + 0.5)


def test_a_lost_command_lets_the_one_before_it_grow_old():
    """Half a second on average, and a second more for the one second of the eight."""
    made = np.delete(np.arange(0.0, 12.0), 5)
    assert AgeInForce(made, made, START).over(2.0, 10.0).mean == pytest.approx(0.5 + 1.0 / 8)


def test_before_the_first_command_the_age_counts_from_the_start():
    """From 2 to 5 s, and 4 to 9 s."""
    force = AgeInForce(times(1.0), times(5.0), START).over(2.0, 10.0)
    assert force.mean == (3 * 3.5 + 5 * 6.5) / 8


def test_what_is_dropped_is_not_in_force():
    """Half a second each: one is young, one was old when it took effect."""
    force = AgesOverTime(times(0.0, 2.0), times(0.5, 0.5))
    assert force.mean == (0.25 + 2.25) / 2
    assert force.share_above(1.0) == 0.5
    assert math.isnan(AgesOverTime(times(), times()).mean)
