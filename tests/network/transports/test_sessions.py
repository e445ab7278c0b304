"""Datagram sessions on a link, one message or a few at a time, with arrivals worked out by hand."""

from typing import Any

import pytest

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.network.transports.competition import Bottleneck, BottleneckConfig, ends_at
from dva_sim.network.transports.config import Datagrams, Udp
from dva_sim.network.transports.interface import TransportMessage
from dva_sim.network.transports.sessions import open_session

TRINOMIAL = Datagrams(kind="datagrams", header_bytes=12, increase=0.2, decrease=0.125)
IRTP = Datagrams(
    kind="datagrams", header_bytes=12, increase=1.0, decrease=0.5, repeats_crucial=True
)
BTP = Datagrams(kind="datagrams", header_bytes=12, increase=1.0, decrease=0.2, tolerance_s=0.01)
RTNP = Datagrams(kind="datagrams", header_bytes=12, priority=True)


class Bench:
    """A session on a link of 1 Mbit/s and 50 ms each way."""

    def __init__(self, transport: Any, **link: Any) -> None:
        self.clock = Clock()
        config = BottleneckConfig(**{"rate_bps": 1e6, "delay_s": 0.05} | link)
        self.line = Bottleneck(config, Streams(1))
        self.commands: list[tuple[int, float]] = []
        self.pictures: list[tuple[int, float]] = []
        self.ends = ends_at(
            self.line, transport, self._note(self.commands), self._note(self.pictures)
        )
        self.session = open_session(self.clock, transport, self.ends)

    def _note(self, where: list[tuple[int, float]]) -> Any:
        return lambda number: where.append((number, self.clock.now))

    def send(self, at: float, number: int, size: int = 400, crucial: bool = False) -> None:
        self.clock.call_at(at, self.session.command, TransportMessage(number, size, crucial))


def test_udp_sends_a_command_of_400_bytes_with_28_of_headers():
    bench = Bench(Udp())
    bench.send(1.0, 0)
    bench.clock.run(3.0)
    assert bench.commands == [(0, pytest.approx(1.0 + 428 * 8e-6 + 0.05))]
    assert bench.ends.up.bytes == 428
    assert bench.ends.down.bytes == 0


def test_a_picture_of_4000_bytes_comes_in_three_datagrams_and_counts_when_the_last_is_there():
    bench = Bench(Udp())
    bench.clock.call_at(1.0, bench.session.picture, TransportMessage(0, 4000))
    bench.clock.run(3.0)
    assert bench.ends.down.offered == 3
    assert bench.pictures == [(0, pytest.approx(1.0 + (4000 + 3 * 28) * 8e-6 + 0.05))]


def test_a_picture_that_lacks_a_datagram_is_none():
    bench = Bench(Udp(), queue_bytes=3000)  # room for two of the three
    bench.clock.call_at(1.0, bench.session.picture, TransportMessage(0, 4000))
    bench.clock.run(3.0)
    assert bench.ends.down.dropped == 1
    assert bench.pictures == []


@pytest.mark.parametrize("transport", [TRINOMIAL, IRTP, BTP])
def test_unanswered_a_session_with_a_law_sends_ten_datagrams_and_then_the_newest_per_time_out(
    transport,
):
    bench = Bench(transport)
    bench.ends.down.carry = lambda now, size: None  # no answer comes back
    for number in range(30):
        bench.send(1.0 + 0.1 * number, number)
    bench.clock.run(4.0)
    # the tenth goes at 1.9; at 2.0 the first is given up, and the time-out is 2 s from then on
    assert [number for number, _ in bench.commands] == [*range(10), 29]
    assert bench.commands[-1][1] == pytest.approx(1.9 + 2.0 + 0.05, abs=0.01)


def test_acknowledgements_are_datagrams_of_their_own():
    bench = Bench(TRINOMIAL)
    bench.send(1.0, 0)
    bench.clock.run(2.0)
    assert bench.ends.down.bytes == 28 + 12


def test_once_the_round_trip_is_known_commands_flow_as_often_as_there_are_any():
    bench = Bench(TRINOMIAL)
    for number in range(400):
        bench.send(0.05 * number, number)
    bench.clock.run(25.0)
    late = [number for number, _ in bench.commands if number >= 300]
    assert late == list(range(300, 400))


def test_a_crucial_command_of_irtp_that_was_lost_comes_again_three_commands_later():
    bench = Bench(IRTP)
    carry = bench.ends.up.carry
    bench.ends.up.carry = lambda now, size: None if abs(now - 10.0) < 1e-6 else carry(now, size)
    for number in range(150):
        bench.send(0.1 * number, number, crucial=number == 100)
    bench.clock.run(16.0)
    arrived = dict(bench.commands)
    # lost at 10.0; that the third command after it has arrived is known a round trip after 10.3
    trip = 0.1 + (440 + 40) * 8e-6
    assert arrived[100] == pytest.approx(10.3 + trip + 0.05 + 440 * 8e-6, abs=1e-4)


def test_what_is_not_crucial_is_never_sent_again():
    bench = Bench(IRTP)
    carry = bench.ends.up.carry
    bench.ends.up.carry = lambda now, size: None if abs(now - 10.0) < 1e-6 else carry(now, size)
    for number in range(150):
        bench.send(0.1 * number, number)
    bench.clock.run(16.0)
    assert 100 not in dict(bench.commands)
    assert 101 in dict(bench.commands)


def test_a_crucial_command_sent_twice_is_delivered_once():
    bench = Bench(IRTP)
    back = bench.ends.down.carry
    silent = lambda now, size: None if 9.95 < now < 10.95 else back(now, size)  # noqa: E731
    bench.ends.down.carry = silent
    bench.send(1.0, 0)
    bench.send(10.0, 1, crucial=True)
    bench.clock.run(20.0)
    assert [number for number, _ in bench.commands] == [0, 1]
    assert bench.ends.up.offered == 3


# --- priority ----------------------------------------------------------------------------


def behind_a_queue(transport: Any, place: str) -> float:
    """Arrival time of a command behind ten packets of 1500 bytes."""
    bench = Bench(transport, place=place)
    other = bench.line.link("other", "up")

    def crowd() -> None:
        for _ in range(10):
            other.carry(bench.clock.now, 1500)

    bench.clock.call_at(1.0, crowd)
    bench.send(1.001, 0)
    bench.clock.run(3.0)
    return bench.commands[0][1]


def test_at_the_end_hosts_a_command_with_priority_waits_for_the_packet_under_way_only():
    assert behind_a_queue(RTNP, "hosts") == pytest.approx(1.0 + (1500 + 440) * 8e-6 + 0.05)


def test_in_the_network_priority_is_worth_nothing():
    assert behind_a_queue(RTNP, "network") == pytest.approx(1.0 + (15_000 + 440) * 8e-6 + 0.05)


def test_without_priority_the_place_of_the_queue_makes_no_difference():
    assert behind_a_queue(Udp(), "hosts") == behind_a_queue(Udp(), "network")


def test_what_passes_takes_its_time_from_what_comes_later():
    bench = Bench(RTNP, place="hosts")
    other = bench.line.link("other", "up")
    assert other.carry(0.0, 1500) == pytest.approx(0.05 + 0.012)
    bench.ends.up.carry(0.001, 500)
    assert other.carry(0.002, 1500) == pytest.approx(0.05 + 0.012 + 0.004 + 0.012)
