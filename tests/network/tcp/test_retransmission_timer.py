"""Time-outs from round trips, and the timer that rings when they are over."""

import pytest

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.retransmission_timer import RoundTrip, Timer, next_on_grid


def after(*samples, tick=0.0, **changes):
    times = RoundTrip(TcpOptions(tick=tick, **changes))
    for number, sample in enumerate(samples):
        times.sample(sample, 2 * number, 2 * number + 1)
    return times


def test_before_a_sample_the_timeout_is_one_second():
    assert after().timeout == 1.0


@pytest.mark.parametrize(
    ("rtt", "timeout"),
    [(0.02, 0.22), (0.1, 0.3), (0.2, 0.6), (0.5, 1.5)],  # SRTT + max(200 ms, 4 R/2)
)
def test_the_first_sample_gives_half_of_itself_as_variance(rtt, timeout):
    assert after(rtt).timeout == pytest.approx(timeout)


def test_a_slower_second_sample_follows_the_rfc_by_hand():
    # RTTVAR = 3/4 0.05 + 1/4 |0.1 - 0.5| = 0.1375; SRTT = 7/8 0.1 + 1/8 0.5 = 0.15
    times = after(0.1, 0.5)
    assert times.smoothed == pytest.approx(0.15)
    assert times.timeout == pytest.approx(0.15 + 4 * 0.1375)


def test_the_variance_falls_by_a_quarter_of_the_difference_once_per_round_trip():
    # 0.1, then variation 0.075 in the round that ends, 0.05625 in the next
    assert after(0.2, 0.2).timeout == pytest.approx(0.6)
    assert after(0.2, 0.2, 0.2).timeout == pytest.approx(0.2 + 4 * (0.1 - 0.04375 / 4))


def test_a_round_trip_ends_with_the_first_byte_beyond_what_was_sent_at_its_start():
    times = RoundTrip(TcpOptions(tick=0.0))
    for acknowledged, sent in ((0, 10), (10, 20), (11, 20), (21, 30)):
        times.sample(0.2, acknowledged, sent)
    assert times.timeout == pytest.approx(0.2 + 4 * (0.1 - 0.05 / 4))


def test_a_sudden_improvement_hardly_raises_the_variance():
    # a difference of 0.7 s either way: (0.7 - 0.15) / 4 upwards, (0.7 - 0.5) / 32 downwards
    assert after(0.3, 1.0).variance == pytest.approx(0.15 + 0.1375)
    assert after(1.0, 0.3).variance == pytest.approx(0.5 + 0.00625)


def test_without_variance_the_timeout_is_the_round_trip_and_200_ms():
    assert after(0.5, 0.9, rtt_variance=False).timeout == pytest.approx(0.55 + 0.2)


def test_an_opening_that_measured_nothing_leads_to_three_seconds():
    times = after()
    times.without_sample()
    assert times.timeout == 3.0


def test_the_timeout_is_never_beyond_the_longest():
    assert after(100.0, max_rto=120.0).timeout == 120.0


def test_the_timeout_is_in_whole_ticks_of_the_kernel():
    assert after(0.0501, tick=0.004).timeout == pytest.approx(0.252)


# --- the timer -----------------------------------------------------------------------------


def rung(*deadlines, tick=0.0):
    clock, rings = Clock(), []
    timer = Timer(clock, lambda: rings.append(round(clock.now, 6)), tick)
    for deadline in deadlines:
        timer.set(deadline)
    clock.run(10.0)
    return rings


def test_it_rings_once_at_its_deadline():
    assert rung(0.3) == [0.3]


@pytest.mark.parametrize("deadlines", [(0.3, 0.5), (0.5, 0.3), (0.3, 0.5, 0.3), (0.1, 0.9, 0.4)])
def test_only_the_last_deadline_counts(deadlines):
    assert rung(*deadlines) == [deadlines[-1]]


def test_stopped_it_does_not_ring():
    clock, rings = Clock(), []
    timer = Timer(clock, lambda: rings.append(clock.now))
    timer.set(0.3)
    timer.stop()
    clock.run(1.0)
    assert rings == []


@pytest.mark.parametrize(
    ("wait", "grid"),
    [
        (0.04, 0.004),
        (0.252, 0.004),
        (0.256, 0.032),
        (0.3, 0.032),
        (2.0, 0.032),
        (3.0, 0.256),
        (20.0, 2.048),
    ],
)
def test_the_longer_the_wait_the_coarser_the_wheel_at_250_ticks_a_second(wait, grid):
    for now in (0.0011, 0.77, 1.2345):
        ring = next_on_grid(now, wait, 0.004)
        assert now + wait <= ring <= now + wait + grid + 0.004
        assert ring / grid == pytest.approx(round(ring / grid))


def test_a_short_wait_ends_one_tick_after_its_ticks_and_no_later():
    assert next_on_grid(0.0, 0.04, 0.004) == pytest.approx(0.044)
    assert next_on_grid(0.0039, 0.04, 0.004) == pytest.approx(0.044)
    assert next_on_grid(0.004, 0.04, 0.004) == pytest.approx(0.048)


def test_on_a_wheel_a_timeout_of_309_ms_ends_on_the_next_multiple_of_32_ms():
    assert rung(0.309, tick=0.004) == [0.32]
