"""The patterns on the virtual network at both depths: what is alike, what only segments show."""

import itertools
from typing import Any, Literal

import pytest
from helpers.network.links import links

from dva_sim.agents.robot.command_queue import CommandQueue, Letter
from dva_sim.kernel.clock import Clock
from dva_sim.network.connections import Connector, ZeromqConfig
from dva_sim.network.messaging import Request, Requester
from dva_sim.network.virtual_network import RECONNECT, VirtualNetwork

Depth = Literal["message", "segment"]
DEPTHS = pytest.mark.parametrize("depth", ["message", "segment"])


def network(
    depth: Depth, zeromq: dict[str, Any] | None = None, seed: int = 1, **config: Any
) -> VirtualNetwork:
    pair = links(seed, **config)
    between = lambda _, there: pair if there == "robot" else pair[::-1]  # noqa: E731
    connector = Connector(depth=depth, zeromq=ZeromqConfig(**(zeromq or {})))
    return VirtualNetwork(Clock(), between, connector=connector)


class Robot:
    """Takes one request after the other, each for so long; keeps when each was done."""

    def __init__(self, net: VirtualNetwork, service: float) -> None:
        self.done: list[tuple[bytes, float]] = []
        self._clock = net.clock
        inbox = CommandQueue(net.clock, lambda: service, self._handle, latest_wins=False)
        net.serve("robot", inbox.request)

    def _handle(self, letter: Letter) -> None:
        self.done.append((letter.data, self._clock.now))
        assert letter.answer is not None
        letter.answer(b"re: " + letter.data)


@DEPTHS
@pytest.mark.parametrize(("delay", "service"), [(0.0, 0.05), (0.1, 0.05), (0.5, 0.2)])
def test_the_period_under_request_reply_is_round_trip_plus_service(depth, delay, service):
    net = network(depth, delay_s=delay)
    robot = Robot(net, service)
    requester = Requester(net, "phone", "robot", timeout=9.0)

    def again(_: bytes = b"") -> None:
        requester.request(b"go", again)

    again()
    net.clock.run(60.0)
    times = [time for _, time in robot.done]
    periods = [b - a for a, b in itertools.pairwise(times)]
    assert periods == pytest.approx([2 * delay + service] * len(periods), abs=0.003)


@pytest.mark.parametrize(
    ("conflate", "heard"), [("none", [1, 2, 3, 9]), ("subscriber", [3, 9]), ("both", [3, 9])]
)
def test_a_conflating_subscriber_is_handed_the_newest_of_what_comes_in_one_piece(conflate, heard):
    """ZeroMQ decodes all that TCP delivers at once before the program wakes up."""
    net = network("message", {"conflate": conflate}, delay_s=0.05, rate_bps=1e12)
    found: list[int] = []
    net.subscribe("robot", "phone", "r|", found.append)
    for number in (1, 2, 3):
        net.clock.call_at(1.0, net.publish, "phone", "r|", number, 400)
    net.clock.call_at(2.0, net.publish, "phone", "r|", 9, 400)
    net.clock.run(3.0)
    assert found == heard


def test_a_conflating_subscriber_that_left_meanwhile_is_handed_nothing():
    net, found = network("message", {"conflate": "subscriber"}, delay_s=0.05), list[int]()
    heard = net.subscribe("robot", "phone", "r|", found.append)
    net.clock.call_at(1.0, net.publish, "phone", "r|", 1, 400)
    while heard._newest is None:
        net.clock.step()
    heard.close()
    net.clock.run(2.0)
    assert found == []


@DEPTHS
def test_plain_publishing_to_a_slow_robot_queues_without_bound_and_latest_wins_does_not(depth):
    """10 commands a second, 0.5 s each: after 10 s a stop comes 40 s late."""
    ages = {}
    for latest_wins in (False, True):
        net, done = network(depth, delay_s=0.05), list[float]()
        clock = net.clock

        def handle(letter: Letter, done: list[float] = done, clock: Clock = clock) -> None:
            done.append(clock.now - float(letter.data))

        inbox = CommandQueue(clock, lambda: 0.5, handle, latest_wins)
        inbox.flow = net.subscribe("robot", "phone", "r|", inbox.published)
        for number in range(10, 110):
            at = 0.1 * number
            clock.call_at(at, net.publish, "phone", "r|", b"%f" % at, 400)
        clock.run(200.0)
        ages[latest_wins] = max(done)
    assert ages[False] == pytest.approx(40.0, abs=1.0)
    assert ages[True] < 1.2


