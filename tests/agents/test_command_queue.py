"""A robot's computer: what overtakes what, and what only pretends to."""

import itertools
from typing import Any, NamedTuple

import numpy as np
import pytest

from dva_sim.agents.robot.command_queue import (
    LIMIT,
    MAX_OF_OTHERS,
    PER_CONNECTION,
    CommandQueue,
    Letter,
    Standing,
)
from dva_sim.kernel.clock import Clock
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode

ROBOT, ANYBODY = "02:00:00:01:00:01", "02:00:00:03:00:01"
EMERGENCY = encode(m.Message(ROBOT, 9, ANYBODY, "12:00:00", 0, m.Emergency()))


class Bench:
    """An inbox that takes 0.05 s for each message; who it is of, the peer's first letter says."""

    def __init__(self, processing: float = 0.05, read: Any = None, driven: bool = True) -> None:
        self.clock, self.done, self.times = Clock(), list[bytes](), dict[bytes, float]()
        self.busy: list[bytes] = []
        self.inbox = CommandQueue(
            self.clock,
            lambda: processing,
            self._handle,
            latest_wins=True,
            read=read,
            standing=self._standing,
            driven=lambda: driven,
            refuse=lambda letter: self.busy.append(letter.data),
        )

    def _standing(self, letter: Letter) -> Standing:
        kinds = {"s": Standing.OTHER, "d": Standing.DVA}
        return kinds.get(str(letter.request.peer)[:1] if letter.request else "", Standing.HOLDER)

    def _handle(self, letter: Letter) -> None:
        self.done.append(letter.data)
        self.times[letter.data] = self.clock.now

    def ask(self, data: bytes, peer: str = "") -> None:
        self.inbox.request(Request(data, lambda _: None, peer=peer))

    def flood(self, peers: list[str], data: bytes = b"%d of %d", rate: float = 25.0) -> None:
        """Let each peer send so many a second [1/s], from now on."""
        for number, peer in enumerate(peers):
            count = itertools.count()

            def send(peer: str = peer, number: int = number, count: Any = count) -> None:
                self.ask(data % (next(count), number) if b"%" in data else data, peer)

            self.clock.every(1.0 / rate, send, start=0.001 * number)


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize(
    "emergency",
    [EMERGENCY, EMERGENCY.replace(b"<EmergencyMsg>", b"<EmergencyMsg >")],
    ids=["as we write it", "as others may"],
)
def test_an_emergency_overtakes_all_that_waits(bench, emergency):
    for number in range(200):
        bench.ask(b"%d" % number)
    bench.ask(emergency)
    bench.clock.run(0.11)
    assert bench.done == [b"0", emergency]


def test_what_only_calls_itself_an_emergency_overtakes_nothing_and_keeps_none_out(bench):
    for number in range(LIMIT + 1):
        bench.ask(b"<EmergencyMsg>%d" % number)
    bench.ask(EMERGENCY)
    bench.clock.run(0.11)
    assert bench.done == [b"<EmergencyMsg>0", EMERGENCY]


def test_where_processing_takes_no_time_nothing_waits():
    bench = Bench(processing=0.0)
    bench.ask(b"now")
    assert bench.done == [b"now"]


class Noted(NamedTuple):
    """A message of a peer, as the queue is given it."""

    body: m.Body


def test_who_sends_much_waits_for_itself_and_not_the_others(bench):
    for number in range(50):
        bench.ask(b"<SetTeleOp>flood %d" % number, peer="h flood")
    bench.ask(b"<SetTeleOp>holder", peer="h")
    bench.clock.run(0.16)
    assert bench.done[:3] == [b"<SetTeleOp>flood 0", b"<SetTeleOp>flood 1", b"<SetTeleOp>holder"]


def test_what_the_holder_asks_for_comes_before_its_commands_that_wait(bench):
    for number in range(5):
        bench.ask(b"<SetTeleOp>%d" % number, peer="h")
    bench.ask(b"stop", peer="h")
    bench.clock.run(0.11)
    assert bench.done == [b"<SetTeleOp>0", b"stop"]


