"""Links: rate, queue, loss, delay, recorded traces."""

import numpy as np
import pytest
from helpers.network.links import link

from dva_sim.network.link import TraceRate


def test_a_packet_takes_its_serialisation_and_the_delay():
    assert link(delay_s=0.1, rate_bps=8e6).carry(1.0, 1000) == pytest.approx(1.101)


def test_packets_wait_for_each_other_and_the_queue_drops_the_tail():
    line = link(rate_bps=8e3, queue_bytes=3000)
    arrivals = [line.carry(0.0, 1000) for _ in range(4)]
    assert arrivals[:3] == pytest.approx([1.0, 2.0, 3.0])
    assert arrivals[3] is None
    assert line.dropped == 1
    assert line.carry(1.5, 1000) == pytest.approx(4.0)


def test_loss_is_as_frequent_as_asked_within_three_sigma():
    line, n, p = link(loss=0.1), 20_000, 0.1
    lost = sum(line.carry(i * 0.0137, 100) is None for i in range(n))
    assert abs(lost - n * p) < 3 * np.sqrt(n * p * (1 - p))


def test_two_senders_meet_the_same_weather_at_the_same_time():
    often, seldom = link(loss=0.3), link(loss=0.3)
    fates = {t: often.carry(t / 100, 100) is None for t in range(1000)}
    for t in range(0, 1000, 7):
        assert (seldom.carry(t / 100, 100) is None) == fates[t]


def test_jitter_spreads_evenly_and_never_overtakes():
    line = link(delay_s=0.1, jitter_s=0.05)
    delays = [line.carry(t, 100) - t for t in np.arange(0, 500, 0.5)]
    assert 0.05 <= min(delays) < 0.055
    assert 0.145 < max(delays) <= 0.151
    close = [line.carry(1000 + i * 0.001, 100) for i in range(200)]
    assert close == sorted(close)


def test_a_trace_lets_1500_bytes_through_at_each_opportunity_and_repeats():
    rate = TraceRate(np.array([0.010, 0.020, 0.100]), offset_s=0.0)
    assert rate.depart(0.0, 1500) == pytest.approx(0.010)
    assert rate.depart(0.0, 3000) == pytest.approx(0.100)
    assert rate.depart(0.0, 100) == pytest.approx(0.110)
    assert rate.depart(0.0, 1400) == pytest.approx(0.110)
    assert rate.depart(0.0, 1) == pytest.approx(0.120)


def test_an_opportunity_that_finds_no_packet_is_wasted():
    rate = TraceRate(np.array([0.010, 0.020, 0.100]), offset_s=0.0)
    assert rate.depart(0.015, 100) == pytest.approx(0.020)
    assert rate.backlog_bytes(0.016) == 100
    assert rate.backlog_bytes(0.021) == 0


def test_a_trace_starts_at_a_seeded_offset_and_adds_to_the_delay(tmp_path):
    path = tmp_path / "trace.up"
    path.write_text("".join(f"{ms}\n" for ms in range(0, 1001, 20)))
    first, again, other = (
        link(seed=seed, delay_s=0.5, trace_up=str(path)).carry(0.0, 100) for seed in (1, 1, 2)
    )
    assert first == again != other
    assert 0.5 <= first <= 0.52
