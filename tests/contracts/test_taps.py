"""Whoever looks at what a node is asked and answers sees it as it is, and changes nothing."""

import pytest
from helpers.network.transports import BRIEF, PATIENT, PHONE, ROBOT, Asker, World, echo, numbered

from dva_sim.network.messaging import Request
from dva_sim.network.tap import Exchange, Tap

pytestmark = pytest.mark.contract


def tapped(world: World, node: str) -> list[Exchange]:
    seen: list[Exchange] = []
    world.network.taps[node] = Tap(world.clock, seen.append)
    return seen


def test_each_request_is_seen_once_with_the_answer_that_was_given(world):
    seen = tapped(world, ROBOT)
    world.serve(ROBOT, echo)
    asker = Asker(world.network)
    questions = numbered(20)
    asker.ask(*questions)
    world.run_until(asker.all_over)
    assert asker.replies() == [b"re: " + question for question in questions]
    assert [one.number for one in seen] == list(range(1, 21))
    assert [(one.data, one.reply) for one in seen] == [(q, b"re: " + q) for q in questions]
    assert all(one.service_s is not None and 0.0 <= one.service_s < PATIENT for one in seen)


def test_an_answer_that_comes_later_is_told_with_the_time_it_took(world):
    seen = tapped(world, ROBOT)
    replies: list[bytes | None] = []
    world.network.taps[ROBOT] = Tap(
        world.clock, lambda one: (replies.append(one.reply), seen.append(one))
    )
    world.serve(ROBOT, lambda request: world.clock.call_after(0.05, echo, request))
    asker = Asker(world.network)
    asker.ask(b"later")
    world.run_until(asker.all_over)
    assert replies == [None, b"re: later"]
    assert seen[0] is seen[1]
    assert seen[0].service_s is not None
    assert seen[0].service_s > 0.0499


def test_a_request_without_an_answer_is_seen_all_the_same(world):
    seen = tapped(world, ROBOT)

    def silent(_: Request) -> None:
        """Never answers."""

    world.serve(ROBOT, silent)
    asker = Asker(world.network, timeout=BRIEF, attempts=1)
    asker.ask(b"hello?")
    world.run_until(asker.all_over)
    assert [(one.data, one.reply, one.service_s) for one in seen] == [(b"hello?", None, None)]


def test_publications_are_seen_by_the_tap_of_who_hears_them(world):
    seen, got = tapped(world, PHONE), list[bytes]()
    world.network.subscribe(PHONE, ROBOT, "news|", got.append)

    def publish() -> bool:
        world.network.publish(ROBOT, "news|", b"an event", 8)
        return not got

    world.clock.every(0.02, publish)
    world.run_until(lambda: got)
    assert [(one.data, one.published, one.peer) for one in seen] == [(b"an event", True, ROBOT)]


def test_a_tap_that_wants_no_publications_counts_none(world):
    seen, got = tapped(world, PHONE), list[bytes]()
    world.network.taps[PHONE].publications = False
    world.network.subscribe(PHONE, ROBOT, "news|", got.append)
    world.clock.every(0.02, lambda: (world.network.publish(ROBOT, "news|", b"n", 1), not got)[1])
    world.run_until(lambda: got)
    assert seen == []


def test_without_its_tap_a_node_is_as_before(world):
    seen = tapped(world, ROBOT)
    del world.network.taps[ROBOT]
    world.serve(ROBOT, echo)
    asker = Asker(world.network)
    asker.ask(b"anybody?")
    world.run_until(asker.all_over)
    assert (asker.replies(), seen) == ([b"re: anybody?"], [])
