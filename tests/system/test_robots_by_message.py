"""Robots on the network, driven by messages alone."""

import itertools
import math
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

import pymunk
import pytest
from helpers.dva.permissions import enter

from dva_sim.agents.device import MISSION, command_topic, do_nothing
from dva_sim.agents.robot.command_queue import PER_CONNECTION
from dva_sim.agents.robot.robot import FRAME, RobotAgent
from dva_sim.agents.robot.sensors import sensor_topic
from dva_sim.kernel.recorder import Accepted
from dva_sim.network.messaging import Request, Requester
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.exchange import Nuisances, Outbox
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.observations import motion_of, terms_of
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.safety_checks import broken_by_moving
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.worlds.lidar import Lidar

pytestmark = pytest.mark.system

ROBOT = id_of("robot", 1)
QUIET = {"events": [{"kind": "fire", "at_s": 500}], "horizon_s": 600}


def staged(**changes: object) -> Run:
    """A run with everybody in place, whose time the test lets pass."""
    scenario = scenarios.build(scenarios.load("drive-to-event"), QUIET | changes)
    return Run(scenario, 1)


def send(run: Run, time: float, body: m.Body, session: int = 5) -> list[m.Reply]:
    """Let the DVA send a request at a time [s]; replies come into the list."""
    replies: list[m.Reply] = []
    run.clock.call_at(time, say, run, ROBOT, body, replies.append, session)
    return replies


def say(
    run: Run,
    robot: str,
    body: m.Body,
    then: Callable[[m.Reply], object] = do_nothing,
    session: int = 5,
) -> None:
    """Let the DVA send a robot something, which its book says, too."""
    enter(run.dva.core, robot, body)
    run.dva.device.ask(robot, body, then, session=session)


def heard(run: Run, topic: str) -> list[Any]:
    """Messages that a robot publishes on a topic from now on."""
    reports: list[Any] = []
    run.network.subscribe(DVA, ROBOT, topic, lambda data: reports.append(decode(data).body))
    return reports


def place(run: Run, x: float, y: float) -> m.Position:
    return m.Position(*run.stage.site.frame.to_latlon(x, y))


