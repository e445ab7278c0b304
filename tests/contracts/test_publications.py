"""Contract of publishers and subscribers, over any transport."""

from collections.abc import Callable

import pytest
import zmq
from helpers.network.transports import (
    DVA,
    GUARD,
    NODES,
    PHONE,
    ROBOT,
    STRANGER,
    TABLET,
    Asker,
    Listener,
    Meddler,
    Plan,
    VirtualWorld,
    World,
    echo,
    numbered,
)

from dva_sim.agents.robot.command_queue import CommandQueue, Letter
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode

pytestmark = pytest.mark.contract

Publish = Callable[..., None]


def publish(world: World, topic: str, *payloads: bytes, node: str = PHONE) -> None:
    for payload in payloads:
        world.network.publish(node, topic, payload, len(payload))


def marked(*listeners: Listener) -> tuple[Listener, ...]:
    """All subscriptions have arrived, and what was published before the marks."""
    for listener in listeners:
        listener.await_a_mark()
    return listeners


def test_subscribers_get_everything_once_and_in_order(world):
    listeners = marked(*(Listener(world, "robot-1|", node=node) for node in (ROBOT, TABLET, DVA)))
    publish(world, "robot-1|", *numbered(500))
    for listener in marked(*listeners):
        assert listener.got == numbered(500)


def test_topics_do_not_match_by_accident(world):
    one, ten = marked(Listener(world, "robot-1|"), Listener(world, "robot-10|"))
    for topic in ("robot-1|", "robot-10|", "robot-|", "robot-1", "ROBOT-1|", "", "|", " robot-1|"):
        publish(world, topic, topic.encode())
    marked(one, ten)
    assert one.got == [b"robot-1|"]
    assert ten.got == [b"robot-10|"]


def test_who_wants_a_prefix_gets_all_that_begin_with_it(world):
    everything, robots = marked(Listener(world, ""), Listener(world, "robot-1"))
    topics = ["robot-1|", "robot-10|", "robot-2|", "", "|"]
    for topic in topics:
        publish(world, topic, topic.encode())
    marked(everything, robots)
    assert everything.got == [topic.encode() for topic in topics]
    assert robots.got == [b"robot-1|", b"robot-10|"]


def test_two_subscriptions_of_one_node_to_one_topic_both_hear_it(world):
    pair = marked(Listener(world, "news|"), Listener(world, "news|"))
    publish(world, "news|", b"extra")
    marked(*pair)
    pair[0].subscription.close()
    publish(world, "news|", b"late edition")
    pair[1].await_a_mark()
    assert pair[0].got == [b"extra"]
    assert pair[1].got == [b"extra", b"late edition"]


def test_to_publish_to_nobody_does_no_harm(world):
    publish(world, "news|", *numbered(3000))
    publish(world, "news|", b"from nobody", node=STRANGER)
    assert not world.network.ready(PHONE, "news|", 10)
    assert not world.network.ready(STRANGER, "news|", 10)
    (listener,) = marked(Listener(world, "news|"))
    publish(world, "news|", b"extra")
    listener.await_a_mark()
    assert listener.got == [b"extra"]


def test_a_publisher_knows_whether_somebody_wants_a_topic(world):
    (listener,) = marked(Listener(world, "frame|"))
    world.run_until(lambda: world.network.ready(PHONE, "frame|", 10))
    assert not world.network.ready(PHONE, "status|", 10)
    listener.subscription.close()
    world.run_until(lambda: not world.network.ready(PHONE, "frame|", 10))


def test_a_subscription_to_nobody_hears_nothing_and_harms_nobody(world):
    lost = Listener(world, "news|", publisher=STRANGER)
    well = Listener(world, "news|")
    well.await_a_mark()
    publish(world, "news|", b"extra")
    well.await_a_mark()
    lost.subscription.close()
    assert lost.got == []
    assert well.got == [b"extra"]


def test_a_subscription_works_again_when_its_publisher_is_back(world):
    (listener,) = marked(Listener(world, "news|"))
    publish(world, "news|", *numbered(3, "before"))
    listener.await_a_mark()
    for round_ in range(2):
        world.leave(PHONE)
        publish(world, "news|", b"from the grave")
        world.come_back(PHONE)
        listener.await_a_mark()
        publish(world, "news|", *numbered(3, f"after {round_}"))
        listener.await_a_mark()
    after = [*numbered(3, "after 0"), *numbered(3, "after 1")]
    assert listener.got == [*numbered(3, "before"), *after]


def test_who_never_left_and_comes_back_loses_nothing():
    world = VirtualWorld()
    (listener,) = marked(Listener(world, "news|"))
    world.come_back(PHONE)
    publish(world, "news|", *numbered(10))
    listener.await_a_mark()
    assert listener.got == numbered(10)


def test_a_subscription_made_while_its_publisher_is_away_works_when_it_is_back(world):
    world.leave(PHONE)
    listener = Listener(world, "news|")
    world.run_for(0.05)
    world.come_back(PHONE)
    listener.await_a_mark()
    publish(world, "news|", b"extra")
    listener.await_a_mark()
    assert listener.got == [b"extra"]


def test_nothing_comes_after_a_subscription_is_closed(world):
    closing, other = marked(Listener(world, "news|"), Listener(world, "news|"))
    publish(world, "news|", *numbered(100))
    closing.subscription.close()
    publish(world, "news|", *numbered(100))
    other.await_a_mark()
    world.leave(PHONE)
    world.come_back(PHONE)
    other.await_a_mark()
    assert closing.got == []
    assert other.got[:100] == numbered(100)
    closing.subscription.close()  # once more does no harm


