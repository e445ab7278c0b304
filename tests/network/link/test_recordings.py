"""Recorded links: packet opportunities, delay logs, what ping prints."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.network import links
from helpers.paths import ROOT

from dva_sim.network.link import Link, read_delay_log, read_trace

TRACES = ROOT / "experiments" / "traces"
PING = """\
PING 10.0.0.7 (10.0.0.7) 56(84) bytes of data.
[1700000001.030000] 64 bytes from 10.0.0.7: icmp_seq=1 ttl=57 time=30.0 ms
[1700000002.040000] 64 bytes from 10.0.0.7: icmp_seq=2 ttl=57 time=40.0 ms
[1700000004.000000] no answer yet for icmp_seq=3
[1700000004.600000] 64 bytes from host.example (10.0.0.7): icmp_seq=4 ttl=57 time=600 ms
[1700000004.700000] 64 bytes from host.example (10.0.0.7): icmp_seq=4 ttl=57 time=700 ms (DUP!)
[1700000006.000000] no answer yet for icmp_seq=5
[1700000006.200000] 64 bytes from 10.0.0.7: icmp_seq=5 ttl=57 time=1200 ms
[1700000008.010000] 64 bytes from 10.0.0.7: icmp_seq=8 ttl=57 time=10.0 ms
[1700000009.500000] From 10.0.0.1 icmp_seq=9 Destination Host Unreachable

