"""Taps on a node see its requests and replies unchanged, and change nothing."""

from typing import Any

import pytest
from helpers.network.transports import BRIEF, PATIENT, PHONE, ROBOT, Asker, World, echo, numbered

from dva_sim.network.tap import Exchange, Tap

pytestmark = pytest.mark.contract


def tapped(world: World, node: str) -> list[Exchange]:
    seen: list[Exchange] = []
    world.network.taps[node] = Tap(world.clock, seen.append)
    return seen


def asked(world: World, *questions: bytes, **asker: Any) -> list[bytes | None]:
    one = Asker(world.network, **asker)
    one.ask(*questions)
    world.run_until(one.all_over)
    return one.replies()


def test_each_request_is_seen_once_with_the_answer_that_was_given(world):
    seen, questions = tapped(world, ROBOT), numbered(20)
    world.serve(ROBOT, echo)
    assert asked(world, *questions) == [b"re: " + question for question in questions]
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
    asked(world, b"later")
    assert replies == [None, b"re: later"]
    assert seen[0] is seen[1]
    assert (seen[0].service_s or 0.0) > 0.0499


def test_a_request_without_an_answer_is_seen_all_the_same(world):
    seen = tapped(world, ROBOT)
    world.serve(ROBOT, lambda request: None)
    asked(world, b"hello?", timeout=BRIEF, attempts=1)
    assert [(one.data, one.reply, one.service_s) for one in seen] == [(b"hello?", None, None)]


@pytest.mark.parametrize("wanted", [True, False])
def test_publications_are_seen_by_the_tap_of_who_hears_them_if_it_wants_them(world, wanted):
    seen, got = tapped(world, PHONE), list[bytes]()
    world.network.taps[PHONE].publications = wanted
    world.network.subscribe(PHONE, ROBOT, "news|", got.append)
    world.clock.every(0.02, lambda: (world.network.publish(ROBOT, "news|", b"n", 1), not got)[1])
    world.run_until(lambda: got)
    found = [(one.data, one.published, one.peer) for one in seen]
    assert found == ([(b"n", True, ROBOT)] * len(got) if wanted else [])


@pytest.mark.parametrize("window", [1, 4])
def test_a_watcher_sees_both_ends_of_each_request_and_of_its_answer(sockets, window):
    seen = list[tuple[str, bytes, bool]]()
    sockets.network.watcher = lambda *what: seen.append(what)
    sockets.serve(ROBOT, echo)
    assert asked(sockets, b"a", b"b", window=window) == [b"re: a", b"re: b"]
    for question in (b"a", b"b"):
        answer = b"re: " + question
        assert [(node, sent) for node, data, sent in seen if data == question] == [
            (PHONE, True),
            (ROBOT, False),
        ]
        assert [(node, sent) for node, data, sent in seen if data == answer] == [
            (ROBOT, True),
            (PHONE, False),
        ]


def test_without_its_tap_a_node_is_as_before(world):
    seen = tapped(world, ROBOT)
    del world.network.taps[ROBOT]
    world.serve(ROBOT, echo)
    assert (asked(world, b"anybody?"), seen) == ([b"re: anybody?"], [])
