"""A phone's own times become ours: late ones do not count, a fast or slow clock is followed."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.tilt import PhoneClock


def stream(seconds, *, hz=60.0, fast=0.0, jitter=0.02, least=0.003, seed=1):
    """Samples one by one: true time, the phone's time, and when they come, in order [s]."""
    rng = np.random.default_rng(seed)
    came = 0.0
    for n in range(1, round(seconds * hz)):
        true = n / hz
        came = max(came, true + least + rng.exponential(jitter))
        yield true, 1000.0 + true * (1.0 + fast), came


def errors(samples):
    """Lateness of each converted time [s]."""
    clock = PhoneClock()
    return [clock.times_of([entry], came)[0] - true for true, entry, came in samples]


def test_with_jitter_the_soonest_sample_sets_the_clock():
    found = errors(stream(60.0))
    assert found[-1] == pytest.approx(0.003, abs=0.002)
    assert max(abs(x - 0.003) for x in found[300:]) < 0.003


@pytest.mark.parametrize("fast", [100e-6, -100e-6])
def test_a_clock_that_goes_wrong_by_100_ppm_is_followed_for_an_hour(fast):
    found = errors(stream(3600.0, hz=10.0, fast=fast, jitter=0.01))
    assert max(abs(x - 0.003) for x in found[300:]) < 0.006


def test_a_late_burst_moves_nothing():
    clock = PhoneClock()
    for _, entry, came in stream(10.0, jitter=0.001):
        clock.times_of([entry], came)
    before = clock.offset
    late = [1000.0 + 10.0 + n / 60 for n in range(30)]
    times = clock.times_of(late, 11.0)  # half a second of samples, half a second late
    assert clock.offset - before < 0.0005
    assert [b - a for a, b in pairwise(times)] == pytest.approx([1 / 60] * 29)
    assert times[-1] == pytest.approx(10.0 + 29 / 60 + 0.003, abs=0.002)


def test_a_batch_is_set_by_its_newest_sample():
    times = PhoneClock().times_of([5.00, 5.02, 5.04], 1.0)
    assert times == pytest.approx([0.96, 0.98, 1.0])


def test_who_begins_to_count_again_is_believed_and_what_is_a_little_old_is_not():
    clock = PhoneClock()
    clock.times_of([100.0], 1.0)
    assert clock.is_old(99.0)
    assert clock.is_old(100.0)
    assert not clock.is_old(0.5)
    assert clock.times_of([0.5], 2.0) == [2.0]
    assert clock.times_of([0.6], 2.1) == [pytest.approx(2.1)]


@pytest.mark.system
@given(st.lists(st.tuples(st.floats(0, 1e10), st.floats(0, 10.0)), min_size=1, max_size=50))
def test_times_never_run_back_and_are_never_in_the_future(steps):
    clock, now, last = PhoneClock(), 0.0, float("-inf")
    for entry, passed in steps:
        now += passed
        (time,) = clock.times_of([entry], now)
        assert last <= time <= now
        last = time
