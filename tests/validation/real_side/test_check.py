from functools import partial

import numpy as np
import pytest

from dva_sim.cli.checks import check
from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.link import LinkConfig
from dva_sim.network.link.losses import Bursts
from dva_sim.network.pattern_runs import UNLIMITED_BPS
from dva_sim.validation.network.real_side import cell, self_check
from dva_sim.validation.network.real_side.self_check import (
    PROBES,
    Crossing,
    LinkFinding,
    find_bursts,
    find_delay,
    find_jitter,
    find_loss,
    find_rate,
)

fast = partial(LinkConfig, rate_bps=UNLIMITED_BPS)


def crossing(config: LinkConfig, count: int, interval_s: float, size: int = 100) -> Crossing:
    """Datagrams over a wire without devices: never late."""
    wire, _ = links_of(config, seed=3)
    sent = interval_s * np.arange(count)
    out = [(wire.carry(float(at), size), number) for number, at in enumerate(sent)]
    arrived = sorted((at, number) for at, number in out if at is not None)
    numbers = np.array([number for _, number in arrived])
    return Crossing(config, size, sent, numbers, np.array([at for at, _ in arrived]))


def late(of: Crossing, by_s: float) -> Crossing:
    return Crossing(of.wire, of.size, of.sent, of.numbers, of.arrived + by_s)


def test_a_link_that_keeps_its_laws_passes_every_probe():
    for probe in PROBES:
        found = probe.find(crossing(probe.wire, probe.count, probe.interval_s, probe.size))
        assert [str(finding) for finding in found if not finding.passed] == []


def test_a_link_that_is_two_milliseconds_late_is_found_out():
    right = crossing(fast(delay_s=0.05), 100, 0.01)
    assert all(finding.passed for finding in find_delay(late(right, 0.0005)))
    assert not any(finding.passed for finding in find_delay(late(right, 0.002)))


def over(other: LinkConfig, by: Crossing) -> Crossing:
    """Same datagrams under different settings of the link."""
    return Crossing(other, by.size, by.sent, by.numbers, by.arrived)


def test_a_link_that_loses_too_few_is_found_out():
    few = crossing(fast(loss=0.07), 4000, 5e-4)
    assert find_loss(few)[0].passed
    assert not find_loss(over(fast(loss=0.1), few))[0].passed


def test_single_losses_are_not_taken_for_bursts():
    single = crossing(fast(loss=0.1), 4000, 5e-4)
    assert not find_bursts(over(fast(loss=0.1, bursts=Bursts(mean_packets=4)), single))[0].passed


def test_a_line_that_is_three_percent_slow_is_found_out():
    slow = crossing(LinkConfig(rate_bps=0.97e6, queue_packets=400), 250, 4e-3, 1000)
    assert find_rate(slow)[0].passed
    assert not find_rate(over(LinkConfig(rate_bps=1e6), slow))[0].passed


def test_jitter_that_keeps_the_order_is_not_taken_for_free_jitter():
    ordered = crossing(fast(delay_s=0.05, jitter_s=0.02), 1500, 1e-3)
    assert not find_jitter(ordered)[1].passed


def test_a_finding_says_what_was_wanted_and_whether_it_passed():
    line = str(LinkFinding("rate", "kbit/s", 1000.0, 975.0, 20.0))
    assert line.split()[1::2] == ["975.000", "1000.000", "20.000", "MISSED"]


def test_a_missed_finding_is_the_exit_code(monkeypatch, capsys):
    monkeypatch.setattr(cell, "why_no_packets", lambda: "")
    for found, code in ((50.5, 0), (52.0, 1)):
        findings = [LinkFinding("delay, median", "ms", 50.0, found, 1.0)]
        monkeypatch.setattr(self_check, "check_link", lambda findings=findings: findings)
        assert check(["link"]) == code
    assert "an idle machine" in capsys.readouterr().out


def test_where_there_is_no_link_the_check_says_why_and_offers_the_relay(monkeypatch):
    monkeypatch.setattr(cell, "why_no_packets", lambda: "the emulated link needs Linux")
    with pytest.raises(EmulatorError, match="Linux; a relay"):
        check(["link"])
