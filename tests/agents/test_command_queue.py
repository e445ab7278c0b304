"""A robot's computer: what overtakes what, and what only pretends to."""

from __future__ import annotations

from typing import Any, NamedTuple

import pytest

from dva_sim.agents.robot.command_queue import LIMIT, CommandQueue, Letter
from dva_sim.kernel.clock import Clock
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode

ROBOT, ANYBODY = "02:00:00:01:00:01", "02:00:00:03:00:01"
EMERGENCY = encode(m.Message(ROBOT, 9, ANYBODY, "12:00:00", 0, m.Emergency()))


class Bench:
    """An inbox that takes 0.05 s for each message."""

    def __init__(self, processing: float = 0.05, read: Any = None) -> None:
        self.clock, self.done = Clock(), list[bytes]()
        service = lambda: processing  # noqa: E731
        self.inbox = CommandQueue(self.clock, service, self._handle, latest_wins=True, read=read)

    def _handle(self, letter: Letter) -> None:
        self.done.append(letter.data)

    def ask(self, data: bytes, peer: str = "") -> None:
        self.inbox.request(Request(data, lambda _: None, peer=peer))


@pytest.mark.parametrize(
    "emergency",
    [EMERGENCY, EMERGENCY.replace(b"<EmergencyMsg>", b"<EmergencyMsg >")],
    ids=["as we write it", "as others may"],
)
def test_an_emergency_overtakes_all_that_waits(emergency: bytes) -> None:
    bench = Bench()
    for number in range(200):
        bench.ask(b"%d" % number)
    bench.ask(emergency)
    bench.clock.run(0.11)
    assert bench.done == [b"0", emergency]


def test_what_only_calls_itself_an_emergency_overtakes_nothing_and_keeps_none_out() -> None:
    bench = Bench()
    for number in range(LIMIT + 1):
        bench.ask(b"<EmergencyMsg>%d" % number)
    bench.ask(EMERGENCY)
    bench.clock.run(0.11)
    assert bench.done == [b"<EmergencyMsg>0", EMERGENCY]


def test_where_processing_takes_no_time_nothing_waits() -> None:
    bench = Bench(processing=0.0)
    bench.ask(b"now")
    assert bench.done == [b"now"]


class Noted(NamedTuple):
    """A message of a peer, as the queue is given it."""

    body: m.Body


def test_who_sends_much_waits_for_itself_and_not_the_others() -> None:
    bench = Bench()
    for number in range(50):
        bench.ask(b"<SetTeleOp>flood %d" % number, peer="flood")
    bench.ask(b"<SetTeleOp>holder", peer="holder")
    bench.clock.run(0.16)
    assert bench.done[:3] == [b"<SetTeleOp>flood 0", b"<SetTeleOp>flood 1", b"<SetTeleOp>holder"]


def test_a_queue_that_one_peer_has_filled_takes_what_another_sends() -> None:
    bench = Bench()
    for number in range(LIMIT + 50):
        bench.ask(b"<SetTeleOp>%d" % number, peer="flood")
    dropped = bench.inbox.overflowed
    bench.ask(b"<SetTeleOp>holder", peer="holder")
    assert (dropped, bench.inbox.overflowed) == (49, 50)
    bench.clock.run(0.16)
    assert b"<SetTeleOp>holder" in bench.done


def test_what_is_refused_when_it_arrives_takes_no_time_and_no_place() -> None:
    read = lambda request: Noted(m.StartTeleOp()) if request.data == b"good" else None  # noqa: E731
    bench = Bench(read=read)
    for _ in range(5 * LIMIT):
        bench.ask(b"bad")
    bench.ask(b"good")
    bench.clock.run(0.051)
    assert bench.done == [b"good"]
    assert (bench.inbox.longest, bench.inbox.overflowed) == (1, 0)
