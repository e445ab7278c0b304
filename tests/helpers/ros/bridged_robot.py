"""A robot of ROS with a DVA that confirms what a test wants, on one clock."""

from dataclasses import replace

from helpers.dva.permissions import confirmation
from helpers.processes.patience import Patient
from helpers.ros.ros_machine import RosMachine

from dva_sim.kernel.recorder import Recorder
from dva_sim.live.ros_robot import make_stage, scenario_of
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import RobotOptions
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.ros.profile import RosProfile
from dva_sim.ros.robot import RosRobot
from dva_sim.ros.websocket import WebSocketUrl
from dva_sim.simulation.full.stage import DVA

ANA, SESSION = "02:00:00:00:00:77", 5


class BridgedRobot(Patient):
    """The robot, its machine, and the DVA.

    Attributes:
        heard: Requests that the DVA has received.
        statuses: Status messages that the robot has published.
    """

    def __init__(self, machine: RosMachine, profile: RosProfile | None = None) -> None:
        self.machine, profile = machine, profile or RosProfile()
        options = RobotOptions(ros=machine.url, set=("request.timeout_s=0.3",))
        self.clock, self.recorder = LiveClock(), Recorder()
        self.network, self.dva = SocketNetwork(self.clock), SocketNetwork(self.clock)
        stage = make_stage(
            options, scenario_of(options, profile), self.network, self.recorder, None
        )
        self.robot = RosRobot(
            stage, 1, profile, WebSocketUrl(machine.url, "--ros"), options.namespace
        )
        self.agent, self.id_tag = self.robot.agent, self.robot.agent.device.id_tag
        self.network.introduce(DVA, self.dva.join(DVA))
        self.dva.serve(DVA, self._answer)
        self.dva.introduce(self.id_tag, self.agent.device.address)
        self.heard, self.statuses, self._count = [], [], 0
        self.dva.subscribe(DVA, self.id_tag, "status|", self._note)
        self._grant = None
        self.robot.begin()

    def _note(self, data: bytes) -> None:
        self.statuses.append(decode(data).body)

    def _answer(self, request) -> None:
        message = decode(request.data)
        self.heard.append(message.body)
        reply = m.Reply(message.message_id, m.OK, "")
        if isinstance(message.body, m.RobotEmergency):  # as a DVA of before version 1.7
            reply = m.Reply(message.message_id, m.NOT_SUPPORTED, "not for the DVA")
        if isinstance(message.body, m.GetGrant):
            reply = replace(confirmation(self._grant), answers=message.message_id)
        request.answer(encode(m.Message(message.source, 1, DVA, "12:00:00", 0, reply)))

    def ask(self, body, source: str = ANA) -> m.Reply:
        """Send the robot a request: the reply."""
        got, session = [], SESSION if source == ANA else 0
        self._count += 1
        message = m.Message(self.id_tag, self._count, source, "12:00:00", session, body)
        wire = self.dva.connect(DVA, self.id_tag, lambda _, data: got.append(data), False)
        wire.send(1, encode(message))
        self.until(lambda: got)
        wire.close()
        return decode(got[0]).body

    def ready(self) -> None:
        """Wait until it is registered, and give Ana the permission to drive it."""
        self.until(lambda: any(isinstance(each, m.Registration) for each in self.heard))
        grant = m.PermissionGrant(ANA, "teleoperation", SESSION, "127.0.0.1:9", ())
        self._grant = grant
        assert self.ask(grant, source=DVA).code == m.OK
        self.until(lambda: self.agent.controller.grant is not None)

    def start(self) -> None:
        assert self.ask(m.StartTeleOp()).code == m.OK

    def drive(self, speed: float = 0.3, turn_rate: float = 0.0) -> m.Reply:
        tick = self.agent.controller.tick(self.clock.now)
        return self.ask(m.SetTeleOp(speed, turn_rate, tick))

    @property
    def story(self) -> list[str]:
        return [moment.what for moment in self.recorder.timeline]

    def close(self) -> None:
        self.robot.close()
        self.network.close()
        self.dva.close()
