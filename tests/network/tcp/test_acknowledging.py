"""Times of acknowledgements. One way takes 50 ms."""

import pytest
from helpers.network.scripted_tcp import Pair, options

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.receiver import QUICK, Receiver
from dva_sim.network.tcp.retransmission_timer import RoundTrip


def acknowledged_at(pair, start):
    """Times at which the peer sent acknowledgements without data."""
    return [at for at, size in pair.back.since(start) if size == 52]


def answer(pair, size=200):
    pair.peer.on_readable = lambda: (pair.read(), pair.peer.write(size))


def test_a_one_way_stream_is_acknowledged_when_the_program_has_read():
    pair = Pair()
    pair.write_at([1.0 + 0.1 * number for number in range(30)])
    pair.clock.run(6.0)
    assert acknowledged_at(pair, 1.0) == pytest.approx([1.05 + 0.1 * n for n in range(30)])


def test_in_a_dialogue_the_acknowledgement_rides_on_the_answer():
    pair = Pair()
    pair.peer.on_readable = lambda: (pair.read(), pair.clock.call_after(0.03, pair.peer.write, 200))
    pair.write_at([1.0 + 0.1 * number for number in range(10)])
    pair.clock.run(6.0)
    # the first came before there was a dialogue
    assert acknowledged_at(pair, 1.0) == [1.05]


@pytest.mark.parametrize(
    ("written", "acknowledged"),
    [([1.0, 1.1], [1.19]), ([1.0, 1.2, 1.5], [1.29, 1.55]), ([1.0, 1.2, 1.21], [1.26])],
    ids=["it waits 40 ms", "after a wait in vain it is over", "a second segment is told at once"],
)
def test_in_a_dialogue_without_an_answer(written, acknowledged):
    pair = Pair()
    answer(pair)
    pair.write_at(written)
    pair.at(1.12, setattr, pair.peer, "on_readable", pair.read)
    pair.clock.run(2.0)
    assert acknowledged_at(pair, 1.12) == pytest.approx(acknowledged)


def test_an_answer_later_than_40_ms_makes_no_dialogue():
    pair = Pair()
    pair.peer.on_readable = lambda: (pair.read(), pair.clock.call_after(0.045, pair.peer.write, 9))
    pair.write_at([1.0, 1.2, 1.4])
    pair.clock.run(2.0)
    assert acknowledged_at(pair, 1.0) == pytest.approx([1.05, 1.25, 1.45])


def test_a_program_that_does_not_read_is_acknowledged_at_once_sixteen_times_then_later():
    pair = Pair(reads=False)
    pair.write_at([1.0 + 0.1 * number for number in range(18)])
    pair.clock.run(6.0)
    waits = [at - 1.05 - 0.1 * n for n, at in enumerate(acknowledged_at(pair, 1.0))]
    assert waits == pytest.approx([0.0] * 16 + [0.04, 0.08])  # in vain once: twice as patient


def test_two_full_segments_are_acknowledged_at_once_though_nobody_reads():
    pair = Pair(reads=False)
    pair.write_at([1.0 + 0.1 * number for number in range(16)])
    pair.write_at([2.6], 2 * 1448)
    pair.clock.run(6.0)
    assert acknowledged_at(pair, 2.6) == pytest.approx([2.65])


@pytest.mark.parametrize(("pushes", "waits"), [(False, 0.04), (True, 0.0)])
def test_a_full_segment_with_more_to_come_waits_for_it_though_the_program_reads(pushes, waits):
    """Measured on Linux 6.18: only small segments or those with PSH are acknowledged on reading."""
    clock, reports = Clock(), []
    receiver = Receiver(clock, options(), RoundTrip(options()), lambda: acknowledge())

    def acknowledge():
        reports.append(clock.now)
        receiver.leaves(clock.now, False)

    def hears(length, has_push):
        start = receiver.next
        receiver.take(start, start + length, clock.now, has_push)
        receiver.read(length)
        if receiver.pending:
            receiver.wait(clock.now)

    for number in range(QUICK + 1):
        clock.run(0.1 * number)
        hears(100, True)
    assert len(reports) == QUICK + 1
    since = 0.1 * (QUICK + 1)
    clock.run(since)
    hears(1448, pushes)
    clock.run(4.0)
    assert reports[-1] == pytest.approx(since + waits)


def test_without_delayed_acknowledgements_each_segment_has_its_own_at_once():
    pair = Pair(peer=options(delayed_ack=0.0))
    answer(pair)
    pair.write_at([1.0, 1.1, 1.2])
    pair.clock.run(2.0)
    assert acknowledged_at(pair, 1.0) == pytest.approx([1.05, 1.1 + 0.05, 1.25])


def test_what_comes_too_early_or_twice_or_fills_a_hole_is_acknowledged_at_once():
    pair = Pair()
    answer(pair)
    pair.write_at([1.0])
    pair.at(1.06, setattr, pair.peer, "on_readable", pair.read)
    pair.at(1.15, pair.out.lose, 2)
    pair.write_at([1.2, 1.21, 1.22])
    pair.clock.run(3.0)
    # too early at 1.27; the hole filled by the repetition of 1.337, a quarter round trip late
    assert acknowledged_at(pair, 1.262) == pytest.approx([1.27, 1.387])
