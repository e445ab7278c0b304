"""Recovery of lost segments. The round trip is 100 ms, so the time-out is 300 ms.

Waits for a probe and for a segment in doubt are 2 ms longer than RFC 8985 has them, as in Linux.
"""

import pytest
from helpers.network.scripted_tcp import Pair, keep_writing, options

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.sender import Sender


def lost_at(times, lost, until=20.0, late=None, **changes):
    """Write 400 B at each of `times`, lose the segments of these numbers."""
    pair = Pair(opener=options(**changes))
    before = len(pair.out.carried)
    pair.out.lost = {before + number for number in lost}
    pair.out.late = {before + number: by for number, by in (late or {}).items()}
    pair.write_at(times)
    pair.clock.run(until)
    return pair


def test_a_single_lost_segment_is_probed_when_its_timeout_would_have_come():
    # probe time 2 x 0.1 + 0.2 s for a delayed acknowledgement, but no later than the time-out
    pair = lost_at([1.0], {1})
    assert pair.sent(1.0) == pytest.approx([1.0, 1.3])
    assert (pair.opener.sender.tail_probes, pair.opener.sender.timeouts) == (1, 0)


def test_without_the_probe_the_timeout_does_it_and_doubles():
    pair = lost_at([1.0], {1, 2, 3}, tail_probe=False)
    assert pair.sent(1.0) == pytest.approx([1.0, 1.3, 1.9, 3.1])
    assert pair.opener.sender.timeouts == 3


def test_after_a_lost_probe_the_timeout_restarts_and_doubles():
    pair = lost_at([1.0], {1, 2, 3, 4})
    assert pair.sent(1.0) == pytest.approx([1.0, 1.3, 1.6, 2.2, 3.4])


def test_what_is_written_after_a_lost_probe_brings_the_timeout_of_the_first_no_earlier():
    # the probe at 1.212 restarted the time-out, and what leaves at 1.25 is due after 0.202 s
    pair = lost_at([1.0, 1.01, 1.25], {1, 2, 3, 4})
    assert pair.sent(1.0)[:5] == pytest.approx([1.0, 1.01, 1.212, 1.25, 1.452])
    assert (pair.opener.sender.tail_probes, pair.opener.sender.timeouts) == (1, 1)


def test_instead_of_a_second_probe_the_first_segment_waits_for_its_own_timeout():
    # Whether the probe at 1.3 was needed is open after its acknowledgement at 1.4. The next probe
    # would be due at 1.602; the first segment left at 1.35, and its time-out is 300 ms.
    pair = lost_at([1.0, 1.35, 1.36], {1, 3, 4}, until=1.9)
    assert pair.sent(1.0)[:5] == pytest.approx([1.0, 1.3, 1.35, 1.36, 1.65])
    assert (pair.opener.sender.tail_probes, pair.opener.sender.timeouts) == (1, 1)


def test_two_lost_at_the_tail_are_probed_after_two_round_trips_and_both_come_back():
    # the probe repeats the second at 1.212; its acknowledgement at 1.312 tells of the first
    pair = lost_at([1.0, 1.01], {1, 2})
    assert pair.sent(1.0) == pytest.approx([1.0, 1.01, 1.212, 1.312])


def test_a_probe_prefers_something_new():
    pair = Pair(opener=options(initial_window=2))
    pair.out.lose(1, 2)
    pair.write_at([1.0, 1.0, 1.01])
    pair.clock.run(1.25)
    # the third write waits for the window of two; the probe at 1.202 sends it beyond the window
    assert pair.sent(1.0) == pytest.approx([1.0, 1.0, 1.202])
    assert pair.opener.sender.retransmitted == 0


def test_a_silently_mended_loss_reduces_the_window():
    pair = lost_at([1.0, 2.0, 3.0], {1})
    assert pair.opener.sender.tail_probes == 1
    assert pair.opener.congestion_window == 7.0


def test_a_needless_probe_does_not_reduce_it():
    pair = Pair()
    pair.back.lose(1)  # only the acknowledgement was lost; the peer tells of the duplicate
    pair.write_at([1.0, 2.0, 3.0])
    pair.clock.run(5.0)
    assert pair.opener.sender.tail_probes == 1
    assert pair.opener.congestion_window == 10.0


@pytest.mark.parametrize(("again", "window"), [(True, 10.0), (False, 7.0)])
def test_a_probe_whose_end_is_acknowledged_twice_was_needless(again, window):
    """RFC 8985, section 7.4.2, for another end that says nothing of duplicates."""
    clock, edge = Clock(), 1_000_000
    sender = Sender(clock, options(), lambda *segment: None, lambda: None)
    sender.established(0.1, 0, edge)
    sender.write(400)
    clock.run(0.31)
    assert sender.tail_probes == 1
    sender.acknowledge(0.35, 400, edge, (), duplicate=False, echo=0.0)
    sender.write(400)
    if again:
        sender.acknowledge(0.4, 400, edge, (), duplicate=False, echo=0.3)
    sender.acknowledge(0.45, 800, edge, (), duplicate=False, echo=0.31)
    assert sender.window.window == window


