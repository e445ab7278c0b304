"""The age of the command in force, beside what a look at every moment finds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.network.age_in_force import AgeInForce

START, SINCE, UNTIL = 0.0, 2.0, 10.0


def newest(made: np.ndarray, applied: np.ndarray) -> AgeInForce:
    return AgeInForce.of_newest(made, applied, start=START, since=SINCE, until=UNTIL)


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
    moments = np.linspace(SINCE, UNTIL, 8001)[:-1] + 0.0005
    last = np.searchsorted(applied, moments, side="right")
    seen = moments - np.concatenate([[START], made])[last]

    ages = newest(made, applied)
    assert ages.mean == pytest.approx(seen.mean(), abs=0.01)
    assert ages.share_above(1.0) == pytest.approx((seen > 1.0).mean(), abs=0.01)
    for share in (0.05, 0.5, 0.95):
        at = ages.quantile(share)
        assert (seen < at - 0.002).mean() <= share + 0.01
        assert (seen < at + 0.002).mean() >= share - 0.01


def test_the_age_in_force_of_a_command_a_second_late_by_a_tenth_is_six_tenths():
    made = np.arange(0.0, 12.0)
    assert newest(made, made + 0.1).mean == pytest.approx(0.1 + 0.5)


def test_a_lost_command_lets_the_one_before_it_grow_old():
    made = np.arange(0.0, 12.0)
    came = made != 5.0
    # half a second on average, and a second more for the one second of the eight
    assert newest(made[came], made[came]).mean == pytest.approx(0.5 + 1.0 / 8)


def test_before_the_first_command_the_age_is_that_of_the_run():
    assert newest(np.array([0.0]), np.array([20.0])).mean == pytest.approx(6.0)
    assert newest(np.empty(0), np.empty(0)).quantile(0.5) == pytest.approx(6.0)


def test_what_is_dropped_is_not_in_force():
    """Half a second each: one is young, one was old when it took effect."""
    force = AgeInForce(np.array([0.0, 2.0]), np.array([0.5, 0.5]))
    assert force.mean == pytest.approx((0.25 + 2.25) / 2)
    assert force.share_above(1.0) == 0.5
    assert math.isnan(AgeInForce(np.empty(0), np.empty(0)).mean)