@DEPTHS
def test_three_attempts_at_a_robot_that_needs_longer_execute_a_command_three_times(depth):
    net = network(depth, delay_s=0.05)
    robot, alerts = Robot(net, 3.0), list[float]()
    requester = Requester(net, "phone", "robot", timeout=1.0, attempts=3)
    requester.request(b"go", lambda _: None, lambda: alerts.append(net.clock.now))
    net.clock.run(30.0)
    assert [data for data, _ in robot.done] == [b"go"] * 3
    assert alerts == [pytest.approx(3.0)]


@DEPTHS
@pytest.mark.parametrize(("timeout", "heard"), [(1.9, 0), (2.2, 1)])
def test_below_four_round_trips_a_request_over_a_new_connection_is_never_answered(
    depth, timeout, heard
):
    net, replies = network(depth, delay_s=0.25), list[bytes]()
    Robot(net, 0.0)
    requester = Requester(net, "phone", "robot", timeout, attempts=3)
    requester.request(b"go", replies.append)
    net.clock.run(20.0)
    assert len(replies) == heard


def test_one_loss_ends_all_control_where_the_time_out_is_below_four_round_trips():
    """Round trip 0.5 s. All is well until the link is gone for a moment after 30 s."""
    for timeout, goes_on in ((1.5, False), (3.0, True)):
        net = network("segment", delay_s=0.25, outages=[{"from_s": 30.0, "for_s": 1.5}])
        robot = Robot(net, 0.0)
        requester = Requester(net, "phone", "robot", timeout, attempts=3)
        requester.open()

        def again(_: bytes = b"", requester: Requester = requester) -> None:
            requester.request(b"go", again, again)

        net.clock.call_at(5.0, again)
        net.clock.run(120.0)
        times = [time for _, time in robot.done]
        assert max(times) > 29.0
        assert (max(times) > 115.0) is goes_on


def test_a_full_pipe_drops_what_is_published_and_counts_it():
    bounds = {"high_water_mark": 5, "send_buffer_bytes": 4096}
    net, got = network("segment", bounds, rate_bps=10_000), list[int]()
    net.subscribe("robot", "phone", "r|", got.append)
    net.clock.run(5.0)
    for number in range(100):
        net.publish("phone", "r|", number, 400)
    net.clock.run(100.0)
    assert got == list(range(len(got)))
    assert len(got) + net.dropped == 100
    assert 5 < len(got) < 30


def test_requests_wait_where_the_pipe_is_full_and_none_is_lost():
    bounds = {"high_water_mark": 2, "send_buffer_bytes": 4096}
    net = network("segment", bounds, rate_bps=20_000)
    robot = Robot(net, 0.0)
    requester = Requester(net, "phone", "robot", timeout=120.0, window=50)
    asked = [b"%3d" % number + b"x" * 400 for number in range(50)]
    for data in asked:
        requester.request(data, lambda _: None)
    net.clock.run(100.0)
    assert [data for data, _ in robot.done] == asked


def test_a_full_inbox_holds_up_the_publisher_instead_of_losing_commands():
    """400 commands at once; 10 may wait at the robot, which takes 0.1 s for each."""
    fast = {"delay_s": 0.01, "rate_bps": 1e9, "queue_bytes": 10_000_000}
    for depth, kept in (("message", 11), ("segment", 400)):
        net, done = network(depth, **fast), list[bytes]()  # type: ignore[arg-type]
        inbox = CommandQueue(
            net.clock, lambda: 0.1, lambda letter, done=done: done.append(letter.data), False, 10
        )
        inbox.flow = net.subscribe("robot", "phone", "r|", inbox.published)
        net.clock.run(1.0)
        commands = [b"%d" % number for number in range(400)]
        for command in commands:
            net.publish("phone", "r|", command, 400)
        net.clock.run(60.0)
        assert done == commands[:kept]
        assert inbox.longest == 10
        assert inbox.overflowed == 400 - kept