def test_a_loss_is_seen_a_quarter_of_the_round_trip_after_a_later_segment_was_due():
    # the second is acknowledged at 1.11; the first was due at 1.1 and may be 25 ms late
    assert lost_at([1.0, 1.01], {1}).sent(1.0) == pytest.approx([1.0, 1.01, 1.127])


def test_the_loss_is_seen_at_once_when_the_later_segment_is_late_enough():
    assert lost_at([1.0, 1.1], {1}).sent(1.0) == pytest.approx([1.0, 1.1, 1.2])


def test_three_later_segments_end_the_patience():
    pair = lost_at([1.0, 1.001, 1.002, 1.003], {1})
    assert pair.sent(1.0)[-1] == pytest.approx(1.103)


def test_without_rack_three_later_segments_are_needed():
    three = lost_at([1.0, 1.01, 1.02, 1.03], {1}, rack=False)
    two = lost_at([1.0, 1.01, 1.02], {1}, rack=False)
    assert three.sent(1.0)[-1] == pytest.approx(1.13)
    assert two.sent(1.0)[-1] == pytest.approx(1.3)  # nothing but the time-out


def test_a_lost_repetition_is_found_by_what_was_sent_after_it():
    # repeated at 1.2 and lost again; what left at 1.21 is acknowledged at 1.31
    pair = lost_at([1.0, 1.1, 1.101, 1.102, 1.21], {1, 5})
    assert pair.sent(1.0) == pytest.approx([1.0, 1.1, 1.101, 1.102, 1.2, 1.21, 1.31])
    assert pair.opener.sender.timeouts == 0
    assert sum(count for _, count in pair.arrivals) == 2000


def test_a_repeated_first_segment_has_a_whole_timeout_of_its_own():
    # The third is acknowledged at 1.281: the first, whose time-out would come at 1.3, is sent
    # again, and the second is in doubt until 1.305. It comes late, and nothing times out.
    pair = lost_at([1.0, 1.18, 1.181], {1}, late={2: 0.02}, tail_probe=False)
    assert pair.sent(1.0) == pytest.approx([1.0, 1.18, 1.181, 1.281])
    assert pair.opener.sender.timeouts == 0


def test_a_segment_late_within_the_patience_is_not_repeated():
    pair = lost_at([1.0, 1.01], set(), late={1: 0.02})
    assert pair.opener.sender.retransmitted == 0


def test_a_needless_recovery_is_taken_back_by_time_stamps():
    late = {1: 0.08}
    with_undo = lost_at([1.0, 1.01, 1.02], set(), late=late)
    without = lost_at([1.0, 1.01, 1.02], set(), late=late, undo=False)
    assert with_undo.opener.sender.retransmitted == without.opener.sender.retransmitted == 1
    assert with_undo.opener.congestion_window == 10.0
    assert without.opener.congestion_window < 10.0


def test_a_recovery_that_was_needed_is_not_taken_back():
    pair = lost_at([1.0, 1.1, 1.101, 1.102], {1})
    assert (pair.opener.sender.retransmitted, pair.opener.sender.timeouts) == (1, 0)
    assert pair.opener.congestion_window == 7.0


def test_once_reordering_was_seen_three_later_segments_do_not_end_the_patience():
    pair = lost_at([1.0, 1.001, 2.0, 2.001, 2.002, 2.003], {3}, late={1: 0.01})
    assert pair.sent(2.0)[-1] == pytest.approx(2.127)


def test_small_neighbours_are_repeated_as_one_segment():
    # after the time-out 3 x 400 B fit into one segment
    together = lost_at([1.0, 1.001, 1.002], {1, 2, 3, 4}, tail_probe=False)
    apart = lost_at([1.0, 1.001, 1.002], {1, 2, 3, 4}, tail_probe=False, collapse=False)
    assert max(size for _, size in together.out.since(1.25)) == 1252
    assert max(size for _, size in apart.out.since(1.25)) == 452
    assert sum(count for _, count in together.arrivals) == 1200
    assert sum(count for _, count in apart.arrivals) == 1200


def test_a_timeout_leaves_a_window_of_one_segment():
    pair = Pair(opener=options(tail_probe=False))
    pair.out.lose(1)
    pair.write_at([1.0])
    pair.clock.run(1.35)
    assert pair.opener.congestion_window == 1.0


def test_slow_start_doubles_the_segments_of_a_round_trip():
    pair = Pair(opener=options(hystart=False))
    pair.at(1.0, keep_writing, pair.opener)
    pair.clock.run(1.35)
    sent = pair.sent(1.0)
    assert [sent.count(at) for at in (1.0, 1.1, 1.2, 1.3)] == [10, 20, 40, 80]


