"""The operator's end of ZeroMQ's requests, beside a robot that answers when a test says so."""

import time

import pytest
import zmq
from helpers.network.free_ports import free_port
from helpers.processes.patience import PATIENCE_S

from dva_sim.network.middleware import Rendezvous, load_transport

pytestmark = pytest.mark.system
TIMEOUT_S = 0.2


@pytest.fixture
def port():
    return free_port()


@pytest.fixture
def robot(port):
    with zmq.Context() as context, context.socket(zmq.ROUTER) as socket:
        socket.linger = 0
        socket.rcvtimeo = int(1000 * PATIENCE_S)
        socket.bind(f"tcp://127.0.0.1:{port}")
        yield socket


@pytest.fixture
def operator(robot, port, tmp_path):
    ready_by = time.monotonic() + PATIENCE_S
    place = Rendezvous("127.0.0.1", "127.0.0.1", port, tmp_path, ready_by)
    options = {"pattern": "req-rep", "timeout_s": TIMEOUT_S}
    end = load_transport("zeromq", options)().near(place, lambda _: None)
    yield end
    end.close()


def test_one_command_is_under_way_until_its_reply_lets_serve_return(robot, operator):
    assert operator.send(b"one")
    assert not operator.send(b"two")
    robot.send_multipart([*robot.recv_multipart()[:2], b"done"])
    until = time.monotonic() + PATIENCE_S
    operator.serve(until)
    assert time.monotonic() < until
    assert operator.send(b"two")


def test_without_a_reply_the_same_command_comes_again_over_another_connection(robot, operator):
    assert operator.send(b"one")
    first = robot.recv_multipart()
    operator.serve(time.monotonic() + 1.5 * TIMEOUT_S)
    again = robot.recv_multipart()
    assert (first[2], again[2]) == (b"one", b"one")
    assert first[0] != again[0]
    assert not operator.send(b"two")
