import os
import socket
from collections.abc import Iterator

import pytest

from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.emulator.relay import CHUNK_BYTES, Proxy
from dva_sim.network.link import LinkConfig

FOREVER = 1e9


class Relayed:
    """A connection through a proxy that runs only while somebody waits for bytes."""

    def __init__(self, **config: object) -> None:
        self.robot = socket.create_server(("127.0.0.1", 0))
        target = f"tcp://127.0.0.1:{self.robot.getsockname()[1]}"
        self.proxy = Proxy(links_of(LinkConfig(**config), seed=1), target)  # type: ignore[arg-type]
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
    assert relayed.proxy.report().up.passed_packets >= 50_000 / CHUNK_BYTES


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
    narrow = Relayed(rate_bps=1e8, queue_packets=1)
    payload = os.urandom(100_000)
    assert narrow.carry(narrow.near, narrow.far, payload) == payload
    assert narrow.proxy.report().up.lost_in_queue == 0
    narrow.close()
