"""Keys on real sockets: who comes together, who does not, and what both ends say."""

import contextlib
import os
import socket as tcp
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zmq
from helpers.processes.patience import PATIENCE_S
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError
from dva_sim.network import security as module
from dva_sim.network.keys import KeyRing, create_keys
from dva_sim.network.realtime import Poller
from dva_sim.network.security import Reason, Refusal, Security
from dva_sim.network.socket_io import cut

pytestmark = pytest.mark.system

ROBOT, OPERATOR = "02:00:00:01:00:01", "02:00:00:03:00:01"
NULL_GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(48)

Socket = zmq.Socket[bytes]


class End:
    """One side with its own context, as in a process of its own."""

    def __init__(self, ring: KeyRing | None, device: str) -> None:
        self.context: zmq.Context[Socket] = zmq.Context()
        self.poller, self.device, self.refusals = Poller(), device, list[Refusal]()
        self.security = Security(self.context, self.poller, ring, self.refusals.append)
        self.open: list[Socket] = []

    def socket(self, kind: int) -> Socket:
        socket = self.context.socket(kind)
        socket.linger = 0
        self.open.append(socket)
        self.poller.register(socket)
        return socket

    def bind(self, kind: int) -> tuple[Socket, str]:
        socket = self.socket(kind)
        self.security.bind_server(socket, self.device)
        return socket, f"tcp://127.0.0.1:{socket.bind_to_random_port('tcp://127.0.0.1')}"

    def connect(self, kind: int, peer: str, endpoint: str) -> Socket:
        socket = self.socket(kind)
        self.security.connect_client(socket, self.device, peer)
        if kind == zmq.SUB:
            socket.subscribe(b"")
        socket.connect(endpoint)
        return socket

    def turn(self) -> list[Socket]:
        """One turn of the loop; the sockets that have something for the application."""
        for socket in self.open:
            self.poller.look(socket)
        return [s for s in self.poller.poll(0.02) if not self.security.handle(s)]

    def close(self) -> None:
        self.security.close()
        assert self.security.sockets() == []
        for socket in self.open:
            socket.close()
        self.context.term()  # hangs if a socket was left open


Make = Callable[[KeyRing | None, str], End]


@pytest.fixture
def make() -> Iterator[Make]:
    ends: list[End] = []

    def end(ring: KeyRing | None, device: str) -> End:
        ends.append(End(ring, device))
        return ends[-1]

    yield end
    for one in ends:
        one.close()


@pytest.fixture
def ring(tmp_path: Path) -> KeyRing:
    return fresh_ring(tmp_path / "keys")


@pytest.fixture
def other_ring(tmp_path: Path) -> KeyRing:
    return fresh_ring(tmp_path / "others")


def fresh_ring(folder: Path) -> KeyRing:
    create_keys(folder, [ROBOT, OPERATOR])
    return KeyRing(folder)


def knows_the_server_only(ring: KeyRing, other: KeyRing, folder: Path) -> KeyRing:
    """A ring with the right key of the robot and a key of the operator nobody knows."""
    (folder / "public").mkdir(parents=True)
    (folder / "secret").mkdir()
    for source, name in ((ring, ROBOT), (other, OPERATOR)):
        stem = name.replace(":", "-")
        public = f"public/{stem}.key"
        (folder / public).write_bytes((source.folder / public).read_bytes())
    secret = folder / "secret" / f"{stem}.key_secret"
    secret.write_bytes((other.folder / "secret" / secret.name).read_bytes())
    secret.chmod(0o600)
    return KeyRing(folder)


def run(ends: list[End], done: Callable[[], object]) -> None:
    """Turn all loops until something has come about."""
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline, "it never came about"
        for end in ends:
            end.turn()


def receive(ends: list[End], socket: Socket) -> list[zmq.Frame]:
    run(ends, lambda: socket.poll(0))
    return socket.recv_multipart(copy=False)


