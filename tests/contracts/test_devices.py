"""Devices over each transport: requests act once, emergencies always, old commands never."""

from collections import Counter
from dataclasses import dataclass

import pytest
from helpers.dva.permissions import give
from helpers.network.transports import (
    BRIEF,
    DVA,
    PHONE,
    ROBOT,
    TABLET,
    Asker,
    Meddled,
    Meddler,
    Plan,
    SocketWorld,
    World,
    small_device,
)

from dva_sim.agents import device
from dva_sim.agents.device import command_topic
from dva_sim.agents.robot.controller import Limits, Mode, RobotController
from dva_sim.network.messaging import Request, Requester
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import Outbox

pytestmark = pytest.mark.contract

TROUBLE = Plan(lose=0.3, double=0.5, hold=0.1)
SESSION = 7


def tells_senders(world: World) -> bool:
    """By keys, or by a broker that lets its clients write only what is from themselves."""
    return isinstance(world, SocketWorld) and bool(world.ring)


def code_of(reply: bytes | None) -> int:
    assert reply is not None
    body = decode(reply).body
    assert isinstance(body, m.Reply)
    return body.code


class Acting:
    """A robot that takes everything, and counts how often each message has acted."""

    def __init__(self, world: World, meddler: Meddler | None = None) -> None:
        network = world.network if meddler is None else Meddled(world.network, meddler)
        self.device = small_device(world, ROBOT, network=network)
        self.acts: Counter[tuple[str, int]] = Counter()
        self.device.serve(self.act)

    def act(self, message: m.Message) -> m.Reply:
        self.acts[message.source, message.message_id] += 1
        return m.Reply(message.message_id, m.OK, "")


def test_a_request_that_is_sent_again_or_doubled_acts_once(world):
    robot = Acting(world, Meddler(world.clock, 1, TROUBLE))
    ends: dict[tuple[str, int], list[m.Reply | None]] = {}
    for node in (PHONE, TABLET, DVA):
        asker = small_device(world, node, BRIEF)
        for number in range(1, 6):
            end = ends[node, number] = []
            asker.ask(ROBOT, m.StopTeleOp(), end.append, lambda end=end: end.append(None))
    world.run_until(lambda: all(ends.values()))
    world.run_for(2 * TROUBLE.hold)
    assert set(robot.acts.values()) == {1}
    for (node, number), (reply, *more) in ends.items():
        assert more == []
        if reply is not None:
            assert reply.answers == number
            assert robot.acts[node, number] == 1


def test_an_emergency_acts_whenever_it_comes(world):
    """A button may send the same bytes all its life; other requests of the same bytes act once."""
    robot = Acting(world)
    button = Asker(world.network)
    outbox = Outbox(PHONE)
    stop, emergency = (outbox.encode(ROBOT, b, 0.0) for b in (m.StopTeleOp(), m.Emergency()))
    for data in (stop, emergency):
        for _ in range(5):
            button.ask(data)
    world.run_until(lambda: all(len(ends) == 5 for ends in button.ends.values()))
    assert robot.acts == {(PHONE, 1): 1, (PHONE, 2): 5}
    assert {code_of(reply) for ends in button.ends.values() for reply in ends} == {m.OK}


def test_an_emergency_does_not_wait_behind_a_request_that_is_not_answered(world):
    robot, phone = Acting(world), small_device(world, PHONE)

    def answer_emergencies(request: Request) -> None:
        if b"<EmergencyMsg>" in request.data:
            robot.device.take(request, robot.act)

    world.serve(ROBOT, answer_emergencies)
    codes: list[int] = []
    for _ in range(10):
        phone.ask(ROBOT, m.StopTeleOp())
    phone.ask(ROBOT, m.Emergency(), lambda reply: codes.append(reply.code))
    world.run_until(lambda: codes)
    assert codes == [m.OK]
    assert len(robot.acts) == 1


