"""Polling: costs depend on ready sockets, not on open ones, and no event is missed."""

from collections.abc import Callable, Iterator

import pytest
import zmq
from helpers.processes.patience import becomes

from dva_sim.network import realtime
from dva_sim.network.realtime import LiveClock, Poller, has_more
from dva_sim.network.socket_io import cut, read_next

Socket = zmq.Socket[bytes]
Make = Callable[[int], Socket]


@pytest.fixture
def make() -> Iterator[Make]:
    context: zmq.Context[Socket] = zmq.Context()
    made: list[Socket] = []

    def socket(kind: int) -> Socket:
        made.append(context.socket(kind))
        return made[-1]

    yield socket
    context.destroy(linger=0)


def pair(make: Make) -> tuple[Socket, Socket]:
    here, there = make(zmq.PAIR), make(zmq.PAIR)
    port = here.bind_to_random_port("tcp://127.0.0.1")
    there.connect(f"tcp://127.0.0.1:{port}")
    return here, there


def test_a_socket_that_was_not_read_out_is_found_again(make):
    here, there = pair(make)
    poller = Poller()
    poller.register(here)
    for number in range(3):
        there.send(b"%d" % number)
    got: list[bytes] = []

    def read_one() -> bool:
        for socket in poller.poll(0.05):
            got.append(socket.recv())
        return len(got) == 3

    assert becomes(read_one)
    assert got == [b"0", b"1", b"2"]
    assert poller.poll(0.0) == []


def test_what_came_while_the_socket_was_used_is_found_if_one_says_so(make):
    """Asking a socket, or sending, takes the signal away that something has come."""
    here, there = pair(make)
    poller = Poller()
    poller.register(here)
    assert poller.poll(0.0) == []
    there.send(b"news")
    assert becomes(lambda: here.getsockopt(zmq.EVENTS) & zmq.POLLIN)
    assert poller.poll(0.0) == []  # the trap
    poller.look(here)
    assert poller.poll(0.0) == [here]


def test_a_socket_that_is_unregistered_is_not_asked(make):
    here, _ = pair(make)
    poller = Poller()
    poller.register(here)
    poller.unregister(here)
    here.close()
    poller.look(here)
    assert poller.poll(0.0) == []


def test_a_socket_that_was_read_out_is_not_asked_until_its_file_tells(make, monkeypatch):
    here, there = make(zmq.PAIR), make(zmq.PAIR)
    poller, asked = Poller(), list[object]()
    poller.register(here)
    original = realtime.has_more
    monkeypatch.setattr(realtime, "has_more", lambda s: asked.append(s) or original(s))
    poller.read_out(here)
    assert poller.poll(0.0) == []
    assert asked == []
    here.bind("inproc://here")
    there.connect("inproc://here")
    there.send(b"news")
    assert becomes(lambda: poller.poll(0.05) == [here])
    assert poller.has_more(here)
    assert here.recv() == b"news"
    assert not poller.has_more(here)


def test_a_subscription_can_be_cut_while_a_poll_has_begun_a_message(make):
    """Reading on would have ended the process: libzmq asserts that the other part is there."""
    publisher, subscriber = make(zmq.PUB), make(zmq.SUB)
    subscriber.subscribe("frame|")
    subscriber.connect(f"tcp://127.0.0.1:{publisher.bind_to_random_port('tcp://127.0.0.1')}")

    def arrives() -> bool:
        publisher.send_multipart([b"frame|", b"a picture"])
        return has_more(subscriber)

    assert becomes(arrives)
    cut(subscriber)
    assert read_next(subscriber) is None


def test_a_clock_that_is_behind_reads_messages_all_the_same(make):
    here, there = pair(make)
    clock, got = LiveClock(), list[bytes]()
    clock.watch(here, lambda: got.append(here.recv()))
    there.send(b"news")
    assert becomes(lambda: here.getsockopt(zmq.EVENTS) & zmq.POLLIN)
    clock.look(here)
    clock.run(clock.now)  # nothing is left of this time
    assert got == [b"news"]
