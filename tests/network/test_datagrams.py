"""Datagrams: nothing is promised but that a message is whole."""

from typing import Any

import pytest
from helpers.network.links import links

from dva_sim.kernel.clock import Clock
from dva_sim.network.connections import Connector, DatagramConnection
from dva_sim.network.messaging import Request, Requester
from dva_sim.network.virtual_network import VirtualNetwork


def network(**config: Any) -> VirtualNetwork:
    pair = links(**config)
    between = lambda _, there: pair if there == "robot" else pair[::-1]  # noqa: E731
    return VirtualNetwork(Clock(), between, None, Connector("datagrams"))


def heard(size: int, count: int, **config: Any) -> list[int]:
    clock, got = Clock(), list[int]()
    connection = DatagramConnection(clock, *links(**config), got.append, lambda _: None)
    connection.open(lambda: None)
    for number in range(count):
        clock.call_at(0.1 * number, connection.opener.send, number, size)
    clock.run(0.1 * count + 5.0)
    return got


def test_a_message_of_one_packet_is_lost_as_often_as_a_packet_is():
    got = heard(400, 4000, loss=0.1)
    assert len(got) / 4000 == pytest.approx(0.9, abs=0.02)
    assert got == sorted(got)


def test_a_message_of_nine_packets_is_lost_if_one_of_them_is():
    assert len(heard(12_000, 4000, loss=0.1)) / 4000 == pytest.approx(0.9**9, abs=0.025)


def test_where_packets_overtake_messages_do():
    got = heard(400, 500, delay_s=0.5, jitter_s=0.3, reorder=True)
    assert sorted(got) == list(range(500))
    assert got != sorted(got)


def test_nothing_is_shaken_and_the_first_message_leaves_at_once():
    net, times = network(delay_s=0.1, rate_bps=1e9), list[float]()
    net.serve("robot", lambda request: request.answer(request.data))
    requester = Requester(net, "phone", "robot", timeout=1.0)
    requester.request(b"go", lambda _: times.append(net.clock.now))
    net.clock.run(5.0)
    assert times == [pytest.approx(0.2, abs=1e-3)]


def test_only_the_requesters_time_out_sends_again():
    net, seen, replies = network(delay_s=0.1, loss=0.5, seed=3), list[bytes](), list[bytes]()

    def serve(request: Request) -> None:
        seen.append(request.data)
        request.answer(b"re: " + request.data)

    net.serve("robot", serve)
    requester = Requester(net, "phone", "robot", timeout=1.0, attempts=10)
    failed: list[int] = []
    for number in range(50):
        requester.request(b"%d" % number, replies.append, lambda: failed.append(1))
    net.clock.run(600.0)
    assert len(replies) + len(failed) == 50
    assert len(seen) > len(set(seen))
    assert requester.timeouts > 50


def test_a_subscription_that_is_lost_is_said_again():
    net, got = network(loss=0.5, seed=2), list[int]()
    net.subscribe("robot", "phone", "t|", got.append)
    for number in range(200):
        net.clock.call_at(0.1 * number, net.publish, "phone", "t|", number, 400)
    net.clock.run(30.0)
    assert got[0] > 0
    assert len(got) > 60


def test_a_closed_socket_hears_nothing_more_but_what_it_sent_is_executed():
    clock, got, back = Clock(), list[str](), list[str]()
    connection = DatagramConnection(clock, *links(delay_s=0.1), got.append, back.append)
    connection.open(lambda: None)
    connection.opener.send("request", 400)
    connection.close()
    clock.run(1.0)
    assert connection.peer.send("reply", 200)
    clock.run(2.0)
    assert (got, back) == (["request"], [])
    assert not connection.opener.send("another", 400)
