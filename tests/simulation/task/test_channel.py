import numpy as np
import pytest

from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task.delays import Channel, slow_noise
from dva_sim.simulation.task.scenario import OneWayDelay


def sent(way, extra=0.0, every=0.01, count=500):
    """Times at which things sent at a steady rate arrive."""
    channel, arrivals = Channel(way, extra, Streams(1), "up"), {}
    for step in range(2 * count):
        now = step * every
        if step < count:
            channel.put(now, step)
        for item in channel.take(now):
            arrivals[item] = now
    return arrivals


def test_what_is_sent_comes_out_after_delay_and_extra():
    arrivals = sent(OneWayDelay(delay_s=0.2), extra=0.1)
    assert [arrivals[i] - 0.01 * i for i in (0, 100, 499)] == pytest.approx([0.3] * 3)


def test_a_third_of_it_is_lost_and_the_rest_keeps_its_order():
    arrivals = sent(OneWayDelay(delay_s=0.2, loss=1 / 3))
    assert len(arrivals) == pytest.approx(500 * 2 / 3, abs=40)
    assert list(arrivals) == sorted(arrivals)


def test_jitter_changes_single_delays_within_its_width_and_lets_nothing_overtake():
    arrivals = sent(OneWayDelay(delay_s=0.2, jitter_s=0.1))
    delays = [at - 0.01 * item for item, at in arrivals.items()]
    assert min(delays) >= 0.1 - 1e-9
    assert max(delays) <= 0.3 + 0.01 + 1e-9
    assert max(delays) - min(delays) > 0.1
    assert list(arrivals) == sorted(arrivals)


def test_slow_noise_has_variance_one_and_keeps_its_share():
    noise = slow_noise(np.random.default_rng(1), keep=0.9)
    values = np.array([next(noise) for _ in range(50_000)])
    assert values.std() == pytest.approx(1.0, abs=0.05)
    assert np.corrcoef(values[1:], values[:-1])[0, 1] == pytest.approx(0.9, abs=0.01)