def both_say(server: End, client: End, reason: Reason) -> tuple[str, str]:
    """Final lines of both ends: one each, with the same reason."""
    run([server, client], lambda: server.refusals and client.refusals)
    (at_server,), (at_client,) = server.refusals, client.refusals
    assert (at_server.reason, at_client.reason) == (reason, reason)
    assert (at_server.device, at_client.device) == (server.device, client.device)
    assert at_client.peer == server.device
    assert client.security.trouble(client.device, server.device) == str(at_client)
    lines = str(at_server), str(at_client)
    assert "\n" not in "".join(lines)
    return lines


PAIRS = [(zmq.ROUTER, zmq.REQ), (zmq.ROUTER, zmq.DEALER), (zmq.PUB, zmq.SUB)]
each_pair = pytest.mark.parametrize(("binds", "connects"), PAIRS)


def open_both(server: End, client: End, binds: int, connects: int) -> tuple[Socket, Socket]:
    bound, endpoint = server.bind(binds)
    return bound, client.connect(connects, server.device, endpoint)


@each_pair
def test_a_key_that_is_unknown_is_told_at_both_ends(
    ring, other_ring, make, tmp_path, binds, connects
):
    half = knows_the_server_only(ring, other_ring, tmp_path / "half")
    server, client = make(ring, ROBOT), make(half, OPERATOR)
    open_both(server, client, binds, connects)
    at_server, at_client = both_say(server, client, Reason.UNKNOWN_KEY)
    key = half.public(OPERATOR).decode()[:8]
    assert unnamed(at_server, f"({key}...)", "127.0.0.1") == []
    assert not unnamed(at_client, ROBOT, f"the key of {OPERATOR}")
    assert client.refusals[0].gave_up
    assert server.security.refused[ROBOT, Reason.UNKNOWN_KEY] == 1


@each_pair
def test_a_wrong_server_key_is_told_at_both_ends(ring, other_ring, make, binds, connects):
    server, client = make(ring, ROBOT), make(other_ring, OPERATOR)
    open_both(server, client, binds, connects)
    at_server, at_client = both_say(server, client, Reason.WRONG_SERVER_KEY)
    assert ROBOT in at_server
    assert ROBOT in at_client
    assert not client.refusals[0].gave_up
    assert server.security.refused[ROBOT, Reason.WRONG_SERVER_KEY] >= module.MAX_HANGUPS


@each_pair
@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (Reason.PLAIN_CLIENT, ("no keys", f"{ROBOT} wants keys")),
        (Reason.PLAIN_SERVER, ("keys switched on", f"{ROBOT} has no keys")),
    ],
)
def test_who_has_no_keys_is_told_at_both_ends(ring, make, binds, connects, reason, words):
    rings = (ring, None) if reason is Reason.PLAIN_CLIENT else (None, ring)
    server, client = (make(*each) for each in zip(rings, (ROBOT, OPERATOR), strict=True))
    open_both(server, client, binds, connects)
    reported = zip(both_say(server, client, reason), words, strict=True)
    assert [unnamed(*each) for each in reported] == [[], []]


@pytest.mark.parametrize("connects", [zmq.REQ, zmq.DEALER])
@pytest.mark.parametrize("encrypted", [True, False])
def test_requests_and_replies_travel(ring, make, connects, encrypted):
    keys = ring if encrypted else None
    server, client = make(keys, ROBOT), make(keys, OPERATOR)
    router, asker = open_both(server, client, zmq.ROUTER, connects)
    ends = [server, client]
    asker.send_multipart([b"stop"] if connects == zmq.REQ else [b"", b"stop"])
    who, _, request = receive(ends, router)
    assert request.bytes == b"stop"
    assert server.security.sender(request) == (OPERATOR if encrypted else None)
    router.send_multipart([who, b"", b"stopped"])
    assert receive(ends, asker)[-1].bytes == b"stopped"
    assert server.refusals == client.refusals == []
    assert client.security.trouble(OPERATOR, ROBOT) is None