@pytest.mark.parametrize(("latest_wins", "done"), [(True, [0, 4]), (False, [0, 1, 2, 3, 4])])
def test_of_published_commands_the_newest_or_all_wait(bench, latest_wins, done):
    bench.inbox.latest_wins = latest_wins
    for number in range(5):
        bench.inbox.published(b"%d" % number)
    bench.clock.run(1.0)
    assert bench.done == [b"%d" % number for number in done]
    assert bench.inbox.superseded == 5 - len(done)


def test_a_queue_that_one_peer_has_filled_takes_what_another_sends(bench):
    for number in range(LIMIT + 50):
        bench.ask(b"<SetTeleOp>%d" % number, peer="h flood")
    dropped = bench.inbox.overflowed
    bench.ask(b"<SetTeleOp>holder", peer="h")
    assert (dropped, bench.inbox.overflowed) == (49, 50)
    bench.clock.run(0.16)
    assert b"<SetTeleOp>holder" in bench.done


def test_what_is_refused_when_it_arrives_takes_no_time_and_no_place():
    read = lambda request: Noted(m.StartTeleOp()) if request.data == b"good" else None  # noqa: E731
    bench = Bench(read=read)
    for _ in range(5 * LIMIT):
        bench.ask(b"bad")
    bench.ask(b"good")
    bench.clock.run(0.051)
    assert bench.done == [b"good"]
    assert (bench.inbox.longest, bench.inbox.overflowed) == (1, 0)


SERVICE, REST, AFTER_HOLDER = 0.05, 4, 1.0  # [s], in times of the service, [s]


@pytest.mark.parametrize("others", [1, 20])
@pytest.mark.parametrize("of", ["s", "sd"])
@pytest.mark.parametrize("urgent", [0, 20])
def test_how_long_the_holder_waits_does_not_depend_on_how_many_send_how_much(
    bench, others, of, urgent
):
    bench.flood([f"{of[n % len(of)]} {n}" for n in range(others)])
    bench.flood([f"s urgent {n}" for n in range(urgent)], EMERGENCY)
    period = 0.3037 if urgent else 0.1037
    sent = {b"<SetTeleOp>%d" % n: 1.0 + period * n for n in range(12)}
    for data, when in sent.items():
        bench.clock.call_at(when, bench.ask, data, "h")
    bench.clock.run(5.0)
    waits = [bench.times[data] - when - SERVICE for data, when in sent.items()]
    assert max(waits) < (4 if urgent else 1) * SERVICE + 1e-4


@pytest.mark.parametrize("others", [1, 20])
@pytest.mark.parametrize("flood", [b"%d of %d", b"<SetTeleOp>%d of %d", EMERGENCY])
def test_an_emergency_is_done_after_two_services_whoever_sends_what(bench, others, flood):
    bench.flood([f"{'sdh'[n % 3]} {n}" for n in range(others)], flood)
    sent = {EMERGENCY + b" " * n: 1.0 + 0.2037 * n for n in range(1, 15)}
    for data, when in sent.items():
        bench.clock.call_at(when, bench.ask, data, "s in need")
    bench.clock.run(5.0)
    assert max(bench.times[data] - when for data, when in sent.items()) < 2 * SERVICE + 1e-4


@pytest.mark.system
def test_a_flood_of_emergencies_leaves_every_second_turn_and_no_backlog(bench):
    bench.flood([f"s {n}" for n in range(20)], EMERGENCY, rate=500.0)
    bench.clock.call_at(1.0, bench.ask, b"start", "h")
    bench.clock.call_at(1.0, bench.ask, b"grant", "d")
    bench.clock.run(2.0)
    assert max(bench.times[b"start"], bench.times[b"grant"]) < 1.0 + 5 * SERVICE
    assert bench.inbox.longest <= 20 * PER_CONNECTION
    assert set(bench.busy) == {EMERGENCY}