def test_a_device_registers_as_soon_as_the_dva_is_there(world, monkeypatch):
    monkeypatch.setattr(device, "REGISTER_AGAIN", BRIEF)
    robot = small_device(world, ROBOT, BRIEF)
    known: list[str] = []

    def admit(message: m.Message) -> m.Reply:
        known.append(message.source)
        return m.Reply(message.message_id, m.OK, "")

    small_device(world, DVA).serve(admit)
    world.leave(DVA)
    done: list[float] = []
    robot.register(lambda: done.append(world.clock.now))
    world.run_for(3 * BRIEF)
    assert not done
    world.come_back(DVA)
    world.run_until(lambda: done)
    world.run_for(3 * BRIEF)
    assert len(done) == 1
    assert set(known) == {ROBOT}


# --- whose key it is ----------------------------------------------------------------------


def test_who_speaks_for_another_is_refused_where_the_sender_is_told(world):
    robot = Acting(world)
    impostor = Asker(world.network, node=TABLET)
    impostor.ask(Outbox(PHONE).encode(ROBOT, m.StopTeleOp(), 0.0))
    impostor.ask(Outbox(TABLET).encode(ROBOT, m.StopTeleOp(), 0.0))
    world.run_until(impostor.all_over)
    expected = m.NOT_PERMITTED if tells_senders(world) else m.OK
    assert [code_of(reply) for reply in impostor.replies()] == [expected, m.OK]
    assert robot.acts[PHONE, 1] == (0 if tells_senders(world) else 1)
    assert robot.acts[TABLET, 1] == 1


@pytest.mark.invariant("S5")
def test_an_emergency_is_obeyed_whoever_it_says_it_is_from(world):
    robot = Acting(world)
    impostor = Asker(world.network, node=TABLET)
    impostor.ask(Outbox(PHONE).encode(ROBOT, m.Emergency(), 0.0))
    world.run_until(impostor.all_over)
    assert [code_of(reply) for reply in impostor.replies()] == [m.OK]
    assert robot.acts == {(PHONE, 1): 1}


def test_a_reply_in_the_name_of_another_is_not_believed(world):
    """Whatever the transport, who was asked must be who answers."""
    phone, reported = small_device(world, PHONE), Outbox(TABLET)
    world.serve(
        ROBOT, lambda r: r.answer(reported.encode(PHONE, m.Reply(1, m.OK, ""), world.clock.now))
    )
    believed: list[m.Reply] = []
    phone.ask(ROBOT, m.StopTeleOp(), believed.append)
    world.run_until(lambda: phone.recorder.counters["refused: of another source"] == 1)
    assert believed == []


# --- a robot that is driven ---------------------------------------------------------------


@dataclass
class Decided:
    """A message that reached the controller: when, when it was made, and what came of it."""

    message: m.Message
    now: float
    code: int
    until: float | None


class DrivenRobot:
    """A robot's controller behind its device, in a drive; and the operator who sends."""

    LIMITS = Limits(watchdog=0.06, max_age=0.04)

    def __init__(self, world: World) -> None:
        self.world = world
        self.meddler = Meddler(world.clock, 1, Plan())
        network = Meddled(world.network, self.meddler)
        self.device = small_device(world, ROBOT, network=network)
        self.controller = RobotController(ROBOT, DVA, self.LIMITS, clock_offset=5000.0)
        self.decided: list[Decided] = []
        self.made: dict[int, float] = {}
        self.device.serve(self._decide)
        network.subscribe(ROBOT, PHONE, command_topic(ROBOT), self._hear)
        self.phone = small_device(world, PHONE)
        self._start()

    def _start(self) -> None:
        codes: list[int] = []
        now, grant = self.world.clock.now, m.PermissionGrant(PHONE, "both", SESSION)
        codes.append(give(self.controller, grant, now).code)
        self.phone.ask(
            ROBOT, m.StartTeleOp(), lambda reply: codes.append(reply.code), session=SESSION
        )
        self.world.run_until(lambda: len(codes) == 2)
        assert codes == [m.OK, m.OK]

    def await_publications(self) -> None:
        """Publish until something is heard."""

        def heard() -> bool:
            self.publish()
            return bool(self.commands())

        self.world.run_until(heard)

    def command(self) -> bytes:
        """A new command, by a picture that is taken now."""
        now = self.world.clock.now
        body = m.SetTeleOp(0.1, 0.0, self.controller.tick(now))
        data = self.phone.outbox.encode(ROBOT, body, now, SESSION)
        self.made[decode(data).message_id] = now
        return data

    def publish(self) -> None:
        data = self.command()
        self.world.network.publish(PHONE, command_topic(ROBOT), data, len(data))

    def codes(self) -> Counter[int]:
        """Reply codes of the commands, with counts."""
        return Counter(d.code for d in self.commands())

    def commands(self) -> list[Decided]:
        return [d for d in self.decided if isinstance(d.message.body, m.SetTeleOp)]

    def _hear(self, data: bytes) -> None:
        message = self.device.read(data, PHONE)
        assert message is not None
        self._decide(message)

    def _decide(self, message: m.Message) -> m.Reply:
        now = self.world.clock.now
        decision = self.controller.handle(message, now, now, moving=False)
        until = None if decision.set_point is None else decision.set_point.until
        self.decided.append(Decided(message, now, decision.code, until))
        return m.Reply(message.message_id, decision.code, decision.text)


