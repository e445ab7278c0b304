"""The end of a WebSocket connection: what was sent last arrives, whatever is unread."""

import socket
import threading
from types import SimpleNamespace

import pytest

from dva_sim.network.realtime import LiveClock
from dva_sim.ros.websocket import LINGERS, WebSocketConnection

UNREAD = bytes(100_000)


class OpenProtocol:
    """A protocol whose handshake is over, with one command to stand that has not been sent."""

    state = SimpleNamespace(name="OPEN")

    def __init__(self):
        self.out = [b"stand"]

    def send_close(self, code, reason):
        self.out.append(b"bye")

    def data_to_send(self):
        out, self.out = self.out, []
        return out


@pytest.fixture
def ends():
    """A connection with unread bytes, and the socket of its peer."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        ours = socket.create_connection(server.getsockname())
        peer, _ = server.accept()
    peer.sendall(UNREAD)
    ours.setblocking(False)
    gone = []
    connection = WebSocketConnection(
        LiveClock(), ours, OpenProtocol(), lambda _: None, lambda _: gone.append(True)
    )
    yield connection, peer, gone
    peer.close()


def read(peer):
    """All that comes until the connection ends or is reset."""
    got = b""
    try:
        while more := peer.recv(1000):
            got += more
    except ConnectionResetError:
        got += b" reset"
    return got


def test_a_peer_that_reads_gets_what_was_sent_last(ends):
    connection, peer, gone = ends
    got = []

    def reads():
        got.append(read(peer))
        peer.close()

    thread = threading.Thread(target=reads)
    thread.start()
    connection.close(linger=60.0)
    thread.join()
    assert got == [b"standbye"]
    assert gone == [True]


def test_a_peer_that_never_closes_is_not_waited_for_long(ends):
    connection, _, gone = ends
    connection.close(linger=LINGERS / 100)
    assert gone == [True]
    assert not connection.is_open


def test_without_lingering_the_connection_is_reset(ends):
    connection, peer, _ = ends
    connection.close()
    assert read(peer).endswith(b"reset")
