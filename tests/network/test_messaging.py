"""Streams and connections of whole messages: their order, their losses, when they are open."""

import pytest
from helpers.network.links import links

from dva_sim.kernel.clock import Clock
from dva_sim.network.connections import MAX_IN_FLIGHT, Connection, Stream
from dva_sim.network.virtual_network import VirtualNetwork


def test_a_stream_delivers_everything_once_and_in_order_through_loss():
    clock, (forward, backward) = Clock(), links(loss=0.3, delay_s=0.05, jitter_s=0.05)
    got: list[int] = []
    stream = Stream(clock, forward, backward, got.append)
    for i in range(500):
        clock.call_at(i * 0.1, stream.send, i, 200)
    clock.run(400.0)
    assert got == list(range(500))
    assert stream.retransmitted > 100


def test_a_lost_message_holds_up_those_behind_it():
    clock, (forward, backward) = Clock(), links(delay_s=0.1, loss=0.3, seed=4)
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
    clock, (forward, backward) = Clock(), links(delay_s=10.0)
    stream = Stream(clock, forward, backward, lambda _: None)
    taken = sum(stream.send(i, 10) for i in range(MAX_IN_FLIGHT + 50))
    assert taken == MAX_IN_FLIGHT


def test_a_connection_opens_after_three_round_trips():
    clock, (out, back) = Clock(), links(delay_s=0.1)
    opened: list[float] = []
    connection = Connection(clock, out, back, lambda _: None, lambda _: None)
    connection.open(lambda: opened.append(clock.now))
    clock.run(5.0)
    assert opened == [pytest.approx(0.6, abs=0.01)]


def test_what_is_published_before_the_subscription_has_arrived_is_lost():
    pair, got = links(delay_s=0.1), list[int]()
    net = VirtualNetwork(Clock(), lambda *_: pair)
    net.subscribe("robot", "phone", "robot|", got.append)
    for i in range(20):
        net.clock.call_at(i * 0.1, net.publish, "phone", "robot|", i, 100)
    net.clock.run(5.0)
    joined = 7  # three round trips and a half, at 0.2 s each
    assert got[0] in (joined, joined + 1)
    assert got == list(range(got[0], 20))
