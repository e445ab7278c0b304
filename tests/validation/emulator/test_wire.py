import math

import numpy as np
import pytest

from dva_sim.kernel.streams import Streams
from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.emulator.wire import EmulatedWire, WireConfig

MANY = 20_000


def wire(seed: int = 1, **config: object) -> EmulatedWire:
    return EmulatedWire(WireConfig(**config), Streams(seed), "ab")  # type: ignore[arg-type]


def releases(of: EmulatedWire, times: list[float], size: int = 1000) -> list[float | None]:
    return [of.offer(now, size) for now in times]


def test_a_packet_leaves_when_it_came_where_nothing_is_set():
    assert releases(wire(), [1.0, 1.0, 2.5]) == [1.0, 1.0, 2.5]


def test_a_packet_comes_out_after_the_delay():
    assert releases(wire(delay_s=0.25), [1.0, 2.0]) == [1.25, 2.25]


def test_packets_wait_for_one_another_on_a_slow_line():
    """1000 bytes at 80 kbit/s take 0.1 s."""
    out = releases(wire(rate_bps=80e3, delay_s=0.5), [0.0, 0.0, 0.05, 1.0])
    assert out == pytest.approx([0.6, 0.7, 0.8, 1.6])


def test_a_packet_that_finds_the_queue_full_is_dropped():
    """Of two places one is taken by the packet that is being sent."""
    slow = wire(rate_bps=80e3, queue_pkts=2)
    assert releases(slow, [0.0, 0.0, 0.0]) == [pytest.approx(0.1), pytest.approx(0.2), None]
    assert slow.offer(0.1, 1000) == pytest.approx(0.3)
    assert (slow.counts.offered, slow.counts.lost, slow.counts.tail) == (4, 0, 1)


def test_a_lost_packet_has_used_the_line():
    certain = wire(rate_bps=80e3, loss=0.9)
    out = releases(certain, [0.0] * 50)
    arrived = [round(at / 0.1) for at in out if at is not None]
    assert certain.counts.lost == 50 - len(arrived)
    assert all(at == pytest.approx(0.1 * place) for place, at in enumerate(out, 1) if at)


def test_each_packet_is_lost_by_itself():
    """Within three sigma: the share, and the share of losses that follow a loss."""
    lost = np.array([at is None for at in releases(wire(loss=0.1), [0.0] * MANY)])
    assert abs(lost.mean() - 0.1) < 3 * math.sqrt(0.1 * 0.9 / MANY)
    after = lost[1:][lost[:-1]]
    assert abs(after.mean() - 0.1) < 3 * math.sqrt(0.1 * 0.9 / len(after))


def test_losses_in_bursts_keep_their_share_and_their_length():
    """Runs of 5 on average: a loss follows a loss with 4/5, within three sigma.

    The share of a chain of two states has 1 + r over 1 - r times the variance of single
    losses, where r = 1 - 1/5 - 0.1 / 0.9 / 5 links one packet to the next.
    """
    lost = np.array([at is None for at in releases(wire(loss=0.1, burst_pkts=5), [0.0] * MANY)])
    after = lost[1:][lost[:-1]]
    assert abs(after.mean() - 0.8) < 3 * math.sqrt(0.8 * 0.2 / len(after))
    linked = 1 - 1 / 5 - 0.1 / 0.9 / 5
    sigma = math.sqrt(0.1 * 0.9 / MANY * (1 + linked) / (1 - linked))
    assert abs(lost.mean() - 0.1) < 3 * sigma


def test_jitter_is_uniform_around_the_delay():
    """Packets a second apart: no two wait for one another. Mean and spread within 3 sigma."""
    times = [float(second) for second in range(MANY)]
    out = releases(wire(delay_s=0.1, jitter_s=0.02), times)
    delays = np.array([at - now for at, now in zip(out, times, strict=True) if at is not None])
    assert delays.min() >= 0.08 - 1e-9
    assert delays.max() <= 0.12 + 1e-9
    assert abs(delays.mean() - 0.1) < 3 * 0.02 / math.sqrt(3 * MANY)
    assert delays.std() == pytest.approx(0.02 / math.sqrt(3), rel=0.02)


def test_packets_overtake_only_where_they_may():
    times = [0.001 * step for step in range(1000)]
    ordered = releases(wire(delay_s=0.1, jitter_s=0.02), times)
    assert ordered == sorted(ordered, key=lambda at: at or 0.0)
    free = releases(wire(delay_s=0.1, jitter_s=0.02, reorder=True), times)
    assert free != sorted(free, key=lambda at: at or 0.0)


def test_the_same_seed_has_the_same_luck_and_another_one_another():
    times = [0.01 * step for step in range(200)]
    first, again, other = (wire(seed, loss=0.3, delay_s=1, jitter_s=1) for seed in (1, 1, 2))
    assert releases(first, times) == releases(again, times) != releases(other, times)


def test_jitter_does_not_change_which_packets_are_lost():
    lost = [
        [at is None for at in releases(wire(loss=0.3, delay_s=1, jitter_s=jitter), [0.0] * 100)]
        for jitter in (0.0, 0.5)
    ]
    assert lost[0] == lost[1]


def test_the_backlog_empties_as_packets_leave():
    """1000 bytes at 64 kbit/s take an eighth of a second."""
    slow = wire(rate_bps=64e3)
    releases(slow, [0.0, 0.0, 0.0])
    assert [slow.backlog(now) for now in (0.0, 0.125, 0.3, 0.375)] == [3, 2, 1, 0]


def test_a_condition_sets_both_directions():
    condition = Condition("pub", 10, delay_ms=100, jitter_frac=0.2, loss=0.05, rate_kbit=64)
    config = WireConfig.of(condition)
    assert (config.delay_s, config.jitter_s) == (pytest.approx(0.1), pytest.approx(0.02))
    assert (config.loss, config.rate_bps, config.queue_pkts) == (0.05, 64e3, 100)
