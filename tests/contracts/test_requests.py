"""Contract of requesters, over any transport."""

import pytest
from helpers.network.transports import (
    BRIEF,
    GUARD,
    LOSSY,
    NODES,
    ROBOT,
    STRANGER,
    Asker,
    Tap,
    World,
    echo,
    numbered,
)

from dva_sim.network.messaging import QUEUE_LIMIT, Request

pytestmark = pytest.mark.contract

WORLDS = [("virtual messages", 1), ("virtual messages", 4), ("virtual segments", 4)]
WORLDS += [("virtual datagrams", 1), (LOSSY, 4)]
REAL = [("sockets", 1), ("sockets with keys", 4)]
WINDOWS = pytest.mark.parametrize(
    ("world", "window"),
    [*WORLDS, *(pytest.param(*each, marks=pytest.mark.system) for each in REAL)],
    indirect=["world"],
)


def answered(world: World, asker: Asker, *questions: bytes) -> list[bytes | None]:
    """Outcomes of all requests so far, after sending these."""
    asker.ask(*questions)
    world.run_until(asker.all_over)
    return asker.replies()


def echoes(*questions: bytes) -> list[bytes | None]:
    return [b"re: " + question for question in questions]


def asked_until_answered(world: World, asker: Asker) -> int:
    """Number of requests until one was answered."""
    for number in range(1, 101):
        question = b"are you there? %d" % len(asker.ends)
        if answered(world, asker, question)[-1:] == echoes(question):
            return number
    raise AssertionError("100 requests have failed")


@WINDOWS
def test_each_request_gets_its_own_reply_in_the_order_asked(world, window):
    seen: list[bytes] = []
    world.serve(ROBOT, lambda request: (seen.append(request.data), echo(request)))
    questions = numbered(50)
    replies = answered(world, Asker(world.network, window=window), *questions)
    assert (seen, replies) == (questions, echoes(*questions))


@WINDOWS
def test_doubled_replies_answer_one_request_each(world, window):
    def stutter(request: Request) -> None:
        """The second copy may come when the next request is under way."""
        echo(request)
        world.clock.call_after(0.02, echo, request)
        world.clock.call_after(0.04, echo, request)

    world.serve(ROBOT, stutter)
    asker = Asker(world.network, window=window)
    answered(world, asker, *numbered(20))
    answered(world, asker, b"and now?")
    world.run_for(0.1)
    assert asker.replies() == echoes(*numbered(20), b"and now?")


@WINDOWS
def test_a_request_is_sent_three_times_then_fails_and_others_are_served(world, window):
    seen: list[bytes] = []

    def choosy(request: Request) -> None:
        seen.append(request.data)
        if request.data != b"never":
            echo(request)

    world.serve(ROBOT, choosy)
    tap = Tap(world.network)
    asker = Asker(tap, BRIEF, window)
    assert answered(world, asker, b"never") == [None]
    assert tap.sent == [b"never"] * 3
    assert tap.wires == (3 if window == 1 else 1)
    assert (asker.requester.timeouts, asker.requester.failures) == (3, 1)
    assert set(seen) <= {b"never"}
    asked_until_answered(world, asker)
    assert asker.ends[b"never"] == [None]


@WINDOWS
def test_the_same_bytes_come_again_until_they_are_answered(world, window):
    seen: list[bytes] = []

    def third_time_lucky(request: Request) -> None:
        seen.append(request.data)
        if len(seen) >= 3:
            echo(request)

    world.serve(ROBOT, third_time_lucky)
    asker = Asker(world.network, BRIEF, window, attempts=1000)
    data = b"\x00\xff any bytes <&>"
    assert answered(world, asker, data) == echoes(data)
    assert set(seen) == {data}
    assert len(seen) >= 3


@WINDOWS
def test_a_reply_that_comes_after_the_failure_answers_nothing(world, window):
    late: list[Request] = []

    def slow_for_one(request: Request) -> None:
        late.append(request) if request.data.startswith(b"slow") else echo(request)

    world.serve(ROBOT, slow_for_one)
    asker = Asker(world.network, BRIEF, window)
    while not late:
        answered(world, asker, b"slow %d" % len(asker.ends))
    slow = list(asker.ends)
    for request in late:
        echo(request)
    asked_until_answered(world, asker)
    assert [asker.ends[question] for question in slow] == [[None]] * len(slow)


@pytest.mark.parametrize("window", [1, 7])
def test_never_more_than_the_window_is_unanswered(world, window):
    held: list[Request] = []
    most = 0

    def hold(request: Request) -> None:
        nonlocal most
        held.append(request)
        most = max(most, len(held))

    world.serve(ROBOT, hold)
    asker = Asker(world.network, window=window)
    asker.ask(*numbered(20))
    assert asker.requester.busy
    for _ in range(20):
        world.run_until(lambda: held)
        echo(held.pop(0))
    world.run_until(asker.all_over)
    assert most == window
    assert asker.replies() == echoes(*numbered(20))
    assert not asker.requester.busy


