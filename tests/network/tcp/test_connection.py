"""Opening, finishing, giving up."""

import pytest
from helpers.network.scripted_tcp import EXACT, Pair, ScriptedLink, options

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp import TcpConnection


def opened(delay=0.05, lose_out=(), lose_back=(), until=200.0, dead=False, opener=EXACT):
    """Times at which the two ends may write, and the links."""
    clock, out, back = Clock(), ScriptedLink(delay), ScriptedLink(delay)
    out.lost, back.lost, out.dead = set(lose_out), set(lose_back), dead
    times = {}
    connection = TcpConnection(clock, out, back, opener, EXACT)
    connection.opener.on_end = lambda: times.update(end=round(clock.now, 6))
    connection.open(
        lambda: times.update(opener=round(clock.now, 6)),
        lambda: times.update(peer=round(clock.now, 6)),
    )
    clock.run(until)
    return times, out, connection


def ends(pair, end):
    """Times at which an end learns that the connection is over."""
    reports = []
    end.on_end = lambda: reports.append(round(pair.clock.now, 6))
    return reports


def test_the_opener_may_write_after_one_round_trip_and_the_peer_after_one_and_a_half():
    assert opened()[0] == {"opener": 0.1, "peer": 0.15}


@pytest.mark.parametrize(
    ("lost", "at"), [({1}, 1.1), ({1, 2}, 2.1), ({1, 2, 3, 4, 5}, 5.1), ({1, 2, 3, 4, 5, 6}, 7.1)]
)
def test_a_lost_opening_is_repeated_each_second_four_times_and_then_doubling(lost, at):
    assert opened(lose_out=lost)[0]["opener"] == at


def test_with_doubling_from_the_start_the_third_opening_leaves_after_three_seconds():
    assert opened(lose_out={1, 2}, opener=options(syn_linear=0))[0]["opener"] == 3.1


def test_a_lost_answer_comes_again_with_the_repeated_opening():
    # both ends repeat after a second; the answer leaves 0.05 s behind the opening
    assert opened(lose_back={1})[0]["opener"] == pytest.approx(1.1, abs=1e-6)


def test_an_unanswered_opening_is_given_up_after_131_seconds():
    # 4 x 1 s, then 1, 2, 4, 8, 16, 32 and 64 s: the kernel's documentation of tcp_syn_retries
    times, out, _ = opened(dead=True)
    assert times == {"end": 131.0}
    assert len(out.carried) == 11


def test_one_lost_opening_leaves_the_window_and_two_reduce_it_to_one_segment():
    for lost, window in (({1}, 10.0), ({1, 2}, 1.0)):
        assert opened(lose_out=lost)[2].opener.congestion_window == window


def test_after_an_answer_that_was_repeated_the_first_data_time_out_after_three_seconds():
    """RFC 6298, rule 5.7: the peer cannot tell which of its answers was acknowledged."""
    clock, out, back = Clock(), ScriptedLink(0.05), ScriptedLink(0.05)
    back.lost = {1, 4}
    connection = TcpConnection(clock, out, back, EXACT, options(tail_probe=False))
    connection.open(lambda: clock.call_at(4.0, connection.peer.write, 400))
    clock.run(12.0)
    assert [at for at, size in back.carried if size > 60] == [4.0, 7.0]


def test_without_a_handshake_the_opener_may_write_at_once():
    times, out, _ = opened(opener=options(handshake=False))
    assert times == {"opener": 0.0, "peer": 0.0}
    assert out.carried == []


def test_data_opens_the_peer_when_the_last_acknowledgement_was_lost():
    clock, out, back = Clock(), ScriptedLink(0.05), ScriptedLink(0.05)
    out.lost = {2}
    connection = TcpConnection(clock, out, back, EXACT, EXACT)
    read = []
    connection.peer.on_readable = lambda: read.append((clock.now, connection.peer.readable))
    connection.open(lambda: clock.call_after(0.02, connection.opener.write, 400))
    clock.run(0.5)
    assert read == [(0.17, 400)]


def test_what_was_written_before_finishing_is_still_delivered_even_if_it_was_lost():
    pair = Pair()
    ended = ends(pair, pair.peer)

    def write_and_finish():
        pair.out.lose(1)
        pair.opener.write(400)
        pair.opener.finish()

    pair.at(1.0, write_and_finish)
    pair.clock.run(5.0)
    assert [count for _, count in pair.arrivals] == [400]
    assert len(ended) == 1
    assert ended[0] >= pair.arrivals[0][0]


def test_data_for_a_finished_program_is_answered_by_a_reset():
    pair = Pair()
    ended = ends(pair, pair.peer)
    pair.at(1.0, pair.opener.finish)
    pair.back.lost = set()
    pair.at(1.02, pair.peer.write, 200)
    pair.clock.run(5.0)
    assert ended == [1.05]  # the end itself; the reset comes at 1.12 and finds nobody to tell
    assert pair.opener.gone
    assert pair.peer.gone
    assert pair.opener.readable == 0
    assert pair.out.carried[-1] == (1.07, 40)


def test_finishing_with_unread_bytes_resets_at_once():
    pair = Pair(reads=False)
    ended = ends(pair, pair.opener)
    pair.write_at([1.0])
    pair.at(1.2, pair.peer.finish)
    pair.clock.run(5.0)
    assert ended == [1.25]


def test_a_closed_connection_sends_and_tells_nothing_more():
    pair = Pair()
    reports = []
    pair.opener.on_end = pair.peer.on_end = lambda: reports.append(1)
    pair.out.dead = True
    pair.write_at([1.0])
    pair.at(1.1, pair.connection.close)
    pair.clock.run(60.0)
    assert pair.sent(1.05) == []
    assert reports == []
    assert pair.opener.write(400) == 0


def test_a_dead_peer_is_given_up_after_the_stated_number_of_timeouts():
    # probe at 0.3 s, then time-outs after 0.3, 0.6 and 1.2 s, and the last wait of 2.4 s
    pair = Pair(opener=options(retries=3))
    ended = ends(pair, pair.opener)
    pair.out.dead = True
    pair.write_at([1.0])
    pair.clock.run(20.0)
    assert pair.sent(1.0) == pytest.approx([1.0, 1.3, 1.6, 2.2, 3.4])
    assert ended == [pytest.approx(5.8)]


def test_giving_up_by_default_takes_fifteen_timeouts():
    pair = Pair()
    pair.out.dead = True
    pair.write_at([1.0])
    pair.clock.run(2000.0)
    assert pair.opener.sender.timeouts == 15
    assert pair.opener.gone