@pytest.mark.parametrize("encrypted", [True, False])
def test_what_is_published_arrives(ring, make, encrypted):
    keys = ring if encrypted else None
    server, client = make(keys, ROBOT), make(keys, OPERATOR)
    publisher, subscriber = open_both(server, client, zmq.PUB, zmq.SUB)

    def published() -> bool:
        publisher.send_multipart([b"status|", b"idle"])
        return bool(subscriber.poll(0))

    run([server, client], published)
    assert subscriber.recv_multipart() == [b"status|", b"idle"]
    assert server.refusals == client.refusals == []


def test_several_devices_in_one_context(ring, make):
    both = make(ring, ROBOT)
    router, endpoint = both.bind(zmq.ROUTER)
    both.device = OPERATOR
    asker = both.connect(zmq.REQ, ROBOT, endpoint)
    asker.send(b"list")
    assert both.security.sender(receive([both], router)[-1]) == OPERATOR


def test_a_refused_client_can_be_told_to_try_again(ring, other_ring, make, tmp_path):
    half = knows_the_server_only(ring, other_ring, tmp_path / "half")
    server, client = make(ring, ROBOT), make(half, OPERATOR)
    publisher, subscriber = open_both(server, client, zmq.PUB, zmq.SUB)
    both_say(server, client, Reason.UNKNOWN_KEY)
    subscriber.connect(cut(subscriber))
    run([server, client], lambda: server.security.refused[ROBOT, Reason.UNKNOWN_KEY] == 2)
    run([server, client], lambda: client.security.refused[OPERATOR, Reason.UNKNOWN_KEY] == 2)
    assert len(server.refusals) == len(client.refusals) == 1  # once is enough
    server.security._ring = half  # as if started again with the key known
    subscriber.connect(cut(subscriber))
    run([server, client], lambda: client.security.trouble(OPERATOR, ROBOT) is None)
    run([server, client], lambda: publisher.send(b"idle") or subscriber.poll(0))


def test_a_persistent_client_is_told_once(ring, other_ring, make, monkeypatch):
    monkeypatch.setattr(module, "RECONNECT_FIRST", 5)
    server, client = make(ring, ROBOT), make(other_ring, OPERATOR)
    open_both(server, client, zmq.ROUTER, zmq.DEALER)
    run([server, client], lambda: client.security.refused[OPERATOR, Reason.WRONG_SERVER_KEY] > 20)
    assert len(server.refusals) == len(client.refusals) == 1
    assert len(client.security._handshakes) == 1


def test_one_hang_up_is_kept_for_the_time_out_but_not_told(ring, other_ring, make):
    server, client = make(ring, ROBOT), make(other_ring, OPERATOR)
    open_both(server, client, zmq.ROUTER, zmq.REQ)
    run([server, client], lambda: client.security.trouble(OPERATOR, ROBOT))
    assert client.security.refused.total() < module.MAX_HANGUPS
    assert client.refusals == []


def test_strangers_without_number_are_not_told_without_end(ring, make, monkeypatch):
    monkeypatch.setattr(module, "UNKNOWN_KEYS_REPORTED", 3)
    server = make(ring, ROBOT)
    _, endpoint = server.bind(zmq.ROUTER)
    for _ in range(6):
        stranger = server.socket(zmq.REQ)
        stranger.curve_publickey, stranger.curve_secretkey = zmq.curve_keypair()
        stranger.curve_serverkey = ring.public(ROBOT)
        stranger.connect(endpoint)
    run([server], lambda: server.security.refused[ROBOT, Reason.UNKNOWN_KEY] == 6)
    assert len(server.refusals) == 3
    assert "no more" in str(server.refusals[-1])
    assert len(server.security._unknown_keys) == 3


def test_a_loop_that_is_late_does_not_stop_the_traffic(ring, make):
    """libzmq holds up everything when the queue of a monitor is full, by default at 1000."""
    server = make(ring, ROBOT)
    _, endpoint = server.bind(zmq.ROUTER)
    address = "127.0.0.1", int(endpoint.rpartition(":")[2])
    for _ in range(2500):
        with tcp.create_connection(address, timeout=PATIENCE_S) as plain:
            plain.sendall(NULL_GREETING)
            while plain.recv(100):
                pass
    run([server], lambda: server.security.refused[ROBOT, Reason.PLAIN_CLIENT] == 2500)
    assert len(server.refusals) == 1