--- 10.0.0.7 ping statistics ---
9 packets transmitted, 5 received, +1 duplicates, +1 errors, 44.4% packet loss, time 8012ms
rtt min/avg/max/mdev = 10.000/376.000/1200.000/463.914 ms, pipe 2
"""
COLUMNS = "# s, ms\n100.0, 20\n100.5, 40\n101.0, -\n101.5, 30\n"


def write(folder: Path, text: str, name: str = "delays.log") -> str:
    path = folder / name
    path.write_text(text)
    return str(path)


def link(path: str, direction: str = "up", **config: Any) -> Link:
    return links.link(direction, **{"delay_log": path, "rate_bps": links.FAST} | config)


def played(line: Link, every: float = 0.05, count: int = 400) -> list[float | None]:
    """Delays [ms] of packets sent at a steady rate."""
    found = []
    for n in range(count):
        arrival = line.carry(n * every, 100)
        found.append(None if arrival is None else round(1000 * (arrival - n * every), 3))
    return found


def test_what_ping_prints_tells_when_each_request_was_sent_and_which_were_lost(tmp_path):
    log = read_delay_log(write(tmp_path, PING))
    assert log.times - 1.7e9 == pytest.approx([1, 2, 3, 4, 5, 6, 7, 8, 9], abs=1e-5)
    lost = [False, False, True, False, False, True, True, False, True]
    assert np.isnan(log.delays).tolist() == lost
    assert log.delays[~np.isnan(log.delays)] == pytest.approx([0.03, 0.04, 0.6, 1.2, 0.01])


def test_ping_counts_with_16_bits(tmp_path):
    lines = [
        f"[{n}.5] 64 bytes from h: icmp_seq={(65533 + n) % 65536} ttl=9 time=500 ms"
        for n in (0, 1, 2, 4, 3, 6)
    ]
    log = read_delay_log(write(tmp_path, "\n".join(lines)))
    assert log.times == pytest.approx([0, 1, 2, 3, 4, 5, 6])
    assert np.flatnonzero(np.isnan(log.delays)).tolist() == [5]


@pytest.mark.parametrize("gap", [", ", " ", "\t", ";"])
def test_a_log_may_have_two_columns(tmp_path, gap):
    log = read_delay_log(write(tmp_path, COLUMNS.replace(", ", gap)))
    assert log.times.tolist() == [100.0, 100.5, 101.0, 101.5]
    assert log.delays[[0, 1, 3]] == pytest.approx([0.02, 0.04, 0.03])
    assert np.isnan(log.delays[2])


def test_a_packet_meets_the_probe_nearest_in_time_over_and_over(tmp_path):
    line = link(write(tmp_path, COLUMNS), delay_log_share=1, reorder=True)
    once = played(line, every=0.05, count=40)  # two seconds, the length of the log
    assert {d: once.count(d) for d in (20, 40, None, 30)} == {20: 10, 40: 10, None: 10, 30: 10}
    changes = [n for n in range(1, 40) if once[n] != once[n - 1]]
    assert len(changes) in (3, 4)  # in the order of the log, from anywhere in it
    again = played(link(write(tmp_path, COLUMNS), delay_log_share=1, reorder=True), 0.05, 80)
    assert again[:40] == again[40:] == once


def test_half_of_a_round_trip_goes_each_way_on_top_of_the_delay(tmp_path):
    path = write(tmp_path, "0 20\n1 20\n")
    assert set(played(link(path, delay_s=0.1))) == {110.0}
    assert link(path, delay_s=0.1).delay == pytest.approx(0.11)
    assert not link(path).is_ideal()


def test_later_packets_wait_for_earlier_ones_unless_they_may_overtake(tmp_path):
    path = write(tmp_path, "0 900\n1 10\n2 10\n")
    for reorder in (False, True):
        line = link(path, delay_log_share=1, reorder=reorder)
        arrivals = [line.carry(n * 0.05, 100) for n in range(60)]
        assert (arrivals == sorted(arrivals)) is not reorder


def test_a_lost_round_trip_is_lost_in_one_direction_half_of_them_each_way(tmp_path):
    path = write(tmp_path, "".join(f"{n} {'-' if n % 2 else 10}\n" for n in range(2000)))
    up, down = (played(link(path, d), every=1.0, count=2000) for d in ("up", "down"))
    both = [(a is None) + (b is None) for a, b in zip(up, down, strict=True)]
    assert sorted(set(both)) == [0, 1]
    assert both.count(1) == 1000
    assert up.count(None) == pytest.approx(500, abs=4 * 250**0.5)


def test_a_one_way_log_loses_in_its_own_direction(tmp_path):
    path = write(tmp_path, COLUMNS)
    for direction in ("up", "down"):
        assert played(link(path, direction, delay_log_share=1), count=40).count(None) == 10


def test_a_log_begins_at_a_seeded_moment_the_same_in_both_directions(tmp_path):
    path = write(tmp_path, "".join(f"{n} {n}\n" for n in range(1000)))
    up, down, other = link(path), link(path, "down"), link(path, seed=2)
    first = played(up, count=1)
    assert played(down, count=1) == first == played(link(path), count=1)
    assert played(other, count=1) != first


@pytest.mark.parametrize("name", ["cellular.up", "cellular.down"])
def test_a_cellular_link_lets_through_what_was_recorded(name):
    times = read_trace(str(TRACES / name))
    line = links.link(trace_up=str(TRACES / name), queue_bytes=10**9)
    n = len(times)
    arrivals = np.array([line.carry(0.0, 1500) for _ in range(2 * n)], dtype=float)
    assert arrivals[n:] - arrivals[:n] == pytest.approx(float(times[-1]))  # one lap
    gaps = np.diff(times, prepend=0.0)  # the run begins anywhere in the lap
    assert np.sort(np.diff(arrivals[: n + 1])) == pytest.approx(np.sort(gaps), abs=1e-9)


def test_on_a_cellular_link_commands_wait_for_each_gap_in_coverage():
    path = str(TRACES / "cellular.up")
    times = read_trace(path)
    line = links.link(trace_up=path)
    sent = np.arange(0, float(times[-1]), 0.1)
    waits = np.array([line.carry(t, 15) for t in sent.tolist()], dtype=float) - sent
    # A few bytes every 100 ms never queue: each waits for the next opportunity only.
    gaps = np.diff(times, prepend=0.0)
    assert waits.max() == pytest.approx(gaps.max(), abs=0.11)
    assert waits.mean() == pytest.approx((gaps**2).sum() / times[-1] / 2, rel=0.2)