def test_who_closes_in_the_middle_of_a_publication_hears_nothing_more(world):
    got: list[bytes] = []

    def first(payload: bytes) -> None:
        got.append(payload)
        closing.subscription.close()

    closing, other = Listener(world, "news|", first), Listener(world, "news|")
    marked(closing, other)
    publish(world, "news|", *numbered(100))
    other.await_a_mark()
    assert got == numbered(1)
    assert other.got == numbered(100)


def test_meddled_publications_are_those_that_were_made(world):
    got: list[bytes] = []
    meddler = Meddler(world.clock, 1, Plan(lose=0.2, double=0.2, hold=0.1))
    (listener,) = marked(Listener(world, "news|", meddler.handler(got.append)))
    publish(world, "news|", *numbered(200))
    listener.await_a_mark()
    world.run_for(0.2)
    assert len(got) == 200 - meddler.done["lost"] + meddler.done["doubled"]
    assert set(got) < set(numbered(200))
    assert got != sorted(got, key=numbered(200).index)


# --- a subscriber that is slower than its publisher ---------------------------------------


class SlowRobot:
    """Takes 20 ms for each message, whether anybody waits for the answer or not."""

    def __init__(self, world: World, latest_wins: bool) -> None:
        self.done: list[bytes] = []
        self.inbox = CommandQueue(world.clock, lambda: 0.02, self._handle, latest_wins)
        self.listener = Listener(world, "robot|", self.inbox.published)
        self.listener.await_a_mark()
        world.serve(ROBOT, self.inbox.request)

    def _handle(self, letter: Letter) -> None:
        self.done.append(letter.data)
        if letter.answer is not None:
            letter.answer(b"re: " + letter.data)


EMERGENCY = encode(m.Message(ROBOT, 9, TABLET, "12:00:00", 0, m.Emergency()))
COMMANDS = numbered(40, "<SetTeleOp>")


@pytest.mark.parametrize("latest_wins", [True, False])
def test_a_slow_subscriber_gets_all_in_order_or_the_newest_where_the_latest_wins(
    world, latest_wins
):
    robot = SlowRobot(world, latest_wins)
    publish(world, "robot|", *COMMANDS)
    world.run_until(lambda: robot.done and robot.done[-1] == COMMANDS[-1])
    assert robot.done == [command for command in COMMANDS if command in robot.done]
    assert robot.inbox.superseded == 40 - len(robot.done)
    assert (len(robot.done) < 40) is latest_wins


@pytest.mark.parametrize("latest_wins", [True, False])
def test_requests_overtake_what_is_published_and_emergencies_overtake_both(world, latest_wins):
    robot = SlowRobot(world, latest_wins)
    control = Asker(world.network, window=5)
    emergency = Asker(world.network)
    ready = Asker(world.network, node=TABLET)
    ready.ask(b"open the connection")
    world.run_until(ready.all_over)
    # All of it has arrived before the first message is done.
    world.serve(ROBOT, lambda request: held.append(request))
    held: list[Request] = []
    control.ask(*numbered(5, "control"))
    emergency.ask(EMERGENCY)
    world.run_until(lambda: len(held) == 6)
    robot.done.clear()
    for command in COMMANDS[:5]:
        robot.inbox.published(command)
    for request in held:
        robot.inbox.request(request)
    world.run_until(lambda: control.all_over() and emergency.all_over())
    waiting = COMMANDS[4:5] if latest_wins else COMMANDS[1:5]
    world.run_until(lambda: len(robot.done) == 7 + len(waiting))
    assert robot.done == [COMMANDS[0], EMERGENCY, *numbered(5, "control"), *waiting]


# --- other programs -----------------------------------------------------------------------


def test_publications_of_another_form_are_dropped_and_counted(sockets):
    program = sockets.replace(GUARD, zmq.PUB, published=True)
    listener = Listener(sockets, "news|", publisher=GUARD)

    def heard() -> bool:
        program.send_multipart([b"news|", b"good"])
        return bool(listener.got)

    sockets.run_until(heard)
    program.send_multipart([b"news|"])
    program.send_multipart([b"news|", b"a", b"b"])
    program.send_multipart([b"news|", *numbered(1000)])
    program.send_multipart([b"news|", b"last"])
    sockets.run_until(lambda: listener.got[-1] == b"last")
    assert set(listener.got) == {b"good", b"last"}
    assert sockets.network.counters["publications of another form"] == 3


def test_what_is_said_to_a_publisher_does_no_harm(sockets):
    """A subscriber says what it wants, and nothing keeps it from saying anything else."""
    program = sockets.program(zmq.XSUB, PHONE, published=True)
    for entry in (b"", b"\x02", b"\x00never wanted", b"\x01\xff\xfe", b"\xff" * 60_000):
        program.send(entry)
    program.send_multipart([b"\x01a", b"\x01b", b""])
    (listener,) = marked(Listener(sockets, "news|"))
    sockets.run_until(lambda: sockets.network.ready(PHONE, "news|", 10))
    publish(sockets, "news|", b"extra")
    listener.await_a_mark()
    assert listener.got == [b"extra"]


def test_every_node_publishes_and_serves_at_once(world):
    listeners = [
        Listener(world, "news|", node=a, publisher=b) for a in NODES for b in NODES if a != b
    ]
    for node in NODES:
        world.serve(node, echo)
    marked(*listeners)
    for node in NODES:
        publish(world, "news|", *numbered(20, node), node=node)
    asker = Asker(world.network)
    asker.ask(*numbered(20))
    world.run_until(asker.all_over)
    for listener in marked(*listeners):
        assert listener.got == numbered(20, listener.publisher)