def test_a_peer_that_only_knocks_is_no_refusal(ring, make):
    server, client = make(ring, ROBOT), make(ring, OPERATOR)
    router, endpoint = server.bind(zmq.ROUTER)
    address = "127.0.0.1", int(endpoint.rpartition(":")[2])
    tcp.create_connection(address).close()
    with tcp.create_connection(address) as web:
        web.sendall(b"GET / HTTP/1.1\r\n\r\n" + bytes(100))
    client.connect(zmq.REQ, ROBOT, endpoint).send(b"list")
    receive([server, client], router)
    assert server.refusals == []


@pytest.mark.parametrize("encrypted", [True, False])
def test_a_peer_that_keeps_silent_is_told(ring, make, monkeypatch, encrypted):
    monkeypatch.setattr(module, "HANDSHAKE_LIMIT", 50)
    client = make(ring if encrypted else None, OPERATOR)
    with tcp.create_server(("127.0.0.1", 0)) as mute:
        client.connect(zmq.REQ, ROBOT, f"tcp://127.0.0.1:{mute.getsockname()[1]}")
        run([client], lambda: client.refusals)
    assert client.refusals[0].reason == Reason.SILENT
    assert ROBOT in str(client.refusals[0])


def test_a_peer_that_hangs_up_without_keys_is_told(make):
    client = make(None, OPERATOR)
    with tcp.create_server(("127.0.0.1", 0)) as rude:
        rude.settimeout(0.0)
        client.connect(zmq.REQ, ROBOT, f"tcp://127.0.0.1:{rude.getsockname()[1]}")

        def hang_up() -> bool:
            with contextlib.suppress(BlockingIOError):
                rude.accept()[0].close()
            return bool(client.refusals)

        run([client], hang_up)
    assert client.refusals[0].reason == Reason.CLOSED


def test_without_an_open_door_nobody_gets_in(ring, make):
    server, client = make(ring, ROBOT), make(ring, OPERATOR)
    router, endpoint = server.bind(zmq.ROUTER)
    server.security.close()
    client.connect(zmq.REQ, ROBOT, endpoint).send(b"list")
    run([server, client], lambda: client.refusals)
    # As good as it can know: hung up, or silent for too long if the machine was busy meanwhile.
    assert client.refusals[0].reason in (Reason.WRONG_SERVER_KEY, Reason.SILENT)
    assert not router.poll(0)


def test_monitors_go_with_their_sockets(ring, make):
    server, client = make(ring, ROBOT), make(ring, OPERATOR)
    released, endpoint = server.bind(zmq.ROUTER)
    closed = client.connect(zmq.REQ, ROBOT, endpoint)
    assert len(server.security.sockets()) == len(client.security.sockets()) == 2
    server.security.release(released)
    assert len(server.security.sockets()) == 1
    client.poller.unregister(closed)
    closed.close()
    run([client], lambda: len(client.security.sockets()) == 1)


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="open files of Linux")
def test_sockets_that_come_and_go_leave_nothing_behind(ring, make):
    client = make(ring, OPERATOR)

    def come_and_go() -> int:
        for _ in range(20):
            asker = client.connect(zmq.REQ, ROBOT, "tcp://127.0.0.1:9")
            client.turn()
            client.security.release(asker)
            client.poller.unregister(asker)
            asker.close()
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208

    come_and_go()
    before = come_and_go()
    run([client], lambda: come_and_go() <= before)


def test_keys_that_are_missing_are_told_before_anything_opens(ring, make):
    end = make(ring, "02:00:00:01:00:09")
    with pytest.raises(ConfigError, match="key of 02:00:00:01:00:09"):
        end.bind(zmq.ROUTER)
    end.device = OPERATOR
    with pytest.raises(ConfigError, match="key of robot-9"):
        end.connect(zmq.REQ, "robot-9", "tcp://127.0.0.1:9")
    assert len(end.security.sockets()) == 1