def test_strangers_take_a_fifth_of_a_robot_that_is_driven_and_all_of_one_that_is_not():
    taken = []
    for driven in (True, False):
        bench = Bench(driven=driven)
        bench.flood([f"s {n}" for n in range(20)])
        sent = {b"<SetTeleOp>%d" % n: 0.5 + 0.1007 * n for n in range(90)} if driven else {}
        for data, when in sent.items():
            bench.clock.call_at(when, bench.ask, data, "h")
        bench.clock.run(10.0)
        taken.append((len(bench.done) - len(sent)) * SERVICE / 10.0)
        held_up = [data for data, when in sent.items() if bench.times[data] > when + SERVICE + 0.01]
        assert len(held_up) < 3
    assert taken == [pytest.approx(0.17, abs=0.03), pytest.approx(1.0, abs=0.01)]


def test_who_holds_a_robot_and_says_nothing_does_not_silence_strangers():
    bench = Bench(driven=True)
    for number in range(4):
        bench.ask(b"%d" % number, peer=f"s {number}")
    bench.clock.run(4 * 1.26)
    assert len(bench.done) == 4
    pauses = np.diff(list(bench.times.values()))
    assert pauses == pytest.approx(SERVICE + REST * SERVICE + AFTER_HOLDER)


def test_strangers_have_their_turns_however_much_the_holder_sends(bench):
    bench.flood(["h"], b"<SetTeleOp>%d of %d", rate=200.0)
    bench.flood(["s a", "s b"], b"%d of %d")
    bench.flood(["d"], b"dva %d %d")
    bench.clock.run(10.0)
    of = [sum(data.endswith(end) for data in bench.done) for end in (b"of 0", b"of 1")]
    dva = sum(data.startswith(b"dva") for data in bench.done)
    commands = sum(data.startswith(b"<SetTeleOp>") for data in bench.done)
    assert commands == pytest.approx(100, abs=2)
    assert dva > 55
    assert min(of[0] - commands, of[1]) > 15


def test_commands_of_strangers_have_their_turns_among_what_others_ask():
    bench = Bench(driven=False)
    bench.flood([f"s {n}" for n in range(20)])
    bench.clock.call_at(1.0, bench.ask, b"<SetTeleOp>", "s who held it")
    bench.clock.run(3.0)
    assert bench.times[b"<SetTeleOp>"] < 1.0 + 22 * SERVICE


def test_a_connection_that_is_not_the_holders_has_so_many_places_and_is_told_so(bench):
    for number in range(PER_CONNECTION + 4):
        bench.ask(b"%d" % number, peer="s")
        bench.ask(b"<SetTeleOp>%d" % number, peer="h")
    assert bench.busy == [b"9", b"10", b"11"]
    assert bench.inbox.overflowed == 3
    bench.clock.run(20.0)
    assert len(bench.done) == 2 * (PER_CONNECTION + 4) - 3


def test_a_thousand_connections_keep_neither_the_holder_nor_the_dva_out(bench):
    for number in range(2 * LIMIT):
        bench.ask(b"%d" % number, peer=f"s {number}")
    bench.ask(b"grant", peer="d")
    bench.ask(b"start", peer="h")
    assert len(bench.busy) == 2 * LIMIT - MAX_OF_OTHERS
    bench.clock.run(0.16)
    assert bench.done == [b"0", b"start", b"grant"]


def test_who_becomes_the_holder_while_it_waits_has_the_holders_turn(bench):
    for number in range(20):
        bench.ask(b"%d" % number, peer=f"s {number}")
    bench.ask(b"start", peer="s last")
    bench.inbox._waiting._standing = lambda letter: (
        Standing.HOLDER if letter.data == b"start" else Standing.OTHER
    )
    bench.clock.run(0.11)
    assert bench.done == [b"0", b"start"]
