"""Room at both ends. The numbers of the send buffer were measured on Linux 6.18."""

import pytest
from helpers.network.scripted_tcp import Pair, keep_writing, options


def fill(send_buffer, size=409, writes=400):
    """Writes in one moment, nothing acknowledged: how many bytes were taken, and the charge."""
    pair = Pair(opener=options(send_buffer=send_buffer))
    taken = sum(pair.opener.write(size) for _ in range(writes))
    return taken, pair.opener.sender.buffer.used


@pytest.mark.parametrize(
    ("send_buffer", "taken", "charged"),
    [
        (1, 4 * 409, 4964),  # the least, 4608 B: four packets of 409 + 832 B
        (4096, 7 * 409, 8687),  # doubled to 8192 B
        (16384, 35_946, 45_098),  # ten under way, and one waiting packet of 31,856 B
    ],
)
def test_a_small_send_buffer_takes_what_linux_takes(send_buffer, taken, charged):
    assert fill(send_buffer) == (taken, charged)


def test_an_automatic_send_buffer_starts_at_46080_bytes():
    assert Pair().opener.sender.buffer.limit == 46_080


def test_it_becomes_writable_again_when_a_third_is_free():
    # 7 x 1241 B are charged, 2/3 of 8192 B are 5461 B: four remain when it reopens
    pair = Pair(opener=options(send_buffer=4096), reads=False)
    reopened = []
    pair.opener.on_writable = lambda: reopened.append(pair.opener.sender.buffer.used)
    pair.write_at([1.0 + number / 1000 for number in range(20)], 409)
    pair.clock.run(2.0)
    assert reopened == [4 * 1241]


def test_a_tuned_send_buffer_grows_with_the_congestion_window():
    pair = Pair(opener=options(hystart=False))
    pair.at(1.0, keep_writing, pair.opener)
    pair.clock.run(2.0)
    buffer, window = pair.opener.sender.buffer, pair.opener.congestion_window
    assert window > 100
    assert 46_080 < buffer.limit <= 2 * (window + 1) * 2304


@pytest.mark.parametrize("is_announced", [True, False])
def test_a_program_that_does_not_read_closes_the_window_and_what_it_reads_opens_it(is_announced):
    """If the window update is lost, a probe asks for it."""
    pair = Pair(peer=options(receive_buffer=4096), reads=False)
    pair.write_at([1.0 + number / 100 for number in range(20)], 1000)
    pair.clock.run(5.0)
    assert pair.peer.readable == pair.opener.sender.next == 4096
    pair.peer.on_readable = pair.read
    if not is_announced:
        pair.at(5.999, pair.back.lose, 1)
    pair.at(6.0, pair.read)
    pair.clock.run(30.0)
    assert sum(count for _, count in pair.arrivals) == 20_000
    assert (pair.arrivals[1][0] == pytest.approx(6.1)) is is_announced


def test_a_slowly_reading_program_gets_no_tiny_segments():
    pair = Pair(peer=options(receive_buffer=8192), reads=False)
    pair.at(1.0, keep_writing, pair.opener)
    pair.clock.every(0.01, lambda: pair.peer.read(100), 2.0)
    pair.clock.run(10.0)
    sizes = [size - 52 for at, size in pair.out.since(4.0) if size > 60]
    assert sizes
    assert min(sizes) >= 1000


def test_a_tuned_receive_window_grows_with_what_is_read():
    pair = Pair(opener=options(send_buffer=4_000_000, hystart=False))
    pair.at(1.0, keep_writing, pair.opener)
    pair.clock.run(2.0)
    in_flight = pair.opener.sender.next - pair.opener.sender.first
    assert in_flight > 500_000


def test_what_has_been_gathered_is_freed_packet_by_packet():
    # four packets wait behind a closed window; when it opens for 4096 B, two leave whole and a
    # piece of the third; once they are acknowledged two packets are left
    pair = Pair(opener=options(send_buffer=4096), peer=options(receive_buffer=4096), reads=False)
    pair.write_at([1.0 + number / 100 for number in range(60)], 409)
    pair.clock.run(5.0)
    sender = pair.opener.sender
    assert sender.buffer.used == 5786 + 4 * 832
    pair.at(6.0, pair.read)
    pair.clock.run(8.0)
    assert pair.peer.readable == 4096
    assert sender.buffer.used == 5786 - 4096 + 2 * 832
