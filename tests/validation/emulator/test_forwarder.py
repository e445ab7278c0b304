import os
import socket
from collections.abc import Iterator

import pytest

from dva_sim.kernel.streams import Streams
from dva_sim.validation.network.emulator.wire import EmulatedWire, Forwarder, WireConfig, tell

PACKET = b"\x45" + b"." * 39
FOREVER = 1e9


class Pretended:
    """A forwarder between two pairs of sockets, which read like devices; and an open end."""

    def __init__(self, **config: object) -> None:
        self.a, a = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.b, b = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        wires = [EmulatedWire(WireConfig(**config), Streams(1), way) for way in ("ab", "ba")]  # type: ignore[arg-type]
        self.called, self._call = os.pipe()
        os.write(self._call, b"!")
        for end in (a, b, self.a, self.b):
            end.setblocking(False)
        self.forwarder = Forwarder((a.detach(), b.detach()), (wires[0], wires[1]))

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
    told = between.forwarder.told()
    assert (told["emu_pkts_ab"], told["emu_pkts_ba"]) == (1, 1)
    assert 0 <= told["emu_late_p50_ms"] <= told["emu_late_max_ms"]


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
    assert between.forwarder.told()["emu_pkts_ab"] == 0


def test_a_packet_that_is_not_due_yet_stays_inside():
    slow = Pretended(delay_s=3600)
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
    assert between.forwarder.told()["emu_pkts_ab"] == 1


def test_forwarding_ends_at_its_deadline(between):
    assert between.forwarder.run([], deadline=0.0) is None


def test_lateness_is_told_in_milliseconds():
    wires = (
        EmulatedWire(WireConfig(), Streams(1), "ab"),
        EmulatedWire(WireConfig(), Streams(1), "ba"),
    )
    told = tell(wires, [0.001 * step for step in range(101)])
    assert told["emu_late_p50_ms"] == pytest.approx(50)
    assert told["emu_late_p99_ms"] == pytest.approx(99)
    assert told["emu_late_max_ms"] == pytest.approx(100)