# --- reconnecting ------------------------------------------------------------------------------


@DEPTHS
def test_after_a_publisher_is_back_a_subscriber_misses_the_interval_and_the_handshake(depth):
    net, got = network(depth, delay_s=0.1, rate_bps=1e9), list[int]()
    net.subscribe("robot", "phone", "r|", got.append)
    for number in range(1000):
        net.clock.call_at(0.01 * number, net.publish, "phone", "r|", number, 100)
    net.clock.call_at(5.0, net.leave, "phone")
    net.clock.call_at(6.0, net.come_back, "phone")
    net.clock.run(20.0)
    before, after = max(n for n in got if n < 600), min(n for n in got if n > 600)
    assert 0.01 * before == pytest.approx(5.0 - 0.1, abs=0.02)  # what was under way is lost
    assert 0.01 * after == pytest.approx(6.0 + RECONNECT + 3.5 * 0.2, abs=0.02)


def test_what_waits_in_the_pipe_outlives_its_connection_and_what_had_left_it_does_not():
    """5 requests a second pass; when the robot leaves, a batch of 20 is beyond the pipe."""
    net = network("segment", {"send_buffer_bytes": 4096}, delay_s=0.05, rate_bps=20_000)
    robot = Robot(net, 0.0)
    requester = Requester(net, "phone", "robot", timeout=60.0, attempts=1, window=100)
    requester.open()
    net.clock.run(2.0)
    asked = [b"%3d" % number + b"x" * 400 for number in range(100)]
    for data in asked:
        requester.request(data, lambda _: None)
    net.clock.call_at(4.0, net.leave, "robot")
    net.clock.call_at(5.0, net.come_back, "robot")
    net.clock.run(50.0)
    done = [data for data, _ in robot.done]
    before = [data for data, time in robot.done if time < 4.0]
    lost = 100 - len(done)
    assert 5 < len(before) < 12
    assert 15 < lost < 30
    assert done == before + asked[len(before) + lost :]


def test_a_late_reply_to_a_closed_connection_is_dropped():
    net, replies, held = network("segment", delay_s=0.05), list[bytes](), list[Request]()
    net.serve("robot", held.append)
    requester = Requester(net, "phone", "robot", timeout=1.0, attempts=2)
    requester.request(b"go", replies.append)
    net.clock.run(1.9)
    assert [request.data for request in held] == [b"go", b"go"]
    held[0].answer(b"of the first connection")
    held[1].answer(b"of the second")
    net.clock.run(5.0)
    assert replies == [b"of the second"]


def test_a_requester_forgets_the_deadlines_of_what_was_answered():
    """A thousand answered requests in a second leave no thousand deadlines for nine more."""
    net, answered = network("message", delay_s=0.0001), list[bytes]()
    Robot(net, 0.0)
    requester = Requester(net, "phone", "robot", timeout=9.0)
    for _ in range(1000):
        requester.request(b"go", answered.append)
    net.clock.run(5.0)
    assert len(answered) > 900
    assert len(requester._deadlines) < 100


# --- what is held up on the way -----------------------------------------------------------------


@pytest.mark.parametrize("of", ["request", "subscription"])
@pytest.mark.parametrize(
    ("between", "arrives"),
    [("nothing", True), ("it is closed", False), ("the connection is another", False)],
)
def test_what_interference_releases_late_is_dropped_with_its_connection(of, between, arrives):
    net, got, held = network("message", delay_s=0.05), list[bytes](), list[Any]()

    def interfere(_: str, receiver: str, data: Any, take: Any) -> None:
        held.append((data, take)) if receiver == "phone" else take(data)

    net.interference = interfere
    if of == "request":
        Robot(net, 0.0)
        client: Any = Requester(net, "phone", "robot", timeout=60.0)
        client.request(b"go", got.append)
    else:
        client = net.subscribe("phone", "robot", "r|", got.append)
        net.clock.call_at(1.0, net.publish, "robot", "r|", b"go", 100)
    net.clock.run(2.0)
    [(data, take)] = held
    if between == "it is closed":
        client.close()
    elif between == "the connection is another":
        net.leave("robot")
        net.come_back("robot")
        net.clock.run(4.0)
    take(data)
    assert bool(got) is arrives
