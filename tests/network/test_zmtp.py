"""ZeroMQ on top of TCP: when it is open, what waits where, what a full pipe does, what is lost."""

import itertools
from typing import Any

import pytest
from helpers.network.links import links

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp import TcpOptions
from dva_sim.network.zmtp import BATCH, Pipe, ZmtpConnection, ZmtpOptions, framed

SMALL_BUFFER = TcpOptions(send_buffer=4096)


class Pair:
    """Two ends over two equal links; each keeps what it got, and when."""

    def __init__(
        self,
        opener: ZmtpOptions | None = None,
        peer: ZmtpOptions | None = None,
        seed: int = 1,
        **config: Any,
    ) -> None:
        self.clock = Clock()
        self.at_peer, self.at_opener = list[Any](), list[Any]()
        self.times: dict[Any, float] = {}
        self.ready: list[float] = []
        self.connection = ZmtpConnection(
            self.clock, *links(seed, **config), self._at_peer, self.at_opener.append, opener, peer
        )

    def _at_peer(self, message: Any) -> None:
        self.at_peer.append(message)
        self.times[message] = self.clock.now

    def open(self, until: float = 5.0) -> None:
        now = self.clock
        self.connection.open(lambda: self.ready.append(now.now), lambda: self.ready.append(now.now))
        self.clock.run(until)

    def send(self, *messages: Any, size: int = 409) -> list[bool]:
        return [self.connection.opener.send(message, size) for message in messages]

    def run_for(self, seconds: float) -> None:
        self.clock.run(self.clock.now + seconds)


def test_a_frame_has_two_bytes_more_up_to_255_bytes_and_nine_beyond():
    assert [framed(size) for size in (0, 255, 256, 400)] == [2, 257, 265, 409]


def test_the_opener_is_ready_after_three_round_trips_and_the_peer_half_a_one_later():
    pair = Pair(delay_s=0.1, rate_bps=1e9)
    pair.open()
    assert pair.ready == [pytest.approx(0.6, abs=1e-3), pytest.approx(0.7, abs=1e-3)]


def test_what_is_sent_before_the_handshake_leaves_when_it_is_over():
    pair = Pair(delay_s=0.1, rate_bps=1e9)
    assert pair.send("early") == [True]
    pair.open()
    assert pair.times["early"] == pytest.approx(0.7, abs=1e-3)


@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_everything_arrives_once_and_in_order(loss):
    pair = Pair(delay_s=0.02, jitter_s=0.01, loss=loss)
    pair.open(20.0)
    for number in range(300):
        pair.clock.call_at(20.0 + 0.05 * number, pair.send, number)
    pair.clock.run(120.0)
    assert pair.at_peer == list(range(300))


def test_a_message_longer_than_a_batch_arrives_whole_and_before_the_next():
    pair = Pair(delay_s=0.01)
    pair.open()
    pair.connection.opener.send("long", 5 * BATCH + 17)
    pair.send("short")
    pair.run_for(2.0)
    assert pair.at_peer == ["long", "short"]
    assert pair.times["long"] <= pair.times["short"]


def test_a_pipe_at_its_mark_refuses_and_takes_again_when_half_of_it_has_left():
    """10 wait in the pipe, one in the encoder, and a few in TCP's buffer of 4 KiB, doubled."""
    pair = Pair(ZmtpOptions(mark=10, tcp=SMALL_BUFFER), delay_s=0.1, rate_bps=20_000)
    pair.open()
    room: list[float] = []
    pair.connection.opener.pipe.on_room = lambda: room.append(pair.clock.now)
    taken = pair.send(*range(100))
    kept = sum(taken)
    assert taken == [True] * kept + [False] * (100 - kept)
    assert 10 + 1 + 2 <= kept <= 10 + 1 + 2 * 4096 // 409
    pair.run_for(60.0)
    assert pair.at_peer == list(range(kept))
    assert len(room) == 1


def test_what_conflates_sends_the_newest_of_what_waited():
    pair = Pair(ZmtpOptions(conflate=True, tcp=SMALL_BUFFER), delay_s=0.1, rate_bps=20_000)
    pair.open()
    assert all(pair.send(*range(100)))
    pair.run_for(60.0)
    assert pair.at_peer[-1] == 99
    assert pair.at_peer == sorted(pair.at_peer)
    assert len(pair.at_peer) < 60


def test_on_a_slow_link_the_kernels_buffer_makes_commands_old_and_a_small_one_does_not():
    """20 commands a second of 461 bytes want 74 kbit/s; the link has 32."""
    ages = {}
    for name, tcp in {"tuned": TcpOptions(), "4 KiB": SMALL_BUFFER}.items():
        pair = Pair(ZmtpOptions(conflate=True, tcp=tcp), delay_s=0.05, rate_bps=32_000)
        pair.open()
        for number in range(1200):
            pair.clock.call_at(5.0 + 0.05 * number, pair.send, number)
        pair.clock.run(65.0)
        last = pair.at_peer[-1]
        ages[name] = pair.times[last] - (5.0 + 0.05 * last)
    assert ages["tuned"] > 10.0
    assert ages["4 KiB"] < 5.0


# --- a receiver that does not take ---------------------------------------------------------


def test_a_receiver_that_pauses_gets_everything_later_in_order():
    pair = Pair(delay_s=0.01)
    pair.open()
    pair.connection.peer.pause()
    pair.send(*range(100))
    pair.run_for(5.0)
    assert pair.at_peer == []
    pair.connection.peer.resume()
    pair.run_for(5.0)
    assert pair.at_peer == list(range(100))


