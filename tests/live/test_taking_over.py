"""Robots taken over and released, sensors that the DVA heeds: in virtual time and over sockets."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.network.scripted_session import OPERATOR, PATIENT, ROBOT, _quick_network
from helpers.network.scripted_session import Scene as AnyScene

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.operator.scripted import Ask, Pause, Script, ScriptedOperator
from dva_sim.core.events import State
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.keys import KeyRing, create_keys
from dva_sim.network.messaging import Transport
from dva_sim.network.real_network import RealNetwork
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.stage import DVA, Stage, id_of

pytestmark = pytest.mark.system

SUPERVISOR, OTHER = id_of("operator", 2), id_of("operator", 3)
ROOM = id_of("control-room", 1)
SHOWS_SMOKE = {"robot.sensors": [{"name": "smoke", "low": 0.5}], "dva.sensors": ["smoke"]}


@pytest.fixture(params=["virtual", "sockets", "sockets with keys"])
def network(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Transport]:
    if request.param == "virtual":
        yield _quick_network()
        return
    ring = None
    if request.param == "sockets with keys":
        devices = [DVA, ROBOT, OPERATOR, SUPERVISOR, OTHER, id_of("detector", 1), ROOM]
        create_keys(tmp_path, devices)
        ring = KeyRing(tmp_path)
    live = SocketNetwork(LiveClock(), ring)
    yield live
    live.close()


class Scene(AnyScene):
    """One where nothing happens for long."""

    def __init__(self, network: Transport, **changes: object) -> None:
        quiet = {"events": [{"kind": "fire", "at_s": 5000}], "operator.count": 3}
        quiet |= {"dva.supervisors": ["operator-2"]}
        scenario = scenarios.build(scenarios.load("drive-to-event"), PATIENT | quiet | changes)
        stage = Stage(scenario, 1, network, Recorder())
        if isinstance(network, RealNetwork):
            stage.address = lambda kind, number: network.join(id_of(kind, number))
        super().__init__(stage)


def request(takeover: str | None) -> Ask:
    return Ask(DVA, m.PermissionRequest(ROBOT, "teleoperation", (), takeover))


def until_granted(takeover: str | None, heard: list[m.Reply]) -> Script:
    """Ask until the robot is given; the last reply of each kind is noted."""
    while True:
        reply = yield request(takeover)
        assert reply is not None
        heard.append(reply)
        if isinstance(reply.content, m.Permission):
            return
        yield Pause(0.2)


def drives_until_refused(heard: list[m.Reply]) -> Callable[[ScriptedOperator], Script]:
    """Drives round and round until a command is refused, which is heard."""

    def script(_: ScriptedOperator) -> Script:
        yield from until_granted(None, heard)
        session = session_of(heard)
        yield from starts(session)
        reply = yield Ask(ROBOT, m.SetTeleOp(0.3, 0.3), session)
        while reply is not None and reply.code == m.OK:
            yield Pause(0.05)
            reply = yield Ask(ROBOT, m.SetTeleOp(0.3, 0.3), session)
        assert reply is not None
        heard.append(reply)

    return script


def starts(session: int) -> Script:
    reply = yield Ask(ROBOT, m.StartTeleOp(), session)
    while reply is None or reply.code != m.OK:
        yield Pause(0.1)
        reply = yield Ask(ROBOT, m.StartTeleOp(), session)


def session_of(heard: list[m.Reply]) -> int:
    content = heard[-1].content
    assert isinstance(content, m.Permission)
    return content.session


def takes_and_drives(
    takeover: str, heard: list[m.Reply], speeds: list[float], scene: Scene
) -> Callable[[ScriptedOperator], Script]:
    def script(_: ScriptedOperator) -> Script:
        heard.append((yield request("no")) or m.Reply(0, 0, ""))
        yield from until_granted(takeover, heard)
        scene.field.world.advance_to(scene.stage.clock.now)
        speeds.append(scene.robot.body.speed)
        session = session_of(heard)
        yield from starts(session)
        for _ in range(20):
            yield Ask(ROBOT, m.SetTeleOp(0.2, 0.0), session)

    return script


def waits(_: ScriptedOperator) -> Script:
    yield Ask(DVA, m.GetDeviceList())
    yield Pause(1000.0)


def is_moving(scene: Scene) -> bool:
    scene.field.world.advance_to(scene.stage.clock.now)
    return scene.robot.body.speed > 0.2


@pytest.mark.invariant("S2")
def test_a_supervisor_takes_a_moving_robot_over_and_it_stands_in_between(network):
    scene, first, second = Scene(network), list[m.Reply](), list[m.Reply]()
    speeds: list[float] = []
    driver = scene.enters(1, drives_until_refused(first))
    scene.until(lambda: is_moving(scene))
    taker = scene.enters(2, takes_and_drives("force", second, speeds, scene), kind="Remote Control")
    scene.until(lambda: taker.done and driver.done)
    holder = second[0].content
    assert isinstance(holder, m.Holder)
    assert (holder.holder, holder.label) == (OPERATOR, "operator-1")
    assert holder.held_for > 0.0
    assert abs(speeds[0]) < 0.05
    assert first[-1].code in (m.WRONG_MODE, m.NOT_PERMITTED, m.BAD_SESSION)
    kinds = [d.message for d in scene.witness.decisions if d.code == m.OK]
    reports = [k for k in kinds if k.startswith("Permission")]
    assert reports == ["PermissionGrant", "PermissionRevocation", "PermissionGrant"]
    assert kinds[-20:] == ["SetTeleOp"] * 20
    assert scene.robot.controller.owner == SUPERVISOR


def test_who_is_no_supervisor_is_refused_and_whoever_is_asked_may_decline(network):
    scene, first, second = Scene(network), list[m.Reply](), list[m.Reply]()

    def asks(_: ScriptedOperator) -> Script:
        for takeover in ("force", "ask", "ask"):
            second.append((yield request(takeover)) or m.Reply(0, 0, ""))
            yield Pause(0.5)

    scene.enters(1, drives_until_refused(first))
    scene.until(lambda: is_moving(scene))
    asker = scene.enters(3, asks)
    scene.until(lambda: asker.done)
    assert [reply.code for reply in second] == [m.NOT_PERMITTED, m.BUSY, m.BUSY]
    assert "not give" in second[-1].text  # who follows a script gives nothing up
    assert scene.robot.controller.owner == OPERATOR


def test_a_holder_that_agrees_gives_its_robot_up(network):
    scene, first, second = Scene(network), list[m.Reply](), list[m.Reply]()
    speeds: list[float] = []
    driver = scene.enters(1, drives_until_refused(first))
    asked: list[m.HandoverRequest] = []

    def agree(message: m.Message) -> m.Reply:
        if isinstance(message.body, m.HandoverRequest):
            asked.append(message.body)
        return m.Reply(message.message_id, m.OK, "")

    driver.device.serve(agree)
    scene.until(lambda: is_moving(scene))
    taker = scene.enters(3, takes_and_drives("ask", second, speeds, scene))
    scene.until(lambda: taker.done and driver.done)
    assert asked == [m.HandoverRequest(ROBOT, OTHER, "operator-3")]
    assert abs(speeds[0]) < 0.05
    assert scene.robot.controller.owner == OTHER


def test_nobody_plays_the_supervisor_where_the_sender_is_told(network):
    """By a key, or by the broker; else a supervisor is known by its word."""
    scene, first, second = Scene(network), list[m.Reply](), list[m.Reply]()
    scene.enters(1, drives_until_refused(first))
    scene.until(lambda: is_moving(scene))
    honest = scene.enters(2, waits)
    scene.until(lambda: honest.asked)
    impostor = scene.stage.device("operator", 3)
    impostor.outbox.source = SUPERVISOR
    impostor.ask(DVA, request("force").body, second.append)
    scene.until(lambda: second)
    reported = bool(getattr(network, "_ring", None))
    assert second[0].code == (m.NOT_PERMITTED if reported else m.BUSY)
    assert (ROBOT in scene.dva.core.sessions.reserved) is not reported


def test_the_dva_lists_sensors_and_smoke_at_a_robot_is_an_event(network):
    scene, heard = Scene(network, **SHOWS_SMOKE), list[m.Reply]()

    def asks(_: ScriptedOperator) -> Script:
        while True:
            reply = yield Ask(DVA, m.GetSensorInfo())
            assert reply is not None
            heard.append(reply)
            if isinstance(reply.content, m.SensorList) and reply.content.devices:
                return
            yield Pause(0.2)

    asker = scene.enters(1, asks)
    events = scene.dva.core.events
    scene.until(lambda: asker.done and events.total)
    content = heard[-1].content
    assert isinstance(content, m.SensorList)
    (line,) = content.devices
    assert (line.device, line.sensors) == (ROBOT, (m.Sensor("smoke", "1/m"),))
    event = events.get(1)
    assert event is not None
    assert (event.kind, set(event.sources)) == ("fire", {ROBOT})
    here = scene.robot.body.pose()
    at = scene.stage.site.frame.to_xy(event.position.latitude, event.position.longitude)
    assert math.dist(at, (here.x, here.y)) < 0.5


def test_what_a_detector_reports_beside_the_robot_is_confirmed_by_it(network):
    scene = Scene(network, **SHOWS_SMOKE)
    pose = scene.robot.body.pose()
    place = m.Position(*scene.stage.site.frame.to_latlon(pose.x + 3.0, pose.y))
    detector = scene.stage.device("detector", 1)
    report = m.EventReport(None, "fire", place, 0.5, 0.9, "detected")
    detector.register(lambda: detector.ask(DVA, report))
    events = scene.dva.core.events
    scene.until(lambda: events.total and events.get(1).state is State.CONFIRMED)  # type: ignore[union-attr]
    assert events.total == 1
    assert set(events.closed[1].sources) >= {detector.id_tag}
    assert replace(events.closed[1]).position == place


def stops_and_starts_anew(heard: list[m.Reply]) -> Callable[[ScriptedOperator], Script]:
    """Drives, stops the robot by an emergency, and asks for a start until that is granted."""

    def script(_: ScriptedOperator) -> Script:
        granted: list[m.Reply] = []
        yield from until_granted(None, granted)
        session = session_of(granted)
        yield from starts(session)
        yield Ask(ROBOT, m.SetTeleOp(0.3, 0.3), session)
        yield Ask(ROBOT, m.Emergency(), session)
        while not heard or heard[-1].code != m.OK:
            reply = yield Ask(ROBOT, m.StartTeleOp(), session)
            assert reply is not None
            heard.append(reply)
            yield Pause(0.1)

    return script


@pytest.mark.invariant("S3")
def test_an_emergency_holds_until_a_control_room_releases_the_robot(network):
    changes = {"emergency.release": "person", "dva.control_rooms": {"control-room-1": "dispatch"}}
    scene, heard, answers = Scene(network, **changes), list[m.Reply](), list[m.Reply]()
    room = ControlRoomAgent(scene.stage.device("control-room", 1))
    room.start()
    driver = scene.enters(1, stops_and_starts_anew(heard))
    scene.until(lambda: len(heard) > 20)
    assert {reply.code for reply in heard} == {m.BUSY}
    room.ask(m.ReleaseEmergency(ROBOT), answers.append)
    scene.until(lambda: driver.done)
    assert answers[0].code == m.OK
    assert scene.robot.controller.latch.released.device == ROOM
