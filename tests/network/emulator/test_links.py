"""Links whose packets are real: their fates in a time that is only told."""

from itertools import groupby
from typing import Any

import pytest

from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.link import LinkConfig
from dva_sim.network.pattern_runs import UNLIMITED_BPS, Condition

MANY = 2000


def fates(times: list[float], seed: int = 1, way: int = 0, **config: Any) -> list[float | None]:
    """Transit times of packets in one direction; None for a lost one."""
    given = {"rate_bps": UNLIMITED_BPS} | config
    link = links_of(LinkConfig.model_validate(given), seed)[way]
    arrivals = [link.carry(now, 100) for now in times]
    return [
        None if at is None else round(at - now, 8) for at, now in zip(arrivals, times, strict=True)
    ]


def every(step: float) -> list[float]:
    return [step * number for number in range(MANY)]


JITTERED = {"loss": 0.3, "delay_s": 0.5, "jitter_s": 0.2, "reorder": True}
GAMMA = {"delay_s": 0.1, "delay_law": {"law": "gamma", "sd_s": 0.02}, "reorder": True, "loss": 0.1}


@pytest.mark.parametrize("config", [JITTERED, GAMMA], ids=["jitter", "gamma"])
def test_a_packet_has_the_fate_of_its_number_whenever_it_is_sent(config):
    slow, fast = fates(every(0.5), **config), fates(every(0.0101), **config)
    assert slow == fast
    assert fates(every(0.5), seed=2, **config) != slow
    assert fates(every(0.5), way=1, **config) != slow


def test_a_packet_that_the_queue_refuses_changes_no_later_fate():
    free = fates([0.0] * 20, loss=0.3)
    narrow = fates([0.0] * 20, loss=0.3, rate_bps=1e3, queue_packets=5)
    assert [at is None for at in narrow[:5]] == [at is None for at in free[:5]]
    assert narrow[5:] == [None] * 15


def test_jitter_does_not_change_which_packets_are_lost():
    lost = [
        [at is None for at in fates(every(0.01), loss=0.3, delay_s=1, jitter_s=jitter)]
        for jitter in (0.0, 0.5)
    ]
    assert lost[0] == lost[1]


def test_bursts_last_as_long_however_often_one_sends():
    """Half a second on average: a sender that backs off meets fewer packets of each, not later."""
    lengths = []
    for step in (0.01, 0.04):
        lost = fates([step * n for n in range(int(400 / step))], loss=0.2, bursts={"mean_s": 0.5})
        runs = [len(list(run)) for is_lost, run in groupby(at is None for at in lost) if is_lost]
        lengths.append(step * sum(runs) / len(runs))
    assert lengths[0] == pytest.approx(0.5, rel=0.3)
    assert lengths[1] == pytest.approx(lengths[0], rel=0.2)


def test_each_direction_has_its_own_keys():
    config = {"delay_s": 0.1, "up": {"delay_s": 0.3}, "down": {"loss": 0.9}}
    assert fates([0.0], **config) == [0.3]
    back = fates(every(0.1), way=1, **config)
    assert 0.85 < back.count(None) / MANY < 0.95
    assert set(back) == {None, 0.1}


def test_a_partition_parts_one_end_from_the_other_one_way():
    config = {"partitions": [{"from_s": 1, "for_s": 2, "source": "near", "destination": "far"}]}
    times = [0.5, 1.5, 2.5, 3.5]
    assert fates(times, **config) == [0.0, None, None, 0.0]
    assert fates(times, way=1, **config) == [0.0] * 4


def test_a_condition_sets_both_directions():
    config = Condition("pub", 10, delay_ms=100, jitter_frac=0.2, loss=0.05, rate_kbit=64).link()
    assert (config.delay_s, config.jitter_s) == (pytest.approx(0.1), pytest.approx(0.02))
    assert (config.loss, config.rate_bps, config.queue_packets) == (0.05, 64e3, 100)