ROUNDING = 0.001  # ticks are whole milliseconds [s]


def check_what_was_obeyed(robot: DrivenRobot) -> None:
    """Commands only move forward, and none is obeyed that is older than the limits."""
    limits, newest = robot.LIMITS, 0
    for decided in robot.commands():
        number, made = decided.message.message_id, robot.made[decided.message.message_id]
        if decided.code == m.OK:
            assert number > newest
            assert decided.until is not None
            assert decided.now < decided.until <= decided.now + limits.watchdog
            assert decided.until <= made + limits.max_age + ROUNDING
        elif decided.code == m.STALE:
            assert number > newest
            assert decided.now >= made + limits.max_age - ROUNDING
        else:
            assert decided.code == m.OUT_OF_ORDER
            assert number <= newest
        newest = max(newest, number)


@pytest.mark.parametrize(
    ("pattern", "codes"),
    [
        ("published", {m.OK, m.STALE, m.OUT_OF_ORDER}),
        ("pipelined", {m.OK, m.STALE, m.OUT_OF_ORDER}),
        ("one at a time", {m.OK, m.STALE}),
    ],
    ids=["published", "pipelined", "one at a time"],
)
def test_a_robot_obeys_only_new_commands_however_they_are_delayed(world, pattern, codes):
    robot = DrivenRobot(world)
    window = 4 if pattern == "pipelined" else 1
    requester = Requester(world.network, PHONE, ROBOT, BRIEF, window=window)
    answers: list[tuple[int, int]] = []

    def send() -> None:
        if pattern == "published":
            robot.publish()
        elif not requester.busy:
            data = robot.command()
            number = max(robot.made)
            requester.request(data, lambda reply: answers.append((number, _answers(reply))))

    if pattern == "published":
        robot.await_publications()
    robot.meddler.plan = Plan(lose=0.3, double=0.5, hold=0.1)
    world.clock.every(0.02, send, start=world.clock.now)
    world.run_until(lambda: all(robot.codes()[code] >= 3 for code in codes))
    check_what_was_obeyed(robot)
    assert set(robot.codes()) <= codes
    assert all(number == answered for number, answered in answers)


def _answers(reply: bytes) -> int:
    body = decode(reply).body
    assert isinstance(body, m.Reply)
    return body.answers


@pytest.mark.invariant("S3")
def test_after_an_emergency_nothing_that_was_held_back_moves_the_robot(world):
    robot = DrivenRobot(world)
    robot.await_publications()
    robot.meddler.plan = Plan(double=0.5, hold=0.2)
    for _ in range(40):
        robot.publish()
    stopped: list[m.Reply] = []
    small_device(world, TABLET).ask(ROBOT, m.Emergency(), stopped.append)
    world.run_until(lambda: stopped)
    for _ in range(40):
        robot.publish()
    world.run_until(lambda: len(robot.commands()) >= 80)
    first = next(i for i, d in enumerate(robot.decided) if d.message.body == m.Emergency())
    after = [d for d in robot.decided[first:] if isinstance(d.message.body, m.SetTeleOp)]
    assert len(after) > 20
    assert {d.code for d in after} == {m.WRONG_MODE}
    assert robot.controller.mode is Mode.IDLE