def test_a_receiver_that_takes_nothing_fills_its_pipe_the_window_and_the_senders_pipe():
    small = TcpOptions(send_buffer=4096, receive_buffer=4096)
    pair = Pair(ZmtpOptions(mark=10, tcp=small), ZmtpOptions(tcp=small), delay_s=0.01)
    waiting: list[object] = []

    def deliver(message: object) -> None:
        waiting.append(message)
        if len(waiting) == 10:
            pair.connection.peer.pause()

    pair.connection.peer._deliver = deliver
    pair.open()
    for number in range(400):
        pair.clock.call_at(5.0 + 0.01 * number, pair.send, number)
    pair.clock.run(20.0)
    assert len(waiting) == 10
    assert pair.send("one more") == [False]
    taken = []
    while waiting:
        taken.append(waiting.pop(0))
        if len(waiting) == 5:
            pair.connection.peer.resume()
        pair.run_for(0.2)
    assert taken[:40] == list(range(40))
    assert len(taken) < 120


# --- the end -------------------------------------------------------------------------------


def test_what_tcp_has_when_a_socket_is_closed_still_arrives_and_its_answer_does_not():
    pair = Pair(delay_s=0.1)
    pair.open()
    pair.send("request")
    pair.connection.close()
    pair.run_for(1.0)
    assert pair.at_peer == ["request"]
    assert not pair.connection.peer.send("reply", 202)
    assert pair.at_opener == []


def test_a_request_whose_packet_was_lost_arrives_although_its_socket_was_closed():
    """TCP goes on behind a closed socket: so commands are executed more than once."""
    late = 0
    for seed in range(40):
        pair = Pair(seed=seed, delay_s=0.1, loss=0.3)
        pair.open(60.0)
        if not pair.ready:
            continue
        pair.send("request")
        pair.connection.close()
        pair.run_for(60.0)
        late += pair.times.get("request", 0.0) > 60.15
    assert late >= 5


def test_a_socket_that_is_closed_in_the_handshake_sends_nothing():
    pair = Pair(delay_s=0.1)
    pair.send("request")
    pair.open(0.55)
    pair.connection.close()
    pair.run_for(10.0)
    assert pair.at_peer == []
    assert pair.send("more") == [False]


def test_who_is_left_hears_of_it_half_a_round_trip_later():
    pair = Pair(delay_s=0.1)
    pair.open()
    ended: list[float] = []
    pair.connection.peer.on_end = lambda: ended.append(pair.clock.now)
    pair.connection.close()
    pair.run_for(5.0)
    assert ended == [pytest.approx(5.1, abs=1e-3)]


def test_who_pauses_hears_of_the_end_when_it_goes_on():
    pair = Pair(delay_s=0.1)
    pair.open()
    ended: list[float] = []
    peer = pair.connection.peer
    peer.on_end = lambda: ended.append(pair.clock.now)
    peer.pause()
    pair.send("last")
    pair.run_for(1.0)
    pair.connection.close()
    pair.run_for(5.0)
    assert (pair.at_peer, ended) == ([], [])
    peer.resume()
    assert (pair.at_peer, ended) == (["last"], [pair.clock.now])


def test_nothing_is_delivered_after_a_connection_broke():
    pair = Pair(delay_s=0.1)
    pair.open()
    pair.send("under way")
    pair.connection.peer.send("too", 202)
    pair.connection.drop()
    pair.run_for(30.0)
    assert pair.at_peer == pair.at_opener == []


def test_a_small_buffer_is_filled_and_drained_in_the_rhythm_of_real_sockets():
    """Fifty a second into 64 kbit/s. Seen on sockets: seven fill the buffer; then nothing is
    written until four are left; of what comes then four or five in a row find room."""
    conflated = ZmtpOptions(conflate=True, tcp=SMALL_BUFFER)
    pair = Pair(conflated, delay_s=0.05, rate_bps=64_000)
    pair.open()
    for number in range(500):
        pair.send(number)
        pair.run_for(0.02)
    settled = pair.at_peer[50:150]
    breaks = [i for i in range(1, len(settled)) if settled[i] != settled[i - 1] + 1]
    assert {b - a for a, b in itertools.pairwise(breaks)} == {4, 5}
    assert {settled[i] - settled[i - 1] for i in breaks} <= {8, 9, 10, 11}


# --- pipes: the high-water mark, the low one at half of it, keeping only the newest ---------


@pytest.mark.parametrize(("mark", "low"), [(1, 1), (2, 1), (3, 2), (10, 5), (1000, 500)])
def test_a_full_pipe_has_room_again_when_half_of_it_has_been_read(mark, low):
    pipe: Pipe[int] = Pipe(mark)
    assert [pipe.put(number) for number in range(mark + 1)] == [True] * mark + [False]
    for _ in range(low - 1):
        pipe.take()
        assert not pipe.put(-1)
    pipe.take()
    assert [pipe.put(number) for number in range(low + 1)] == [True] * low + [False]


def test_who_was_refused_is_told_once_when_there_is_room():
    pipe, reported = Pipe[int](4), list[int]()
    pipe.on_room = lambda: reported.append(len(pipe))
    for number in range(5):
        pipe.put(number)
    assert [pipe.take() for _ in range(4)] == [0, 1, 2, 3]
    assert reported == [2]


def test_what_conflates_keeps_the_newest_and_is_never_full():
    pipe = Pipe[int](1, conflate=True)
    assert all(pipe.put(number) for number in range(5))
    assert (len(pipe), pipe.superseded, pipe.take(), pipe.take()) == (1, 4, 4, None)
