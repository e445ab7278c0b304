"""Small segments without TCP_NODELAY. One way takes 50 ms."""

import pytest
from helpers.network.scripted_tcp import EXACT, Pair, options

GATHERS = options(nodelay=False)


def sent(opener, writes, loses=0):
    """Time and size of each data segment, for writes of these sizes."""
    pair = Pair(opener=opener)
    if loses:
        pair.out.lose(loses)
    for at, size in writes:
        pair.write_at([at], size)
    pair.clock.run(3.0)
    return [(at, size - 52) for at, size in pair.out.since(1.0) if size > 52]


def test_a_small_segment_waits_for_the_acknowledgement_of_the_last_small_one():
    writes = [(1.0, 400), (1.02, 400), (1.05, 300), (1.2, 500)]
    assert sent(EXACT, writes) == writes
    assert sent(GATHERS, writes) == [(1.0, 400), (1.1, 700), (1.2, 500)]


def test_what_has_become_a_full_segment_does_not_wait():
    writes = [(1.0, 400), (1.02, 1000), (1.04, 1000)]
    assert sent(GATHERS, writes) == [(1.0, 400), (1.04, 1448), (1.1, 552)]


def test_behind_full_segments_alone_a_small_one_leaves_at_once():
    assert sent(GATHERS, [(1.0, 1448), (1.01, 400)]) == [(1.0, 1448), (1.01, 400)]


def test_the_end_of_what_is_written_does_not_wait():
    pair = Pair(opener=GATHERS)
    pair.write_at([1.0, 1.01], 400)
    pair.at(1.02, pair.opener.finish)
    pair.clock.run(3.0)
    assert [at for at, size in pair.out.since(1.0) if size > 52] == [1.0, 1.02]


@pytest.mark.parametrize("nodelay", [True, False])
def test_a_loss_holds_gathered_bytes_until_it_is_mended(nodelay):
    leaving = sent(options(nodelay=nodelay), [(1.0, 400), (1.02, 400), (1.04, 400)], loses=1)
    assert len(leaving) == (4 if nodelay else 3)