@pytest.mark.invariant("S10")
@WINDOWS
def test_a_full_queue_refuses_at_once_and_what_waits_is_served(world, window):
    world.serve(ROBOT, echo)
    asker = Asker(world.network, window=window)
    room = window + QUEUE_LIMIT
    asker.ask(*numbered(room))
    assert not any(asker.ends.values())
    asker.ask(b"one too many")
    assert asker.ends[b"one too many"] == [None]
    assert asker.requester.overflows == 1
    assert answered(world, asker) == [*echoes(*numbered(room)), None]


@WINDOWS
def test_who_closes_hears_nothing_more(world, window):
    held: list[Request] = []
    world.serve(ROBOT, held.append)
    asker = Asker(world.network, BRIEF, window, attempts=1000)
    asker.ask(*numbered(10))
    world.run_until(lambda: held)
    timeouts = asker.requester.timeouts
    asker.requester.close()
    for request in held:
        echo(request)
    world.run_for(3 * BRIEF)
    assert list(asker.ends.values()) == [[]] * 10
    assert not asker.requester.busy
    assert (asker.requester.timeouts, asker.requester.failures) == (timeouts, 0)


@WINDOWS
def test_who_closes_in_the_middle_of_a_reply_hears_nothing_more(world, window):
    world.serve(ROBOT, echo)
    asker = Asker(world.network, window=window)
    got: list[bytes] = []

    def first(reply: bytes) -> None:
        got.append(reply)
        asker.requester.close()

    asker.requester.request(b"first", first)
    asker.ask(*numbered(10))
    world.run_until(lambda: got)
    answered(world, Asker(world.network), *numbered(10))
    assert got == [b"re: first"]
    assert list(asker.ends.values()) == [[]] * 10


@WINDOWS
def test_who_has_closed_may_ask_again(world, window):
    held: list[Request] = []
    world.serve(ROBOT, held.append)
    asker = Asker(world.network, window=window)
    asker.ask(b"before")
    world.run_until(lambda: held)
    asker.requester.close()
    asker.ask(b"after")
    world.run_until(lambda: len(held) == 2)
    for request in held:
        echo(request)
    world.run_until(lambda: asker.ends[b"after"])
    assert asker.ends == {b"before": [], b"after": [b"re: after"]}


@WINDOWS
def test_a_peer_that_vanishes_fails_and_is_reached_when_it_is_back(world, window):
    held: list[Request] = []
    world.serve(ROBOT, held.append)
    asker = Asker(world.network, BRIEF, window)
    while not held:
        asker.ask(b"under way %d" % len(asker.ends))
        world.run_until(lambda: held or asker.all_over())
    world.leave(ROBOT)
    replies, failed = answered(world, asker, b"too late"), list(asker.ends)
    assert replies == [None] * len(failed)
    for request in held:
        echo(request)  # the service has not noticed, or notices too late
    world.serve(ROBOT, echo)
    world.come_back(ROBOT)
    asked_until_answered(world, asker)
    assert [asker.ends[question] for question in failed] == [[None]] * len(failed)


@WINDOWS
def test_a_peer_that_nobody_knows_fails_and_harms_nobody(world, window):
    world.serve(ROBOT, echo)
    lost = Asker(world.network, BRIEF, window, peer=STRANGER)
    well = Asker(world.network, window=window)
    lost.ask(*numbered(2))
    well.ask(*numbered(2))
    world.run_until(lambda: lost.all_over() and well.all_over())
    assert lost.replies() == [None] * 2
    assert well.replies() == echoes(*numbered(2))


@WINDOWS
def test_a_peer_that_does_not_serve_fails(world, window):
    assert answered(world, Asker(world.network, BRIEF, window), b"anybody?") == [None]


def test_everybody_can_ask_everybody_at_once(world):
    for node in NODES:
        world.serve(node, echo)
    pairs = [(a, b) for a in NODES for b in NODES if a != b]
    askers = [Asker(world.network, window=3, node=a, peer=b) for a, b in pairs]
    for (a, b), asker in zip(pairs, askers, strict=True):
        asker.ask(*numbered(10, f"{a} to {b}"))
    world.run_until(lambda: all(asker.all_over() for asker in askers))
    for asker in askers:
        assert asker.replies() == echoes(*asker.ends)


def test_a_peer_is_reached_once_somebody_has_told_where_it_is(sockets):
    elsewhere = sockets.elsewhere()
    address = elsewhere.join(GUARD)
    elsewhere.serve(GUARD, echo)
    asker = Asker(sockets.network, BRIEF, peer=GUARD)
    assert answered(sockets, asker, b"where are you?") == [None]
    sockets.network.introduce(GUARD, address)
    asked_until_answered(sockets, asker)


def test_a_peer_that_has_moved_is_reached_where_it_is_now(sockets):
    elsewhere = sockets.elsewhere()
    sockets.network.introduce(GUARD, elsewhere.join(GUARD))
    elsewhere.serve(GUARD, echo)
    asker = Asker(sockets.network, BRIEF, 4, peer=GUARD)
    asked_until_answered(sockets, asker)
    elsewhere.leave(GUARD)
    sockets.network.introduce(GUARD, elsewhere.join(GUARD))
    asked_until_answered(sockets, asker)
