"""A link that changes while it carries: what is under way keeps its fate, and its order."""

import pytest
from helpers.network.links import link

from dva_sim.network.link import LinkConfig


def test_packets_sent_before_keep_their_fate_and_later_ones_do_not_overtake_them():
    way = link(delay_s=0.5, rate_bps=1e9)
    first = way.carry(1.0, 1000)
    way.change(1.1, LinkConfig(delay_s=0.0, rate_bps=1e9))
    assert first == pytest.approx(1.5, abs=1e-4)
    assert way.carry(1.2, 1000) == pytest.approx(1.5, abs=1e-4)
    assert way.carry(1.6, 1000) == pytest.approx(1.6, abs=1e-4)


def test_where_packets_may_overtake_they_do():
    way = link(delay_s=0.5, rate_bps=1e9)
    way.carry(1.0, 1000)
    way.change(1.1, LinkConfig(delay_s=0.0, rate_bps=1e9, reorder=True))
    assert way.carry(1.2, 1000) == pytest.approx(1.2, abs=1e-4)


def test_a_train_of_packets_is_overtaken_by_none_either():
    way = link(delay_s=0.5, rate_bps=1e6)
    last = way.carry_train(1.0, 10, 15_000)
    way.change(1.01, LinkConfig(delay_s=0.0, rate_bps=1e6))
    assert last == pytest.approx(1.62)
    assert way.carry_train(1.02, 1, 100) is None
    assert way.carry(1.02, 100) >= last


def test_what_waits_leaves_at_the_new_rate():
    way = link(delay_s=0.0, rate_bps=1e6, reorder=True)
    way.carry(0.0, 12_500)
    assert way.backlog_bytes(0.05) == pytest.approx(6_250)
    way.change(0.05, LinkConfig(rate_bps=1e5, reorder=True))
    assert way.backlog_bytes(0.05) == pytest.approx(6_250)
    assert way.carry(0.05, 1_250) == pytest.approx(0.05 + 8 * 7_500 / 1e5)


def test_loss_begins_and_ends_with_the_change():
    way = link(delay_s=0.01, rate_bps=1e9)

    def lost(start):
        return sum(way.carry(start + n / 100, 100) is None for n in range(1000))

    assert lost(0.0) == 0
    way.change(10.0, LinkConfig(delay_s=0.01, loss=0.5, rate_bps=1e9))
    assert lost(10.0) == pytest.approx(500, abs=60)
    way.change(20.0, LinkConfig(delay_s=0.01, rate_bps=1e9))
    assert lost(20.0) == 0


def test_jitter_spreads_and_keeps_the_order_through_a_change():
    way = link(delay_s=0.1, rate_bps=1e9)
    arrivals = [way.carry(n / 200, 100) for n in range(200)]
    way.change(1.0, LinkConfig(delay_s=0.1, jitter_s=0.1, rate_bps=1e9))
    arrivals += [way.carry(1.0 + n / 200, 100) for n in range(200)]
    assert arrivals == sorted(arrivals)
    late = [at - (1.0 + n / 200) for n, at in enumerate(arrivals[200:])]
    assert max(late) - min(late) > 0.05


def test_the_weather_of_a_link_is_the_same_at_the_same_time_however_it_came_about():
    changed, drawn = link(delay_s=0.05), link(delay_s=0.05, loss=0.3)
    changed.change(0.0, LinkConfig(delay_s=0.05, loss=0.3))
    times = [n / 50 for n in range(500)]
    assert [changed.carry(t, 100) is None for t in times] == [
        drawn.carry(t, 100) is None for t in times
    ]
