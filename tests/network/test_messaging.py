"""Request/reply and publish/subscribe on the virtual network."""

import pytest

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.network.connections import MAX_IN_FLIGHT, Connection, Stream
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.messaging import Request, Requester
from dva_sim.network.virtual_network import VirtualNetwork


def pair(seed: int = 1, **config: float) -> tuple[Link, Link]:
    settings = LinkConfig(**config)  # type: ignore[arg-type]
    streams = Streams(seed)
    return (
        Link(settings, ConstantRate(settings.rate_bps), streams, "up"),
        Link(settings, ConstantRate(settings.rate_bps), streams, "down"),
    )


def network(seed: int = 1, **config: float) -> VirtualNetwork:
    links = pair(seed, **config)
    return VirtualNetwork(Clock(), lambda a, b: links if b == "robot" else links[::-1])


def echo(net: VirtualNetwork, service_time: float) -> list[bytes]:
    """A robot that answers after its service time, one request at a time."""
    seen: list[bytes] = []

    def serve(request: Request) -> None:
        seen.append(request.data)
        net.clock.call_after(service_time, request.answer, b"re: " + request.data)

    net.serve("robot", serve)
    return seen


def test_a_stream_delivers_everything_once_and_in_order_through_loss():
    clock, (forward, backward) = Clock(), pair(loss=0.3, delay_s=0.05, jitter_s=0.05)
    got: list[int] = []
    stream = Stream(clock, forward, backward, got.append)
    for i in range(500):
        clock.call_at(i * 0.1, stream.send, i, 200)
    clock.run(400.0)
    assert got == list(range(500))
    assert stream.retransmitted > 100


def test_a_lost_message_holds_up_those_behind_it():
    clock, (forward, backward) = Clock(), pair(delay_s=0.1, loss=0.3, seed=4)
    sent: dict[int, float] = {}
    got: dict[int, float] = {}
    stream = Stream(clock, forward, backward, lambda i: got.setdefault(i, clock.now))

    def send(number: int) -> None:
        sent[number], before = clock.now, forward.lost
        stream.send(number, 100)
        lost.append(forward.lost > before)

    lost: list[bool] = []
    for i in range(100):
        clock.call_at(i * 0.02, send, i)
    clock.run(100.0)
    first = next(i for i in range(10, 99) if lost[i] and not lost[i + 1])
    assert got[first + 1] == got[first]
    assert got[first] - sent[first] >= 0.3


def test_a_full_send_queue_refuses_rather_than_grows():
    clock, (forward, backward) = Clock(), pair(delay_s=10.0)
    stream = Stream(clock, forward, backward, lambda _: None)
    taken = sum(stream.send(i, 10) for i in range(MAX_IN_FLIGHT + 50))
    assert taken == MAX_IN_FLIGHT


def test_a_connection_opens_after_three_round_trips():
    clock, (out, back) = Clock(), pair(delay_s=0.1)
    opened: list[float] = []
    connection = Connection(clock, out, back, lambda _: None, lambda _: None)
    connection.open(lambda: opened.append(clock.now))
    clock.run(5.0)
    assert opened == [pytest.approx(0.6, abs=0.01)]


def test_a_request_is_tried_three_times_then_fails_and_late_replies_are_dropped():
    net = network(delay_s=0.1)
    seen = echo(net, 100.0)
    requester = Requester(net, "phone", "robot", timeout=2.0, attempts=3)
    replies: list[bytes] = []
    failures: list[float] = []
    requester.request(b"go", replies.append, lambda: failures.append(net.clock.now))
    net.clock.run(400.0)
    assert seen == [b"go"] * 3
    assert failures == [pytest.approx(6.0)]
    assert replies == []
    assert requester.timeouts == 3


def test_what_is_published_before_the_subscription_has_arrived_is_lost():
    net = network(delay_s=0.1)
    got: list[int] = []
    net.subscribe("robot", "phone", "robot|", got.append)
    for i in range(20):
        net.clock.call_at(i * 0.1, net.publish, "phone", "robot|", i, 100)
    net.clock.run(5.0)
    joined = 7  # three round trips and a half, at 0.2 s each
    assert got[0] in (joined, joined + 1)
    assert got == list(range(got[0], 20))


def test_topics_that_end_in_a_bar_do_not_match_by_accident():
    net = network()
    got: list[str] = []
    net.subscribe("robot", "phone", "robot-1|", got.append)
    net.clock.run(1.0)
    net.publish("phone", "robot-1|", "mine", 10)
    net.publish("phone", "robot-11|", "not mine", 10)
    net.clock.run(2.0)
    assert got == ["mine"]


def test_nothing_is_delivered_after_a_subscription_is_closed():
    net = network(delay_s=0.2)
    got: list[str] = []
    subscription = net.subscribe("robot", "phone", "r|", got.append)
    net.clock.run(3.0)
    net.publish("phone", "r|", "under way", 10)
    subscription.close()
    net.clock.run(5.0)
    assert got == []
    assert not net.ready("phone", "r|", 10)
