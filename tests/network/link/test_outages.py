"""Outages: when nothing gets through, and to whom."""

import pytest
from helpers.network.links import link

from dva_sim.network.link import Link, LinkConfig, part_links


def heard(line: Link, times: list[float]) -> list[float]:
    """At which of the times a packet gets through."""
    return [t for t in times if line.carry(t, 100) is not None]


SECONDS = [float(t) for t in range(12)]


def test_what_would_cross_during_an_outage_is_lost():
    line = link(outages=[{"from_s": 3, "for_s": 4}])
    assert heard(line, SECONDS) == [0, 1, 2, 7, 8, 9, 10, 11]
    assert (line.offered, line.lost, line.dropped) == (12, 4, 0)


def test_an_outage_may_come_again_and_again():
    line = link(outages=[{"from_s": 2, "for_s": 1.5, "every_s": 5}])
    assert heard(line, SECONDS) == [0, 1, 4, 5, 6, 9, 10, 11]


def test_an_outage_may_concern_one_direction_and_several_may_overlap():
    outages = [
        {"from_s": 2, "for_s": 2, "direction": "up"},
        {"from_s": 3, "for_s": 2, "direction": "down"},
        {"from_s": 8, "for_s": 1},
    ]
    assert heard(link("up", outages=outages), SECONDS) == [0, 1, 4, 5, 6, 7, 9, 10, 11]
    assert heard(link("down", outages=outages), SECONDS) == [0, 1, 2, 5, 6, 7, 9, 10, 11]


def test_a_packet_is_lost_when_it_would_leave_the_queue_not_when_it_enters_it():
    line = link(outages=[{"from_s": 1, "for_s": 2}], rate_bps=8e3, queue_bytes=9000)
    fates = [line.carry(0.5, 1000) is None for _ in range(4)]  # they leave at 1.5, 2.5, 3.5, 4.5
    assert fates == [True, True, False, False]


def test_a_train_is_looked_at_packet_by_packet_where_there_are_outages():
    line = link(outages=[{"from_s": 100, "for_s": 1}])
    assert line.carry_train(0.0, 3, 3000) is None
    assert line.offered == 0
    assert not line.is_ideal()
    assert link("down", outages=[{"from_s": 1, "for_s": 1, "direction": "up"}]).is_ideal()


PARTED = {"source": "operator-*", "destination": "robot-1", "from_s": 3, "for_s": 4}
PARTITIONS = LinkConfig(partitions=[PARTED]).partitions  # type: ignore[list-item]


def parted(source: str, destination: str) -> tuple[Link, Link]:
    return part_links((link("up"), link("down")), source, destination, PARTITIONS)


def test_a_partition_cuts_one_way_between_some_nodes_only():
    gap = [0, 1, 2, 7, 8, 9, 10, 11]
    out, back = parted("operator-2", "robot-1")
    assert (heard(out, SECONDS), heard(back, SECONDS)) == (gap, SECONDS)
    out, back = parted("robot-1", "operator-2")
    assert (heard(out, SECONDS), heard(back, SECONDS)) == (SECONDS, gap)
    for source, destination in (("dva", "robot-1"), ("operator-1", "robot-2")):
        out, back = parted(source, destination)
        assert (heard(out, SECONDS), heard(back, SECONDS)) == (SECONDS, SECONDS)


def test_nodes_that_are_kept_apart_share_the_link_and_its_counts_with_others():
    whole = link("up", rate_bps=8e3, queue_bytes=9000, delay_s=0.5)
    mine, _ = part_links((whole, link("down")), "operator-1", "robot-1", PARTITIONS)
    assert whole.carry(0.0, 1000) == pytest.approx(1.5)
    assert mine.carry(0.0, 1000) == pytest.approx(2.5)
    assert mine.backlog_bytes(1.0) == pytest.approx(1000)
    assert mine.carry_train(1.0, 1, 1000) == pytest.approx(3.5)
    assert mine.carry_train(4.0, 1, 1000) is None
    assert mine.carry(4.0, 1000) is None
    assert (whole.offered, whole.lost, whole.bytes) == (4, 1, 3000)
    assert (mine.offered, mine.delay, mine.room) == (4, 0.5, 9000)
    assert whole.is_ideal()
    assert not mine.is_ideal()
