"""Effect of reception on a link, place by place."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.network.connections import Stream
from dva_sim.network.link import Link, LinkConfig
from dva_sim.network.link.link import make_link


class Quality(NamedTuple):
    loss: float = 0.0
    rate_bps: float = 1e9
    extra_delay_s: float = 0.0


class Place:
    """Position of the robot, as far as the link needs it."""

    def __init__(self, quality: Quality | None = None) -> None:
        self.quality = quality

    def link(self, **config: Any) -> Link:
        settings = LinkConfig(**config)
        return make_link(settings, "up", Streams(1), "radio", lambda: self.quality)


def test_where_nothing_is_drawn_the_link_is_as_it_is():
    wired = make_link(LinkConfig(delay_s=0.1, loss=0.2), "up", Streams(1), "radio")
    radio = Place().link(delay_s=0.1, loss=0.2)
    times = [n * 0.01 for n in range(500)]
    assert [radio.carry(t, 500) for t in times] == [wired.carry(t, 500) for t in times]
    assert radio.lost == wired.lost > 50


def test_reception_adds_its_delay():
    assert Place(Quality(extra_delay_s=0.05)).link(delay_s=0.1, rate_bps=8e6).carry(
        1.0, 1000
    ) == pytest.approx(1.151)


def test_the_slower_of_air_and_link_gives_the_rate():
    slow = Place(Quality(rate_bps=8e3)).link(rate_bps=8e6)
    assert [slow.carry(0.0, 500) for _ in range(3)] == pytest.approx([0.5, 1.0, 1.5])
    fast = Place(Quality(rate_bps=8e9)).link(rate_bps=8e3)
    assert fast.carry(0.0, 500) == pytest.approx(0.5)


def test_losses_of_the_air_come_on_top():
    link = Place(Quality(loss=0.5)).link(loss=0.2)
    arrived = sum(link.carry(n * 0.01, 100) is not None for n in range(4000))
    assert arrived / 4000 == pytest.approx(0.4, abs=0.03)


def test_where_there_is_no_reception_nothing_arrives():
    link = Place(Quality(loss=1.0)).link()
    assert {link.carry(n * 0.01, 100) for n in range(200)} == {None}


def test_a_full_queue_before_the_air_drops():
    link = Place(Quality(rate_bps=8e3)).link(queue_bytes=3000)
    fates = [link.carry(0.0, 1000) for _ in range(5)]
    assert [fate is None for fate in fates] == [False, False, False, True, True]
    assert (link.offered, link.dropped) == (5, 2)


def test_packets_keep_their_order_when_reception_gets_better():
    place = Place(Quality(extra_delay_s=1.0, rate_bps=8e3))
    link = place.link(delay_s=0.1)
    first = link.carry(0.0, 100)
    place.quality = Quality()
    second = link.carry(0.05, 100)
    assert first is not None
    assert second is not None
    assert second >= first > 1.0


def test_packets_overtake_in_the_air_too_where_the_link_may_reorder_them():
    law = {"law": "gamma", "sd_s": 0.05}
    for reorder in (False, True):
        link = Place(Quality()).link(delay_s=0.1, delay_law=law, reorder=reorder)
        arrivals = [link.carry(n * 0.005, 100) for n in range(300)]
        assert (arrivals == sorted(arrivals)) is not reorder


def test_a_slow_air_leaves_the_law_of_the_delay_as_it_is():
    law, n = {"law": "normal", "sd_s": 0.02}, 4000
    link = Place(Quality(rate_bps=1e6)).link(delay_s=0.1, delay_law=law, reorder=True)
    times = np.arange(n) / 100
    delays = np.array([link.carry(t, 125) for t in times.tolist()], dtype=float) - times
    assert delays.mean() == pytest.approx(0.101, abs=4 * 0.02 / n**0.5)
    assert delays.std() == pytest.approx(0.02, abs=4 * 0.02 / (2 * n) ** 0.5)


def test_what_was_sent_without_reception_arrives_when_there_is_some_again():
    place, clock = Place(Quality(loss=1.0)), Clock()
    got: list[tuple[str, float]] = []
    back = Place().link(delay_s=0.01)
    stream = Stream(
        clock, place.link(delay_s=0.01), back, lambda what: got.append((what, clock.now))
    )
    stream.send("stop", 400)
    clock.run(20.0)
    assert got == []
    place.quality = None
    clock.run(90.0)
    assert [what for what, _ in got] == ["stop"]
