"""A robot's computer: what overtakes what, and what only pretends to."""

from __future__ import annotations

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

    def __init__(self, processing: float = 0.05) -> None:
        self.clock, self.done = Clock(), list[bytes]()
        self.inbox = CommandQueue(self.clock, lambda: processing, self._handle, latest_wins=True)

    def _handle(self, letter: Letter) -> None:
        self.done.append(letter.data)

    def ask(self, data: bytes) -> None:
        self.inbox.request(Request(data, lambda _: None))


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