def test_without_a_congestion_window_all_that_is_written_leaves_at_once():
    pair = Pair(opener=options(congestion_window=False, send_buffer=1_000_000))
    pair.at(1.0, pair.opener.write, 60 * 1000)
    pair.clock.run(1.01)
    assert len(pair.sent(1.0)) == 42


def sender_of(opening=0.1, **changes):
    """A sender whose segments go nowhere, after an opening of this round trip [s]."""
    clock, edge = Clock(), 1_000_000
    sender = Sender(clock, options(**changes), lambda *segment: None, lambda: None)
    sender.established(opening, 0, edge)

    def hears(at, acknowledged, echo, duplicate=False):
        clock.run(at)
        sender.acknowledge(at, acknowledged, edge, (), duplicate=duplicate, echo=echo)

    return clock, sender, hears


def test_a_probe_that_repeats_is_not_another_segment_in_flight():
    clock, sender, _ = sender_of()
    sender.write(400)
    clock.run(0.31)
    assert sender.tail_probes == 1
    assert sender.board.in_flight == 1


def test_a_needless_timeout_is_taken_back_although_the_one_before_was_needless_too():
    clock, sender, hears = sender_of(tail_probe=False)
    sender.write(400)
    sender.write(400)
    clock.run(0.31)  # both are sent again as one segment
    hears(0.35, 400, echo=0.0)  # the first was late only
    assert sender.window.window == 10.0
    hears(0.45, 400, echo=0.3, duplicate=True)
    clock.run(1.3)
    assert sender.timeouts == 2
    hears(1.31, 800, echo=0.35)  # so was the second
    assert sender.window.window == 10.0


def test_the_timeout_of_another_segment_halves_again_that_of_the_same_one_does_not():
    """RFC 5681, section 3.1; CUBIC's factor is 0.7."""
    clock, sender, hears = sender_of(tail_probe=False, undo=False)
    for _ in range(10):
        sender.write(1448)
    clock.run(0.31)
    assert (sender.timeouts, sender.window.threshold) == (1, 7.0)
    clock.run(0.95)
    assert (sender.timeouts, sender.window.threshold) == (2, 7.0)
    hears(1.0, 1448, echo=0.91)
    clock.run(1.5)
    assert sender.timeouts == 3
    assert sender.window.threshold < 7.0


@pytest.mark.parametrize(
    ("overtaken", "repeated_later"), [(True, []), (False, [(1200, pytest.approx(1.205))])]
)
def test_what_is_lost_besides_what_times_out_is_found_then_or_by_an_acknowledgement(
    overtaken, repeated_later
):
    # The third is acknowledged after 0.27 s, and the first times out at 1.2. By then the second is
    # lost, too, unless segments have overtaken each other: then it may come until 1.214.
    clock, emitted, edge = Clock(), list[tuple[int, float]](), 1_000_000
    sender = Sender(
        clock,
        options(tail_probe=False, congestion_window=False, collapse=False),
        lambda start, end, now, pushes: emitted.append((start, now)),
        lambda: None,
    )
    sender.established(0.1, 0, edge)
    for at in (0.5, 0.5, 0.9, 0.919, 0.92, 1.205):
        clock.call_at(at, sender.write, 400)
    clock.run(0.6)
    if overtaken:
        sender.acknowledge(0.6, 0, edge, ((400, 800),), duplicate=False, echo=0.5)
    sender.acknowledge(0.6, 800, edge, (), duplicate=False, echo=0.5)
    clock.run(1.19)
    sender.acknowledge(1.19, 800, edge, ((1600, 2000),), duplicate=False, echo=0.92)
    emitted.clear()
    clock.run(1.4)
    assert emitted == [(800, pytest.approx(1.2)), *repeated_later, (2000, 1.205)]


@pytest.mark.parametrize(("segments", "grows"), [(9, False), (10, True)])
def test_beyond_slow_start_only_a_window_that_was_filled_grows(segments, grows):
    _, sender, hears = sender_of(congestion="reno")
    sender.window.threshold = sender.window.window
    sender.write(segments * 1448)
    hears(0.1, segments * 1448, echo=0.0)
    assert (sender.window.window > 10.0) is grows


def test_each_byte_written_by_itself_is_a_round_trip_of_its_own():
    # the variance falls from 0.25 s by a quarter of the difference to the variation, 0.1406 s
    _, sender, hears = sender_of(opening=0.5)
    timeouts = []
    for number in (1, 2):
        sender.write(1)
        hears(0.5 * number, number, echo=0.5 * (number - 1))
        timeouts.append(sender.times.timeout)
    assert timeouts == [1.5, 1.390625]
