import dataclasses
import os
import socket
import sys
from collections.abc import Iterator

import pytest

from dva_sim.kernel.streams import Streams
from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.emulator.cell import EmulatorError
from dva_sim.validation.network.emulator.measuring import measure
from dva_sim.validation.network.emulator.wire import CHUNK_BYTES, EmulatedWire, Proxy, WireConfig

CONDITION = Condition("req", 20, timeout_ms=2500, attempts=3, delay_ms=50, dur_s=1, warm_s=0)
FOREVER = 1e9


class Relayed:
    """A connection through a proxy that runs only while somebody waits for bytes."""

    def __init__(self, **config: object) -> None:
        self.robot = socket.create_server(("127.0.0.1", 0))
        wires = [EmulatedWire(WireConfig(**config), Streams(1), way) for way in ("ab", "ba")]  # type: ignore[arg-type]
        target = f"tcp://127.0.0.1:{self.robot.getsockname()[1]}"
        self.proxy = Proxy((wires[0], wires[1]), target)
        host, _, port = self.proxy.address.removeprefix("tcp://").partition(":")
        self.near = socket.create_connection((host, int(port)))
        self.proxy.run([self.robot.fileno()], FOREVER)
        self.far, _ = self.robot.accept()

    def carry(self, sender: socket.socket, receiver: socket.socket, payload: bytes) -> bytes:
        """Send through the proxy; what arrives, until it is all there."""
        sender.sendall(payload)
        arrived = b""
        while len(arrived) < len(payload):
            assert self.proxy.run([receiver.fileno()], FOREVER) == receiver.fileno()
            arrived += receiver.recv(65_536)
        return arrived

    def close(self) -> None:
        self.proxy.close()
        for end in (self.near, self.far, self.robot):
            end.close()


@pytest.fixture
def relayed() -> Iterator[Relayed]:
    made = Relayed()
    yield made
    made.close()


def test_bytes_cross_in_both_directions_and_in_order(relayed):
    payload = os.urandom(50_000)
    assert relayed.carry(relayed.near, relayed.far, payload) == payload
    assert relayed.carry(relayed.far, relayed.near, payload[::-1]) == payload[::-1]
    assert relayed.proxy.told()["emu_pkts_ab"] >= 50_000 / CHUNK_BYTES


def test_the_end_of_a_stream_crosses_after_its_bytes(relayed):
    relayed.near.sendall(b"last")
    relayed.near.close()
    arrived = b""
    while not arrived.endswith(b"last"):
        relayed.proxy.run([relayed.far.fileno()], FOREVER)
        arrived += relayed.far.recv(100)
    relayed.proxy.run([relayed.far.fileno()], FOREVER)
    assert relayed.far.recv(100) == b""


def test_a_full_queue_holds_the_sender_back_and_drops_nothing():
    """One chunk at a time over a line of 100 Mbit/s."""
    narrow = Relayed(rate_bps=1e8, queue_pkts=1)
    payload = os.urandom(100_000)
    assert narrow.carry(narrow.near, narrow.far, payload) == payload
    assert narrow.proxy.told()["emu_tail_ab"] == 0
    narrow.close()


@pytest.mark.skipif(sys.platform != "linux", reason="programs are tied together as Linux does")
def test_programs_are_measured_through_the_relay():
    """Fifty milliseconds away and five of service; the first twenty round trips."""
    row = measure(CONDITION, 1, "proxy")
    assert float(row["age_p50"]) >= 55
    assert float(row["rtt_p50"]) >= 105
    assert float(row["t_conn_ms"]) < float(row["t_hs_ms"])


@pytest.mark.parametrize("asked", [{"loss": 0.01}, {"reorder": True}])
def test_a_relay_does_not_pretend_what_it_cannot_do(asked):
    with pytest.raises(EmulatorError, match="lose nor reorder"):
        measure(dataclasses.replace(CONDITION, **asked), 1, "proxy")  # type: ignore[arg-type]
