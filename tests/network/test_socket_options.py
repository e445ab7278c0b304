"""Socket options of a scenario, set on real ZeroMQ sockets or refused."""

from collections.abc import Iterator

import pytest
import zmq
from helpers.processes.patience import PATIENCE_S

from dva_sim.kernel.errors import ConfigError
from dva_sim.live.options import scenario_of
from dva_sim.network.connections import ZeromqConfig
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import LiveOptions

PICTURE, COUNT = b"x" * 60_000, 200
SMALL = ZeromqConfig(high_water_mark=2, send_buffer_bytes=4096, receive_buffer_bytes=4096)


@pytest.fixture
def network(request: pytest.FixtureRequest) -> Iterator[SocketNetwork]:
    made = SocketNetwork(LiveClock(), zeromq=request.param)
    yield made
    made.close()


def live_until_heard(network: SocketNetwork, got: list[bytes], last: bytes) -> None:
    """Publish `last` now and then, which waits its turn behind all else, until it is there."""

    def look() -> bool | None:
        if last in got:
            network.clock.stop()
            return False
        network.publish("robot", "topic", last, len(last))
        return None

    network.clock.every(0.02, look)
    network.clock.run(network.clock.now + PATIENCE_S)


def heard(network: SocketNetwork) -> int:
    """Number of 200 pictures that reach a subscriber who reads after all were sent."""
    got: list[bytes] = []
    network.join("robot")
    subscription = network.subscribe("phone", "robot", "topic", got.append)
    live_until_heard(network, got, b"ready")
    subscription.pause()
    for _ in range(COUNT):
        network.publish("robot", "topic", PICTURE, len(PICTURE))
    subscription.resume()
    live_until_heard(network, got, b"over")
    return got.count(PICTURE)


@pytest.mark.parametrize("network", [None], indirect=True)
def test_two_hundred_pictures_wait_for_a_subscriber_with_usual_marks(network):
    assert heard(network) == COUNT


@pytest.mark.parametrize("network", [SMALL], indirect=True)
def test_pipes_of_two_messages_and_small_buffers_drop_most_of_them(network):
    assert 1 <= heard(network) < 40


@pytest.mark.parametrize(
    ("network", "wanted"),
    [(SMALL, [2, 2, 4096, 4096]), (None, [1000, 1000, -1, -1])],
    indirect=["network"],
)
def test_every_socket_has_what_is_asked_for(network, wanted):
    for kind in (zmq.REQ, zmq.DEALER, zmq.SUB):
        socket = network.client(kind, "phone", "robot")
        found = [socket.getsockopt(o) for o in (zmq.SNDHWM, zmq.RCVHWM, zmq.SNDBUF, zmq.RCVBUF)]
        assert found == wanted


@pytest.mark.parametrize("network", [None], indirect=True)
def test_a_peer_without_power_is_given_up_after_half_a_minute(network):
    """The kernel probes after a silence, and then so often, before it ends a connection."""
    for kind in (zmq.REQ, zmq.DEALER, zmq.SUB):
        socket = network.client(kind, "phone", "robot")
        silence, pause, probes = (
            socket.getsockopt(option)
            for option in (zmq.TCP_KEEPALIVE_IDLE, zmq.TCP_KEEPALIVE_INTVL, zmq.TCP_KEEPALIVE_CNT)
        )
        assert socket.getsockopt(zmq.TCP_KEEPALIVE) == 1
        assert silence + pause * probes == 32
        assert socket.getsockopt(zmq.TCP_MAXRT) == 30_000


def refusal(*changes: str) -> str:
    with pytest.raises(ConfigError) as error:
        scenario_of(LiveOptions("drive-to-event", set=changes))
    return str(error.value)


def test_a_live_run_refuses_what_only_virtual_time_has():
    assert refusal("transport=datagrams").startswith("transport 'datagrams': ")
    assert refusal("zeromq.conflate=subscriber").startswith("zeromq.conflate 'subscriber': only")


def test_a_live_run_takes_marks_and_buffers():
    changes = ("zeromq.high_water_mark=2", "zeromq.send_buffer_bytes=4096")
    zeromq = scenario_of(LiveOptions("drive-to-event", set=changes)).zeromq
    assert (zeromq.high_water_mark, zeromq.send_buffer_bytes) == (2, 4096)
