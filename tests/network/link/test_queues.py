"""Queues in bytes and in packets, per direction; what a link says of itself."""

import pytest
from helpers.network.links import link

from dva_sim.kernel.streams import Streams
from dva_sim.network.link import LinkConfig
from dva_sim.network.link.link import make_link


def test_a_queue_may_count_packets_with_the_one_under_way():
    line = link(rate_bps=8e3, queue_packets=3)
    assert [line.carry(0.0, 1000) for _ in range(4)] == [1.0, 2.0, 3.0, None]
    assert line.carry(0.9, 10) is None
    assert line.carry(1.0, 10) == pytest.approx(3.01)  # one has left
    assert (line.offered, line.dropped, line.lost) == (6, 2, 0)
    assert line.backlog_bytes(1.0) == pytest.approx(2010)


def test_packets_count_whatever_their_size():
    small, large = link(rate_bps=8e3, queue_packets=100), link(rate_bps=8e3, queue_packets=100)
    for line, size in ((small, 40), (large, 9000)):
        assert sum(line.carry(0.0, size) is not None for _ in range(150)) == 100


def test_a_queue_of_packets_before_a_recorded_link(tmp_path):
    path = tmp_path / "slow.up"
    path.write_text("1000\n2000\n")
    line = link(trace_up=str(path), queue_packets=4)
    assert [line.carry(0.0, 1500) is None for _ in range(6)] == [False] * 4 + [True] * 2


def test_a_train_does_not_jump_a_queue_that_counts_packets():
    line = link(queue_packets=5)
    assert line.carry_train(0.0, 3, 3000) is None
    assert line.offered == 0


def test_each_direction_may_have_its_own_rate_and_queue():
    config = {
        "rate_bps": 8e6,
        "queue_bytes": 5000,
        "up": {"rate_bps": 8e3, "queue_packets": 2},
        "down": {"queue_bytes": 3000},
    }
    up, down = link("up", **config), link("down", **config)
    assert (up.rate_bps, down.rate_bps) == (8e3, 8e6)
    assert [up.carry(0.0, 1000) for _ in range(3)] == [1.0, 2.0, None]
    assert [down.carry(0.0, 1000) is None for _ in range(4)] == [False, False, False, True]


def test_a_link_tells_its_rate_and_room(tmp_path):
    path = tmp_path / "a.up"
    path.write_text("5\n")
    plain, recorded = link(queue_bytes=9000), link(trace_up=str(path))
    assert (plain.rate_bps, plain.room) == (20e6, 9000)
    assert recorded.rate_bps is None
    assert link(queue_packets=100).room == 4000  # as many bare TCP headers


@pytest.mark.parametrize(
    "config",
    [
        {"loss": 0.01},
        {"delay_s": 0.1, "jitter_s": 0.01},
        {"delay_s": 0.1, "delay_law": {"law": "gamma", "sd_s": 0.01}},
        {"outages": [{"from_s": 1, "for_s": 1}]},
        {"up": {"loss": 0.01}},
    ],
)
def test_a_link_that_may_lose_or_spread_is_not_ideal(config):
    assert not link(**config).is_ideal()


def test_a_link_is_ideal_whatever_its_delay_rate_and_queue():
    assert link(delay_s=1.0, rate_bps=1e4, queue_packets=3).is_ideal()
    assert link("down", up={"loss": 0.01}).is_ideal()
    assert not make_link(LinkConfig(), "up", Streams(1), "x", lambda: None).is_ideal()
