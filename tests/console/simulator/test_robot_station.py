"""A robot that runs alone, over sockets: off, registered, listening, and off again."""

import time
from dataclasses import replace

import pytest
from helpers.console.declared_lines import checked
from helpers.dva.permissions import confirmation
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.wording import unnamed

from dva_sim.console.robots.robot_station import two_free_ports
from dva_sim.console.simulator.robot_simulator import LoneRobotActions, scenario_of
from dva_sim.console.simulator.robot_world import RobotWorld
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import hints_of
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.realtime import PacedClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import RobotOptions
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.simulation.full.stage import DVA

pytestmark = pytest.mark.system

ANA = "02:00:00:00:00:77"


class Bench:
    """The robot, what it tells pages, and a DVA that says what a test wants it to say."""

    def __init__(self):
        options = RobotOptions(set=("request.timeout_s=0.3",))
        self.world = RobotWorld(scenario_of(options), clock=PacedClock())
        self.lines = []
        self.world.tell = lambda line, key="": self.lines.append(checked(line))
        self.core = LoneRobotActions(self.world)
        self.world.begin()
        self.world.clock.go()
        self.count, self.code, self.heard = 0, m.OK, []
        self.dva = SocketNetwork(self.world.clock)
        self.address = self.dva.join(DVA)
        self.dva.serve(DVA, self.answer)
        self.grant = None

    def answer(self, request):
        message = decode(request.data)
        self.heard.append(message.body)
        reply = m.Reply(message.message_id, self.code, "as wanted")
        if isinstance(message.body, m.GetGrant):
            reply = replace(confirmation(self.grant), answers=message.message_id)
        request.answer(encode(m.Message(message.source, 1, DVA, "12:00:00", 0, reply)))

    def say(self, body, session=0):
        """The DVA, or Ana in its place, sends the robot a request: the reply, or None."""
        self.grant = body if isinstance(body, m.PermissionGrant) else self.grant
        robot, got = self.world.robot.device, []
        self.dva.introduce(robot.id_tag, robot.address)
        self.count += 1
        source = DVA if isinstance(body, m.PermissionGrant) else ANA
        wire = self.dva.connect(DVA, robot.id_tag, lambda _, data: got.append(data), False)
        wire.send(1, encode(m.Message(robot.id_tag, self.count, source, "12:00:00", session, body)))
        self.until(lambda: got, within=1.0, must=False)
        wire.close()
        return decode(got[0]).body if got else None

    def until(self, true, within=PATIENCE_S, must=True):
        end = time.monotonic() + within
        while not true() and time.monotonic() < end:
            self.world.clock.run(self.world.clock.now + 0.02)
        assert true() or not must

    def do(self, what, **about):
        self.count += 1
        number = f"a{self.count}"
        robot = {"robot": 0} if "robot" in hints_of(ACTIONS[what].arguments) else {}
        self.core.take({"id": number, "client": "c1", "do": what, **robot, **about})

        def answers():
            return [one for one in self.lines if one["k"] == "done" and one["id"] == number]

        self.until(answers)
        return answers()[0]["ok"], answers()[0]["text"]

    @property
    def state(self):
        return self.world.station.line()["state"]

    def close(self):
        self.dva.close()
        self.world.close()


@pytest.fixture
def bench():
    bench = Bench()
    yield bench
    bench.close()


def listening(bench):
    # On a busy machine the DVA's answer may be later than the robot waits.
    assert becomes(lambda: bench.do("robot_register", dva=bench.address)[0])
    assert bench.do("robot_listen")[0]
    return bench


def test_nobody_reaches_a_robot_before_it_has_registered_and_opened_its_port(bench):
    assert bench.state == "off"
    assert bench.say(m.GetSensorInfo()) is None
    done, text = bench.do("robot_listen")
    assert (done, unnamed(text, "off", "registered")) == (False, [])
    assert bench.do("robot_register", dva=bench.address)[0]
    assert bench.state == "registered"
    assert bench.heard[0].address == bench.world.robot.device.address
    assert bench.say(m.GetSensorInfo()) is None
    assert bench.do("manual_take")[1].startswith("The robot is registered")
    assert bench.do("robot_listen")[0]
    assert bench.state == "listening"
    assert isinstance(bench.say(m.GetSensorInfo()).content, m.SensorInfo)


def test_a_dva_that_refuses_is_told_in_its_words_and_the_robot_stays_off(bench):
    bench.code = m.NOT_PERMITTED
    ok, text = bench.do("robot_register", dva=bench.address)
    assert not ok
    assert "as wanted" in text
    assert bench.state == "off"
    bench.code = m.OK
    assert bench.do("robot_register", dva=bench.address)[0]


def test_a_dva_that_is_not_there_is_told_with_its_address(bench):
    nobody = f"127.0.0.1:{two_free_ports('127.0.0.1')}"
    done, text = bench.do("robot_register", dva=nobody)
    assert (done, unnamed(text, nobody, "0.9 s")) == (False, [])
    assert not bench.do("robot_register", dva="nowhere")[0]
    assert bench.state == "off"


def test_a_robot_that_is_switched_off_is_silent_and_may_come_back_elsewhere(bench):
    listening(bench)
    assert bench.do("robot_off")[0]
    assert bench.state == "off"
    count = len(bench.heard)
    assert bench.say(m.GetSensorInfo()) is None
    assert len(bench.heard) == count
    listening(bench)
    assert bench.say(m.GetSensorInfo()).code == m.OK


def test_whoever_holds_it_drives_it_and_its_own_button_stops_it_without_a_broken_rule(bench):
    listening(bench)
    assert bench.say(m.PermissionGrant(ANA, "both", 1 << 33)).code == m.OK
    assert bench.say(m.StartTeleOp(), 1 << 33).code == m.OK
    assert bench.say(m.SetTeleOp(0.4, 0.0, None), 1 << 33).code == m.OK
    bench.until(lambda: bench.world.robot.body.speed > 0.2)
    assert bench.do("emergency")[0]
    bench.until(lambda: abs(bench.world.robot.body.speed) < 0.01)
    assert bench.say(m.SetTeleOp(0.4, 0.0, None), 1 << 33).code == m.WRONG_MODE
    assert bench.do("manual_take")[0] is False  # somebody still holds it
    assert bench.say(m.StartTeleOp(), 1 << 33).code == m.BUSY
    assert bench.do("robot_release", robot=0)[0]
    assert bench.do("robot_release", robot=0)[0] is False
    assert bench.say(m.StartTeleOp(), 1 << 33).code == m.OK
    assert not bench.world.recorder.violations


def test_what_no_robot_knows_is_refused(bench):
    done, text = bench.do("take")
    assert (done, "'take'" in text) == (False, True)


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (RobotOptions(dva="x"), "--dva 'x' .* HOST:PORT"),
        (RobotOptions(profile="pibott"), "did you mean 'pibot'"),
        (RobotOptions(set=("robot.nose=1",)), "nose"),
    ],
)
def test_what_is_asked_for_wrongly_is_told_in_a_line(options, why):
    with pytest.raises(ConfigError, match=why):
        scenario_of(options)
