"""Links: rate, queue, loss, delay, recorded traces."""

import numpy as np
import pytest
from helpers.network.links import GAMMA, NORMAL, SHIFTED, link

from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.link import LinkConfig, TraceRate, read_trace


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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1\nx\n", ":2:1: should be a whole millisecond"),
        ("5\n3\n", ":2:1: 3 ms comes after 5 ms"),
        ("", "no packet opportunity"),
        ("0\n", "no packet opportunity"),
    ],
)
def test_a_bad_trace_is_refused_with_its_line(tmp_path, text, words):
    path = tmp_path / "bad.up"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_trace(str(path))
    assert words in str(caught.value)


def test_a_missing_trace_is_named():
    with pytest.raises(ConfigError, match=r"nowhere\.up: "):
        read_trace("nowhere.up")


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"delay_s": 0.05, "delay_law": NORMAL}, "sd_s 0.02 of a normal law is above a third of"),
        ({"delay_s": 0.03, "delay_law": GAMMA}, "least_s 0.04 should be below delay_s 0.03"),
        ({"delay_s": 0.04, "delay_law": SHIFTED}, "least_s 0.04 should be below delay_s 0.04"),
        ({"delay_s": 0.1, "up": {"delay_s": 0.05}, "delay_law": NORMAL}, "third of delay_s 0.05"),
        ({"delay_s": 0.1, "jitter_s": 0.1, "delay_law": NORMAL}, "jitter_s and delay_law exclude"),
        ({"delay_law": NORMAL, "delay_log": "x", "delay_s": 1}, "delay_law and delay_log exclude"),
        ({"delay_law": {"law": "empirical"}}, "needs either delays_s or file"),
        ({"delay_law": "normal"}, "delay_law: a law is a mapping, such as .*, not 'normal'"),
        ({"delay_law": {"law": "normal"}}, "missing key 'delay_law.sd_s'"),
        ({"delay_law": {"law": "cauchy"}}, "'cauchy'.*normal, gamma"),
        ({"delay_law": {"law": "gamma", "sd_s": 1, "sdd": 2}}, "unknown key 'delay_law.sdd'"),
        ({"up": {"delay": 1}}, "unknown key 'up.delay'; did you mean 'delay_s'"),
        ({"bursts": {}}, "bursts need either mean_s or mean_packets"),
        ({"bursts": {"mean_s": 1, "mean_packets": 2}}, "bursts need either"),
        ({"loss": 0.5, "bursts": {"mean_s": 1, "loss": 0.5}}, "should be below bursts.loss 0.5"),
        ({"loss": 0.8, "bursts": {"mean_packets": 2}}, "too short for a loss of 0.8: at least 4"),
        ({"loss": 0.1, "down": {"loss": 0.6}, "bursts": {"mean_s": 1, "loss": 0.5}}, "loss 0.6"),
        ({"outages": [{"from_s": 1}]}, "missing key 'outages.0.for_s'"),
        ({"outages": [{"from_s": 1, "for_s": 2, "every_s": 2}]}, "for_s 2 should be below every_s"),
        ({"outages": [{"from_s": 1, "for_s": 2, "direction": "left"}]}, "up, down or both"),
        ({"partitions": [{"from_s": 1, "for_s": 2, "to": "x"}]}, "unknown key 'partitions.0.to'"),
        ({"queue_packets": 0}, "queue_packets: "),
        ({"delay_s": 0.1, "jitter_s": 0.2}, r"jitter_s 0\.2 .*delay_s 0\.1"),
    ],
)
def test_what_no_link_can_be_is_refused(config, words):
    with pytest.raises(ConfigError, match=words):
        validate(LinkConfig, config)
