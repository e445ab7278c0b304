import math
import os
import socket
from collections.abc import Iterator
from dataclasses import replace

import pytest

from dva_sim.network.emulator.forwarder import Forwarder, links_of
from dva_sim.network.emulator.report import Durations, LinkFlow, LinkReport
from dva_sim.network.link import LinkConfig, Outage

PACKET = b"\x45" + b"." * 39
FOREVER = 1e9
OUTAGE = (Outage(from_s=0, for_s=5),)


class Pretended:
    """A forwarder between two pairs of sockets, which read like devices; and an open end."""

    def __init__(self, **config: object) -> None:
        self.a, a = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.b, b = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.called, self._call = os.pipe()
        os.write(self._call, b"!")
        for end in (a, b, self.a, self.b):
            end.setblocking(False)
        links = links_of(LinkConfig(rate_bps=1e12, **config), seed=1)  # type: ignore[arg-type]
        self.forwarder = Forwarder((a.detach(), b.detach()), links)

    def turn(self) -> None:
        """Once round: what is due is written, what waits is read."""
        assert self.forwarder.run([self.called], FOREVER) == self.called

    def close(self) -> None:
        self.forwarder.close()
        self.a.close()
        self.b.close()
        os.close(self.called)
        os.close(self._call)


@pytest.fixture
def between() -> Iterator[Pretended]:
    made = Pretended()
    yield made
    made.close()


def test_a_packet_of_either_end_comes_out_at_the_other(between):
    between.a.send(PACKET)
    between.b.send(PACKET + b"back")
    between.turn()
    between.turn()
    assert between.b.recv(100) == PACKET
    assert between.a.recv(100) == PACKET + b"back"
    report = between.forwarder.report()
    up, down = report.up, report.down
    assert (up.offered_packets, up.passed_packets, up.passed_bytes) == (1, 1, len(PACKET))
    assert (down.passed_packets, down.passed_bytes) == (1, len(PACKET) + 4)
    assert 0 <= report.late_p50_s <= report.late_max_s <= up.waited_max_s + down.waited_max_s


def test_packets_keep_their_order(between):
    for number in range(100):
        between.a.send(PACKET + bytes([number]))
    for _ in range(5):
        between.turn()
    assert [between.b.recv(100)[-1] for _ in range(100)] == list(range(100))


def test_what_is_not_ipv4_is_neither_forwarded_nor_counted(between):
    between.a.send(b"\x60" + b"." * 39)
    between.turn()
    between.turn()
    with pytest.raises(BlockingIOError):
        between.b.recv(100)
    assert between.forwarder.report().up.offered_packets == 0


def test_a_packet_that_is_not_due_yet_stays_inside():
    slow = Pretended(delay_s=30)
    slow.a.send(PACKET)
    slow.turn()
    slow.turn()
    with pytest.raises(BlockingIOError):
        slow.b.recv(100)
    slow.close()


def test_an_end_that_is_gone_takes_nothing_and_stops_nobody(between):
    between.a.send(PACKET)
    between.turn()
    between.b.close()
    between.turn()
    assert between.forwarder.report().up.offered_packets == 1


def test_forwarding_ends_at_its_deadline(between):
    assert between.forwarder.run([], deadline=0.0) is None


def test_packets_are_counted_by_what_became_of_them():
    """An outage from the start, twice what the queue holds, and losses after that."""
    up, down = links_of(LinkConfig(loss=0.5, queue_packets=40, outages=OUTAGE), seed=1)
    for _ in range(80):
        up.carry(0.0, 1500)
    for packet in range(40):
        up.carry(10.0 + packet, 1500)
    found = LinkFlow(up).report()
    assert (found.offered_packets, found.lost_in_outage, found.lost_in_queue) == (120, 40, 40)
    assert 5 < found.lost_by_chance < 35
    assert down.offered == 0


def test_durations_are_known_within_a_percent_however_many_there_are():
    durations = Durations()
    for step in range(1, 20_001):
        durations.add(5e-6 * step)
    for share in (0.5, 0.95, 0.99):
        assert durations.quantile(share) == pytest.approx(0.1 * share, rel=0.01)
    assert durations.quantile(1.0) == durations.longest_s == pytest.approx(0.1)
    assert math.isnan(Durations().quantile(0.5))


def test_a_late_forwarder_marks_its_report_as_disturbed(between):
    calm = LinkReport.from_json(between.forwarder.report().to_json())
    for late, disturbed in ((0.0051, True), (0.0049, False)):
        assert replace(calm, late_p99_s=late).is_disturbed == disturbed
    assert replace(calm, overrun_packets=1).is_disturbed