def test_a_robot_drives_a_mission_by_itself_and_is_idle_again():
    run = staged()
    robot = run.field.robots[ROBOT]
    start = robot.body.pose()
    corner, goal = (12.0, 12.0), (20.0, 12.0)
    send(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    messages = send(run, 12.0, m.GoTo((place(run, *corner), place(run, *goal))))
    run.clock.run(14.0)
    assert [r.code for r in messages] == [m.OK]
    assert robot.controller.mode == "Mission"
    run.clock.run(120.0)
    assert robot.controller.mode == "Idle"
    assert math.dist(robot.body.pose()[:2], goal) < 0.6
    assert robot.body.distance > math.dist(start[:2], corner)
    assert run.recorder.violations == {}


def test_an_emergency_stops_a_moving_robot_within_its_braking_distance():
    run = staged()
    robot = run.field.robots[ROBOT]
    send(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    send(run, 12.0, m.GoTo((place(run, 30.0, 12.0),)))
    run.clock.run(45.0)
    run.field.world.advance_to(45.0)
    assert robot.body.speed > 0.4
    before = robot.body.distance
    messages = send(run, 45.0, m.Emergency(), session=0)
    run.clock.run(60.0)
    run.field.world.advance_to(60.0)
    assert [r.code for r in messages] == [m.OK]
    assert robot.controller.mode == "Idle"
    processing, lag, brake = 0.05 * 0.5, 0.15 * 0.5, 0.5**2 / 2
    assert robot.body.distance - before < processing + lag + brake + 0.02
    assert run.recorder.violations == {}


def test_two_robots_that_meet_head_on_get_past_each_other_without_touching():
    run = staged(**{"robot.count": 2, "operator.count": 2})
    one, two = (run.field.robots[id_of("robot", n)] for n in (1, 2))
    ways = ((ROBOT, (14.5, 7.4)), (id_of("robot", 2), (9.5, 7.4)))
    for robot, goal in ways:
        grant = m.PermissionGrant(DVA, "missions", 5)
        run.clock.call_at(10.0, say, run, robot, grant)
        there = m.GoTo((place(run, *goal),))
        run.clock.call_at(12.0, say, run, robot, there)
    gaps: list[float] = []

    def measure() -> None:
        run.field.world.advance_to(run.clock.now)
        gaps.append(math.dist(one.body.pose()[:2], two.body.pose()[:2]))

    run.clock.every(0.1, measure)
    run.clock.run(60.0)
    assert min(gaps) > 2 * one.body.spec.radius
    assert one.body.contacts == two.body.contacts == 0
    for robot, (_, goal) in zip((one, two), ways, strict=True):
        assert math.dist(robot.body.pose()[:2], goal) < 0.5


def test_bad_bytes_are_answered_and_change_nothing():
    run = staged()
    answers: list[bytes] = []
    handler = run.network.service(ROBOT)
    assert handler is not None
    for data in (b"", b"<msg>", b"<!DOCTYPE x><msg/>", b"\xff" * 9000):
        handler(Request(data, answers.append))
    run.clock.run(5.0)
    assert len(answers) == 4
    assert all(b"<Code>1</Code>" in a for a in answers)
    assert run.recorder.counters["refused"] == 4
    assert run.field.robots[ROBOT].controller.mode == "Idle"


def test_a_sensor_is_read_at_the_frequency_asked_for_while_it_is_permitted():
    run = staged(events=[{"kind": "fire", "at_s": 5, "room": "Chemistry lab"}])
    values = heard(run, sensor_topic("heat_flux", DVA))
    messages = send(run, 1.0, m.GetSensorInfo(), session=0)
    by_id = send(run, 1.2, m.GetSensorInfo(ROBOT), session=0)
    early = send(run, 1.5, m.DevSub("heat_flux", 2.0))
    send(run, 2.0, m.PermissionGrant(DVA, "sensors", 5, None, ("heat_flux",)))
    late = send(run, 3.0, m.DevSub("heat_flux", 2.0))
    over = send(run, 23.0, m.PermissionRevocation(ROBOT, DVA, 5))
    run.clock.run(40.0)
    for reply in (*messages, *by_id):
        assert isinstance(reply.content, m.SensorInfo)
        assert m.Sensor("heat_flux", "kW/m2") in reply.content.sensors
    assert [r.code for r in (*early, *late, *over)] == [m.NOT_PERMITTED, m.OK, m.OK]
    assert len(values) in (39, 40, 41)
    assert {value.unit for value in values} == {"kW/m2"}
    ticks = [value.tick for value in values]
    assert ticks == sorted(ticks)


def test_a_new_mission_right_after_an_emergency_is_driven_by_one_loop_alone():
    run = staged(**{"robot.processing_s": 0.0})
    robot = run.field.robots[ROBOT]
    obeyed: list[float] = []
    drive = robot.body.drive
    robot.body.drive = lambda *asked: (obeyed.append(run.clock.now), drive(*asked))  # type: ignore[method-assign,assignment,func-returns-value]
    send(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    send(run, 12.0, m.GoTo((place(run, 30.0, 12.0),)))
    send(run, 12.05, m.Emergency(), session=0)
    run.clock.call_at(12.055, robot.controller.release_by_hand, "warden")
    send(run, 12.06, m.GoTo((place(run, 12.0, 12.0),)))
    run.clock.run(14.0)
    assert robot.controller.mode == "Mission"
    last_second = [time for time in obeyed if time > 13.0]
    assert len(last_second) in (9, 10, 11)


def rules_broken(run: Run, robot: RobotAgent) -> list[str]:
    witness = run.audit.witness(robot.device.id_tag)
    limits = terms_of(run.scenario).motors[robot.device.id_tag]
    return [rule for rule, _ in broken_by_moving(witness, motion_of(robot), limits, run.clock.now)]


def test_a_robot_that_another_has_pushed_breaks_no_rule_but_one_that_drives_on_does():
    """It slides until its own brakes have stopped it; after that nothing excuses a motion."""
    run = staged(**{"robot.count": 2, "operator.count": 2})
    pushed = run.field.robots[ROBOT]
    run.clock.run(10.0)
    run.field.world.advance_to(10.0)
    pushed.body._touch.last = 10.0
    pushed.body.body.velocity = pymunk.Vec2d(0.1, 0.0).rotated(pushed.body.body.angle)
    assert rules_broken(run, pushed) == []
    pushed.body._touch.last = 5.0
    assert rules_broken(run, pushed) == ["S1"]


def test_a_robot_that_drives_backwards_by_itself_breaks_a_rule():
    run = staged()
    robot = run.field.robots[ROBOT]
    run.clock.run(10.0)
    run.field.world.advance_to(10.0)
    robot.body.body.velocity = pymunk.Vec2d(-0.04, 0.0).rotated(robot.body.body.angle)
    assert rules_broken(run, robot) == []
    robot.body.body.velocity = pymunk.Vec2d(-0.06, 0.0).rotated(robot.body.body.angle)
    assert rules_broken(run, robot) == ["S1", "S4"]
    robot.body._touch.last = 10.0
    assert rules_broken(run, robot) == []


def test_a_published_command_to_another_robot_is_counted_and_not_obeyed():
    run = staged()
    robot = run.field.robots[ROBOT]
    other = m.Message(id_of("robot", 2), 1, DVA, "12:00:00", 5, m.SetTeleOp(0.5, 0.0))
    robot._published(encode(other))
    run.clock.run(1.0)
    assert run.recorder.counters["refused: to another device"] == 1
    assert robot.refused == 0


def test_a_patrol_is_cancelled_and_the_robot_goes_home():
    run = staged()
    robot = run.field.robots[ROBOT]
    base = robot.body.pose()
    messages = heard(run, MISSION)
    beat = (place(run, 12.0, 12.0), place(run, 18.0, 12.0))
    send(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    began = send(run, 12.0, m.Patrol(beat, 0))
    asked = send(run, 70.0, m.GetMissionStatus(), session=0)
    second = send(run, 100.0, m.ReturnToBase())  # refused: on a patrol
    over = send(run, 101.0, m.CancelMission())
    home = send(run, 103.0, m.ReturnToBase())
    run.clock.run(99.0)
    assert robot.controller.mode == "Mission"
    assert robot.body.distance > 25.0
    run.clock.run(102.5)
    assert robot.controller.mode == "Idle"
    assert abs(robot.body.speed) < 0.01
    run.clock.run(200.0)
    assert [r.code for r in (*began, *second, *over, *home)] == [m.OK, m.BUSY, m.OK, m.OK]
    assert math.dist(robot.body.pose()[:2], base[:2]) < 0.5
    assert [status.mission_state for status in messages][-3:] == ["failed", "under_way", "done"]
    assert messages[-3].reason == "cancelled"
    patrol, way_home = messages[0].mission_id, messages[-1].mission_id
    assert way_home > patrol > 0
    (status,) = (reply.content for reply in asked)
    assert isinstance(status, m.MissionStatus)
    assert (status.mission_id, status.mission_state) == (patrol, "under_way")
    assert status.waypoints_left in (1, 2)
    assert run.recorder.violations == {}


def test_an_emergency_during_a_patrol_ends_it_and_says_so():
    run = staged()
    messages = heard(run, MISSION)
    send(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    send(run, 12.0, m.Patrol((place(run, 12.0, 12.0), place(run, 18.0, 12.0)), 0))
    send(run, 40.0, m.Emergency(), session=0)
    run.clock.run(60.0)
    robot = run.field.robots[ROBOT]
    assert robot.controller.mode == "Idle"
    assert (messages[-1].mission_state, messages[-1].reason) == ("failed", "emergency")
    before = robot.body.distance
    run.clock.run(90.0)
    assert robot.body.distance == before


def test_a_robot_inspects_an_event_and_waits_before_it():
    nobody_drives = [{"levels": ["sensors"]}]
    run = staged(events=[{"kind": "fire", "at_s": 5, "room": "Workshop"}], access=nobody_drives)
    robot = run.field.robots[ROBOT]
    fire = run.field.incidents[0].hazard.position
    messages = heard(run, MISSION)
    send(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    send(run, 12.0, m.Inspect(3, "fire", place(run, *fire)))
    run.clock.run(110.0)
    assert (messages[-1].mission_state, messages[-1].reason) == ("waiting", "fire in view")
    assert any(seen.kind == "fire" for seen in robot.observe().hazards)
    assert robot.controller.mode == "Mission"
    assert robot.body.contacts == 0


def test_a_lidar_is_subscribed_to_and_sees_the_walls_of_its_bay():
    run = staged(**{"robot.sensors": [{"name": "lidar", "noise": 0.0, "rate_hz": 10}]})
    robot = run.field.robots[ROBOT]
    scans = heard(run, sensor_topic("lidar", DVA))
    send(run, 2.0, m.PermissionGrant(DVA, "sensors", 5, None, ("lidar",)))
    too_often = send(run, 3.0, m.DevSub("lidar", 20.0))
    messages = send(run, 4.0, m.DevSub("lidar", 5.0))
    run.clock.run(24.0)
    assert [r.code for r in (*too_often, *messages)] == [m.NOT_SUPPORTED, m.OK]
    assert len(scans) == 100 or abs(len(scans) - 100) <= 2
    assert {len(scan.values) for scan in scans} == {36}
    assert {scan.unit for scan in scans} == {"m"}
    expected = Lidar(run.field.world).scan([robot.body])[0]
    assert scans[-1].values == tuple(expected.round(3).tolist())


def test_a_frame_is_published_when_it_has_been_encoded_one_at_a_time():
    """0.25 s for a frame: of ten a second, one in three is taken, and arrives that much later."""
    run = staged(**{"camera.encode_s": 0.25, "camera.rate_hz": 10.0, "link.delay_s": 0.0})
    shown: list[tuple[float, float]] = []
    run.network.subscribe(
        DVA, ROBOT, FRAME, lambda frame: shown.append((run.clock.now, frame.captured))
    )
    run.clock.run(31.0)
    ages = [arrived - captured for arrived, captured in shown]
    assert min(ages) >= 0.25
    assert max(ages) < 0.30
    (first, _), (last, _) = shown[0], shown[-1]
    # The next frame is taken at the first tick of the camera after the last one was encoded.
    assert (last - first) / (len(shown) - 1) == pytest.approx(0.3, abs=0.001)


@pytest.mark.invariant("S11")
def test_nobody_can_talk_a_robot_to_death():
    """Twenty strangers send rubbish, fifty a second each, while the DVA drives the robot."""
    served: dict[str, list[float]] = {"alone": [], "flooded": []}
    for name, senders in (("alone", 0), ("flooded", 20)):
        run = staged()
        send(run, 2.0, m.PermissionGrant(DVA, "both", 5))
        send(run, 3.0, m.StartTeleOp())
        for number in range(60):
            begun = 4.0 + 0.1 * number
            answered = lambda _, t=begun, s=served[name]: s.append(run.clock.now - t)  # noqa: B023,E731
            ask = partial(run.dva.device.ask, ROBOT, m.SetTeleOp(0.1, 0.3), answered, session=5)
            run.clock.call_at(begun, ask)
        for number in range(senders):
            wire = run.network.connect(f"stranger-{number}", ROBOT, lambda *_: None, True)
            for tag in range(250):
                run.clock.call_at(1.0 + tag / 50, wire.send, tag, b"<msg>rubbish %d</msg>" % tag)
        run.clock.run(15.0)
        assert run.field.robots[ROBOT].applied == 60
    assert max(served["flooded"]) == pytest.approx(max(served["alone"]), abs=0.001)
    counted = run.recorder.counters
    unread = counted["refused unread: of a peer that sends no messages"]
    assert counted["refused"] + unread == 20 * 250
    assert unread > 2000


HOLDER, SERVICE = id_of("operator", 1), 0.05
SENDERS = (1, 20)
ANSWERED_BY_ITSELF: tuple[m.Body, ...] = (
    m.GetSensorInfo(),
    m.GetSensorInfo(ROBOT),
    m.GetMissionStatus(),
    m.DevSub("heat_flux", 1.0),
    m.Registration("a device", "Robot", "127.0.0.1"),
)
HOLDERS: tuple[m.Body, ...] = (
    m.StartTeleOp(),
    m.SetTeleOp(0.5, 0.0),
    m.StopTeleOp(),
    m.GoTo((m.Position(38.66, -9.2),)),
    m.ReturnToBase(),
    m.CancelMission(),
)
DVAS: tuple[m.Body, ...] = (
    m.PermissionGrant("02:00:00:0F:00:01", "both", 9 << 32),
    m.PermissionRevocation(ROBOT, HOLDER, 9 << 32),
    m.TaskAward(7),
)
FORGED: tuple[tuple[str, m.Body], ...] = (
    (DVA, m.GetSensorInfo()),
    (DVA, m.PermissionGrant(HOLDER, "both", 1)),
    (HOLDER, m.StopTeleOp()),
    (HOLDER, m.SetTeleOp(0.5, 0.0)),
)
FLOODS = [("", body) for body in (*ANSWERED_BY_ITSELF, *HOLDERS, *DVAS)] + list(FORGED)


class Driven:
    """A robot that an operator drives by a pattern, at 10 commands a second."""

    def __init__(self, pattern: str) -> None:
        self.run = staged(pattern=pattern)
        self.robot, self.clock = self.run.field.robots[ROBOT], self.run.clock
        self.outbox, self.answered = Outbox(HOLDER), list[float]()
        network, waits = self.run.network, list[float]()
        self.waits, accepted = waits, self.run.recorder.on_accepted

        def note(command: Accepted) -> None:
            waits.append(command.time - command.arrived - SERVICE)
            accepted(command)

        self.run.recorder.on_accepted = note  # type: ignore[method-assign]
        self.control = Requester(network, HOLDER, ROBOT, 9.0)
        self.commands = Requester(
            network, HOLDER, ROBOT, 9.0, 3, 8 if pattern == "pipelined" else 1
        )
        self.emergency = Requester(network, id_of("guard", 1), ROBOT, 9.0)
        self.published = pattern in ("pub-sub", "latest-wins")
        self.session = 0
        self.clock.call_at(1.0, self._ask_for_it)
        self.clock.call_at(2.0, self.start)
        self.clock.every(0.1, self._command, start=3.0)
        self.clock.run(4.0)
        assert self.robot.controller.mode == "Teleoperation"
        self.numbers = itertools.count(1)

    def _ask_for_it(self) -> None:
        def granted(reply: bytes) -> None:
            body = decode(reply).body
            assert isinstance(body, m.Reply)
            assert isinstance(body.content, m.Permission)
            self.session = body.content.session

        asked = self.outbox.encode(DVA, m.PermissionRequest(ROBOT, "both"), self.clock.now)
        Requester(self.run.network, HOLDER, DVA, 9.0).request(asked, granted)

    def start(self) -> None:
        self.control.request(self._says(m.StartTeleOp()), lambda _: None)

    def _says(self, body: m.Body) -> bytes:
        return self.outbox.encode(ROBOT, body, self.clock.now, self.session)

    def _command(self) -> None:
        data = self._says(m.SetTeleOp(0.0, 0.1))
        if self.published:
            self.run.network.publish(HOLDER, command_topic(ROBOT), data, len(data))
        elif not self.commands.busy:
            self.commands.request(data, lambda _: None)

    def flood(self, senders: int, source: str, body: m.Body, lasts: float = 0.6) -> None:
        """Strangers send so, 25 a second each, over connections that are new."""
        service, begun = self.run.network.service(ROBOT), self.clock.now
        assert service is not None
        for sender in range(senders):
            peer = next(self.numbers)
            outbox = Outbox(source or f"02:00:00:0F:{peer >> 8:02X}:{peer & 255:02X}")
            session = 77 << 32 if source == HOLDER else 0

            def say(peer: int = peer, outbox: Outbox = outbox, session: int = session) -> bool:
                data = outbox.encode(ROBOT, body, self.clock.now, session)
                service(Request(data, lambda _: None, peer=peer))
                return self.clock.now < begun + lasts - 0.1

            self.clock.every(0.04, say, start=begun + 0.001 * sender)
        self.clock.run(begun + lasts)

    def cry(self) -> None:
        """An emergency, whose answer is timed."""
        begun = self.clock.now
        data = Outbox(id_of("guard", 1)).encode(ROBOT, m.Emergency(), begun)
        self.emergency.request(data, lambda _: self.answered.append(self.clock.now - begun))


@pytest.mark.invariant("S10")
@pytest.mark.parametrize("pattern", ["req-rep", "pipelined", "pub-sub"])
def test_no_valid_message_of_strangers_keeps_the_holder_waiting(pattern):
    """The holder's command waits for one message of others, whatever they send, however many."""
    driven = Driven(pattern)
    for source, body in FLOODS:
        for senders in SENDERS:
            applied = len(driven.waits)
            driven.flood(senders, source, body)
            assert driven.robot.controller.mode == "Teleoperation", body
            assert len(driven.waits) - applied >= 2, (senders, body)
    assert max(driven.waits) < SERVICE + 1e-4
    assert driven.robot.controller.grant is not None
    assert not driven.run.recorder.violations


def test_what_only_the_holder_may_say_costs_a_robot_that_is_driven_nothing():
    driven = Driven("req-rep")
    for body in (*HOLDERS, *DVAS):
        driven.flood(20, "", body)
    driven.flood(20, HOLDER, m.SetTeleOp(0.5, 0.0))
    assert max(driven.waits) < 1e-4


@pytest.mark.parametrize("body", [body for _, body in FLOODS[:1]] + [m.Emergency()])
def test_no_flood_holds_up_an_emergency_and_none_outlasts_it(body):
    driven = Driven("pub-sub")
    for senders in SENDERS:
        cries = [0.1 + 0.1537 * number for number in range(3)]
        for cry in cries:
            driven.clock.call_after(cry, driven.cry)
        driven.flood(senders, "", body)
        assert len(driven.answered) == len(cries)
        driven.clock.run(driven.clock.now + 0.5)
        driven.start()
        driven.clock.run(driven.clock.now + 0.5)
        assert driven.robot.controller.mode == "Teleoperation"
        driven.answered.clear()
    longest = max(driven.emergency.round_trips) - min(driven.emergency.round_trips)
    assert longest < SERVICE + 1e-3  # of which one service is its own


def test_more_than_a_few_waiting_messages_of_a_connection_are_answered_busy():
    driven, reported = Driven("req-rep"), list[m.Body]()
    service = driven.run.network.service(ROBOT)
    assert service is not None
    outbox = Outbox("02:00:00:0F:00:01")
    for _ in range(200):
        data = outbox.encode(ROBOT, m.GetSensorInfo(), driven.clock.now)
        service(Request(data, lambda reply: reported.append(decode(reply).body), peer="one"))
    driven.clock.run(driven.clock.now + 5.0)
    codes = Counter(reply.code for reply in reported if isinstance(reply, m.Reply))
    assert codes[m.OK] in (PER_CONNECTION, PER_CONNECTION + 1)
    assert codes[m.BUSY] == Nuisances.UNANSWERED + 1
    counted = driven.run.recorder.counters
    busy, unread = (
        counted["refused: busy"],
        counted["refused unread: of a peer that sends no messages"],
    )
    assert busy + unread + codes[m.OK] == 200
